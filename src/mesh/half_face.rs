//! Half-face structure (HF) of the cells: the neighbour of each cell behind each of its faces.
//!
//! The structure is made of arrays. The half-faces of the tets come first: half-face
//! `4 * tet + face` is the face opposite the tet's local vertex `face`. The half-faces of pyramids,
//! prisms and hexahedra follow: 5, 5 and 6 for each cell, in the order of [`cell_faces`].
//! `opposite` holds the half-face on the other side. The paper (section 4) uses HF for its volume
//! mesh of tets and gives no layout.

use std::ops::Range;

use rayon::prelude::*;

use super::{
    CellKind, CellName, HybridMesh, MeshError, cell_faces,
    corners::{Face, face_of, faces_of},
    csr::Csr,
    in_pieces,
};

/// Marks a half-face on the boundary: there is no cell behind it.
pub const BOUNDARY: u32 = u32::MAX;

/// Marks a face of a degenerate cell that has shrunk to an edge or a vertex.
const SHRUNK: u32 = u32::MAX - 1;

/// Local vertices of the face opposite each local vertex of a tet. Seen from outside a tet of
/// positive volume they turn counter-clockwise.
pub const FACE: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The faces of a mesh and the cells behind them.
#[derive(Clone, Debug)]
pub struct HalfFaces {
    /// The half-face on the other side of each half-face `[n_half_faces]`, or [`BOUNDARY`].
    pub opposite: Vec<u32>,
}

impl HalfFaces {
    /// Pairs the faces of all cells.
    ///
    /// # Errors
    /// - [`MeshError::FaceOfManyCells`]: more than two cells share a face
    /// - [`MeshError::DuplicateCell`]: two cells have the same vertices
    /// - [`MeshError::SameSide`]: two cells lie on the same side of their common face, or join its
    ///   vertices in another order
    pub fn new<'a>(mesh: impl Into<HybridMesh<'a>>) -> Result<Self, MeshError> {
        let mesh = mesh.into();
        let lowest_of_faces = |&[a, b, c, d]: &[u32; 4]| {
            let (ab, cd) = (a.min(b), c.min(d));
            [b.min(cd), a.min(cd), ab.min(d), ab.min(c)]
        };
        let of_tets: Vec<[u32; 4]> = mesh.mesh.tets.par_iter().map(lowest_of_faces).collect();
        let mut lowest = of_tets.into_flattened();
        for kind in &CellKind::ALL[1..] {
            for cell in mesh.cells_of(*kind) {
                let lowest_of = |face: &&[usize]| face_of(cell, face).map_or(SHRUNK, |face| face.key()[0]);
                lowest.extend(cell_faces(cell.len()).iter().map(lowest_of));
            }
        }
        let n = lowest.len();
        let mut opposite = vec![BOUNDARY; n];
        let by_lowest = if lowest.contains(&SHRUNK) {
            let faces = lowest.iter().copied().zip(0..);
            (0..n).filter(|&face| lowest[face] == SHRUNK).for_each(|face| opposite[face] = SHRUNK);
            Csr::from_pairs(mesh.vertices().len(), faces.filter(|&(vertex, _)| vertex != SHRUNK))
        } else {
            Csr::of_rows(mesh.vertices().len(), &lowest)
        };
        drop(lowest);
        let pairs_of = |vertices: Range<usize>| {
            let n_faces = by_lowest.row_start[vertices.end] - by_lowest.row_start[vertices.start];
            let mut pairs = Vec::with_capacity(n_faces as usize / 2);
            // The face's other vertices in the upper bits, the half-face in the lower bits: numbers
            // are sorted faster than tuples.
            let key = |&half_face: &u32| {
                let [_, second, third, fourth] = face_vertices(mesh, half_face).key().map(u128::from);
                second << 96 | third << 64 | fourth << 32 | u128::from(half_face)
            };
            let mut row: Vec<u128> = Vec::new();
            for vertex in vertices {
                row.clear();
                row.extend(by_lowest.row(vertex).iter().map(key));
                row.sort_unstable();
                for same in row.chunk_by(|a, b| a >> 32 == b >> 32) {
                    match *same {
                        [_] => {}
                        [a, b] => {
                            let (a, b) = (a as u32, b as u32);
                            if are_twins(mesh, a, b) {
                                return Err(duplicate(mesh, a, b));
                            }
                            if !face_vertices(mesh, a).is_turn_of(&face_vertices(mesh, b).turned_over()) {
                                return Err(same_side(mesh, a, b));
                            }
                            pairs.push([a, b]);
                        }
                        _ => {
                            let half_faces: Vec<u32> = same.iter().map(|&key| key as u32).collect();
                            return Err(many_cells(mesh, &half_faces));
                        }
                    }
                }
            }
            Ok(pairs)
        };
        for pairs in in_pieces(mesh.vertices().len(), pairs_of) {
            for [a, b] in pairs? {
                opposite[a as usize] = b;
                opposite[b as usize] = a;
            }
        }
        Ok(Self { opposite })
    }

    /// The tet behind a face of a tet, in a mesh of tets. `None` on the boundary.
    pub fn neighbour(&self, tet: u32, face: usize) -> Option<u32> {
        let opposite = self.opposite[4 * tet as usize + face];
        (opposite != BOUNDARY).then_some(opposite / 4)
    }

    /// Whether a half-face is a face. Some faces of a degenerate cell have shrunk to an edge or a
    /// vertex.
    pub fn is_face(&self, half_face: u32) -> bool {
        self.opposite[half_face as usize] != SHRUNK
    }

    /// The half-faces on the boundary, ascending.
    pub fn boundary(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.opposite.len() as u32).filter(|&half_face| self.opposite[half_face as usize] == BOUNDARY)
    }

    /// Of each two half-faces that face each other the lower one, ascending.
    pub fn inner(&self) -> impl Iterator<Item = u32> + '_ {
        let is_lower = |half_face: &u32| {
            let opposite = self.opposite[*half_face as usize];
            opposite < SHRUNK && *half_face < opposite
        };
        (0..self.opposite.len() as u32).filter(is_lower)
    }
}

/// The number of a half-face's cell, in the order of [`HybridMesh`].
pub fn cell_of(mesh: HybridMesh, half_face: u32) -> u32 {
    let (mut half_face, mut first) = (half_face, 0);
    for (kind, n_faces) in CellKind::ALL.into_iter().zip([4, 5, 5, 6]) {
        let count = mesh.count(kind) as u32;
        if half_face < n_faces * count {
            return first + half_face / n_faces;
        }
        (half_face, first) = (half_face - n_faces * count, first + count);
    }
    unreachable!("a half-face belongs to a cell")
}

/// The cell of a half-face, and the face's number in the cell.
fn place(mesh: HybridMesh, half_face: u32) -> (CellName, usize) {
    let mut rest = half_face as usize;
    for (kind, n_faces) in CellKind::ALL.into_iter().zip([4, 5, 5, 6]) {
        let of_kind = n_faces * mesh.count(kind);
        if rest < of_kind {
            return (CellName { kind, index: rest / n_faces }, rest % n_faces);
        }
        rest -= of_kind;
    }
    unreachable!("a half-face belongs to a cell")
}

/// Vertices of a half-face that has not shrunk. Seen from outside its cell they turn
/// counter-clockwise.
pub fn face_vertices(mesh: HybridMesh, half_face: u32) -> Face {
    if let Some(tet) = mesh.mesh.tets.get(half_face as usize / 4) {
        return Face::of_triangle(FACE[half_face as usize % 4].map(|local| tet[local]));
    }
    let (name, face) = place(mesh, half_face);
    let cell = mesh.cell(name);
    face_of(cell, cell_faces(cell.len())[face]).expect("faces that have shrunk are left out")
}

/// Whether two half-faces at one place belong to cells with the same vertices.
fn are_twins(mesh: HybridMesh, a: u32, b: u32) -> bool {
    let tet = |half_face: u32| mesh.mesh.tets.get(half_face as usize / 4);
    if let (Some(of_a), Some(of_b)) = (tet(a), tet(b)) {
        return of_a[a as usize % 4] == of_b[b as usize % 4];
    }
    let vertices = |half_face: u32| {
        let mut vertices = mesh.cell(place(mesh, half_face).0).to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    };
    vertices(a) == vertices(b)
}

fn many_cells(mesh: HybridMesh, half_faces: &[u32]) -> MeshError {
    for (at, &a) in half_faces.iter().enumerate() {
        if let Some(&b) = half_faces[at + 1..].iter().find(|&&b| are_twins(mesh, a, b)) {
            return duplicate(mesh, a, b);
        }
    }
    let cells: Vec<CellName> = half_faces.iter().map(|&half_face| place(mesh, half_face).0).collect();
    let mut vertices = face_vertices(mesh, half_faces[0]).vertices().to_vec();
    vertices.sort_unstable();
    let at = mesh.vertices()[vertices[0] as usize];
    MeshError::FaceOfManyCells { vertices, cells, at }
}

fn duplicate(mesh: HybridMesh, first: u32, second: u32) -> MeshError {
    let cells = [first, second].map(|half_face| place(mesh, half_face).0);
    let at = mesh.vertices()[mesh.cell(cells[0])[0] as usize];
    MeshError::DuplicateCell { cells, at }
}

fn same_side(mesh: HybridMesh, a: u32, b: u32) -> MeshError {
    let vertices: Box<[u32]> = face_vertices(mesh, a).vertices().into();
    let at = mesh.vertices()[vertices[0] as usize];
    MeshError::SameSide { cells: [a, b].map(|half_face| place(mesh, half_face).0), vertices, at }
}

/// The families all of whose faces lie inside the volume: between two cells `[n_families]`. Faces
/// that have shrunk to lines do not count, unless a family has no others: then it lies inside too.
/// A family without faces does not.
///
/// Faces are counted, without the whole topology.
pub fn families_inside<'a>(mesh: impl Into<HybridMesh<'a>>) -> Vec<bool> {
    let counts = count_inside(mesh.into());
    counts.into_iter().map(|count| count.inside + count.shrunk > 0 && count.inside == count.all).collect()
}

/// [`MeshError::PartlyInside`] for each family of which some faces lie inside the volume and others
/// do not. A mover refuses such a mesh; other uses of a mesh may only tell of it.
pub fn partly_inside<'a>(mesh: impl Into<HybridMesh<'a>>) -> Vec<MeshError> {
    let mesh = mesh.into();
    let counts = count_inside(mesh).into_iter().zip(&mesh.mesh.families);
    let error = |(count, family): (InFamily, &String)| {
        let first = count.first.filter(|_| count.inside < count.all)?;
        let at = mesh.vertices()[mesh.face_vertices(first)[0] as usize];
        Some(MeshError::PartlyInside { family: family.clone(), inside: count.inside, all: count.all, at })
    };
    counts.filter_map(error).collect()
}

/// The faces of a family.
#[derive(Clone, Copy, Default)]
struct InFamily {
    /// Number of faces, without those that have shrunk to lines.
    all: usize,
    shrunk: usize,
    /// Number of faces between two cells, and the first of them.
    inside: usize,
    first: Option<u32>,
}

/// The faces of each family `[n_families]`.
fn count_inside(mesh: HybridMesh) -> Vec<InFamily> {
    let faces = 0..mesh.n_faces() as u32;
    let mut cells_at: std::collections::HashMap<[u32; 4], u32> =
        faces.clone().filter_map(|face| Some((mesh.face(face)?.key(), 0))).collect();
    // Most faces of cells have a vertex that is on no face with a family. They are not looked up.
    let mut on_face = vec![false; mesh.vertices().len()];
    for &vertex in faces.clone().flat_map(|face| mesh.face_vertices(face)) {
        on_face.get_mut(vertex as usize).into_iter().for_each(|on_face| *on_face = true);
    }
    for cell in mesh.cells() {
        if cell.iter().filter(|&&vertex| on_face.get(vertex as usize) == Some(&true)).count() < 3 {
            continue;
        }
        for face in faces_of(cell) {
            if let Some(count) = cells_at.get_mut(&face.key()) {
                *count += 1;
            }
        }
    }
    let mut counts = vec![InFamily::default(); mesh.mesh.families.len()];
    for face in faces {
        let Some(count) = mesh.family_of(face).and_then(|family| counts.get_mut(family.index())) else { continue };
        let Some(vertices) = mesh.face(face) else {
            count.shrunk += 1;
            continue;
        };
        count.all += 1;
        if cells_at[&vertices.key()] == 2 {
            count.inside += 1;
            count.first = count.first.or(Some(face));
        }
    }
    counts
}
