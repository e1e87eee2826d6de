//! Stage carenage (paper 3.4): carenage vertices move by springs and stay on their original
//! surface.
//!
//! The paper projects the vertices after every motion of the springs. Here the springs first relax
//! freely, and the vertices are projected. Then rounds follow: the springs relax within the tangent
//! planes at the vertices, and the vertices are projected again. The rounds end when no vertex
//! moves any more. The equilibrium is the paper's: springs balance along the surface, and every
//! vertex is on the surface. Here the equilibrium takes a few projections instead of hundreds.
//!
//! Vertices at which a carenage meets a plane family or another carenage stay where they are.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::surface_equilibrium::SurfaceEquilibrium;
use super::surface_network::SurfaceNetwork;
use crate::families::shape::FamilyShape;
use crate::families::{Families, PlacedBy};
use crate::mesh::Displacement;
use crate::stage::{Kept, NoProduct, Products, SetUp, Stage, StageError};
use crate::{
    backend::BackendError,
    constraint::Constraint,
    mesh::{FamilyId, TetMesh},
    projection::TargetSurface,
    relaxation::{Convergence, Stopping},
};

/// Largest number of rounds. After these a carenage counts as not converged. The example takes 4
/// rounds. The sharp nose of a whole fuselage of few faces takes 60: a vertex there goes to and fro
/// between its sides, each time a tenth less.
const MOST_ROUNDS: usize = 150;

/// All carenages of a mesh.
pub struct Carenages {
    carenages: Vec<(FamilyId, SurfaceNetwork)>,
}

impl Carenages {
    /// Sets up one network for each carenage.
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
            let edges = surface.edges_of(surface.triangles_of(family));
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
                let history = convergence.history.and(tangential.history.clone());
                convergence =
                    Convergence { sweeps: convergence.sweeps + tangential.sweeps, history, ..tangential.clone() };
                // A round leaves only the error that the surface's curvature causes, which is
                // smaller than the motion of the round. So this motion bounds the error.
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

impl Products for Carenages {
    fn forward(
        &mut self,
        set_up: &SetUp,
        kept: &Kept,
        change: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        clear(set_up.families, change);
        let mut all = Convergence::nothing_to_do();
        for (family, network) in &mut self.carenages {
            let Some(FamilyShape::Surface(target)) = &set_up.families.shapes[family.index()] else { continue };
            let mut equilibrium = SurfaceEquilibrium::new(set_up.mesh, target, network, &kept.surfaces)?;
            all = all.and(equilibrium.forward(change, stopping)?);
        }
        Ok(all)
    }

    fn reverse(
        &mut self,
        set_up: &SetUp,
        kept: &Kept,
        gradient: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        let mut all = Convergence::nothing_to_do();
        for (family, network) in self.carenages.iter_mut().rev() {
            let Some(FamilyShape::Surface(target)) = &set_up.families.shapes[family.index()] else { continue };
            let mut equilibrium = SurfaceEquilibrium::new(set_up.mesh, target, network, &kept.surfaces)?;
            all = all.and(equilibrium.reverse(gradient, stopping)?);
        }
        clear(set_up.families, gradient);
        Ok(all)
    }
}

/// Sets the vectors of the stage's own vertices to zero.
fn clear(families: &Families, vectors: &mut Displacement) {
    for (vector, placed_by) in vectors.iter_mut().zip(&families.placed_by) {
        if *placed_by == PlacedBy::Carenage {
            *vector = DVec3::ZERO;
        }
    }
}

/// Moves the vertices that may move to the closest points of the surface. Returns the surface's
/// unit normal at each of these vertices.
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
