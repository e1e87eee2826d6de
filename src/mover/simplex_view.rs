//! [`SimplexView`]: a mesh as tets and triangles only, for the places of faults.

use std::borrow::Cow;

use crate::mesh::{CornerCells, HybridMesh, OtherCells, TetMesh, halves};

/// A mesh as tets and triangles: tets and corner tets, triangles and the halves of quadrilaterals.
pub(super) struct SimplexView<'a> {
    /// In the order of the mesh that was given.
    pub(super) mesh: Cow<'a, TetMesh>,
    pub(super) cells: CornerCells,
    n_triangles: usize,
}

impl<'a> SimplexView<'a> {
    /// The view of a mesh. A mesh of tets is not copied.
    pub(super) fn new(mesh: &'a TetMesh, others: &OtherCells) -> Self {
        let n_triangles = mesh.triangles.len();
        if others.is_empty() {
            return Self { mesh: Cow::Borrowed(mesh), cells: CornerCells::of_tets(mesh.tets.len()), n_triangles };
        }
        let (mut simplices, cells) = CornerCells::new(HybridMesh { mesh, others });
        for (&face, &family) in others.quadrilaterals.iter().zip(&others.quadrilateral_family) {
            simplices.triangles.extend(halves(face, &mesh.vertices));
            simplices.triangle_family.extend([family; 2]);
        }
        Self { mesh: Cow::Owned(simplices), cells, n_triangles }
    }

    /// A triangle of a face, which counts triangles first and then quadrilaterals.
    pub(super) fn triangle_of(&self, face: u32) -> u32 {
        match (face as usize).checked_sub(self.n_triangles) {
            Some(quadrilateral) => (self.n_triangles + 2 * quadrilateral) as u32,
            None => face,
        }
    }
}
