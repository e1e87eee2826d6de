//! Quality of a mesh during local optimisation. The quality decides which vertices move, and which
//! of two meshes is kept.

use glam::DVec3;
use rayon::prelude::*;

use super::Merit;
use crate::quality::{faults::is_inverted, lesser};

/// Quality of a mesh, in f64.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// Merit of each tet `[n_tets]`; see [`Merit`].
    pub(super) beta: Vec<f64>,
    pub(super) worst: Worst,
}

/// Number of inverted tets and smallest beta of a mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct Worst {
    /// Tets without positive volume, or whose volume is NaN.
    pub(super) inverted: usize,
    /// Smallest beta. Infinite without tets, NaN if one is NaN.
    pub(super) beta: f64,
}

impl State {
    pub(super) fn new(beta: Vec<f64>) -> Self {
        let worst = Worst::of(&beta);
        Self { beta, worst }
    }

    /// Measures the tets in `moved` again. [`State::worst`] does not change.
    pub(super) fn measure(&mut self, merit: &Merit, at: &[DVec3], tets: &[[u32; 4]], moved: &[u32]) {
        for &tet in moved {
            self.beta[tet as usize] = merit.of(tet as usize, tets[tet as usize], at);
        }
    }

    /// Takes over the quality of another mesh.
    pub(super) fn copy(&mut self, other: &Self) {
        self.beta.copy_from_slice(&other.beta);
        self.worst = other.worst;
    }
}

impl Worst {
    /// The worst of the betas of a mesh.
    pub(super) fn of(beta: &[f64]) -> Self {
        let of_tet = |&beta: &f64| Self { inverted: usize::from(is_inverted(beta)), beta };
        let none = || Self { inverted: 0, beta: f64::INFINITY };
        let both = |a: Self, b: Self| Self { inverted: a.inverted + b.inverted, beta: lesser(a.beta, b.beta) };
        beta.par_iter().with_min_len(1 << 14).map(of_tet).reduce(none, both)
    }

    /// Whether no tet is inverted or below this beta.
    pub(super) fn reaches(&self, beta: f64) -> bool {
        self.inverted == 0 && self.beta >= beta
    }

    /// Whether `self` has fewer inverted tets than `other`, or equally many and a smallest beta
    /// that is greater by this fraction.
    pub(super) fn beats(&self, other: &Self, by: f64) -> bool {
        self.inverted < other.inverted
            || (self.inverted == other.inverted && self.beta > other.beta + by * other.beta.abs())
    }
}
