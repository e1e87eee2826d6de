//! Smoothed aggregation multigrid: a hierarchy of ever coarser networks.
//!
//! A cycle sweeps a network a few times, which damps the differences between neighbours. The
//! remaining error goes to a network with about a twentieth of the vertices, and so on down. The
//! coarsest network is relaxed by sweeps alone. Every level is a spring network with constraints of
//! its own, and is swept by the same kernels. The groups of vertices (`aggregation`) and the coarse
//! springs (`coarsening`) are computed once, on the CPU.
//!
//! **Constraints.** A vertex joins, and is smoothed with, only vertices with similar constraints,
//! and the aggregate inherits the constraint. So a plane stays a plane on all levels, and the
//! coarse networks are as stiff as the fine ones. With smoothing across the edge of a plane,
//! corrections overshot: cycles on thin layers with a symmetry plane had eigenvalues up to 1.38,
//! beyond their bounds.
//!
//! **Acceleration.** Cycles follow one another with Chebyshev's coefficients. Conjugate gradients
//! took 6 cycles where these take 7 to 8 (residual over 1e6, wings of 100 000 and 900 000 tets),
//! but need sums over all vertices in each cycle.
//!
//! The paper has no multigrid.

mod aggregation;
mod coarsening;
mod rows;

use aggregation::{Aggregates, strong};

use super::schedule::{Method, Schedule};
use super::{Network, Spectrum};
use crate::backend::{LevelData, Sweep, Transfer};
use crate::constraint::Constraint;

/// A network with at most so many vertices is relaxed by sweeps alone.
const COARSEST: usize = 40;

/// A further level is not worth its cost if it has more than this share of the vertices.
const SHRINKS: f64 = 0.8;

/// Sweeps before a coarse correction, and again after it. One sweep takes 1.5 times the cycles at
/// 0.65 times the cost, three take 0.85 times the cycles at 1.4 times the cost.
///
/// Levels between the finest and the last two are swept twice as often, because the errors of many
/// levels add up (Bramble and Pasciak, Math. Comp. 49, 1987, 311-329, show it for cycles with more
/// sweeps the coarser the level).
const SMOOTHING: usize = 2;

/// [`SMOOTHING`] sweeps damp the eigenvalues from the highest down to this fraction of it. Lower
/// eigenvalues are left to the coarser levels. With twice as many sweeps the limit falls to a
/// quarter, as Chebyshev's polynomials allow.
const DAMPED: f64 = 0.25;

/// A hierarchy of networks.
pub struct Hierarchy {
    levels: Vec<Level>,
}

struct Level {
    /// `None` at the finest level, whose network belongs to the caller.
    network: Option<Network>,
    sweeps: Vec<Sweep>,
    coarser: Option<Coarser>,
}

/// The aggregates and transfers to the next coarser level.
struct Coarser {
    aggregates: Aggregates,
    restriction: Transfer,
    prolongation: Transfer,
}

impl Hierarchy {
    /// Coarsens a network until few vertices are left. All vertices of `finest` must move.
    pub fn new(finest: &Network) -> Self {
        let mut levels: Vec<Level> = Vec::new();
        let mut highest = Vec::new();
        let mut network: Option<Network> = None;
        loop {
            let fine = network.as_ref().unwrap_or(finest);
            let strong = strong(fine);
            let aggregates = aggregates(fine, &strong);
            let (sweeps, coarser, coarse) = match aggregates {
                None => (solving_sweeps(fine), None, None),
                Some(aggregates) => {
                    let of_fine = Spectrum::highest(fine);
                    highest.push(of_fine);
                    let (coarser, coarse) = Coarser::new(fine, strong, aggregates, of_fine);
                    (smoothing_sweeps(of_fine, SMOOTHING), Some(coarser), Some(coarse))
                }
            };
            levels.push(Level { network: network.take(), sweeps, coarser });
            if coarse.is_none() {
                break;
            }
            network = coarse;
        }
        let last_but_one = highest.len().saturating_sub(1);
        for (level, &highest) in levels.iter_mut().zip(&highest).take(last_but_one).skip(1) {
            level.sweeps = smoothing_sweeps(highest, 2 * SMOOTHING);
        }
        Self { levels }
    }

    /// Number of levels.
    pub fn depth(&self) -> usize {
        self.levels.len()
    }

    /// Number of springs on all levels over the number on the finest: the cost of a cycle's sweeps
    /// in units of the finest level.
    pub fn complexity(&self, finest: &Network) -> f64 {
        let coarse: usize =
            self.levels.iter().flat_map(|level| &level.network).map(|coarse| coarse.stiffness.len()).sum();
        1.0 + coarse as f64 / finest.stiffness.len().max(1) as f64
    }

    /// The levels in the layout for a backend, the finest first.
    ///
    /// - `finest`: the network from which the hierarchy was made
    pub fn data<'a>(&'a self, finest: &'a Network) -> Vec<LevelData<'a>> {
        let data = |level: &'a Level| LevelData {
            network: level.network.as_ref().unwrap_or(finest).data(),
            sweeps: &level.sweeps,
            transfers: level.coarser.as_ref().map(|coarser| [&coarser.restriction, &coarser.prolongation]),
        };
        self.levels.iter().map(data).collect()
    }

    /// The part of the hierarchy that is needed after a device has received the rest.
    pub fn aggregate_maps(self) -> AggregateMaps {
        let coarser = self.levels.into_iter().filter_map(|level| level.coarser);
        AggregateMaps { aggregates: coarser.map(|coarser| coarser.aggregates).collect() }
    }
}

/// The aggregates of each level, finest level first.
pub struct AggregateMaps {
    aggregates: Vec<Aggregates>,
}

impl AggregateMaps {
    /// The constraints of all levels, one level after another, from the constraints of the finest
    /// level `[n_vertices]`.
    pub fn constraints(&self, finest: &[Constraint]) -> Vec<Constraint> {
        let mut all = finest.to_vec();
        let mut first = 0;
        for aggregates in &self.aggregates {
            let coarse = aggregates.constraints(&all[first..]);
            first = all.len();
            all.extend(coarse);
        }
        all
    }
}

impl Coarser {
    /// The transfers to the coarser network, and the coarser network.
    fn new(fine: &Network, strong: Network, aggregates: Aggregates, highest: f64) -> (Self, Network) {
        let prolongation = coarsening::prolongation(&strong, &aggregates, highest);
        drop(strong);
        let mut restriction = coarsening::transpose(&prolongation, aggregates.count);
        let mut coarse = coarsening::galerkin(fine, &prolongation, &restriction);
        coarse.constraint = aggregates.constraints(&fine.constraint);
        // Residuals and loads are divided by the total stiffness of their rows.
        for row in 0..coarse.len() {
            for entry in restriction.sources.range(row) {
                let of_fine = fine.inverse_total[restriction.sources.entries[entry] as usize];
                restriction.weights[entry] *= coarse.inverse_total[row] / of_fine;
            }
        }
        (Self { aggregates, restriction, prolongation }, coarse)
    }
}

/// The aggregates of a network. `None` if the network is coarse enough, or would hardly become
/// coarser.
fn aggregates(network: &Network, strong: &Network) -> Option<Aggregates> {
    if network.len() <= COARSEST {
        return None;
    }
    let aggregates = Aggregates::new(network, strong);
    (aggregates.count > 0 && aggregates.count as f64 <= SHRINKS * network.len() as f64).then_some(aggregates)
}

/// Sweeps that damp the errors that a coarser network cannot represent.
///
/// - `highest`: largest eigenvalue of the network's scaled matrix
fn smoothing_sweeps(highest: f64, count: usize) -> Vec<Sweep> {
    let low = DAMPED * (SMOOTHING as f64 / count as f64).powi(2) * highest;
    Schedule::new(Method::Chebyshev, Spectrum { low, high: highest }).next(count)
}

/// Sweeps that shrink every error fiftyfold.
///
/// Chebyshev's polynomials end at twice the average rate, with either sign. Errors that shrink by
/// `s` leave cycles with eigenvalues up to `1 + s`, and the bounds of cycles end at 1.02.
fn solving_sweeps(network: &Network) -> Vec<Sweep> {
    let Some(spectrum) = Spectrum::new(network) else { return Vec::new() };
    let mut schedule = Schedule::new(Method::Chebyshev, spectrum);
    schedule.next(2 * schedule.sweeps_per_digit())
}
