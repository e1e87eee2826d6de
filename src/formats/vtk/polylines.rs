//! Polylines of VTK poly data, `.vtp` and legacy `.vtk`: sections of a surface cut by ParaView and
//! other programs.

use std::path::Path;

use glam::DVec3;

use super::{legacy, vtu};
use crate::formats::error::{Location, ReadError};

/// Points and polylines between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Polylines {
    /// Coordinates `[n_points]`, in the unit of the file.
    pub points: Vec<DVec3>,
    /// Points of each line, in order.
    pub lines: Vec<Vec<u32>>,
}

/// Reads the polylines of a VTK file from its bytes.
///
/// - `path`: selects the format (`.vtk` is legacy, any other extension is XML), and is named in
///   messages
///
/// # Errors
///
/// [`ReadError`]: the contents are broken or no poly data.
pub fn read_polylines(path: &Path, bytes: &[u8]) -> Result<Polylines, ReadError> {
    let legacy = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("vtk"));
    let (points, mut corners) = if legacy { legacy::read_lines(path, bytes)? } else { vtu::read_lines(path, bytes)? };
    let malformed = |expected: String, found: i64| ReadError::Malformed {
        place: Location::File(path.into()),
        expected,
        found: found.to_string(),
    };
    let mut lines = Vec::with_capacity(corners.n_cells());
    let mut start = 0;
    for line in 0..corners.n_cells() {
        let of_line = corners.of(line, start);
        let of_line = of_line.map_err(|end| malformed("the end of a line among its points".into(), end))?;
        start = of_line.end;
        let known = |&point: &i64| u32::try_from(point).ok().filter(|&point| (point as usize) < points.len());
        let point = |point| known(&point).ok_or_else(|| malformed(format!("a point below {}", points.len()), point));
        lines.push(of_line.map(|place| point(corners.vertex(place).unwrap_or(-1))).collect::<Result<_, _>>()?);
    }
    Ok(Polylines { points, lines })
}
