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
    /// In the appended section, at an offset that an attribute gives.
    Appended { offset: usize, attribute: Range<usize> },
}

/// The contents of the tags.
pub(super) struct Header {
    pub coding: Coding,
    pub pieces: Vec<Piece>,
    /// Offset of the appended arrays, and whether they are base64.
    pub appended: Option<(usize, bool)>,
    pub names: Vec<(i32, String)>,
}

/// A part of the mesh with its own points.
#[derive(Default)]
pub(super) struct Piece {
    pub n_points: usize,
    pub n_cells: usize,
    pub arrays: Vec<Array>,
}

impl Header {
    /// The places in which the file gives the offsets of its appended arrays.
    pub fn offsets(&self) -> Vec<Offset> {
        let Some((base, _)) = self.appended else { return Vec::new() };
        let arrays = self.pieces.iter().flat_map(|piece| &piece.arrays);
        let said = arrays.filter_map(|array| match &array.values {
            Values::Appended { offset, attribute } => Some((*offset, attribute.clone())),
            _ => None,
        });
        said.map(|(value, attribute)| Offset { value, start: base.saturating_add(value), attribute }).collect()
    }
}

/// Reads the tags of a file with the type `expected`, up to the appended data.
pub(super) fn read_header(path: &Path, bytes: &[u8], expected: &'static str) -> Result<Header, ReadError> {
    let unsupported = |found: String, hint| ReadError::Unsupported { path: path.into(), found, hint };
    let mut tags = Tags::new(path, bytes);
    let mut header = Header {
        coding: Coding { endian: Endian::Little, header: 4, compression: None },
        pieces: Vec::new(),
        appended: None,
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
                let n_points = count("NumberOfPoints")?;
                let n_cells = count(if expected == "PolyData" { "NumberOfLines" } else { "NumberOfCells" })?;
                header.pieces.push(Piece { n_points, n_cells, arrays: Vec::new() });
            }
            (
                "Points" | "Cells" | "Lines" | "Verts" | "Strips" | "Polys" | "PointData" | "CellData" | "FieldData",
                closes,
            ) => {
                section = if closes { String::new() } else { tag.name.into() };
            }
            ("DataArray" | "Array", false) if !section.is_empty() && section != "FieldData" => {
                let array = read_array(&tags, &tag, &section)?;
                header.pieces.last_mut().into_iter().for_each(|piece| piece.arrays.extend(array.clone()));
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
    if header.pieces.is_empty() {
        return Err(ReadError::Missing { path: path.into(), what: "<Piece>", hint: "is it a complete VTU file?" });
    }
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
