//! The tet mesh with its named surface families, and the topology derived from it.
//!
//! Coordinates are f64. Vertices stand in the order of the file, or in an [`Order`] made for speed.
//! The other modules refer to vertices, tets and triangles by their indices here.

mod cell_quality;
mod corner_cells;
#[doc(hidden)]
pub mod corners;
#[doc(hidden)]
pub mod csr;
mod division;
#[doc(hidden)]
pub mod edges;
mod error;
#[doc(hidden)]
pub mod half_edge;
#[doc(hidden)]
pub mod half_face;
mod hilbert;
mod hybrid;
mod order;
mod other_cells;
mod refine;
mod refine_others;
mod size;
mod validate;

use std::collections::HashMap;
use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

pub use cell_quality::{
    CellMeasures, KindQuality, WorstCorner, by_kind, cell_volume, measures, measures_of_cell, middle_of_cell,
    worst_corner,
};
pub use corner_cells::{CornerCells, counted};
pub use division::{faces_of_families, halves, triangles_of_families};
pub use error::MeshError;
pub use half_face::{families_inside, partly_inside};
pub use hybrid::{CellKind, CellName, HybridMesh};
pub use order::Order;
pub(crate) use order::cells_around;
pub use other_cells::{OtherCells, cell_faces};
pub use refine::refine;
pub use refine_others::refine_hybrid;
pub use size::SIZES;
pub use validate::{Topology, check, check_size, mostly_left_handed, validate};

use crate::{geometry, quality};

/// Index of a family in [`TetMesh::families`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FamilyId(pub u16);

impl FamilyId {
    /// The family's position in [`TetMesh::families`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A tetrahedral mesh whose boundary triangles belong to named families.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetMesh {
    /// Coordinates `[n_vertices]`, in the unit of the file.
    pub vertices: Vec<DVec3>,
    /// Vertices of each tet `[n_tets]`; a valid tet has positive [`crate::quality::volume`].
    pub tets: Vec<[u32; 4]>,
    /// Vertices of each boundary triangle `[n_triangles]`, orientation as in the file.
    pub triangles: Vec<[u32; 3]>,
    /// Family of each boundary triangle `[n_triangles]`.
    pub triangle_family: Vec<FamilyId>,
    /// Names of the families, in the order of the file.
    pub families: Vec<String>,
}

impl TetMesh {
    /// The family with this name.
    pub fn family(&self, name: &str) -> Option<FamilyId> {
        self.families.iter().position(|family| family == name).map(|index| FamilyId(index as u16))
    }

    /// The families by their names, for many questions.
    pub fn families_by_name(&self) -> HashMap<&str, FamilyId> {
        // Of two families with one name the first counts, as for `family`.
        let named = self.families.iter().enumerate().rev();
        named.map(|(index, name)| (name.as_str(), FamilyId(index as u16))).collect()
    }

    /// The triangles of some families, in the order of the mesh.
    pub fn triangles_of(&self, families: &[FamilyId]) -> Vec<[u32; 3]> {
        let mut is_member = vec![false; self.families.len()];
        for family in families {
            is_member.get_mut(family.index()).into_iter().for_each(|is_member| *is_member = true);
        }
        let members = self.triangles.iter().zip(&self.triangle_family);
        let members = members.filter(|(_, other)| is_member.get(other.index()) == Some(&true));
        members.map(|(&triangle, _)| triangle).collect()
    }

    /// Whether there are tets, and all are left-handed: their [`crate::quality::volume`] is
    /// negative.
    ///
    /// Such a mesh comes from a mesh that was mirrored, or from a program with another order of
    /// vertices. If only some tets have a negative volume, they are inverted.
    pub fn is_left_handed(&self) -> bool {
        let is_left_handed = |&tet: &[u32; 4]| quality::volume(geometry::corners(&self.vertices, tet)) < 0.0;
        !self.tets.is_empty() && self.tets.iter().all(is_left_handed)
    }

    /// Turns every tet over: its second and its third vertex change places. Triangles stay.
    pub fn turn_over(&mut self) {
        self.tets.iter_mut().for_each(|tet| tet.swap(1, 2));
    }

    /// Turns every tet so that its two lowest vertices come first, ascending; its orientation
    /// stays.
    ///
    /// Formats begin a tet with different vertices, and OpenFOAM stores only its faces. After the
    /// rotation sums over a mesh have the same bits, whatever file the mesh came from.
    pub fn turn_tets(&mut self) {
        self.tets.iter_mut().for_each(|tet| *tet = turned(tet));
    }

    /// Whether the tets are turned as [`TetMesh::turn_tets`] turns them.
    pub(crate) fn has_turned_tets(&self) -> bool {
        self.tets.iter().all(|tet| turned(tet) == *tet)
    }
}

/// A tet with its lowest vertex first, and the lowest of the others second.
fn turned(tet: &[u32; 4]) -> [u32; 4] {
    // Each row is an even permutation, so the orientation does not change.
    const FIRST: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]];
    const SECOND: [[usize; 4]; 3] = [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2]];
    let [a, b, c, d] = FIRST[lowest_of(tet)].map(|place| tet[place]);
    SECOND[lowest_of(&[b, c, d])].map(|place| [a, b, c, d][place])
}

/// Position of the lowest vertex among the vertices of a cell or a face.
fn lowest_of(vertices: &[u32]) -> usize {
    (1..vertices.len()).fold(0, |lowest, place| if vertices[place] < vertices[lowest] { place } else { lowest })
}

/// Items in a task: some tens of microseconds of work. The number is fixed, so no result depends on
/// the number of threads.
const PIECE: usize = 2048;

/// Applies `work` to the items `0..n_items`, piece by piece in parallel. The results are in the
/// order of the pieces.
pub(crate) fn in_pieces<T: Send>(n_items: usize, work: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    let pieces = 0..n_items.div_ceil(PIECE);
    pieces.into_par_iter().map(|piece| work(piece * PIECE..n_items.min((piece + 1) * PIECE))).collect()
}

/// The items of all pieces, one piece after another, copied in parallel.
pub(crate) fn joined<T: Copy + Default + Send + Sync>(pieces: &[Vec<T>]) -> Vec<T> {
    let mut all = vec![T::default(); pieces.iter().map(Vec::len).sum()];
    let mut rest = &mut all[..];
    let mut places = Vec::with_capacity(pieces.len());
    for piece in pieces {
        let (place, others) = rest.split_at_mut(piece.len());
        places.push(place);
        rest = others;
    }
    places.into_par_iter().zip(pieces).for_each(|(place, piece)| place.copy_from_slice(piece));
    all
}

/// Displacement of every vertex of the mesh `[n_vertices]`, in the unit of length of the mesh.
pub type Displacement = Vec<DVec3>;
