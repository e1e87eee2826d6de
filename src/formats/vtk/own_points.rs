//! Files in which every cell has points of its own, as after ParaView's filters that tear cells
//! apart.
//!
//! Such cells touch only where their points are equal, so points that are equal to the last bit are
//! one vertex. In a file with a point of two cells no points are merged: there equal points can be
//! the two sides of a slit. In a file without such a point the sides of a slit cannot be told from
//! neighbours. They become one, and the faces of the slit are then faces inside the volume, which
//! the check of the mesh refuses.

use std::collections::HashMap;

use glam::DVec3;

use super::points::{Copies, bits};
use crate::formats::document::Coordinates;
use crate::formats::mesh_builder::MeshBuilder;

/// A mesh as its cells share points, or as it is in the file.
pub(super) struct Shared {
    /// Position of each vertex `[n_vertices]`.
    pub positions: Vec<DVec3>,
    pub coordinates: Box<dyn Coordinates>,
    /// A warning, if points were merged.
    pub warning: Option<String>,
}

/// Merges equal points, if every cell has points of its own.
///
/// - `positions` `[n_points]`: the points that the cells of `mesh_builder` name
/// - `coordinates`: the writer of these points
pub(super) fn share(
    positions: Vec<DVec3>,
    coordinates: Box<dyn Coordinates>,
    mesh_builder: &mut MeshBuilder,
) -> Shared {
    if !has_own_points(mesh_builder, positions.len()) {
        return Shared { positions, coordinates, warning: None };
    }
    let mut known = HashMap::with_capacity(positions.len() / 4);
    let mut vertices: Vec<DVec3> = Vec::new();
    let vertex_of: Vec<u32> = positions
        .iter()
        .map(|point| {
            *known.entry(bits(point)).or_insert_with(|| {
                vertices.push(*point);
                (vertices.len() - 1) as u32
            })
        })
        .collect();
    if vertices.len() == positions.len() {
        return Shared { positions, coordinates, warning: None };
    }
    mesh_builder.vertices_mut().for_each(|vertex| *vertex = vertex_of[*vertex as usize]);
    let warning = format!(
        "no point belongs to two cells: the {} points are read as {} vertices, points that are equal to the last bit as one",
        positions.len(),
        vertices.len()
    );
    let coordinates = Box::new(Copies::new(&positions, &vertices, vertex_of, coordinates));
    Shared { positions: vertices, coordinates, warning: Some(warning) }
}

/// Whether there are several cells and faces, and each vertex occurs in one of them at most.
fn has_own_points(mesh_builder: &mut MeshBuilder, n_points: usize) -> bool {
    let mut is_used = vec![false; n_points];
    // In other files this stops at one of the first cells.
    mesh_builder.vertices_mut().all(|vertex| !std::mem::replace(&mut is_used[*vertex as usize], true))
}
