//! VTU files: VTK unstructured grids in XML, as written by ParaView and other programs.
//!
//! A family is a number of the boundary faces in a cell array. Files written by idmesh also hold
//! the names, in a comment. All encodings are read: text, base64 and appended raw; zlib, LZ4, LZMA;
//! headers of 32 and 64 bits; both byte orders.
//!
//! Ranges of coordinates in the file (`RangeMin`, `L2_NORM_RANGE`) do not change when the mesh is
//! written back. Several pieces are one mesh: points of different pieces with equal coordinates are
//! one vertex, and each point is written back in its place. So are points of a file in which every
//! cell has points of its own, see [`super::own_points`].
//!
//! Source: K. Martin and others, *VTK File Formats*, "XML File Formats".

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

use glam::DVec3;

use super::cells::{self, Corners, Table};
use super::create::create;
use super::header::{Array, Contents, Header, Piece, Values, read_header};
use super::names::listed_names;
use super::own_points::{Shared, share};
use super::payload::{Payload, Undecoded};
use super::points::{self, Pieces, Stored};
use super::types::FAMILY_ARRAYS;
use crate::formats::allowance::Allowance;
use crate::formats::document::SourceFile;
use crate::formats::error::{Location, ReadError};
use crate::formats::format::{Create, Format, Parsed};
use crate::formats::mesh_builder::{MOST_VERTICES, MeshBuilder, check_finite_at};
use crate::formats::new_file::{NewFile, renamed};
use crate::formats::number::{Integers, Number};
use crate::formats::scanner::{Width, find_byte, next_token, parse_double, shown};

/// The format's name in [`crate::formats::FORMATS`].
const NAME: &str = "VTU";

/// The format, as a row of [`FORMATS`](crate::formats::FORMATS).
pub(in crate::formats) const FORMAT: Format = Format {
    name: NAME,
    extensions: &["vtu"],
    description: "VTK unstructured grid for ParaView, with families, displacement and beta",
    read,
    create: Create::File(create),
    limits,
    companion: None,
};

/// Reads a VTU file from its (decompressed) bytes. `path` is for messages.
fn read(path: &Path, extension: &'static str, bytes: Vec<u8>) -> Result<Parsed, ReadError> {
    let header = read_header(path, &bytes, Contents::Cells)?;
    let offsets = header.offsets();
    let allowance = Allowance::new(path, bytes.len());
    let mut mesh_builder = MeshBuilder::default();
    let (positions, coordinates) = if let [piece] = &header.pieces[..] {
        let file = File { path, bytes: &bytes, header: &header, piece, allowance: &allowance };
        let (positions, stored) = file.read_points(file.array("Points", None)?)?;
        file.read_cells(positions.len(), |vertex| vertex as u32, &mut mesh_builder)?;
        points::together(vec![stored], offsets).map(|coordinates| (positions, coordinates))
    } else {
        let mut pieces = Pieces::default();
        for piece in header.pieces.iter().filter(|piece| piece.n_points > 0 || piece.n_cells > 0) {
            let file = File { path, bytes: &bytes, header: &header, piece, allowance: &allowance };
            file.refuse_ghosts()?;
            let (positions, stored) = file.read_points(file.array("Points", None)?)?;
            let count = pieces.positions.len() + positions.len();
            if count >= MOST_VERTICES {
                return Err(ReadError::TooMany { path: path.into(), what: "vertices", count, limit: MOST_VERTICES });
            }
            let vertices = pieces.add(positions, stored);
            file.read_cells(vertices.len(), |point| vertices[point], &mut mesh_builder)?;
        }
        pieces.finish(offsets)
    }
    .ok_or_else(|| ReadError::Unsupported {
        path: path.into(),
        found: "a file of pieces that are encoded differently or overlap".into(),
        hint: "merge the pieces (in ParaView: Merge Blocks)",
    })?;
    check_apart(path, &bytes, &header)?;
    let Shared { positions, coordinates, warning } = share(positions, coordinates, &mut mesh_builder);
    mesh_builder.orient_prisms(&positions);
    let mut beside = mesh_builder.passed_over();
    for array in header.pieces.iter().flat_map(|piece| &piece.arrays) {
        let words = format!("the array '{}'", array.name);
        if array.section.ends_with("Data") && !FAMILY_ARRAYS.contains(&&*array.name) && !beside.contains(&words) {
            beside.push(words);
        }
    }
    let name = |tag: i32| header.names.iter().find(|(number, _)| *number == tag).map(|(_, name)| name.clone());
    let (mesh, others) = mesh_builder.finish(path, positions, name)?;
    let earlier = earlier_motion(&header);
    let mut document = SourceFile::of_file(NAME, extension, bytes, coordinates, beside);
    document.warnings.extend(warning.into_iter().chain(earlier));
    Ok(Parsed { mesh, others, document })
}

/// A warning if the file has arrays that idmesh writes beside a moved mesh. They are copied as they
/// are, and would be taken for those of the next motion.
fn earlier_motion(header: &Header) -> Option<String> {
    let arrays = header.pieces.iter().flat_map(|piece| &piece.arrays).filter(|array| array.section.ends_with("Data"));
    let names: BTreeSet<String> = arrays
        .filter(|array| super::create::OF_MOTION.contains(&&*array.name))
        .map(|array| format!("`{}`", array.name))
        .collect();
    let names: Vec<String> = names.into_iter().collect();
    // Each name alone may be somebody else's.
    (names.len() > 1).then(|| {
        format!(
            "the arrays {} seem to tell of an earlier motion: they are copied as they are, and do not tell of the next one",
            names.join(", ")
        )
    })
}

/// Losses of a new file: letters of names.
fn limits(new_file: &NewFile) -> Vec<String> {
    renamed(new_file.cells.families, &listed_names(new_file.cells.families))
}

/// Checks that no appended array reaches into the next one, and that points share no bytes with
/// another array. Otherwise moved points could change an array that is not theirs.
///
/// # Errors
/// [`ReadError::Malformed`]
fn check_apart(path: &Path, bytes: &[u8], header: &Header) -> Result<(), ReadError> {
    let Some((base, base64)) = header.appended else { return Ok(()) };
    let malformed = |tag: usize, expected: String, found: String| ReadError::Malformed {
        place: place(path, bytes, tag),
        expected,
        found,
    };
    // An array of an empty piece may have no bytes at all.
    for array in header.appended_arrays.iter().filter(|array| !array.of_nothing) {
        let start = base.saturating_add(array.offset);
        let length = header.coding.length(bytes.get(start..).unwrap_or_default(), base64);
        let end = length.map_or(usize::MAX, |length| start.saturating_add(length));
        let end_before = header.end_before(start);
        if end > end_before {
            let expected = format!("the array '{}' between the bytes {start} and {end_before} of the file", array.name);
            return Err(malformed(array.tag, expected, "a longer one".into()));
        }
        if array.points && header.n_at(start) > 1 {
            let expected = format!("bytes of their own for the points '{}'", array.name);
            return Err(malformed(array.tag, expected, format!("another array at byte {start}, too")));
        }
    }
    Ok(())
}

fn place(path: &Path, bytes: &[u8], at: usize) -> Location {
    Location::Line(path.into(), 1 + bytes[..at].iter().filter(|&&byte| byte == b'\n').count())
}

/// The points and lines of a poly data file.
pub(super) fn read_lines<'a>(path: &'a Path, bytes: &'a [u8]) -> Result<(Vec<DVec3>, Corners<'a>), ReadError> {
    let header = read_header(path, bytes, Contents::Lines)?;
    let [piece] = &header.pieces[..] else {
        let found = format!("a file of {} pieces", header.pieces.len());
        let hint = "merge the pieces (in ParaView: Append Geometry)";
        return Err(ReadError::Unsupported { path: path.into(), found, hint });
    };
    let allowance = Allowance::new(path, bytes.len());
    let file = File { path, bytes, header: &header, piece, allowance: &allowance };
    let (points, _) = file.read_points(file.array("Points", None)?)?;
    Ok((points, file.corners("Lines")?))
}

/// A number of numbers that a piece promises for an array.
struct Promise<'w> {
    count: usize,
    /// The expected and the found contents, in words, for an array of this many numbers.
    words: &'w dyn Fn(usize) -> (String, String),
}

/// A piece of a file with the contents of its tags.
pub(super) struct File<'a, 'h> {
    pub path: &'a Path,
    pub bytes: &'a [u8],
    pub header: &'h Header,
    pub piece: &'h Piece,
    /// What the arrays of the file may unpack to.
    pub allowance: &'h Allowance<'a>,
}

impl<'a, 'h> File<'a, 'h> {
    pub fn malformed(&self, at: usize, expected: impl Into<String>, found: impl Into<String>) -> ReadError {
        let place = place(self.path, self.bytes, at);
        ReadError::Malformed { place, expected: expected.into(), found: found.into() }
    }

    /// The array with this name in a section, or the section's only array.
    pub fn array(&self, section: &'static str, name: Option<&str>) -> Result<&'h Array, ReadError> {
        let fits = |array: &&Array| array.section == section && name.is_none_or(|name| array.name == name);
        self.piece.arrays.iter().find(fits).ok_or_else(|| ReadError::Missing {
            path: self.path.into(),
            what: match name {
                Some("types") => "array of cell types",
                Some("offsets") => "array of cell offsets",
                Some(_) => "array of cell connectivity",
                None => "array of points",
            },
            hint: "is it a complete VTU file?",
        })
    }

    /// Offset of an array's payload, and the decoded payload. `None` if the array is text.
    ///
    /// - `promised`: how many numbers the piece promises, if it does, and the expected and the
    ///   found contents for the message. An array with more numbers is refused before it is
    ///   decoded.
    fn payload(&self, array: &Array, promised: Option<Promise>) -> Result<Option<(usize, Payload<'a>)>, ReadError> {
        let (start, base64) = match array.values {
            Values::Text(_) => return Ok(None),
            Values::Base64(start) => (start + blanks(&self.bytes[start..]), true),
            Values::Appended(offset) => {
                let (start, base64) = self
                    .header
                    .appended
                    .ok_or_else(|| self.malformed(array.tag, "an <AppendedData> section for this array", "none"))?;
                (start.saturating_add(offset), base64)
            }
        };
        let bytes = self.bytes.get(start..).unwrap_or_default();
        let allow = |n_bytes: usize| match promised {
            Some(Promise { count, words }) if n_bytes / array.number.bytes() > count => {
                let (expected, found) = words(n_bytes / array.number.bytes());
                Err(self.malformed(array.tag, expected, found))
            }
            _ => self.allowance.take(&format!("the array '{}'", array.name), n_bytes),
        };
        let payload = self.header.coding.decode(bytes, base64, allow).map_err(|error| match error {
            Undecoded::Broken(found) => self.malformed(array.tag, format!("the array '{}'", array.name), found),
            Undecoded::Refused(error) => error,
        })?;
        let (length, size) = (payload.data.len(), array.number.bytes());
        if length % size != 0 {
            let expected = format!("the array '{}' of numbers of {size} bytes", array.name);
            return Err(self.malformed(array.tag, expected, format!("{length} bytes")));
        }
        let end_before = self.header.end_before(start);
        if matches!(array.values, Values::Appended(_)) && payload.length > end_before.saturating_sub(start) {
            let expected = format!("the array '{}' between the bytes {start} and {end_before} of the file", array.name);
            return Err(self.malformed(array.tag, expected, format!("{} bytes", payload.length)));
        }
        Ok(Some((start, payload)))
    }

    /// Checks that no cell of the piece is a copy of another piece's cell.
    ///
    /// # Errors
    /// [`ReadError::Unsupported`]
    fn refuse_ghosts(&self) -> Result<(), ReadError> {
        let Some(array) = self.cell_array("vtkGhostType") else { return Ok(()) };
        let mut ghosts = self.of_cells(array)?;
        if (0..ghosts.len()).all(|cell| ghosts.get(cell) == Some(0)) {
            return Ok(());
        }
        let hint = "save it without them, or merge the pieces (in ParaView: Merge Blocks)";
        Err(ReadError::Unsupported { path: self.path.into(), found: "a file of pieces with ghost cells".into(), hint })
    }

    fn cell_array(&self, name: &str) -> Option<&'h Array> {
        self.piece.arrays.iter().find(|array| array.section == "CellData" && array.name == name)
    }

    /// Reads the cells of a piece with `n_points` points. `numbered` gives the vertex of a point.
    fn read_cells(
        &self,
        n_points: usize,
        numbered: impl Fn(usize) -> u32,
        mesh_builder: &mut MeshBuilder,
    ) -> Result<(), ReadError> {
        let types = self.of_cells(self.array("Cells", Some("types"))?)?;
        let corners = self.corners("Cells")?;
        let family = FAMILY_ARRAYS.iter().find_map(|name| self.cell_array(name));
        let families = family.map(|array| self.of_cells(array)).transpose()?;
        let cells_tag = self.array("Cells", Some("connectivity"))?.tag;
        let malformed = |expected: String, found: String| self.malformed(cells_tag, expected, found);
        if types.len() != self.piece.n_cells {
            let expected = format!("{} cell types, as the piece declares", self.piece.n_cells);
            return Err(malformed(expected, types.len().to_string()));
        }
        cells::assemble(self.path, Table { types, corners }, families, n_points, numbered, malformed, mesh_builder)
    }

    /// The vertices of the cells or lines of a section.
    pub fn corners(&self, section: &'static str) -> Result<Corners<'a>, ReadError> {
        let ends = self.of_cells(self.array(section, Some("offsets"))?)?;
        Ok(Corners::Ends(ends, self.integers(self.array(section, Some("connectivity"))?, None)?))
    }

    /// The values of an array with a whole number for each cell or line.
    pub fn of_cells(&self, array: &Array) -> Result<Integers<'a>, ReadError> {
        let count = self.piece.n_cells;
        let words = |found: usize| {
            let expected = format!("{count} numbers in '{}', as many as the piece declares cells", array.name);
            (expected, found.to_string())
        };
        self.integers(array, Some(Promise { count, words: &words }))
    }

    /// The values of an array of whole numbers.
    fn integers(&self, array: &Array, promised: Option<Promise>) -> Result<Integers<'a>, ReadError> {
        let values = match self.payload(array, promised)? {
            Some((_, payload)) => Integers::stored(payload.data, array.number, payload.coding.endian),
            None => {
                let mut values = Vec::new();
                for token in self.tokens(array) {
                    let text = std::str::from_utf8(&self.bytes[token.clone()]).unwrap_or_default();
                    let value = text.parse().map_err(|_| {
                        let found = shown(&self.bytes[token.clone()]);
                        self.malformed(token.start, format!("a whole number of '{}'", array.name), found)
                    })?;
                    values.push(value);
                }
                Some(values.into())
            }
        };
        values.ok_or_else(|| self.malformed(array.tag, format!("whole numbers in '{}'", array.name), "others"))
    }

    /// The values `[n_points n_components]` of an array of numbers at the points.
    pub fn of_points(&self, array: &Array) -> Result<Vec<f64>, ReadError> {
        let count = self.piece.n_points.saturating_mul(array.n_components);
        let words = |found: usize| (format!("{count} numbers in '{}'", array.name), found.to_string());
        let values = match self.payload(array, Some(Promise { count, words: &words }))? {
            Some((_, payload)) => array.number.doubles(&payload.data, payload.coding.endian),
            None => {
                let value = |token: Range<usize>| {
                    let number = parse_double(&self.bytes[token.clone()]);
                    let found = || shown(&self.bytes[token.clone()]);
                    number.ok_or_else(|| self.malformed(token.start, format!("a number of '{}'", array.name), found()))
                };
                self.tokens(array).map(value).collect::<Result<_, _>>()?
            }
        };
        if values.len() != count {
            let (expected, found) = words(values.len());
            return Err(self.malformed(array.tag, expected, found));
        }
        Ok(values)
    }

    /// Ranges of the values of a text array.
    fn tokens(&self, array: &Array) -> impl Iterator<Item = Range<usize>> + '_ {
        let start = if let Values::Text(start) = array.values { start } else { self.bytes.len() };
        let rest = &self.bytes[start..];
        let end = start + find_byte(rest, b'<').unwrap_or(rest.len());
        let mut at = start;
        std::iter::from_fn(move || {
            let token = next_token(&self.bytes[..end], at);
            at = token.end;
            (!token.is_empty()).then_some(token)
        })
    }

    /// Reads the points, and their places in the file.
    pub fn read_points(&self, array: &Array) -> Result<(Vec<DVec3>, Stored), ReadError> {
        let mut slots = Vec::new();
        let n_points = self.piece.n_points;
        let words =
            |found: usize| (format!("{n_points} points, as the piece declares"), format!("{found} coordinates"));
        let payload = self.payload(array, Some(Promise { count: n_points.saturating_mul(3), words: &words }))?;
        let values = match &payload {
            Some((_, payload)) => array.number.doubles(&payload.data, payload.coding.endian),
            None => {
                let mut values = Vec::new();
                for token in self.tokens(array) {
                    let value = parse_double(&self.bytes[token.clone()]);
                    let found = || shown(&self.bytes[token.clone()]);
                    values.push(value.ok_or_else(|| self.malformed(token.start, "a coordinate", found()))?);
                    if values.len() % 3 == 1 {
                        slots.push(token.start);
                    }
                }
                values
            }
        };
        if Some(values.len()) != n_points.checked_mul(3) {
            let (expected, found) = words(values.len());
            return Err(self.malformed(array.tag, expected, found));
        }
        let place = || place(self.path, self.bytes, array.tag);
        let (triples, _) = values.as_chunks::<3>();
        for (vertex, &position) in triples.iter().enumerate() {
            check_finite_at(position, vertex as u64, place)?;
        }
        let positions = triples.iter().map(|&position| position.into()).collect();
        // A moved point does not fit an array of whole numbers, even where it is text.
        let width = match array.number {
            Number::F64 => Width::Double,
            Number::F32 => Width::Single,
            _ => return Err(self.malformed(array.tag, "points of type Float64 or Float32", "whole numbers")),
        };
        let Some((start, payload)) = payload else { return Ok((positions, Stored::Text(slots))) };
        Ok((positions, Stored::Array(points::Array { start, payload: payload.into_owned(), width })))
    }
}

/// Number of white-space bytes at the start of a text.
fn blanks(bytes: &[u8]) -> usize {
    bytes.iter().take_while(|byte| byte.is_ascii_whitespace()).count()
}
