//! Vertex-sweeps a second and edges a second: the two kernels that all the arithmetic of the springs goes through.
//!
//! `cargo bench --bench sweeps -- [N ...]`: bricks of N x N x N cubes, six tets each, and the example's mesh. The GPU may be a
//! software adapter; it is named. Where there is none its rows are left out.

mod common;

use std::{process::ExitCode, time::Instant};

use common::{Example, Failure, brick, median, numbers, print_machine, print_table, row};
use glam::DVec3;
use idmesh::{
    backend::{self, Backend, BackendError, Constraint, CpuBackend, EdgeStiffness, Precision, Selection, Sweep},
    mesh::edges::{TetEdges, VertexGraph},
    relaxation::Network,
    springs::Springs,
};
use rayon::prelude::*;

/// Sweeps in a batch, about as many as a pass does between two measures.
const BATCH: usize = 50;

/// Repetitions a figure is the median of.
const REPEATS: usize = 5;

/// A batch or an evaluation is repeated until this many seconds are over, for each repetition.
const LEAST_SECONDS: f64 = 0.1;

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let sizes = numbers(&[10, 25, 50])?;
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

    let mut meshes: Vec<Mesh> = sizes.into_iter().map(brick_mesh).collect();
    meshes.push(example()?);
    let mut rows = vec![row(&[
        "mesh",
        "vertices",
        "edges",
        "backend",
        "ms/sweep",
        "Mvertex-sweeps/s",
        "GB/s",
        "Medges/s (stiffness)",
    ])];
    for mesh in &meshes {
        for (name, backend) in &backends {
            let (vertices, edges) = (mesh.points.len(), mesh.topology.edges.len());
            let sweep = seconds_a_sweep(mesh, backend.as_ref())?;
            let stiffness = seconds_a_stiffness(mesh, backend.as_ref())?;
            rows.push(vec![
                mesh.name.clone(),
                vertices.to_string(),
                edges.to_string(),
                (*name).to_owned(),
                format!("{:.4}", 1e3 * sweep),
                format!("{:.1}", 1e-6 * vertices as f64 / sweep),
                format!("{:.1}", 1e-9 * bytes_a_sweep(vertices, edges, name) / sweep),
                format!("{:.2}", 1e-6 * edges as f64 / stiffness),
            ]);
        }
    }
    print_table(&rows);
    println!("\ncopying memory: {:.1} GB/s", 1e-9 * copy_bandwidth()?);
    Ok(())
}

/// Bytes a sweep moves if each array goes through memory once: columns and stiffness of both ends of an edge, and per vertex
/// its row's start, constraint, load, correction, and the one before, which is read and written.
fn bytes_a_sweep(vertices: usize, edges: usize, backend: &str) -> f64 {
    let number = if backend.ends_with("f64") { 8 } else { 4 };
    (2 * edges * (4 + number) + vertices * (4 + 5 * 4 * number)) as f64
}

/// Bytes a second that all threads together read and write when they copy an array larger than the caches they have to
/// themselves.
fn copy_bandwidth() -> Result<f64, Failure> {
    const BYTES: usize = 256 << 20;
    const PIECE: usize = 1 << 20;
    let source = vec![1u8; BYTES];
    let mut copy = vec![0u8; BYTES];
    let time = seconds(|| {
        copy.par_chunks_mut(PIECE)
            .zip(source.par_chunks(PIECE))
            .for_each(|(copy, source)| copy.copy_from_slice(source));
        Ok(())
    })?;
    Ok(2.0 * BYTES as f64 / time)
}

/// A mesh as the springs see it.
struct Mesh {
    name: String,
    points: Vec<DVec3>,
    topology: TetEdges,
    edge_vector: Vec<DVec3>,
    /// Whether a vertex is on the boundary `[n_vertices]`.
    on_boundary: Vec<bool>,
}

impl Mesh {
    fn new(name: String, points: Vec<DVec3>, tets: &[[u32; 4]], on_boundary: Vec<bool>) -> Self {
        let topology = TetEdges::new(points.len(), tets);
        let edge_vector = topology.edges.iter().map(|[a, b]| points[*b as usize] - points[*a as usize]).collect();
        Self { name, points, topology, edge_vector, on_boundary }
    }

    fn stiffness_input(&self) -> EdgeStiffness<'_> {
        let springs = <&Springs>::default();
        EdgeStiffness {
            edge_vector: &self.edge_vector,
            edge_tets: &self.topology.edge_tets,
            tet_edges: &self.topology.tet_edges,
            length: springs.stiffness.length,
            torsion: springs.stiffness.torsion,
        }
    }
}

/// A brick of cubes of side 1.
fn brick_mesh(n: usize) -> Mesh {
    let (points, tets, on_boundary) = brick(n);
    Mesh::new(format!("brick {n}"), points, &tets, on_boundary)
}

fn example() -> Result<Mesh, Failure> {
    let mesh = Example::read()?.file.mesh;
    let mut on_boundary = vec![false; mesh.vertices.len()];
    mesh.triangles.iter().flatten().for_each(|&vertex| on_boundary[vertex as usize] = true);
    Ok(Mesh::new("wing-body".to_owned(), mesh.vertices, &mesh.tets, on_boundary))
}

/// Time of one Jacobi sweep over all vertices of a mesh whose boundary is held; a measure every [`BATCH`] sweeps is part
/// of it, as in a relaxation.
fn seconds_a_sweep(mesh: &Mesh, backend: &dyn Backend) -> Result<f64, Failure> {
    let stiffness = CpuBackend::new(Precision::F64).edge_stiffness(&mesh.stiffness_input())?;
    let length: Vec<f64> = mesh.edge_vector.iter().map(|edge| edge.length()).collect();
    let graph = VertexGraph::new(mesh.points.len(), &mesh.topology.edges);
    let constraint = mesh.on_boundary.iter().map(|&held| if held { Constraint::Held } else { Constraint::Free });
    let network = Network::new(&graph, &stiffness, &length, constraint.collect(), vec![0.0; mesh.points.len()]);
    let mut device = backend.upload(&network.data())?;
    let load: Vec<DVec3> =
        mesh.points.iter().zip(&mesh.on_boundary).map(|(at, &held)| if held { DVec3::ZERO } else { *at }).collect();
    device.start(&load)?;
    let batch = [Sweep { relaxation: 1.0, momentum: 0.0 }; BATCH];
    let batches = seconds(|| {
        device.sweep(&batch)?;
        Ok(())
    })?;
    Ok(batches / BATCH as f64)
}

/// Time of the stiffness of all edges, copies to and from the device included.
fn seconds_a_stiffness(mesh: &Mesh, backend: &dyn Backend) -> Result<f64, Failure> {
    let input = mesh.stiffness_input();
    seconds(|| {
        backend.edge_stiffness(&input)?;
        Ok(())
    })
}

/// Median time of a piece of work, done once before the clock starts.
fn seconds(mut work: impl FnMut() -> Result<(), Failure>) -> Result<f64, Failure> {
    work()?;
    let mut times = Vec::with_capacity(REPEATS);
    for _ in 0..REPEATS {
        let start = Instant::now();
        let mut count = 0;
        while start.elapsed().as_secs_f64() < LEAST_SECONDS {
            work()?;
            count += 1;
        }
        times.push(start.elapsed().as_secs_f64() / f64::from(count));
    }
    Ok(median(times))
}
