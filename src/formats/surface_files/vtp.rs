//! VTK's poly data (`.vtp`).
//!
//! | data | array | values |
//! |---|---|---|
//! | point | `displacement`, if the mesh was moved | displacement of the vertex |
//! | point | `vertex` | number of the vertex in the mesh, from 0 |
//! | polygon | `family` | 1 + the family, as in a `.vtu` file |
//! | field | `families` | the names of the families |

use std::io;

use super::{SurfaceFile, Used};
use crate::formats::out::Out;
use crate::formats::vtk::{Array, array, create_xml, family_number, vectors};

/// Writes the surfaces.
pub(super) fn create(out: &mut Out, surface: &SurfaceFile) -> io::Result<()> {
    let families = surface.families();
    let faces = || families.iter().flat_map(|(_, _, faces)| faces.iter().copied());
    let used = Used::new(faces(), surface.vertices.len());
    let points = used.pick(surface.vertices);
    let displacement = surface.displacement.map(|displacement| used.pick(displacement));
    let mut point_data: Vec<Array> =
        displacement.iter().map(|displacement| vectors("displacement", displacement)).collect();
    point_data.push(array(("vertex", "Int64", 1), points.len(), || {
        used.vertices.iter().map(|&vertex| i64::from(vertex).to_le_bytes())
    }));
    let n_faces = faces().count();
    let numbers =
        || families.iter().flat_map(|(family, _, faces)| std::iter::repeat_n(family_number(*family), faces.len()));
    let polygons = vec![
        array(("connectivity", "Int64", 1), faces().map(<[u32]>::len).sum(), || {
            faces().flatten().map(|&vertex| i64::from(used.number(vertex)).to_le_bytes())
        }),
        array(("offsets", "Int64", 1), n_faces, || {
            let ends = faces().scan(0, |end, face| {
                *end += face.len() as i64;
                Some(*end)
            });
            ends.map(i64::to_le_bytes)
        }),
    ];
    let parts = [
        ("PointData", point_data),
        ("CellData", vec![array(("family", "Int32", 1), n_faces, || numbers().map(i32::to_le_bytes))]),
        ("Points", vec![vectors("Points", &points)]),
        ("Polys", polygons),
    ];
    let counts = format!(
        "NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{n_faces}\"",
        points.len()
    );
    let names = &surface.mesh.mesh.families;
    create_xml(out, ("PolyData", &names_field(names)), &counts, names, &parts)
}

/// The names of the families as an array of texts: the codes of the letters, a zero after each
/// name.
fn names_field(names: &[String]) -> String {
    let codes = names.iter().flat_map(|name| name.bytes().filter(|&byte| byte != 0).chain([0]));
    let codes: Vec<String> = codes.map(|code| code.to_string()).collect();
    format!(
        "<FieldData>\n<DataArray type=\"String\" Name=\"families\" NumberOfTuples=\"{}\" format=\"ascii\">{}</DataArray>\n\
         </FieldData>\n",
        names.len(),
        codes.join(" ")
    )
}
