//! Half-face structure (HF) of the tets: which tet lies behind each face of each tet.
//!
//! Array-based: half-face `4 * tet + face` is the face opposite the tet's local vertex `face`; `opposite` holds the
//! half-face on the other side. The paper (section 4) uses HF for its volume mesh; it gives no layout.

use super::{MeshError, TetMesh, csr::Csr};

/// Marks a half-face with no tet behind it.
pub const BOUNDARY: u32 = u32::MAX;

/// Local vertices of the face opposite each local vertex, seen from outside a positive tet counter-clockwise.
pub const FACE: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The faces of a tet mesh and what lies behind them.
#[derive(Clone, Debug)]
pub struct HalfFaces {
    /// For each half-face `[4 * n_tets]` the half-face on its other side, or [`BOUNDARY`].
    pub opposite: Vec<u32>,
}

impl HalfFaces {
    /// Pairs the faces of all tets.
    ///
    /// # Errors
    /// [`MeshError::FaceOfManyTets`] when more than two tets share a face, [`MeshError::DuplicateTet`] when two of them
    /// have the same four vertices.
    pub fn new(mesh: &TetMesh) -> Result<Self, MeshError> {
        let n = mesh.tets.len() * 4;
        let lowest = (0..n).map(|half_face| (sorted_face(mesh, half_face as u32)[0], half_face as u32));
        let by_lowest = Csr::from_pairs(mesh.vertices.len(), lowest);
        let mut opposite = vec![BOUNDARY; n];
        let mut row: Vec<([u32; 3], u32)> = Vec::new();
        for vertex in 0..mesh.vertices.len() {
            row.clear();
            row.extend(by_lowest.row(vertex).iter().map(|&half_face| (sorted_face(mesh, half_face), half_face)));
            row.sort_unstable();
            for same in row.chunk_by(|a, b| a.0 == b.0) {
                match *same {
                    [_] => {}
                    [(_, a), (_, b)] => {
                        if apex(mesh, a) == apex(mesh, b) {
                            return Err(MeshError::DuplicateTet { first: a / 4, second: b / 4 });
                        }
                        opposite[a as usize] = b;
                        opposite[b as usize] = a;
                    }
                    _ => return Err(many_tets(mesh, same)),
                }
            }
        }
        Ok(Self { opposite })
    }

    /// The tet behind a tet's face, if any.
    pub fn neighbour(&self, tet: u32, face: usize) -> Option<u32> {
        let opposite = self.opposite[4 * tet as usize + face];
        (opposite != BOUNDARY).then_some(opposite / 4)
    }

    /// The half-faces with no tet behind them, ascending.
    pub fn boundary(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.opposite.len() as u32).filter(|&half_face| self.opposite[half_face as usize] == BOUNDARY)
    }
}

/// Vertices of a half-face, counter-clockwise seen from outside its tet.
pub fn face_vertices(mesh: &TetMesh, half_face: u32) -> [u32; 3] {
    let tet = mesh.tets[half_face as usize / 4];
    FACE[half_face as usize % 4].map(|local| tet[local])
}

fn sorted_face(mesh: &TetMesh, half_face: u32) -> [u32; 3] {
    let mut face = face_vertices(mesh, half_face);
    face.sort_unstable();
    face
}

fn apex(mesh: &TetMesh, half_face: u32) -> u32 {
    mesh.tets[half_face as usize / 4][half_face as usize % 4]
}

fn many_tets(mesh: &TetMesh, same: &[([u32; 3], u32)]) -> MeshError {
    for (at, &(_, a)) in same.iter().enumerate() {
        if let Some(&(_, b)) = same[at + 1..].iter().find(|&&(_, b)| apex(mesh, a) == apex(mesh, b)) {
            return MeshError::DuplicateTet { first: a / 4, second: b / 4 };
        }
    }
    MeshError::FaceOfManyTets { vertices: same[0].0, tets: same.iter().map(|&(_, half_face)| half_face / 4).collect() }
}
