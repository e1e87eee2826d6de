//! The rounding of coordinates by the digits in which a file has them.

use glam::DVec3;

/// Digits of a number in double precision, beyond which a file has lost none.
const DOUBLE: usize = 15;

/// The greatest rounding of points, in their unit. It follows from the digits in which all their
/// coordinates are written, and is 0 if these are as many as a double has.
pub(super) fn by_digits(points: impl Iterator<Item = DVec3> + Clone) -> f64 {
    let digits =
        |value: f64| format!("{value:e}").bytes().take_while(|&byte| byte != b'e').filter(u8::is_ascii_digit).count();
    let mut most = 1;
    for value in points.clone().flat_map(|point| point.to_array()) {
        most = most.max(digits(value));
        if most > DOUBLE {
            return 0.0;
        }
    }
    10f64.powi(1 - most as i32) * points.map(|point| point.abs().max_element()).fold(0.0, f64::max)
}

/// The greatest distance by which a vertex moves through rounding alone.
///
/// - `tolerance`: largest distance between a row and its vertex
/// - `rounding`: of the positions in the file; it counts up to [`NEAREST`] tolerances
pub(super) fn at_rest(tolerance: f64, rounding: f64) -> f64 {
    tolerance.max(rounding.min(NEAREST * tolerance))
}

/// A rounded position is nearer to its vertex than to any other, by so many tolerances: half the
/// shortest edge.
pub(super) const NEAREST: f64 = 500.0;
