//! Stage volume: longitudinal and torsional springs on the edges of the tets carry the surfaces' motion inside.
//!
//! The stiffness is that of the undeformed mesh, so the result depends on the design alone and not on the way to it.
//! Vertices of plane families slide on in their planes; all other surface vertices are held.

use super::{Families, Motion, Owner};
use crate::{
    backend::{Backend, BackendError, Constraint, EdgeStiffness},
    mesh::{
        TetMesh,
        edges::{TetEdges, VertexGraph},
    },
    relaxation::{Accuracy, Convergence, Method, Network, Relaxer},
    springs::Springs,
};

/// The network of all tets.
pub struct Volume {
    relaxer: Relaxer,
}

impl Volume {
    /// Evaluates the springs and sets the network up.
    ///
    /// # Errors
    /// The backend failed or the mesh does not fit.
    pub fn new(
        mesh: &TetMesh,
        families: &Families,
        springs: &Springs,
        backend: &dyn Backend,
        method: Method,
    ) -> Result<Self, BackendError> {
        let TetEdges { edges, edge_tets, tet_edges } = TetEdges::new(mesh.vertices.len(), &mesh.tets);
        let edge_vector: Vec<glam::DVec3> =
            edges.iter().map(|[a, b]| mesh.vertices[*b as usize] - mesh.vertices[*a as usize]).collect();
        let stiffness = backend.edge_stiffness(&EdgeStiffness {
            edge_vector: &edge_vector,
            edge_tets: &edge_tets,
            tet_edges: &tet_edges,
            length: springs.length,
            torsion: springs.torsion,
        })?;
        let length: Vec<f64> = edge_vector.iter().map(|vector| vector.length()).collect();
        let graph = VertexGraph::new(mesh.vertices.len(), &edges);
        let constraint: Vec<Constraint> = (0..mesh.vertices.len() as u32)
            .map(|vertex| match families.owner[vertex as usize] {
                Owner::Volume => Constraint::Free,
                Owner::Plane => families.plane_constraint(vertex),
                _ => Constraint::Held,
            })
            .collect();
        let network = Network::new(&graph, &stiffness, &length, constraint, vec![0.0; mesh.vertices.len()]);
        Ok(Self { relaxer: Relaxer::new(network, backend, method)? })
    }

    /// Moves the inside after the surfaces.
    ///
    /// # Errors
    /// The backend failed.
    pub fn run(&mut self, motion: &mut Motion, accuracy: &Accuracy) -> Result<Convergence, BackendError> {
        self.relaxer.relax(motion, None, accuracy)
    }
}
