//! Forward and reverse products with the derivative of an outcome: seconds of each against the
//! volume stage of an update, and the bytes that an outcome keeps for them.
//!
//! `cargo bench --bench products -- [FILES]`: meshes with a family `wing`, which pitches by 10
//! degrees, and cases (`.toml`) with all of their stages; the wing of the tests and the example if
//! none is named. On the CPU; `RAYON_NUM_THREADS` limits its threads.

mod common;

use std::{
    cell::Cell,
    path::{Path, PathBuf},
    process::ExitCode,
    time::{Duration, Instant},
};

use common::{Failure, median, print_machine, print_table, root, row};
use glam::{DQuat, DVec3};
use idmesh::{
    backend::{self, Selection},
    case::Case,
    families::Role,
    formats,
    mover::{Derivative, Design, Mover},
    relaxation::Stopping,
};

/// Runs of which the median is taken.
const RUNS: usize = 9;

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    print_machine(&[backend::select(Selection::Cpu)?.info()]);
    let arguments: Vec<PathBuf> =
        std::env::args().skip(1).filter(|argument| argument != "--bench").map(PathBuf::from).collect();
    let own = || ["tests/data/pitch-wing.msh.gz", "examples/wing-body/case.toml"].map(|file| root().join(file)).into();
    let files = if arguments.is_empty() { own() } else { arguments };
    let mut rows = vec![row(&[
        "mesh or case",
        "tolerance",
        "update ms",
        "volume ms",
        "forward ms",
        "reverse ms",
        "forward / volume",
        "reverse / volume",
        "kept, bytes a vertex",
    ])];
    for file in files {
        for tolerance in [1e-4, 1e-8, 1e-12] {
            let is_case = file.extension().is_some_and(|extension| extension == "toml");
            let (mover, design) = if is_case { of_case(&file, tolerance)? } else { pitching(&file, tolerance)? };
            rows.push([vec![file.display().to_string()], costs(mover, &design, tolerance)?].concat());
        }
    }
    print_table(&rows);
    Ok(())
}

/// A case and its design, without local optimisation and with one step, which have derivatives.
fn of_case(file: &Path, tolerance: f64) -> Result<(Mover, Design), Failure> {
    let case = Case::load(file)?;
    let builder = case.builder().stopping(Stopping { tolerance, ..Stopping::default() });
    Ok((builder.quality(None).max_steps(1).build(backend::select(Selection::Cpu)?)?, case.design))
}

/// A wing between a far field and planes, and its pitch by 10 degrees.
fn pitching(file: &Path, tolerance: f64) -> Result<(Mover, Design), Failure> {
    let mesh = formats::read(file)?.mesh;
    let role = |family: &str| match family {
        "farfield" => Role::Fixed,
        "symmetry" => Role::PLANE,
        _ => Role::Prescribed,
    };
    let mut builder = Mover::builder(mesh.clone()).stopping(Stopping { tolerance, ..Stopping::default() });
    for family in &mesh.families {
        builder = builder.role(family, role(family));
    }
    let mover = builder.quality(None).max_steps(1).build(backend::select(Selection::Cpu)?)?;
    let turn = DQuat::from_rotation_y(10f64.to_radians());
    let mut design = Design::default();
    for family in mesh.families.iter().filter(|family| role(family) == Role::Prescribed) {
        let vertices = mover.family_vertices(family).into_iter().flatten();
        let by = |&vertex: &u32| turn * mesh.vertices[vertex as usize] - mesh.vertices[vertex as usize];
        design.prescribed.insert(family.clone(), vertices.map(by).collect());
    }
    Ok((mover, design))
}

/// The cells of a line of the table after the first.
fn costs(mut mover: Mover, design: &Design, tolerance: f64) -> Result<Vec<String>, Failure> {
    let seed: Vec<DVec3> = mover.mesh().vertices.iter().map(|at| DVec3::new(at.z.sin(), at.x.cos(), at.y)).collect();
    let mut times: [Vec<f64>; 4] = Default::default();
    let (mut kept, n_vertices) = (0, mover.mesh().vertices.len());
    for _ in 0..RUNS {
        let (start, last) = (Instant::now(), Cell::new(Instant::now()));
        let mut volume = Duration::ZERO;
        // The volume is the last stage.
        let outcome = mover.update_amended(design, &mut |_, _| volume = last.replace(Instant::now()).elapsed())?;
        let update = start.elapsed();
        if !outcome.converged {
            return Err("an update did not converge, so its times mean nothing".into());
        }
        kept = outcome.bytes_for_products();
        let start = Instant::now();
        mover.forward(&outcome, design, Derivative::Exact)?;
        let forward = start.elapsed();
        let start = Instant::now();
        mover.reverse(&outcome, &seed, Derivative::Exact)?;
        let reverse = start.elapsed();
        for (times, time) in times.iter_mut().zip([update, volume, forward, reverse]) {
            times.push(1e3 * time.as_secs_f64());
        }
    }
    let [update, volume, forward, reverse] = times.map(median);
    let mut cells = vec![format!("{tolerance:e}")];
    cells.extend([update, volume, forward, reverse].map(|time| format!("{time:.1}")));
    cells.extend([forward / volume, reverse / volume].map(|ratio| format!("{ratio:.2}")));
    cells.push(format!("{:.1}", kept as f64 / n_vertices as f64));
    Ok(cells)
}
