//! Closest points on surfaces: on the original surface of a family, continued across the holes
//! under the wings, and on moved surfaces.
//!
//! All computations are in f64 on the CPU. The paper (section 3.4) projects every moved carenage
//! vertex back on the original surface. The paper does not treat the hole under the wing;
//! [`continuation`] closes it.

pub mod continuation;
pub mod crossing;
pub mod curved;
mod slide;
mod slope;
mod tree;
pub mod walk;

pub use slope::Slope;
pub use tree::TriangleTree;

use glam::DVec3;

use crate::geometry::{corners, diagonal, vertex_normals};

/// The point of a surface nearest to a query point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// The nearest point, in the unit of the query.
    pub point: DVec3,
    /// Index of the triangle with this point.
    pub triangle: u32,
    /// Barycentric coordinates of the point in the triangle.
    pub barycentric: [f64; 3],
    /// Squared distance from the query point.
    pub distance_squared: f64,
}

/// A triangulated surface for closest points and intersections with lines.
#[derive(Clone, Debug)]
pub struct TargetSurface {
    tree: TriangleTree,
    /// Unit normals `[n_points]`, weighted by area.
    normals: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Diagonal of the surface's bounding box, in the unit of the points.
    size: f64,
}

impl TargetSurface {
    /// Builds the search tree of a surface.
    ///
    /// - `points` `[n_points]`: in any unit
    /// - `triangles` `[n_triangles]`
    pub fn new(points: &[DVec3], triangles: Vec<[u32; 3]>) -> Self {
        let normals = vertex_normals(points, &triangles);
        let size = diagonal(triangles.iter().flatten().map(|&point| points[point as usize]));
        Self { tree: TriangleTree::new(points, &triangles), normals, triangles, size }
    }

    /// Number of the points for which the surface takes memory.
    #[cfg(test)]
    pub(crate) fn n_points(&self) -> usize {
        self.normals.len()
    }

    /// The point of the surface nearest to `at`.
    ///
    /// # Panics
    /// The surface has no triangle.
    pub fn closest(&self, at: DVec3) -> Closest {
        self.tree.closest(at)
    }

    /// Unit normal of the surface at one of its points, continuous across edges.
    pub fn normal(&self, on: &Closest) -> DVec3 {
        let corners = corners(&self.normals, self.triangles[on.triangle as usize]);
        (corners[0] * on.barycentric[0] + corners[1] * on.barycentric[1] + corners[2] * on.barycentric[2])
            .normalize_or_zero()
    }

    /// The point near `from` where the line through `from` along the unit vector `direction` meets
    /// the surface.
    ///
    /// The search is Newton's method on the distance to the tangent plane. If it fails, as where
    /// the line is nearly parallel to the surface, the result is the nearest crossing of the line
    /// with a facet. If the line misses the surface, the result is the closest point.
    pub fn along(&self, from: DVec3, direction: DVec3) -> DVec3 {
        // Below this cosine the intersection moves faster than the distance between vertex and
        // surface changes.
        const LEAST_COSINE: f64 = 0.2;
        // A point is on the surface if its distance is this fraction of its coordinates, or a tenth
        // of this fraction of the surface's size. Rounding is about as large.
        const ON_SURFACE: f64 = 1e-15;
        let start = self.closest(from);
        let reach = 4.0 * start.distance_squared.sqrt() / LEAST_COSINE;
        let crossing = || match self.tree.crossing(from, direction, reach) {
            Some(travel) => self.closest(from + travel * direction).point,
            None => start.point,
        };
        let mut travel = 0.0;
        for _ in 0..30 {
            let at = from + travel * direction;
            let on = self.closest(at);
            if on.distance_squared <= ON_SURFACE * ON_SURFACE * (0.01 * self.size * self.size + at.length_squared()) {
                return on.point;
            }
            // The normal of the facet, not the smooth normal: the line meets facets.
            let normal = self.tree.facet_normal(on.triangle);
            let offset = at - on.point;
            let (height, slope) = if offset.dot(normal).powi(2) > 0.25 * on.distance_squared {
                (offset.dot(normal), direction.dot(normal))
            } else {
                (offset.length(), direction.dot(offset) / offset.length())
            };
            if slope.abs() < LEAST_COSINE {
                return crossing();
            }
            travel -= height / slope;
            if travel.is_nan() || travel.abs() > reach {
                return crossing();
            }
        }
        let on = self.closest(from + travel * direction);
        if on.distance_squared.sqrt() < 0.1 * start.distance_squared.sqrt() { on.point } else { crossing() }
    }
}

#[cfg(test)]
mod tests;
