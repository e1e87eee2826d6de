//! CGNS files in HDF5 or ADF, with unstructured zones, which are one mesh.
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
mod boundary;
mod chunks;
mod columns;
mod conditions;
mod coordinates;
mod create;
mod data;
mod elements;
mod face_pairs;
mod hdf5;
mod headers;
mod interfaces;
mod join;
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
use columns::{Column, Columns, ZoneColumns};
use conditions::{symmetries, types_of_conditions};
use coordinates::{grid_of, read_coordinates};
use create::{create, limits};
use data::{Shared, Source};
use elements::{Reader, Vertices};
use interfaces::Interfaces;
use join::{HOW_ZONES_MEET, Joined, ZonePoints, join};
use tree::Node;

/// The format's name in [`super::FORMATS`].
const NAME: &str = "CGNS";

/// The format, as a row of [`FORMATS`](crate::formats::FORMATS).
pub(super) const FORMAT: Format = Format {
    name: NAME,
    extensions: &["cgns"],
    description: "CGNS in HDF5 or ADF, unstructured zones; families are the boundary conditions",
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
    let contents = read_contents(path, &shared)?;
    apart::check(path, &shared, &contents)?;
    let Contents { mesh_builder, positions, columns, names, symmetries, beside, warnings } = contents;
    let changes = match columns.all().any(Column::is_packed) {
        true => vec!["coordinates: packed in the file that was read, and not where they move".to_owned()],
        false => Vec::new(),
    };
    let (mesh, others) = mesh_builder.finish(path, positions, |tag| Some(names[tag as usize].clone()))?;
    // HDF5 has released the bytes.
    let bytes = Arc::unwrap_or_clone(shared.bytes);
    let coordinates = Box::new(columns);
    let of_file = SourceFile::of_file(NAME, extension, bytes, coordinates, beside);
    let document = SourceFile { warnings, changes, symmetries, ..of_file };
    Ok(Parsed { mesh, others, document })
}

/// The contents of a file.
struct Contents {
    mesh_builder: MeshBuilder,
    positions: Vec<DVec3>,
    columns: Columns,
    /// Name of each tag of the faces.
    names: Vec<String>,
    /// Families with a symmetry condition.
    symmetries: Vec<String>,
    beside: Vec<String>,
    warnings: Vec<String>,
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

/// Reads all zones of all bases.
fn read_contents(path: &Path, shared: &Shared) -> Result<Contents, ReadError> {
    let adf = if is_adf(&shared.bytes) { Some(Adf::open(path, shared)?) } else { None };
    let source = Source::new(path, shared);
    let root = Node::root(&source, adf.as_ref(), || open_hdf5(path, shared))?;
    let bases = root.children("CGNSBase_t")?;
    let [bases, of_surfaces] = of_volumes(bases)?;
    let missing = |what| ReadError::Missing { path: path.into(), what, hint: "is it a complete CGNS file?" };
    if bases.is_empty() {
        return Err(missing("base"));
    }
    let mut nodes = Vec::new();
    for base in &bases {
        for zone in base.children("Zone_t")? {
            nodes.push((base, zone));
        }
    }
    if nodes.is_empty() {
        return Err(missing("zone"));
    }
    let mut reader = Reader::new(path);
    for base in &of_surfaces {
        reader.warnings.push(format!("{}: a base of surfaces is passed over, and stays", base.path()));
    }
    let (mut zones, mut columns) = (Vec::new(), Vec::new());
    for (base, zone) in &nodes {
        for kind in zone.children("ZoneType_t")? {
            let kind = kind.text()?;
            if kind != "Unstructured" {
                return Err(zone.unsupported(format!("a zone of type '{kind}'"), "convert it to an unstructured mesh"));
            }
        }
        let grid = grid_of(zone, &mut reader.warnings)?;
        let (positions, of_zone) = read_coordinates(path, &grid)?;
        let n_vertices = zone.integers()?.get(0).unwrap_or_default();
        if n_vertices != positions.len() as i64 {
            return Err(
                grid.malformed(format!("coordinates of {n_vertices} vertices, as the zone says"), positions.len())
            );
        }
        columns.push(of_zone);
        zones.push(ZonePoints { base, zone, positions });
    }
    let positions = match &mut zones[..] {
        [zone] => {
            let positions = std::mem::take(&mut zone.positions);
            reader.zone(zone.zone, Vertices { count: positions.len(), of_mesh: None })?;
            reader.tag_faces(zone.base, zone.zone, &positions, "")?;
            positions
        }
        zones => read_joined(&mut reader, zones, &mut columns, bases.len() > 1)?,
    };
    let builder = &reader.mesh_builder;
    let has_cells = !builder.tets.is_empty() || builder.others.n_cells() > 0;
    if has_cells && builder.triangles.is_empty() && builder.others.quadrilaterals.is_empty() {
        let hint = "save the boundary in sections of TRI_3 or QUAD_4 with a BC_t on each (GridLocation FaceCenter), or with a \
                    BC_t on its vertices (GridLocation Vertex)";
        return Err(nodes[0].1.unsupported("a zone without sections of faces or conditions on vertices", hint));
    }
    let Reader { mesh_builder, names, warnings, .. } = reader;
    let mut beside = mesh_builder.passed_over();
    beside.extend(types_of_conditions(nodes.iter().map(|(_, zone)| zone))?);
    let mut of_symmetry = Vec::new();
    for (base, zone) in &nodes {
        of_symmetry.extend(symmetries(base, zone)?);
    }
    beside.extend(of_surfaces.iter().map(|base| format!("the base '{}'", base.name())));
    let mut others = Vec::new();
    for base in &bases {
        others.extend(base.labelled()?);
    }
    for (_, zone) in &nodes {
        others.extend(zone.labelled()?);
    }
    for (label, node) in others {
        if !READ.contains(&&*label) {
            beside.push(format!("the node '{}'", node.name()));
        }
    }
    let columns = Columns { zones: columns };
    Ok(Contents { mesh_builder, positions, columns, names, symmetries: of_symmetry, beside, warnings })
}

/// The bases with cells of three dimensions, and beside these the others.
fn of_volumes<'a>(bases: Vec<Node<'a>>) -> Result<[Vec<Node<'a>>; 2], ReadError> {
    let dimensions = bases.iter().map(|base| Ok(base.integers()?.get(0))).collect::<Result<Vec<_>, ReadError>>()?;
    if !dimensions.contains(&Some(3)) {
        return Ok([bases, Vec::new()]);
    }
    let (of_volumes, others): (Vec<_>, Vec<_>) =
        bases.into_iter().zip(dimensions).partition(|(_, dimension)| *dimension == Some(3));
    Ok([of_volumes, others].map(|bases| bases.into_iter().map(|(base, _)| base).collect()))
}

/// Reads several zones into one mesh, and returns the positions of its vertices.
fn read_joined(
    reader: &mut Reader,
    zones: &[ZonePoints],
    columns: &mut [ZoneColumns],
    has_bases: bool,
) -> Result<Vec<DVec3>, ReadError> {
    let Joined { positions, vertex_of, is_shared } = join(zones)?;
    let mut interfaces = Interfaces::new(&is_shared);
    for ((zone, columns), vertex_of) in zones.iter().zip(columns).zip(vertex_of) {
        if !vertex_of.iter().any(|&vertex| is_shared[vertex as usize]) {
            return Err(zone.zone.unsupported("a zone that shares no point with the others", HOW_ZONES_MEET));
        }
        columns.set_vertices(&zone.positions, vertex_of.clone(), &positions);
        reader.zone(zone.zone, Vertices { count: vertex_of.len(), of_mesh: Some(vertex_of) })?;
        let prefix = match has_bases {
            true => format!("{}/{}/", zone.base.name(), zone.zone.name()),
            false => format!("{}/", zone.zone.name()),
        };
        reader.tag_faces(zone.base, zone.zone, &positions, &prefix)?;
        interfaces.add(zone.zone, reader)?;
    }
    let remark = interfaces.remove(reader);
    reader.warnings.extend(remark);
    Ok(positions)
}
