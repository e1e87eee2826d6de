//! Stage planes: vertices of symmetry and other plane families move in their planes. The paper has
//! no such stage.
//!
//! A plane may have any orientation. Where two planes meet, their common vertices move along the
//! common line. All plane families are one spring network on triangles. The volume stage moves
//! these vertices again, together with the tets.

use super::surface_network::SurfaceNetwork;
use crate::families::PlacedBy;
use crate::mesh::Displacement;
use crate::stage::{Kept, NoProduct, Products, SetUp, Stage, StageError};
use crate::{
    backend::BackendError,
    constraint::Constraint,
    relaxation::{Convergence, Stopping},
};

/// The network of all plane families together.
pub struct Planes {
    network: Option<SurfaceNetwork>,
}

impl Planes {
    /// Sets up the network.
    ///
    /// # Errors
    /// The backend failed.
    pub fn new(set_up: &SetUp) -> Result<Self, BackendError> {
        let SetUp { mesh, surface, families, backend, method, .. } = *set_up;
        let triangles = families.families_of(PlacedBy::Plane).flat_map(|family| surface.triangles_of(family));
        let edges = surface.edges_of(triangles);
        if edges.is_empty() {
            return Ok(Self { network: None });
        }
        let constraint = |vertex: u32| match families.placed_by[vertex as usize] {
            PlacedBy::Plane => families.plane_constraint(vertex),
            _ => Constraint::Held,
        };
        Ok(Self { network: Some(SurfaceNetwork::new(&mesh.vertices, &edges, constraint, backend, method)?) })
    }
}

impl Stage for Planes {
    fn run(
        &mut self,
        set_up: &SetUp,
        displacement: &mut Displacement,
        _: &dyn Fn(&str),
    ) -> Result<Convergence, StageError> {
        match &mut self.network {
            Some(network) => Ok(network.relax(displacement, &set_up.stopping)?),
            None => Ok(Convergence::nothing_to_do()),
        }
    }
}

impl Products for Planes {
    fn forward(
        &mut self,
        _: &SetUp,
        _: &Kept,
        change: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        match &mut self.network {
            Some(network) => Ok(network.forward(change, stopping)?),
            None => Ok(Convergence::nothing_to_do()),
        }
    }

    fn reverse(
        &mut self,
        _: &SetUp,
        _: &Kept,
        gradient: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        match &mut self.network {
            Some(network) => Ok(network.reverse(gradient, stopping)?),
            None => Ok(Convergence::nothing_to_do()),
        }
    }
}
