//! Cells and boundary faces of other shapes than tets and triangles, and the tets they split into.

use super::{FamilyId, lowest_of};

/// The pyramids, prisms, hexahedra and boundary quadrilaterals of a mesh, beside the tets and triangles of its
/// [`super::TetMesh`], whose vertices and families they name.
///
/// Vertices of a cell stand in the order of the CGNS standard (SIDS, section 3.3): the base so that its normal points
/// into the cell, then the apex or the top over the base.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OtherCells {
    /// Base of four and apex `[n_pyramids]`.
    pub pyramids: Vec<[u32; 5]>,
    /// Base of three and top `[n_prisms]`.
    pub prisms: Vec<[u32; 6]>,
    /// Base of four and top `[n_hexahedra]`.
    pub hexahedra: Vec<[u32; 8]>,
    /// Boundary quadrilaterals `[n_quadrilaterals]`, orientation as in the file.
    pub quadrilaterals: Vec<[u32; 4]>,
    /// Family of each quadrilateral `[n_quadrilaterals]`.
    pub quadrilateral_family: Vec<FamilyId>,
}

/// Faces of a cell by its corners, normals outward; of three corners or four.
type Faces = &'static [&'static [usize]];

const TET: Faces = &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]];
const PYRAMID: Faces = &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];
const PRISM: Faces = &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]];
const HEXAHEDRON: Faces = &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]];

impl OtherCells {
    /// Whether the mesh has tets and triangles only.
    pub fn is_empty(&self) -> bool {
        self.n_cells() == 0 && self.quadrilaterals.is_empty()
    }

    /// How many cells there are, quadrilaterals not counted.
    pub fn n_cells(&self) -> usize {
        self.pyramids.len() + self.prisms.len() + self.hexahedra.len()
    }

    /// How many there are of each shape, those that there are: `("pyramids", 12)`.
    pub fn counts(&self) -> impl Iterator<Item = (&'static str, usize)> {
        let counts = [
            ("pyramids", self.pyramids.len()),
            ("prisms", self.prisms.len()),
            ("hexahedra", self.hexahedra.len()),
            ("quadrilaterals", self.quadrilaterals.len()),
        ];
        counts.into_iter().filter(|&(_, count)| count > 0)
    }

    /// The tets the cells split into: two of a pyramid, three of a prism, six of a hexahedron, in that order of shapes.
    ///
    /// A cell is split from its lowest vertex, and each quadrilateral along the diagonal from its lowest, so that
    /// neighbours agree on the face between them (J. Dompierre and others, *How to Subdivide Pyramids, Prisms and
    /// Hexahedra into Tetrahedra*, 1999). The tets of a valid cell with plane faces have positive volumes.
    pub fn tets(&self) -> Vec<[u32; 4]> {
        let mut tets = Vec::with_capacity(2 * self.pyramids.len() + 3 * self.prisms.len() + 6 * self.hexahedra.len());
        self.pyramids.iter().for_each(|cell| split(cell, PYRAMID, &mut tets));
        self.prisms.iter().for_each(|cell| split(cell, PRISM, &mut tets));
        self.hexahedra.iter().for_each(|cell| split(cell, HEXAHEDRON, &mut tets));
        tets
    }
}

/// The faces of a cell of 4, 5, 6 or 8 vertices by its corners, normals outward; none of another.
pub fn cell_faces(n_vertices: usize) -> &'static [&'static [usize]] {
    match n_vertices {
        4 => TET,
        5 => PYRAMID,
        6 => PRISM,
        8 => HEXAHEDRON,
        _ => &[],
    }
}

/// Joins the lowest vertex of a cell to the triangles of the faces that do not touch it.
fn split(cell: &[u32], faces: Faces, tets: &mut Vec<[u32; 4]>) {
    let apex = cell[lowest_of(cell)];
    for face in faces {
        let mut corners = [0; 4];
        let corners = &mut corners[..face.len()];
        corners.iter_mut().zip(*face).for_each(|(corner, &of_cell)| *corner = cell[of_cell]);
        if corners.contains(&apex) {
            continue;
        }
        corners.rotate_left(lowest_of(corners));
        // Seen from inside, the outward triangle turns the other way: its normal points at the apex.
        for pair in corners[1..].windows(2) {
            tets.push([corners[0], pair[1], pair[0], apex]);
        }
    }
}
