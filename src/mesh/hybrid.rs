//! [`HybridMesh`]: a view of all cells and all boundary faces of a mesh, whatever their kinds.
//!
//! Cells are numbered in the order tets, pyramids, prisms, hexahedra, and within a kind as in the
//! mesh. Boundary faces are numbered in the order triangles, quadrilaterals.

use std::fmt;

use glam::DVec3;

use super::{FamilyId, OtherCells, TetMesh, corners::Face};

/// A kind of cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs, reason = "the names say it")]
pub enum CellKind {
    Tet,
    Pyramid,
    Prism,
    Hexahedron,
}

impl CellKind {
    /// All kinds, in the order in which cells are numbered.
    pub const ALL: [Self; 4] = [Self::Tet, Self::Pyramid, Self::Prism, Self::Hexahedron];

    /// The name of one cell.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tet => "tet",
            Self::Pyramid => "pyramid",
            Self::Prism => "prism",
            Self::Hexahedron => "hexahedron",
        }
    }

    /// The name of several cells.
    pub const fn plural(self) -> &'static str {
        match self {
            Self::Tet => "tets",
            Self::Pyramid => "pyramids",
            Self::Prism => "prisms",
            Self::Hexahedron => "hexahedra",
        }
    }
}

/// A cell by its kind and its number among the cells of this kind, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct CellName {
    /// The kind.
    pub kind: CellKind,
    /// The number in the mesh's list of this kind.
    pub index: usize,
}

impl fmt::Display for CellName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.kind.name(), self.index)
    }
}

/// All cells and boundary faces of a mesh.
#[derive(Clone, Copy)]
pub struct HybridMesh<'a> {
    /// Vertices, tets, triangles and families.
    pub mesh: &'a TetMesh,
    /// The other cells and the quadrilaterals.
    pub others: &'a OtherCells,
}

impl<'a> From<&'a TetMesh> for HybridMesh<'a> {
    fn from(mesh: &'a TetMesh) -> Self {
        static NONE: OtherCells = OtherCells::none();
        Self { mesh, others: &NONE }
    }
}

impl<'a> HybridMesh<'a> {
    /// Positions of the vertices `[n_vertices]`, in the mesh's unit.
    pub fn vertices(&self) -> &'a [DVec3] {
        &self.mesh.vertices
    }

    /// Number of cells of a kind.
    pub fn count(&self, kind: CellKind) -> usize {
        match kind {
            CellKind::Tet => self.mesh.tets.len(),
            CellKind::Pyramid => self.others.pyramids.len(),
            CellKind::Prism => self.others.prisms.len(),
            CellKind::Hexahedron => self.others.hexahedra.len(),
        }
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.mesh.tets.len() + self.others.n_cells()
    }

    /// The vertices of one cell of a kind.
    pub fn cell(&self, CellName { kind, index }: CellName) -> &'a [u32] {
        match kind {
            CellKind::Tet => &self.mesh.tets[index],
            CellKind::Pyramid => &self.others.pyramids[index],
            CellKind::Prism => &self.others.prisms[index],
            CellKind::Hexahedron => &self.others.hexahedra[index],
        }
    }

    /// All cells of a kind, in order.
    pub fn cells_of(self, kind: CellKind) -> impl Iterator<Item = &'a [u32]> {
        (0..self.count(kind)).map(move |index| self.cell(CellName { kind, index }))
    }

    /// The kind and the number in the kind of the cell with this number.
    pub fn name(&self, mut cell: usize) -> CellName {
        for kind in CellKind::ALL {
            if cell < self.count(kind) {
                return CellName { kind, index: cell };
            }
            cell -= self.count(kind);
        }
        CellName { kind: CellKind::Hexahedron, index: self.others.hexahedra.len() + cell }
    }

    /// All cells, in order.
    pub fn cells(self) -> impl Iterator<Item = &'a [u32]> {
        CellKind::ALL.into_iter().flat_map(move |kind| self.cells_of(kind))
    }

    /// Number of boundary faces, with faces inside the volume that have a family.
    pub fn n_faces(&self) -> usize {
        self.mesh.triangles.len() + self.others.quadrilaterals.len()
    }

    /// The vertices of a face with a family.
    pub fn face_vertices(&self, face: u32) -> &'a [u32] {
        let face = face as usize;
        match self.mesh.triangles.get(face) {
            Some(triangle) => triangle,
            None => &self.others.quadrilaterals[face - self.mesh.triangles.len()],
        }
    }

    /// A face with a family. `None` if it has fewer than three different vertices.
    pub fn face(&self, face: u32) -> Option<Face> {
        Face::new(self.face_vertices(face))
    }

    /// The family of a face. `None` if the mesh has no such family.
    pub fn family_of(&self, face: u32) -> Option<FamilyId> {
        let (face, n_triangles) = (face as usize, self.mesh.triangles.len());
        match face.checked_sub(n_triangles) {
            None => self.mesh.triangle_family.get(face).copied(),
            Some(quadrilateral) => self.others.quadrilateral_family.get(quadrilateral).copied(),
        }
    }

    /// A face in words, such as `triangle 7`. Triangles and quadrilaterals are counted apart, from
    /// 0.
    pub fn face_name(&self, face: u32) -> String {
        match (face as usize).checked_sub(self.mesh.triangles.len()) {
            None => format!("triangle {face}"),
            Some(quadrilateral) => format!("quadrilateral {quadrilateral}"),
        }
    }
}
