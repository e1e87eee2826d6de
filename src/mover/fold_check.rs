//! [`FoldCheck`] counts folded surface triangles after each stage of an update.
//!
//! A refused result then names the stage that folded a triangle first.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::{
    families::{Families, PlacedBy},
    mesh::{FamilyId, TetMesh, half_edge::Surface},
    quality::faults::EdgeAngles,
};

/// The folded triangles of one update so far.
pub(super) struct FoldCheck<'a> {
    mesh: &'a TetMesh,
    surface: &'a Surface,
    edge_angles: &'a EdgeAngles,
    families: &'a Families,
    /// Positions of the surface's vertices at the last check `[n_vertices of the surface]`, in the
    /// order of [`Surface::vertices`].
    last: Vec<DVec3>,
    /// Number of folded triangles at the last check, of each family that has some; see
    /// [`crate::quality::faults::folded`].
    pub(super) folded: BTreeMap<FamilyId, usize>,
    /// Stages that left folded triangles in families placed so far, with the number of these
    /// triangles.
    pub(super) folds: Vec<(&'static str, usize)>,
}

impl<'a> FoldCheck<'a> {
    /// Begins with the undeformed surfaces, which count as not folded.
    ///
    /// - `edge_angles`: angles of the undeformed surfaces
    pub(super) fn new(
        mesh: &'a TetMesh,
        surface: &'a Surface,
        edge_angles: &'a EdgeAngles,
        families: &'a Families,
    ) -> Self {
        let last = surface.vertices().iter().map(|&vertex| mesh.vertices[vertex as usize]).collect();
        Self { mesh, surface, edge_angles, families, last, folded: BTreeMap::new(), folds: Vec::new() }
    }

    /// Counts the folded triangles after a stage.
    ///
    /// - `placed`: the last value of [`PlacedBy`] that this stage or an earlier one places; folds
    ///   count in families up to it
    /// - `here` `[n_vertices]`: positions after the stage, in the mesh's unit
    pub(super) fn fold_check(&mut self, stage: &'static str, placed: PlacedBy, here: &[DVec3]) {
        let surface = self.surface;
        let mut moves = false;
        for (last, &vertex) in self.last.iter_mut().zip(surface.vertices()) {
            moves |= *last != here[vertex as usize];
            *last = here[vertex as usize];
        }
        if moves {
            self.folded.clear();
            let folded = self.edge_angles.folded(&self.mesh.vertices, here, &surface.triangles, &surface.opposite);
            // A quadrilateral is folded if one of its triangles is.
            for triangle in surface.one_of_each_face(folded) {
                *self.folded.entry(surface.family[triangle as usize]).or_default() += 1;
            }
        }
        let is_placed = |family: &FamilyId| self.families.roles[family.index()].placed_by() <= placed;
        let count: usize = self.folded.iter().filter(|(family, _)| is_placed(family)).map(|(_, count)| count).sum();
        if count > 0 {
            self.folds.push((stage, count));
        }
    }
}
