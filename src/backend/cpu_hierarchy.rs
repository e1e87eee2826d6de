//! A hierarchy of networks in the CPU's memory: multigrid cycles out of the twins.

use std::mem;

use glam::DVec3;
use rayon::prelude::*;

use super::cpu::{CHUNK, SERIAL};
use super::packed::Packed;
use super::vectors::Vectors;
use super::{BackendError, Constraint, DeviceNetwork, LevelData, Measure, Sweep, Transfer};
use crate::kernels::convergence::BLOCK;
use crate::kernels::transfer::Weights;
use crate::kernels::{Real, accelerate, defect, relax_sweep, transfer};

/// A hierarchy in the CPU's memory, finest level first.
pub(super) struct CpuHierarchy<T> {
    levels: Vec<Level<T>>,
    /// The finest level's correction before the cycle, and one cycle earlier.
    start: Vectors<T>,
    previous: Vectors<T>,
    largest: Vec<T>,
}

struct Level<T> {
    packed: Packed<T>,
    sweeps: Vec<Sweep>,
    /// To the load of the coarser level, and back.
    transfers: Option<[PackedTransfer<T>; 2]>,
    e: Vectors<T>,
    /// The correction a sweep earlier; also the defect.
    spare: Vectors<T>,
}

struct PackedTransfer<T> {
    row_start: Vec<u32>,
    columns: Vec<u32>,
    weights: Vec<T>,
}

impl<T: Real> CpuHierarchy<T> {
    pub(super) fn new(levels: &[LevelData]) -> Self {
        let levels: Vec<Level<T>> = levels
            .iter()
            .map(|level| {
                let packed = Packed::new(&level.network);
                Level {
                    sweeps: level.sweeps.to_vec(),
                    transfers: level.transfers.map(|both| both.map(PackedTransfer::new)),
                    spare: Vectors::zero(packed.n_vertices()),
                    e: Vectors::zero(packed.n_vertices()),
                    packed,
                }
            })
            .collect();
        let n_vertices = levels[0].e.len();
        let zero = || Vectors::zero(n_vertices);
        Self { levels, start: zero(), previous: zero(), largest: vec![T::ZERO; n_vertices.div_ceil(BLOCK)] }
    }
}

impl<T: Real> PackedTransfer<T> {
    fn new(transfer: &Transfer) -> Self {
        Self {
            row_start: transfer.sources.row_start.clone(),
            columns: transfer.sources.entries.clone(),
            weights: transfer.weights.iter().map(|&weight| T::from_f64(weight)).collect(),
        }
    }

    /// See [`transfer::run`].
    fn run(&self, constraint: &[[T; 4]], keep: T, source: &[[T; 4]], target: &mut [[T; 4]]) {
        let weights = Weights { row_start: &self.row_start, columns: &self.columns, weights: &self.weights };
        in_chunks(target, |first, target| transfer::run(first, &weights, constraint, keep, source, target));
    }
}

impl<T: Real> Level<T> {
    fn smooth(&mut self) {
        let rows = self.packed.rows();
        for sweep in &self.sweeps {
            let (relaxation, momentum) = (T::from_f64(sweep.relaxation), T::from_f64(sweep.momentum));
            let e = &*self.e;
            in_chunks(&mut self.spare, |first, previous| {
                relax_sweep::run(first, &rows, relaxation, momentum, e, previous);
            });
            mem::swap(&mut self.e, &mut self.spare);
        }
    }
}

/// The correction of the finest of these levels after one cycle, from the correction and load that stand in it.
fn cycle<T: Real>(levels: &mut [Level<T>]) {
    let [level, coarser @ ..] = levels else { return };
    level.smooth();
    let (Some([restriction, prolongation]), Some(next)) = (&level.transfers, coarser.first_mut()) else { return };
    let rows = level.packed.rows();
    let e = &*level.e;
    in_chunks(&mut level.spare, |first, out| defect::run(first, &rows, e, out));
    let (constraint, load) = next.packed.constraint_and_load();
    restriction.run(constraint, T::ZERO, &level.spare, load);
    next.e.fill([T::ZERO; 4]);
    cycle(coarser);
    prolongation.run(rows.constraint, T::ONE, &coarser[0].e, &mut level.e);
    level.smooth();
}

impl<T: Real> DeviceNetwork for CpuHierarchy<T> {
    fn constrain(&mut self, mut constraint: &[Constraint]) -> Result<(), BackendError> {
        for level in &mut self.levels {
            let (own, coarser) = constraint.split_at(level.e.len());
            level.packed.constrain(own);
            constraint = coarser;
        }
        Ok(())
    }

    fn start(&mut self, load: &[DVec3]) -> Result<(), BackendError> {
        let finest = &mut self.levels[0];
        finest.packed.start(load);
        finest.e.fill([T::ZERO; 4]);
        self.previous.fill([T::ZERO; 4]);
        Ok(())
    }

    fn sweep(&mut self, sweeps: &[Sweep]) -> Result<Measure, BackendError> {
        let mut change = 0.0;
        for sweep in sweeps {
            self.start.copy_from_slice(&self.levels[0].e);
            cycle(&mut self.levels);
            let Level { packed, e, .. } = &mut self.levels[0];
            let factors = [sweep.relaxation, sweep.momentum].map(T::from_f64);
            let (constraint, inverse_length) = (packed.rows().constraint, packed.inverse_length());
            let (start, previous) = (&*self.start, &*self.previous);
            let chunks = e.par_chunks_mut(CHUNK).zip(self.largest.par_chunks_mut(CHUNK / BLOCK)).enumerate();
            chunks.for_each(|(chunk, (e, largest))| {
                let rows = chunk * CHUNK..chunk * CHUNK + e.len();
                let [start, previous, constraint] = [start, previous, constraint].map(|of| &of[rows.clone()]);
                accelerate::run(factors, constraint, start, previous, &inverse_length[rows], e, largest);
            });
            mem::swap(&mut self.start, &mut self.previous);
            let largest = self.largest.iter().fold(T::ZERO, |largest, &block| largest.max_magnitude(block));
            change = packed.change(largest.to_f64());
        }
        Ok(Measure { change, residual: f64::NAN })
    }

    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError> {
        let finest = &self.levels[0];
        Ok(finest.packed.correction(&finest.e))
    }
}

/// Chunks of an array in parallel, each with the place of its first element; small arrays on the calling thread.
fn in_chunks<T: Send>(array: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
    if array.len() <= SERIAL {
        work(0, array);
    } else {
        array.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, array)| work(chunk * CHUNK, array));
    }
}
