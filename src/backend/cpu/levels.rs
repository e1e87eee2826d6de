//! The levels of a hierarchy of networks in the CPU's memory, in f32. Multigrid cycles are made of
//! the twins.
//!
//! A cycle serves one or several designs: the springs are those of the mesh, the vectors have the
//! components of all designs. See [`Rows`](crate::kernels::row::Rows) for their number `N`.

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
    /// The level's network, without a load.
    pub(super) packed: Packed<f32>,
    sweeps: Vec<Sweep>,
    /// The transfers to the load of the coarser level, and back.
    transfers: Option<[PackedTransfer; 2]>,
}

/// The vectors of a level.
pub(super) struct LevelVectors<const N: usize> {
    pub(super) load: Vectors<f32, N>,
    /// The correction.
    pub(super) e: Vectors<f32, N>,
    /// The correction one sweep earlier; also the defect.
    spare: Vectors<f32, N>,
}

struct PackedTransfer {
    row_start: Vec<u32>,
    columns: Vec<u32>,
    weights: Vec<f32>,
}

/// Makes the levels, finest first.
pub(super) fn levels(levels: &[LevelData]) -> Vec<Level> {
    let level = |level: &LevelData| {
        let mut packed = Packed::new(&level.network);
        packed.forget_load();
        let transfers = level.transfers.map(|both| both.map(PackedTransfer::new));
        Level { packed, sweeps: level.sweeps.to_vec(), transfers }
    };
    levels.iter().map(level).collect()
}

/// Vectors of zeros for these levels.
pub(super) fn vectors<const N: usize>(levels: &[Level]) -> Vec<LevelVectors<N>> {
    let of_level = |Level { packed, .. }: &Level| {
        let zero = || Vectors::zero(packed.n_vertices());
        LevelVectors { load: packed.no_load(), e: zero(), spare: zero() }
    };
    levels.iter().map(of_level).collect()
}

impl<const N: usize> LevelVectors<N> {
    /// Sets the correction to zero. What a pass that diverged has left would outlive a factor of 0.
    pub(super) fn clear(&mut self) {
        self.e.fill([0.0; N]);
        self.spare.fill([0.0; N]);
    }
}

/// Replaces the constraints of all levels.
///
/// - `constraint`: constraints of the levels, one level after another
pub(super) fn constrain(levels: &mut [Level], mut constraint: &[Constraint]) {
    for level in levels {
        let (own, coarser) = constraint.split_at(level.packed.n_vertices());
        level.packed.constrain(own);
        constraint = coarser;
    }
}

/// Replaces the correction of the finest of these levels by its correction after one cycle.
pub(super) fn cycle<const N: usize>(levels: &[Level], vectors: &mut [LevelVectors<N>]) {
    if let (Some(level), Some(own)) = (levels.first(), vectors.first_mut()) {
        level.smooth(own);
        correct(levels, vectors);
    }
}

/// [`cycle`] with a start correction of zero.
pub(super) fn cycle_from_zero<const N: usize>(levels: &[Level], vectors: &mut [LevelVectors<N>]) {
    if let (Some(level), Some(own)) = (levels.first(), vectors.first_mut()) {
        level.smooth_from_zero(own);
        correct(levels, vectors);
    }
}

/// The part of a cycle after a level's first sweeps: the coarser level's correction, and the sweeps
/// again.
fn correct<const N: usize>(levels: &[Level], vectors: &mut [LevelVectors<N>]) {
    let ([level, coarser @ ..], [own, of_coarser @ ..]) = (levels, vectors) else { return };
    let (Some([restriction, prolongation]), Some(next), Some(of_next)) =
        (&level.transfers, coarser.first(), of_coarser.first_mut())
    else {
        return;
    };
    let LevelVectors { load, e, spare } = &mut *own;
    let (rows, now) = (level.packed.rows_of(load), &**e);
    in_chunks(spare, |first, out| defect::run(first, &rows, now, out));
    restriction.run(next.packed.constraint(), 0.0, spare, &mut of_next.load);
    cycle_from_zero(coarser, of_coarser);
    prolongation.run(rows.constraint, 1.0, &of_coarser[0].e, e);
    level.smooth(own);
}

impl Level {
    fn smooth<const N: usize>(&self, vectors: &mut LevelVectors<N>) {
        self.sweep_from(0, vectors);
    }

    /// The first sweep from a correction of zero takes a share of the load and reads no spring.
    fn smooth_from_zero<const N: usize>(&self, vectors: &mut LevelVectors<N>) {
        let LevelVectors { load, e, spare } = &mut *vectors;
        let rows = self.packed.rows_of(load);
        let relaxation = self.sweeps.first().map_or(0.0, |sweep| sweep.relaxation as f32);
        in_chunks(e, |first, e| first_sweep::run(first, &rows, relaxation, e));
        in_chunks(spare, |_, previous| previous.fill([0.0; N]));
        self.sweep_from(1, vectors);
    }

    fn sweep_from<const N: usize>(&self, first_sweep: usize, vectors: &mut LevelVectors<N>) {
        let LevelVectors { load, e, spare } = vectors;
        let rows = self.packed.rows_of(load);
        for sweep in self.sweeps.iter().skip(first_sweep) {
            let (relaxation, momentum) = (sweep.relaxation as f32, sweep.momentum as f32);
            let now = &**e;
            in_chunks(spare, |first, previous| {
                relax_sweep::run(first, &rows, relaxation, momentum, now, previous);
            });
            mem::swap(e, spare);
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
    fn run<const N: usize>(&self, constraint: &[[f32; 4]], keep: f32, source: &[[f32; N]], target: &mut [[f32; N]]) {
        let weights = Weights { row_start: &self.row_start, columns: &self.columns, weights: &self.weights };
        in_chunks(target, |first, target| transfer::run(first, &weights, constraint, keep, source, target));
    }
}
