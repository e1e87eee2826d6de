//! Why a mesh file could not be read or written.

use std::fmt;
use std::io;
use std::path::PathBuf;

use glam::DVec3;
use thiserror::Error;

/// Where in a file: a line of a text file, a byte of a binary one (of its decompressed contents), a node of a tree.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Location {
    /// Line of a text file, from 1.
    Line(PathBuf, usize),
    /// Offset in a binary file, from 0.
    Byte(PathBuf, usize),
    /// Node of a CGNS file by the names that lead to it, such as `/Base/Zone/GridCoordinates`.
    Node(PathBuf, String),
    /// The file as a whole.
    File(PathBuf),
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Location::Line(path, line) => write!(f, "{}:{line}", path.display()),
            Location::Byte(path, byte) => write!(f, "{}: byte {byte}", path.display()),
            Location::Node(path, node) => write!(f, "{}: {node}", path.display()),
            Location::File(path) => write!(f, "{}", path.display()),
        }
    }
}

/// Why a mesh could not be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The file is missing or cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The mesh file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file's gzip stream is broken.
    #[error("{}: cannot be unzipped, the file is damaged or cut short: {source}", path.display())]
    Zipped {
        /// The mesh file.
        path: PathBuf,
        /// What is wrong with the stream.
        source: io::Error,
    },
    /// No format has that extension.
    #[error("{}: unknown mesh format; known are {known}, each also with .gz", path.display())]
    UnknownFormat {
        /// The mesh file.
        path: PathBuf,
        /// The extensions that can be read.
        known: String,
    },
    /// The file holds nothing.
    #[error("{}: the file is empty", path.display())]
    Empty {
        /// The mesh file.
        path: PathBuf,
    },
    /// A version or variant of the format that is not read.
    #[error("{}: {found} is not read; {hint}", path.display())]
    Unsupported {
        /// The mesh file.
        path: PathBuf,
        /// What the file says it is.
        found: String,
        /// What to do about it.
        hint: &'static str,
    },
    /// Something else stands where the format asks for something.
    #[error("{place}: expected {expected}, found {found}")]
    Malformed {
        /// Where.
        place: Location,
        /// What the format asks for.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// The file ends too early.
    #[error("{place}: the file ends where {expected} should stand")]
    Truncated {
        /// The file's end.
        place: Location,
        /// What the format asks for there.
        expected: String,
    },
    /// A count that the rest of the file is too short for.
    #[error("{place}: {what} is {count}, but only {remaining} bytes of the file are left")]
    AbsurdCount {
        /// Where the count stands.
        place: Location,
        /// What is counted.
        what: &'static str,
        /// The count.
        count: u64,
        /// Bytes after it.
        remaining: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("{place}: vertex {vertex} has coordinate {value}, not a finite number")]
    NotFinite {
        /// Where the coordinate stands.
        place: Location,
        /// The vertex's tag in the file.
        vertex: u64,
        /// The coordinate.
        value: f64,
    },
    /// Two vertices have the same tag.
    #[error("{place}: the vertex with these coordinates has tag {tag}, which an earlier vertex has too")]
    DuplicateVertex {
        /// Where the second one's coordinates stand.
        place: Location,
        /// Their common tag.
        tag: u64,
    },
    /// An element names a vertex that the file does not define.
    #[error("{place}: {entity} {element} names vertex {vertex}, but the file defines {defined}")]
    UnknownVertex {
        /// Where the name stands.
        place: Location,
        /// `tet` or `triangle`.
        entity: &'static str,
        /// The element's tag in the file.
        element: u64,
        /// The vertex's tag.
        vertex: String,
        /// How many vertices there are and in which range their tags lie.
        defined: String,
    },
    /// The mesh has other cells and faces than tets and triangles.
    #[error(
        "{}: only meshes of linear tets and triangles can be moved, but the file has {found}", path.display()
    )]
    Elements {
        /// The mesh file.
        path: PathBuf,
        /// Counts and names of the others.
        found: String,
    },
    /// A part of the mesh is not in the file.
    #[error("{}: the file has no {what}; {hint}", path.display())]
    Missing {
        /// The mesh file.
        path: PathBuf,
        /// The missing part.
        what: &'static str,
        /// What to do about it.
        hint: &'static str,
    },
    /// Some triangles belong to no family.
    #[error(
        "{}: {count} of {n_triangles} triangles belong to no physical group ({detail}); give every boundary surface \
         one (Gmsh: Physical Surface(\"wing\") = {{...}}) and save again, without 'Save all elements'",
        path.display()
    )]
    WithoutFamily {
        /// The mesh file.
        path: PathBuf,
        /// How many triangles.
        count: usize,
        /// Of how many.
        n_triangles: usize,
        /// Where the first of them is.
        detail: String,
    },
    /// A triangle belongs to two families.
    #[error(
        "{}: {what} is in two physical groups, '{first}' and '{second}'; a boundary triangle belongs to one family",
        path.display()
    )]
    TwoFamilies {
        /// The mesh file.
        path: PathBuf,
        /// The surface or triangle.
        what: String,
        /// One family.
        first: String,
        /// The other.
        second: String,
    },
    /// More vertices or families than can be numbered.
    #[error("{}: {count} {what} are too many (at most {limit})", path.display())]
    TooMany {
        /// The mesh file.
        path: PathBuf,
        /// Vertices or families.
        what: &'static str,
        /// How many.
        count: usize,
        /// How many can be numbered.
        limit: usize,
    },
}

/// Why a mesh could not be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The file cannot be made.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file to write.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// No format has that extension.
    #[error("cannot write {}: unknown mesh format; known are {known}, each also with .gz", path.display())]
    UnknownFormat {
        /// The file to write.
        path: PathBuf,
        /// The extensions that can be written.
        known: String,
    },
    /// An array does not fit the mesh.
    #[error("{found} {what} do not fit a mesh that has {expected}")]
    Length {
        /// What the array holds.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that fits.
        expected: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} is at {position}: not finite, so the mesh is not written")]
    NotFinite {
        /// The vertex.
        vertex: usize,
        /// Where it is said to be.
        position: DVec3,
    },
    /// A file beside the one to write would give its families wrong names.
    #[error(
        "{} is there already and is not this mesh's: {what}; remove it, or write the mesh under another name", path.display()
    )]
    Stale {
        /// The file beside.
        path: PathBuf,
        /// Where they differ.
        what: String,
    },
    /// Two meshes to write would have one file beside them that gives the families of one of them wrong names.
    #[error(
        "{} and {} number the families of the mesh otherwise, but would both find their names in {}; give one of them \
         another name", first.display(), second.display(), path.display()
    )]
    Shared {
        /// The file beside.
        path: PathBuf,
        /// One mesh file.
        first: PathBuf,
        /// The other.
        second: PathBuf,
    },
    /// A cell names a vertex that is not there.
    #[error("{entity} {index} names vertex {vertex}, but there are {n_vertices} vertices")]
    VertexOutOfRange {
        /// `tet` or `triangle`.
        entity: &'static str,
        /// Which of them.
        index: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many there are.
        n_vertices: usize,
    },
}
