//! [`SurfaceNetwork`]: a spring network on a part of the surface, such as a curve or a family.
//!
//! Every stage that moves a surface builds such networks once per mesh and relaxes them once per
//! design.

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    backend::{Backend, BackendError, CpuBackend, Precision},
    constraint::Constraint,
    mesh::edges::VertexGraph,
    relaxation::{Convergence, Method, Network, Relaxer, Stopping},
    stage::SetUp,
};

/// Steps of a long way; see [`SurfaceNetwork::follow`].
const STEPS: u32 = 10;

/// The largest tolerance of a step.
const TOLERANCE: f64 = 1e-8;

/// The stiffest spring, if the softest has the stiffness 1.
const STIFFEST: f64 = 1e9;

/// A network of longitudinal springs along edges of the surface. The stiffness of a spring is
/// `1 / l`, `l` the length of its edge.
pub struct SurfaceNetwork {
    /// The mesh's vertex for each vertex of the network `[n]`, ascending.
    pub vertices: Vec<u32>,
    relaxer: Relaxer,
}

impl SurfaceNetwork {
    /// Makes a network.
    ///
    /// - `positions` `[n_vertices]`: of the whole mesh, in the mesh's unit
    /// - `edges`: pairs of the mesh's vertices, each edge once
    /// - `constraint`: the constraint of a vertex of the mesh
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

    /// Makes a network with conservative springs, which pull vertices back to displacement zero.
    ///
    /// The stiffness of a vertex's conservative spring is `(l / reach)^2 Σ k`, with `Σ k` the total
    /// stiffness of the vertex's edges and `l` their root-mean-square length.
    ///
    /// - `reach`: the length over which a displacement of held vertices dies away around a vertex,
    ///   in the mesh's unit; infinity is no conservative spring
    /// - others: as for [`Self::new`]
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
        let length = |&[a, b]: &[u32; 2]| positions[a as usize].distance(positions[b as usize]);
        let stiffness = edges.iter().map(|edge| 1.0 / length(edge)).collect();
        Self::of_springs(positions, edges, stiffness, constraint, reach, backend, method)
    }

    /// A network with conservative springs, and edges of any stiffness `[n_edges]`.
    fn of_springs(
        positions: &[DVec3],
        edges: &[[u32; 2]],
        stiffness: Vec<f64>,
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

    /// Moves vertices a long way, in [`STEPS`] steps. The springs of a step have the stiffness that
    /// their edges have then. So an edge that has become short is stiff, and triangles do not fold
    /// where one step would fold them. The steps relax in f64 on the CPU, because stiffnesses that
    /// differ by a factor of a million take the digits of f32.
    ///
    /// - `positions` `[n_vertices]`: of the whole mesh, in the mesh's unit; those of the network
    ///   change
    /// - `edges`, `constraint`: as for [`Self::new`]
    /// - `stiffness`: of an edge between two places; its scale does not matter
    /// - `place`: where a held vertex is at a progress from 0 to 1
    /// - `back`: the place nearest to a point where a vertex that may move may be
    ///
    /// # Errors
    /// The backend failed.
    pub fn follow(
        set_up: &SetUp,
        positions: &mut [DVec3],
        edges: &[[u32; 2]],
        constraint: impl Fn(u32) -> Constraint,
        stiffness: impl Fn(&[DVec3], [DVec3; 2]) -> f64 + Sync,
        place: impl Fn(u32, f64) -> DVec3,
        back: impl Fn(u32, DVec3) -> DVec3,
    ) -> Result<Convergence, BackendError> {
        let mut convergence = Convergence::nothing_to_do();
        let mut by = vec![DVec3::ZERO; positions.len()];
        let stopping = Stopping { tolerance: set_up.stopping.tolerance.min(TOLERANCE), ..set_up.stopping };
        for step in 1..=STEPS {
            let progress = f64::from(step) / f64::from(STEPS);
            let now: &[DVec3] = positions;
            let stiffness: Vec<f64> =
                edges.par_iter().map(|edge| stiffness(now, edge.map(|end| now[end as usize]))).collect();
            // An edge without length would be infinitely stiff.
            let softest = stiffness.iter().copied().fold(f64::INFINITY, f64::min);
            let stiffness = stiffness.into_iter().map(|own| (own / softest).min(STIFFEST)).collect();
            let (backend, method) = (&CpuBackend { precision: Precision::F64 }, set_up.method);
            let mut network =
                Self::of_springs(positions, edges, stiffness, &constraint, |_| f64::INFINITY, backend, method)?;
            let is_held = |vertex: u32| constraint(vertex) == Constraint::Held;
            for &vertex in &network.vertices {
                let at = vertex as usize;
                by[at] = if is_held(vertex) { place(vertex, progress) - positions[at] } else { DVec3::ZERO };
            }
            convergence = convergence.and(network.relax(&mut by, &stopping)?);
            for &vertex in &network.vertices {
                let at = vertex as usize;
                positions[at] =
                    if is_held(vertex) { place(vertex, progress) } else { back(vertex, positions[at] + by[at]) };
            }
        }
        Ok(convergence)
    }

    /// Relaxes the vertices that may move.
    ///
    /// - `displacement` `[n_vertices]`: of the whole mesh, in the mesh's unit; vertices of the
    ///   network that are held keep theirs
    ///
    /// # Errors
    /// The backend failed.
    pub fn relax(&mut self, displacement: &mut [DVec3], stopping: &Stopping) -> Result<Convergence, BackendError> {
        let mut local = self.gather(displacement);
        let convergence = self.relaxer.relax(&mut local, None, stopping)?;
        for ((&vertex, moved), constraint) in self.vertices.iter().zip(local).zip(&self.relaxer.network().constraint) {
            if *constraint != Constraint::Held {
                displacement[vertex as usize] = moved;
            }
        }
        Ok(convergence)
    }

    /// Change of the equilibrium that [`Self::relax`] finds.
    ///
    /// - `change` `[n_vertices]`: of the displacement of the whole mesh, in any unit; set for the
    ///   vertices that may move
    /// - `stopping`: its tolerance is relative to the argument
    ///
    /// # Errors
    /// The backend failed.
    pub fn forward(&mut self, change: &mut [DVec3], stopping: &Stopping) -> Result<Convergence, BackendError> {
        let mut local = self.gather(change);
        let convergence = self.relaxer.forward(&mut local, None, stopping)?;
        self.scatter(&local, change);
        Ok(convergence)
    }

    /// The transpose of [`Self::forward`].
    ///
    /// - `gradient` `[n_vertices]`: of the whole mesh, by the displacement after the relaxation on
    ///   entry and before it on exit, in any unit
    /// - `stopping`: its tolerance is relative to the argument
    ///
    /// # Errors
    /// The backend failed.
    pub fn reverse(&mut self, gradient: &mut [DVec3], stopping: &Stopping) -> Result<Convergence, BackendError> {
        let mut local = self.gather(gradient);
        let (_, convergence) = self.relaxer.reverse(&mut local, stopping)?;
        self.scatter(&local, gradient);
        Ok(convergence)
    }

    /// The equilibrium of forces alone: no held vertex moves.
    ///
    /// - `force` `[n]`: on the network's vertices, in any unit
    /// - `stopping`: its tolerance is relative to the argument
    ///
    /// Returns the displacement `[n]` in the unit of `force` over stiffness.
    ///
    /// # Errors
    /// The backend failed.
    pub fn of_force(
        &mut self,
        force: &[DVec3],
        stopping: &Stopping,
    ) -> Result<(Vec<DVec3>, Convergence), BackendError> {
        let mut displacement = vec![DVec3::ZERO; self.vertices.len()];
        let convergence = self.relaxer.forward(&mut displacement, Some(force), stopping)?;
        Ok((displacement, convergence))
    }

    /// The network, in f64.
    pub fn network(&self) -> &Network {
        self.relaxer.network()
    }

    /// The values of the network's vertices, from those of all vertices of the mesh.
    pub fn gather(&self, of_mesh: &[DVec3]) -> Vec<DVec3> {
        self.vertices.iter().map(|&vertex| of_mesh[vertex as usize]).collect()
    }

    /// Writes the values of the network's vertices into those of all vertices of the mesh.
    pub fn scatter(&self, local: &[DVec3], of_mesh: &mut [DVec3]) {
        self.vertices.iter().zip(local).for_each(|(&vertex, value)| of_mesh[vertex as usize] = *value);
    }

    /// Changes the constraints of the vertices that may move; see [`Relaxer::constrain`].
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

    /// The vertices that may move, each with one over its shortest edge (1 / the mesh's unit).
    pub fn moving(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        let network = self.relaxer.network();
        (0..self.vertices.len())
            .filter(|&row| network.constraint[row] != Constraint::Held)
            .map(|row| (self.vertices[row], network.inverse_length[row]))
    }
}
