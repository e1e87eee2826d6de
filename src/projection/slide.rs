//! The derivative of [`TargetSurface::along`].

use glam::{DMat3, DVec3};

use super::TargetSurface;
use crate::geometry::rotation_vectors::outer;

/// A point is on a line if it is nearer than this fraction of its coordinates and of the surface's
/// size.
const ON_LINE: f64 = 1e-9;

impl TargetSurface {
    /// The derivatives of the point `to` that [`Self::along`] finds, by `from` and by `direction`.
    /// `None` where the line only touches the surface, so that the point does not follow it
    /// smoothly.
    ///
    /// Where the line meets the surface the point is `from + s direction` in the plane of a facet
    /// with the normal n, and its derivatives are `1 - direction n^T / (n . direction)` and s times
    /// that. On an edge of facets n is the smooth normal. If the line misses the surface, the point
    /// is the closest one.
    ///
    /// # Panics
    /// The surface has no triangle.
    pub fn along_change(&self, from: DVec3, direction: DVec3, to: DVec3) -> Option<(DMat3, DMat3)> {
        let travel = (to - from).dot(direction);
        if (to - from - travel * direction).length() > ON_LINE * (self.size + to.length()) {
            let (closest, change) = self.closest_change(from);
            return (closest == to).then_some((change, DMat3::ZERO));
        }
        let normal = self.slope(to).facet;
        let slope = normal.dot(direction);
        let change = DMat3::IDENTITY - outer(direction, normal) * (1.0 / slope);
        change.is_finite().then_some((change, change * travel))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two slopes that meet in a ridge along y, with their lower ends at z = 0.
    fn roof() -> TargetSurface {
        let at = |x: f64, y: f64| DVec3::new(x, y, 1.0 - 0.5 * x.abs());
        let points: Vec<DVec3> = [-2.0, 0.0, 2.0].into_iter().flat_map(|x| [at(x, -2.0), at(x, 2.0)]).collect();
        TargetSurface::new(&points, vec![[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]])
    }

    /// Lines that meet a slope from above and from below, one that misses the surface beyond its
    /// lower end, and one that misses it above the ridge.
    ///
    /// Fails if the direction's change is left out, or a line that misses follows the facet.
    #[test]
    fn a_slide_follows_its_start_and_its_direction() {
        let roof = roof();
        for (from, direction) in [
            (DVec3::new(0.7, 0.3, 1.1), DVec3::new(0.2, 0.1, -1.0)),
            (DVec3::new(-1.2, 0.3, 0.1), DVec3::new(0.2, -0.4, 1.0)),
            (DVec3::new(2.3, 0.3, 0.2), DVec3::new(0.1, 0.0, 1.0)),
            (DVec3::new(0.1, 0.4, 1.3), DVec3::new(1.0, 0.2, 0.0)),
        ] {
            let direction = direction.normalize();
            let along = |from: DVec3, direction: DVec3| roof.along(from, direction);
            let (by_start, by_direction) = roof.along_change(from, direction, along(from, direction)).unwrap();
            let h = 1e-6;
            for axis in DVec3::AXES {
                let ends = [h, -h].map(|h| along(from + axis * h, direction));
                let difference = (ends[0] - ends[1]) / (2.0 * h);
                assert!(difference.distance(by_start * axis) < 1e-8, "{from}: {difference} {}", by_start * axis);
                // A direction stays a unit vector.
                let turn = axis.reject_from_normalized(direction);
                let ends = [h, -h].map(|h| along(from, (direction + turn * h).normalize()));
                let difference = (ends[0] - ends[1]) / (2.0 * h);
                assert!(
                    difference.distance(by_direction * turn) < 1e-8,
                    "{from}: {difference} {}",
                    by_direction * turn
                );
            }
        }
    }
}
