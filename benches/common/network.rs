//! The spring network of a mesh, and how fast its sweeps go.

use std::time::Instant;

use glam::DVec3;
use idmesh::{
    backend::{Backend, EdgeStiffness, Sweep},
    constraint::Constraint,
    mesh::{
        Order, TetMesh,
        edges::{TetEdges, VertexGraph},
    },
    relaxation::{FreeRows, Network},
    springs::Springs,
};
use rayon::prelude::*;

use super::{Failure, median};

/// Sweeps in a batch, about as many as a pass does between two measures.
const BATCH: usize = 50;

/// Repetitions a figure is the median of.
const REPEATS: usize = 5;

/// A piece of work is repeated until this many seconds are over, for each repetition.
const LEAST_SECONDS: f64 = 0.1;

/// The mesh in the order in which a mover has it that holds the surfaces.
pub fn in_order(mesh: &TetMesh) -> TetMesh {
    let mut is_held = vec![false; mesh.vertices.len()];
    mesh.triangles.iter().flatten().for_each(|&vertex| is_held[vertex as usize] = true);
    Order::new(mesh, &is_held).of(mesh)
}

/// The edges of a mesh's cells.
pub struct Edges {
    topology: TetEdges,
    /// The edges with a spring: those of cells.
    graph: VertexGraph,
    /// Vector from each edge's first to its second vertex.
    vector: Vec<DVec3>,
    n_vertices: usize,
}

impl Edges {
    /// The edges of these tets.
    pub fn new(points: &[DVec3], tets: &[[u32; 4]]) -> Self {
        Self::of_cells(points, tets, |edges| vec![true; edges.edges.len()])
    }

    /// The edges of these tets and corner tets, with springs along those of cells.
    pub fn of_cells(points: &[DVec3], tets: &[[u32; 4]], is_of_cell: impl Fn(&TetEdges) -> Vec<bool>) -> Self {
        let topology = TetEdges::new(points.len(), tets);
        let vector = topology.edges.iter().map(|[a, b]| points[*b as usize] - points[*a as usize]).collect();
        let is_of_cell = is_of_cell(&topology);
        let graph = VertexGraph::of_some(points.len(), &topology.edges, |edge| is_of_cell[edge]);
        Self { topology, graph, vector, n_vertices: points.len() }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.vector.len()
    }

    /// What a backend needs for the torsional stiffness.
    pub fn stiffness_input(&self) -> EdgeStiffness<'_> {
        EdgeStiffness {
            edge_vector: &self.vector,
            edge_tets: &self.topology.edge_tets,
            tet_edges: &self.topology.tet_edges,
        }
    }

    /// The default springs, but for their power of the proximity to walls.
    ///
    /// # Errors
    /// The backend failed.
    pub fn network(&self, backend: &dyn Backend, constraint: Vec<Constraint>) -> Result<Network, Failure> {
        let sums = backend.edge_stiffness(&self.stiffness_input())?;
        let length: Vec<f64> = self.vector.iter().map(|vector| vector.length()).collect();
        let of = <&Springs>::default().stiffness;
        let stiffness: Vec<f64> = length.iter().zip(sums).map(|(&length, sum)| of.on_wall(length, sum)).collect();
        Ok(Network::new(&self.graph, &stiffness, &length, constraint, vec![0.0; self.n_vertices]))
    }
}

/// How fast a device sweeps.
pub struct Speed {
    /// Seconds of one sweep.
    pub seconds: f64,
    /// Bytes a second.
    pub bandwidth: f64,
}

/// Jacobi sweeps over the vertices that move, as a relaxation has them on the device; a measure
/// every [`BATCH`] sweeps is part of it.
///
/// # Errors
/// The backend failed.
pub fn sweep_speed(moving: &FreeRows, backend: &dyn Backend) -> Result<Speed, Failure> {
    let network = &moving.network;
    let mut device = backend.upload(&network.data())?;
    let load: Vec<DVec3> = (0..network.len()).map(|row| DVec3::new(row as f64, 1.0, -1.0)).collect();
    device.start(&load)?;
    let batch = [Sweep { relaxation: 1.0, momentum: 0.0 }; BATCH];
    let batches = seconds(|| {
        device.sweep(&batch)?;
        Ok(())
    })?;
    let seconds = batches / BATCH as f64;
    let number = if device.epsilon() == f64::EPSILON { 8 } else { 4 };
    // What a sweep moves if each array goes through memory once: columns and stiffness of both ends
    // of a spring, and per vertex its row's start, constraint, load, correction, and the one
    // before, which is read and written.
    let bytes = network.stiffness.len() * (4 + number) + network.len() * (4 + 5 * 4 * number);
    Ok(Speed { seconds, bandwidth: bytes as f64 / seconds })
}

/// Bytes a second that all threads together read and write when they copy an array larger than the
/// caches they have to themselves.
///
/// # Errors
/// None.
pub fn copy_bandwidth() -> Result<f64, Failure> {
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

/// Median time of a piece of work, done once before the clock starts.
///
/// # Errors
/// Those of the work.
pub fn seconds(mut work: impl FnMut() -> Result<(), Failure>) -> Result<f64, Failure> {
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
