//! A part of the surface (a curve, a family) as a spring network of its own.

use glam::DVec3;

use crate::{
    backend::{Backend, BackendError},
    constraint::Constraint,
    mesh::edges::VertexGraph,
    relaxation::{Convergence, Method, Network, Relaxer, Stopping},
};

/// Longitudinal springs `1 / l` along the edges of a curve or a family.
pub struct SurfaceNetwork {
    /// Vertices of the mesh behind the network's `[n]`, ascending.
    pub vertices: Vec<u32>,
    relaxer: Relaxer,
}

impl SurfaceNetwork {
    /// A network along these edges (pairs of mesh vertices); `constraint` says what a vertex may
    /// do.
    ///
    /// # Errors
    /// The backend failed.
    pub fn new(
        positions: &[DVec3],
        edges: &[[u32; 2]],
        constraint: impl Fn(u32) -> Constraint,
        backend: &dyn Backend,
        method: Method,
    ) -> Result<Self, BackendError> {
        Self::anchored(positions, edges, constraint, |_| f64::INFINITY, backend, method)
    }

    /// [`Self::new`] with conservative springs, which pull the vertices that move back to zero.
    ///
    /// `reach` of a vertex is the length over which a displacement of the held vertices dies away
    /// around it: its spring is `(l / reach)^2` of its total stiffness, `l` its root-mean-square
    /// edge. Infinity is no such spring.
    ///
    /// # Errors
    /// The backend failed.
    pub fn anchored(
        positions: &[DVec3],
        edges: &[[u32; 2]],
        constraint: impl Fn(u32) -> Constraint,
        reach: impl Fn(u32) -> f64,
        backend: &dyn Backend,
        method: Method,
    ) -> Result<Self, BackendError> {
        let mut vertices: Vec<u32> = edges.iter().flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        let local = |vertex: u32| vertices.binary_search(&vertex).expect("every end of an edge is a vertex") as u32;
        let local_edges: Vec<[u32; 2]> = edges.iter().map(|edge| edge.map(local)).collect();
        let graph = VertexGraph::new(vertices.len(), &local_edges);
        let length: Vec<f64> =
            edges.iter().map(|[a, b]| positions[*a as usize].distance(positions[*b as usize])).collect();
        let stiffness: Vec<f64> = length.iter().map(|length| 1.0 / length).collect();
        let constraint: Vec<Constraint> = vertices.iter().map(|&vertex| constraint(vertex)).collect();
        let anchor = (0..vertices.len())
            .map(|row| {
                let own = &graph.entry_edge[graph.neighbours.range(row)];
                let total: f64 = own.iter().map(|&edge| stiffness[edge as usize]).sum();
                let square = own.iter().map(|&edge| length[edge as usize].powi(2)).sum::<f64>() / own.len() as f64;
                let reach = reach(vertices[row]);
                if constraint[row] == Constraint::Held { 0.0 } else { total * square / (reach * reach) }
            })
            .collect();
        let network = Network::new(&graph, &stiffness, &length, constraint, anchor);
        Ok(Self { relaxer: Relaxer::new(network, backend, method)?, vertices })
    }

    /// Relaxes the vertices that may move; `displacement` is of the whole mesh `[n_vertices]`.
    ///
    /// # Errors
    /// The backend failed.
    pub fn relax(&mut self, displacement: &mut [DVec3], stopping: &Stopping) -> Result<Convergence, BackendError> {
        let mut local: Vec<DVec3> = self.vertices.iter().map(|&vertex| displacement[vertex as usize]).collect();
        let convergence = self.relaxer.relax(&mut local, None, stopping)?;
        for ((&vertex, moved), constraint) in self.vertices.iter().zip(local).zip(&self.relaxer.network().constraint) {
            if *constraint != Constraint::Held {
                displacement[vertex as usize] = moved;
            }
        }
        Ok(convergence)
    }

    /// Changes what the vertices that may move may do; see [`Relaxer::constrain`].
    ///
    /// # Errors
    /// The backend failed.
    pub fn constrain(&mut self, constraint: impl Fn(u32) -> Constraint) -> Result<(), BackendError> {
        let now = &self.relaxer.network().constraint;
        let new = self
            .vertices
            .iter()
            .zip(now)
            .map(|(&vertex, &now)| if now == Constraint::Held { now } else { constraint(vertex) });
        self.relaxer.constrain(new.collect())
    }

    /// The vertices that may move, with one over their shortest edge.
    pub fn moving(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        let network = self.relaxer.network();
        (0..self.vertices.len())
            .filter(|&row| network.constraint[row] != Constraint::Held)
            .map(|row| (self.vertices[row], network.inverse_length[row]))
    }
}
