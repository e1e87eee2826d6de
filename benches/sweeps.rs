//! Vertex-sweeps a second and edges a second: the two kernels that all the arithmetic of the
//! springs goes through.
//!
//! `cargo bench --bench sweeps -- [N | MESH ...]`: bricks of N x N x N cubes, six tets each, and
//! meshes; the example's if none is named. The GPU may be a software adapter; it is named. Where
//! there is none its rows are left out.

mod common;

use std::{path::Path, process::ExitCode};

use common::{
    Failure, brick, example,
    network::{Edges, copy_bandwidth, in_order, seconds, sweep_speed},
    print_machine, print_table, row,
};
use glam::DVec3;
use idmesh::{
    backend::{self, Backend, BackendError, CpuBackend, Precision, Selection},
    constraint::Constraint,
    formats,
    mesh::TetMesh,
    relaxation::FreeRows,
};

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let mut arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    if arguments.is_empty() {
        arguments = ["10", "25", "50", ""].map(str::to_owned).to_vec();
    }
    let mut backends: Vec<(&str, Box<dyn Backend>)> = vec![
        ("CPU f64", Box::new(CpuBackend::new(Precision::F64))),
        ("CPU f32", Box::new(CpuBackend::new(Precision::F32))),
    ];
    match backend::select(Selection::Gpu) {
        Ok(gpu) => backends.push(("GPU f32", gpu)),
        Err(BackendError::NoAdapter(why)) => eprintln!("no rows for a GPU: {why}"),
        Err(error) => return Err(error.into()),
    }
    print_machine(&backends.iter().map(|(_, backend)| backend.info()).collect::<Vec<_>>());

    let copying = copy_bandwidth()?;
    let mut rows = vec![row(&[
        "mesh",
        "moving",
        "edges",
        "backend",
        "ms/sweep",
        "Mvertex-sweeps/s",
        "GB/s",
        "of copying",
        "Medges/s (stiffness)",
    ])];
    for argument in &arguments {
        let Mesh { name, edges, moving } = Mesh::new(argument)?;
        for (of, backend) in &backends {
            let sweep = sweep_speed(&moving, backend.as_ref())?;
            let input = edges.stiffness_input();
            let stiffness = seconds(|| {
                backend.edge_stiffness(&input)?;
                Ok(())
            })?;
            rows.push(vec![
                name.clone(),
                moving.network.len().to_string(),
                edges.len().to_string(),
                (*of).to_owned(),
                format!("{:.4}", 1e3 * sweep.seconds),
                format!("{:.1}", 1e-6 * moving.network.len() as f64 / sweep.seconds),
                format!("{:.1}", 1e-9 * sweep.bandwidth),
                format!("{:.0} %", 100.0 * sweep.bandwidth / copying),
                format!("{:.2}", 1e-6 * edges.len() as f64 / stiffness),
            ]);
        }
    }
    print_table(&rows);
    println!("\ncopying memory: {:.1} GB/s before, {:.1} GB/s after", 1e-9 * copying, 1e-9 * copy_bandwidth()?);
    Ok(())
}

/// A mesh as the springs see it, its boundary held.
struct Mesh {
    name: String,
    edges: Edges,
    moving: FreeRows,
}

impl Mesh {
    /// A brick of cubes of side 1, a mesh file, or, without a name, the example's.
    fn new(argument: &str) -> Result<Self, Failure> {
        if let Ok(n) = argument.parse() {
            let (points, tets, on_boundary) = brick(n);
            return Self::of(format!("brick {n}"), &points, &tets, &on_boundary);
        }
        let (name, mesh): (String, TetMesh) = if argument.is_empty() {
            ("wing-body".to_owned(), example()?.file.mesh)
        } else {
            let path = Path::new(argument);
            (path.file_name().unwrap_or_default().to_string_lossy().into_owned(), formats::read(path)?.mesh)
        };
        let mesh = in_order(&mesh);
        let mut on_boundary = vec![false; mesh.vertices.len()];
        mesh.triangles.iter().flatten().for_each(|&vertex| on_boundary[vertex as usize] = true);
        Self::of(name, &mesh.vertices, &mesh.tets, &on_boundary)
    }

    fn of(name: String, points: &[DVec3], tets: &[[u32; 4]], on_boundary: &[bool]) -> Result<Self, Failure> {
        let edges = Edges::new(points, tets);
        let constraint = on_boundary.iter().map(|&held| if held { Constraint::Held } else { Constraint::Free });
        let moving = FreeRows::new(&edges.network(&CpuBackend::new(Precision::F64), constraint.collect())?);
        Ok(Self { name, edges, moving })
    }
}
