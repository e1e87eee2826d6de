//! The levels of a hierarchy of networks in the CPU's memory, in f32. Multigrid cycles are made of
//! the twins.

use std::mem;

use super::chunks::in_chunks;
use crate::backend::packed::Packed;
use crate::backend::vectors::Vectors;
use crate::backend::{LevelData, Sweep, Transfer};
use crate::constraint::Constraint;
use crate::kernels::transfer::Weights;
use crate::kernels::{defect, first_sweep, relax_sweep, transfer};

/// A level of a hierarchy.
pub(super) struct Level {
    /// The level's network.
    pub(super) packed: Packed<f32>,
    sweeps: Vec<Sweep>,
    /// The transfers to the load of the coarser level, and back.
    transfers: Option<[PackedTransfer; 2]>,
    /// The correction.
    pub(super) e: Vectors<f32>,
    /// The correction one sweep earlier; also the defect.
    spare: Vectors<f32>,
}

struct PackedTransfer {
    row_start: Vec<u32>,
    columns: Vec<u32>,
    weights: Vec<f32>,
}

/// Makes the levels, finest first.
pub(super) fn levels(levels: &[LevelData]) -> Vec<Level> {
    let level = |level: &LevelData| {
        let packed = Packed::new(&level.network);
        Level {
            sweeps: level.sweeps.to_vec(),
            transfers: level.transfers.map(|both| both.map(PackedTransfer::new)),
            e: Vectors::zero(packed.n_vertices()),
            spare: Vectors::zero(packed.n_vertices()),
            packed,
        }
    };
    levels.iter().map(level).collect()
}

/// Replaces the constraints of all levels.
///
/// - `constraint`: constraints of the levels, one level after another
pub(super) fn constrain(levels: &mut [Level], mut constraint: &[Constraint]) {
    for level in levels {
        let (own, coarser) = constraint.split_at(level.e.len());
        level.packed.constrain(own);
        constraint = coarser;
    }
}

/// Replaces the correction of the finest of these levels by its correction after one cycle.
pub(super) fn cycle(levels: &mut [Level]) {
    if let Some(level) = levels.first_mut() {
        level.smooth();
        correct(levels);
    }
}

/// [`cycle`] with a start correction of zero.
pub(super) fn cycle_from_zero(levels: &mut [Level]) {
    if let Some(level) = levels.first_mut() {
        level.smooth_from_zero();
        correct(levels);
    }
}

/// The part of a cycle after a level's first sweeps: the coarser level's correction, and the sweeps
/// again.
fn correct(levels: &mut [Level]) {
    let [level, coarser @ ..] = levels else { return };
    let (Some([restriction, prolongation]), Some(next)) = (&level.transfers, coarser.first_mut()) else { return };
    let rows = level.packed.rows();
    let e = &*level.e;
    in_chunks(&mut level.spare, |first, out| defect::run(first, &rows, e, out));
    let (constraint, load) = next.packed.constraint_and_load();
    restriction.run(constraint, 0.0, &level.spare, load);
    cycle_from_zero(coarser);
    prolongation.run(rows.constraint, 1.0, &coarser[0].e, &mut level.e);
    level.smooth();
}

impl Level {
    fn smooth(&mut self) {
        self.sweep_from(0);
    }

    /// The first sweep from a correction of zero takes a share of the load and reads no spring.
    fn smooth_from_zero(&mut self) {
        let rows = self.packed.rows();
        let relaxation = self.sweeps.first().map_or(0.0, |sweep| sweep.relaxation as f32);
        in_chunks(&mut self.e, |first, e| first_sweep::run(first, &rows, relaxation, e));
        in_chunks(&mut self.spare, |_, previous| previous.fill([0.0; 4]));
        self.sweep_from(1);
    }

    fn sweep_from(&mut self, first_sweep: usize) {
        let rows = self.packed.rows();
        for sweep in self.sweeps.iter().skip(first_sweep) {
            let (relaxation, momentum) = (sweep.relaxation as f32, sweep.momentum as f32);
            let e = &*self.e;
            in_chunks(&mut self.spare, |first, previous| {
                relax_sweep::run(first, &rows, relaxation, momentum, e, previous);
            });
            mem::swap(&mut self.e, &mut self.spare);
        }
    }
}

impl PackedTransfer {
    fn new(transfer: &Transfer) -> Self {
        Self {
            row_start: transfer.sources.row_start.clone(),
            columns: transfer.sources.entries.clone(),
            weights: transfer.weights.iter().map(|&weight| weight as f32).collect(),
        }
    }

    /// See [`transfer::run`].
    fn run(&self, constraint: &[[f32; 4]], keep: f32, source: &[[f32; 4]], target: &mut [[f32; 4]]) {
        let weights = Weights { row_start: &self.row_start, columns: &self.columns, weights: &self.weights };
        in_chunks(target, |first, target| transfer::run(first, &weights, constraint, keep, source, target));
    }
}
