//! Distances of points from a profile.

use glam::DVec3;

use super::path_boxes::PathBoxes;
use crate::geometry::nearest_on_segment;

/// Largest distance of `points` from the polyline through `curve`, in the mesh's unit. NaN if
/// `curve` is empty and `points` is not.
///
/// In the report `points` is the section of the moved wing, and `curve` is the new profile. No
/// point is left out.
pub fn max_distance(points: &[DVec3], curve: &[DVec3]) -> f64 {
    let curve = Polyline::new(curve);
    let distances = points.iter().map(|&point| curve.distance(point));
    distances.fold(0.0, |worst, d| if d > worst || d.is_nan() { d } else { worst })
}

/// Distance of a point from the polyline through `curve`, in the mesh's unit. NaN if `curve` is
/// empty, infinite if the point is NaN.
///
/// For many points `Polyline` takes less time.
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

/// A polyline, prepared for the distances of many points. A distance takes a time that grows with
/// the logarithm of the number of the polyline's points.
pub(super) struct Polyline<'a> {
    points: &'a [DVec3],
    /// None for fewer than two points.
    boxes: Option<PathBoxes>,
}

impl<'a> Polyline<'a> {
    pub fn new(points: &'a [DVec3]) -> Self {
        Self { points, boxes: (points.len() > 1).then(|| PathBoxes::new(points)) }
    }

    /// The same number as [`distance`].
    pub fn distance(&self, point: DVec3) -> f64 {
        match &self.boxes {
            None => distance(point, self.points),
            // The least of no numbers.
            Some(_) if point.is_nan() => f64::INFINITY,
            Some(boxes) => boxes.distance_squared(self.points, point).sqrt(),
        }
    }
}
