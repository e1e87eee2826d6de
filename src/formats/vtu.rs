//! VTU, the VTK unstructured grid of ParaView: written only.
//!
//! One file with tets and boundary triangles as cells, all arrays appended raw (little-endian, 64-bit sizes, not
//! compressed: reading it is then one copy).

use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;

use super::{Fields, WriteError, write_generated};
use crate::mesh::{FamilyId, TetMesh};

/// VTK's numbers for the cell types.
const VTK_TRIANGLE: u8 = 5;
const VTK_TETRA: u8 = 10;

/// Cells of a mesh: all of them, or the few worth looking at.
#[derive(Clone, Copy, Debug)]
pub struct Cells<'a> {
    /// Vertices of each tet `[n_tets]`.
    pub tets: &'a [[u32; 4]],
    /// Vertices of each triangle `[n_triangles]`.
    pub triangles: &'a [[u32; 3]],
    /// Family of each triangle `[n_triangles]`.
    pub triangle_family: &'a [FamilyId],
    /// Names of the families.
    pub families: &'a [String],
}

impl<'a> Cells<'a> {
    /// All cells of a mesh.
    pub fn of(mesh: &'a TetMesh) -> Self {
        let TetMesh { tets, triangles, triangle_family, families, .. } = mesh;
        Self { tets, triangles, triangle_family, families }
    }
}

/// Writes vertices `[n_vertices]` and some cells on them as a VTU file, gzipped if `path` ends in `.gz`.
///
/// - point data: `displacement` if given; `family`: 1 + the lowest family that touches the vertex, 0 if none does
/// - cell data: `family`: 0 for tets, 1 + its family for triangles; `beta` if given: that of the tets, 0 for triangles
///
/// Tets come before triangles, each in their order. A comment at the head of the file tells which number is which
/// family.
///
/// # Errors
///
/// - [`WriteError::Length`]: a field or the families do not fit the vertices or cells.
/// - [`WriteError::VertexOutOfRange`]: a cell names a vertex that is not there.
/// - [`WriteError::NotFinite`]: a coordinate is NaN or infinite.
/// - [`WriteError::Io`]: the file could not be written.
pub fn write_vtu(path: &Path, vertices: &[DVec3], cells: &Cells, fields: &Fields) -> Result<(), WriteError> {
    write_generated(path, generate, vertices, cells, fields)
}

/// An array of the appended section.
struct Array<'a> {
    name: &'static str,
    /// VTK's type name.
    kind: &'static str,
    components: usize,
    n_bytes: usize,
    write: Box<WriteArray<'a>>,
}

type WriteArray<'a> = dyn Fn(&mut dyn Write) -> io::Result<()> + 'a;

/// Describes an array of `len` entries; `values` is run when it is written.
fn array<'a, const N: usize, I: Iterator<Item = [u8; N]>>(
    (name, kind, components): (&'static str, &'static str, usize),
    len: usize,
    values: impl Fn() -> I + 'a,
) -> Array<'a> {
    let write = move |out: &mut dyn Write| {
        // A virtual call for each number would cost more than the copy.
        let mut block = Vec::with_capacity(1 << 16);
        for value in values() {
            block.extend_from_slice(&value);
            if block.len() + N > block.capacity() {
                out.write_all(&block)?;
                block.clear();
            }
        }
        out.write_all(&block)
    };
    Array { name, kind, components, n_bytes: len * N, write: Box::new(write) }
}

fn vectors<'a>(name: &'static str, values: &'a [DVec3]) -> Array<'a> {
    let bytes = |value: &DVec3| value.to_array().map(f64::to_le_bytes);
    array((name, "Float64", 3), 3 * values.len(), move || values.iter().flat_map(bytes))
}

fn number(family: FamilyId) -> i32 {
    i32::from(family.0) + 1
}

/// Writes a VTU file whose arrays have been checked.
pub(super) fn generate(out: &mut dyn Write, vertices: &[DVec3], cells: &Cells, fields: &Fields) -> io::Result<()> {
    let Cells { tets, triangles, triangle_family, families } = *cells;
    let n_cells = tets.len() + triangles.len();
    let mut vertex_family = vec![0; vertices.len()];
    for (triangle, &family) in triangles.iter().zip(triangle_family) {
        for &vertex in triangle {
            let lowest = &mut vertex_family[vertex as usize];
            if *lowest == 0 || number(family) < *lowest {
                *lowest = number(family);
            }
        }
    }
    let mut point_data = vec![array(("family", "Int32", 1), vertices.len(), || {
        vertex_family.iter().map(|family: &i32| family.to_le_bytes())
    })];
    point_data.extend(fields.displacement.map(|displacement| vectors("displacement", displacement)));
    let mut cell_data = vec![array(("family", "Int32", 1), n_cells, || {
        let of_tets = tets.iter().map(|_| 0);
        of_tets.chain(triangle_family.iter().map(|&family| number(family))).map(i32::to_le_bytes)
    })];
    cell_data.extend(fields.beta.map(|beta| {
        array(("beta", "Float64", 1), n_cells, || {
            beta.iter().copied().chain(triangles.iter().map(|_| 0.0)).map(f64::to_le_bytes)
        })
    }));
    let n_corners = 4 * tets.len() + 3 * triangles.len();
    let topology = vec![
        array(("connectivity", "Int64", 1), n_corners, || {
            tets.iter().flatten().chain(triangles.iter().flatten()).map(|&vertex| i64::from(vertex).to_le_bytes())
        }),
        array(("offsets", "Int64", 1), n_cells, || {
            let of_triangles = (1..=triangles.len()).map(|count| 4 * tets.len() + 3 * count);
            (1..=tets.len()).map(|count| 4 * count).chain(of_triangles).map(|end| (end as i64).to_le_bytes())
        }),
        array(("types", "UInt8", 1), n_cells, || {
            tets.iter().map(|_| [VTK_TETRA]).chain(triangles.iter().map(|_| [VTK_TRIANGLE]))
        }),
    ];
    let parts = [
        ("Points", vec![vectors("Points", vertices)]),
        ("Cells", topology),
        ("PointData", point_data),
        ("CellData", cell_data),
    ];

    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(
        out,
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">"
    )?;
    writeln!(out, "<!-- families:{} -->", listed(families))?;
    writeln!(out, "<UnstructuredGrid>")?;
    writeln!(out, "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{n_cells}\">", vertices.len())?;
    let mut offset = 0;
    for (part, arrays) in &parts {
        writeln!(out, "<{part}>")?;
        for Array { name, kind, components, n_bytes, .. } in arrays {
            write!(out, "<DataArray type=\"{kind}\" Name=\"{name}\" ")?;
            // Told of one component, meshio makes an array of two dimensions.
            if *components > 1 {
                write!(out, "NumberOfComponents=\"{components}\" ")?;
            }
            writeln!(out, "format=\"appended\" offset=\"{offset}\"/>")?;
            offset += size_of::<u64>() + n_bytes;
        }
        writeln!(out, "</{part}>")?;
    }
    writeln!(out, "</Piece>\n</UnstructuredGrid>")?;
    write!(out, "<AppendedData encoding=\"raw\">\n_")?;
    for array in parts.iter().flat_map(|(_, arrays)| arrays) {
        out.write_all(&(array.n_bytes as u64).to_le_bytes())?;
        (array.write)(out)?;
    }
    writeln!(out, "\n</AppendedData>\n</VTKFile>")
}

/// The families and their numbers, fit for an XML comment: ` 1=wing, 2=far field`.
fn listed(families: &[String]) -> String {
    let mut list = String::new();
    for (index, family) in families.iter().enumerate() {
        let comma = if index == 0 { "" } else { "," };
        list += &format!("{comma} {}={family}", index + 1);
    }
    // A comment may hold neither "--" nor control characters, and ends at "-->".
    list.chars()
        .map(|letter| if letter.is_control() { '\u{fffd}' } else { letter })
        .collect::<String>()
        .replace("--", "&#45;&#45;")
}
