//! A hierarchy of networks on a GPU. Multigrid cycles run without data transfers to the CPU.
//!
//! The dispatches of a cycle never change, so they are bound, and their parameters written, once.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::NoUninit;
use glam::DVec3;
use wgpu::{BindGroup, Buffer, BufferUsages, CommandEncoder, ComputePassDescriptor};

use super::device::Device;
use super::network::{SLOT, matrix, plan, slots};
use super::pipeline::Pipeline;
use crate::backend::packed::Packed;
use crate::backend::{BackendError, DeviceNetwork, LevelData, Measure, Sweep, Transfer};
use crate::constraint::Constraint;
use crate::kernels::convergence::BLOCK;
use crate::kernels::{Real, accelerate, defect, relax_sweep, transfer};

/// Cycles in one submission. Their sweeps over the finest network are about as many as in a batch
/// of sweeps.
const BATCH: usize = 16;

/// A hierarchy in the GPU's memory, finest level first.
pub(super) struct GpuHierarchy {
    device: Arc<Device>,
    levels: Vec<Level>,
    /// The finest level's correction before the cycle, and one cycle earlier.
    start: Buffer,
    previous: Buffer,
    partials: Buffer,
    /// Parameters of the last step of each cycle of a batch `[BATCH]`, one slot each.
    end_params: Buffer,
    end: BindGroup,
    staging: Buffer,
}

struct Level {
    arrays: Arrays,
    /// The way down: sweeps, the defect, and its transfer to the coarser level. On the coarsest
    /// level only sweeps.
    down: Vec<Dispatch>,
    /// The way up: the transfer from the coarser level, and sweeps.
    up: Vec<Dispatch>,
}

/// The arrays of a level. A cycle's correction begins in the first `e`.
struct Arrays {
    packed: Packed<f32>,
    constraint: Buffer,
    load: Buffer,
    /// The correction, and the correction one sweep earlier, which also holds the defect. Sweeps
    /// exchange the two arrays.
    e: [Buffer; 2],
    /// Index of the array with the correction after a cycle.
    ends_in: usize,
}

/// A kernel over a chunk of rows, with all its bindings.
struct Dispatch {
    kernel: Kernel,
    n_rows: usize,
    bound: BindGroup,
}

#[derive(Clone, Copy)]
enum Kernel {
    RelaxSweep,
    Defect,
    Transfer,
}

impl GpuHierarchy {
    pub(super) fn new(device: Arc<Device>, levels: &[LevelData]) -> Result<Self, BackendError> {
        let of_device = Arc::clone(&device);
        of_device.guarded(|| Self::allocate(device, levels))
    }

    fn allocate(device: Arc<Device>, data: &[LevelData]) -> Result<Self, BackendError> {
        let arrays = data.iter().map(|level| Arrays::new(&device, level)).collect::<Result<Vec<_>, _>>()?;
        let paths = (0..data.len())
            .map(|at| dispatches(&device, &data[at], &arrays[at], arrays.get(at + 1)))
            .collect::<Result<Vec<_>, _>>()?;
        let levels: Vec<Level> =
            arrays.into_iter().zip(paths).map(|(arrays, [down, up])| Level { arrays, down, up }).collect();
        let finest = &levels[0].arrays;
        let bytes = 16 * finest.packed.n_vertices() as u64;
        let n_blocks = finest.packed.n_vertices().div_ceil(BLOCK);
        let [start, previous] = ["start", "previous"].map(|label| vector(&device, label, bytes));
        let partials = vector(&device, "partials", 4 * n_blocks as u64);
        let end_params = uniform(&device, BATCH);
        let inverse_length = device.filled("inverse_length", finest.packed.inverse_length());
        let end = device.bind(
            &device.pipelines.accelerate,
            &[
                ("params", &end_params),
                ("start", &start),
                ("previous", &previous),
                ("constraint", &finest.constraint),
                ("inverse_length", &inverse_length),
                ("e", &finest.e[finest.ends_in]),
                ("partials", &partials),
            ],
        );
        let staging =
            device.buffer("staging", bytes.max(4 * n_blocks as u64), BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        Ok(Self { levels, start, previous, partials, end_params, end, staging, device })
    }

    /// Records a batch of cycles. It must be submitted before the next batch is recorded.
    fn record(&self, sweeps: &[Sweep], encoder: &mut CommandEncoder) {
        let finest = &self.levels[0].arrays;
        let n_vertices = finest.packed.n_vertices();
        let bytes = 16 * n_vertices as u64;
        let params = sweeps.iter().map(|sweep| accelerate::Params {
            n_vertices: n_vertices as u32,
            relaxation: sweep.relaxation as f32,
            momentum: sweep.momentum as f32,
            padding: 0,
        });
        self.device.write(&self.end_params, &slots(params));
        for cycle in 0..sweeps.len() {
            encoder.copy_buffer_to_buffer(&self.start, 0, &self.previous, 0, bytes);
            encoder.copy_buffer_to_buffer(&finest.e[0], 0, &self.start, 0, bytes);
            self.record_cycle(0, encoder);
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
            pass.set_pipeline(&self.device.pipelines.accelerate.pipeline);
            pass.set_bind_group(0, &self.end, &[(cycle * SLOT) as u32]);
            let (x, y) = self.device.workgroups(n_vertices, &self.device.pipelines.accelerate);
            pass.dispatch_workgroups(x, y, 1);
            drop(pass);
            if finest.ends_in != 0 {
                encoder.copy_buffer_to_buffer(&finest.e[finest.ends_in], 0, &finest.e[0], 0, bytes);
            }
        }
    }

    /// Records a level's way down, the cycle of the coarser levels, and the level's way up.
    fn record_cycle(&self, at: usize, encoder: &mut CommandEncoder) {
        self.record_dispatches(&self.levels[at].down, encoder);
        if let Some(coarser) = self.levels.get(at + 1) {
            encoder.clear_buffer(&coarser.arrays.e[0], 0, None);
            self.record_cycle(at + 1, encoder);
            self.record_dispatches(&self.levels[at].up, encoder);
        }
    }

    fn record_dispatches(&self, dispatches: &[Dispatch], encoder: &mut CommandEncoder) {
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        for Dispatch { kernel, n_rows, bound } in dispatches {
            let pipeline = kernel.pipeline(&self.device);
            pass.set_pipeline(&pipeline.pipeline);
            pass.set_bind_group(0, bound, &[0]);
            let (x, y) = self.device.workgroups(*n_rows, pipeline);
            pass.dispatch_workgroups(x, y, 1);
        }
    }
}

impl DeviceNetwork for GpuHierarchy {
    fn constrain(&mut self, mut constraint: &[Constraint]) -> Result<(), BackendError> {
        let device = Arc::clone(&self.device);
        device.guarded(|| {
            for Level { arrays, .. } in &mut self.levels {
                let (own, coarser) = constraint.split_at(arrays.packed.n_vertices());
                arrays.packed.constrain(own);
                device.write(&arrays.constraint, arrays.packed.rows().constraint);
                constraint = coarser;
            }
            Ok(())
        })
    }

    fn start(&mut self, load: &[DVec3]) -> Result<(), BackendError> {
        let finest = &mut self.levels[0].arrays;
        finest.packed.start(load);
        self.device.guarded(|| {
            self.device.write(&finest.load, finest.packed.rows().load);
            let mut encoder = self.device.encoder();
            for buffer in [&finest.e[0], &finest.e[1], &self.start, &self.previous] {
                encoder.clear_buffer(buffer, 0, None);
            }
            self.device.submit(encoder);
            Ok(())
        })
    }

    fn sweep(&mut self, sweeps: &[Sweep]) -> Result<Measure, BackendError> {
        let packed = &self.levels[0].arrays.packed;
        if sweeps.is_empty() {
            return Ok(Measure { change: 0.0, residual: f64::NAN });
        }
        let partials: Vec<f32> = self.device.guarded(|| {
            let mut encoder = self.device.encoder();
            let mut batches = sweeps.chunks(BATCH).peekable();
            while let Some(batch) = batches.next() {
                self.record(batch, &mut encoder);
                if batches.peek().is_some() {
                    self.device.submit(std::mem::replace(&mut encoder, self.device.encoder()));
                }
            }
            self.device.read(encoder, &self.partials, &self.staging, packed.n_vertices().div_ceil(BLOCK))
        })?;
        let largest = partials.iter().fold(0.0f32, |largest, &block| largest.max_magnitude(block));
        Ok(Measure { change: packed.change(largest.to_f64()), residual: f64::NAN })
    }

    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError> {
        let Arrays { packed, e, .. } = &self.levels[0].arrays;
        let e: Vec<[f32; 4]> = self
            .device
            .guarded(|| self.device.read(self.device.encoder(), &e[0], &self.staging, packed.n_vertices()))?;
        Ok(packed.correction(&e))
    }
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
            packed,
        })
    }
}

/// The way down and the way up of a level.
fn dispatches(
    device: &Device,
    level: &LevelData,
    arrays: &Arrays,
    coarser: Option<&Arrays>,
) -> Result<[Vec<Dispatch>; 2], BackendError> {
    let Arrays { packed, constraint, load, e, .. } = arrays;
    let rows = packed.rows();
    let springs = Chunks::new(device, rows.row_start, rows.columns, rows.stiffness)?;
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
    let mut sweeps = || {
        let mut all = Vec::new();
        for factors in level.sweeps {
            all.extend(sweep(factors, current));
            current = 1 - current;
        }
        (all, current)
    };
    let (mut down, middle) = sweeps();
    let (Some([restriction, prolongation]), Some(coarser)) = (level.transfers, coarser) else {
        return Ok([down, Vec::new()]);
    };
    let [correction, defect] = [&e[middle], &e[1 - middle]];
    let params = |range: &Range<usize>| defect::Params { first_row: range.start as u32, n_rows: range.len() as u32 };
    let buffers = [("constraint", constraint), ("load", load), ("e", correction), ("rest", defect)];
    down.extend(springs.dispatches(device, Kernel::Defect, params, &buffers));
    let gather = |transfer: &Transfer, keep: f32, constraint, source, gathered| {
        let params = |range: &Range<usize>| transfer::Params {
            first_row: range.start as u32,
            n_rows: range.len() as u32,
            keep,
            padding: 0,
        };
        let buffers = [("constraint", constraint), ("source", source), ("gathered", gathered)];
        Ok(Chunks::of_transfer(device, transfer)?.dispatches(device, Kernel::Transfer, params, &buffers))
    };
    down.extend(gather(restriction, 0.0, &coarser.constraint, defect, &coarser.load)?);
    let mut up = gather(prolongation, 1.0, constraint, &coarser.e[coarser.ends_in], correction)?;
    up.extend(sweeps().0);
    Ok([down, up])
}

/// A matrix, or the weights of a transfer, in chunks of rows that fit one binding.
struct Chunks {
    chunks: Vec<(Range<usize>, [Buffer; 2])>,
}

impl Chunks {
    fn new(device: &Device, row_start: &[u32], columns: &[u32], values: &[f32]) -> Result<Self, BackendError> {
        device.rows_fit(row_start, 1, "vertex")?;
        let with_buffers = |range| {
            let buffers = matrix(device, row_start, columns, values, &range);
            (range, buffers)
        };
        Ok(Self { chunks: plan(row_start, device)?.into_iter().map(with_buffers).collect() })
    }

    fn of_transfer(device: &Device, transfer: &Transfer) -> Result<Self, BackendError> {
        let weights: Vec<f32> = transfer.weights.iter().map(|&weight| weight as f32).collect();
        Self::new(device, &transfer.sources.row_start, &transfer.sources.entries, &weights)
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
            Self::RelaxSweep => &device.pipelines.relax_sweep,
            Self::Defect => &device.pipelines.defect,
            Self::Transfer => &device.pipelines.transfer,
        }
    }
}

fn vector(device: &Device, label: &str, bytes: u64) -> Buffer {
    device.buffer(label, bytes, BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC)
}

/// A buffer for the parameters of `n` dispatches.
fn uniform(device: &Device, n: usize) -> Buffer {
    device.buffer("parameters", (n * SLOT) as u64, BufferUsages::UNIFORM | BufferUsages::COPY_DST)
}
