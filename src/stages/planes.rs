//! Stage planes: symmetry and other plane families slide in their planes.
//!
//! A plane may have any orientation; where two meet, their common vertices slide along the line. The stage relaxes each
//! family as a surface; the volume stage lets its vertices slide on with the tets behind them.

use super::{Motion, Owner, SetUp, patch::Patch};
use crate::{
    backend::{BackendError, Constraint},
    mesh::edges::triangle_edges,
    relaxation::{Accuracy, Convergence},
};

/// The network of all plane families together.
pub struct Planes {
    network: Option<Patch>,
}

impl Planes {
    /// Sets the network up.
    ///
    /// # Errors
    /// The backend failed.
    pub fn new(set_up: &SetUp) -> Result<Self, BackendError> {
        let SetUp { mesh, surface, families, backend, method, .. } = *set_up;
        let triangles = families.placed_by(Owner::Plane).flat_map(|family| surface.corners_of(family));
        let edges = triangle_edges(triangles);
        if edges.is_empty() {
            return Ok(Self { network: None });
        }
        let constraint = |vertex: u32| match families.owner[vertex as usize] {
            Owner::Plane => families.plane_constraint(vertex),
            _ => Constraint::Held,
        };
        Ok(Self { network: Some(Patch::new(&mesh.vertices, &edges, constraint, backend, method)?) })
    }

    /// Slides the plane families after what borders them.
    ///
    /// # Errors
    /// The backend failed.
    pub fn run(&mut self, motion: &mut Motion, accuracy: &Accuracy) -> Result<Convergence, BackendError> {
        match &mut self.network {
            Some(network) => network.relax(motion, accuracy),
            None => Ok(Convergence::nothing_to_do()),
        }
    }
}
