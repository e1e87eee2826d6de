//! The faults of a mesh.

use glam::DVec3;
use thiserror::Error;

use super::size::SIZES;
use crate::text::figures::near;
use crate::text::shown;

/// A fault of a mesh. Vertices, tets and triangles are numbered from 0, in the order of the file.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum MeshError {
    #[error("the mesh has no tets")]
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
        "{count} of {n_tets} tets are left-handed (negative volume), the first is tet {first}, near {at:.6}{}; write the mesh \
         again with the vertices of all tets in one order, or swap two vertices of each left-handed tet",
        right_handed.map_or(String::new(), |tet| format!(", but tet {tet} is not"))
    )]
    LeftHanded { count: usize, n_tets: usize, first: usize, right_handed: Option<usize>, at: DVec3 },
    #[error("tets {first} and {second} have the same four vertices, near {}", near(*at))]
    DuplicateTet { first: u32, second: u32, at: DVec3 },
    #[error(
        "the face with the vertices {vertices:?}, near {}, belongs to {} tets ({tets:?}); at most two can share a face",
        near(*at), tets.len()
    )]
    FaceOfManyTets { vertices: [u32; 3], tets: Vec<u32>, at: DVec3 },
    #[error(
        "the triangle with the vertices {vertices:?}, near {}, stands in the file twice, as triangle {} of the family '{}' and as \
         triangle {} of the family '{}'",
        near(*at), triangles[0], shown(&families[0]), triangles[1], shown(&families[1])
    )]
    DuplicateTriangle { triangles: [u32; 2], families: [String; 2], vertices: [u32; 3], at: DVec3 },
    #[error(
        "{count} triangles are not faces on the boundary of the tets ({}); the first is triangle {first} of the family '{}' with \
         the vertices {vertices:?}, near {}; a family holds faces of the boundary only, not faces inside the volume",
        listed(families), shown(family), near(*at)
    )]
    TrianglesNotOnBoundary {
        count: usize,
        /// The families of these triangles, each with the number of them.
        families: Vec<(String, usize)>,
        first: u32,
        /// The family of the first one.
        family: String,
        vertices: [u32; 3],
        at: DVec3,
    },
    #[error(
        "{count} faces on the boundary of the tets belong to no family; the first has the vertices {vertices:?}, near \
         {}; every boundary face needs a named surface group",
        near(*at)
    )]
    BoundaryWithoutFamily { count: usize, vertices: [u32; 3], at: DVec3 },
    #[error("{triangles} boundary triangles meet in the edge {vertices:?} near {}; exactly two can", near(*at))]
    NonManifoldEdge { vertices: [u32; 2], triangles: usize, at: DVec3 },
}

/// Families with their numbers of triangles, in words.
fn listed(families: &[(String, usize)]) -> String {
    let words: Vec<String> = families.iter().map(|(family, count)| format!("{count} of '{}'", shown(family))).collect();
    words.join(", ")
}
