//! The levels of a hierarchy of networks in a GPU's memory, in f32, and the multigrid cycle over
//! them.
//!
//! The dispatches of a cycle never change, so they are bound, and their parameters written, once.

use std::ops::Range;

use bytemuck::NoUninit;
use wgpu::{BindGroup, Buffer, BufferUsages};

use super::coarse::{Coarse, Joined};
use super::commands::Commands;
use super::device::Device;
use super::network::{SLOT, matrix, plan, slots};
use super::pipeline::Pipeline;
use crate::backend::packed::Packed;
use crate::backend::{BackendError, LevelData, Measure, Sweep, Transfer};
use crate::constraint::Constraint;
use crate::kernels::{defect, first_sweep, relax_sweep, restrict_sweep, transfer};

/// Cycles in one submission. Their sweeps over the finest network are about as many as in a batch
/// of sweeps.
pub(super) const BATCH: usize = 16;

/// The levels, finest first.
pub(super) struct Levels {
    /// Those with dispatches of their own.
    levels: Vec<Level>,
    coarse: Option<Coarse>,
    /// The springs of the finest level.
    pub(super) springs: Chunks,
}

struct Level {
    arrays: Arrays,
    /// The way down: sweeps, the defect, and its transfer to the coarser level, unless
    /// [`Levels::coarse`] has that. On the coarsest level only sweeps.
    down: Vec<Dispatch>,
    /// The way up: the transfer from the coarser level, and sweeps.
    up: Vec<Dispatch>,
}

/// The arrays of a level. A cycle's correction begins in the first `e`.
pub(super) struct Arrays {
    pub(super) packed: Packed<f32>,
    pub(super) constraint: Buffer,
    pub(super) load: Buffer,
    /// The correction, and the correction one sweep earlier, which also holds the defect. Sweeps
    /// exchange the two arrays.
    pub(super) e: [Buffer; 2],
    /// Index of the array with the correction after a cycle.
    pub(super) ends_in: usize,
    /// Factor of the first sweep from zero.
    first_relaxation: f32,
    /// Index of the array with the defect before the transfer to the coarser level.
    defect_in: usize,
}

/// A kernel over a chunk of rows, with all its bindings.
struct Dispatch {
    kernel: Kernel,
    n_rows: usize,
    bound: BindGroup,
}

#[derive(Clone, Copy)]
enum Kernel {
    FirstSweep,
    RelaxSweep,
    Defect,
    RestrictSweep,
    Transfer,
}

/// Where the sweeps of a level begin.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Start {
    /// At the correction in the first `e`.
    Correction,
    /// At zero.
    Zero,
    /// At the first sweep from zero, which the transfer to the level's load takes too. So begin all
    /// levels but the finest.
    Swept,
}

impl Levels {
    /// Brings the levels to the device.
    ///
    /// - `row_bytes`: most bytes of a row in an array of the finest level's rows
    pub(super) fn new(device: &Device, data: &[LevelData], start: Start, row_bytes: u64) -> Result<Self, BackendError> {
        let (n_single, joined) = Joined::new(device, data).map_or((data.len(), None), |(at, of)| (at, Some(of)));
        let data = &data[..n_single];
        let arrays = data.iter().map(|level| Arrays::new(device, level)).collect::<Result<Vec<_>, _>>()?;
        let springs = |at: usize, Arrays { packed, .. }: &Arrays| {
            let rows = packed.rows();
            Chunks::new(device, rows.row_start, rows.columns, rows.stiffness, if at == 0 { row_bytes } else { 4 })
        };
        let mut springs = arrays.iter().enumerate().map(|(at, of)| springs(at, of)).collect::<Result<Vec<_>, _>>()?;
        let above = &arrays[n_single - 1];
        let coarse = joined.map(|joined| Coarse::new(device, joined, &above.e[above.defect_in]));
        let paths = (0..n_single)
            .map(|at| {
                let start = if at == 0 { start } else { Start::Swept };
                let coarser = arrays.get(at + 1).map(Coarser::Single).or(coarse.as_ref().map(Coarser::Joined));
                dispatches(device, &data[at], start, &springs[at], &arrays[at], coarser)
            })
            .collect::<Result<Vec<_>, _>>()?;
        let levels = arrays.into_iter().zip(paths).map(|(arrays, [down, up])| Level { arrays, down, up }).collect();
        Ok(Self { levels, coarse, springs: springs.swap_remove(0) })
    }

    /// Drops what the device has received.
    pub(super) fn forget_received(&mut self) {
        self.levels.iter_mut().for_each(|level| level.arrays.packed.forget_received());
    }

    pub(super) fn finest(&self) -> &Arrays {
        &self.levels[0].arrays
    }

    pub(super) fn finest_mut(&mut self) -> &mut Arrays {
        &mut self.levels[0].arrays
    }

    /// Replaces the constraints of all levels, one level after another.
    pub(super) fn constrain(&mut self, device: &Device, mut constraint: &[Constraint]) {
        for Level { arrays, .. } in &mut self.levels {
            let (own, coarser) = constraint.split_at(arrays.packed.n_vertices());
            arrays.packed.constrain(own);
            device.write(&arrays.constraint, arrays.packed.rows().constraint);
            arrays.packed.forget_received();
            constraint = coarser;
        }
        self.coarse.iter_mut().for_each(|coarse| coarse.constrain(device, constraint));
    }

    /// Records a cycle: the ways down of the levels, the coarse levels, and the ways up.
    pub(super) fn record_cycle(&self, device: &Device, encoder: &mut Commands) {
        self.levels.iter().for_each(|level| record_dispatches(device, &level.down, encoder));
        self.coarse.iter().for_each(|coarse| coarse.record(device, encoder));
        self.levels.iter().rev().for_each(|level| record_dispatches(device, &level.up, encoder));
    }
}

fn record_dispatches(device: &Device, dispatches: &[Dispatch], encoder: &mut Commands) {
    if dispatches.is_empty() {
        return;
    }
    let mut pass = encoder.pass();
    for Dispatch { kernel, n_rows, bound } in dispatches {
        device.dispatch(&mut pass, kernel.pipeline(device), (bound, 0), *n_rows);
    }
}

/// Runs batches of cycles, at most [`BATCH`] cycles in a submission.
///
/// - `run`: runs cycles, and returns the change by each
pub(super) fn measures(
    batches: &[Vec<Sweep>],
    mut run: impl FnMut(&[Sweep]) -> Result<Vec<f64>, BackendError>,
) -> Result<Vec<Measure>, BackendError> {
    let mut changes = Vec::new();
    for cycles in batches.concat().chunks(BATCH) {
        changes.extend(run(cycles)?);
    }
    let ends = batches.iter().scan(0, |end: &mut usize, batch| {
        *end += batch.len();
        Some(*end)
    });
    let change = |end: usize| end.checked_sub(1).map_or(0.0, |last| changes[last]);
    Ok(ends.map(|end| Measure { change: change(end), residual: f64::NAN }).collect())
}

impl Arrays {
    fn new(device: &Device, level: &LevelData) -> Result<Self, BackendError> {
        let packed = Packed::new(&level.network);
        let bytes = 16 * packed.n_vertices() as u64;
        device.fits(bytes, device.max_array)?;
        let rows = packed.rows();
        Ok(Self {
            constraint: device.filled("constraint", rows.constraint),
            load: device.filled("load", rows.load),
            e: ["e", "e_previous"].map(|label| vector(device, label, bytes)),
            // The numbers of sweeps on the way up and down are equal, so the arrays are exchanged
            // an even number of times.
            ends_in: if level.transfers.is_some() { 0 } else { level.sweeps.len() % 2 },
            // The first sweep sets `e` to zero, even where a level has no sweeps.
            first_relaxation: level.sweeps.first().map_or(0.0, |sweep| sweep.relaxation as f32),
            defect_in: 1 - level.sweeps.len() % 2,
            packed,
        })
    }
}

/// The coarser level.
#[derive(Clone, Copy)]
enum Coarser<'a> {
    Single(&'a Arrays),
    /// The first of the coarse levels, whose kernel transfers the defect itself.
    Joined(&'a Coarse),
}

impl Coarser<'_> {
    /// The array with the correction after a cycle.
    fn correction(&self) -> &Buffer {
        match self {
            Self::Single(arrays) => &arrays.e[arrays.ends_in],
            Self::Joined(coarse) => &coarse.e,
        }
    }
}

/// The way down and the way up of a level.
fn dispatches(
    device: &Device,
    level: &LevelData,
    start: Start,
    springs: &Chunks,
    arrays: &Arrays,
    coarser: Option<Coarser>,
) -> Result<[Vec<Dispatch>; 2], BackendError> {
    let Arrays { constraint, load, e, .. } = arrays;
    let first = || {
        let params = |range: &Range<usize>| first_sweep::Params {
            first_row: range.start as u32,
            n_rows: range.len() as u32,
            relaxation: arrays.first_relaxation,
            padding: 0,
        };
        let buffers = [("constraint", constraint), ("load", load), ("e", &e[0]), ("e_previous", &e[1])];
        springs.dispatches(device, Kernel::FirstSweep, params, &buffers)
    };
    let sweep = |sweep: &Sweep, current: usize| {
        let params = |range: &Range<usize>| relax_sweep::Params {
            first_row: range.start as u32,
            n_rows: range.len() as u32,
            relaxation: sweep.relaxation as f32,
            momentum: sweep.momentum as f32,
        };
        let buffers = [("constraint", constraint), ("load", load), ("e", &e[current]), ("e_previous", &e[1 - current])];
        springs.dispatches(device, Kernel::RelaxSweep, params, &buffers)
    };
    let mut current = 0;
    let mut sweeps = |start: Start| {
        let mut all = Vec::new();
        if start == Start::Zero {
            all.extend(first());
        }
        for (at, factors) in level.sweeps.iter().enumerate() {
            if at > 0 || start == Start::Correction {
                all.extend(sweep(factors, current));
            }
            current = 1 - current;
        }
        (all, current)
    };
    let (mut down, middle) = sweeps(start);
    let (Some([restriction, prolongation]), Some(coarser)) = (level.transfers, coarser) else {
        return Ok([down, Vec::new()]);
    };
    let [correction, defect] = [&e[middle], &e[arrays.defect_in]];
    let params = |range: &Range<usize>| defect::Params { first_row: range.start as u32, n_rows: range.len() as u32 };
    let buffers = [("constraint", constraint), ("load", load), ("e", correction), ("rest", defect)];
    down.extend(springs.dispatches(device, Kernel::Defect, params, &buffers));
    if let Coarser::Single(coarser) = coarser {
        let params = |range: &Range<usize>| restrict_sweep::Params {
            first_row: range.start as u32,
            n_rows: range.len() as u32,
            relaxation: coarser.first_relaxation,
            padding: 0,
        };
        let [e, e_previous] = &coarser.e;
        let of_coarser =
            [("constraint", &coarser.constraint), ("load", &coarser.load), ("e", e), ("e_previous", e_previous)];
        let buffers = [&[("source", defect)], &of_coarser[..]].concat();
        let chunks = Chunks::of_transfer(device, restriction)?;
        down.extend(chunks.dispatches(device, Kernel::RestrictSweep, params, &buffers));
    }
    let params = |range: &Range<usize>| transfer::Params {
        first_row: range.start as u32,
        n_rows: range.len() as u32,
        keep: 1.0,
        padding: 0,
    };
    let buffers = [("constraint", constraint), ("source", coarser.correction()), ("gathered", correction)];
    let mut up = Chunks::of_transfer(device, prolongation)?.dispatches(device, Kernel::Transfer, params, &buffers);
    up.extend(sweeps(Start::Correction).0);
    Ok([down, up])
}

/// A matrix, or the weights of a transfer, in chunks of rows that fit one binding.
pub(super) struct Chunks {
    /// The rows of each chunk, their starts and their entries.
    pub(super) chunks: Vec<(Range<usize>, [Buffer; 2])>,
}

impl Chunks {
    fn new(
        device: &Device,
        row_start: &[u32],
        columns: &[u32],
        values: &[f32],
        row_bytes: u64,
    ) -> Result<Self, BackendError> {
        device.rows_fit(row_start, 1, "vertex")?;
        let with_buffers = |range| {
            let buffers = matrix(device, row_start, columns, values, &range);
            (range, buffers)
        };
        Ok(Self { chunks: plan(row_start, row_bytes, device)?.into_iter().map(with_buffers).collect() })
    }

    fn of_transfer(device: &Device, transfer: &Transfer) -> Result<Self, BackendError> {
        let weights: Vec<f32> = transfer.weights.iter().map(|&weight| weight as f32).collect();
        Self::new(device, &transfer.sources.row_start, &transfer.sources.entries, &weights, 4)
    }

    /// One dispatch of a kernel per chunk.
    fn dispatches<P: NoUninit>(
        &self,
        device: &Device,
        kernel: Kernel,
        params: impl Fn(&Range<usize>) -> P,
        buffers: &[(&str, &Buffer)],
    ) -> Vec<Dispatch> {
        let dispatch = |(range, [row_start, entries]): &(Range<usize>, [Buffer; 2])| {
            let own = uniform(device, 1);
            device.write(&own, &slots([params(range)].into_iter()));
            let mut all = vec![("params", &own), ("row_start", row_start), ("entries", entries), ("weights", entries)];
            all.extend_from_slice(buffers);
            Dispatch { kernel, n_rows: range.len(), bound: device.bind(kernel.pipeline(device), &all) }
        };
        self.chunks.iter().map(dispatch).collect()
    }
}

impl Kernel {
    fn pipeline(self, device: &Device) -> &Pipeline {
        match self {
            Self::FirstSweep => &device.pipelines.first_sweep,
            Self::RelaxSweep => &device.pipelines.relax_sweep,
            Self::Defect => &device.pipelines.defect,
            Self::RestrictSweep => &device.pipelines.restrict_sweep,
            Self::Transfer => &device.pipelines.transfer,
        }
    }
}

pub(super) fn vector(device: &Device, label: &str, bytes: u64) -> Buffer {
    device.buffer(label, bytes, BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC)
}

/// A buffer for the parameters of `n` dispatches.
pub(super) fn uniform(device: &Device, n: usize) -> Buffer {
    device.buffer("parameters", (n * SLOT) as u64, BufferUsages::UNIFORM | BufferUsages::COPY_DST)
}
