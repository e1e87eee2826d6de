//! Eight designs in groups of four against one after another: seconds of a design, in turns.
//!
//! `cargo bench --bench together -- [--refine N] MESH`: a mesh of tets with a family `wing`,
//! refined N times, on the CPU. Without a mesh the example's, refined once. Its surfaces pitch by 3
//! to 10 degrees, but for families `symmetry` and `farfield`. `RAYON_NUM_THREADS` limits the CPU's
//! threads.

mod common;

use std::{path::PathBuf, process::ExitCode, time::Instant};

use common::{Failure, median, print_machine, print_table, row};
use glam::DQuat;
use idmesh::{
    backend::{self, Selection},
    families::Role,
    formats,
    mesh::{self, HybridMesh, OtherCells},
    mover::{Design, Mover, Outcome},
};

/// Designs, and rounds of all of them.
const DESIGNS: u32 = 8;
const ROUNDS: usize = 3;

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let (mut path, mut refinements) = (None, None);
    let mut words = arguments.iter();
    while let Some(word) = words.next() {
        match word.as_str() {
            "--refine" => refinements = Some(words.next().ok_or("--refine needs a number")?.parse::<usize>()?),
            mesh => path = Some(PathBuf::from(mesh)),
        }
    }
    let refinements = refinements.unwrap_or(usize::from(path.is_none()));
    let path = path.unwrap_or_else(|| common::root().join("examples/wing-body/wing-body.msh.gz"));
    let mut mesh = formats::read(&path)?.mesh;
    for _ in 0..refinements {
        mesh = mesh::refine_hybrid(HybridMesh { mesh: &mesh, others: &OtherCells::default() })?.0;
    }
    let role = |family: &String| match family.as_str() {
        "farfield" => Role::Fixed,
        "symmetry" => Role::PLANE,
        _ => Role::Prescribed,
    };
    let mut builder = Mover::builder(mesh.clone());
    for family in &mesh.families {
        builder = builder.role(family, role(family));
    }
    let cpu = backend::select(Selection::Cpu)?;
    print_machine(&[cpu.info()]);
    let mut mover = builder.build(cpu)?;
    let wing = mover.family_vertices("wing").ok_or("the mesh has no family `wing`")?;
    let pivot = mesh.vertices[wing[0] as usize];
    let pitched = |degrees: u32| {
        let turn = DQuat::from_rotation_y(f64::from(degrees).to_radians());
        let mut design = Design::default();
        for name in mesh.families.iter().filter(|family| role(family) == Role::Prescribed) {
            let from = |vertex: &u32| mesh.vertices[*vertex as usize] - pivot;
            let vertices = mover.family_vertices(name).into_iter().flatten();
            design.prescribed.insert(name.clone(), vertices.map(|vertex| turn * from(vertex) - from(vertex)).collect());
        }
        design
    };
    let designs: Vec<Design> = (3..3 + DESIGNS).map(pitched).collect();
    let designs: Vec<&Design> = designs.iter().collect();
    let (mut alone, mut together, mut cycles) = (Vec::new(), Vec::new(), Vec::new());
    for round in 0..=ROUNDS {
        let start = Instant::now();
        let one_by_one = designs.iter().map(|design| mover.update(design));
        let one_by_one = one_by_one.collect::<Result<Vec<Outcome>, _>>()?;
        let of_alone = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let at_once = mover.update_many(&designs).into_iter().collect::<Result<Vec<Outcome>, _>>()?;
        let of_together = start.elapsed().as_secs_f64();
        for (one, other) in one_by_one.iter().zip(&at_once) {
            if one.even_if_invalid() != other.even_if_invalid() || one.inverted > 0 || !one.converged {
                return Err("the designs did not come out well and alike, so their times mean nothing".into());
            }
        }
        // The first round is not counted.
        if round > 0 {
            alone.push(of_alone / f64::from(DESIGNS));
            together.push(of_together / f64::from(DESIGNS));
        }
        cycles = at_once.iter().map(|outcome| outcome.solver.sweeps).collect();
    }
    let (alone, together) = (median(alone), median(together));
    print_table(&[
        row(&["tets", "alone s", "together s", "ratio", "cycles"]),
        vec![
            mesh.tets.len().to_string(),
            format!("{alone:.4}"),
            format!("{together:.4}"),
            format!("{:.2}", together / alone),
            cycles.iter().map(usize::to_string).collect::<Vec<_>>().join(" "),
        ],
    ]);
    Ok(())
}
