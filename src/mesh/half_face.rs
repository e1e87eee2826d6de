//! Half-face structure (HF) of the tets: the neighbour of each tet behind each of its faces.
//!
//! The structure is made of arrays: half-face `4 * tet + face` is the face opposite the tet's local
//! vertex `face`, and `opposite` holds the half-face on the other side. The paper (section 4) uses
//! HF for its volume mesh and gives no layout.

use std::ops::Range;

use rayon::prelude::*;

use super::{MeshError, TetMesh, csr::Csr, in_pieces};

/// Marks a half-face on the boundary: there is no tet behind it.
pub const BOUNDARY: u32 = u32::MAX;

/// Local vertices of the face opposite each local vertex. Seen from outside a tet of positive
/// volume they turn counter-clockwise.
pub const FACE: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The faces of a tet mesh and the tets behind them.
#[derive(Clone, Debug)]
pub struct HalfFaces {
    /// The half-face on the other side of each half-face `[4 * n_tets]`, or [`BOUNDARY`].
    pub opposite: Vec<u32>,
}

impl HalfFaces {
    /// Pairs the faces of all tets.
    ///
    /// # Errors
    /// - [`MeshError::FaceOfManyTets`]: more than two tets share a face
    /// - [`MeshError::DuplicateTet`]: two tets have the same four vertices
    pub fn new(mesh: &TetMesh) -> Result<Self, MeshError> {
        let n = mesh.tets.len() * 4;
        let lowest_of_faces = |&[a, b, c, d]: &[u32; 4]| {
            let (ab, cd) = (a.min(b), c.min(d));
            [b.min(cd), a.min(cd), ab.min(d), ab.min(c)]
        };
        let lowest: Vec<[u32; 4]> = mesh.tets.par_iter().map(lowest_of_faces).collect();
        let by_lowest = Csr::of_rows(mesh.vertices.len(), lowest.as_flattened());
        drop(lowest);
        let pairs_of = |vertices: Range<usize>| {
            let n_faces = by_lowest.row_start[vertices.end] - by_lowest.row_start[vertices.start];
            let mut pairs = Vec::with_capacity(n_faces as usize / 2);
            // The face's other vertices in the upper bits, the half-face in the lower bits: numbers
            // are sorted faster than tuples.
            let key = |&half_face: &u32| {
                let [_, middle, highest] = sorted_face(mesh, half_face).map(u128::from);
                middle << 64 | highest << 32 | u128::from(half_face)
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
                            if apex(mesh, a) == apex(mesh, b) {
                                return Err(duplicate_tet(mesh, a / 4, b / 4));
                            }
                            pairs.push([a, b]);
                        }
                        _ => {
                            let half_faces: Vec<u32> = same.iter().map(|&key| key as u32).collect();
                            return Err(many_tets(mesh, &half_faces));
                        }
                    }
                }
            }
            Ok(pairs)
        };
        let mut opposite = vec![BOUNDARY; n];
        for pairs in in_pieces(mesh.vertices.len(), pairs_of) {
            for [a, b] in pairs? {
                opposite[a as usize] = b;
                opposite[b as usize] = a;
            }
        }
        Ok(Self { opposite })
    }

    /// The tet behind a face of a tet. `None` on the boundary.
    pub fn neighbour(&self, tet: u32, face: usize) -> Option<u32> {
        let opposite = self.opposite[4 * tet as usize + face];
        (opposite != BOUNDARY).then_some(opposite / 4)
    }

    /// The half-faces on the boundary, ascending.
    pub fn boundary(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.opposite.len() as u32).filter(|&half_face| self.opposite[half_face as usize] == BOUNDARY)
    }
}

/// Vertices of a half-face. Seen from outside its tet they turn counter-clockwise.
pub fn face_vertices(mesh: &TetMesh, half_face: u32) -> [u32; 3] {
    let tet = mesh.tets[half_face as usize / 4];
    FACE[half_face as usize % 4].map(|local| tet[local])
}

fn sorted_face(mesh: &TetMesh, half_face: u32) -> [u32; 3] {
    let [a, b, c] = face_vertices(mesh, half_face);
    let (lowest, highest) = (a.min(b).min(c), a.max(b).max(c));
    [lowest, a ^ b ^ c ^ lowest ^ highest, highest]
}

fn apex(mesh: &TetMesh, half_face: u32) -> u32 {
    mesh.tets[half_face as usize / 4][half_face as usize % 4]
}

fn many_tets(mesh: &TetMesh, half_faces: &[u32]) -> MeshError {
    for (at, &a) in half_faces.iter().enumerate() {
        if let Some(&b) = half_faces[at + 1..].iter().find(|&&b| apex(mesh, a) == apex(mesh, b)) {
            return duplicate_tet(mesh, a / 4, b / 4);
        }
    }
    let tets = half_faces.iter().map(|half_face| half_face / 4).collect();
    let vertices = sorted_face(mesh, half_faces[0]);
    MeshError::FaceOfManyTets { vertices, tets, at: mesh.vertices[vertices[0] as usize] }
}

fn duplicate_tet(mesh: &TetMesh, first: u32, second: u32) -> MeshError {
    let at = mesh.vertices[mesh.tets[first as usize][0] as usize];
    MeshError::DuplicateTet { first, second, at }
}
