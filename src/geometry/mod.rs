//! Geometry that knows nothing of meshes: points, triangles, segments, boxes.
//!
//! Every formula stands here once, so the same question gets the same bits wherever it is asked.

mod boxes;
pub mod fitted_motion;
mod segments;
mod triangles;

pub use boxes::{NOWHERE, apart, bounds, diagonal};
pub use segments::nearest_on_segment;
pub use triangles::{closest_on_triangle, triangle_normal, unit_normal, vertex_normals};

use glam::DVec3;

/// The places of some vertices, such as the corners of a tet or a triangle.
///
/// - `at` `[n_vertices]`
#[inline]
pub fn corners<const N: usize>(at: &[DVec3], vertices: [u32; N]) -> [DVec3; N] {
    // In hot loops `vertices.map(..)` stays a call.
    let mut corners = [DVec3::ZERO; N];
    for (corner, vertex) in corners.iter_mut().zip(vertices) {
        *corner = at[vertex as usize];
    }
    corners
}
