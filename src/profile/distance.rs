//! Distances of points from a profile.

use glam::DVec3;

use crate::geometry::nearest_on_segment;

/// Largest distance of `points` from the polyline through `curve`, in the mesh's unit. NaN if
/// `curve` is empty and `points` is not.
///
/// In the report `points` is the section of the moved wing, and `curve` is the new profile. No
/// point is left out.
pub fn max_distance(points: &[DVec3], curve: &[DVec3]) -> f64 {
    points.iter().map(|&p| distance(p, curve)).fold(0.0, |worst, d| if d > worst || d.is_nan() { d } else { worst })
}

/// Distance of a point from the polyline through `curve`, in the mesh's unit. NaN if `curve` is
/// empty, infinite if the point is NaN.
pub fn distance(point: DVec3, curve: &[DVec3]) -> f64 {
    match curve {
        [] => f64::NAN,
        [only] => point.distance(*only),
        _ => {
            let squared = |pair: &[DVec3]| point.distance_squared(nearest_on_segment(point, pair[0], pair[1]).0);
            curve.windows(2).map(squared).fold(f64::INFINITY, f64::min).sqrt()
        }
    }
}
