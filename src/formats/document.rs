//! The bytes of a mesh file, and the places of its coordinates in them.

use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use glam::DVec3;
use rayon::prelude::*;

use super::out::Out;
use super::scanner::{Encoding, Width, find_byte, next_token, parse_double};
use crate::geometry::bounds;
use crate::text::figures::Shortest;

/// The source of a mesh with the places of its coordinates: everything needed to write the file
/// back with moved vertices.
#[derive(Debug)]
pub(super) struct SourceFile {
    /// Name of the file's format in [`super::FORMATS`].
    pub format: &'static str,
    /// The extension, which selects the format, and in some formats the variant.
    pub extension: &'static str,
    /// The decompressed bytes of the file.
    pub bytes: Vec<u8>,
    /// Places and encoding of the coordinates.
    pub coordinates: Box<dyn Coordinates>,
    /// Parts of the file besides the mesh, in words. A new file of another format loses them.
    pub beside: Vec<String>,
    /// A file that belongs to the mesh file and does not change.
    pub companion: Option<Companion>,
    /// For a mesh that is a folder: the other files of the folder, unchanged.
    pub siblings: NamedFiles,
    /// Pairs of families that the file declares periodic.
    pub partners: Vec<[String; 2]>,
    /// Families with a symmetry condition in the file.
    pub symmetries: Vec<String>,
    /// What a user must know before the mesh is moved, in words.
    pub warnings: Vec<String>,
    /// What is otherwise in a file that is written back, besides moved coordinates, in words.
    pub changes: Vec<String>,
}

/// Names and contents of the files of a folder.
pub(super) type NamedFiles = Vec<(String, Vec<u8>)>;

/// What the references of a mesh's faces are called.
pub(super) type Names = BTreeMap<i32, String>;

/// The numbers of the boundary conditions of the references of a mesh's faces.
pub(super) type Conditions = BTreeMap<i32, i32>;

/// A small file beside a mesh file, with names that the mesh file cannot hold.
#[derive(Clone, Debug)]
pub(super) struct Companion {
    /// Computes the path from the path of the mesh file.
    pub path: fn(&Path) -> PathBuf,
    /// Contents of the file. `None` if the mesh has no such file; the file of another mesh must
    /// then not be taken for it.
    pub bytes: Option<Vec<u8>>,
    /// Names of the references of the mesh's faces.
    pub names: Names,
    /// Boundary conditions of the references. Empty if the mesh has none.
    pub conditions: Conditions,
}

impl SourceFile {
    /// A mesh that is one file.
    pub fn of_file(
        format: &'static str,
        extension: &'static str,
        bytes: Vec<u8>,
        coordinates: Box<dyn Coordinates>,
        beside: Vec<String>,
    ) -> Self {
        Self {
            format,
            extension,
            bytes,
            coordinates,
            beside,
            companion: None,
            siblings: Vec::new(),
            partners: Vec::new(),
            symmetries: Vec::new(),
            warnings: Vec::new(),
            changes: Vec::new(),
        }
    }

    /// Whether the file holds coordinates in single precision.
    pub fn is_single(&self) -> bool {
        self.coordinates.is_single()
    }

    /// Writes the file with its vertices at `vertices` `[n_vertices]`. All other bytes are copied.
    pub fn write(&self, out: &mut Out, vertices: &[DVec3]) -> io::Result<()> {
        self.coordinates.write(&self.bytes, out, vertices)
    }
}

/// The coordinates in a kind of file.
pub(super) trait Coordinates: fmt::Debug + Send + Sync {
    /// Writes `bytes` with the vertices at `vertices` `[n_vertices]`. All other bytes are copied.
    fn write(&self, bytes: &[u8], out: &mut Out, vertices: &[DVec3]) -> io::Result<()>;

    /// Whether some are numbers in single precision.
    fn is_single(&self) -> bool;
}

/// Coordinates in the order of the vertices, each vertex with three plain numbers.
#[derive(Debug)]
pub(super) struct Slots {
    pub encoding: Encoding,
    /// Size of a number in a binary file.
    pub width: Width,
    /// Offset of each vertex's x `[n_vertices]`, ascending. y and z follow x, in a text file after
    /// white space.
    pub slots: Vec<usize>,
}

/// Vertices per task when text is written, and number of tasks whose text is kept at a time.
const VERTICES: usize = 2048;
const TASKS: usize = 64;

impl Slots {
    /// Writes a text file. A coordinate whose value did not change keeps its digits. Digits are
    /// made in parallel.
    fn write_text(&self, bytes: &[u8], out: &mut Out, vertices: &[DVec3]) -> io::Result<()> {
        let Some(&first) = self.slots.first() else { return out.write_all(bytes) };
        out.write_all(&bytes[..first])?;
        // The text from a task's first coordinate to the next task's first one, and the offset of
        // its end.
        let of_task = |task: usize| {
            let (begin, end) = (task * VERTICES, self.slots.len().min((task + 1) * VERTICES));
            let mut text = Vec::with_capacity(80 * (end - begin));
            let mut copied = self.slots[begin];
            for (&slot, vertex) in self.slots[begin..end].iter().zip(&vertices[begin..end]) {
                copied = write_vertex(bytes, &mut text, copied, slot, vertex)?;
            }
            let next = self.slots.get(end).map_or(copied, |&next| next);
            text.extend_from_slice(&bytes[copied..next]);
            Ok((text, next))
        };
        let mut copied = first;
        let n_tasks = self.slots.len().div_ceil(VERTICES);
        for begin in (0..n_tasks).step_by(TASKS) {
            let tasks = begin..n_tasks.min(begin + TASKS);
            for (text, next) in tasks.into_par_iter().map(of_task).collect::<io::Result<Vec<_>>>()? {
                out.write_all(&text)?;
                copied = next;
            }
        }
        out.write_all(&bytes[copied..])
    }
}

impl Coordinates for Slots {
    fn write(&self, bytes: &[u8], out: &mut Out, vertices: &[DVec3]) -> io::Result<()> {
        let Encoding::Binary(endian) = self.encoding else { return self.write_text(bytes, out, vertices) };
        if self.is_single() {
            check_single(vertices)?;
        }
        let mut copied = 0;
        for (&slot, vertex) in self.slots.iter().zip(vertices) {
            out.write_all(&bytes[copied..slot])?;
            let mut block = [0; 24];
            let block = &mut block[..3 * self.width.bytes()];
            for (bytes, value) in block.chunks_exact_mut(self.width.bytes()).zip(vertex.to_array()) {
                match self.width {
                    Width::Single => bytes.copy_from_slice(&endian.single(narrow(value)?)),
                    Width::Double => bytes.copy_from_slice(&endian.double(value)),
                }
            }
            out.write_all(block)?;
            copied = slot + block.len();
        }
        out.write_all(&bytes[copied..])
    }

    fn is_single(&self) -> bool {
        matches!(self.encoding, Encoding::Binary(_)) && self.width == Width::Single
    }
}

/// Copies from `copied` to the end of the vertex's last coordinate, with its new value. Returns the
/// offset of this end.
fn write_vertex(
    bytes: &[u8],
    out: &mut impl Write,
    mut copied: usize,
    slot: usize,
    vertex: &DVec3,
) -> io::Result<usize> {
    let mut at = slot;
    for value in vertex.to_array() {
        let mut token = next_token(bytes, at);
        // Comments of OpenFOAM may stand before a number.
        while matches!(bytes[token.clone()], [b'/', b'/' | b'*', ..]) {
            token = next_token(bytes, token.start + comment(&bytes[token.start..]));
        }
        // A comment, a tag or a parenthesis may follow a number without white space.
        let ends = |byte: &u8| matches!(byte, b'%' | b'<' | b')' | b'/');
        token.end = bytes[token.clone()].iter().position(ends).map_or(token.end, |length| token.start + length);
        at = token.end;
        // Other digits of the same number must not change, so values are compared, by their bits.
        if parse_double(&bytes[token.clone()]).map(f64::to_bits) != Some(value.to_bits()) {
            out.write_all(&bytes[copied..token.start])?;
            write_shortest(out, value)?;
            copied = at;
        }
    }
    out.write_all(&bytes[copied..at])?;
    Ok(at)
}

/// Length of the C++ comment at the start of a text: up to the end of its line, or including its
/// `*/`.
pub(super) fn comment(text: &[u8]) -> usize {
    let inside = text.get(2..).unwrap_or_default();
    let length = match text.get(1) {
        Some(b'/') => find_byte(inside, b'\n'),
        _ => inside.windows(2).position(|pair| pair == b"*/").map(|at| at + 2),
    };
    (length.unwrap_or(inside.len()) + 2).min(text.len())
}

/// Checks that single precision can hold the shape of a mesh with these vertices. In a smaller mesh
/// coordinates would become zero.
///
/// # Errors
/// The mesh is too small.
pub(super) fn check_single(vertices: &[DVec3]) -> io::Result<()> {
    let size = bounds(vertices.iter().copied()).map_or(0.0, |[low, high]| (high - low).max_element());
    if size > 0.0 && size < f64::from(f32::MIN_POSITIVE) {
        let message = format!("the mesh measures {size:e} of its unit, too little for the file's single precision");
        return Err(io::Error::new(io::ErrorKind::InvalidData, message));
    }
    Ok(())
}

/// A coordinate in single precision, for a mesh that has passed [`check_single`].
///
/// # Errors
/// The coordinate is too large.
pub(super) fn narrow(value: f64) -> io::Result<f32> {
    let narrow = value as f32;
    if narrow.is_finite() {
        return Ok(narrow);
    }
    let message = format!("coordinate {value:e} does not fit the file's single precision");
    Err(io::Error::new(io::ErrorKind::InvalidData, message))
}

/// Writes the fewest digits that read back as the same number, with an exponent where there would
/// be many zeros.
pub(super) fn write_shortest(out: &mut impl Write, value: f64) -> io::Result<()> {
    write!(out, "{}", Shortest(value))
}
