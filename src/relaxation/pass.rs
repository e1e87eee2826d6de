//! One pass of a relaxation: its schedule, its stopping rule, and the batches that are planned
//! ahead.

use super::{Relaxation, Stopping, schedule, schedule::Schedule};
use crate::backend::{BackendError, DeviceNetwork, Sweep};
use glam::DVec3;

/// Lower bound of the factor by which a batch shrinks the error in the estimate. The modes that
/// change most may hide slower modes for a while.
const FASTEST: f64 = 0.25;

/// Most batches that are planned at once.
const MOST_AHEAD: usize = 16;

/// A pass ends after so many batches that did not halve the change. The slowest cycles measured, on
/// an O-grid, halve it in 20.
const STALLED: usize = 100;

/// A pass tells how far it is after so many batches. Cycles of multigrid end before.
const TOLD: usize = 64;

/// The end of a pass.
pub(super) struct Ended {
    pub(super) sweeps: usize,
    pub(super) error: f64,
    /// The pass reached its end. It did not run out of sweeps or diverge.
    pub(super) settled: bool,
}

/// What the stopping rule says of a batch.
pub(super) enum Verdict {
    GoesOn,
    /// The pass goes on with other coefficients than were planned.
    NewSchedule,
    Ends(Ended),
}

/// A pass in work.
pub(super) struct Pass<'a> {
    schedule: Schedule,
    batch: usize,
    relaxation: &'a mut Relaxation,
    stopping: &'a Stopping,
    /// Unit roundoff of the device.
    epsilon: f64,
    /// Sweeps of the relaxation before this pass.
    done: usize,
    sweeps: usize,
    largest_change: f64,
    last: Change,
    progress: Progress,
    batches: usize,
    first_error: f64,
}

impl<'a> Pass<'a> {
    /// - `epsilon`: unit roundoff of the device
    pub(super) fn new(
        schedule: Schedule,
        relaxation: &'a mut Relaxation,
        stopping: &'a Stopping,
        epsilon: f64,
    ) -> Self {
        Self {
            batch: schedule.batch(),
            schedule,
            done: relaxation.sweeps,
            relaxation,
            stopping,
            epsilon,
            sweeps: 0,
            largest_change: 0.0,
            last: Change { measured: f64::INFINITY, bound: f64::INFINITY, ratio: f64::INFINITY },
            progress: Progress { change: f64::INFINITY, batches: 0 },
            batches: 0,
            first_error: 0.0,
        }
    }

    /// The coefficients of the next batch; `None` if no sweeps are left.
    pub(super) fn next_batch(&self) -> Option<Vec<Sweep>> {
        self.next_batches(1).map(|mut batches| batches.swap_remove(0))
    }

    /// The end of a pass that has no sweeps left.
    pub(super) fn out_of_sweeps(&self) -> Ended {
        Ended { sweeps: self.sweeps, error: f64::INFINITY, settled: false }
    }

    fn left(&self) -> usize {
        self.stopping.max_sweeps.saturating_sub(self.done + self.sweeps)
    }

    fn noise(&self) -> f64 {
        100.0 * self.epsilon * self.largest_change
    }

    /// The factor by which a batch shrinks the error at best, by the bounds of the spectrum.
    fn rate(&self) -> f64 {
        self.schedule.rate().powi(self.batch as i32)
    }

    /// The coefficients of the next batches, as many as are needed at least; `None` if no sweeps
    /// are left.
    ///
    /// - `most`: the most batches that the device wants at once
    fn next_batches(&self, most: usize) -> Option<Vec<Vec<Sweep>>> {
        let (left, batch) = (self.left(), self.batch);
        let count = batch.min(left);
        if count == 0 {
            return None;
        }
        let ahead = self.last.batches_to(self.stopping.tolerance, self.noise(), self.rate()).min(left / batch);
        let mut planned = self.schedule.clone();
        Some((0..ahead.min(most).max(1)).map(|_| planned.next(count)).collect())
    }

    /// Applies the stopping rule to the next batch.
    ///
    /// - `measured`: the change by the batch; see [`Measure::change`](crate::backend::Measure)
    /// - `tell`: gets the share of the work that is done, now and then
    pub(super) fn judge(&mut self, measured: f64, tell: &dyn Fn(f64)) -> Verdict {
        let (rate, count, last) = (self.rate(), self.batch.min(self.left()), self.last);
        let tolerance = self.stopping.tolerance;
        self.schedule.next(count);
        self.sweeps += count;
        self.relaxation.sweeps = self.done + self.sweeps;
        self.relaxation.add_change(self.done + self.sweeps, measured);
        let sweeps = self.sweeps;
        if !measured.is_finite() {
            return Verdict::Ends(Ended { sweeps, error: f64::NAN, settled: false });
        }
        self.largest_change = self.largest_change.max(measured);
        // Chebyshev's polynomials oscillate. A change far below the promise of the bounds is a
        // coincidence, unless it is zero.
        let promised = rate * last.bound;
        let bound = if measured > 0.0 && promised.is_finite() { measured.max(promised) } else { measured };
        let ratio = bound / last.bound;
        // The remaining error is the sum of a geometric series of further batches.
        let shrinks = if count < self.batch { 1.0 } else { ratio.clamp(FASTEST, 0.99) };
        let error = bound * shrinks / (1.0 - shrinks).max(0.01);
        let at_roundoff = measured >= 0.5 * last.measured && measured <= self.noise();
        if error <= tolerance || at_roundoff || self.progress.has_ended(measured) {
            return Verdict::Ends(Ended { sweeps, error, settled: true });
        }
        self.batches += 1;
        if self.batches == 1 {
            self.first_error = error;
        }
        if self.batches.is_multiple_of(TOLD) && self.first_error > tolerance {
            tell(((error / self.first_error).ln() / (tolerance / self.first_error).ln()).clamp(0.0, 1.0));
        }
        let is_new = self.schedule.adapt([last.ratio, ratio]);
        self.last = Change { measured, bound, ratio };
        if is_new { Verdict::NewSchedule } else { Verdict::GoesOn }
    }

    /// Runs a pass of one design to its end.
    ///
    /// - `load` `[n_vertices of the device]`; `None`: the residual of values that the device keeps
    ///
    /// # Errors
    /// The device failed.
    pub(super) fn run(
        mut self,
        device: &mut dyn DeviceNetwork,
        load: Option<&[DVec3]>,
        tell: &dyn Fn(f64),
    ) -> Result<Ended, BackendError> {
        start(device, load)?;
        let mut made = Vec::new();
        loop {
            let Some(next) = self.next_batches(device.most_batches()) else { return Ok(self.out_of_sweeps()) };
            let ahead = next.len();
            let measures = device.sweep_batches(&next)?;
            // The rule is applied batch by batch. If it ends the pass or changes the schedule
            // before the last of these batches, the device goes back to the batch at which it did.
            for (at, (next, measure)) in next.into_iter().zip(measures).enumerate() {
                let is_last = at + 1 == ahead;
                if device.most_batches() > 1 {
                    made.extend(next);
                }
                match self.judge(measure.change, tell) {
                    Verdict::GoesOn => {}
                    Verdict::NewSchedule => {
                        if !is_last {
                            repeat(device, load, &made)?;
                            break;
                        }
                    }
                    Verdict::Ends(ended) => {
                        if !is_last && ended.settled {
                            repeat(device, load, &made)?;
                        }
                        return Ok(ended);
                    }
                }
            }
        }
    }
}

/// Begins a pass with a load, or with the residual of the values that the device keeps.
fn start(device: &mut dyn DeviceNetwork, load: Option<&[DVec3]>) -> Result<(), BackendError> {
    match (load, device.resident()) {
        (Some(load), _) => device.start(load)?,
        (None, Some(resident)) => resident.start_pass(),
        (None, None) => {}
    }
    Ok(())
}

/// Runs the sweeps of a pass again: the device has made more of them than were needed.
fn repeat(device: &mut dyn DeviceNetwork, load: Option<&[DVec3]>, sweeps: &[Sweep]) -> Result<(), BackendError> {
    start(device, load)?;
    device.sweep(sweeps).map(drop)
}

/// The largest change of a vertex by the last batch of sweeps, as a fraction of its shortest edge.
#[derive(Clone, Copy)]
struct Change {
    measured: f64,
    /// The change in the estimate: not much less than the bounds of the spectrum promise.
    bound: f64,
    /// `bound` over the `bound` of the batch before.
    ratio: f64,
}

impl Change {
    /// Number of batches that are needed at least until the estimated error is within the tolerance
    /// or the changes are noise: no bound falls faster than the bounds of the spectrum promise, and
    /// no batch counts for more than [`FASTEST`].
    ///
    /// - `noise`: change below which rounding errors may end a pass
    /// - `rate`: factor by which a batch shrinks the error at best
    fn batches_to(&self, tolerance: f64, noise: f64, rate: f64) -> usize {
        let enough = (tolerance * (1.0 - FASTEST) / FASTEST).max(noise);
        // After a slow batch the next may change the schedule.
        if !(self.bound.is_finite() && rate < 1.0) || schedule::is_slow(self.ratio) {
            return 1;
        }
        let mut batches = 1;
        let mut bound = self.bound * rate;
        while bound > enough && batches < MOST_AHEAD {
            bound *= rate;
            batches += 1;
        }
        batches
    }
}

/// The progress of a pass: when the changes have last halved.
struct Progress {
    /// The change then.
    change: f64,
    /// Batches since then.
    batches: usize,
}

impl Progress {
    /// Whether no batch of the last [`STALLED`] halved the change. On tight pairs of vertices
    /// between weak springs the rounding errors of f32 are larger than those of a regular mesh, and
    /// a pass would go on until it has no sweeps left.
    fn has_ended(&mut self, change: f64) -> bool {
        if change <= 0.5 * self.change {
            *self = Self { change, batches: 0 };
            return false;
        }
        self.batches += 1;
        self.batches >= STALLED
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pass goes on while the change halves in 20 batches, and ends where it stays.
    ///
    /// Fails if `STALLED` is 10 or 10 000.
    #[test]
    fn a_slow_pass_goes_on() {
        let mut progress = Progress { change: f64::INFINITY, batches: 0 };
        assert!((0..1000).all(|batch| !progress.has_ended(0.5f64.powf(f64::from(batch) / 20.0))));
        assert!((0..1000).any(|_| progress.has_ended(0.5f64.powi(50))));
    }
}
