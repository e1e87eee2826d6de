//! [`FoldCheck`] counts folded surface triangles after each stage of an update.
//!
//! A refused result then names the stage that folded a triangle first.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::{
    mesh::{FamilyId, TetMesh, half_edge::Surface},
    quality::faults::EdgeAngles,
    stage::SetUp,
    stages::StageRow,
};

/// The folded triangles of one update so far.
pub(super) struct FoldCheck {
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

impl FoldCheck {
    /// Begins with the undeformed surfaces, which count as not folded.
    pub(super) fn new(mesh: &TetMesh, surface: &Surface) -> Self {
        let last = surface.vertices().iter().map(|&vertex| mesh.vertices[vertex as usize]).collect();
        Self { last, folded: BTreeMap::new(), folds: Vec::new() }
    }

    /// Counts the folded triangles after a stage.
    ///
    /// - `set_up`: of the mesh of [`Self::new`]
    /// - `edge_angles`: angles of the undeformed surfaces
    /// - `stage`: folds count in families that this stage or an earlier one places
    /// - `here` `[n_vertices]`: positions after the stage, in the mesh's unit
    pub(super) fn fold_check(&mut self, set_up: &SetUp, edge_angles: &EdgeAngles, stage: &StageRow, here: &[DVec3]) {
        let SetUp { mesh, surface, families, .. } = set_up;
        let mut moves = false;
        for (last, &vertex) in self.last.iter_mut().zip(surface.vertices()) {
            moves |= *last != here[vertex as usize];
            *last = here[vertex as usize];
        }
        if moves {
            self.folded.clear();
            let folded = edge_angles.folded(&mesh.vertices, here, &surface.triangles, &surface.opposite);
            // A quadrilateral is folded if one of its triangles is.
            for triangle in surface.one_of_each_face(folded) {
                *self.folded.entry(surface.family[triangle as usize]).or_default() += 1;
            }
        }
        let is_placed = |family: &FamilyId| families.roles[family.index()].placed_by() <= stage.placed_by;
        let count: usize = self.folded.iter().filter(|(family, _)| is_placed(family)).map(|(_, count)| count).sum();
        if count > 0 {
            self.folds.push((stage.name, count));
        }
    }
}
