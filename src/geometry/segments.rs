//! Straight segments between two points.

use glam::DVec3;

/// The point of the segment from `a` to `b` nearest to `point`, and its parameter: 0 at `a`, 1 at
/// `b`. A segment of length 0 gives `a` and 0.
#[inline]
pub fn nearest_on_segment(point: DVec3, a: DVec3, b: DVec3) -> (DVec3, f64) {
    let along = b - a;
    let square = along.length_squared();
    let t = if square > 0.0 { ((point - a).dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
    (a + along * t, t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_lies_between_the_ends() {
        let (a, b) = (DVec3::new(1.0, 1.0, 0.0), DVec3::new(5.0, 1.0, 0.0));
        assert_eq!(nearest_on_segment(DVec3::new(2.0, 7.0, -3.0), a, b), (DVec3::new(2.0, 1.0, 0.0), 0.25));
        assert_eq!(nearest_on_segment(DVec3::new(-9.0, 0.0, 0.0), a, b), (a, 0.0));
        assert_eq!(nearest_on_segment(DVec3::new(9.0, 0.0, 0.0), a, b), (b, 1.0));
        assert_eq!(nearest_on_segment(DVec3::ZERO, a, a), (a, 0.0));
    }
}
