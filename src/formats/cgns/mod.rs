//! CGNS files in HDF5 or ADF, with one unstructured zone.
//!
//! A family is a boundary condition (`BC_t`). Its name is the name of the condition's family:
//! `FamilyName_t` of the condition, or the full name in the `Family_t`. Without a family it is the
//! name of the condition. Faces without a condition belong to a family with their section's name.
//!
//! When a file is written back, the numbers of the coordinates are replaced in their places, and
//! everything else is kept.
//!
//! Source: the CGNS standard, SIDS and "SIDS file mapping, HDF5".

mod adf;
mod apart;
mod chunks;
mod columns;
mod conditions;
mod coordinates;
mod create;
mod elements;
mod hdf5;
mod headers;
mod tree;

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use hdf5_pure::{File, Group};

use super::document::SourceFile;
use super::error::{Location, ReadError};
use super::format::{Create, Format, Parsed};
use super::mesh_builder::MeshBuilder;

use adf::{Adf, is_adf};
use columns::{Column, Columns};
use conditions::types_of_conditions;
use coordinates::read_coordinates;
use create::{create, limits};
use elements::{Reader, Vertices};
use tree::{Node, Shared, Tree};

/// The format's name in [`super::FORMATS`].
const NAME: &str = "CGNS";

/// The format, as a row of [`FORMATS`](crate::formats::FORMATS).
pub(super) const FORMAT: Format = Format {
    name: NAME,
    extensions: &["cgns"],
    description: "CGNS in HDF5 or ADF, one unstructured zone; families are the boundary conditions",
    read,
    create: Create::File(create),
    limits,
    companion: None,
};

/// Labels of nodes in a base or zone that are read, or that hold nothing about the mesh.
const READ: [&str; 7] =
    ["Zone_t", "Family_t", "ZoneType_t", "GridCoordinates_t", "Elements_t", "ZoneBC_t", "Ordinal_t"];

/// Reads a CGNS file from its (decompressed) bytes. `path` is for messages.
fn read(path: &Path, extension: &'static str, bytes: Vec<u8>) -> Result<Parsed, ReadError> {
    let shared = Shared::new(bytes);
    let zone = read_zone(path, &shared)?;
    apart::check(path, &shared, &zone)?;
    let Zone { mesh_builder, positions, columns, names, beside, remarks } = zone;
    let changes = match columns.axes.iter().any(Column::is_packed) {
        true => vec!["coordinates: packed in the file that was read, and not where they move".to_owned()],
        false => Vec::new(),
    };
    let (mesh, others) = mesh_builder.finish(path, positions, |tag| names[tag as usize].clone())?;
    // HDF5 has released the bytes.
    let bytes = Arc::unwrap_or_clone(shared.bytes);
    let coordinates = Box::new(columns);
    let document = SourceFile { remarks, changes, ..SourceFile::of_file(NAME, extension, bytes, coordinates, beside) };
    Ok(Parsed { mesh, others, document })
}

/// The contents of a zone.
struct Zone {
    mesh_builder: MeshBuilder,
    positions: Vec<DVec3>,
    columns: Columns,
    /// Name of each tag of the faces.
    names: Vec<String>,
    beside: Vec<String>,
    remarks: Vec<String>,
}

/// The root of a file in HDF5.
fn open_hdf5(path: &Path, shared: &Shared) -> Result<Group, ReadError> {
    let bytes = &shared.bytes[..];
    let file = File::from_source(shared.clone()).map_err(|error| ReadError::Malformed {
        place: Location::File(path.into()),
        expected: "an HDF5 or ADF file".into(),
        found: error.to_string(),
    })?;
    let length = file.superblock().eof_address;
    if length > bytes.len() as u64 {
        let expected = format!("the rest of its {length} bytes");
        return Err(ReadError::Truncated { place: Location::Byte(path.into(), bytes.len()), expected });
    }
    Ok(file.root())
}

fn read_zone(path: &Path, shared: &Shared) -> Result<Zone, ReadError> {
    let adf = if is_adf(&shared.bytes) { Some(Adf::open(path, shared)?) } else { None };
    let tree = Tree::new(path, shared, adf);
    let root = Node::root(&tree, || open_hdf5(path, shared))?;
    let base = root.only("CGNSBase_t", "base", "leave one base in it")?;
    let zone = base.only("Zone_t", "zone", "merge them into one in which they share vertices")?;
    for kind in zone.children("ZoneType_t")? {
        let kind = kind.text()?;
        if kind != "Unstructured" {
            return Err(zone.unsupported(format!("a zone of type '{kind}'"), "convert it to an unstructured mesh"));
        }
    }
    let grid = zone.children("GridCoordinates_t")?;
    let grid = grid.first().ok_or_else(|| zone.malformed("grid coordinates in it", "none"))?;
    let (positions, columns) = read_coordinates(path, grid)?;
    let mut reader = Reader::new(path);
    reader.zone(&zone, Vertices { count: positions.len(), of_mesh: None })?;
    reader.tag_faces(&base, &zone, &positions, "")?;
    let Reader { mesh_builder, names, remarks, .. } = reader;
    let mut beside = mesh_builder.passed_over();
    beside.extend(types_of_conditions(&zone)?);
    for (label, node) in base.labelled()?.into_iter().chain(zone.labelled()?) {
        if !READ.contains(&&*label) {
            beside.push(format!("the node '{}'", node.name()));
        }
    }
    Ok(Zone { mesh_builder, positions, columns, names, beside, remarks })
}
