//! A hierarchy of networks on a GPU whose load and correction are in f64, with cycles in f32: what
//! the CPU computes in f64, with the same operations in the same order.

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use wgpu::{BindGroup, Buffer, BufferUsages};

use super::commands::Commands;
use super::device::Device;
use super::levels::{BATCH, Levels, Start, measures, uniform, vector};
use super::network::{SLOT, slots};
use super::pipeline::{Pipeline, Window};
use crate::backend::packed::Packed;
use crate::backend::{BackendError, DeviceNetwork, LevelData, Measure, Sweep};
use crate::constraint::Constraint;
use crate::kernels::accelerate_double::LARGEST;
use crate::kernels::convergence::BLOCK;
use crate::kernels::{OfDoubleKernels, accelerate_double, hand_over};

/// Bytes of a vertex's constraint or load, of which a kernel sees those of a chunk.
const ROW: u64 = 32;

/// Bytes of a vertex's correction, of which a kernel sees all.
const CORRECTION: u64 = 24;

/// A hierarchy in the GPU's memory.
pub(super) struct GpuDoubleHierarchy {
    device: Arc<Device>,
    finest: Packed<f64>,
    levels: Levels,
    constraint: Buffer,
    load: Buffer,
    /// The correction, and the correction one cycle earlier. `current` is the index of the
    /// correction.
    e: [Buffer; 2],
    current: usize,
    /// Whether the correction is zero everywhere.
    is_zero: bool,
    /// Whether the pass begins, and the corrections have to become zero.
    begins: bool,
    chunks: Vec<Chunk>,
    /// Largest changes `[BATCH][blocks]`.
    partials: Buffer,
    /// Parameters of the last step of each cycle of a batch `[BATCH][chunks]`, one slot each.
    end_params: Buffer,
    staging: Buffer,
}

/// A chunk of the finest level's rows, whose arrays fit one binding.
struct Chunk {
    rows: Range<usize>,
    /// Bindings for either index of the correction.
    hand_over: [BindGroup; 2],
    accelerate: [BindGroup; 2],
}

impl GpuDoubleHierarchy {
    pub(super) fn new(device: Arc<Device>, levels: &[LevelData]) -> Result<Self, BackendError> {
        let of_device = Arc::clone(&device);
        of_device.guarded(|| Self::allocate(device, levels))
    }

    fn allocate(device: Arc<Device>, data: &[LevelData]) -> Result<Self, BackendError> {
        let mut finest = Packed::<f64>::new(&data[0].network);
        let n_vertices = finest.n_vertices();
        let bytes = CORRECTION * n_vertices as u64;
        device.fits(bytes, device.max_array)?;
        let levels = Levels::new(&device, data, Start::Zero, ROW)?;
        let kernels = kernels(&device)?;
        let rows = finest.rows();
        let constraint = device.filled("constraint", rows.constraint);
        let load = device.filled("load", rows.load);
        let inverse_length = device.filled("inverse_length", finest.inverse_length());
        let e = ["e", "e_previous"].map(|label| vector(&device, label, bytes));
        let of_changes = (8 * BATCH * n_vertices.div_ceil(BLOCK)) as u64;
        let partials = vector(&device, "partials", of_changes);
        let n_chunks = levels.springs.chunks.len();
        let end_params = uniform(&device, BATCH * n_chunks);
        let chunk = |(range, [row_start, entries]): &(Range<usize>, [Buffer; 2])| {
            let window = |buffer| Window { buffer, first: ROW * range.start as u64, bytes: ROW * range.len() as u64 };
            let windows = [("constraint", window(&constraint)), ("load", window(&load))];
            let entries_of = rows.row_start[range.start] as usize..rows.row_start[range.end] as usize;
            let stiffness = device.filled("stiffness", &rows.stiffness[entries_of]);
            let params = uniform(&device, 2);
            let of_chunk = |is_zero| hand_over::Params {
                first_row: range.start as u32,
                n_rows: range.len() as u32,
                is_zero,
                padding: 0,
            };
            device.write(&params, &slots([0, 1].map(of_chunk).into_iter()));
            let bind = |pipeline: &Pipeline, params, current: usize| {
                let of_finest = levels.finest();
                let buffers = [
                    ("params", params),
                    ("row_start", row_start),
                    ("entries", entries),
                    ("stiffness", &stiffness),
                    ("e", &e[current]),
                    ("e_previous", &e[1 - current]),
                    ("handed", &of_finest.load),
                    ("of_cycle", &of_finest.e[of_finest.ends_in]),
                    ("inverse_length", &inverse_length),
                    ("partials", &partials),
                ];
                device.bind_windows(pipeline, &buffers, &windows)
            };
            Chunk {
                rows: range.clone(),
                hand_over: [0, 1].map(|current| bind(&kernels.hand_over, &params, current)),
                accelerate: [0, 1].map(|current| bind(&kernels.accelerate_double, &end_params, current)),
            }
        };
        let chunks = levels.springs.chunks.iter().map(chunk).collect();
        finest.forget_stiffness();
        let staging = device.buffer("staging", bytes.max(of_changes), BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        let (is_zero, begins) = (true, true);
        Ok(Self {
            finest,
            levels,
            constraint,
            load,
            e,
            current: 0,
            is_zero,
            begins,
            chunks,
            partials,
            end_params,
            staging,
            device,
        })
    }

    /// Commands for a submission, first those that begin a pass.
    fn encoder(&mut self) -> Commands {
        let mut encoder = self.device.encoder();
        if std::mem::take(&mut self.begins) {
            self.e.iter().for_each(|e| self.device.clear(&mut encoder, e));
        }
        encoder
    }

    /// Runs at most [`BATCH`] cycles. Returns the change by each.
    fn run(&mut self, sweeps: &[Sweep]) -> Result<Vec<f64>, BackendError> {
        let device = Arc::clone(&self.device);
        let n_blocks = self.finest.n_vertices().div_ceil(BLOCK);
        let partials: Vec<f64> = device.guarded(|| {
            let mut encoder = self.encoder();
            let of_cycle = |(cycle, sweep): (usize, &Sweep)| {
                let (relaxation, momentum) = (sweep.relaxation, sweep.momentum);
                let of_chunk = move |chunk: &Chunk| accelerate_double::Params {
                    first_row: chunk.rows.start as u32,
                    n_rows: chunk.rows.len() as u32,
                    first_partial: (cycle * n_blocks) as u32,
                    padding: 0,
                    relaxation,
                    momentum,
                };
                self.chunks.iter().map(of_chunk)
            };
            device.write(&self.end_params, &slots(sweeps.iter().enumerate().flat_map(of_cycle)));
            for cycle in 0..sweeps.len() {
                self.record(cycle, &mut encoder)?;
                self.current = 1 - self.current;
                self.is_zero = false;
            }
            device.read(encoder, &self.partials, &self.staging, sweeps.len() * n_blocks)
        })?;
        let greatest = |of_cycle: &[f64]| of_cycle.iter().copied().fold(0.0, f64::max);
        let change = |largest| if largest >= LARGEST { f64::NAN } else { self.finest.change(largest) };
        Ok(partials.chunks(n_blocks.max(1)).map(|of_cycle| change(greatest(of_cycle))).collect())
    }

    /// Records a cycle of a batch.
    fn record(&self, cycle: usize, encoder: &mut Commands) -> Result<(), BackendError> {
        let Self { device, chunks, current, .. } = self;
        let kernels = kernels(device)?;
        let mut pass = encoder.pass();
        for chunk in chunks {
            let bound = (&chunk.hand_over[*current], (usize::from(self.is_zero) * SLOT) as u32);
            device.dispatch(&mut pass, &kernels.hand_over, bound, chunk.rows.len());
        }
        drop(pass);
        self.levels.record_cycle(device, encoder);
        let mut pass = encoder.pass();
        for (at, chunk) in chunks.iter().enumerate() {
            let bound = (&chunk.accelerate[*current], ((cycle * chunks.len() + at) * SLOT) as u32);
            device.dispatch(&mut pass, &kernels.accelerate_double, bound, chunk.rows.len());
        }
        Ok(())
    }
}

/// The device's kernels in f64.
fn kernels(device: &Device) -> Result<&OfDoubleKernels<Pipeline>, BackendError> {
    device.double_pipelines.as_ref().ok_or_else(|| device.error("the device does not compute in f64"))
}

impl DeviceNetwork for GpuDoubleHierarchy {
    fn epsilon(&self) -> f64 {
        f64::EPSILON
    }

    fn constrain(&mut self, constraint: &[Constraint]) -> Result<(), BackendError> {
        let device = Arc::clone(&self.device);
        device.guarded(|| {
            self.finest.constrain(&constraint[..self.finest.n_vertices()]);
            device.write(&self.constraint, self.finest.rows().constraint);
            self.levels.constrain(&device, constraint);
            Ok(())
        })
    }

    fn start(&mut self, load: &[DVec3]) -> Result<(), BackendError> {
        self.finest.start(load);
        (self.is_zero, self.begins) = (true, true);
        self.device.guarded(|| {
            self.device.write(&self.load, self.finest.rows().load);
            Ok(())
        })
    }

    fn sweep(&mut self, sweeps: &[Sweep]) -> Result<Measure, BackendError> {
        Ok(self.sweep_batches(&[sweeps.to_vec()])?[0])
    }

    fn most_batches(&self) -> usize {
        BATCH
    }

    fn sweep_batches(&mut self, batches: &[Vec<Sweep>]) -> Result<Vec<Measure>, BackendError> {
        measures(batches, |cycles| self.run(cycles))
    }

    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError> {
        let device = Arc::clone(&self.device);
        let encoder = self.encoder();
        let n_vertices = self.finest.n_vertices();
        let e: Vec<[f64; 3]> =
            device.guarded(|| device.read(encoder, &self.e[self.current], &self.staging, n_vertices))?;
        Ok(self.finest.correction(&e))
    }
}
