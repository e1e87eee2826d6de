//! Vertices that a design moves with one family, and that another family holds.
//!
//! A vertex on a wing and on a fixed or prescribed family is such a vertex, and so is one on a
//! prescribed and on a fixed family.
//!
//! The surface is bent at a vertex that is held back, however good its triangles are. Only the user
//! knows whether the bend is meant. An outcome therefore lists these vertices, and is not valid if
//! one of them is held back by more than its shortest edge.

use std::collections::BTreeMap;

use glam::DVec3;

use super::Mover;
use crate::{
    families::Families,
    geometry,
    mesh::{Displacement, FamilyId, TetMesh, half_edge::Surface},
    stage::Wanted,
};

/// A vertex held back by at most this fraction of its family's size does not count.
const BACK: f64 = 1e-9;

/// The vertices of one family that another family holds back. Lengths are in the mesh's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldBack {
    /// The family that holds the vertices.
    pub by: String,
    /// The family with which the design moves the vertices.
    pub family: String,
    /// Number of the vertices.
    pub vertices: usize,
    /// Largest distance of a vertex from its place in the design.
    pub max_distance: f64,
    /// Original position of the vertex with the largest distance.
    pub at: DVec3,
    /// The vertex with the largest ratio of distance to shortest edge, if the ratio exceeds 1.
    pub beyond: Option<Beyond>,
}

/// A vertex held back by more than its shortest edge. Lengths are in the mesh's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beyond {
    /// Distance of the vertex from its place in the design.
    pub distance: f64,
    /// The shortest edge at the vertex, of those in the family that moves.
    pub edge: f64,
    /// Original position of the vertex.
    pub at: DVec3,
}

/// Finds the vertices that are held back, in pairs of families.
///
/// - `mesh`: in the mover's order
/// - `wanted`: displacements by families that do not place the vertex
/// - `displacement` `[n_vertices]`: displacements by the families that place the vertices
pub(super) fn held_back(
    mesh: &TetMesh,
    surface: &Surface,
    families: &Families,
    wanted: &[Wanted],
    displacement: &Displacement,
) -> Vec<HeldBack> {
    let mut measured: BTreeMap<FamilyId, (f64, BTreeMap<u32, f64>)> = BTreeMap::new();
    let mut found: BTreeMap<(FamilyId, FamilyId), HeldBack> = BTreeMap::new();
    for &Wanted { family, vertex, displacement: wanted } in wanted {
        let distance = wanted.distance(displacement[vertex as usize]);
        let (size, edges) = measured
            .entry(family)
            .or_insert_with(|| (size_of(mesh, surface, family), surface.shortest_edges(&mesh.vertices, family)));
        if distance <= BACK * *size {
            continue;
        }
        let Some(by) = families.holder(surface, vertex) else { continue };
        let name = |family: FamilyId| mesh.families[family.index()].clone();
        let held = found.entry((by, family)).or_insert_with(|| HeldBack {
            by: name(by),
            family: name(family),
            vertices: 0,
            max_distance: 0.0,
            at: DVec3::ZERO,
            beyond: None,
        });
        let at = mesh.vertices[vertex as usize];
        held.vertices += 1;
        // NaN counts as the largest distance.
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

/// The diagonal of a family's bounding box, in the mesh's unit.
fn size_of(mesh: &TetMesh, surface: &Surface, family: FamilyId) -> f64 {
    geometry::diagonal(surface.vertices_of(family).iter().map(|&vertex| mesh.vertices[vertex as usize]))
}

impl Mover {
    /// The diagonal of a family's bounding box, in the mesh's unit.
    pub(super) fn size_of(&self, family: FamilyId) -> f64 {
        size_of(&self.ordered, &self.surface, family)
    }
}
