//! Set-up and solution of a mesh's spring network by each method: where `auto` changes from one to the other.
//!
//! `cargo bench --bench relaxation -- [MESH ...]`: meshes with a family `wing`, which turns by 0.5 rad while all others are held;
//! without any, bricks whose top is twisted and the wing of the tests. CPU, f64; `RAYON_NUM_THREADS` limits its threads.

mod common;

use std::{path::PathBuf, process::ExitCode, time::Instant};

use common::{Failure, brick, median, network::Edges, print_machine, print_table, row};
use glam::DVec3;
use idmesh::{
    backend::{Backend, Constraint, CpuBackend, Precision},
    formats,
    mesh::TetMesh,
    relaxation::{Accuracy, Method, Network, Relaxer},
};

/// Repetitions a figure is the median of.
const REPEATS: usize = 9;

/// Sides of the bricks.
const BRICKS: [usize; 6] = [10, 15, 20, 25, 35, 50];

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let backend = CpuBackend::new(Precision::F64);
    print_machine(&[backend.info()]);
    let mut files: Vec<PathBuf> =
        std::env::args().skip(1).filter(|word| word != "--bench").map(PathBuf::from).collect();
    let mut rows = vec![row(&["mesh", "tets", "method", "set-up ms", "sweeps", "solve ms", "both ms"])];
    if files.is_empty() {
        files.push(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/pitch-wing.msh.gz"));
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
        let mesh = formats::read(&file)?.mesh;
        let (constraint, start) = turned_wing(&mesh)?;
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let network = Edges::new(&mesh.vertices, &mesh.tets).network(&backend, constraint)?;
        rows.extend(measure(&backend, &name, mesh.tets.len(), &network, start)?);
    }
    print_table(&rows);
    Ok(())
}

/// Every surface vertex held, those of the wing turned by 0.5 rad about y.
fn turned_wing(mesh: &TetMesh) -> Result<(Vec<Constraint>, Vec<DVec3>), Failure> {
    let wing = mesh.family("wing").ok_or("the mesh has no family `wing`")?;
    let mut constraint = vec![Constraint::Free; mesh.vertices.len()];
    let mut start = vec![DVec3::ZERO; mesh.vertices.len()];
    let turn = glam::DQuat::from_rotation_y(0.5);
    for (triangle, family) in mesh.triangles.iter().zip(&mesh.triangle_family) {
        for &vertex in triangle {
            constraint[vertex as usize] = Constraint::Held;
            if *family == wing {
                let at = mesh.vertices[vertex as usize];
                start[vertex as usize] = turn * at - at;
            }
        }
    }
    Ok((constraint, start))
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
        let (mut set_ups, mut solutions, mut sweeps) = (Vec::new(), Vec::new(), 0);
        for _ in 0..REPEATS {
            let network = network.clone();
            let begin = Instant::now();
            let mut relaxer = Relaxer::new(network, backend, method)?;
            set_ups.push(begin.elapsed().as_secs_f64());
            let mut displacement = start.clone();
            let begin = Instant::now();
            let convergence = relaxer.relax(&mut displacement, None, &Accuracy::default())?;
            solutions.push(begin.elapsed().as_secs_f64());
            sweeps = convergence.sweeps;
            if !convergence.converged {
                return Err(format!("{name}: {} did not converge", method.name()).into());
            }
        }
        let (set_up, solution) = (1e3 * median(set_ups), 1e3 * median(solutions));
        rows.push(vec![
            name.to_owned(),
            n_tets.to_string(),
            method.name().to_owned(),
            format!("{set_up:.2}"),
            sweeps.to_string(),
            format!("{solution:.2}"),
            format!("{:.2}", set_up + solution),
        ]);
    }
    Ok(rows)
}
