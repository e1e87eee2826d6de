//! The derivatives of the closest point of a [`TargetSurface`] and of its normal.
//!
//! The closest point on a facet has the derivative `1 - n n^T`, with `n` the facet's normal. On an
//! edge that the point is pressed to from beyond both facets it is `t t^T`, with `t` along the
//! edge, and on a corner it is 0.
//!
//! # Kinks
//!
//! A point that lies on the surface itself, on an edge or a corner of facets, moves on along
//! another facet in each direction. There the derivative is that of the plane of the smooth normal.
//! Each one-sided derivative differs from it by the angle between the facet and this plane.

use std::collections::HashSet;

use glam::{DMat3, DVec3};

use super::TargetSurface;
use crate::geometry::{corners, rotation_vectors::outer, triangle_normal, unit_normal};

/// A point is beside an edge of its facet if a barycentric coordinate is smaller.
const BESIDE: f64 = 1e-9;

/// A point lies on the surface if its distance is this fraction of its coordinates or of the
/// surface's size.
const ON_SURFACE: f64 = 1e-12;

/// A point is above a facet if the sine of the angle between its offset and the facet's normal is
/// smaller.
const ABOVE: f64 = 1e-9;

/// The surface around one of its points.
#[derive(Clone, Copy, Debug)]
pub struct Slope {
    /// Smooth unit normal.
    pub normal: DVec3,
    /// Unit normal of the plane in which the point moves: that of its facet, or on a kink the
    /// smooth normal.
    pub facet: DVec3,
    /// Change of the smooth normal per displacement in the facet, in 1 / the unit of the points.
    pub normal_change: DMat3,
    /// Whether the point is beside an edge of its facet.
    pub beside: bool,
}

impl TargetSurface {
    /// The closest point and its derivative by `at`. The derivative is symmetric.
    ///
    /// # Panics
    /// The surface has no triangle.
    pub fn closest_change(&self, at: DVec3) -> (DVec3, DMat3) {
        let on = self.closest(at);
        let of_corners = self.tree.corners_of(on.triangle);
        let facet = unit_normal(of_corners);
        let in_plane = |normal: DVec3| DMat3::IDENTITY - outer(normal, normal);
        let near: Vec<usize> = (0..3).filter(|&corner| on.barycentric[corner] < BESIDE).collect();
        let offset = at - on.point;
        let distance = offset.length();
        let change = if near.is_empty() {
            in_plane(facet)
        } else if distance <= ON_SURFACE * at.length().max(self.size) {
            in_plane(self.normal(&on))
        } else if offset.cross(facet).length() <= ABOVE * distance {
            in_plane(facet)
        } else if let [corner] = near[..] {
            let along = (of_corners[(corner + 2) % 3] - of_corners[(corner + 1) % 3]).normalize_or_zero();
            outer(along, along)
        } else {
            DMat3::ZERO
        };
        (on.point, change)
    }

    /// The surface around a point that lies on it.
    ///
    /// # Panics
    /// The surface has no triangle.
    pub fn slope(&self, at: DVec3) -> Slope {
        let on = self.closest(at);
        let of_corners = self.tree.corners_of(on.triangle);
        let normals = corners(&self.normals, self.triangles[on.triangle as usize]);
        let normal = self.normal(&on);
        let sum = (0..3).fold(DVec3::ZERO, |sum, corner| sum + normals[corner] * on.barycentric[corner]);
        let area = triangle_normal(of_corners);
        // The gradient of a barycentric coordinate is across the opposite edge.
        let of_sum = (0..3).fold(DMat3::ZERO, |of_sum, corner| {
            let opposite = of_corners[(corner + 2) % 3] - of_corners[(corner + 1) % 3];
            of_sum + outer(normals[corner], area.cross(opposite) / area.length_squared())
        });
        let normal_change = (DMat3::IDENTITY - outer(normal, normal)) * of_sum * (1.0 / sum.length());
        let near = on.barycentric.iter().filter(|&&share| share < BESIDE).count();
        let facet = if near == 2 { normal } else { area.normalize_or_zero() };
        Slope { normal, facet, normal_change, beside: near > 0 }
    }

    /// The edges at which the surface ends: those of one triangle, the smaller index first.
    pub fn open_edges(&self) -> HashSet<[u32; 2]> {
        let mut edges = HashSet::new();
        for &[a, b, c] in &self.triangles {
            for [a, b] in [[a, b], [b, c], [c, a]] {
                let edge = [a.min(b), a.max(b)];
                if !edges.remove(&edge) {
                    edges.insert(edge);
                }
            }
        }
        edges
    }

    /// Whether the surface ends at a point that lies on it.
    ///
    /// - `open`: of [`Self::open_edges`]
    ///
    /// # Panics
    /// The surface has no triangle.
    pub fn ends(&self, at: DVec3, open: &HashSet<[u32; 2]>) -> bool {
        let on = self.closest(at);
        let own = self.triangles[on.triangle as usize];
        let near: Vec<usize> = (0..3).filter(|&corner| on.barycentric[corner] < BESIDE).collect();
        match near[..] {
            [] => false,
            [corner] => {
                let [a, b] = [own[(corner + 1) % 3], own[(corner + 2) % 3]];
                open.contains(&[a.min(b), a.max(b)])
            }
            _ => (0..3).any(|corner| !near.contains(&corner) && open.iter().any(|edge| edge.contains(&own[corner]))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A roof with its ridge along y, and a little curved at its ends.
    fn roof() -> TargetSurface {
        let at = |x: f64, y: f64| DVec3::new(x, y, 2.0 - 0.5 * x.abs() - 0.1 * y * y);
        let points: Vec<DVec3> =
            (-1..=1).flat_map(|x| (-1..=1).map(move |y| (x, y))).map(|(x, y)| at(f64::from(x), f64::from(y))).collect();
        let cells = [0, 1, 3, 4].into_iter();
        TargetSurface::new(&points, cells.flat_map(|a| [[a, a + 3, a + 4], [a, a + 4, a + 1]]).collect())
    }

    /// Above a facet, outside the ridge, and outside the corner of the top.
    ///
    /// Fails if a point outside the ridge has the derivative of a facet.
    #[test]
    fn closest_points_change_with_their_points() {
        let roof = roof();
        let tops = [
            (DVec3::new(0.4, 0.3, 2.4), 2),
            (DVec3::new(-0.4, -0.7, 1.1), 2),
            (DVec3::new(0.01, 0.3, 3.0), 1),
            (DVec3::new(0.01, 0.01, 3.0), 0),
            (DVec3::new(2.0, 0.3, 1.0), 1),
        ];
        for (at, rank) in tops {
            let (point, change) = roof.closest_change(at);
            assert_eq!(point, roof.closest(at).point);
            let trace = change.x_axis.x + change.y_axis.y + change.z_axis.z;
            assert!((trace - f64::from(rank)).abs() < 1e-12, "{at}: {trace}");
            let h = 1e-6;
            for axis in DVec3::AXES {
                let difference = (roof.closest(at + axis * h).point - roof.closest(at - axis * h).point) / (2.0 * h);
                assert!(difference.distance(change * axis) < 1e-8, "{at}: {difference} instead of {}", change * axis);
            }
        }
        // On the ridge itself: along the ridge as before, across it on the level.
        let (_, change) = roof.closest_change(DVec3::new(0.0, 0.0, 2.0));
        for (axis, expected) in [(DVec3::X, DVec3::X), (DVec3::Y, DVec3::Y), (DVec3::Z, DVec3::ZERO)] {
            assert!((change * axis).distance(expected) < 1e-12, "{axis}: {}", change * axis);
        }
    }

    #[test]
    fn normals_change_along_their_facet() {
        let roof = roof();
        let at = roof.closest(DVec3::new(0.4, 0.3, 2.4)).point;
        let slope = roof.slope(at);
        assert!(!slope.beside);
        let normal = |at: DVec3| roof.normal(&roof.closest(at));
        assert!(slope.normal.distance(normal(at)) < 1e-15);
        let h = 1e-6;
        for along in [DVec3::X, DVec3::Y, DVec3::ONE] {
            let along = along - slope.facet * slope.facet.dot(along);
            let difference = (normal(at + along * h) - normal(at - along * h)) / (2.0 * h);
            assert!(difference.length() > 1e-3);
            assert!(difference.distance(slope.normal_change * along) < 1e-8, "{difference}");
        }
        // The outline and its corners end the surface, the ridge and the corner in the middle do
        // not.
        let open = roof.open_edges();
        assert_eq!(open.len(), 8);
        for (x, y, z, ends) in
            [(0.0, 0.5, 1.95, false), (1.0, 0.5, 1.45, true), (1.0, 1.0, 1.4, true), (0.0, 0.0, 2.0, false)]
        {
            let at = DVec3::new(x, y, z);
            assert!(roof.slope(at).beside);
            assert_eq!(roof.ends(at, &open), ends, "{at}");
        }
    }
}
