//! The time of an update, without the time for other designs meanwhile.

use std::time::{Duration, Instant};

/// Measures the laps of an update.
pub(super) struct Stopwatch {
    last: Instant,
    /// Time of the lap before `last`.
    before: Duration,
}

impl Stopwatch {
    pub(super) fn start() -> Self {
        Self { last: Instant::now(), before: Duration::ZERO }
    }

    /// Stops before the mover turns to another design.
    pub(super) fn pause(&mut self) {
        self.before += self.last.elapsed();
    }

    /// Starts again.
    ///
    /// - `share`: the design's share of the time for several designs since [`Self::pause`]
    pub(super) fn go_on(&mut self, share: Duration) {
        self.before += share;
        self.last = Instant::now();
    }

    /// Ends a lap, at which the next begins. Returns its seconds.
    pub(super) fn lap(&mut self) -> f64 {
        let now = Instant::now();
        let lap = self.before + (now - self.last);
        *self = Self { last: now, before: Duration::ZERO };
        lap.as_secs_f64()
    }
}
