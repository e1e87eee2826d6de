//! VTU files: VTK unstructured grids in XML, as ParaView and others write them.
//!
//! A family is a number that a cell array gives the boundary faces; files that idmesh wrote also hold the names, in a
//! comment. All encodings are read: text, base64 and appended raw, zlib, LZ4, LZMA, headers of 32 and 64 bits, both byte
//! orders.
//!
//! What the file says about the range of its coordinates (`RangeMin`, `L2_NORM_RANGE`) stays that of the mesh before it
//! moved.
//!
//! Source: K. Martin and others, *VTK File Formats*, "XML File Formats".

use std::io::{self, Write};
use std::ops::Range;
use std::path::Path;

use glam::DVec3;

use super::cells::{self, Corners, Table};
use super::compression::Compression;
use super::names::parse_names;
use super::payload::{Coding, Payload};
use super::types::FAMILY_ARRAYS;
use super::xml::{Tag, Tags};
use crate::formats::assembly::{check_finite_at, surface};
use crate::formats::document::{Coordinates, Document, Slots, narrow};
use crate::formats::error::{Place, ReadError};
use crate::formats::number::{Integers, Number};
use crate::formats::out::Out;
use crate::formats::scanner::{Encoding, Endian, Width, find_byte, next_token, parse_double, shown};
use crate::formats::table::Parsed;

/// The format's name in [`crate::formats::FORMATS`].
pub(in crate::formats) const NAME: &str = "VTU";

/// An array that the file declares.
#[derive(Clone, Debug)]
struct Array {
    /// The tag around it: `Points`, `Cells`, `PointData`, `CellData`.
    section: String,
    name: String,
    number: Number,
    /// Where its tag stands.
    tag: usize,
    values: Values,
}

/// Where the values of an array stand.
#[derive(Clone, Debug)]
enum Values {
    /// Text from here to the next `<`.
    Text(usize),
    /// Base64 from here on.
    Base64(usize),
    /// In the appended section, at the offset that an attribute says.
    Appended { offset: usize, attribute: Range<usize> },
}

/// What the tags say.
struct Header {
    coding: Coding,
    n_points: usize,
    n_cells: usize,
    arrays: Vec<Array>,
    /// Where the appended arrays begin, and whether they are base64.
    appended: Option<(usize, bool)>,
    names: Vec<(i32, String)>,
}

/// Reads a VTU file from its (decompressed) bytes; `path` is for messages.
pub(in crate::formats) fn read(path: &Path, extension: &'static str, bytes: Vec<u8>) -> Result<Parsed, ReadError> {
    let header = read_header(path, &bytes, "UnstructuredGrid")?;
    let file = File { path, bytes: &bytes, header: &header };
    let points = file.array("Points", None)?;
    let (positions, coordinates) = file.read_points(points)?;
    let types = file.integers(file.array("Cells", Some("types"))?)?;
    let corners = file.corners("Cells")?;
    let of_cells = |name: &str| header.arrays.iter().find(|array| array.section == "CellData" && array.name == name);
    let family = FAMILY_ARRAYS.iter().find_map(|name| of_cells(name));
    let families = family.map(|array| file.integers(array)).transpose()?;
    let cells_tag = file.array("Cells", Some("connectivity"))?.tag;
    let malformed = |expected: String, found: String| file.malformed(cells_tag, expected, found);
    if types.len() != header.n_cells {
        let expected = format!("{} cell types, as the piece declares", header.n_cells);
        return Err(malformed(expected, types.len().to_string()));
    }
    let mut assembly = cells::assemble(path, Table { types, corners }, families, positions.len(), malformed)?;
    assembly.orient_prisms(&positions);
    let mut beside = assembly.passed_over();
    let data = header.arrays.iter().filter(|array| array.section.ends_with("Data"));
    beside.extend(
        data.filter(|array| !FAMILY_ARRAYS.contains(&&*array.name)).map(|array| format!("the array '{}'", array.name)),
    );
    let name = |tag: i32| {
        let named = header.names.iter().find(|(number, _)| *number == tag);
        named.map_or_else(|| surface(tag), |(_, name)| name.clone())
    };
    let (mesh, others) = assembly.finish(path, positions, name)?;
    Ok(Parsed {
        mesh,
        others,
        document: Document {
            format: NAME,
            extension,
            bytes,
            coordinates,
            beside,
            companion: None,
            siblings: Vec::new(),
        },
    })
}

/// Reads the tags of a file of that type, up to the appended data.
fn read_header(path: &Path, bytes: &[u8], expected: &'static str) -> Result<Header, ReadError> {
    let unsupported = |found: String, hint| ReadError::Unsupported { path: path.into(), found, hint };
    let mut tags = Tags::new(path, bytes);
    let mut header = Header {
        coding: Coding { endian: Endian::Little, header: 4, compression: None },
        n_points: 0,
        n_cells: 0,
        arrays: Vec::new(),
        appended: None,
        names: Vec::new(),
    };
    let mut section = String::new();
    let (mut in_file, mut pieces) = (false, 0);
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
                    Some(kind) if kind == expected => {}
                    other => {
                        let found = format!("a VTK file of type {}", other.unwrap_or("none"));
                        let hint = match expected {
                            "PolyData" => "save the lines as poly data (.vtp)",
                            _ => "save it as an unstructured grid (.vtu)",
                        };
                        return Err(unsupported(found, hint));
                    }
                }
                header.coding = read_coding(&tags, &tag, unsupported)?;
            }
            ("Piece", false) => {
                pieces += 1;
                header.n_points = count("NumberOfPoints")?;
                header.n_cells = count(if expected == "PolyData" { "NumberOfLines" } else { "NumberOfCells" })?;
            }
            (
                "Points" | "Cells" | "Lines" | "Verts" | "Strips" | "Polys" | "PointData" | "CellData" | "FieldData",
                closes,
            ) => {
                section = if closes { String::new() } else { tag.name.into() };
            }
            ("DataArray" | "Array", false) if !section.is_empty() && section != "FieldData" => {
                header.arrays.extend(read_array(&tags, &tag, &section)?);
            }
            ("AppendedData", false) => {
                let base64 = match tag.get("encoding") {
                    Some("raw") => false,
                    Some("base64") | None => true,
                    Some(other) => return Err(tags.malformed(tag.start, "the encoding raw or base64", other)),
                };
                let underscore = bytes[tag.end..].iter().position(|&byte| byte == b'_');
                let start = underscore.ok_or_else(|| tags.malformed(tag.start, "'_' before appended data", "none"))?;
                header.appended = Some((tag.end + start + 1, base64));
                break;
            }
            _ => {}
        }
    }
    if !in_file {
        return Err(ReadError::Missing { path: path.into(), what: "<VTKFile> tag", hint: "is it an XML file of VTK?" });
    }
    match pieces {
        0 => Err(ReadError::Missing { path: path.into(), what: "<Piece>", hint: "is it a complete VTU file?" }),
        1 => Ok(header),
        _ => Err(unsupported(format!("a file of {pieces} pieces"), "merge the pieces (in ParaView: Merge Blocks)")),
    }
}

/// The points of a poly data file, and those of its lines.
pub(super) fn read_lines<'a>(path: &'a Path, bytes: &'a [u8]) -> Result<(Vec<DVec3>, Corners<'a>), ReadError> {
    let header = read_header(path, bytes, "PolyData")?;
    let file = File { path, bytes, header: &header };
    let (points, _) = file.read_points(file.array("Points", None)?)?;
    Ok((points, file.corners("Lines")?))
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

/// A `DataArray`; nothing if it is one of strings.
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
        Some("appended") => {
            let offset = tag.get("offset").and_then(|offset| offset.trim().parse().ok());
            let attribute = tag.place_of("offset").unwrap_or_default();
            let offset = offset.ok_or_else(|| {
                tags.malformed(tag.start, "the offset of an appended array", tag.get("offset").unwrap_or("none"))
            })?;
            Values::Appended { offset, attribute }
        }
        other => {
            let found = other.unwrap_or("none");
            return Err(tags.malformed(tag.start, "the format ascii, binary or appended", found));
        }
    };
    let name = tag.get("Name").unwrap_or_default().to_string();
    Ok(Some(Array { section: section.to_string(), name, number, tag: tag.start, values }))
}

/// A file with what its tags say.
struct File<'a, 'h> {
    path: &'a Path,
    bytes: &'a [u8],
    header: &'h Header,
}

impl<'a, 'h> File<'a, 'h> {
    fn malformed(&self, at: usize, expected: impl Into<String>, found: impl Into<String>) -> ReadError {
        let lines = self.bytes[..at].iter().filter(|&&byte| byte == b'\n').count();
        let place = Place::Line(self.path.into(), lines + 1);
        ReadError::Malformed { place, expected: expected.into(), found: found.into() }
    }

    /// The array of that name in a section, or its only one.
    fn array(&self, section: &'static str, name: Option<&str>) -> Result<&'h Array, ReadError> {
        let fits = |array: &&Array| array.section == section && name.is_none_or(|name| array.name == name);
        self.header.arrays.iter().find(fits).ok_or_else(|| ReadError::Missing {
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

    /// Where the payload of an array begins and the array itself; nothing if it is text.
    fn payload(&self, array: &Array) -> Result<Option<(usize, Payload<'a>)>, ReadError> {
        let (start, base64) = match array.values {
            Values::Text(_) => return Ok(None),
            Values::Base64(start) => (start + blanks(&self.bytes[start..]), true),
            Values::Appended { offset, .. } => {
                let (start, base64) = self
                    .header
                    .appended
                    .ok_or_else(|| self.malformed(array.tag, "an <AppendedData> section for this array", "none"))?;
                (start.saturating_add(offset), base64)
            }
        };
        let bytes = self.bytes.get(start..).unwrap_or_default();
        let payload = self.header.coding.decode(bytes, base64);
        let payload =
            payload.map_err(|found| self.malformed(array.tag, format!("the array '{}'", array.name), found))?;
        let (length, size) = (payload.data.len(), array.number.bytes());
        if length % size != 0 {
            let expected = format!("the array '{}' of numbers of {size} bytes", array.name);
            return Err(self.malformed(array.tag, expected, format!("{length} bytes")));
        }
        Ok(Some((start, payload)))
    }

    /// The vertices of the cells or lines of a section.
    fn corners(&self, section: &'static str) -> Result<Corners<'a>, ReadError> {
        let array = |name| self.integers(self.array(section, Some(name))?);
        Ok(Corners::Ends(array("offsets")?, array("connectivity")?))
    }

    /// The values of an array of whole numbers.
    fn integers(&self, array: &Array) -> Result<Integers<'a>, ReadError> {
        let values = match self.payload(array)? {
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

    /// Where the values of a text array stand.
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

    /// The points and how to write them back.
    fn read_points(&self, array: &Array) -> Result<(Vec<DVec3>, Box<dyn Coordinates>), ReadError> {
        let mut slots = Vec::new();
        let payload = self.payload(array)?;
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
        let n_points = self.header.n_points;
        if Some(values.len()) != n_points.checked_mul(3) {
            let expected = format!("{n_points} points, as the piece declares");
            return Err(self.malformed(array.tag, expected, format!("{} coordinates", values.len())));
        }
        let place =
            || Place::Line(self.path.into(), 1 + self.bytes[..array.tag].iter().filter(|&&b| b == b'\n').count());
        let (triples, _) = values.as_chunks::<3>();
        for (vertex, &position) in triples.iter().enumerate() {
            check_finite_at(position, vertex as u64, place)?;
        }
        let positions = triples.iter().map(|&position| position.into()).collect();
        let Some((start, payload)) = payload else {
            let slots = Slots { encoding: Encoding::Text, width: Width::Double, slots };
            return Ok((positions, Box::new(slots)));
        };
        let width = match array.number {
            Number::F64 => Width::Double,
            Number::F32 => Width::Single,
            _ => return Err(self.malformed(array.tag, "points of type Float64 or Float32", "whole numbers")),
        };
        let behind = |other: &Array| match (&array.values, &other.values) {
            (Values::Appended { offset: here, .. }, Values::Appended { offset, attribute }) if offset > here => {
                Some((*offset, attribute.clone()))
            }
            _ => None,
        };
        let mut behind: Vec<_> = self.header.arrays.iter().filter_map(behind).collect();
        behind.sort_by_key(|(_, attribute)| attribute.start);
        Ok((positions, Box::new(Points { start, payload: payload.into_owned(), width, behind })))
    }
}

/// How many white-space bytes a text begins with.
fn blanks(bytes: &[u8]) -> usize {
    bytes.iter().take_while(|byte| byte.is_ascii_whitespace()).count()
}

/// The array of points, to be replaced as a whole.
#[derive(Debug)]
struct Points {
    /// Where it begins in the file.
    start: usize,
    payload: Payload<'static>,
    width: Width,
    /// Offsets of the appended arrays behind it with the places where the file says them, in order: if its length
    /// changes, so do they.
    behind: Vec<(usize, Range<usize>)>,
}

impl Coordinates for Points {
    fn write(&self, bytes: &[u8], out: &mut Out, vertices: &[DVec3]) -> io::Result<()> {
        let endian = self.payload.coding.endian;
        let mut data = Vec::with_capacity(self.payload.data.len());
        for value in vertices.iter().flat_map(|vertex| vertex.to_array()) {
            match self.width {
                Width::Single => data.extend_from_slice(&endian.single(narrow(value)?)),
                Width::Double => data.extend_from_slice(&endian.double(value)),
            }
        }
        if data == *self.payload.data {
            return out.write_all(bytes);
        }
        let payload = self.payload.encode(&data)?;
        let mut copied = 0;
        for (offset, attribute) in &self.behind {
            out.write_all(&bytes[copied..attribute.start])?;
            write!(out, "{}", offset - self.payload.length + payload.len())?;
            copied = attribute.end;
        }
        out.write_all(&bytes[copied..self.start])?;
        out.write_all(&payload)?;
        out.write_all(&bytes[self.start + self.payload.length..])
    }
}
