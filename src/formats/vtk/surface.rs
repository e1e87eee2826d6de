//! Surface meshes in VTK's XML files: poly data (`.vtp`) and unstructured grids (`.vtu`).

use std::path::Path;

use super::cells::{self, Corners, Table};
use super::header::{Contents, read_header};
use super::vtu::File;
use crate::formats::allowance::Allowance;
use crate::formats::error::ReadError;
use crate::formats::mesh_builder::MeshBuilder;
use crate::formats::number::{Integers, Number};
use crate::formats::surface::{PointField, Surface};

/// Reads a poly data file from its (decompressed) bytes. `path` is for messages.
pub(in crate::formats) fn read_poly_data(path: &Path, bytes: &[u8]) -> Result<Surface, ReadError> {
    read(path, bytes, Contents::Polygons, |file, surface| {
        surface.count("triangle strips", file.piece.n_strips);
        if file.piece.n_cells == 0 {
            return Ok(());
        }
        let mut corners = file.corners("Polys")?;
        read_polygons(file, &mut corners, surface)
    })
}

/// Reads the faces of an unstructured grid from its (decompressed) bytes. `path` is for messages.
pub(in crate::formats) fn read_grid(path: &Path, bytes: &[u8]) -> Result<Surface, ReadError> {
    read(path, bytes, Contents::Cells, |file, surface| {
        let types = file.of_cells(file.array("Cells", Some("types"))?)?;
        let corners = file.corners("Cells")?;
        let tag = file.array("Cells", Some("connectivity"))?.tag;
        let malformed = |expected: String, found: String| file.malformed(tag, expected, found);
        if types.len() != file.piece.n_cells {
            let expected = format!("{} cell types, as the piece declares", file.piece.n_cells);
            return Err(malformed(expected, types.len().to_string()));
        }
        let mut mesh_builder = MeshBuilder::default();
        // Families of faces do not matter.
        let families = Some(Integers::from(vec![0; types.len()]));
        let table = Table { types, corners };
        let number = |vertex| vertex as u32;
        cells::assemble(path, table, families, surface.points.len(), number, malformed, &mut mesh_builder)?;
        surface.take(mesh_builder);
        Ok(())
    })
}

/// Reads points, fields and, with `read_faces`, faces.
fn read(
    path: &Path,
    bytes: &[u8],
    contents: Contents,
    read_faces: impl Fn(&File, &mut Surface) -> Result<(), ReadError>,
) -> Result<Surface, ReadError> {
    let header = read_header(path, bytes, contents)?;
    let pieces: Vec<_> = header.pieces.iter().filter(|piece| piece.n_points > 0).collect();
    let [piece] = pieces[..] else {
        let found = format!("a surface of {} pieces with points", pieces.len());
        let hint = "merge the pieces (in ParaView: Append Geometry or Merge Blocks)";
        return Err(ReadError::Unsupported { path: path.into(), found, hint });
    };
    let allowance = Allowance::new(path, bytes.len());
    let file = File { path, bytes, header: &header, piece, allowance: &allowance };
    let points = file.array("Points", None)?;
    let mut surface = Surface { is_single: points.number == Number::F32, ..Surface::default() };
    surface.points = file.read_points(points)?.0;
    read_faces(&file, &mut surface)?;
    for array in piece.arrays.iter().filter(|array| array.section == "PointData") {
        if matches!(array.n_components, 1 | 3) {
            let (name, n_components) = (array.name.clone(), array.n_components);
            surface.fields.push(PointField { name, n_components, values: file.of_points(array)? });
        }
    }
    Ok(surface)
}

/// Reads polygons, of which triangles are kept.
fn read_polygons(file: &File, corners: &mut Corners, surface: &mut Surface) -> Result<(), ReadError> {
    let tag = file.array("Polys", Some("connectivity"))?.tag;
    let n_points = surface.points.len();
    let mut start = 0;
    for polygon in 0..file.piece.n_cells {
        let range = corners.of(polygon, start).map_err(|end| {
            file.malformed(tag, format!("the end of polygon {polygon} from {start} on"), end.to_string())
        })?;
        start = range.end;
        let mut vertices = Vec::with_capacity(3);
        for place in range {
            let point = corners.vertex(place).unwrap_or(-1);
            let known = u32::try_from(point).ok().filter(|&point| (point as usize) < n_points);
            let expected = || format!("a point of polygon {polygon} below {n_points}");
            vertices.push(known.ok_or_else(|| file.malformed(tag, expected(), point.to_string()))?);
        }
        match vertices[..] {
            [a, b, c] => surface.triangles.push([a, b, c]),
            _ => surface.count("polygons that are no triangles", 1),
        }
    }
    Ok(())
}
