//! Gmsh `.msh` files, versions 4.1 and 2.2, ASCII and binary.
//!
//! A family is a 2-D physical group. A face without a group is left out if it lies inside the
//! volume, and is an error on the boundary. Vertices, tets and triangles keep the order of the
//! file. Points, lines, and all sections that do not define the mesh are ignored. Ignored parts
//! survive because the file is written back with only its coordinates replaced, see
//! [`super::document`].
//!
//! Numbers about the geometry of vertices do not change: the parameters of parametric nodes and the
//! bounding boxes of entities still describe the mesh before it moved.
//!
//! Source: the Gmsh reference manual, "MSH file format" (4.1) and "MSH file format version 2
//! (Legacy)".

mod create;
mod elements;
mod families;
mod ungrouped;
mod v22;
mod v41;
mod vertices;

use std::path::Path;

use super::document::{Slots, SourceFile};
use super::error::ReadError;
use super::format::{Create, Format, Parsed};
use super::scanner::{Encoding, Endian, Scanner, Width, shown};
use super::surface::Surface;

use create::{create, limits};
use elements::Elements;
use families::Groups;
use vertices::Vertices;

/// The format's name in [`super::FORMATS`].
const NAME: &str = "Gmsh";

/// The format, as a row of [`FORMATS`](crate::formats::FORMATS).
pub(super) const FORMAT: Format = Format {
    name: NAME,
    extensions: &["msh"],
    description: "Gmsh 4.1 or 2.2, ascii or binary; families are the surface's physical groups",
    read,
    create: Create::File(create),
    limits,
    companion: None,
};

#[derive(Clone, Copy, PartialEq, Eq)]
enum Version {
    V22,
    V41,
}

/// The parts of a mesh read so far.
#[derive(Default)]
struct Parts {
    version: Option<Version>,
    encoding: Option<Encoding>,
    groups: Groups,
    vertices: Option<Vertices>,
    elements: Option<Elements>,
    /// Names of the sections that are kept but not read.
    beside: Vec<String>,
}

/// Reads a Gmsh file from its (decompressed) bytes. `path` is for messages.
fn read(path: &Path, extension: &'static str, bytes: Vec<u8>) -> Result<Parsed, ReadError> {
    let mut parts = read_sections(path, &bytes)?;
    let encoding = parts.encoding.unwrap_or(Encoding::Text);
    let (version, vertices, elements) = parts.take(path)?;
    let Vertices { positions, slots, .. } = vertices;
    let (mesh, others, mut beside) = elements.into_mesh(path, version, &parts.groups, positions)?;
    beside.extend(parts.beside.iter().map(|name| format!("the section ${name}")));
    let coordinates = Box::new(Slots { encoding, width: Width::Double, slots });
    Ok(Parsed { mesh, others, document: SourceFile::of_file(NAME, extension, bytes, coordinates, beside) })
}

/// Reads the faces of a Gmsh file from its (decompressed) bytes, with or without groups. `path` is
/// for messages.
pub(super) fn read_surface(path: &Path, bytes: &[u8]) -> Result<Surface, ReadError> {
    let mut parts = read_sections(path, bytes)?;
    let (_, vertices, elements) = parts.take(path)?;
    // Without them the points could be taken for displaced ones.
    if parts.beside.iter().any(|name| name == "NodeData") {
        let found = "a Gmsh file with $NodeData as a surface".into();
        let hint = "save the surface with its data as .vtu, or without the data";
        return Err(ReadError::Unsupported { path: path.into(), found, hint });
    }
    let mut surface = Surface { points: vertices.positions, ..Surface::default() };
    surface.take(elements.without_groups());
    Ok(surface)
}

fn read_sections(path: &Path, bytes: &[u8]) -> Result<Parts, ReadError> {
    let mut parts = Parts::default();
    let mut scanner = Scanner::of_text(path, bytes);
    while scanner.remaining() > 0 {
        // Text between the sections is a comment for Gmsh too.
        if let Some(name) = scanner.line().strip_prefix(b"$") {
            read_section(&mut scanner, name, &mut parts)?;
        }
    }
    Ok(parts)
}

impl Parts {
    /// Takes the sections without which there is no mesh.
    fn take(&mut self, path: &Path) -> Result<(Version, Vertices, Elements), ReadError> {
        let missing = |what, hint| ReadError::Missing { path: path.into(), what, hint };
        let version = self.version.ok_or_else(|| missing("$MeshFormat section", "is it a Gmsh mesh?"))?;
        let vertices = self.vertices.take().ok_or_else(|| missing("$Nodes section", "is it complete?"))?;
        let elements = self.elements.take().ok_or_else(|| missing("$Elements section", "is it complete?"))?;
        Ok((version, vertices, elements))
    }
}

/// Reads the section after its `$Name` line, including its `$EndName`.
fn read_section(scanner: &mut Scanner, name: &[u8], parts: &mut Parts) -> Result<(), ReadError> {
    let end = [b"$End", name].concat();
    let unsupported =
        |found: &str, hint| ReadError::Unsupported { path: scanner.path().into(), found: found.into(), hint };
    match (name, parts.version) {
        (b"NOD" | b"NOE", _) => return Err(unsupported("Gmsh version 1", UPGRADE)),
        (b"MeshFormat", None) => read_format(scanner, parts)?,
        (b"Nodes" | b"ParametricNodes" | b"Elements" | b"PhysicalNames" | b"Entities", None) => {
            return Err(scanner.malformed("$MeshFormat", shown(&[b"$", name].concat())));
        }
        (b"MeshFormat", Some(_)) => return Err(scanner.malformed("one $MeshFormat section", "a second one")),
        (b"PhysicalNames", Some(version)) => parts.groups.read_names(scanner, version == Version::V22)?,
        (b"Entities", Some(Version::V41)) => v41::read_entities(scanner, &mut parts.groups)?,
        (b"PartitionedEntities", Some(Version::V41)) => v41::read_partitioned_entities(scanner, &mut parts.groups)?,
        (b"Nodes" | b"ParametricNodes", Some(version)) => {
            if parts.vertices.is_some() {
                return Err(scanner.malformed("one $Nodes section", "a second one"));
            }
            let vertices = match version {
                Version::V22 => v22::read_nodes(scanner, name == b"ParametricNodes")?,
                Version::V41 => v41::read_nodes(scanner)?,
            };
            parts.vertices = Some(vertices);
        }
        (b"Elements", Some(version)) => {
            let Some(vertices) = &parts.vertices else {
                return Err(scanner.malformed("$Nodes before $Elements", "'$Elements'"));
            };
            if parts.elements.is_some() {
                return Err(scanner.malformed("one $Elements section", "a second one"));
            }
            let elements = match version {
                Version::V22 => v22::read_elements(scanner, vertices)?,
                Version::V41 => v41::read_elements(scanner, vertices)?,
            };
            parts.elements = Some(elements);
        }
        (b"", _) => return Err(scanner.malformed("the name of a section", "'$'")),
        _ if name.starts_with(b"End") => {
            return Err(scanner.malformed("a section", shown(&[b"$", name].concat())));
        }
        _ => {
            if name != b"Comments" {
                parts.beside.push(String::from_utf8_lossy(name).into_owned());
            }
            return scanner.skip_past(&end);
        }
    }
    match scanner.token() {
        found if found == end => Ok(()),
        b"" => Err(scanner.truncated(String::from_utf8_lossy(&end))),
        found => Err(scanner.malformed(String::from_utf8_lossy(&end), shown(found))),
    }
}

const UPGRADE: &str = "save it as version 4.1: gmsh old.msh -save -format msh41 -o new.msh";

/// Reads `version file-type data-size`, and in a binary file the number one, which shows the byte
/// order.
fn read_format(scanner: &mut Scanner, parts: &mut Parts) -> Result<(), ReadError> {
    let path = scanner.path();
    let unsupported = |found, hint| ReadError::Unsupported { path: path.into(), found, hint };
    let version = scanner.token();
    parts.version = match version {
        b"4.1" => Some(Version::V41),
        b"2.2" | b"2.1" | b"2.0" | b"2" => Some(Version::V22),
        b"" => return Err(scanner.truncated("the version of the format")),
        _ => {
            let found = String::from_utf8_lossy(version);
            let Ok(_) = found.parse::<f64>() else {
                return Err(scanner.malformed("the version of the format, such as 4.1", shown(version)));
            };
            return Err(unsupported(format!("Gmsh version {found}"), UPGRADE));
        }
    };
    let binary = scanner.unsigned_int("0 (ascii) or 1 (binary)")?;
    if binary > 1 {
        return Err(scanner.malformed("0 (ascii) or 1 (binary)", binary.to_string()));
    }
    let data_size = scanner.unsigned_int("the size of a number, 8")?;
    scanner.line();
    if binary == 0 {
        parts.encoding = Some(Encoding::Text);
        return Ok(());
    }
    if data_size != 8 {
        let hint = "save it with a 64-bit Gmsh, or as ascii";
        return Err(unsupported(format!("binary with numbers of {data_size} bytes"), hint));
    }
    scanner.encoding = Encoding::Binary(Endian::Little);
    let one = scanner.block::<4>("the number 1 in binary")?;
    let endian = match one {
        [1, 0, 0, 0] => Endian::Little,
        [0, 0, 0, 1] => Endian::Big,
        _ => return Err(scanner.malformed("the number 1 in binary (the header says binary)", shown(&one))),
    };
    scanner.encoding = Encoding::Binary(endian);
    parts.encoding = Some(scanner.encoding);
    Ok(())
}
