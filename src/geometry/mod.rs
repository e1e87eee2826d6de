//! Geometry without meshes: points, triangles, segments, boxes and fitted motions.
//!
//! Every formula has one place here, so the same question gets the same bits everywhere.

mod boxes;
pub mod fitted_motion;
pub mod motion_change;
pub mod rotation_vectors;
mod segments;
mod triangles;

pub use boxes::{NOWHERE, apart, bounds, diagonal};
pub use segments::nearest_on_segment;
pub use triangles::{closest_on_triangle, triangle_normal, unit_normal, vertex_normals};

use glam::DVec3;

/// The positions of some vertices, for example the corners of a tet or a triangle.
///
/// - `at` `[n_vertices]`: positions of all vertices, in any unit
/// - `vertices`: indices into `at`
#[inline]
pub fn corners<const N: usize>(at: &[DVec3], vertices: [u32; N]) -> [DVec3; N] {
    // In hot loops the compiler does not inline `vertices.map(..)`.
    let mut corners = [DVec3::ZERO; N];
    for (corner, vertex) in corners.iter_mut().zip(vertices) {
        *corner = at[vertex as usize];
    }
    corners
}
