//! The derivative of [`TargetSurface::along`].

use glam::{DMat3, DVec3};

use super::{Closest, TargetSurface};
use crate::geometry::rotation_vectors::outer;

/// A barycentric coordinate below this is that of an edge.
const AT_EDGE: f64 = 1e-9;

/// A point is on a line, or on the surface, if it is nearer than this fraction of its coordinates
/// and of the surface's size.
const ON: f64 = 1e-9;

impl TargetSurface {
    /// The derivatives of the point `to` that [`Self::along`] finds, by `from` and by `direction`.
    /// `None` where the line only touches the surface, so that the point does not follow it
    /// smoothly.
    ///
    /// Where the line meets the surface the point is `from + s direction` on a facet with the
    /// normal n, and its derivatives are `1 - direction n^T / (n . direction)` and s times that. If
    /// the line misses the surface it is the closest point.
    pub fn along_change(&self, from: DVec3, direction: DVec3, to: DVec3) -> Option<(DMat3, DMat3)> {
        let travel = (to - from).dot(direction);
        let near = ON * (self.size + to.length());
        if (to - from - travel * direction).length() > near {
            let closest = self.closest(from);
            return (closest.point == to).then(|| (self.projector(from, &closest), DMat3::ZERO));
        }
        let normal = self.normal_around(&self.closest(to));
        let slope = normal.dot(direction);
        let change = DMat3::IDENTITY - outer(direction, normal) * (1.0 / slope);
        change.is_finite().then_some((change, change * travel))
    }

    /// The derivative of the closest point by `at`: within the facet, along the edge, or none at a
    /// corner.
    pub fn projector(&self, at: DVec3, on: &Closest) -> DMat3 {
        let in_plane = |normal: DVec3| DMat3::IDENTITY - outer(normal, normal);
        let offset = at - on.point;
        if offset.length() <= ON * (self.size + at.length()) {
            return in_plane(self.normal_around(on));
        }
        let normal = self.tree.facet_normal(on.triangle);
        // An edge is at right angles to both.
        let along = normal.cross(offset / offset.length());
        match on.barycentric.iter().filter(|share| **share < AT_EDGE).count() {
            0 => in_plane(normal),
            _ if along.length() < AT_EDGE => in_plane(normal),
            1 => outer(along, along) * (1.0 / along.length_squared()),
            _ => DMat3::ZERO,
        }
    }

    /// The normal of the facet, and on an edge or a corner, where facets meet, the smooth normal.
    fn normal_around(&self, on: &Closest) -> DVec3 {
        let at_edge = on.barycentric.iter().any(|share| *share < AT_EDGE);
        if at_edge { self.normal(on) } else { self.tree.facet_normal(on.triangle) }
    }
}
