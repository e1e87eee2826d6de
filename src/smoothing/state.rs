//! How good the mesh is: what decides where the smoother works, and which of two meshes it keeps.

use glam::DVec3;
use rayon::prelude::*;

use crate::quality;

/// Quality of a mesh in f64.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// Beta of each tet `[n_tets]`.
    pub(super) beta: Vec<f64>,
    /// Tets without positive volume, and those whose volume is no number.
    pub(super) inverted: usize,
    /// Smallest beta; infinite without tets, NaN if one is.
    pub(super) beta_min: f64,
    /// Smallest volume over that of the original tet.
    pub(super) sigma_min: f64,
}

impl State {
    /// - `volume` `[n_tets]`: volume of each original tet
    pub(super) fn new(positions: &[DVec3], tets: &[[u32; 4]], volume: &[f64]) -> Self {
        let mut beta = vec![0.0; tets.len()];
        let of_tets = beta.par_iter_mut().zip(tets).zip(volume);
        let of_tet = |((beta, tet), volume): ((&mut f64, &[u32; 4]), &f64)| {
            let corners = tet.map(|vertex| positions[vertex as usize]);
            *beta = quality::beta(corners);
            let inverted = usize::from(beta.is_nan() || *beta <= 0.0);
            (inverted, *beta, quality::volume(corners) / volume)
        };
        let worst = |a: f64, b: f64| if a.is_nan() || a <= b { a } else { b };
        let (inverted, beta_min, sigma_min) = of_tets
            .map(of_tet)
            .reduce(|| (0, f64::INFINITY, f64::INFINITY), |a, b| (a.0 + b.0, worst(a.1, b.1), worst(a.2, b.2)));
        Self { beta, inverted, beta_min, sigma_min }
    }

    /// Whether no tet is below this beta.
    pub(super) fn reaches(&self, beta: f64) -> bool {
        self.inverted == 0 && self.beta_min >= beta
    }

    /// Whether it has fewer inverted tets, or as many and a greater smallest beta, by this fraction of it.
    pub(super) fn beats(&self, other: &Self, by: f64) -> bool {
        self.inverted < other.inverted
            || (self.inverted == other.inverted && self.beta_min > other.beta_min + by * other.beta_min.abs())
    }
}
