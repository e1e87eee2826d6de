//! Airfoil coordinates without units, as in databases and panel codes, and their placement in
//! space.
//!
//! A file has rows `x y` after titles, in one of these orders:
//!
//! - Selig's: from the trailing edge over one side to the leading edge and back along the other
//!   side; a curve that comes back to its start may start anywhere
//! - Lednicer's: the numbers of points of both sides, then each side between the edges
//! - the two sides one after the other, each with its number of points or a label before it, or
//!   with neither
//!
//! The limits of the domain of ISES may stand before the points. The chord is 1, or 100. A third
//! column may hold the coordinate along the span, the same in all rows. It is the second or the
//! third column.

use std::path::Path;

use glam::{DVec2, DVec3};

use super::airfoil_rows::Table;
use super::fail;
use super::sides::{Break, check_place, in_chords, join};
use super::tecplot::Curve;
use crate::profile::ProfileError;

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

/// The coordinate along the span must be the same in all rows, up to this share of the largest
/// coordinate.
const SAME: f64 = 1e-9;

/// A point of an airfoil has no x beyond this multiple of the largest x of the other points.
const BEYOND: f64 = 1.5;

/// What a row of numbers that are no numbers of points may be else.
const OR_TITLE: &str =
    "that many points of the upper and of the lower side; or, if the line is a title, a letter in it";

/// Reads the points of one airfoil, from one side of the trailing edge to the other, in units of
/// the chord.
///
/// # Errors
/// [`ProfileError::Line`]
pub(super) fn parse(path: &Path, text: &str) -> Result<Vec<DVec2>, ProfileError> {
    let mut table = Table::read(path, text)?;
    let counts = counts(path, &mut table)?;
    let points = in_plane(path, &table)?;
    if points.is_empty() {
        return Err(fail(path, text.lines().count().max(1) - 1, "no point".into(), "rows of two numbers: x y"));
    }
    let starts = starts(path, &table, points.len())?;
    let second = match (counts, &starts[..]) {
        (Some(at), _) | (None, &[at]) => Break::At(at),
        (None, []) => Break::Perhaps(&table.after_blank),
        (None, &[_, third, ..]) => {
            let what = "a third side begins".to_string();
            return Err(fail(path, table.lines[third], what, "one airfoil: one curve, or its two sides"));
        }
    };
    closed_curve(path, &table.lines, &points, &second)
}

/// The points of one airfoil, as [`parse`] gives them, whose one curve or two sides are curves of
/// Tecplot in the plane z = 0.
///
/// # Errors
/// [`ProfileError::Line`]
pub(super) fn of_curves(path: &Path, curves: &[Curve]) -> Result<Vec<DVec2>, ProfileError> {
    let (lines, points): (Vec<_>, Vec<_>) =
        curves.iter().flat_map(|curve| curve.points.iter().map(|point| (curve.line, point.truncate()))).unzip();
    if points.is_empty() {
        return Err(fail(path, 0, "no point".into(), "a zone with the points of an airfoil"));
    }
    let second = match curves {
        [] | [_] => Break::Perhaps(&[]),
        [first, _] => Break::At(first.points.len()),
        [_, _, third, ..] => {
            let what = "a third curve without z among its variables".to_string();
            return Err(fail(path, third.line, what, "one airfoil: one curve, or its two sides"));
        }
    };
    closed_curve(path, &lines, &points, &second)
}

/// The curve of an airfoil, in chords, from one side of the trailing edge to the other.
///
/// - `lines` `[n_points]`: line of each point, from 0
/// - `points` `[n_points]`: as in the file
fn closed_curve(path: &Path, lines: &[usize], points: &[DVec2], second: &Break) -> Result<Vec<DVec2>, ProfileError> {
    let mut curve = join(path, lines, points, second)?;
    // Both sides begin at the leading edge, so the point occurs twice.
    curve.dedup();
    in_chords(&mut curve);
    check_place(path, lines[0], &curve)?;
    Ok(curve)
}

/// The number of points of the first side, if a row of two numbers of points is before all points.
/// The row may also be a title, or the first point in percent of the chord.
///
/// # Errors
/// The row may be either, and does not fit the points.
fn counts(path: &Path, table: &mut Table) -> Result<Option<usize>, ProfileError> {
    let Some(heading) = &table.heading else { return Ok(None) };
    let ([first, second], n_points) = (heading.numbers, table.rows.len());
    if first.fract() == 0.0 && first + second == n_points as f64 {
        return Ok(Some(first as usize));
    }
    let largest = table.rows.iter().fold(0.0, |largest: f64, row| largest.max(row[0].abs()));
    if first <= BEYOND * largest {
        table.heading_is_point();
    } else if !heading.is_title {
        let what = format!("{n_points} points after the numbers {first} and {second}");
        return Err(fail(path, heading.line, what, OR_TITLE));
    }
    Ok(None)
}

/// The first points of all sides but the first, where rows between the points tell.
///
/// # Errors
/// A side has another number of points than the row before it says.
fn starts(path: &Path, table: &Table, n_points: usize) -> Result<Vec<usize>, ProfileError> {
    let mut starts: Vec<usize> = table.starts.iter().map(|start| start.at).filter(|&at| at < n_points).collect();
    starts.dedup();
    for start in &table.starts {
        let Some(count) = start.count.filter(|_| !start.is_title) else { continue };
        let end = starts.iter().copied().find(|&at| at > start.at).unwrap_or(n_points);
        if count != (end - start.at) as f64 {
            let what = format!("{} points after the number {count}", end - start.at);
            return Err(fail(path, start.line, what, "that many points; or, if the line is a title, a letter in it"));
        }
    }
    starts.retain(|&at| at > 0);
    Ok(starts)
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
