//! Looks at the surfaces after each stage: does one lie folded?

use std::collections::BTreeMap;

use glam::DVec3;

use crate::{
    families::{Families, PlacedBy},
    mesh::{FamilyId, TetMesh, half_edge::Surface},
    quality::faults::EdgeAngles,
};

/// What has been found wrong with the surfaces of one update.
pub(super) struct FoldCheck<'a> {
    mesh: &'a TetMesh,
    surface: &'a Surface,
    edge_angles: &'a EdgeAngles,
    families: &'a Families,
    /// Where the surface's vertices were when it was last looked at, in its order.
    last: Vec<DVec3>,
    /// Folded triangles of each family that has some, there; see
    /// [`crate::quality::faults::folded`].
    pub(super) folded: BTreeMap<FamilyId, usize>,
    /// Stages after which a triangle of a family placed so far was folded, with their number.
    pub(super) folds: Vec<(&'static str, usize)>,
}

impl<'a> FoldCheck<'a> {
    /// Nothing is wrong with the undeformed surfaces, `edge_angles` theirs.
    pub(super) fn new(
        mesh: &'a TetMesh,
        surface: &'a Surface,
        edge_angles: &'a EdgeAngles,
        families: &'a Families,
    ) -> Self {
        let last = surface.vertices().iter().map(|&vertex| mesh.vertices[vertex as usize]).collect();
        Self { mesh, surface, edge_angles, families, last, folded: BTreeMap::new(), folds: Vec::new() }
    }

    /// Looks at the surfaces after a stage.
    ///
    /// - `placed`: the families it and those before it place, by the last of their owners
    /// - `here` `[n_vertices]`: where the stage puts the vertices
    pub(super) fn fold_check(&mut self, stage: &'static str, placed: PlacedBy, here: &[DVec3]) {
        let surface = self.surface;
        let mut moves = false;
        for (last, &vertex) in self.last.iter_mut().zip(surface.vertices()) {
            moves |= *last != here[vertex as usize];
            *last = here[vertex as usize];
        }
        if moves {
            self.folded.clear();
            for triangle in self.edge_angles.folded(&self.mesh.vertices, here, &surface.triangles, &surface.opposite) {
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
