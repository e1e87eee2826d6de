//! Measures of the tets: signed volume and the paper's beta; and what is wrong with a moved mesh ([`faults`]).

pub mod faults;

use glam::DVec3;
use rayon::prelude::*;

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

/// Statistics of beta over a mesh, as in the paper's Table 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Smallest beta.
    pub min: f64,
    /// Largest beta.
    pub max: f64,
    /// Arithmetic mean of beta.
    pub mean: f64,
    /// Number of tets whose volume is not positive.
    pub inverted: usize,
}

/// Beta of every tet `[n_tets]`.
pub fn betas(vertices: &[DVec3], tets: &[[u32; 4]]) -> Vec<f64> {
    tets.par_iter().map(|tet| beta(tet.map(|vertex| vertices[vertex as usize]))).collect()
}

impl Statistics {
    /// The statistics of these values. A NaN counts as inverted and shows in all three figures.
    pub fn new(betas: &[f64]) -> Self {
        let extreme = |pick: fn(f64, f64) -> bool| {
            betas.iter().copied().reduce(|a, b| if a.is_nan() || pick(a, b) { a } else { b }).unwrap_or(f64::NAN)
        };
        Self {
            min: extreme(|a, b| a <= b),
            max: extreme(|a, b| a >= b),
            mean: betas.iter().sum::<f64>() / betas.len() as f64,
            inverted: betas.iter().filter(|&&beta| faults::is_inverted(beta)).count(),
        }
    }
}
