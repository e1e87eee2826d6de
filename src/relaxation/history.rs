//! [`Relaxation`]: how one relaxation came to its end, for reports. [`History`] is a list of them.

use serde::Serialize;

/// Most points of a curve. A relaxation of thousands of batches keeps every second, fourth, ...
/// point.
const MOST_POINTS: usize = 200;

/// Most relaxations of a history. A path of many steps has thousands, of which the first ones show
/// as much.
const MOST_RELAXATIONS: usize = 64;

/// One relaxation of a network.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Relaxation {
    /// The unknown: `"displacement"` or `"rotation"`.
    pub of: &'static str,
    /// The method; see [`super::Method::name`].
    pub method: &'static str,
    /// Whether the estimated error fell below the tolerance.
    pub converged: bool,
    /// Number of sweeps, or of cycles with multigrid.
    pub sweeps: usize,
    /// After so many sweeps: the largest change of a vertex by the last batch of sweeps, as a
    /// fraction of its shortest edge.
    pub changes: Vec<(usize, f64)>,
    /// After so many sweeps: the norm of the f64 residual over the norm at the start. It is
    /// computed at the end of a pass alone.
    pub residuals: Vec<(usize, f64)>,
}

impl Relaxation {
    /// Adds a point to the curve of the changes. A long curve is thinned, and keeps its ends.
    pub(super) fn add_change(&mut self, sweeps: usize, change: f64) {
        if self.changes.len() >= MOST_POINTS {
            let last = self.changes.len() - 1;
            let mut at = 0..;
            self.changes.retain(|_| at.next().is_some_and(|at| at % 2 == 0 || at == last));
        }
        self.changes.push((sweeps, change));
    }
}

/// The relaxations of a stage, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    relaxations: Vec<Relaxation>,
}

impl History {
    /// A history of one relaxation.
    pub(super) fn of(relaxation: Relaxation) -> Self {
        Self { relaxations: vec![relaxation] }
    }

    /// The relaxations, in order: all, or the first ones of very many.
    pub fn relaxations(&self) -> &[Relaxation] {
        &self.relaxations
    }

    /// Says that the unknowns of the relaxations are rotations.
    pub(crate) fn of_rotations(mut self) -> Self {
        self.relaxations.iter_mut().for_each(|relaxation| relaxation.of = "rotation");
        self
    }

    /// This history, and another one after it.
    pub fn and(mut self, other: Self) -> Self {
        let room = MOST_RELAXATIONS.saturating_sub(self.relaxations.len());
        self.relaxations.extend(other.relaxations.into_iter().take(room));
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails if a curve grows without bound, or loses its first or its last point.
    #[test]
    fn a_long_curve_keeps_its_ends() {
        let mut relaxation = Relaxation::default();
        (1..=100_000).for_each(|sweeps| relaxation.add_change(sweeps, 1.0 / sweeps as f64));
        let sweeps: Vec<usize> = relaxation.changes.iter().map(|point| point.0).collect();
        assert!((50..=MOST_POINTS).contains(&sweeps.len()), "{}", sweeps.len());
        assert!(sweeps.is_sorted());
        assert_eq!((sweeps[0], sweeps.last()), (1, Some(&100_000)));
    }

    /// Fails if a path of steps makes a report of any length.
    #[test]
    fn a_history_has_an_end() {
        let one = || History::of(Relaxation { sweeps: 3, ..Relaxation::default() });
        let all = (0..1000).fold(History::default(), |all, _| all.and(one()));
        assert_eq!(all.relaxations().len(), MOST_RELAXATIONS);
    }
}
