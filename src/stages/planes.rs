//! Stage planes: symmetry and other plane families slide in their planes.
//!
//! A plane may have any orientation; where two meet, their common vertices slide along the line.
//! The stage relaxes each family as a surface; the volume stage lets its vertices slide on with the
//! tets behind them.

use super::surface_network::SurfaceNetwork;
use crate::families::PlacedBy;
use crate::mesh::Displacement;
use crate::stage::{SetUp, Stage, StageError};
use crate::{backend::BackendError, constraint::Constraint, mesh::edges::triangle_edges, relaxation::Convergence};

/// The network of all plane families together.
pub struct Planes {
    network: Option<SurfaceNetwork>,
}

impl Planes {
    /// Sets the network up.
    ///
    /// # Errors
    /// The backend failed.
    pub fn new(set_up: &SetUp) -> Result<Self, BackendError> {
        let SetUp { mesh, surface, families, backend, method, .. } = *set_up;
        let triangles = families.families_of(PlacedBy::Plane).flat_map(|family| surface.corners_of(family));
        let edges = triangle_edges(triangles);
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
