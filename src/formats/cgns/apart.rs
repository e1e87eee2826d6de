//! The coordinates of a CGNS file stand apart from everything else in it.
//!
//! A broken file may give an array the place of another one. If it were written with other
//! coordinates, it would be another mesh.

use std::ops::Range;
use std::path::Path;

use super::data::Shared;
use super::{Contents, read_contents};
use crate::formats::document::Coordinates;
use crate::formats::error::{Location, ReadError};
use crate::formats::out::in_blocks;

/// Checks that no byte of the coordinates is also a byte of something else that was read.
///
/// # Errors
/// [`ReadError::Malformed`]
pub(super) fn check(path: &Path, shared: &Shared, read: &Contents) -> Result<(), ReadError> {
    let mut ranges: Vec<&Range<usize>> = read.columns.all().flat_map(|column| column.ranges()).collect();
    ranges.sort_by_key(|range| range.start);
    if ranges.windows(2).any(|pair| pair[1].start < pair[0].end) {
        return Err(malformed(path, "coordinates with places of their own", "two that share bytes of the file"));
    }
    // HDF5 may read a little more than it needs, so only other coordinates can show what is used.
    // They also show that a header can say where unpacked coordinates are.
    let is_one_piece = read.columns.all().all(|column| column.ranges().len() == 1 && !column.is_in_header());
    let is_used = || ranges.iter().any(|range| shared.is_used_otherwise(range));
    if (!is_one_piece || is_used()) && !is_same_with_others(path, shared, read) {
        return Err(malformed(path, "coordinates with places of their own", "some that share bytes with other data"));
    }
    Ok(())
}

fn malformed(path: &Path, expected: &str, found: &str) -> ReadError {
    ReadError::Malformed { place: Location::File(path.into()), expected: expected.into(), found: found.into() }
}

/// Whether the file with other coordinates has these coordinates and the same cells and families.
fn is_same_with_others(path: &Path, shared: &Shared, read: &Contents) -> bool {
    let other = |value: f64| if value.abs() < 1e30 { -1.5 * value - 1.0 } else { 0.0 };
    let vertices: Vec<_> = read.positions.iter().map(|position| position.map(other)).collect();
    let mut bytes = Vec::with_capacity(shared.bytes.len());
    let written = in_blocks(&mut bytes, |out| read.columns.write(&shared.bytes, out, &vertices));
    let again = written.ok().and_then(|()| read_contents(path, &Shared::new(bytes)).ok());
    let close = |(a, b): (&glam::DVec3, &glam::DVec3)| (*a - *b).abs().max_element() <= 1e-6 * b.abs().max_element();
    again.is_some_and(|again| {
        again.mesh_builder == read.mesh_builder
            && again.names == read.names
            && again.positions.len() == vertices.len()
            && again.positions.iter().zip(&vertices).all(close)
    })
}
