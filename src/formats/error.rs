//! Errors of reading and writing mesh files.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use glam::DVec3;
use thiserror::Error;

use super::placed::PlaceError;
use crate::memory::MemoryError;
use crate::text::figures::place as place_of;
use crate::text::shown;

/// A place in a file: a line of a text file, a byte of the decompressed contents of a binary file,
/// or a node of a tree.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Location {
    /// A line of a text file, from 1.
    Line(PathBuf, usize),
    /// An offset in a binary file, from 0.
    Byte(PathBuf, usize),
    /// A node of a CGNS file: the names on the way to it, such as `/Base/Zone/GridCoordinates`.
    Node(PathBuf, String),
    /// The whole file.
    File(PathBuf),
}

impl Location {
    /// Path of the file.
    pub fn path(&self) -> &Path {
        let (Self::Line(path, _) | Self::Byte(path, _) | Self::Node(path, _) | Self::File(path)) = self;
        path
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Location::Line(path, line) => write!(f, "{}:{line}", path.display()),
            Location::Byte(path, byte) => write!(f, "{}: byte {byte}", path.display()),
            Location::Node(path, node) => write!(f, "{}: {}", path.display(), shown(node)),
            Location::File(path) => write!(f, "{}", path.display()),
        }
    }
}

/// An error of reading a mesh.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The file is missing or cannot be read.
    #[error("{}: cannot read the mesh: {source}", path.display())]
    Io {
        /// Path of the mesh file, or of a file beside it.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The file's gzip stream is broken.
    #[error("{}: cannot be unzipped, the file is damaged or cut short: {source}", path.display())]
    Zipped {
        /// Path of the mesh file.
        path: PathBuf,
        /// The error in the stream.
        source: io::Error,
    },
    /// The file, or a part of it, unpacks to suspiciously many bytes.
    #[error(
        "{}: {what} unpacks to {} bytes, expected at most {most} from a file of {packed} bytes; if the file is what \
         you expect, allow more with --max-memory", path.display(), if *is_all { bytes.to_string() } else { format!("more than {bytes}") }
    )]
    Unpacked {
        /// Path of the file.
        path: PathBuf,
        /// The part.
        what: String,
        /// Bytes of the unpacked part.
        bytes: u64,
        /// Whether these are all bytes. Otherwise there are more.
        is_all: bool,
        /// Bytes of the packed file.
        packed: u64,
        /// The most bytes that are unpacked.
        most: u64,
    },
    /// The memory does not hold the file.
    #[error("{}: {error}", path.display())]
    Memory {
        /// Path of the file.
        path: PathBuf,
        /// Bytes needed and available.
        error: MemoryError,
    },
    /// No format has this extension.
    #[error("{}: unknown mesh format; known are {known}, each also with .gz", path.display())]
    UnknownFormat {
        /// Path of the mesh file.
        path: PathBuf,
        /// The extensions that can be read.
        known: String,
    },
    /// The file is empty.
    #[error("{}: the file is empty", path.display())]
    Empty {
        /// Path of the mesh file.
        path: PathBuf,
    },
    /// The version or variant of the format is not supported.
    #[error("{}: {found} is not read; {hint}", path.display(), found = shown(found))]
    Unsupported {
        /// Path of the mesh file.
        path: PathBuf,
        /// Name of the version or variant.
        found: String,
        /// Advice for the user.
        hint: &'static str,
    },
    /// The file holds something else than the format requires.
    #[error("{place}: expected {expected}, found {found}", expected = shown(expected), found = shown(found))]
    Malformed {
        /// Place in the file.
        place: Location,
        /// The contents that the format requires.
        expected: String,
        /// The contents found.
        found: String,
    },
    /// A file beside the mesh holds something else than the format requires, and is a link to a
    /// file in another folder. Whoever made the link may not be allowed to see that file, so it is
    /// not quoted.
    #[error(
        "{place}: not what the format requires there; what stands there is not shown, because the file is a link out of the \
         mesh's folder"
    )]
    Linked {
        /// Place in the file.
        place: Location,
    },
    /// The file ends too early.
    #[error("{place}: the file ends where {expected} should stand", expected = shown(expected))]
    Truncated {
        /// End of the file.
        place: Location,
        /// The contents that the format requires there.
        expected: String,
    },
    /// A count is too large for the rest of the file.
    #[error("{place}: {what} is {count}, but only {remaining} bytes of the file are left")]
    AbsurdCount {
        /// Place of the count.
        place: Location,
        /// The counted entities.
        what: &'static str,
        /// The count.
        count: u64,
        /// Number of bytes after the count.
        remaining: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("{place}: vertex {vertex} has coordinate {value}, not a finite number")]
    NotFinite {
        /// Place of the coordinate.
        place: Location,
        /// Tag of the vertex in the file.
        vertex: u64,
        /// The coordinate.
        value: f64,
    },
    /// Two vertices have the same tag.
    #[error("{place}: the vertex with these coordinates has tag {tag}, which an earlier vertex has too")]
    DuplicateVertex {
        /// Place of the second vertex's coordinates.
        place: Location,
        /// The common tag.
        tag: u64,
    },
    /// An element names a vertex that the file does not define.
    #[error("{place}: {entity} {element} names vertex {vertex}, but the file defines {defined}")]
    UnknownVertex {
        /// Place of the vertex's name.
        place: Location,
        /// `tet` or `triangle`.
        entity: &'static str,
        /// Tag of the element in the file.
        element: u64,
        /// Tag of the vertex.
        vertex: String,
        /// Number of vertices and range of their tags, in words.
        defined: String,
    },
    /// The mesh has cells or faces other than tets and triangles.
    #[error(
        "{}: read as a mesh of tets and triangles alone, but the file has {found} (`read_mixed` takes these too)",
        path.display()
    )]
    Elements {
        /// Path of the mesh file.
        path: PathBuf,
        /// Counts and names of these cells and faces.
        found: String,
    },
    /// A part of the mesh is missing in the file.
    #[error("{}: the file has no {what}; {hint}", path.display())]
    Missing {
        /// Path of the mesh file.
        path: PathBuf,
        /// The missing part.
        what: &'static str,
        /// Advice for the user.
        hint: &'static str,
    },
    /// Some triangles belong to no family.
    #[error(
        "{}: {count} of {n_triangles} triangles belong to no physical group ({detail}); give every boundary surface \
         one (Gmsh: Physical Surface(\"wing\") = {{...}}) and save again, without 'Save all elements'",
        path.display()
    )]
    WithoutFamily {
        /// Path of the mesh file.
        path: PathBuf,
        /// Number of these triangles.
        count: usize,
        /// Number of all triangles.
        n_triangles: usize,
        /// Place of the first of these triangles.
        detail: String,
    },
    /// A triangle belongs to two families.
    #[error(
        "{}: {what} is in two physical groups, '{first}' and '{second}'; a boundary triangle belongs to one family",
        path.display(), what = shown(what), first = shown(first), second = shown(second)
    )]
    TwoFamilies {
        /// Path of the mesh file.
        path: PathBuf,
        /// The surface or triangle.
        what: String,
        /// Name of the first family.
        first: String,
        /// Name of the second family.
        second: String,
    },
    /// There are more vertices or families than can be numbered.
    #[error("{}: {count} {what} are too many (at most {limit})", path.display())]
    TooMany {
        /// Path of the mesh file.
        path: PathBuf,
        /// The counted entities.
        what: &'static str,
        /// The count.
        count: usize,
        /// The largest count allowed.
        limit: usize,
    },
}

impl ReadError {
    /// The error of an element's vertex that the file does not have.
    ///
    /// - `element`, `vertex`: numbered from 1
    pub(super) fn unknown_vertex(
        place: Location,
        entity: &'static str,
        element: u64,
        vertex: i64,
        n_vertices: usize,
    ) -> Self {
        let defined = format!("{n_vertices} vertices, numbered from 1");
        Self::UnknownVertex { place, entity, element, vertex: vertex.to_string(), defined }
    }
}

/// An error of writing a mesh.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The file cannot be made.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// Path of the file to write.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// No format has this extension.
    #[error("cannot write {}: unknown mesh format; known are {known}, each also with .gz", path.display())]
    UnknownFormat {
        /// Path of the file to write.
        path: PathBuf,
        /// The extensions that can be written.
        known: String,
    },
    /// An array does not have the mesh's length.
    #[error("{found} {what} do not fit a mesh that has {expected}")]
    Length {
        /// Contents of the array.
        what: &'static str,
        /// Length of the array.
        found: usize,
        /// The length required.
        expected: usize,
    },
    /// Cells are inverted by the rounding of a file in single precision.
    #[error(
        "cannot write {}: the rounding to the file's single precision would invert {count} of the cells, the first at \
         {at}; write a format with double precision, or move the origin of the coordinates nearer to these cells",
        path.display(), at = place_of(*at)
    )]
    Rounded {
        /// Path of the file to write.
        path: PathBuf,
        /// Number of cells that are inverted by the rounding alone.
        count: usize,
        /// The middle of the first of them, in the mesh's unit.
        at: DVec3,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} is at {position}: not finite, so the mesh is not written")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
        /// Position of the vertex.
        position: DVec3,
    },
    /// A file beside the one to write has other names for the families.
    #[error(
        "{} is there already and is not this mesh's: {what}; remove it, or write the mesh under another name",
        path.display(), what = shown(what)
    )]
    Stale {
        /// Path of the file beside.
        path: PathBuf,
        /// The difference.
        what: String,
    },
    /// Two meshes to write need the same file beside them, with different names or boundary
    /// conditions for the families.
    #[error(
        "{} and {} have other numbers or boundary conditions of the families, but would both find their names in {}; give one \
         of them another name", first.display(), second.display(), path.display()
    )]
    Shared {
        /// Path of the file beside.
        path: PathBuf,
        /// Path of the first mesh file.
        first: PathBuf,
        /// Path of the second mesh file.
        second: PathBuf,
    },
    /// A cell names a vertex that does not exist.
    #[error("{entity} {index} names vertex {vertex}, but there are {n_vertices} vertices")]
    VertexOutOfRange {
        /// `tet` or `triangle`.
        entity: &'static str,
        /// Index of the cell.
        index: usize,
        /// Index of the vertex.
        vertex: u32,
        /// Number of vertices.
        n_vertices: usize,
    },
}

impl From<PlaceError> for WriteError {
    fn from(PlaceError { path, source }: PlaceError) -> Self {
        Self::Io { path, source }
    }
}
