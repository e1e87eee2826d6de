//! The coefficients of successive sweeps.

use super::Spectrum;
use crate::backend::Sweep;

/// How a network is relaxed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Plain Jacobi sweeps, the paper's.
    Jacobi,
    /// Jacobi sweeps with Chebyshev's coefficients: the square root of the number of sweeps for one vector more.
    Chebyshev,
}

impl Method {
    /// The word for it in cases and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Jacobi => "jacobi",
            Self::Chebyshev => "chebyshev",
        }
    }
}

/// The sweeps of one pass.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    method: Method,
    spectrum: Spectrum,
    /// Relaxation factor of the last Chebyshev sweep.
    last: Option<f64>,
}

impl Schedule {
    pub(super) fn new(method: Method, spectrum: Spectrum) -> Self {
        Self { method, spectrum, last: None }
    }

    /// Sweeps that shrink the error tenfold by the spectrum's bounds.
    pub(super) fn sweeps_per_digit(&self) -> usize {
        let Spectrum { low, high } = self.spectrum;
        let rate = match self.method {
            // The iteration matrix has no negative entry, so its largest eigenvalue is its spectral radius (Perron).
            Method::Jacobi => 1.0 - low,
            Method::Chebyshev => {
                let root = (high / low).sqrt();
                (root - 1.0) / (root + 1.0)
            }
        };
        let sweeps = 10f64.ln() / -rate.clamp(0.1, 1.0 - 1e-9).ln();
        (sweeps.ceil() as usize).clamp(4, 1 << 20)
    }

    /// The next sweeps.
    pub(super) fn next(&mut self, count: usize) -> Vec<Sweep> {
        (0..count).map(|_| self.sweep()).collect()
    }

    /// Chebyshev semi-iteration for eigenvalues in `[low, high]` (Saad, Iterative Methods, algorithm 12.1, written with
    /// the change of the displacement instead of a search direction).
    fn sweep(&mut self) -> Sweep {
        if self.method == Method::Jacobi {
            return Sweep { relaxation: 1.0, momentum: 0.0 };
        }
        let Spectrum { low, high } = self.spectrum;
        let (centre, half_width) = (0.5 * (high + low), 0.5 * (high - low));
        match self.last {
            None => {
                self.last = Some(1.0 / centre);
                Sweep { relaxation: 1.0 / centre, momentum: 0.0 }
            }
            Some(last) => {
                let first = last == 1.0 / centre;
                let beta = (half_width * last).powi(2) * if first { 0.5 } else { 0.25 };
                let relaxation = 1.0 / (centre - beta / last);
                self.last = Some(relaxation);
                Sweep { relaxation, momentum: relaxation * beta / last }
            }
        }
    }
}
