//! Stage volume: springs on the edges of the tets (see [`crate::springs`]) carry the surfaces' motion inside; rest edges
//! turn with the surfaces where the springs say so (see `rotation`).
//!
//! The stiffness is that of the undeformed mesh, so the result depends on the design alone and not on the way to it.
//! Vertices of plane families slide on in their planes; all other surface vertices are held.

use std::cell::LazyCell;

use rayon::prelude::*;

use super::{
    Motion, Owner, SetUp, Start,
    rotation::{Rotation, rest_force},
    start::Equilibrium,
};
use crate::{
    backend::{Backend, BackendError, Constraint, CpuBackend, EdgeStiffness, Precision},
    mesh::{
        TetMesh,
        edges::{TetEdges, VertexGraph},
    },
    relaxation::{Accuracy, Convergence, Method, Network, Relaxer},
    springs::{Springs, Stiffness, nearness},
};

/// Edges in a task.
const EDGES: usize = 4096;

/// Where the springs of a mesh go; the same for all its deformed shapes.
pub struct Lattice {
    tets: TetEdges,
    graph: VertexGraph,
}

impl Lattice {
    /// The edges of the tets.
    pub fn new(mesh: &TetMesh) -> Self {
        let tets = TetEdges::new(mesh.vertices.len(), &mesh.tets);
        let graph = VertexGraph::new(mesh.vertices.len(), &tets.edges);
        Self { tets, graph }
    }
}

/// Below this tolerance the springs are evaluated in f64, whatever the backend: residuals are f64, and the equilibrium of springs
/// rounded to f32 is some 1e-6 of an edge off on a wing of 102 341 tets pitched by 10 degrees.
const SINGLE: f64 = 1e-5;

/// The network of all tets.
pub struct Volume {
    relaxer: Relaxer,
    last: Equilibrium,
    /// For springs whose rest edges turn.
    rotation: Option<Rotation>,
}

impl Volume {
    /// Evaluates the springs at the vertices of `set_up`'s mesh and sets the network up.
    ///
    /// # Errors
    /// The backend failed or the mesh does not fit.
    pub fn new(set_up: &SetUp, lattice: &Lattice, springs: &Springs) -> Result<Self, BackendError> {
        let SetUp { mesh, surface, families, backend, method, accuracy } = *set_up;
        let Lattice { tets: TetEdges { edges, edge_tets, tet_edges }, graph } = lattice;
        let edge_vector: Vec<glam::DVec3> =
            edges.iter().map(|[a, b]| mesh.vertices[*b as usize] - mesh.vertices[*a as usize]).collect();
        let near = LazyCell::new(|| {
            let walls: Vec<[u32; 3]> = families.moved().flat_map(|family| surface.corners_of(family)).collect();
            nearness(&mesh.vertices, edges, &walls)
        });
        let length: Vec<f64> = edge_vector.iter().map(|vector| vector.length()).collect();
        let reference = CpuBackend::new(Precision::F64);
        let springs_on: &dyn Backend = if accuracy.tolerance < SINGLE { &reference } else { backend };
        // One sum over the tets serves all springs.
        let sum = match springs.are_torsional() {
            true => springs_on.edge_stiffness(&EdgeStiffness { edge_vector: &edge_vector, edge_tets, tet_edges })?,
            false => vec![0.0; edges.len()],
        };
        let stiffness = |of: Stiffness| -> Vec<f64> {
            let mut stiffness: Vec<f64> =
                length.iter().zip(&sum).map(|(&length, &sum)| of.on_wall(length, sum)).collect();
            if of.wall != 0.0 {
                stiffness
                    .par_iter_mut()
                    .zip(&**near)
                    .with_min_len(EDGES)
                    .for_each(|(stiffness, near)| *stiffness *= near.powf(of.wall));
            }
            stiffness
        };
        let constraint: Vec<Constraint> = (0..mesh.vertices.len() as u32)
            .map(|vertex| match families.owner[vertex as usize] {
                Owner::Volume => Constraint::Free,
                Owner::Plane => families.plane_constraint(vertex),
                _ => Constraint::Held,
            })
            .collect();
        let turning = springs.rotation.map(stiffness);
        let stiffness = stiffness(springs.stiffness);
        let anchor = vec![0.0; mesh.vertices.len()];
        // The two networks know nothing of each other.
        let (rotation, relaxer) = rayon::join(
            || turning.map(|stiffness| Rotation::new(set_up, graph, &stiffness)).transpose(),
            || Relaxer::new(Network::new(graph, &stiffness, &length, constraint, anchor), backend, method),
        );
        Ok(Self { relaxer: relaxer?, last: Equilibrium::default(), rotation: rotation? })
    }

    /// What each vertex of the mesh may do once its surfaces are moved `[n_vertices]`.
    pub fn constraint(&self) -> &[Constraint] {
        &self.relaxer.network().constraint
    }

    /// How the springs are relaxed; never [`Method::Auto`].
    pub fn method(&self) -> Method {
        self.relaxer.method()
    }

    /// Where [`Self::run`] starts from now on.
    pub fn start_from(&mut self, start: Start) {
        self.last.start_from(start);
        if let Some(rotation) = &mut self.rotation {
            rotation.start_from(start);
        }
    }

    /// Moves the inside after the surfaces.
    ///
    /// # Errors
    /// The backend failed.
    pub fn run(
        &mut self,
        vertices: &[glam::DVec3],
        motion: &mut Motion,
        accuracy: &Accuracy,
    ) -> Result<Convergence, BackendError> {
        if motion.iter().all(|displacement| *displacement == glam::DVec3::ZERO) {
            return Ok(Convergence::nothing_to_do());
        }
        self.last.recall(&self.relaxer.network().constraint, motion);
        let convergence = match &mut self.rotation {
            None => self.relaxer.relax(motion, None, accuracy)?,
            Some(rotation) => {
                let (turned, spread) = rotation.spread(vertices, motion, accuracy)?;
                let force = rest_force(self.relaxer.network(), vertices, &turned);
                self.relaxer.relax(motion, Some(&force), accuracy)?.and(spread)
            }
        };
        self.last.keep(&convergence, motion);
        Ok(convergence)
    }
}
