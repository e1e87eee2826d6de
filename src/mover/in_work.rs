//! [`InWork`]: an update between its stages.

use std::{cell::Cell, ops::ControlFlow, sync::Arc, time::Duration};

use glam::DVec3;

use super::{
    HeldBack, MoveError, StageName, StageQuality, builder::Progress, fold_check::FoldCheck, stage_clock::StageClock,
    stopwatch::Stopwatch,
};
use crate::{
    backend::DeviceWork,
    families::PlacedBy,
    mesh::{CornerCells, Displacement, Order},
    quality::Statistics,
    relaxation::Convergence,
    stage::SetUp,
    stages::{MadeBySurfaces, StageRow},
    volume::{Jump, displaced},
};

/// A function that gets a stage's name and may change the displacements after the stage.
pub(super) type Amend<'a> = dyn FnMut(&str, &mut Displacement) + 'a;

/// An update whose surfaces have moved.
pub(super) struct InWork {
    /// `[n_vertices]`, in the mesh's unit and the mover's order.
    pub(super) displacement: Displacement,
    pub(super) held_back: Vec<HeldBack>,
    /// The stages so far.
    pub(super) ends: Vec<(&'static str, Convergence)>,
    pub(super) watch: StageWatch,
    pub(super) clock: StageClock,
    pub(super) fold_check: FoldCheck,
    /// The work of the device before the update.
    pub(super) device_work: DeviceWork,
    /// What the stages keep of the design, while they work on another one.
    pub(super) made: MadeBySurfaces,
    /// The jump of the volume, if it was made together with those of other designs.
    pub(super) jump: Option<Jump>,
}

impl InWork {
    /// Stops the update's clocks before the mover turns to another design.
    pub(super) fn pause(&mut self) {
        self.watch.time.pause();
        self.clock.time.pause();
    }

    /// Starts the update's clocks again.
    ///
    /// - `share`: the design's share of the time for several designs since [`Self::pause`]
    pub(super) fn go_on(&mut self, share: Duration) {
        self.watch.time.go_on(share);
        self.clock.time.go_on(share);
    }
}

/// Passes the progress of an update on, and hears whether the update shall stop.
pub(super) struct Listener<'a> {
    progress: &'a Progress,
    tell: &'a dyn Fn(&str) -> ControlFlow<()>,
    is_stopped: Cell<bool>,
}

impl<'a> Listener<'a> {
    pub(super) fn new(progress: &'a Progress, tell: &'a dyn Fn(&str) -> ControlFlow<()>) -> Self {
        Self { progress, tell, is_stopped: Cell::new(false) }
    }

    pub(super) fn hear(&self, what: &str) {
        (self.progress)(what);
        if (self.tell)(what).is_break() {
            self.is_stopped.set(true);
        }
    }

    /// # Errors
    /// [`MoveError::Stopped`]: the update shall stop.
    pub(super) fn go_on(&self) -> Result<(), MoveError> {
        if self.is_stopped.get() { Err(MoveError::Stopped) } else { Ok(()) }
    }
}

/// Ends a stage. Returns the positions of all vertices `[n_vertices]`.
///
/// - `amend`: may change the displacement
pub(super) fn end_stage(
    set_up: &SetUp,
    order: &Order,
    stage: &StageRow,
    amend: Option<&mut Amend>,
    displacement: &mut Displacement,
) -> Vec<DVec3> {
    if stage.placed_by < PlacedBy::Volume {
        set_up.families.partners.even(set_up.families, displacement);
    }
    if let Some(amend) = amend {
        let mut given = order.of_vertices(displacement);
        amend(stage.name, &mut given);
        *displacement = order.to_vertices(&given);
    }
    displaced(&set_up.mesh.vertices, displacement)
}

/// Records the quality of the stages, and their times.
pub(super) struct StageWatch {
    cells: Arc<CornerCells>,
    time: Stopwatch,
    pub(super) stages: Vec<StageQuality>,
}

impl StageWatch {
    pub(super) fn new(cells: Arc<CornerCells>) -> Self {
        Self { cells, time: Stopwatch::start(), stages: Vec::new() }
    }

    /// Records the quality at a stage, and the time since the stage before in s. The time includes
    /// the measurement of quality.
    ///
    /// - `betas` `[n_simplices]`: of the tets and the corner tets
    pub(super) fn record(&mut self, name: StageName, betas: &[f64]) -> Statistics {
        let mut statistics = Statistics::new(&betas[..self.cells.n_tets]);
        if !self.cells.are_tets() {
            statistics.inverted = self.cells.n_inverted(betas);
        }
        self.record_statistics(name, &statistics);
        statistics
    }

    /// As [`Self::record`].
    pub(super) fn record_statistics(&mut self, name: StageName, statistics: &Statistics) {
        let lap = self.time.lap();
        let seconds = if self.stages.is_empty() { 0.0 } else { lap };
        self.stages.push(StageQuality::new(name, statistics, seconds));
    }
}
