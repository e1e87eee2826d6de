//! Set-up and solution of a mesh's spring network by each method: where `auto` changes from one to
//! the other.
//!
//! `cargo bench --bench relaxation -- [MESH ...]`: meshes with a family `wing`, which pitches while
//! all others are held; without any, bricks whose top is twisted and the wing of the tests. CPU,
//! f64; `RAYON_NUM_THREADS` limits its threads. `--system FOLDER` writes the last mesh's linear
//! system there, which `benches/peers.py` solves with other programs.

mod common;

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
    time::Instant,
};

use common::{
    Failure, brick, median,
    network::{Edges, in_order},
    print_machine, print_table, row,
};
use glam::DVec3;
use idmesh::{
    backend::{Backend, CpuBackend, Precision},
    constraint::Constraint,
    formats,
    mesh::TetMesh,
    relaxation::{Convergence, FreeRows, Method, Network, Relaxer, Stopping},
};

/// Repetitions a figure is the median of.
const REPEATS: usize = 9;

/// Above so many tets one repetition is enough.
const LARGE: usize = 1_000_000;

/// Sides of the bricks.
const BRICKS: [usize; 6] = [10, 15, 20, 25, 35, 50];

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let backend = CpuBackend::new(Precision::F64);
    print_machine(&[backend.info()]);
    let mut files: Vec<PathBuf> = Vec::new();
    let mut system: Option<PathBuf> = None;
    let mut words = std::env::args().skip(1).filter(|word| word != "--bench");
    while let Some(word) = words.next() {
        match word.as_str() {
            "--system" => system = Some(words.next().ok_or("--system needs a folder")?.into()),
            file => files.push(file.into()),
        }
    }
    let mut rows =
        vec![row(&["mesh", "tets", "method", "set-up ms", "sweeps", "solve ms", "both ms", "residual", "to 1e-6"])];
    if files.is_empty() {
        files.push(common::root().join("tests/data/pitch-wing.msh.gz"));
        for n in BRICKS {
            let (points, tets, on_boundary) = brick(n);
            let twist = |at: &DVec3| DVec3::Z.cross(*at - DVec3::splat(0.5 * n as f64)) * (at.z / n as f64);
            let start = points.iter().zip(&on_boundary).map(|(at, &held)| if held { twist(at) } else { DVec3::ZERO });
            let start = start.collect();
            let name = format!("brick {n}");
            let constraint = on_boundary.iter().map(|&held| if held { Constraint::Held } else { Constraint::Free });
            let network = Edges::new(&points, &tets).network(&backend, constraint.collect())?;
            rows.extend(measure(&backend, &name, tets.len(), &network, start)?);
        }
    }
    for file in files {
        let mesh = in_order(&formats::read(&file)?.mesh);
        let (constraint, start) = pitched_wing(&mesh)?;
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let network = Edges::new(&mesh.vertices, &mesh.tets).network(&backend, constraint)?;
        if let Some(folder) = &system {
            write_system(&backend, folder, &network, &start)?;
        }
        rows.extend(measure(&backend, &name, mesh.tets.len(), &network, start)?);
    }
    print_table(&rows);
    Ok(())
}

/// Every surface vertex held, those of the wing pitched by 10 degrees about the quarter chord and
/// their tips lifted by 0.2 chords.
fn pitched_wing(mesh: &TetMesh) -> Result<(Vec<Constraint>, Vec<DVec3>), Failure> {
    let wing = mesh.family("wing").ok_or("the mesh has no family `wing`")?;
    let of_wing = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|&(_, &family)| family == wing);
    let of_wing: BTreeSet<u32> = of_wing.flat_map(|(triangle, _)| *triangle).collect();
    let points = || of_wing.iter().map(|&vertex| mesh.vertices[vertex as usize]);
    let low = points().reduce(DVec3::min).ok_or("the wing has no vertices")?;
    let high = points().reduce(DVec3::max).ok_or("the wing has no vertices")?;
    let (size, middle) = (high - low, 0.5 * (low + high));
    let pivot = middle.with_x(low.x + 0.25 * size.x);
    let turn = glam::DQuat::from_rotation_y(10f64.to_radians());
    let mut constraint = vec![Constraint::Free; mesh.vertices.len()];
    let mut start = vec![DVec3::ZERO; mesh.vertices.len()];
    mesh.triangles.iter().flatten().for_each(|&vertex| constraint[vertex as usize] = Constraint::Held);
    for &vertex in &of_wing {
        let at = mesh.vertices[vertex as usize];
        let lift = 0.2 * size.x * (2.0 * (at.y - middle.y) / size.y).powi(2);
        start[vertex as usize] = pivot + turn * (at - pivot) - at + DVec3::Z * lift;
    }
    Ok((constraint, start))
}

/// Writes the linear system of a network and its solution as raw numbers, for others to solve:
/// `row_start` and `columns` (u32) with `stiffness` (f64) of each entry, and for each vertex that
/// moves `anchor`, `load` (three), `solution` (three) and `inverse_length` (f64). The matrix is the
/// diagonal of stiffness and anchor of each row less the stiffness.
fn write_system(backend: &CpuBackend, folder: &Path, network: &Network, start: &[DVec3]) -> Result<(), Failure> {
    let mut exact = start.to_vec();
    let stopping = Stopping { tolerance: 1e-10, ..Stopping::default() };
    if !Relaxer::new(network.clone(), backend, Method::Multigrid)?.relax(&mut exact, None, &stopping)?.converged {
        return Err("the system was not solved".into());
    }
    let residual = network.residual(start, None);
    let FreeRows { network: moving, vertices } = FreeRows::new(network);
    let flat = |of: &dyn Fn(usize) -> DVec3| -> Vec<f64> {
        vertices.iter().flat_map(|&vertex| of(vertex as usize).to_array()).collect()
    };
    let total = |row: usize| moving.stiffness[moving.graph.range(row)].iter().sum::<f64>() + moving.anchor[row];
    let totals: Vec<f64> = (0..moving.len()).map(total).collect();
    let mut load = flat(&|vertex| residual[vertex]);
    load.chunks_mut(3).zip(&totals).for_each(|(load, total)| load.iter_mut().for_each(|part| *part *= total));
    fs::create_dir_all(folder)?;
    fs::write(folder.join("row_start"), bytemuck::cast_slice(&moving.graph.row_start))?;
    fs::write(folder.join("columns"), bytemuck::cast_slice(&moving.graph.entries))?;
    fs::write(folder.join("stiffness"), bytemuck::cast_slice(&moving.stiffness))?;
    fs::write(folder.join("anchor"), bytemuck::cast_slice(&moving.anchor))?;
    fs::write(folder.join("load"), bytemuck::cast_slice(&load))?;
    fs::write(folder.join("solution"), bytemuck::cast_slice(&flat(&|vertex| exact[vertex] - start[vertex])))?;
    fs::write(folder.join("inverse_length"), bytemuck::cast_slice(&moving.inverse_length))?;
    Ok(())
}

/// Sweeps until the residual is this fraction of the first one.
fn sweeps_to(fraction: f64, relaxer: &mut Relaxer, start: &[DVec3]) -> Result<usize, Failure> {
    let mut most = [0, 1];
    let mut reaches = |max_sweeps: usize| -> Result<bool, Failure> {
        let stopping = Stopping { tolerance: 0.0, max_sweeps };
        Ok(relaxer.relax(&mut start.to_vec(), None, &stopping)?.relative_residual <= fraction)
    };
    // A number that is enough, then the least one, between the last two tried.
    while !reaches(most[1])? {
        most = [most[1], 2 * most[1]];
    }
    while most[1] - most[0] > 1 {
        let middle = most[0].midpoint(most[1]);
        if reaches(middle)? { most[1] = middle } else { most[0] = middle }
    }
    Ok(most[1])
}

fn measure(
    backend: &CpuBackend,
    name: &str,
    n_tets: usize,
    network: &Network,
    start: Vec<DVec3>,
) -> Result<Vec<Vec<String>>, Failure> {
    let mut rows = Vec::new();
    for method in [Method::Chebyshev, Method::Multigrid] {
        let (mut set_ups, mut solutions) = (Vec::new(), Vec::new());
        let mut end = Convergence::default();
        let repeats = if n_tets > LARGE { 1 } else { REPEATS };
        for _ in 0..repeats {
            let network = network.clone();
            let begin = Instant::now();
            let mut relaxer = Relaxer::new(network, backend, method)?;
            set_ups.push(begin.elapsed().as_secs_f64());
            let mut displacement = start.clone();
            let begin = Instant::now();
            end = relaxer.relax(&mut displacement, None, &Stopping::default())?;
            solutions.push(begin.elapsed().as_secs_f64());
            if !end.converged {
                return Err(format!("{name}: {} did not converge", method.name()).into());
            }
        }
        let (set_up, solution) = (1e3 * median(set_ups), 1e3 * median(solutions));
        rows.push(vec![
            name.to_owned(),
            n_tets.to_string(),
            method.name().to_owned(),
            format!("{set_up:.2}"),
            end.sweeps.to_string(),
            format!("{solution:.2}"),
            format!("{:.2}", set_up + solution),
            format!("{:.1e}", end.relative_residual),
            match method {
                Method::Multigrid => {
                    sweeps_to(1e-6, &mut Relaxer::new(network.clone(), backend, method)?, &start)?.to_string()
                }
                _ => String::new(),
            },
        ]);
    }
    Ok(rows)
}
