//! The faults of a mesh.

use glam::DVec3;
use thiserror::Error;

use super::size::SIZES;
use super::{CellKind, CellName};
use crate::text::figures::near;
use crate::text::shown;

/// A fault of a mesh. Vertices, tets and triangles are numbered from 0, in the order of the file.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum MeshError {
    #[error("the mesh has no cells")]
    NoTets,
    #[error("vertex {vertex} has the coordinates {at:?}; they must be finite numbers")]
    NotFinite { vertex: usize, at: [f64; 3] },
    #[error("{what} {index} names vertex {vertex}, but the mesh has the vertices 0..{n_vertices}")]
    VertexOutOfRange { what: &'static str, index: usize, vertex: u32, n_vertices: usize },
    #[error("{what} {index} names vertex {vertex} twice")]
    RepeatedVertex { what: &'static str, index: usize, vertex: u32 },
    #[error(
        "the mesh measures {size:e} of its unit, expected {:e} to {:e}: give it and all its lengths in another unit",
        SIZES.start(), SIZES.end()
    )]
    Size { size: f64 },
    #[error(
        "{count} of {n_tets} tets are inverted or flat; the first is tet {first} with volume {volume:e}, near {}; \
         a mesh must be valid before it is moved",
        near(*at)
    )]
    Inverted { count: usize, n_tets: usize, first: usize, volume: f64, at: DVec3 },
    #[error(
        "{count} of {n_cells} {} are left-handed (negative volume), the first is {} {first}, near {at:.6}{}; write the mesh \
         again with the vertices of all {} in one order, or {}",
        kind.plural(), kind.name(), right_handed.map_or(String::new(), |cell| format!(", but {} {cell} is not", kind.name())), kind.plural(),
        if *kind == CellKind::Tet { "swap two vertices of each left-handed tet" } else { "turn each left-handed one over" }
    )]
    LeftHanded { kind: CellKind, count: usize, n_cells: usize, first: usize, right_handed: Option<usize>, at: DVec3 },
    #[error(
        "{count} of {n_cells} {} are inverted or flat; the first is {} {first}, whose volume {} is {volume:e}, near {}; a mesh \
         must be valid before it is moved",
        kind.plural(), kind.name(), corner.map_or("as a whole".to_owned(), |corner| format!("at the corner at vertex {corner}")), near(*at)
    )]
    InvertedCell {
        kind: CellKind,
        count: usize,
        n_cells: usize,
        first: usize,
        /// The vertex of the corner. `None` if all corners are good, and the volume of the whole
        /// cell is not.
        corner: Option<u32>,
        /// Volume of the corner tet, or of the cell, in the cube of the mesh's unit.
        volume: f64,
        /// Position of the corner, or the middle of the cell, in the mesh's unit.
        at: DVec3,
    },
    #[error("{cell}, near {}, names a vertex twice; only meshes without such cells can be refined", near(*at))]
    Degenerate { cell: CellName, at: DVec3 },
    #[error("{what} {index} names so few different vertices that nothing of it is left; the first is vertex {at}")]
    Shrunk { what: &'static str, index: usize, at: u32 },
    #[error("{} and {} have the same vertices, near {}", cells[0], cells[1], near(*at))]
    DuplicateCell { cells: [CellName; 2], at: DVec3 },
    #[error(
        "the face with the vertices {vertices:?}, near {}, belongs to {} cells ({}); at most two can share a face",
        near(*at), cells.len(), cells.iter().map(CellName::to_string).collect::<Vec<_>>().join(", ")
    )]
    FaceOfManyCells { vertices: Vec<u32>, cells: Vec<CellName>, at: DVec3 },
    #[error(
        "{} and {} lie on the same side of their common face with the vertices {vertices:?}, near {}, or join its vertices in \
         another order; the mesh is folded over itself there, or one of the cells has its vertices in a wrong order",
        cells[0], cells[1], near(*at)
    )]
    SameSide { cells: [CellName; 2], vertices: Box<[u32]>, at: DVec3 },
    #[error(
        "{face} of the family '{}' joins the vertices {vertices:?}, near {}, in another order than the face of its cell",
        shown(family), near(*at)
    )]
    CrossedFace { face: String, family: String, vertices: Vec<u32>, at: DVec3 },
    #[error("refined, the mesh would not be valid: {0}")]
    Refined(Box<MeshError>),
    #[error(
        "the face with the vertices {vertices:?}, near {}, stands in the file twice, as {} of the family '{}' and as {} of the \
         family '{}'",
        near(*at), faces[0], shown(&families[0]), faces[1], shown(&families[1])
    )]
    DuplicateFace { faces: Box<[String; 2]>, families: Box<[String; 2]>, vertices: Vec<u32>, at: DVec3 },
    #[error(
        "{count} faces with a family are not faces of cells ({}); the first is {first} of the family '{}' with the vertices \
         {vertices:?}, near {}; a family holds faces of the boundary, or faces between two cells{}",
        listed(families), shown(family), near(*at), merge(*are_doubled)
    )]
    FacesOfNoCell {
        count: usize,
        /// The families of these faces, each with the number of them.
        families: Vec<(String, usize)>,
        first: Box<str>,
        /// The family of the first one.
        family: String,
        vertices: Box<[u32]>,
        at: DVec3,
        /// Whether other vertices are at the places of the first one's.
        are_doubled: bool,
    },
    #[error(
        "{inside} of the {all} faces of the family '{}' lie inside the volume, between two cells, the first of them near {}, \
         and the others on its boundary; give the faces inside a family of their own",
        shown(family), near(*at)
    )]
    PartlyInside { family: String, inside: usize, all: usize, at: DVec3 },
    #[error(
        "{count} faces on the boundary of the cells belong to no family; the first has the vertices {vertices:?}, near \
         {}; every boundary face needs a named surface group{}",
        near(*at), merge(*are_doubled)
    )]
    BoundaryWithoutFamily {
        count: usize,
        vertices: Vec<u32>,
        at: DVec3,
        /// Whether other vertices are at the places of the first one's.
        are_doubled: bool,
    },
    #[error("{triangles} boundary triangles meet in the edge {vertices:?} near {}; exactly two can", near(*at))]
    NonManifoldEdge { vertices: [u32; 2], triangles: usize, at: DVec3 },
}

/// What to do about doubled points, after a message.
fn merge(are_doubled: bool) -> &'static str {
    match are_doubled {
        true => {
            "; other vertices are at the same places: if its points are doubled, merge equal points (\"Clean to Grid\" in ParaView)"
        }
        false => "",
    }
}

/// Families with their numbers of faces, in words.
fn listed(families: &[(String, usize)]) -> String {
    let words: Vec<String> = families.iter().map(|(family, count)| format!("{count} of '{}'", shown(family))).collect();
    words.join(", ")
}
