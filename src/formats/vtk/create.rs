//! New VTU files.
//!
//! A file holds cells and boundary faces as cells. All arrays are appended raw (little-endian,
//! 64-bit sizes, not compressed), so reading is one copy.

use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;

use super::names::list_names;
use super::types::vtk_number;
use crate::formats::atomic::write_atomically;
use crate::formats::error::WriteError;
use crate::formats::new_file::{Cells, Fields, NewFile};
use crate::formats::out::{Out, in_blocks};
use crate::mesh::{CellMeasures, FamilyId, OtherCells};

/// Writes vertices `[n_vertices]` and some cells on them as a VTU file, gzipped if `path` ends in
/// `.gz`.
///
/// | data | array | values |
/// |---|---|---|
/// | point | `displacement`, if given | displacement of the vertex |
/// | point | `family` | 1 + the lowest family of the vertex, 0 without family |
/// | cell | `family` | 0 for cells, 1 + the family for faces |
/// | cell | `beta`, if given | beta for tets, 0 for others |
/// | cell | `scaled_jacobian`, if given | of the worst corner of a cell, 0 for faces |
/// | cell | `shape`, if given | of the worst corner of a cell against the undeformed mesh, 0 for faces |
///
/// Cells come before faces, each in their order. A comment at the head of the file lists the
/// families' numbers.
///
/// # Errors
///
/// - [`WriteError::Length`]: a field or the families do not fit the vertices or cells.
/// - [`WriteError::VertexOutOfRange`]: a cell names a vertex that does not exist.
/// - [`WriteError::NotFinite`]: a coordinate is NaN or infinite.
/// - [`WriteError::Io`]: the file could not be written.
pub fn write_vtu(path: &Path, vertices: &[DVec3], cells: &Cells, fields: &Fields) -> Result<(), WriteError> {
    let io = |source| WriteError::Io { path: path.into(), source };
    let bytes = vtu_bytes(vertices, cells, &OtherCells::none(), fields)?;
    write_atomically(path, |out| out.write_all(&bytes)).map_err(io)
}

/// The bytes of the file of [`write_vtu`], with other cells than tets.
///
/// # Errors
///
/// As [`write_vtu`], but for the file.
pub fn vtu_bytes(
    vertices: &[DVec3],
    cells: &Cells,
    others: &OtherCells,
    fields: &Fields,
) -> Result<Vec<u8>, WriteError> {
    let new_file = NewFile { vertices, cells: *cells, others, fields: *fields, extension: "vtu" };
    new_file.check()?;
    let mut bytes = Vec::new();
    let written = in_blocks(&mut bytes, |out| create(out, &new_file));
    written.map_err(|source| WriteError::Io { path: "in memory".into(), source })?;
    Ok(bytes)
}

/// An array of the appended section.
pub(in crate::formats) struct Array<'a> {
    name: &'static str,
    /// VTK's type name.
    kind: &'static str,
    components: usize,
    n_bytes: usize,
    write: Box<WriteArray<'a>>,
}

type WriteArray<'a> = dyn Fn(&mut Out) -> io::Result<()> + 'a;

/// An array with `len` entries. `values` runs when the array is written.
pub(in crate::formats) fn array<'a, const N: usize, I: Iterator<Item = [u8; N]>>(
    (name, kind, components): (&'static str, &'static str, usize),
    len: usize,
    values: impl Fn() -> I + 'a,
) -> Array<'a> {
    let write = move |out: &mut Out| values().try_for_each(|value| out.write_all(&value));
    Array { name, kind, components, n_bytes: len * N, write: Box::new(write) }
}

/// An array of vectors.
pub(in crate::formats) fn vectors<'a>(name: &'static str, values: &'a [DVec3]) -> Array<'a> {
    let bytes = |value: &DVec3| value.to_array().map(f64::to_le_bytes);
    array((name, "Float64", 3), 3 * values.len(), move || values.iter().flat_map(bytes))
}

/// The number of a family in a file: its index + 1.
pub(in crate::formats) fn number(family: FamilyId) -> i32 {
    i32::from(family.0) + 1
}

/// The family number of every cell and face in their order; 0 for cells.
pub(super) fn families_of_cells<'a>(new_file: &NewFile<'a>) -> impl Iterator<Item = i32> + use<'a> {
    let of_cells = std::iter::repeat_n(0, new_file.cells.tets.len() + new_file.others.n_cells());
    of_cells.chain(new_file.faces().map(|(_, _, family)| number(family)))
}

/// The number of the lowest family at each vertex, or 0 `[n_vertices]`.
fn vertex_families(new_file: &NewFile) -> Vec<i32> {
    let mut vertex_family = vec![0; new_file.vertices.len()];
    for (_, corners, family) in new_file.faces() {
        for &vertex in corners {
            let lowest = &mut vertex_family[vertex as usize];
            if *lowest == 0 || number(family) < *lowest {
                *lowest = number(family);
            }
        }
    }
    vertex_family
}

/// An array with a number for each cell that has one, and 0 for the elements after these.
fn of_cells<'a, T>(name: &'static str, n_cells: usize, cells: &'a [T], number: fn(&T) -> f64) -> Array<'a> {
    array((name, "Float64", 1), n_cells, move || {
        cells.iter().map(number).chain(std::iter::repeat_n(0.0, n_cells - cells.len())).map(f64::to_le_bytes)
    })
}

/// The names of the arrays that tell of a motion.
pub(super) const OF_MOTION: [&str; 4] = ["displacement", "beta", "scaled_jacobian", "shape"];

/// Writes a VTU file whose arrays have been checked.
pub(super) fn create(out: &mut Out, new_file: &NewFile) -> io::Result<()> {
    let NewFile { vertices, cells, fields, .. } = new_file;
    let families = cells.families;
    let n_cells = new_file.n_elements();
    let vertex_family = vertex_families(new_file);
    let mut point_data = vec![array(("family", "Int32", 1), vertices.len(), || {
        vertex_family.iter().map(|family: &i32| family.to_le_bytes())
    })];
    point_data.extend(fields.displacement.map(|displacement| vectors("displacement", displacement)));
    let mut cell_data =
        vec![array(("family", "Int32", 1), n_cells, || families_of_cells(new_file).map(i32::to_le_bytes))];
    cell_data.extend(fields.beta.map(|beta| of_cells("beta", n_cells, beta, |&beta| beta)));
    if let Some(measures) = fields.measures {
        cell_data.push(of_cells("scaled_jacobian", n_cells, measures, |cell| cell.jacobian));
        cell_data.push(of_cells("shape", n_cells, measures, CellMeasures::shape));
    }
    let n_corners = new_file.elements().map(|(_, corners)| corners.len()).sum();
    let topology = vec![
        array(("connectivity", "Int64", 1), n_corners, || {
            new_file.elements().flat_map(|(_, corners)| corners).map(|&vertex| i64::from(vertex).to_le_bytes())
        }),
        array(("offsets", "Int64", 1), n_cells, || {
            let ends = new_file.elements().scan(0, |end, (_, corners)| {
                *end += corners.len() as i64;
                Some(*end)
            });
            ends.map(i64::to_le_bytes)
        }),
        array(("types", "UInt8", 1), n_cells, || new_file.elements().map(|(shape, _)| [vtk_number(shape)])),
    ];
    let parts = [
        ("Points", vec![vectors("Points", vertices)]),
        ("Cells", topology),
        ("PointData", point_data),
        ("CellData", cell_data),
    ];

    let counts = format!("NumberOfPoints=\"{}\" NumberOfCells=\"{n_cells}\"", vertices.len());
    create_xml(out, ("UnstructuredGrid", ""), &counts, families, &parts)
}

/// Writes an XML file of one piece.
///
/// - `kind`, `head`: the type of the file, and what comes before its piece
/// - `counts`: the attributes of its piece
/// - `parts`: the parts of the piece with their arrays, in order
pub(in crate::formats) fn create_xml(
    out: &mut Out,
    (kind, head): (&str, &str),
    counts: &str,
    families: &[String],
    parts: &[(&str, Vec<Array>)],
) -> io::Result<()> {
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(out, "<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">")?;
    // A comment must not hold "--".
    writeln!(out, "<!-- {} -->", list_names(families).replace("--", "&#45;&#45;"))?;
    writeln!(out, "<{kind}>")?;
    out.write_all(head.as_bytes())?;
    writeln!(out, "<Piece {counts}>")?;
    let mut offset = 0;
    for (part, arrays) in parts {
        writeln!(out, "<{part}>")?;
        for Array { name, kind, components, n_bytes, .. } in arrays {
            write!(out, "<DataArray type=\"{kind}\" Name=\"{name}\" ")?;
            // With the attribute for one component meshio makes an array of two dimensions.
            if *components > 1 {
                write!(out, "NumberOfComponents=\"{components}\" ")?;
            }
            writeln!(out, "format=\"appended\" offset=\"{offset}\"/>")?;
            offset += size_of::<u64>() + n_bytes;
        }
        writeln!(out, "</{part}>")?;
    }
    writeln!(out, "</Piece>\n</{kind}>")?;
    write!(out, "<AppendedData encoding=\"raw\">\n_")?;
    for array in parts.iter().flat_map(|(_, arrays)| arrays) {
        out.write_all(&(array.n_bytes as u64).to_le_bytes())?;
        (array.write)(out)?;
    }
    writeln!(out, "\n</AppendedData>\n</VTKFile>")
}
