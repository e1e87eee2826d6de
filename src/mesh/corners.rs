//! Corners and corner tets of cells.
//!
//! A *corner* is a vertex of a cell at which three edges of the cell meet. The corner and the other
//! ends of these edges are its *corner tet*. A tet has one corner tet, itself. A pyramid has four
//! (none at its apex), a prism six and a hexahedron eight. In a valid cell every corner tet has a
//! positive volume.
//!
//! Corner tets stand in for cells wherever the method needs tets: in the stiffness of springs, in
//! the check for inverted cells, and in local optimisation. Unlike a split into tets they do not
//! depend on the numbers of the vertices, and a valid cell with warped faces has no bad one. The
//! paper moves tets only.
//!
//! **Degenerate cells.** Files hold hexahedra and prisms that name a vertex twice, because an edge
//! or a face has shrunk to a vertex. The corners of such a cell are the vertices at which three
//! of its remaining faces meet.

use super::cell_faces;

/// Local vertices of the corner tets of a pyramid. The first one is the corner.
const PYRAMID: [[usize; 4]; 4] = [[0, 1, 3, 4], [1, 2, 0, 4], [2, 3, 1, 4], [3, 0, 2, 4]];

/// Local vertices of the corner tets of a prism. The first one is the corner.
const PRISM: [[usize; 4]; 6] = [[0, 1, 2, 3], [1, 2, 0, 4], [2, 0, 1, 5], [3, 5, 4, 0], [4, 3, 5, 1], [5, 4, 3, 2]];

/// Local vertices of the corner tets of a hexahedron. The first one is the corner.
const HEXAHEDRON: [[usize; 4]; 8] =
    [[0, 1, 3, 4], [1, 2, 0, 5], [2, 3, 1, 6], [3, 0, 2, 7], [4, 7, 5, 0], [5, 4, 6, 1], [6, 5, 7, 2], [7, 6, 4, 3]];

/// Adds the corner tets of a cell with 4, 5, 6 or 8 vertices, in the order of the cell's vertices.
///
/// The first vertex of a corner tet is the corner. Its volume is positive in a valid cell.
pub fn corner_tets(cell: &[u32], tets: &mut Vec<[u32; 4]>) {
    if is_degenerate(cell) {
        return corner_tets_of_faces(cell, tets);
    }
    let table: &[[usize; 4]] = match cell.len() {
        4 => &[[0, 1, 2, 3]],
        5 => &PYRAMID,
        6 => &PRISM,
        8 => &HEXAHEDRON,
        _ => &[],
    };
    tets.extend(table.iter().map(|corner| corner.map(|local| cell[local])));
}

/// Number of corner tets of a cell.
pub fn n_corner_tets(cell: &[u32]) -> usize {
    let mut tets = Vec::new();
    corner_tets(cell, &mut tets);
    tets.len()
}

/// Whether a cell names a vertex twice.
pub fn is_degenerate(cell: &[u32]) -> bool {
    cell.iter().enumerate().any(|(place, vertex)| cell[..place].contains(vertex))
}

/// Whether a cell of another kind has shrunk to a tet: four different vertices are left.
pub fn is_tet(cell: &[u32]) -> bool {
    let is_new = |&(place, vertex): &(usize, &u32)| !cell[..place].contains(vertex);
    cell.len() > 4 && cell.iter().enumerate().filter(is_new).count() == 4
}

/// The faces of a cell with normals outward, each with three or four different vertices.
///
/// A face of a degenerate cell that has only two different vertices is no face. A quadrilateral
/// with three different vertices is a triangle.
pub fn faces_of(cell: &[u32]) -> impl Iterator<Item = Face> + '_ {
    cell_faces(cell.len()).iter().filter_map(|face| face_of(cell, face))
}

/// The face of a cell with these local vertices. `None` if it has shrunk to an edge or a vertex.
pub(super) fn face_of(cell: &[u32], face: &[usize]) -> Option<Face> {
    let mut corners = [0; 4];
    let corners = &mut corners[..face.len()];
    corners.iter_mut().zip(face).for_each(|(corner, &local)| *corner = cell[local]);
    Face::new(corners)
}

/// The vertices of a triangle or a quadrilateral in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    corners: [u32; 4],
    len: u8,
}

impl AsRef<[u32]> for Face {
    fn as_ref(&self) -> &[u32] {
        self.vertices()
    }
}

impl Face {
    /// The face with these vertices, of which vertices equal to the one before are left out. `None`
    /// if fewer than three are left.
    pub fn new(vertices: &[u32]) -> Option<Self> {
        let (mut corners, mut len) = ([u32::MAX; 4], 0);
        for (place, &vertex) in vertices.iter().enumerate() {
            let before = vertices[(place + vertices.len() - 1) % vertices.len()];
            if vertex != before {
                corners[len] = vertex;
                len += 1;
            }
        }
        // The two sides of a quadrilateral whose opposite corners coincide have no area.
        let folded = len == 4 && (corners[0] == corners[2] || corners[1] == corners[3]);
        (len >= 3 && !folded).then_some(Self { corners, len: len as u8 })
    }

    /// The triangle with three different vertices.
    pub fn of_triangle([a, b, c]: [u32; 3]) -> Self {
        Self { corners: [a, b, c, u32::MAX], len: 3 }
    }

    /// The vertices in order.
    pub fn vertices(&self) -> &[u32] {
        &self.corners[..usize::from(self.len)]
    }

    /// The same face with other numbers of its vertices.
    pub fn renumbered(mut self, number: impl Fn(u32) -> u32) -> Self {
        self.corners[..usize::from(self.len)].iter_mut().for_each(|vertex| *vertex = number(*vertex));
        self
    }

    /// The same face seen from the other side.
    pub fn turned_over(mut self) -> Self {
        self.corners[..usize::from(self.len)].reverse();
        self
    }

    /// Whether another face has the same vertices in the same cyclic order.
    pub fn is_turn_of(&self, other: &Self) -> bool {
        let (own, other) = (self.vertices(), other.vertices());
        let Some(start) = other.iter().position(|vertex| *vertex == own[0]) else { return false };
        own.len() == other.len() && (0..own.len()).all(|place| own[place] == other[(start + place) % other.len()])
    }

    /// The same for every face with these vertices: the vertices ascending. In a triangle a zero
    /// follows the lowest vertex.
    ///
    /// The zero is unambiguous: only the lowest vertex, which stands before it, can have this
    /// number.
    pub fn key(&self) -> [u32; 4] {
        let mut sorted = self.corners;
        if self.len == 3 {
            let [a, b, c, _] = sorted;
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            return [low, 0, a ^ b ^ c ^ low ^ high, high];
        }
        sorted.sort_unstable();
        sorted
    }
}

/// The corner tets of a cell from its faces: one for each vertex at which three faces meet.
fn corner_tets_of_faces(cell: &[u32], tets: &mut Vec<[u32; 4]>) {
    let faces: Vec<Face> = faces_of(cell).collect();
    for (place, &corner) in cell.iter().enumerate() {
        if cell[..place].contains(&corner) {
            continue;
        }
        // Each face at the corner, seen from outside, comes from one neighbour and goes to another.
        let around: Vec<[u32; 2]> = faces.iter().filter_map(|face| beside(face.vertices(), corner)).collect();
        let [[from, to], ..] = around[..] else { continue };
        if around.len() != 3 {
            continue;
        }
        // The face that goes on where the first one ended.
        if let Some(&[_, third]) = around.iter().find(|next| next[0] == to)
            && ![from, to].contains(&third)
        {
            tets.push([corner, from, to, third]);
        }
    }
}

/// The vertices before and after a vertex of a face.
fn beside(face: &[u32], vertex: u32) -> Option<[u32; 2]> {
    let n = face.len();
    let place = face.iter().position(|&other| other == vertex)?;
    Some([face[(place + n - 1) % n], face[(place + 1) % n]])
}
