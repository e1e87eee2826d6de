//! Airfoil coordinates without units, as in databases and panel codes, and their placement in
//! space.
//!
//! A file has rows `x y` after a title, in one of these orders:
//!
//! - Selig's: from the trailing edge over one side to the leading edge and back along the other
//!   side
//! - Lednicer's: the numbers of points of both sides, then each side between the edges
//! - the two sides without their numbers, one after the other
//!
//! A third column may hold the coordinate along the span, the same in all rows. It is the second or
//! the third column.

use std::path::Path;

use glam::{DVec2, DVec3};

use super::sides::{Break, check_place, join};
use super::{fail, number};
use crate::profile::ProfileError;
use crate::text::{Mark, Row, fields, parse_number, rows};

/// The coordinate axis along the span. Profiles lie in planes perpendicular to this axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SpanAxis {
    /// Span along y: chord along x, thickness along z.
    #[default]
    Y,
    /// Span along z: chord along x, thickness along y.
    Z,
}

/// Position, size and twist of an airfoil of chord 1 in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Length of the chord, in the mesh's unit.
    pub chord: f64,
    /// Nose-up rotation about the leading edge, in degrees.
    pub twist: f64,
    /// Position of the airfoil's origin, its leading edge, in the mesh's unit.
    pub position: DVec3,
    /// The axis along the span.
    pub span: SpanAxis,
}

impl Placement {
    /// Places a point of the airfoil in space, in the mesh's unit.
    ///
    /// - `point`: x along the chord, y upward, in chords
    pub fn place(&self, point: DVec2) -> DVec3 {
        let (sin, cos) = self.twist.to_radians().sin_cos();
        let (along, up) = (point.x * cos + point.y * sin, point.y * cos - point.x * sin);
        let turned = match self.span {
            SpanAxis::Y => DVec3::new(along, 0.0, up),
            SpanAxis::Z => DVec3::new(along, up, 0.0),
        };
        self.position + self.chord * turned
    }
}

/// A first row of two whole numbers above this is no point of an airfoil. It holds Lednicer's
/// numbers of points.
const COUNTS: f64 = 1.5;

/// The coordinate along the span must be the same in all rows, up to this share of the largest
/// coordinate.
const SAME: f64 = 1e-9;

/// The rows of numbers in a file.
struct Table {
    /// Line of each row, from 0.
    lines: Vec<usize>,
    /// The two or three numbers of each row; the third is 0 if there are two.
    rows: Vec<[f64; 3]>,
    /// Indices of the rows after a blank line.
    after_blank: Vec<usize>,
}

/// Reads the points of one airfoil, from one side of the trailing edge to the other.
///
/// # Errors
/// [`ProfileError::Line`]
pub(super) fn parse(path: &Path, text: &str) -> Result<Vec<DVec2>, ProfileError> {
    let table = table(path, text)?;
    let points = in_plane(path, &table)?;
    let Some(&counts) = points.first() else {
        return Err(fail(path, text.lines().count().max(1) - 1, "no point".into(), "rows of two numbers: x y"));
    };
    let mut curve = if counts.min_element() > COUNTS {
        let [first, second] = counts.to_array().map(|count| count as usize);
        let points = &points[1..];
        if counts != DVec2::new(first as f64, second as f64) || points.len() != first.saturating_add(second) {
            let what = format!("{} points after the numbers {} and {}", points.len(), counts.x, counts.y);
            return Err(fail(path, table.lines[0], what, "that many points of the upper and of the lower side"));
        }
        join(path, &table.lines[1..], points, &Break::At(first))?
    } else {
        join(path, &table.lines, &points, &Break::Perhaps(&table.after_blank))?
    };
    // Both sides begin at the leading edge, so the point occurs twice.
    curve.dedup();
    check_place(path, table.lines[0], &curve)?;
    Ok(curve)
}

fn table(path: &Path, text: &str) -> Result<Table, ProfileError> {
    let mut table = Table { lines: Vec::new(), rows: Vec::new(), after_blank: Vec::new() };
    let (mut n_columns, mut is_first, mut blank) = (0, true, false);
    for Row { line, text: row, comment } in rows(text, Mark::Any) {
        let words = fields(row);
        let n = words.len();
        if n == 0 {
            blank |= comment.is_empty();
            continue;
        }
        let is_point = (2..=3).contains(&n) && words.iter().all(|word| parse_number(word).is_some());
        // The title, which may be missing, is any row that is no point. Names of the columns may
        // follow it.
        let is_title = std::mem::take(&mut is_first);
        if !is_point && (is_title || table.rows.is_empty() && names_columns(&words)) {
            continue;
        }
        if !(2..=3).contains(&n) || !table.rows.is_empty() && n != n_columns {
            let expected = match n_columns {
                3 => "three numbers as before: x, y and the place along the span",
                _ => "two numbers: x y",
            };
            return Err(fail(path, line, format!("{n} words"), expected));
        }
        let mut values = [0.0; 3];
        for (value, word) in values.iter_mut().zip(&words) {
            *value = number(path, line, word)?;
        }
        if std::mem::take(&mut blank) && !table.rows.is_empty() {
            table.after_blank.push(table.rows.len());
        }
        n_columns = n;
        table.lines.push(line);
        table.rows.push(values);
    }
    Ok(table)
}

/// Whether a row holds names of coordinates, such as `x/c y/c`.
fn names_columns(words: &[&str]) -> bool {
    words.iter().all(|word| matches!(&*word.to_ascii_lowercase(), "x" | "y" | "z" | "x/c" | "y/c" | "z/c"))
}

/// The coordinates in the airfoil's plane, without the coordinate along the span.
fn in_plane(path: &Path, table: &Table) -> Result<Vec<DVec2>, ProfileError> {
    let largest = table.rows.iter().flatten().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let varies =
        |column: usize| table.rows.iter().position(|row| (row[column] - table.rows[0][column]).abs() > SAME * largest);
    let up = match (varies(1), varies(2)) {
        (_, None) => 1,
        (None, Some(_)) => 2,
        (Some(_), Some(row)) => {
            let what = "the second and the third column both change".to_string();
            let expected = "x, y and the place along the span, the same in all rows";
            return Err(fail(path, table.lines[row], what, expected));
        }
    };
    Ok(table.rows.iter().map(|row| DVec2::new(row[0], row[up])).collect())
}
