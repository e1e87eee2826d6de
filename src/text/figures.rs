//! Lengths and positions in messages and files. They are readable in every unit: very small and
//! very large numbers have an exponent.

use std::fmt;

use glam::DVec3;

/// A number with the fewest digits that read back as the same number. It has an exponent where
/// there would be many zeros.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shortest(pub f64);

impl fmt::Display for Shortest {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self(value) = self;
        if *value == 0.0 || (1e-5..1e16).contains(&value.abs()) { write!(f, "{value}") } else { write!(f, "{value:e}") }
    }
}

/// A position with all its digits, such as `(1, -0.25, 0)`. If its largest coordinate is very small
/// or very large, the coordinates have exponents.
pub(crate) fn place(at: DVec3) -> String {
    let [x, y, z] = at.to_array();
    if is_plain(at.abs().max_element(), 1e-9) {
        return format!("({x}, {y}, {z})");
    }
    let [x, y, z] = [x, y, z].map(Shortest);
    format!("({x}, {y}, {z})")
}

/// A position with six decimals, such as `[1.000000, -0.250000, 0.000000]`. If its largest
/// coordinate is very small or very large, all coordinates have an exponent.
pub(crate) fn near(at: DVec3) -> String {
    if is_plain(at.abs().max_element(), 1e-3) {
        return format!("{at:.6}");
    }
    let [x, y, z] = at.to_array();
    format!("[{x:.6e}, {y:.6e}, {z:.6e}]")
}

/// A length with four decimals. If lengths such as `size` are very small or very large, it has an
/// exponent.
pub(crate) fn length(value: f64, size: f64) -> String {
    if is_plain(size, 1e-1) { format!("{value:.4}") } else { format!("{value:.4e}") }
}

/// Whether a length is written without exponent. Infinity and NaN are.
///
/// - `least`: the least such length above 0
fn is_plain(size: f64, least: f64) -> bool {
    size == 0.0 || !size.is_finite() || (least..1e12).contains(&size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ordinary_lengths_have_no_exponent() {
        assert_eq!(place(DVec3::new(1.0, -0.25, 1e-7)), "(1, -0.25, 0.0000001)");
        assert_eq!(near(DVec3::new(1.0, -0.25, 1e-17)), "[1.000000, -0.250000, 0.000000]");
        assert_eq!(near(DVec3::ZERO), "[0.000000, 0.000000, 0.000000]");
        assert_eq!(length(1e-17, 4.0), "0.0000");
    }

    /// Fixed decimals would show a place on a mesh of 1e-30 as zero.
    #[test]
    fn no_length_is_shown_as_zero_for_its_unit() {
        for scale in [1e-30, 1e-12, 1e14, 1e30] {
            let at = scale * DVec3::new(1.0, -0.25, 1.0 / 3.0);
            let number = |text: &str| text.trim().parse::<f64>().unwrap();
            let of =
                |text: String| text[1..text.len() - 1].split(',').map(number).zip(at.to_array()).collect::<Vec<_>>();
            for (found, expected) in of(near(at)) {
                assert!((found - expected).abs() <= 1e-6 * scale, "{found:e} instead of {expected:e}");
            }
            for (found, expected) in of(place(at)) {
                assert_eq!(found, expected);
            }
            assert!((number(&length(at.x, 3.0 * scale)) - at.x).abs() <= 1e-4 * scale);
            assert!(place(at).len() < 80 && near(at).len() < 80);
        }
    }
}
