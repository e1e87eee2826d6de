//! The relaxation methods, and the coefficients of their successive sweeps or cycles.

use super::Spectrum;
use crate::backend::Sweep;

/// The method by which a network is relaxed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Chebyshev sweeps for small networks that need few of them, multigrid cycles for all others.
    #[default]
    Auto,
    /// Plain Jacobi sweeps, as in the paper.
    Jacobi,
    /// Jacobi sweeps with Chebyshev's coefficients. The number of sweeps is about the square root
    /// of Jacobi's; one more vector is stored.
    Chebyshev,
    /// Multigrid cycles with Chebyshev's coefficients. The number of cycles hardly depends on the
    /// size of the mesh.
    Multigrid,
}

/// Number of moving vertices from which [`Method::Auto`] stands for multigrid.
///
/// Milliseconds of set-up + solution to 1e-4 edges on one core (`cargo bench --bench relaxation`,
/// 2-core x86-64 cloud machine):
///
/// | vertices that move | Chebyshev | multigrid |
/// |---|---|---|
/// | 2 744 | 1.2 + 2.7 | 1.9 + 1.7 |
/// | 6 859 | 2.8 + 8.3 | 5.4 + 5.1 |
/// | 13 824 | 6.3 + 21.1 | 11.6 + 10.6 |
/// | 14 673, pitching wing | 11.5 + 25.8 | 17.7 + 15.0 |
/// | 39 304 | 19.7 + 101.2 | 36.7 + 34.9 |
/// | 117 649 | 80.3 + 423.1 | 127.9 + 116.8 |
///
/// A solution is faster by multigrid from a thousand vertices on, and with the set-up from some 3
/// 000 on. On a GPU the small networks of a hierarchy cost as much as larger ones, so the crossover
/// lies higher; it was not measured on hardware.
const LARGE: usize = 10_000;

/// If cycles shrink the error by no more than this factor, their spectrum is wider than its bounds.
/// Where it is only a little wider, a new start would cost more than it gains.
const SLOW: f64 = 0.3;

/// Least lower bound, for which cycles halve the error. If the error shrinks more slowly still, the
/// remainder is roundoff.
const LOWEST: f64 = 0.1;

/// Greatest upper bound. A cycle with a greater eigenvalue would lengthen errors by itself.
const HIGHEST: f64 = 2.0;

/// Number of Chebyshev sweeps per digit above which [`Method::Auto`] stands for multigrid on small
/// networks too.
///
/// Networks of tets take 4 to 30 sweeps, O-grids of hexahedra with layers of 1e-5 chords up to
/// 114. A wing of 2 128 hexahedra whose layers of 1e-5 end at a wingtip takes 2 000 sweeps for
/// its rotations and 200 000 for its displacements, and multigrid 16 cycles.
const MOST_SWEEPS_PER_DIGIT: usize = 300;

impl Method {
    /// Whether the bounds of the spectrum decide on the method of a network with so many moving
    /// vertices.
    pub(super) fn depends_on_bounds(self, n_moving: usize) -> bool {
        self == Self::Auto && n_moving < LARGE
    }

    /// The method for a network. Only [`Method::Auto`] depends on the network.
    ///
    /// - `n_moving`: number of moving vertices
    /// - `bounds`: of the eigenvalues of the scaled matrix; unknown bounds are those of few sweeps
    pub fn for_network(self, n_moving: usize, bounds: Option<Spectrum>) -> Self {
        let sweeps = |bounds| Schedule::new(Self::Chebyshev, bounds).sweeps_per_digit();
        match self {
            Self::Auto if n_moving >= LARGE => Self::Multigrid,
            Self::Auto if bounds.is_some_and(|bounds| sweeps(bounds) > MOST_SWEEPS_PER_DIGIT) => Self::Multigrid,
            Self::Auto => Self::Chebyshev,
            chosen => chosen,
        }
    }

    /// The method to try where this one does not converge.
    pub fn other(self) -> Self {
        if self == Self::Multigrid { Self::Chebyshev } else { Self::Multigrid }
    }

    /// The name in cases and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Jacobi => "jacobi",
            Self::Chebyshev => "chebyshev",
            Self::Multigrid => "multigrid",
        }
    }
}

/// Whether a cycle shrank the error so little that [`Schedule::adapt`] may act on two of them.
///
/// - `ratio`: the change over the change of the cycle before
pub(super) fn is_slow(ratio: f64) -> bool {
    ratio >= SLOW
}

/// The sequence of sweeps of one pass.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    method: Method,
    spectrum: Spectrum,
    /// Relaxation factor of the last Chebyshev sweep.
    last: Option<f64>,
    /// Number of sweeps since the start.
    age: usize,
}

impl Schedule {
    pub(super) fn new(method: Method, spectrum: Spectrum) -> Self {
        Self { method, spectrum, last: None, age: 0 }
    }

    /// Sweeps between two measures: by the bounds of the spectrum they shrink the error tenfold.
    /// With multigrid a single cycle, which shrinks the error by about as much.
    pub(super) fn batch(&self) -> usize {
        if self.method == Method::Multigrid { 1 } else { self.sweeps_per_digit() }
    }

    /// Sweeps that shrink the error tenfold by the bounds of the spectrum.
    pub(super) fn sweeps_per_digit(&self) -> usize {
        let sweeps = 10f64.ln() / -self.rate().clamp(0.1, 1.0 - 1e-9).ln();
        (sweeps.ceil() as usize).clamp(4, 1 << 20)
    }

    /// The factor by which a sweep shrinks the error on average, by the bounds of the spectrum.
    pub(super) fn rate(&self) -> f64 {
        let Spectrum { low, high } = self.spectrum;
        match self.method {
            // The iteration matrix has no negative entry, so its spectral radius is its largest
            // eigenvalue (Perron).
            Method::Jacobi => 1.0 - low,
            _ => {
                let root = (high / low).sqrt();
                (root - 1.0) / (root + 1.0)
            }
        }
    }

    /// Restarts the cycles on wider bounds if the last two cycles shrank the error much less than
    /// the bounds promise.
    ///
    /// A mode with an eigenvalue outside the bounds decays as Chebyshev's polynomials grow outside
    /// `[-1, 1]`. The rate of decay gives the eigenvalue (after Manteuffel, Numer. Math. 28, 1977,
    /// 307-327). A mode below the bounds always decays, because Chebyshev's polynomials are 1 at
    /// zero. If the error grows, the eigenvalue lies above the bounds.
    ///
    /// Returns whether the bounds have changed.
    ///
    /// - `ratios`: for the last two cycles, the change over the change of the cycle before
    pub(super) fn adapt(&mut self, ratios: [f64; 2]) -> bool {
        let Spectrum { low, high } = self.spectrum;
        let growth = ratios[1] / self.rate();
        let is_slow = ratios.iter().all(|&ratio| is_slow(ratio) && ratio >= 1.3 * self.rate());
        // The first cycles of a schedule are not typical of the later ones.
        if self.method != Method::Multigrid || !is_slow || self.age < 4 {
            return false;
        }
        let from_centre = 0.5 * (high - low) * 0.5 * (growth + 1.0 / growth);
        let centre = 0.5 * (high + low);
        let spectrum = if ratios.iter().all(|&ratio| ratio > 1.0) {
            Spectrum { low, high: (1.05 * (centre + from_centre)).min(HIGHEST) }
        } else {
            Spectrum { low: (0.8 * (centre - from_centre)).clamp(LOWEST, low), high }
        };
        let is_new = spectrum != self.spectrum;
        if is_new {
            *self = Self::new(self.method, spectrum);
        }
        is_new
    }

    /// The coefficients of the next sweeps.
    pub(super) fn next(&mut self, count: usize) -> Vec<Sweep> {
        (0..count).map(|_| self.sweep()).collect()
    }

    /// One sweep of Chebyshev semi-iteration for eigenvalues in `[low, high]` (Saad, Iterative
    /// Methods, algorithm 12.1, with the change of the displacement instead of a search direction).
    fn sweep(&mut self) -> Sweep {
        self.age += 1;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Cycles until modes of these eigenvalues, each 1 at first, are all below 1e-8; and the lower
    /// bound they end with.
    fn cycles(eigenvalues: &[f64]) -> (usize, f64) {
        let mut schedule = Schedule::new(Method::Multigrid, Spectrum::OF_CYCLES);
        let mut errors: Vec<[f64; 2]> = vec![[1.0, 0.0]; eigenvalues.len()];
        let mut last = [f64::INFINITY; 2];
        for cycle in 1..=200 {
            let Sweep { relaxation, momentum } = schedule.sweep();
            for (&eigenvalue, [error, change]) in eigenvalues.iter().zip(&mut errors) {
                *change = momentum * *change - relaxation * eigenvalue * *error;
                *error += *change;
            }
            if errors.iter().all(|[error, _]| error.abs() < 1e-8) {
                return (cycle, schedule.spectrum.low);
            }
            let change = errors.iter().map(|[_, change]| change.abs()).fold(0.0, f64::max);
            let now = [change, change / last[0]];
            schedule.adapt([last[1], now[1]]);
            last = now;
        }
        panic!("{eigenvalues:?} do not fade: {errors:?}");
    }

    /// The largest network measured is three times as fast by multigrid; the smallest gains
    /// nothing.
    ///
    /// Fails if `LARGE` is 100000000 or 10.
    #[test]
    fn large_networks_are_relaxed_by_multigrid() {
        assert_eq!(Method::Auto.for_network(117_649, None), Method::Multigrid);
        assert_eq!(Method::Auto.for_network(1_000, None), Method::Chebyshev);
        assert_eq!(Method::Jacobi.for_network(117_649, None), Method::Jacobi);
    }

    /// The error of Chebyshev's sweeps falls by `(root - 1) / (root + 1)` with each, where `root`
    /// is the square root of the condition: a digit takes about `1.15 root` sweeps.
    #[test]
    fn small_networks_with_many_sweeps_are_relaxed_by_multigrid() {
        let of_condition = |condition: f64| Some(Spectrum { low: 2.0 / condition, high: 2.0 });
        for (method, condition, expected) in [
            // 115 sweeps, as an O-grid may need.
            (Method::Auto, 1e4, Method::Chebyshev),
            // 1 151 sweeps.
            (Method::Auto, 1e6, Method::Multigrid),
            (Method::Auto, 1e11, Method::Multigrid),
            (Method::Chebyshev, 1e11, Method::Chebyshev),
            (Method::Jacobi, 1e11, Method::Jacobi),
        ] {
            assert_eq!(method.for_network(2_000, of_condition(condition)), expected, "{method:?} {condition:e}");
        }
        assert!(Method::Auto.depends_on_bounds(2_000) && !Method::Auto.depends_on_bounds(117_649));
    }

    #[test]
    fn the_other_method_is_another() {
        assert_eq!(Method::Chebyshev.other(), Method::Multigrid);
        assert_eq!(Method::Jacobi.other(), Method::Multigrid);
        assert_eq!(Method::Multigrid.other(), Method::Chebyshev);
    }

    /// On the first bounds the mode of eigenvalue 0.2 fades by 0.75 with each cycle and takes 64 of
    /// them; on bounds that hold it, and end at 0.1 or above, every mode fades by 0.52 or faster.
    ///
    /// Fails if `SLOW` is 0.9, and if `LOWEST` is 0.001 or 0.6.
    #[test]
    fn bounds_follow_a_mode_below_them() {
        let (cycles, low) = cycles(&[0.2, 0.66, 0.8, 0.9, 1.0]);
        assert!((0.1..=0.2).contains(&low), "{low}");
        assert!(cycles <= 35, "{cycles}");
    }

    /// A mode of eigenvalue 1.6 fades by 0.91 with each cycle on the first bounds, and then looks
    /// like a mode below the bounds. On lower bounds it grows.
    ///
    /// Fails if growth is taken for a mode below the bounds.
    #[test]
    fn bounds_follow_a_mode_above_them() {
        let (cycles, _) = cycles(&[0.66, 0.8, 1.0, 1.6]);
        assert!(cycles <= 60, "{cycles}");
    }

    #[test]
    fn bounds_that_hold_all_modes_stay() {
        let (cycles, low) = cycles(&[0.66, 0.8, 0.9, 1.0]);
        assert_eq!(low, Spectrum::OF_CYCLES.low);
        assert!(cycles <= 10, "{cycles}");
    }
}
