//! A hierarchy of networks on a GPU whose load and correction are in f64, with cycles in f32: what
//! the CPU computes in f64, with the same operations in the same order.

use std::any::Any;
use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use wgpu::{BindGroup, Buffer, BufferUsages};

use super::commands::Commands;
use super::device::Device;
use super::levels::{BATCH, Levels, Start, measures, uniform, vector};
use super::network::{SLOT, slots};
use super::pipeline::{Pipeline, Window};
use super::residency::{Begin, OfHierarchy, Residency};
use crate::backend::packed::Packed;
use crate::backend::{BackendError, DeviceNetwork, EndOfPass, LevelData, Measure, Resident, Surroundings, Sweep};
use crate::constraint::Constraint;
use crate::kernels::convergence::BLOCK;
use crate::kernels::figures::finite_or_nan;
use crate::kernels::{OfDoubleKernels, accelerate_double, figures, hand_over};

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
    inverse_length: Buffer,
    chunks: Vec<Chunk>,
    /// Largest change of each cycle of a batch, from those of its blocks.
    figures: BindGroup,
    /// Largest changes, and their sums `[BATCH]`.
    changes: Buffer,
    /// Parameters of the last step of each cycle of a batch `[BATCH][chunks]`, one slot each.
    end_params: Buffer,
    staging: Buffer,
    residency: Option<Residency>,
    /// How the present relaxation began, if its values stay on the device, and whether this is
    /// still to be done.
    begin: Option<Begin>,
    begins_relaxation: bool,
}

/// A chunk of the finest level's rows, whose arrays fit one binding.
struct Chunk {
    rows: Range<usize>,
    stiffness: Buffer,
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
        let mut levels = Levels::new(&device, data, Start::Zero, ROW)?;
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
                stiffness: stiffness.clone(),
                hand_over: [0, 1].map(|current| bind(&kernels.hand_over, &params, current)),
                accelerate: [0, 1].map(|current| bind(&kernels.accelerate_double, &end_params, current)),
            }
        };
        let chunks = levels.springs.chunks.iter().map(chunk).collect();
        finest.forget_received();
        levels.forget_received();
        let changes = vector(&device, "changes", 16 * BATCH as u64);
        let figure_params = uniform(&device, 1);
        let length = n_vertices.div_ceil(BLOCK) as u32;
        let lists = figures::Params { n_lists: BATCH as u32, length, first: 0, padding: 0 };
        device.write(&figure_params, &slots([lists].into_iter()));
        let buffers = [("params", &figure_params), ("partials", &partials), ("figures_of", &changes)];
        let figures = device.bind(&kernels.figures, &buffers);
        let staging =
            device.buffer("staging", bytes.max(16 * BATCH as u64), BufferUsages::MAP_READ | BufferUsages::COPY_DST);
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
            inverse_length,
            chunks,
            figures,
            changes,
            end_params,
            staging,
            residency: None,
            begin: None,
            begins_relaxation: false,
            device,
        })
    }

    /// Commands for a submission, first those that begin a pass.
    fn encoder(&mut self) -> Result<Commands, BackendError> {
        let mut encoder = self.device.encoder();
        if std::mem::take(&mut self.begins) {
            self.e.iter().for_each(|e| self.device.clear(&mut encoder, e));
        }
        if std::mem::take(&mut self.begins_relaxation)
            && let (Some(residency), Some(begin)) = (&self.residency, self.begin)
        {
            residency.record_begin(&self.device, kernels(&self.device)?, begin, &mut encoder);
        }
        Ok(encoder)
    }

    /// Runs work with the arrays that a residency shares.
    fn with_arrays<R>(&self, work: impl FnOnce(OfHierarchy) -> R) -> Result<R, BackendError> {
        let Self { device, levels, chunks, constraint, load, inverse_length, e, .. } = self;
        let of_chunk = |(chunk, (range, [row_start, entries])): (&Chunk, &(Range<usize>, [Buffer; 2]))| {
            (range.clone(), [row_start, entries, &chunk.stiffness].map(Buffer::clone))
        };
        let chunks: Vec<_> = chunks.iter().zip(&levels.springs.chunks).map(of_chunk).collect();
        let kernels = kernels(device)?;
        Ok(work(OfHierarchy { chunks: &chunks, constraint, load, inverse_length, e, kernels }))
    }

    /// Runs at most [`BATCH`] cycles. Returns the change by each.
    fn run(&mut self, sweeps: &[Sweep]) -> Result<Vec<f64>, BackendError> {
        let device = Arc::clone(&self.device);
        let n_blocks = self.finest.n_vertices().div_ceil(BLOCK);
        let changes: Vec<[f64; 2]> = device.guarded(|| {
            let mut encoder = self.encoder()?;
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
            let mut pass = encoder.pass();
            device.dispatch(&mut pass, &kernels(&device)?.figures, (&self.figures, 0), BATCH * BLOCK);
            drop(pass);
            device.read(encoder, &self.changes, &self.staging, sweeps.len())
        })?;
        Ok(changes.iter().map(|[largest, _]| self.finest.change(finite_or_nan(*largest))).collect())
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
            self.finest.forget_received();
            self.levels.constrain(&device, constraint);
            Ok(())
        })
    }

    fn start(&mut self, load: &[DVec3]) -> Result<(), BackendError> {
        self.finest.start(load);
        self.begin = None;
        (self.is_zero, self.begins, self.begins_relaxation) = (true, true, false);
        self.device.guarded(|| {
            self.device.write(&self.load, self.finest.rows().load);
            self.finest.forget_received();
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

    fn reside(&mut self, around: &Surroundings) -> Result<bool, BackendError> {
        let device = Arc::clone(&self.device);
        self.residency = device.guarded(|| self.with_arrays(|of| Residency::new(&device, around, of))?)?;
        Ok(self.residency.is_some())
    }

    fn resident(&mut self) -> Option<&mut dyn Resident> {
        if self.residency.is_some() { Some(self) } else { None }
    }

    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError> {
        let device = Arc::clone(&self.device);
        let encoder = self.encoder()?;
        let n_vertices = self.finest.n_vertices();
        let e: Vec<[f64; 3]> =
            device.guarded(|| device.read(encoder, &self.e[self.current], &self.staging, n_vertices))?;
        Ok(self.finest.correction(&e))
    }
}

impl Resident for GpuDoubleHierarchy {
    fn places(&self) -> &[u32] {
        self.residency.as_ref().map_or(&[], |residency| &residency.places)
    }

    fn turn_with(&mut self, rotations: &dyn Resident, positions: &[DVec3]) -> Result<(), BackendError> {
        let device = Arc::clone(&self.device);
        let rotations = rotations.as_any().downcast_ref::<Self>().and_then(|of| of.residency.as_ref());
        let rotations = rotations.ok_or_else(|| device.error("the rotations are on another device"))?;
        device.guarded(|| {
            let Some(mut residency) = self.residency.take() else { return Ok(()) };
            self.with_arrays(|of| residency.turn_with(&device, rotations, positions, of))?;
            self.residency = Some(residency);
            Ok(())
        })
    }

    fn begin(&mut self, values: &[DVec3], turns: Option<f64>) -> Result<(), BackendError> {
        let device = Arc::clone(&self.device);
        device.guarded(|| {
            let Some(residency) = &mut self.residency else { return Ok(()) };
            self.begin = Some(residency.begin(&device, values, turns));
            self.finest.set_load_unit(residency.unit());
            self.begins_relaxation = true;
            Ok(())
        })
    }

    fn unit(&self) -> f64 {
        self.residency.as_ref().map_or(1.0, Residency::unit)
    }

    fn start_pass(&mut self) {
        (self.is_zero, self.begins) = (true, true);
    }

    fn end_pass(&mut self, fetch: bool) -> Result<EndOfPass, BackendError> {
        let device = Arc::clone(&self.device);
        device.guarded(|| {
            let mut encoder = self.encoder()?;
            let (Some(residency), Some(begin)) = (&self.residency, self.begin) else {
                return Err(device.error("a pass ends that did not begin"));
            };
            residency.record_end(&device, kernels(&device)?, begin, self.current, &mut encoder);
            let ([first, now, furthest], values) = residency.read(&device, encoder, fetch)?;
            let norm = |sum| f64::sqrt(finite_or_nan(sum)) * residency.unit();
            let furthest = self.finest.change(finite_or_nan(furthest));
            Ok(EndOfPass { first_norm: norm(first), norm: norm(now), furthest, values })
        })
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
