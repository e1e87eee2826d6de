//! Runs sweeps or cycles on a device until the displacement is close enough to equilibrium.

use std::sync::Arc;

use glam::DVec3;

use super::{
    FreeRows, History, Method, MovingGraph, Network, Relaxation, Spectrum, Stopping,
    multigrid::{AggregateMaps, Hierarchy},
    schedule::{self, Schedule},
};
use crate::backend::{Backend, BackendError, CpuBackend, DeviceNetwork, Precision, Sweep, WholeNetwork};
use crate::constraint::Constraint;

/// A network on a device. Set up once, relaxed many times.
pub struct Relaxer {
    network: Network,
    /// The vertices that move, in the order of the device.
    moving: Arc<Vec<u32>>,
    /// Only with multigrid.
    aggregate_maps: Option<AggregateMaps>,
    spectrum: Option<Spectrum>,
    method: Method,
    device: Box<dyn DeviceNetwork>,
}

/// The result of a relaxation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Convergence {
    /// Whether the estimated error fell below the tolerance.
    pub converged: bool,
    /// Number of sweeps, or of cycles with multigrid.
    pub sweeps: usize,
    /// Norm of the f64 residual at the end over the norm at the start. 0 if there was nothing to
    /// do.
    pub relative_residual: f64,
    /// Largest estimated error of a vertex, as a fraction of its shortest edge.
    pub error: f64,
    /// The method of a relaxation that did not converge. `None` if all did.
    pub failed: Option<Method>,
    /// How the relaxations went.
    pub history: History,
}

impl Convergence {
    /// The results of two relaxations as one: the sum of the sweeps, and the worse of the other
    /// values.
    pub fn and(self, other: Self) -> Self {
        Self {
            converged: self.converged && other.converged,
            sweeps: self.sweeps + other.sweeps,
            relative_residual: self.relative_residual.max(other.relative_residual),
            error: self.error.max(other.error),
            failed: self.failed.or(other.failed),
            history: self.history.and(other.history),
        }
    }

    /// The result if no vertex has to move.
    pub fn nothing_to_do() -> Self {
        Self { converged: true, ..Self::default() }
    }
}

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

impl Relaxer {
    /// Brings a network to the backend, or to the CPU if the backend leaves it there (see
    /// [`Backend::takes`]), and bounds its spectrum.
    ///
    /// # Errors
    /// The device failed, or the network does not fit the device.
    pub fn new(network: Network, backend: &dyn Backend, method: Method) -> Result<Self, BackendError> {
        let graph = MovingGraph::new(&network);
        Self::along(network, &graph, backend, method)
    }

    /// [`Self::new`], which shares the graph of another network if the same vertices move in both.
    ///
    /// # Errors
    /// As for [`Self::new`].
    pub fn along(
        network: Network,
        graph: &MovingGraph,
        backend: &dyn Backend,
        method: Method,
    ) -> Result<Self, BackendError> {
        // The data on the device is not kept here as well: for a large mesh it is most of the
        // memory.
        let FreeRows { network: of_moving, vertices: moving } = FreeRows::along(&network, graph);
        let reference = CpuBackend::new(Precision::F64);
        let backend = if backend.takes(moving.len()) { backend } else { &reference };
        // The bounds cost a fraction of the sweeps that they save.
        let bounds = if method.depends_on_bounds(moving.len()) { Spectrum::new(&of_moving) } else { None };
        let mut method = method.for_network(moving.len(), bounds);
        let hierarchy = (method == Method::Multigrid).then(|| Hierarchy::new(&of_moving));
        let (aggregate_maps, device, spectrum) = match hierarchy.filter(|hierarchy| hierarchy.depth() > 1) {
            Some(hierarchy) => {
                let (graph, stiffness) = (Arc::clone(&network.graph), Arc::clone(&network.stiffness));
                let whole = WholeNetwork { graph, stiffness, moving: Some(Arc::clone(&moving)) };
                let device = backend.upload_hierarchy_of(&whole, &hierarchy.data(&of_moving))?;
                (Some(hierarchy.aggregate_maps()), device, Some(Spectrum::OF_CYCLES))
            }
            None => {
                // A cycle on one level is no more than sweeps, and the bounds for cycles do not
                // hold for it.
                method = if method == Method::Multigrid { Method::Chebyshev } else { method };
                (None, backend.upload(&of_moving.data())?, bounds.or_else(|| Spectrum::new(&of_moving)))
            }
        };
        Ok(Self { network, moving, aggregate_maps, spectrum, method, device })
    }

    /// The network, in f64.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// The method in use; never [`Method::Auto`].
    pub fn method(&self) -> Method {
        self.method
    }

    /// Replaces the constraints `[n_vertices]`. Held vertices must stay held, and no other vertex
    /// may become held.
    ///
    /// The rows that move and the bounds of their spectrum are kept. A constraint restricts
    /// directions only, and the spectrum stays in the bounds.
    ///
    /// # Errors
    /// The device failed.
    pub fn constrain(&mut self, constraint: Vec<Constraint>) -> Result<(), BackendError> {
        let of_moving = self.gather(&constraint);
        self.network.constraint = constraint;
        let of_levels = self.aggregate_maps.as_ref().map(|aggregate_maps| aggregate_maps.constraints(&of_moving));
        self.device.constrain(&of_levels.unwrap_or(of_moving))
    }

    /// Moves the free vertices of `displacement` `[n_vertices]` to equilibrium with the held ones.
    ///
    /// - `displacement` `[n_vertices]`: on entry the start, on exit the result, in the mesh's unit
    /// - `force` `[n_vertices]`: forces on the vertices, in the unit of stiffness times
    ///   displacement
    ///
    /// # Errors
    /// The device failed. A relaxation that does not converge is no error: see [`Convergence`].
    pub fn relax(
        &mut self,
        displacement: &mut [DVec3],
        force: Option<&[DVec3]>,
        stopping: &Stopping,
    ) -> Result<Convergence, BackendError> {
        self.relax_and_tell(displacement, force, stopping, &|_| ())
    }

    /// As [`Self::relax`].
    ///
    /// - `tell`: gets the share of the work that is done, now and then, in a relaxation of many
    ///   sweeps. The share is that of the digits of the error that are gained
    ///
    /// # Errors
    /// As for [`Self::relax`].
    pub fn relax_and_tell(
        &mut self,
        displacement: &mut [DVec3],
        force: Option<&[DVec3]>,
        stopping: &Stopping,
        tell: &dyn Fn(f64),
    ) -> Result<Convergence, BackendError> {
        let mut residual = self.network.residual(displacement, force);
        let first_norm = norm(&residual);
        let Some(spectrum) = self.spectrum.filter(|_| first_norm > 0.0) else {
            return Ok(Convergence::nothing_to_do());
        };
        let mut result = Convergence { relative_residual: 1.0, error: f64::INFINITY, ..Convergence::default() };
        let (of, method) = ("displacement", self.method.name());
        let mut relaxation = Relaxation { of, method, residuals: vec![(0, 1.0)], ..Relaxation::default() };
        // A pass in f32 gains about five digits. After more than a handful of passes nothing more
        // is gained.
        for _ in 0..8 {
            let pass = self.pass(&residual, spectrum, stopping, &mut relaxation, tell)?;
            let correction = self.device.correction()?;
            let mut furthest: f64 = 0.0;
            for (&row, e) in self.moving.iter().zip(&correction) {
                let row = row as usize;
                // Rounding on the device must not lift a vertex off its plane.
                displacement[row] += self.network.constraint[row].limit(*e);
                let moved = e.length() * self.network.inverse_length[row];
                furthest = if moved.is_nan() { f64::NAN } else { furthest.max(moved) };
            }
            residual = self.network.residual(displacement, force);
            // Bound of the rounding error that a pass may leave: a few roundoffs on meshes of 20
            // 000 to 100 000 tets.
            let rounding = 8.0 * self.device.epsilon() * furthest;
            result.sweeps += pass.sweeps;
            result.relative_residual = norm(&residual) / first_norm;
            relaxation.residuals.push((result.sweeps, result.relative_residual));
            result.error = if furthest.is_nan() { f64::NAN } else { pass.error.max(rounding) };
            result.converged = result.error <= stopping.tolerance;
            if !pass.settled || result.converged || residual.iter().all(|r| *r == DVec3::ZERO) {
                break;
            }
        }
        result.failed = (!result.converged).then_some(self.method);
        relaxation.converged = result.converged;
        result.history = History::of(relaxation);
        Ok(result)
    }

    /// The values of the vertices that move, from the values of all vertices of the network.
    fn gather<T: Copy>(&self, of_whole: &[T]) -> Vec<T> {
        self.moving.iter().map(|&vertex| of_whole[vertex as usize]).collect()
    }

    fn pass(
        &mut self,
        load: &[DVec3],
        spectrum: Spectrum,
        stopping: &Stopping,
        relaxation: &mut Relaxation,
        tell: &dyn Fn(f64),
    ) -> Result<Pass, BackendError> {
        let mut schedule = Schedule::new(self.method, spectrum);
        let batch = schedule.batch();
        let load = self.gather(load);
        self.device.start(&load)?;
        let done = relaxation.sweeps;
        let mut sweeps = 0;
        let mut largest_change: f64 = 0.0;
        let mut last = Change { measured: f64::INFINITY, bound: f64::INFINITY, ratio: f64::INFINITY };
        let mut progress = Progress { change: f64::INFINITY, batches: 0 };
        let (mut batches, mut first_error) = (0, 0.0);
        let mut made = Vec::new();
        loop {
            let left = stopping.max_sweeps.saturating_sub(done + sweeps);
            let count = batch.min(left);
            if count == 0 {
                return Ok(Pass { sweeps, error: f64::INFINITY, settled: false });
            }
            let rate = schedule.rate().powi(batch as i32);
            let noise = 100.0 * self.device.epsilon() * largest_change;
            let ahead = last.batches_to(stopping.tolerance, noise, rate).min(left / batch);
            let ahead = ahead.min(self.device.most_batches()).max(1);
            let mut planned = schedule.clone();
            let next: Vec<Vec<Sweep>> = (0..ahead).map(|_| planned.next(count)).collect();
            let measures = self.device.sweep_batches(&next)?;
            // The rule is applied batch by batch. If it ends the pass or changes the schedule
            // before the last of these batches, the device goes back to the batch at which it did.
            for (at, (next, measure)) in next.into_iter().zip(measures).enumerate() {
                let is_last = at + 1 == ahead;
                let measured = measure.change;
                schedule.next(count);
                if self.device.most_batches() > 1 {
                    made.extend(next);
                }
                sweeps += count;
                relaxation.sweeps = done + sweeps;
                relaxation.add_change(done + sweeps, measured);
                if !measured.is_finite() {
                    return Ok(Pass { sweeps, error: f64::NAN, settled: false });
                }
                largest_change = largest_change.max(measured);
                // Chebyshev's polynomials oscillate. A change far below the promise of the bounds
                // is a coincidence, unless it is zero.
                let promised = rate * last.bound;
                let bound = if measured > 0.0 && promised.is_finite() { measured.max(promised) } else { measured };
                let ratio = bound / last.bound;
                // The remaining error is the sum of a geometric series of further batches.
                let shrinks = if count < batch { 1.0 } else { ratio.clamp(FASTEST, 0.99) };
                let error = bound * shrinks / (1.0 - shrinks).max(0.01);
                let noise = 100.0 * self.device.epsilon() * largest_change;
                let at_roundoff = measured >= 0.5 * last.measured && measured <= noise;
                if error <= stopping.tolerance || at_roundoff || progress.has_ended(measured) {
                    if !is_last {
                        self.repeat(&load, &made)?;
                    }
                    return Ok(Pass { sweeps, error, settled: true });
                }
                batches += 1;
                if batches == 1 {
                    first_error = error;
                }
                if batches % TOLD == 0 && first_error > stopping.tolerance {
                    tell(((error / first_error).ln() / (stopping.tolerance / first_error).ln()).clamp(0.0, 1.0));
                }
                let is_new = schedule.adapt([last.ratio, ratio]);
                last = Change { measured, bound, ratio };
                if is_new && !is_last {
                    self.repeat(&load, &made)?;
                    break;
                }
            }
        }
    }

    /// Runs the sweeps of a pass again: the device has made more of them than were needed.
    fn repeat(&mut self, load: &[DVec3], sweeps: &[Sweep]) -> Result<(), BackendError> {
        self.device.start(load)?;
        self.device.sweep(sweeps).map(drop)
    }
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

struct Pass {
    sweeps: usize,
    error: f64,
    /// The pass reached its end. It did not run out of sweeps or diverge.
    settled: bool,
}

fn norm(vectors: &[DVec3]) -> f64 {
    vectors.iter().map(|v| v.length_squared()).sum::<f64>().sqrt()
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
