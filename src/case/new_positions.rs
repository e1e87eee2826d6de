//! Tables of new positions: rows of an index and a position, in this order without a header, as SU2
//! writes `surface_positions.dat`, or in the columns that a header names. The index is the vertex
//! of the mesh, from 0.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;

use super::displacement_error::{DisplacementError, RowPlace};
use crate::text::header::{self, Header};
use crate::text::{comma_advice, parse_number, shorten};

/// Names of a column with indices, in lower case. A program that extracts a surface counts the
/// surface's own points, and calls their numbers `Point ID` or `id`. These are no indices of the
/// mesh.
const INDEX: &[&str] =
    &["index", "vertex", "vertex index", "vertex id", "node", "node index", "global index", "globalindex", "pointid"];

/// The number of columns of a table, the columns with the index, x, y and z, and others that may be
/// displacements.
pub(super) struct Columns {
    n: usize,
    of: [usize; 4],
    others: Vec<UnknownVector>,
}

/// Three columns that may be displacements.
struct UnknownVector {
    columns: [usize; 3],
    /// Their names, in words.
    names: String,
}

impl Columns {
    /// The columns without a header.
    pub const DEFAULT: Self = Self { n: 4, of: [0, 1, 2, 3], others: Vec::new() };

    /// Whether a row without a header has these columns.
    pub fn fit(fields: &[&str]) -> bool {
        fields.len() == Self::DEFAULT.n
    }

    /// Whether a row is one of these columns, which a comment names. Other words in the comment
    /// count as columns too, so a row of the default columns is read as without a header.
    pub fn of_comment_fit(&self, fields: &[&str]) -> bool {
        !Self::fit(fields) || self.n == fields.len() || !self.of.is_sorted()
    }

    /// The columns that a header names. `None` if it has no column with indices, or columns of
    /// displacements or original positions beside it. The error is the fault of the header.
    pub fn of(fields: &[&str]) -> Option<Result<Self, String>> {
        if !header::is_header(fields) {
            return None;
        }
        let header = Header::of(fields);
        let is_index = |name: &&str| INDEX.contains(&name.to_lowercase().replace(['_', '-'], " ").as_str());
        let mut indices = (0..header.names.len()).filter(|&column| is_index(&header.names[column]));
        let index = indices.next()?;
        if header::DISPLACEMENT.is_in(&header) || header::ORIGINAL.is_in(&header) {
            return None;
        }
        if let Some(second) = indices.next() {
            let names = [index, second].map(|column| header.names[column]);
            return Some(Err(format!("the columns '{}' and '{}' both are indices", names[0], names[1])));
        }
        let columns = header::POSITION.columns(&header).and_then(|position| {
            header.check_units(&position)?;
            let [x, y, z] = position;
            let others = header.unknown_vectors().into_iter().map(|columns| {
                let names = columns.map(|column| format!("'{}'", header.names[column]));
                UnknownVector { columns, names: shorten(&names.join(", ")) }
            });
            Ok(Self { n: header.names.len(), of: [index, x, y, z], others: others.collect() })
        });
        Some(columns)
    }

    /// The names of three columns that may be displacements and have a number other than 0 in this
    /// row.
    pub fn unread(&self, fields: &[&str]) -> Option<String> {
        let is_other =
            |&column: &usize| fields.get(column).and_then(|field| parse_number(field)).is_some_and(|of| of != 0.0);
        self.others.iter().find(|other| other.columns.iter().any(is_other)).map(|other| other.names.clone())
    }
}

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
pub(super) fn row(line: usize, fields: &[&str], columns: &Columns) -> Result<NewPosition, String> {
    if fields.len() != columns.n {
        let n = columns.n;
        return Err(format!("{} columns in a table of an index and a new position with {n} columns", fields.len()));
    }
    let [vertex, x, y, z] = columns.of.map(|column| fields[column]);
    let of_new = "in a row of an index and a new position";
    let vertex = vertex.parse().map_err(|_| format!("\"{}\" is no index of a vertex, {of_new}", shorten(vertex)))?;
    let number = |field: &str| match parse_number(field) {
        Some(value) if value.is_finite() => Ok(value),
        _ => Err(format!("\"{}\" is not a finite number{}, {of_new}", shorten(field), comma_advice(field))),
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
            let less_one =
                |row: &NewPosition| row.vertex.checked_sub(1).is_some_and(|less| place_of.contains_key(&less));
            let from_one = table.iter().all(less_one);
            return Err(DisplacementError::NotOfFamily { path, line, vertex, n_vertices: vertices.len(), from_one });
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
