//! Measures of the tets: signed volume and the paper's beta.

use glam::DVec3;

/// Signed volume of a tet, positive when the fourth vertex lies on the side of the first three's right-hand normal.
pub fn volume(tet: [DVec3; 4]) -> f64 {
    let [a, b, c, d] = tet;
    (b - a).cross(c - a).dot(d - a) / 6.0
}

/// `V / l_max^3` of a tet, signed (paper eq. 1): 0.11785 for the regular tet, zero or negative when inverted.
pub fn beta(tet: [DVec3; 4]) -> f64 {
    let [a, b, c, d] = tet;
    let longest = [b - a, c - a, d - a, c - b, d - b, d - c].into_iter().map(DVec3::length_squared).fold(0.0, f64::max);
    volume(tet) / (longest * longest.sqrt())
}
