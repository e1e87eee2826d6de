//! Reads the coordinates of a zone.

use std::path::Path;

use glam::DVec3;

use super::columns::Columns;
use super::tree::Node;
use crate::formats::error::ReadError;
use crate::formats::mesh_builder::{MOST_VERTICES, check_finite_at};

/// The vertices, and the places of their coordinates in the file.
pub(super) fn read_coordinates(path: &Path, grid: &Node) -> Result<(Vec<DVec3>, Columns), ReadError> {
    let mut values = Vec::new();
    let mut starts = [0; 3];
    let mut kinds = Vec::new();
    let axes = ["CoordinateX", "CoordinateY", "CoordinateZ"];
    for (axis, start) in axes.into_iter().zip(&mut starts) {
        let node = grid.child(axis)?;
        let data = node.data()?;
        let Some((address, stored)) = node.stored(&data)? else {
            let hint = "save it without compression (h5repack -l CONTI old.cgns new.cgns)";
            return Err(node.unsupported("coordinates in pieces or compressed", hint));
        };
        *start = address;
        let column = data.read_f64().map_err(|error| node.malformed("coordinates", error))?;
        let kind = Columns::KINDS.into_iter().find(|&kind| Columns::holds(kind, stored, &column));
        kinds.push(kind.ok_or_else(|| node.malformed("coordinates of 4 or 8 bytes", "other numbers"))?);
        values.push(column);
    }
    let lengths: Vec<usize> = values.iter().map(Vec::len).collect();
    let n_vertices = lengths[0];
    if lengths.iter().any(|&length| length != n_vertices) || kinds.iter().any(|kind| *kind != kinds[0]) {
        let found = format!("{lengths:?} of {kinds:?}");
        return Err(grid.malformed("three coordinates of one kind for every vertex", found));
    }
    if n_vertices >= MOST_VERTICES {
        let path = path.into();
        return Err(ReadError::TooMany { path, what: "vertices", count: n_vertices, limit: MOST_VERTICES });
    }
    let mut positions = Vec::with_capacity(n_vertices);
    for (vertex, ((&x, &y), &z)) in (1..).zip(values[0].iter().zip(&values[1]).zip(&values[2])) {
        check_finite_at([x, y, z], vertex, || grid.place())?;
        positions.push([x, y, z].into());
    }
    Ok((positions, Columns { starts, kind: kinds[0] }))
}
