//! Stage carenage (paper 3.4), the elastic shape: vertices move by springs and are projected back
//! onto the original surface.
//!
//! The paper projects after every motion of the springs. Here the springs first relax freely and
//! the result is projected; then they relax within the tangent planes there and are projected
//! again, until nothing moves: the same equilibrium (springs balanced along the surface, every
//! vertex on it) with a handful of projections instead of hundreds. Vertices on the curve shared
//! with a plane family stay.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::surface_network::SurfaceNetwork;
use crate::families::PlacedBy;
use crate::families::shape::FamilyShape;
use crate::mesh::Displacement;
use crate::stage::{SetUp, Stage, StageError};
use crate::{
    backend::BackendError,
    constraint::Constraint,
    mesh::{FamilyId, TetMesh, edges::triangle_edges},
    projection::TargetSurface,
    relaxation::Convergence,
};

/// Rounds of tangential relaxation and projection after which to stop unconverged; the example
/// takes 4.
const MOST_ROUNDS: usize = 40;

/// All carenages of a mesh.
pub struct Carenages {
    carenages: Vec<(FamilyId, SurfaceNetwork)>,
}

impl Carenages {
    /// Sets the networks up.
    ///
    /// # Errors
    /// The backend failed.
    pub fn new(set_up: &SetUp) -> Result<Self, BackendError> {
        let SetUp { mesh, surface, families, backend, method, .. } = *set_up;
        let carenages = families.families_of(PlacedBy::Carenage).map(|family| {
            let constraint = |vertex: u32| {
                let free = families.placed_by[vertex as usize] == PlacedBy::Carenage
                    && families.shapes_at(vertex).count() == 1;
                if free { Constraint::Free } else { Constraint::Held }
            };
            let edges = triangle_edges(surface.corners_of(family));
            Ok((family, SurfaceNetwork::new(&mesh.vertices, &edges, constraint, backend, method)?))
        });
        Ok(Self { carenages: carenages.collect::<Result<_, BackendError>>()? })
    }
}

impl Stage for Carenages {
    fn run(
        &mut self,
        set_up: &SetUp,
        displacement: &mut Displacement,
        _: &dyn Fn(&str),
    ) -> Result<Convergence, StageError> {
        let SetUp { mesh, families, stopping, .. } = set_up;
        let mut all = Convergence::nothing_to_do();
        for (family, network) in &mut self.carenages {
            let Some(FamilyShape::Surface(target)) = &families.shapes[family.index()] else { continue };
            if network.vertices.iter().all(|&vertex| displacement[vertex as usize] == DVec3::ZERO) {
                continue;
            }
            network.constrain(|_| Constraint::Free)?;
            let mut convergence = network.relax(displacement, stopping)?;
            let mut normals = project(mesh, target, network, displacement);
            for _ in 0..MOST_ROUNDS {
                network.constrain(|vertex| Constraint::InPlane(normals[&vertex]))?;
                let before: Vec<DVec3> = network.moving().map(|(vertex, _)| displacement[vertex as usize]).collect();
                let tangential = network.relax(displacement, stopping)?;
                normals = project(mesh, target, network, displacement);
                let moved = network
                    .moving()
                    .zip(before)
                    .map(|((vertex, inverse_length), before)| {
                        (displacement[vertex as usize] - before).length() * inverse_length
                    })
                    .fold(0.0, f64::max);
                convergence = Convergence { sweeps: convergence.sweeps + tangential.sweeps, ..tangential };
                // Each round ends near the last one's place by what the surface's curvature leaves:
                // what the round still moved bounds what is left.
                convergence.error = tangential.error.max(moved);
                convergence.converged = tangential.converged && moved <= stopping.tolerance;
                if convergence.converged || !tangential.converged {
                    break;
                }
            }
            all = all.and(convergence);
        }
        Ok(all)
    }
}

/// Brings the vertices that may move back onto the surface; the normals there.
fn project(
    mesh: &TetMesh,
    target: &TargetSurface,
    network: &SurfaceNetwork,
    displacement: &mut Displacement,
) -> HashMap<u32, DVec3> {
    let vertices: Vec<u32> = network.moving().map(|(vertex, _)| vertex).collect();
    let found: Vec<(u32, DVec3, DVec3)> = vertices
        .par_iter()
        .map(|&vertex| {
            let start = mesh.vertices[vertex as usize];
            let on = target.closest(start + displacement[vertex as usize]);
            (vertex, on.point - start, target.normal(&on))
        })
        .collect();
    for &(vertex, by, _) in &found {
        displacement[vertex as usize] = by;
    }
    found.into_iter().map(|(vertex, _, normal)| (vertex, normal)).collect()
}
