//! The seconds of each stage of an update, and those that its device took.

use std::time::Instant;

use serde::Serialize;

use crate::backend::{Backend, DeviceTimes};

/// The last row of [`Outcome::stage_seconds`](super::Outcome::stage_seconds).
pub(super) const CHECKS: &str = "checks";

/// Seconds of a stage of an update. What the host computes itself takes `seconds - waiting`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct StageSeconds {
    /// The stage; `"checks"` for the measures of the result.
    pub stage: &'static str,
    /// Seconds from the stage before, measures of the stage included.
    pub seconds: f64,
    /// Seconds of waiting for answers of the device; 0 on the CPU. Updates at the same time on the
    /// same device count together.
    pub waiting: f64,
    /// Seconds of the device's kernels. `None` on the CPU, and where they were not asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kernels: Option<f64>,
}

impl StageSeconds {
    /// The seconds of a stage.
    pub fn new(stage: &'static str, seconds: f64, waiting: f64, kernels: Option<f64>) -> Self {
        Self { stage, seconds, waiting, kernels }
    }
}

/// Measures one stage after another.
pub(super) struct StageClock<'a> {
    backend: &'a dyn Backend,
    last: Instant,
    times: DeviceTimes,
    stages: Vec<StageSeconds>,
}

impl<'a> StageClock<'a> {
    pub(super) fn start(backend: &'a dyn Backend) -> Self {
        let times = backend.times().unwrap_or_default();
        Self { backend, last: Instant::now(), times, stages: Vec::new() }
    }

    /// Ends a stage, at which the next begins.
    pub(super) fn end(&mut self, stage: &'static str) {
        let (now, times) = (Instant::now(), self.backend.times().unwrap_or_default());
        let DeviceTimes { waiting, kernels } = times.since(self.times);
        self.stages.push(StageSeconds::new(stage, (now - self.last).as_secs_f64(), waiting, kernels));
        (self.last, self.times) = (now, times);
    }

    /// Ends the last stage.
    pub(super) fn stop(mut self) -> Vec<StageSeconds> {
        self.end(CHECKS);
        self.stages
    }
}
