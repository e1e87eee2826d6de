//! The cells of a VTK file, however it was encoded.

use std::path::Path;

use glam::DVec3;

use super::types::{vtk_kind, vtk_number};
use crate::formats::assembly::{Assembly, Kind, MOST_VERTICES, Shape};
use crate::formats::error::ReadError;

/// Types, ends and vertices of the cells.
pub(super) struct Table {
    /// VTK's number for the type of each cell `[n_cells]`.
    pub types: Vec<i64>,
    /// Where the vertices of each cell end in `connectivity` `[n_cells]`.
    pub offsets: Vec<i64>,
    pub connectivity: Vec<i64>,
}

/// Points, and ends and points of the lines, as a file of poly data holds them.
pub(super) type LineArrays = (Vec<DVec3>, Vec<i64>, Vec<i64>);

/// Sorts the cells by their types; `families` `[n_cells]` gives the number of each cell's family.
///
/// - `malformed`: makes the error from what was expected and what was found
pub(super) fn assemble(
    path: &Path,
    table: &Table,
    families: Option<&[i64]>,
    n_vertices: usize,
    malformed: impl Fn(String, String) -> ReadError,
) -> Result<Assembly, ReadError> {
    if n_vertices >= MOST_VERTICES {
        return Err(ReadError::TooMany {
            path: path.into(),
            what: "vertices",
            count: n_vertices,
            limit: MOST_VERTICES,
        });
    }
    let n_cells = table.types.len();
    if table.offsets.len() != n_cells {
        return Err(malformed(format!("{n_cells} cell offsets"), table.offsets.len().to_string()));
    }
    if let Some(found) = families.map(<[i64]>::len).filter(|&len| len != n_cells) {
        return Err(malformed(format!("{n_cells} families of cells"), found.to_string()));
    }
    let mut assembly = Assembly::default();
    for shape in [Shape::Tet, Shape::Triangle] {
        let number = i64::from(vtk_number(shape));
        assembly.reserve(shape, table.types.iter().filter(|&&other| other == number).count());
    }
    let mut start = 0;
    for (cell, (&number, &end)) in table.types.iter().zip(&table.offsets).enumerate() {
        let corners = usize::try_from(end).ok().and_then(|end| table.connectivity.get(start..end));
        let corners = corners.ok_or_else(|| {
            let expected = format!("the end of cell {cell} between {start} and {}", table.connectivity.len());
            malformed(expected, end.to_string())
        })?;
        start += corners.len();
        let kind = u64::try_from(number).ok().and_then(vtk_kind);
        let (kind, n_corners) =
            kind.ok_or_else(|| malformed(format!("the type of cell {cell}"), number.to_string()))?;
        if let Some(expected) = n_corners.filter(|&expected| expected != corners.len()) {
            let expected = format!("{expected} vertices of cell {cell}, of type {number}");
            return Err(malformed(expected, corners.len().to_string()));
        }
        let shape = match kind {
            Kind::Mesh(shape) => shape,
            Kind::PassOver(name) => {
                assembly.pass_over(name, 1);
                continue;
            }
            Kind::Refuse(name) => {
                assembly.refuse(name, 1);
                continue;
            }
        };
        let family = families.map_or(0, |families| families[cell]);
        let tag =
            i32::try_from(family).map_err(|_| malformed(format!("the family of cell {cell}"), family.to_string()))?;
        let mut next = corners.iter();
        assembly.push(shape, tag, || {
            let vertex = next.next().copied().unwrap_or(-1);
            match u32::try_from(vertex) {
                Ok(vertex) if (vertex as usize) < n_vertices => Ok(vertex),
                _ => Err(malformed(format!("a vertex of cell {cell} below {n_vertices}"), vertex.to_string())),
            }
        })?;
    }
    let has_faces = !assembly.triangles.is_empty() || !assembly.others.quadrilaterals.is_empty();
    if families.is_none() && has_faces {
        return Err(ReadError::Missing {
            path: path.into(),
            what: "cell array 'family'",
            hint: "give the boundary faces their families as whole numbers in a cell array of that name",
        });
    }
    Ok(assembly)
}
