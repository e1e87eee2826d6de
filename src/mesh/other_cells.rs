//! Cells that are not tets, boundary faces that are not triangles, and the tets that cells split
//! into.

use glam::DVec3;

use super::{FamilyId, lowest_of};
use crate::{geometry, quality};

/// The pyramids, prisms, hexahedra and boundary quadrilaterals of a mesh. They use the vertices and
/// families of a [`super::TetMesh`], which holds the tets and triangles.
///
/// The vertices of a cell have the order of the CGNS standard (SIDS, section 3.3): first the base,
/// whose normal points into the cell, then the apex, or the top above the base.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OtherCells {
    /// Four vertices of the base, then the apex `[n_pyramids]`.
    pub pyramids: Vec<[u32; 5]>,
    /// Three vertices of the base, then three of the top `[n_prisms]`.
    pub prisms: Vec<[u32; 6]>,
    /// Four vertices of the base, then four of the top `[n_hexahedra]`.
    pub hexahedra: Vec<[u32; 8]>,
    /// Vertices of each boundary quadrilateral `[n_quadrilaterals]`, orientation as in the file.
    pub quadrilaterals: Vec<[u32; 4]>,
    /// Family of each quadrilateral `[n_quadrilaterals]`.
    pub quadrilateral_family: Vec<FamilyId>,
}

/// Faces of a cell as local vertices, three or four each, with normals outward.
type Faces = &'static [&'static [usize]];

const TET: Faces = &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]];
const PYRAMID: Faces = &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];
const PRISM: Faces = &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]];
const HEXAHEDRON: Faces = &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]];

impl OtherCells {
    /// No cells.
    pub const fn none() -> Self {
        let quadrilateral_family = Vec::new();
        Self {
            pyramids: Vec::new(),
            prisms: Vec::new(),
            hexahedra: Vec::new(),
            quadrilaterals: Vec::new(),
            quadrilateral_family,
        }
    }

    /// Whether the mesh has only tets and triangles.
    pub fn is_empty(&self) -> bool {
        self.n_cells() == 0 && self.quadrilaterals.is_empty()
    }

    /// Number of pyramids, prisms and hexahedra. Quadrilaterals do not count.
    pub fn n_cells(&self) -> usize {
        self.pyramids.len() + self.prisms.len() + self.hexahedra.len()
    }

    /// Number of the cells' corner tets, if no cell is degenerate.
    pub fn n_corner_tets(&self) -> usize {
        4 * self.pyramids.len() + 6 * self.prisms.len() + 8 * self.hexahedra.len()
    }

    /// The shapes that occur and the number of each, for example `("pyramids", 12)`.
    pub fn counts(&self) -> impl Iterator<Item = (&'static str, usize)> {
        let counts = [
            ("pyramids", self.pyramids.len()),
            ("prisms", self.prisms.len()),
            ("hexahedra", self.hexahedra.len()),
            ("quadrilaterals", self.quadrilaterals.len()),
        ];
        counts.into_iter().filter(|&(_, count)| count > 0)
    }

    /// The tets that the cells split into: two per pyramid, three per prism, six per hexahedron, in
    /// this order of shapes.
    ///
    /// A cell is split from its lowest vertex, and each quadrilateral along the diagonal from its
    /// lowest vertex. So neighbours agree on the split of their common face (J. Dompierre and
    /// others, *How to Subdivide Pyramids, Prisms and Hexahedra into Tetrahedra*, 1999). The tets
    /// of a valid cell with plane faces have positive volumes.
    pub fn tets(&self) -> Vec<[u32; 4]> {
        let mut tets = Vec::with_capacity(2 * self.pyramids.len() + 3 * self.prisms.len() + 6 * self.hexahedra.len());
        self.pyramids.iter().for_each(|cell| split(cell, PYRAMID, &mut tets));
        self.prisms.iter().for_each(|cell| split(cell, PRISM, &mut tets));
        self.hexahedra.iter().for_each(|cell| split(cell, HEXAHEDRON, &mut tets));
        tets
    }

    /// The shapes of cells that occur, and whether all cells of the shape are left-handed: the
    /// volume of each, summed over the tets into which it splits, is negative.
    ///
    /// - `vertices` `[n_vertices]`: of the mesh, in any unit
    pub fn handedness(&self, vertices: &[DVec3]) -> Vec<(&'static str, bool)> {
        let of_shapes = [
            ("pyramids", are_left_handed(&self.pyramids, vertices, PYRAMID)),
            ("prisms", are_left_handed(&self.prisms, vertices, PRISM)),
            ("hexahedra", are_left_handed(&self.hexahedra, vertices, HEXAHEDRON)),
        ];
        of_shapes.into_iter().filter_map(|(name, are)| Some((name, are?))).collect()
    }

    /// Turns every cell of these shapes over, by a reflection that keeps its faces.
    ///
    /// - `shapes`: names as in [`OtherCells::handedness`]
    pub fn turn_over(&mut self, shapes: &[&str]) {
        fn turn<const N: usize>(cells: &mut [[u32; N]], places: [usize; N]) {
            cells.iter_mut().for_each(|cell| *cell = places.map(|place| cell[place]));
        }
        for shape in shapes {
            match *shape {
                "pyramids" => turn(&mut self.pyramids, [0, 3, 2, 1, 4]),
                "prisms" => turn(&mut self.prisms, [0, 2, 1, 3, 5, 4]),
                "hexahedra" => turn(&mut self.hexahedra, [0, 3, 2, 1, 4, 7, 6, 5]),
                _ => {}
            }
        }
    }
}

/// Whether all cells of a shape are left-handed. `None` if there are none.
fn are_left_handed<const N: usize>(cells: &[[u32; N]], vertices: &[DVec3], faces: Faces) -> Option<bool> {
    let mut tets = Vec::new();
    let mut is_left_handed = |cell: &[u32; N]| {
        tets.clear();
        split(cell, faces, &mut tets);
        tets.iter().map(|&tet| quality::volume(geometry::corners(vertices, tet))).sum::<f64>() < 0.0
    };
    (!cells.is_empty()).then(|| cells.iter().all(&mut is_left_handed))
}

/// Faces of a cell with 4, 5, 6 or 8 vertices as local vertices, with normals outward. Empty for
/// any other number.
pub fn cell_faces(n_vertices: usize) -> &'static [&'static [usize]] {
    match n_vertices {
        4 => TET,
        5 => PYRAMID,
        6 => PRISM,
        8 => HEXAHEDRON,
        _ => &[],
    }
}

/// Joins the lowest vertex of a cell to the triangles of the faces that do not hold this vertex.
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
        // Seen from inside, an outward triangle turns the other way: its normal then points at the
        // apex.
        for pair in corners[1..].windows(2) {
            tets.push([corners[0], pair[1], pair[0], apex]);
        }
    }
}
