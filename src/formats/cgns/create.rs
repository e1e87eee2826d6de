//! New CGNS files: a base, a zone, and for every family its faces, a boundary condition and a
//! `Family_t`.
//!
//! Cells come first, shape by shape. The faces of each family follow, its triangles before its
//! quadrilaterals, so a boundary condition is one range of elements. Source: as for reading.

use std::io;

use hdf5_pure::{AttrValue, FileBuilder, FormatError, GroupBuilder, LibVer};

use super::elements::element_number;
use crate::formats::mesh_builder::CellKind;
use crate::formats::new_file::{NewFile, clean_names, renamed};
use crate::formats::out::Out;

/// Most letters in the name of a node.
const LONGEST: usize = 32;

/// The name of the zone.
const ZONE: &str = "Zone";

/// The data of a node.
enum Data {
    Nothing,
    Text(String),
    Single(f32),
    Doubles(Vec<f64>),
    Integers(Vec<i64>),
    /// Integers written with 32 bits.
    Short(Vec<i32>),
}

impl Data {
    /// CGNS's name of the type.
    fn kind(&self) -> &'static str {
        match self {
            Data::Nothing => "MT",
            Data::Text(_) => "C1",
            Data::Single(_) => "R4",
            Data::Doubles(_) => "R8",
            Data::Integers(_) => "I8",
            Data::Short(_) => "I4",
        }
    }
}

/// A node without children. `shape` has HDF5's order of indices; CGNS has the last index first.
fn node(name: &str, label: &str, data: &Data, shape: &[u64]) -> Result<GroupBuilder, FormatError> {
    let mut node = FileBuilder::new().create_group(name);
    attributes(name, label, data.kind(), |key, value| node.set_attr(key, value))?;
    node.set_attr("flags", AttrValue::I32Array(vec![1]));
    if !matches!(data, Data::Nothing) {
        // The name begins with a space.
        let values = node.create_dataset(" data");
        let values = match data {
            Data::Nothing => values,
            Data::Text(text) => values.with_i8_data(&letters(text)),
            Data::Single(value) => values.with_f32_data(&[*value]),
            Data::Doubles(all) => values.with_f64_data(all),
            Data::Integers(all) => values.with_i64_data(all),
            Data::Short(all) => values.with_i32_data(all),
        };
        values.with_shape(shape);
    }
    Ok(node)
}

/// The attributes that name a node.
fn attributes(name: &str, label: &str, kind: &str, mut set: impl FnMut(&str, AttrValue)) -> Result<(), FormatError> {
    set("name", AttrValue::ascii_string_sized(name, LONGEST as u32 + 1)?);
    set("label", AttrValue::ascii_string_sized(label, LONGEST as u32 + 1)?);
    set("type", AttrValue::ascii_string_sized(kind, 3)?);
    Ok(())
}

fn letters(text: &str) -> Vec<i8> {
    text.bytes().map(|byte| byte as i8).collect()
}

fn text(name: &str, label: &str, text: &str) -> Result<GroupBuilder, FormatError> {
    node(name, label, &Data::Text(text.to_owned()), &[text.len() as u64])
}

/// A zone under construction.
struct Zone {
    node: GroupBuilder,
    /// Whether integers need 64 bits.
    long: bool,
    /// Number of the next element.
    next: usize,
}

impl Zone {
    /// The zone with its vertices.
    fn new(new_file: &NewFile) -> Result<Self, FormatError> {
        let n_vertices = new_file.vertices.len();
        let long = n_vertices.max(new_file.n_elements()) > i32::MAX as usize;
        let sizes = [n_vertices, new_file.volume_cells().count(), 0].map(|size| size as i64);
        let mut zone = node(ZONE, "Zone_t", &integers(long, sizes.into_iter()), &[3, 1])?;
        zone.add_group(text("ZoneType", "ZoneType_t", "Unstructured")?.finish());
        let mut coordinates = node("GridCoordinates", "GridCoordinates_t", &Data::Nothing, &[])?;
        for (axis, name) in ["CoordinateX", "CoordinateY", "CoordinateZ"].into_iter().enumerate() {
            let values = Data::Doubles(new_file.vertices.iter().map(|vertex| vertex[axis]).collect());
            coordinates.add_group(node(name, "DataArray_t", &values, &[n_vertices as u64])?.finish());
        }
        zone.add_group(coordinates.finish());
        Ok(Self { node: zone, long, next: 1 })
    }

    /// A node with the range of element numbers from `first` up to the last one added.
    fn range(&self, name: &str, first: usize, shape: &[u64]) -> Result<GroupBuilder, FormatError> {
        let ends = [first as i64, self.next as i64 - 1];
        node(name, "IndexRange_t", &integers(self.long, ends.into_iter()), shape)
    }

    /// Adds a section of elements of one shape. Does nothing if there are none.
    fn add(&mut self, name: &str, shape: CellKind, vertices: &[u32]) -> Result<(), FormatError> {
        if vertices.is_empty() {
            return Ok(());
        }
        let first = self.next;
        self.next += vertices.len() / shape.n_vertices();
        let mut section = node(name, "Elements_t", &Data::Short(vec![element_number(shape), 0]), &[2])?;
        section.add_group(self.range("ElementRange", first, &[2])?.finish());
        let corners = integers(self.long, vertices.iter().map(|&vertex| i64::from(vertex) + 1));
        section.add_group(node("ElementConnectivity", "DataArray_t", &corners, &[vertices.len() as u64])?.finish());
        self.node.add_group(section.finish());
        Ok(())
    }
}

/// Integers with 32 or 64 bits.
fn integers(long: bool, values: impl Iterator<Item = i64>) -> Data {
    match long {
        true => Data::Integers(values.collect()),
        false => Data::Short(values.map(|value| value as i32).collect()),
    }
}

/// Names for the nodes of the families.
fn node_names(families: &[String]) -> Vec<String> {
    let short = |name: &String| {
        // Leaves space for the suffix that makes equal names different. A blank at the end would be
        // lost where a boundary condition names its family.
        let name: String = name.trim().chars().take(LONGEST - 5).collect();
        let name = name.trim_end();
        if name.is_empty() { "family".to_owned() } else { name.to_owned() }
    };
    // The nodes of the families and of the zone have one parent, so no family may have the zone's
    // name.
    let names: Vec<String> = std::iter::once(ZONE.to_owned()).chain(families.iter().map(short)).collect();
    let takes = |letter: char| letter == ' ' || letter.is_ascii_graphic() && !matches!(letter, '/' | '.');
    clean_names(&names, takes).split_off(1)
}

/// The full names of the families in the file. All names are different.
fn full_names(families: &[String]) -> Vec<String> {
    // Zeros and blanks at the end of a text only fill it.
    let names: Vec<String> = families.iter().map(|name| name.trim_end_matches(['\0', ' ']).to_owned()).collect();
    clean_names(&names, |_| true)
}

/// Losses of a new file: ends of names, the types of boundary conditions.
pub(super) fn limits(new_file: &NewFile) -> Vec<String> {
    let mut limits = renamed(new_file.cells.families, &full_names(new_file.cells.families));
    limits.push("boundary conditions: those of the families have no type (FamilySpecified)".to_owned());
    limits
}

/// Writes a CGNS file.
pub(super) fn create(out: &mut Out, new_file: &NewFile) -> io::Result<()> {
    let file = build(new_file).map_err(io::Error::other)?;
    file.finish_to(out).map_err(io::Error::other)
}

fn build(new_file: &NewFile) -> Result<FileBuilder, FormatError> {
    let mut zone = Zone::new(new_file)?;
    for (name, shape) in [
        ("tets", CellKind::Tet),
        ("pyramids", CellKind::Pyramid),
        ("prisms", CellKind::Prism),
        ("hexahedra", CellKind::Hexahedron),
    ] {
        zone.add(name, shape, new_file.vertices_of(shape))?;
    }
    let mut conditions = node("ZoneBC", "ZoneBC_t", &Data::Nothing, &[])?;
    let mut families = Vec::new();
    let full = full_names(new_file.cells.families);
    let names = node_names(&full);
    for (index, ((faces, name), full)) in new_file.faces_by_family().into_iter().zip(&names).zip(&full).enumerate() {
        let first = zone.next;
        for (what, shape) in [("triangles", CellKind::Triangle), ("quadrilaterals", CellKind::Quadrilateral)] {
            let faces = faces.iter().filter(|(of, _)| *of == shape).flat_map(|&(_, face)| face);
            zone.add(&format!("{what} {}", index + 1), shape, &faces.copied().collect::<Vec<_>>())?;
        }
        if !faces.is_empty() {
            let mut condition = text(name, "BC_t", "FamilySpecified")?;
            condition.add_group(text("GridLocation", "GridLocation_t", "FaceCenter")?.finish());
            condition.add_group(zone.range("PointRange", first, &[2, 1])?.finish());
            condition.add_group(text("FamilyName", "FamilyName_t", name)?.finish());
            conditions.add_group(condition.finish());
        }
        let mut family = node(name, "Family_t", &Data::Nothing, &[])?;
        // The full name, as in files of gmsh.
        family.add_group(text("FamilyName", "FamilyName_t", full)?.finish());
        families.push(family.finish());
    }
    zone.node.add_group(conditions.finish());

    let mut base = node("Base", "CGNSBase_t", &Data::Short(vec![3, 3]), &[2])?;
    base.add_group(zone.node.finish());
    families.into_iter().for_each(|family| base.add_group(family));
    let mut file = FileBuilder::new();
    // Some programs still read HDF5 1.8 only.
    file.with_libver_bounds(LibVer::Earliest, LibVer::V18);
    attributes("HDF5 MotherNode", "Root Node of HDF5 File", "MT", |key, value| file.set_attr(key, value))?;
    file.create_dataset(" format").with_i8_data(&letters("IEEE_LITTLE_32\0"));
    file.create_dataset(" hdf5version").with_i8_data(&letters(&format!("{:\0<33}", "HDF5 Version 1.8.0")));
    let version = node("CGNSLibraryVersion", "CGNSLibraryVersion_t", &Data::Single(3.4), &[1])?;
    file.add_group(version.finish());
    file.add_group(base.finish());
    Ok(file)
}
