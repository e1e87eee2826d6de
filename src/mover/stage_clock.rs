//! The seconds of each stage of an update, and those that its device took.

use serde::Serialize;

use super::stopwatch::Stopwatch;
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
pub(super) struct StageClock {
    pub(super) time: Stopwatch,
    times: DeviceTimes,
    stages: Vec<StageSeconds>,
}

impl StageClock {
    pub(super) fn start(backend: &dyn Backend) -> Self {
        Self { time: Stopwatch::start(), times: backend.times().unwrap_or_default(), stages: Vec::new() }
    }

    /// Ends a stage, at which the next begins.
    pub(super) fn end(&mut self, backend: &dyn Backend, stage: &'static str) {
        let (seconds, times) = (self.time.lap(), backend.times().unwrap_or_default());
        let DeviceTimes { waiting, kernels } = times.since(self.times);
        self.stages.push(StageSeconds::new(stage, seconds, waiting, kernels));
        self.times = times;
    }

    /// Ends the last stage.
    pub(super) fn stop(mut self, backend: &dyn Backend) -> Vec<StageSeconds> {
        self.end(backend, CHECKS);
        self.stages
    }
}
