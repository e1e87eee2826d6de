//! Airfoil coordinates without units, as databases and panel codes hold them, and where they go in space.
//!
//! Selig's order: a title, then `x y` from the trailing edge over the upper side to the leading edge and back along the
//! lower. Lednicer's: a title, the numbers of points of both sides, then each from the leading edge to the trailing edge.

use std::path::Path;

use glam::{DVec2, DVec3};

use super::{fail, number};
use crate::profile::ProfileError;

/// The coordinate axis along the span: profiles lie in planes across it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SpanAxis {
    /// Chord along x, thickness along z.
    #[default]
    Y,
    /// Chord along x, thickness along y.
    Z,
}

/// Where an airfoil of chord 1 goes in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Length of the chord, in the unit of the mesh.
    pub chord: f64,
    /// Nose-up rotation about the leading edge, in degrees.
    pub twist: f64,
    /// Where the airfoil's origin, its leading edge, goes.
    pub position: DVec3,
    /// The axis along the span.
    pub span: SpanAxis,
}

impl Placement {
    /// The place of a point of the airfoil: x along the chord, y upward.
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

/// A first pair beyond this is no point of an airfoil, but Lednicer's numbers of points.
const COUNTS: f64 = 1.5;

/// Reads the points of one airfoil, from one side of the trailing edge to the other.
pub(super) fn parse(path: &Path, text: &str) -> Result<Vec<DVec2>, ProfileError> {
    let mut rows: Vec<(usize, DVec2)> = Vec::new();
    let mut last_line = 0;
    for (line, row) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        last_line = line;
        let words: Vec<&str> =
            row.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty()).collect();
        let numbers = words.iter().all(|word| word.parse::<f64>().is_ok());
        match words[..] {
            [] => {}
            // The title, which may be missing, is anything that is not two numbers.
            _ if line == 0 && !(numbers && words.len() == 2) => {}
            [x, y] => rows.push((line, DVec2::new(number(path, line, x)?, number(path, line, y)?))),
            _ => return Err(fail(path, line, format!("{} words", words.len()), "two numbers: x y")),
        }
    }
    let points = |rows: &[(usize, DVec2)]| rows.iter().map(|&(_, point)| point).collect::<Vec<_>>();
    let Some(&(line, counts)) = rows.first() else {
        return Err(fail(path, last_line, "no point".into(), "rows of two numbers: x y"));
    };
    if counts.x <= COUNTS && counts.y <= COUNTS {
        return Ok(points(&rows));
    }
    let [upper, lower] = counts.to_array().map(|count| count as usize);
    if counts != DVec2::new(upper as f64, lower as f64) || rows.len() - 1 != upper.saturating_add(lower) {
        let what = format!("{} points after the numbers {} and {}", rows.len() - 1, counts.x, counts.y);
        return Err(fail(path, line, what, "that many points of the upper and of the lower side"));
    }
    let (upper, lower) = rows[1..].split_at(upper);
    let mut curve = points(upper);
    curve.reverse();
    curve.extend(points(lower));
    // Both sides begin at the leading edge.
    curve.dedup();
    Ok(curve)
}
