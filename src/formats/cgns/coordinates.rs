//! Reads the coordinates of a zone.

use std::path::Path;

use glam::DVec3;

use super::columns::{Column, Place, ZoneColumns};
use super::data::{Data, Store};
use super::headers::can_append;
use super::tree::Node;
use crate::formats::error::ReadError;
use crate::formats::mesh_builder::{MOST_VERTICES, check_finite_at};
use crate::formats::number::Number;
use crate::formats::scanner::Width;

/// The name of the mesh's coordinates in a zone (SIDS). Coordinates with other names are of other
/// times of a mesh that moves.
const OF_MESH: &str = "GridCoordinates";

/// The coordinates of a zone's mesh. A warning names every other node of coordinates.
///
/// # Errors
/// [`ReadError::Malformed`]: there are none, or several of which none has the mesh's name
pub(super) fn grid_of<'a>(zone: &Node<'a>, warnings: &mut Vec<String>) -> Result<Node<'a>, ReadError> {
    let mut grids = zone.children("GridCoordinates_t")?;
    let grid = match grids.iter().position(|grid| grid.name() == OF_MESH) {
        Some(place) => grids.remove(place),
        None if grids.len() > 1 => {
            let names: Vec<_> = grids.iter().map(|grid| format!("'{}'", grid.name())).collect();
            return Err(
                zone.malformed(format!("one of its grid coordinates with the name {OF_MESH}"), names.join(", "))
            );
        }
        None => grids.pop().ok_or_else(|| zone.malformed("grid coordinates in it", "none"))?,
    };
    for other in grids {
        warnings.push(format!("{}: coordinates of another time are passed over, and stay", other.path()));
    }
    Ok(grid)
}

/// The vertices, and the places of their coordinates in the file.
pub(super) fn read_coordinates(path: &Path, grid: &Node) -> Result<(Vec<DVec3>, ZoneColumns), ReadError> {
    let axis = |name| -> Result<_, ReadError> {
        let node = grid.child(name)?;
        let Data { bytes, number, endian, store } = node.data()?;
        let width = match number {
            Number::F32 => Width::Single,
            Number::F64 => Width::Double,
            _ => return Err(node.malformed("coordinates of 4 or 8 bytes", "other numbers")),
        };
        let values = number.doubles(&bytes, endian);
        let place = match store {
            Store::Pieces(pieces) => Place::Pieces(pieces),
            Store::Elsewhere => packed(&node, bytes.into_owned())?,
        };
        Ok((values, Column { width, endian, place }))
    };
    let [(x, of_x), (y, of_y), (z, of_z)] = [axis("CoordinateX")?, axis("CoordinateY")?, axis("CoordinateZ")?];
    let axes = [of_x, of_y, of_z];
    let lengths = [&x, &y, &z].map(Vec::len);
    let n_vertices = lengths[0];
    let kinds = axes.each_ref().map(|column| (column.width, column.endian));
    if lengths != [n_vertices; 3] || kinds != [kinds[0]; 3] {
        let found = format!("{lengths:?} of {kinds:?}");
        return Err(grid.malformed("three coordinates of one kind for every vertex", found));
    }
    if n_vertices >= MOST_VERTICES {
        let path = path.into();
        return Err(ReadError::TooMany { path, what: "vertices", count: n_vertices, limit: MOST_VERTICES });
    }
    let mut positions = Vec::with_capacity(n_vertices);
    for (vertex, ((&x, &y), &z)) in (1..).zip(x.iter().zip(&y).zip(&z)) {
        check_finite_at([x, y, z], vertex, || grid.place())?;
        positions.push([x, y, z].into());
    }
    Ok((positions, ZoneColumns { axes, vertex_of: None, unlike: Vec::new() }))
}

/// The place of coordinates that are packed or stand in an object header.
///
/// - `bytes`: the coordinates, unpacked
fn packed(node: &Node, bytes: Vec<u8>) -> Result<Place, ReadError> {
    let file = &node.source.shared.bytes[..];
    if let Some(header) = node.header() {
        match header.compact(file) {
            Some(range) if file[range.clone()] == bytes => return Ok(Place::Header { range, header }),
            None if header.has_room() && can_append(file) => return Ok(Place::Packed { header, bytes }),
            _ => {}
        }
    }
    let hint = "save it without compression (h5repack -f NONE -l CONTI old.cgns new.cgns)";
    Err(node.unsupported("coordinates that are packed so that other ones find no place", hint))
}
