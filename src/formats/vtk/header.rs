//! The tags of a VTK XML file: pieces and their arrays, up to the appended data.

use std::ops::Range;
use std::path::Path;

use super::compression::Compression;
use super::names::parse_names;
use super::payload::Coding;
use super::points::Offset;
use super::xml::{Tag, Tags};
use crate::formats::error::ReadError;
use crate::formats::number::Number;
use crate::formats::scanner::{Endian, shown};

/// An array declared in the file.
#[derive(Clone, Debug)]
pub(super) struct Array {
    /// The tag around the array: `Points`, `Cells`, `PointData` or `CellData`.
    pub section: String,
    pub name: String,
    pub number: Number,
    /// Numbers for each point or cell.
    pub n_components: usize,
    /// Offset of its tag.
    pub tag: usize,
    pub values: Values,
}

/// The place of the values of an array.
#[derive(Clone, Debug)]
pub(super) enum Values {
    /// Text from this offset to the next `<`.
    Text(usize),
    /// Base64 from this offset on.
    Base64(usize),
    /// In the appended section, at this offset.
    Appended(usize),
}

/// An appended array of the file, whether or not it is read.
pub(super) struct Appended {
    pub name: String,
    /// Whether it is an array of points.
    pub points: bool,
    /// Whether it belongs to a piece without points and cells.
    pub of_nothing: bool,
    /// Offset of its tag.
    pub tag: usize,
    /// Offset in the appended section, and the place of this number in the file.
    pub offset: usize,
    pub attribute: Range<usize>,
}

/// The contents of the tags.
pub(super) struct Header {
    pub coding: Coding,
    pub pieces: Vec<Piece>,
    /// Offset of the appended arrays, and whether they are base64.
    pub appended: Option<(usize, bool)>,
    /// All appended arrays.
    pub appended_arrays: Vec<Appended>,
    /// Where these arrays begin in the file, ascending, and the end of the appended section. Arrays
    /// of empty pieces do not count.
    starts: Vec<usize>,
    pub names: Vec<(i32, String)>,
}

/// A part of the mesh with its own points.
#[derive(Default)]
pub(super) struct Piece {
    pub n_points: usize,
    /// Number of cells; of poly data the number of lines, or of polygons where they are read.
    pub n_cells: usize,
    /// Number of triangle strips of poly data.
    pub n_strips: usize,
    pub arrays: Vec<Array>,
}

impl Header {
    /// The places in which the file gives the offsets of its appended arrays.
    pub fn offsets(&self) -> Vec<Offset> {
        let Some((base, _)) = self.appended else { return Vec::new() };
        let of = |array: &Appended| Offset {
            value: array.offset,
            start: base.saturating_add(array.offset),
            attribute: array.attribute.clone(),
        };
        self.appended_arrays.iter().map(of).collect()
    }
}

impl Header {
    /// The place before which an appended array must end that begins at `start`: the begin of the
    /// next one, or the end of the appended section.
    pub fn end_before(&self, start: usize) -> usize {
        self.starts.get(self.starts.partition_point(|&other| other <= start)).copied().unwrap_or(start)
    }

    /// Number of appended arrays that begin at `start`.
    pub fn n_at(&self, start: usize) -> usize {
        self.starts.partition_point(|&other| other <= start) - self.starts.partition_point(|&other| other < start)
    }

    fn find_starts(&mut self, bytes: &[u8]) {
        let Some((base, _)) = self.appended else { return };
        let arrays = self.appended_arrays.iter().filter(|array| !array.of_nothing);
        self.starts = arrays.map(|array| base.saturating_add(array.offset)).collect();
        let end = bytes.windows(CLOSING.len()).rposition(|window| window == CLOSING);
        self.starts.push(end.filter(|&end| end >= base).unwrap_or(bytes.len()));
        self.starts.sort_unstable();
    }
}

/// The tag at the end of the appended section.
const CLOSING: &[u8] = b"</AppendedData";

/// What is read of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Contents {
    /// The cells of an unstructured grid.
    Cells,
    /// The lines of poly data.
    Lines,
    /// The polygons of poly data.
    Polygons,
}

impl Contents {
    /// The type of the file.
    fn kind(self) -> &'static str {
        match self {
            Contents::Cells => "UnstructuredGrid",
            Contents::Lines | Contents::Polygons => "PolyData",
        }
    }

    /// The attribute of a piece with the number of its cells.
    fn count(self) -> &'static str {
        match self {
            Contents::Cells => "NumberOfCells",
            Contents::Lines => "NumberOfLines",
            Contents::Polygons => "NumberOfPolys",
        }
    }

    fn hint(self) -> &'static str {
        match self {
            Contents::Cells => "save it as an unstructured grid (.vtu)",
            Contents::Lines => "save the lines as poly data (.vtp)",
            Contents::Polygons => "save the surface as poly data (.vtp)",
        }
    }
}

/// Reads the tags of a file with these contents, up to the appended data.
pub(super) fn read_header(path: &Path, bytes: &[u8], expected: Contents) -> Result<Header, ReadError> {
    let unsupported = |found: String, hint| ReadError::Unsupported { path: path.into(), found, hint };
    let mut tags = Tags::new(path, bytes);
    let mut header = Header {
        coding: Coding { endian: Endian::Little, header: 4, compression: None },
        pieces: Vec::new(),
        appended: None,
        appended_arrays: Vec::new(),
        starts: Vec::new(),
        names: Vec::new(),
    };
    let mut section = String::new();
    let mut in_file = false;
    while let Some(tag) = tags.next_tag()? {
        let count = |key| {
            let value = tag.get(key).unwrap_or_default();
            value.trim().parse::<usize>().map_err(|_| tags.malformed(tag.start, key, shown(value.as_bytes())))
        };
        match (tag.name, tag.closes) {
            ("", _) => header.names.extend(parse_names(tag.text)),
            ("VTKFile", false) => {
                in_file = true;
                match tag.get("type") {
                    Some(kind) if kind == expected.kind() => {}
                    other => {
                        let found = format!("a VTK file of type {}", other.unwrap_or("none"));
                        return Err(unsupported(found, expected.hint()));
                    }
                }
                header.coding = read_coding(&tags, &tag, unsupported)?;
            }
            ("Piece", false) => {
                let n_points = count("NumberOfPoints")?;
                let n_cells = count(expected.count())?;
                let n_strips = if expected == Contents::Polygons { count("NumberOfStrips")? } else { 0 };
                header.pieces.push(Piece { n_points, n_cells, n_strips, arrays: Vec::new() });
            }
            (
                "Points" | "Cells" | "Lines" | "Verts" | "Strips" | "Polys" | "PointData" | "CellData" | "FieldData",
                closes,
            ) => {
                section = if closes { String::new() } else { tag.name.into() };
            }
            ("DataArray" | "Array", false) => {
                let piece = header.pieces.last_mut().filter(|_| !matches!(&*section, "" | "FieldData"));
                if tag.get("format") == Some("appended") {
                    let of_nothing = piece.as_ref().is_some_and(|piece| piece.n_points == 0 && piece.n_cells == 0);
                    header.appended_arrays.push(read_appended(&tags, &tag, section == "Points", of_nothing)?);
                }
                if let Some(piece) = piece {
                    piece.arrays.extend(read_array(&tags, &tag, &section)?);
                }
            }
            ("AppendedData", false) => {
                let base64 = match tag.get("encoding") {
                    Some("raw") => false,
                    Some("base64") | None => true,
                    Some(other) => return Err(tags.malformed(tag.start, "the encoding raw or base64", other)),
                };
                let start = bytes[tag.end..].iter().take_while(|byte| byte.is_ascii_whitespace()).count();
                if bytes.get(tag.end + start) != Some(&b'_') {
                    return Err(tags.malformed(tag.start, "'_' before appended data", "another byte"));
                }
                header.appended = Some((tag.end + start + 1, base64));
                break;
            }
            _ => {}
        }
    }
    if !in_file {
        return Err(ReadError::Missing { path: path.into(), what: "<VTKFile> tag", hint: "is it an XML file of VTK?" });
    }
    if header.pieces.is_empty() {
        return Err(ReadError::Missing { path: path.into(), what: "<Piece>", hint: "is it a complete VTU file?" });
    }
    header.find_starts(bytes);
    Ok(header)
}

fn read_coding(
    tags: &Tags,
    tag: &Tag,
    unsupported: impl Fn(String, &'static str) -> ReadError,
) -> Result<Coding, ReadError> {
    let endian = match tag.get("byte_order") {
        Some("LittleEndian") | None => Endian::Little,
        Some("BigEndian") => Endian::Big,
        Some(other) => return Err(tags.malformed(tag.start, "byte_order LittleEndian or BigEndian", other)),
    };
    let header = match tag.get("header_type") {
        Some("UInt32") | None => 4,
        Some("UInt64") => 8,
        Some(other) => return Err(tags.malformed(tag.start, "header_type UInt32 or UInt64", other)),
    };
    let compression = match tag.get("compressor") {
        None | Some("") => None,
        Some(name) => match Compression::named(name) {
            None => {
                return Err(unsupported(format!("compression by {name}"), "save it with zlib or without compression"));
            }
            known => known,
        },
    };
    Ok(Coding { endian, header, compression })
}

/// Reads a `DataArray`. `None` for an array of strings.
fn read_array(tags: &Tags, tag: &Tag, section: &str) -> Result<Option<Array>, ReadError> {
    let kind = tag.get("type").unwrap_or_default();
    let Some(number) = Number::named(kind) else {
        return match kind {
            "String" | "Bit" => Ok(None),
            _ => Err(tags.malformed(tag.start, "a type such as Float64", shown(kind.as_bytes()))),
        };
    };
    let values = match tag.get("format") {
        Some("ascii") => Values::Text(tag.end),
        Some("binary") => Values::Base64(tag.end),
        Some("appended") => Values::Appended(read_offset(tags, tag)?),
        other => {
            let found = other.unwrap_or("none");
            return Err(tags.malformed(tag.start, "the format ascii, binary or appended", found));
        }
    };
    let name = tag.get("Name").unwrap_or_default().to_string();
    // Some programs write 0 for an array of plain numbers.
    let n_components = tag.get("NumberOfComponents").and_then(|count| count.trim().parse().ok());
    let n_components = n_components.filter(|&count| count > 0).unwrap_or(1);
    Ok(Some(Array { section: section.to_string(), name, number, n_components, tag: tag.start, values }))
}

/// Reads the tag of an appended array, whatever its type.
fn read_appended(tags: &Tags, tag: &Tag, points: bool, of_nothing: bool) -> Result<Appended, ReadError> {
    let name = tag.get("Name").unwrap_or_default().to_string();
    let attribute = tag.place_of("offset").unwrap_or_default();
    Ok(Appended { name, points, of_nothing, tag: tag.start, offset: read_offset(tags, tag)?, attribute })
}

fn read_offset(tags: &Tags, tag: &Tag) -> Result<usize, ReadError> {
    let offset = tag.get("offset");
    offset
        .and_then(|offset| offset.trim().parse().ok())
        .ok_or_else(|| tags.malformed(tag.start, "the offset of an appended array", offset.unwrap_or("none")))
}
