//! Boxes along the axes, each given by its lowest and its highest corner.

use glam::DVec3;

/// The empty box. No point lies in it, and no box overlaps it.
pub const NOWHERE: [DVec3; 2] = [DVec3::INFINITY, DVec3::NEG_INFINITY];

/// The smallest box around some points, in their unit. `None` if there are no points.
#[inline]
pub fn bounds(points: impl IntoIterator<Item = DVec3>) -> Option<[DVec3; 2]> {
    let mut points = points.into_iter();
    let first = points.next()?;
    Some(points.fold([first, first], |[low, high], at| [low.min(at), high.max(at)]))
}

/// The length of the diagonal of the box around some points, in their unit. 0 if there are no
/// points.
pub fn diagonal(points: impl IntoIterator<Item = DVec3>) -> f64 {
    bounds(points).map_or(0.0, |[low, high]| low.distance(high))
}

/// Whether two boxes have no point in common.
#[inline]
pub fn apart(a: [DVec3; 2], b: [DVec3; 2]) -> bool {
    let along = |axis: usize| a[0][axis] > b[1][axis] || a[1][axis] < b[0][axis];
    along(0) || along(1) || along(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_holds_its_points_and_no_more() {
        let points = [DVec3::new(1.0, -2.0, 5.0), DVec3::new(-3.0, 2.0, 5.0), DVec3::new(0.0, 0.0, 17.0)];
        assert_eq!(bounds(points), Some([DVec3::new(-3.0, -2.0, 5.0), DVec3::new(1.0, 2.0, 17.0)]));
        // sqrt(4^2 + 4^2 + 12^2)
        assert!((diagonal(points) - 176f64.sqrt()).abs() < 1e-14);
        assert_eq!(bounds([]), None);
        assert_eq!(diagonal([]), 0.0);
    }

    #[test]
    fn boxes_that_touch_are_not_apart() {
        let unit = [DVec3::ZERO, DVec3::ONE];
        for axis in DVec3::AXES {
            assert!(!apart(unit, unit.map(|corner| corner + axis)));
            assert!(apart(unit, unit.map(|corner| corner + 1.001 * axis)));
            assert!(apart(unit, unit.map(|corner| corner - 1.001 * axis)));
        }
        assert!(apart(unit, NOWHERE) && apart(NOWHERE, unit));
    }
}
