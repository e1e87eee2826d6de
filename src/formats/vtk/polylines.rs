//! Polylines of VTK poly data, `.vtp` and legacy `.vtk`: sections of a surface as ParaView and others cut them.

use std::path::Path;

use glam::DVec3;

use super::{legacy, vtu};
use crate::formats::error::ReadError;

/// Points and the lines between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Polylines {
    /// Coordinates `[n_points]`.
    pub points: Vec<DVec3>,
    /// Points of each line, in order.
    pub lines: Vec<Vec<u32>>,
}

/// Reads the polylines of a VTK file from its bytes; `path` selects the format (`.vtk` is legacy, all else XML) and is named
/// in messages.
///
/// # Errors
///
/// [`ReadError`]: the contents are broken or no poly data.
pub fn read_polylines(path: &Path, bytes: &[u8]) -> Result<Polylines, ReadError> {
    let legacy = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("vtk"));
    let (points, offsets, connectivity) =
        if legacy { legacy::read_lines(path, bytes)? } else { vtu::read_lines(path, bytes)? };
    let malformed = |expected: String, found: i64| ReadError::Malformed {
        place: crate::formats::Place::Byte(path.into(), 0),
        expected,
        found: found.to_string(),
    };
    let mut lines = Vec::with_capacity(offsets.len());
    let mut start = 0;
    for end in offsets {
        let corners = usize::try_from(end).ok().and_then(|end| connectivity.get(start..end));
        let corners = corners.ok_or_else(|| malformed("the end of a line among its points".into(), end))?;
        start += corners.len();
        let known = |&point: &i64| u32::try_from(point).ok().filter(|&point| (point as usize) < points.len());
        let point = |point| known(point).ok_or_else(|| malformed(format!("a point below {}", points.len()), *point));
        lines.push(corners.iter().map(point).collect::<Result<_, _>>()?);
    }
    Ok(Polylines { points, lines })
}
