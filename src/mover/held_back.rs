//! Vertices that a design moves and another family holds: a wing's or a prescribed family's that a
//! fixed or prescribed one has too.
//!
//! The surface is bent there, however good its triangles are: nobody but the user can say whether
//! that is meant. So it is told, and where it goes beyond the shortest edge at a vertex the result
//! is not taken.

use std::collections::BTreeMap;

use glam::DVec3;

use super::Mover;
use crate::{geometry, mesh::Displacement, mesh::FamilyId, stage::Wanted};

/// A vertex that is held back by less than this fraction of its family's size is where it should
/// be.
const BACK: f64 = 1e-9;

/// The vertices of one family that another holds back.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldBack {
    /// The family that holds them.
    pub by: String,
    /// The family that would move them.
    pub family: String,
    /// How many they are.
    pub vertices: usize,
    /// Largest distance between where they are and where the design would have them.
    pub max_distance: f64,
    /// Where that vertex was.
    pub at: DVec3,
    /// Of the vertex that is held back the most against its shortest edge in the family, if it is
    /// by more than that.
    pub beyond: Option<Beyond>,
}

/// A vertex held back by more than its shortest edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beyond {
    /// The distance.
    pub distance: f64,
    /// The shortest edge.
    pub edge: f64,
    /// Where it was.
    pub at: DVec3,
}

impl Mover {
    /// What is held back once the wing's stage has ended, by the families' names.
    ///
    /// - `wanted`: what others than their owners would do to vertices
    /// - `displacement` `[n_vertices]`: what their owners do
    pub(super) fn held_back(&self, wanted: &[Wanted], displacement: &Displacement) -> Vec<HeldBack> {
        let mut edges_of: BTreeMap<FamilyId, (f64, BTreeMap<u32, f64>)> = BTreeMap::new();
        let mut found: BTreeMap<(FamilyId, FamilyId), HeldBack> = BTreeMap::new();
        for &Wanted { family, vertex, displacement: wanted } in wanted {
            let distance = wanted.distance(displacement[vertex as usize]);
            let (size, edges) = edges_of.entry(family).or_insert_with(|| (self.size_of(family), self.edges_of(family)));
            if distance <= BACK * *size {
                continue;
            }
            let Some(by) = self.families.holder(&self.surface, vertex) else { continue };
            let name = |family: FamilyId| self.mesh.families[family.index()].clone();
            let held = found.entry((by, family)).or_insert_with(|| HeldBack {
                by: name(by),
                family: name(family),
                vertices: 0,
                max_distance: 0.0,
                at: DVec3::ZERO,
                beyond: None,
            });
            let at = self.ordered.vertices[vertex as usize];
            held.vertices += 1;
            // Not a number is as far as can be.
            if held.max_distance.is_finite() && (distance.is_nan() || distance > held.max_distance) {
                (held.max_distance, held.at) = (distance, at);
            }
            let edge = edges[&vertex];
            let worst = held.beyond.map_or(1.0, |beyond| beyond.distance / beyond.edge);
            if distance.is_nan() || distance / edge > worst {
                held.beyond = Some(Beyond { distance, edge, at });
            }
        }
        found.into_values().collect()
    }

    /// The diagonal of a family's bounding box.
    pub(super) fn size_of(&self, family: FamilyId) -> f64 {
        let at = |vertex: &u32| self.ordered.vertices[*vertex as usize];
        geometry::diagonal(self.surface.vertices_of(family).iter().map(at))
    }

    /// The shortest edge of a family's triangles at each of its vertices.
    fn edges_of(&self, family: FamilyId) -> BTreeMap<u32, f64> {
        let mut shortest = BTreeMap::new();
        for [a, b, c] in self.surface.corners_of(family) {
            for [a, b] in [[a, b], [b, c], [c, a]] {
                let length = self.ordered.vertices[a as usize].distance(self.ordered.vertices[b as usize]);
                for end in [a, b] {
                    shortest.entry(end).and_modify(|least: &mut f64| *least = least.min(length)).or_insert(length);
                }
            }
        }
        shortest
    }
}
