//! Tables of new positions: rows `index x y z` without a header, as SU2 writes
//! `surface_positions.dat`. The index is the vertex of the mesh, from 0.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;

use super::displacement_error::{DisplacementError, RowPlace};
use crate::text::{parse_number, shorten};

/// Number of columns.
pub(super) const N_COLUMNS: usize = 4;

/// One row: a vertex and its new position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewPosition {
    /// Line in the file, from 1.
    pub line: usize,
    /// The vertex of the mesh, from 0.
    pub vertex: u32,
    /// New position, in the mesh's unit.
    pub position: DVec3,
}

/// Reads a row of the table. The error is the fault of the row, in words.
pub(super) fn row(line: usize, fields: &[&str]) -> Result<NewPosition, String> {
    let &[vertex, x, y, z] = fields else {
        return Err(format!("{} columns after rows of an index and a new position", fields.len()));
    };
    let of_new = "in a row of an index and a new position";
    let vertex = vertex.parse().map_err(|_| format!("\"{}\" is no index of a vertex, {of_new}", shorten(vertex)))?;
    let number = |field: &str| match parse_number(field) {
        Some(value) if value.is_finite() => Ok(value),
        _ => Err(format!("\"{}\" is not a finite number, {of_new}", shorten(field))),
    };
    Ok(NewPosition { line, vertex, position: DVec3::new(number(x)?, number(y)?, number(z)?) })
}

/// The row of each vertex of a family `[n family_vertices]`. Every row must belong to a vertex of
/// the family: a table that counts vertices otherwise would move every vertex to the place of
/// another one.
///
/// - `path`: the file's path, for errors
/// - `vertices` `[n_vertices]`: original positions of the whole mesh, in the mesh's unit
/// - `family_vertices`: the family's vertices, each once
///
/// # Errors
/// [`DisplacementError::NotOfFamily`], [`DisplacementError::Doubled`] or
/// [`DisplacementError::Missing`]
pub(super) fn match_indices(
    path: &Path,
    table: &[NewPosition],
    vertices: &[DVec3],
    family_vertices: &[u32],
) -> Result<Vec<NewPosition>, DisplacementError> {
    let place_of: HashMap<u32, usize> = family_vertices.iter().copied().zip(0..).collect();
    let mut row_of: Vec<Option<NewPosition>> = vec![None; family_vertices.len()];
    for &row in table {
        let NewPosition { line, vertex, .. } = row;
        let path = path.to_path_buf();
        let Some(&place) = place_of.get(&vertex) else {
            return Err(DisplacementError::NotOfFamily { path, line, vertex, n_vertices: vertices.len() });
        };
        if let Some(first) = row_of[place].replace(row) {
            let position = vertices[vertex as usize];
            let (row, first) = (RowPlace::Line(line), RowPlace::Line(first.line));
            return Err(DisplacementError::Doubled { path, row, first, position });
        }
    }
    let missing = row_of.iter().filter(|row| row.is_none()).count();
    if let Some(first) = row_of.iter().position(Option::is_none) {
        let (path, total, vertex) = (path.to_path_buf(), family_vertices.len(), family_vertices[first]);
        return Err(DisplacementError::Missing { path, missing, total, vertex, position: vertices[vertex as usize] });
    }
    Ok(row_of.into_iter().flatten().collect())
}
