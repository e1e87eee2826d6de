//! Bounds on the eigenvalues of a network's scaled matrix `D^-1 A`, or of multigrid cycles. The
//! eigenvalues of `D^-1 A` lie in `(0, 2)`.
//!
//! The bounds come from Lanczos' method on `D^-1/2 A D^-1/2`. Its start vector is the constant
//! displacement, which is close to the lowest mode of an M-matrix (a mode of one sign), plus some
//! roughness for the highest modes. The extreme Ritz values approach the spectrum from inside, so
//! both ends are widened a little. Chebyshev sweeps converge with a lower bound that is wrong by a
//! factor of two either way, but diverge if an eigenvalue exceeds the upper bound.

use rayon::prelude::*;

use super::Network;

/// Rows of a parallel piece.
const ROWS: usize = 4096;

/// Bounds on the eigenvalues of `D^-1 A`, or of `M^-1 A`, where `M^-1` maps a load to the
/// correction of a multigrid cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spectrum {
    /// Lower bound, positive.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
}

/// Most Lanczos steps. 30 steps settle the ends on 100 000 tets, larger meshes take a few more.
const MOST_STEPS: usize = 200;

/// Number of Lanczos steps that find the upper end to a few percent.
const HIGHEST_STEPS: usize = 10;

/// Upper bound over the highest Ritz value.
const MARGIN: f64 = 1.08;

impl Spectrum {
    /// The bounds with which multigrid cycles begin, on every mesh.
    ///
    /// Lanczos' method in the energy of the springs found lowest eigenvalues of 0.54 to 0.83 on
    /// wings of 54 000 to 921 000 tets, at the price of a seventh of a set-up. It found highest
    /// eigenvalues of 1, apart from the effects of constraints and of the inexact coarsest level. A
    /// wider spectrum shows during the relaxation; see [`super::schedule::Schedule::adapt`].
    pub(super) const OF_CYCLES: Self = Self { low: 0.65, high: 1.02 };

    /// The upper bound alone, from fewer steps. 1 if no vertex can move.
    pub(super) fn highest(network: &Network) -> f64 {
        Self::from_steps(network, HIGHEST_STEPS).map_or(1.0, |spectrum| spectrum.high)
    }

    /// Estimates the bounds. `None` if no vertex can move.
    pub fn new(network: &Network) -> Option<Self> {
        Self::from_steps(network, MOST_STEPS)
    }

    fn from_steps(network: &Network, most_steps: usize) -> Option<Self> {
        let n = network.len();
        let scale = network.scale();
        let mut vector: Vec<f64> =
            (0..n).map(|row| if scale[row] > 0.0 { 1.0 + 0.5 * roughness(row as u64) } else { 0.0 }).collect();
        let norm = dot(&vector, &vector).sqrt();
        if norm == 0.0 {
            return None;
        }
        vector.iter_mut().for_each(|x| *x /= norm);
        let (mut diagonal, mut off_diagonal): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
        let (mut previous, mut product) = (vec![0.0; n], vec![0.0; n]);
        let mut bounds = (1.0, 1.0);
        for step in 1..=most_steps {
            network.scaled_product(&scale, &vector, &mut product);
            let last = off_diagonal.last().copied().unwrap_or(0.0);
            let along = dot(&vector, &product);
            let earlier = vector.par_iter().zip(&previous).with_min_len(ROWS);
            product.par_iter_mut().zip(earlier).for_each(|(product, (vector, previous))| {
                *product -= along * vector + last * previous;
            });
            diagonal.push(along);
            let beta = dot(&product, &product).sqrt();
            let finished = beta < 1e-10;
            if finished || step % 10 == 0 || step == most_steps {
                let earlier = std::mem::replace(&mut bounds, extremes(&diagonal, &off_diagonal));
                let settled = (earlier.0 - bounds.0).abs() < 0.05 * bounds.0 && (earlier.1 - bounds.1).abs() < 0.02;
                if finished || step > 10 && settled {
                    break;
                }
            }
            off_diagonal.push(beta);
            std::mem::swap(&mut previous, &mut vector);
            vector.par_iter_mut().zip(&product).with_min_len(ROWS).for_each(|(x, product)| *x = product / beta);
        }
        Some(Self::around(bounds))
    }

    /// Rounds the bounds outwards to a grid.
    ///
    /// Ritz values carry the rounding errors of their steps. On the grid the bounds are the same
    /// for a rotated mesh and for the same mesh in another unit, and so are all results that depend
    /// on them.
    fn around((lowest, highest): (f64, f64)) -> Self {
        let low = (8.0 * (0.8 * lowest).clamp(1e-12, 1.0).log2()).floor() / 8.0;
        let high = (64.0 * MARGIN * highest).ceil() / 64.0;
        Self { low: low.exp2(), high: high.max(1.0) }
    }
}

/// Smallest and largest eigenvalue of a symmetric tridiagonal matrix, by bisection on Sturm counts.
fn extremes(diagonal: &[f64], off_diagonal: &[f64]) -> (f64, f64) {
    let below = |x: f64| {
        let mut count = 0;
        let mut pivot = 1.0;
        for (at, &d) in diagonal.iter().enumerate() {
            let coupling = if at == 0 { 0.0 } else { off_diagonal[at - 1] * off_diagonal[at - 1] };
            pivot = d - x - coupling / pivot;
            if pivot == 0.0 {
                pivot = -1e-300;
            }
            count += (pivot < 0.0) as usize;
        }
        count
    };
    let at = |at: usize| off_diagonal.get(at).copied().unwrap_or(0.0);
    // Gershgorin's bound. Networks of tets end below 2, coarse networks may exceed it.
    let reach = (0..diagonal.len()).map(|row| diagonal[row] + at(row) + if row == 0 { 0.0 } else { at(row - 1) });
    let reach = reach.fold(0.0, f64::max);
    let bisect = |wanted: usize| {
        let (mut low, mut high) = (-0.5, reach);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if below(middle) >= wanted { high = middle } else { low = middle }
        }
        0.5 * (low + high)
    };
    (bisect(1), bisect(diagonal.len()))
}

/// Sums pieces of fixed size, so that the sum does not depend on the number of threads.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let of_piece = |(a, b): (&[f64], &[f64])| a.iter().zip(b).map(|(x, y)| x * y).sum();
    let sums: Vec<f64> = a.par_chunks(ROWS).zip(b.par_chunks(ROWS)).map(of_piece).collect();
    sums.iter().sum()
}

/// A reproducible number in `[-1, 1]` for each row (the finaliser of SplitMix64).
fn roughness(row: u64) -> f64 {
    let mut x = row.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}
