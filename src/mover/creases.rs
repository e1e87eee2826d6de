//! [`Crease`]: edges of the surface whose angle a motion changes by far.
//!
//! A crease in a body that keeps its shape is a fault. In a family that gives way it is a warning:
//! a wing whose profiles ask for another edge may be right.

use std::collections::BTreeMap;

use glam::DVec3;

use super::Mover;
use crate::families::PlacedBy;
use crate::mesh::FamilyId;

/// An edge is creased if the angle between its two triangles changes by more than so many degrees.
///
/// Tests of pylons, nacelles, fairings and winglets that follow their wing stay below it.
pub const CREASED: f64 = 60.0;

/// The creased edges of a family.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Crease {
    /// Number of edges whose angle changes by more than [`CREASED`] degrees.
    pub edges: usize,
    /// The largest of these changes, in degrees.
    pub degrees: f64,
    /// The middle of the edge with this change after the motion, in the mesh's unit.
    pub at: DVec3,
}

/// The creased edges of a surface, by family. An edge between two families counts in the one that
/// is placed later.
#[derive(Clone, Debug, Default)]
pub(super) struct Creases {
    /// Of rigid families, at edges between triangles of rigid families.
    pub bodies: BTreeMap<String, Crease>,
    /// Of all other families.
    pub others: BTreeMap<String, Crease>,
}

impl Mover {
    /// Finds the creased edges.
    ///
    /// Edges at planes do not count: a wing that turns at its symmetry plane changes the angle
    /// there.
    ///
    /// - `vertices` `[n_vertices]`: moved positions in the mover's order, in the mesh's unit
    pub(super) fn creases(&self, vertices: &[DVec3]) -> Creases {
        let (surface, roles) = (&self.surface, &self.families.roles);
        let mut creases = Creases::default();
        let placed_by = |family: FamilyId| roles[family.index()].placed_by();
        let changed = self.edge_angles.changed(CREASED, vertices, &surface.triangles, &surface.opposite);
        for (half_edge, degrees) in changed {
            let families = [surface.family[half_edge as usize / 3], surface.family_behind(half_edge)];
            if families.iter().any(|&family| placed_by(family) == PlacedBy::Plane) {
                continue;
            }
            let is_body = families.iter().all(|&family| placed_by(family) == PlacedBy::Rigid);
            let [own, other] = families;
            let later = if placed_by(other) > placed_by(own) { other } else { own };
            let of = if is_body { &mut creases.bodies } else { &mut creases.others };
            let ends = [half_edge, surface.opposite[half_edge as usize]].map(|end| surface.origin(end));
            let at = 0.5 * ends.map(|vertex| vertices[vertex as usize]).iter().sum::<DVec3>();
            let first = Crease { edges: 0, degrees, at };
            let crease = of.entry(self.mesh.families[later.index()].clone()).or_insert(first);
            crease.edges += 1;
            if degrees > crease.degrees {
                (crease.degrees, crease.at) = (degrees, at);
            }
        }
        creases
    }
}
