//! The coordinates of a CGNS file stand apart from everything else in it.
//!
//! A broken file may give an array the place of another one. If it were written with other
//! coordinates, it would be another mesh.

use std::ops::Range;
use std::path::Path;

use super::tree::Shared;
use super::{Zone, read_zone};
use crate::formats::document::Coordinates;
use crate::formats::error::{Location, ReadError};
use crate::formats::out::in_blocks;

/// Checks that no byte of the coordinates is also a byte of something else that was read.
///
/// # Errors
/// [`ReadError::Malformed`]
pub(super) fn check(path: &Path, shared: &Shared, zone: &Zone) -> Result<(), ReadError> {
    let length = zone.positions.len() * zone.columns.kind.0.bytes();
    let columns = zone.columns.starts.map(|start| start..start + length);
    let overlap = |a: &Range<usize>, b: &Range<usize>| a.start < b.end && b.start < a.end;
    let [x, y, z] = &columns;
    if overlap(x, y) || overlap(y, z) || overlap(x, z) {
        return Err(malformed(path, "coordinates with places of their own", "two that share bytes of the file"));
    }
    // HDF5 may read a little more than it needs, so only other coordinates can show what is used.
    if columns.iter().any(|column| shared.is_used_otherwise(column)) && !is_same_with_others(path, shared, zone) {
        return Err(malformed(path, "coordinates with places of their own", "some that share bytes with other data"));
    }
    Ok(())
}

fn malformed(path: &Path, expected: &str, found: &str) -> ReadError {
    ReadError::Malformed { place: Location::File(path.into()), expected: expected.into(), found: found.into() }
}

/// Whether the file with other coordinates has the same cells and families.
fn is_same_with_others(path: &Path, shared: &Shared, zone: &Zone) -> bool {
    let other = |value: f64| if value.abs() < 1e30 { -1.5 * value - 1.0 } else { 0.0 };
    let vertices: Vec<_> = zone.positions.iter().map(|position| position.map(other)).collect();
    let mut bytes = Vec::with_capacity(shared.bytes.len());
    let written = in_blocks(&mut bytes, |out| zone.columns.write(&shared.bytes, out, &vertices));
    let again = written.ok().and_then(|()| read_zone(path, &Shared::new(bytes)).ok());
    again.is_some_and(|again| again.mesh_builder == zone.mesh_builder && again.names == zone.names)
}
