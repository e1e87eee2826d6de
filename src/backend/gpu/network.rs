//! A spring network on a GPU, for sweeps in f32.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::bytes_of;
use glam::DVec3;
use wgpu::{BindGroup, Buffer, BufferUsages};

use super::commands::Commands;
use super::device::Device;
use crate::backend::packed::Packed;
use crate::backend::{BackendError, DeviceNetwork, Measure, NetworkData, Sweep};
use crate::constraint::Constraint;
use crate::kernels::convergence::{self, BLOCK};
use crate::kernels::relax_sweep;
use crate::kernels::row::Entry;

/// Sweeps in one submission: enough to hide the cost of a submission, and few enough that a large
/// network does not occupy a display's GPU for seconds, after which its driver would reset it.
const BATCH: usize = 64;

/// Bytes between the parameters of two dispatches: the largest alignment that WebGPU allows a
/// device to require.
pub(super) const SLOT: usize = 256;

/// A network in the GPU's memory. Buffers and bindings are made once.
pub(super) struct GpuNetwork {
    device: Arc<Device>,
    packed: Packed<f32>,
    chunks: Vec<Chunk>,
    constraint: Buffer,
    load: Buffer,
    /// The correction, and the correction one sweep earlier. `current` is the index of the
    /// correction.
    e: [Buffer; 2],
    current: usize,
    snapshot: Buffer,
    partials: Buffer,
    /// Parameters of a batch's dispatches `[BATCH][chunks]`, one slot each.
    sweep_params: Buffer,
    staging: Buffer,
}

/// A chunk of rows whose part of the matrix fits one binding.
struct Chunk {
    first_row: usize,
    n_rows: usize,
    /// Bindings for either index of the correction.
    relax_sweep: [BindGroup; 2],
    convergence: [BindGroup; 2],
}

impl GpuNetwork {
    pub(super) fn new(device: Arc<Device>, network: &NetworkData) -> Result<Self, BackendError> {
        let packed = Packed::new(network);
        device.fits(16 * packed.n_vertices() as u64, device.max_array)?;
        device.rows_fit(packed.rows().row_start, 1, "vertex")?;
        let plan = plan(packed.rows().row_start, 4, &device)?;
        let of_device = Arc::clone(&device);
        of_device.guarded(|| Ok(Self::allocate(device, packed, &plan)))
    }

    fn allocate(device: Arc<Device>, mut packed: Packed<f32>, plan: &[Range<usize>]) -> Self {
        let n_vertices = packed.n_vertices();
        let rows = packed.rows();
        let bytes = 16 * n_vertices as u64;
        let vector = |label| {
            device.buffer(label, bytes, BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC)
        };
        let n_blocks = n_vertices.div_ceil(BLOCK);
        let constraint = device.filled("constraint", rows.constraint);
        let load = device.filled("load", rows.load);
        let inverse_length = device.filled("inverse_length", packed.inverse_length());
        let e = [vector("e"), vector("e_previous")];
        let snapshot = vector("snapshot");
        let partials = vector("partials");
        let uniform =
            |label, n: usize| device.buffer(label, (n * SLOT) as u64, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        let sweep_params = uniform("sweep parameters", BATCH * plan.len());
        let measure_params = uniform("measure parameters", plan.len());
        let measure_slots = slots(plan.iter().map(measure_params_of));
        device.write(&measure_params, &measure_slots);

        let chunk = |range: &Range<usize>| {
            let [row_start, entries] = matrix(&device, rows.row_start, rows.columns, rows.stiffness, range);
            let bind = |pipeline, params, current: usize| {
                let buffers = [
                    ("params", params),
                    ("row_start", &row_start),
                    ("entries", &entries),
                    ("constraint", &constraint),
                    ("load", &load),
                    ("e", &e[current]),
                    ("e_previous", &e[1 - current]),
                    ("snapshot", &snapshot),
                    ("inverse_length", &inverse_length),
                    ("partials", &partials),
                ];
                device.bind(pipeline, &buffers)
            };
            Chunk {
                first_row: range.start,
                n_rows: range.len(),
                relax_sweep: [0, 1].map(|current| bind(&device.pipelines.relax_sweep, &sweep_params, current)),
                convergence: [0, 1].map(|current| bind(&device.pipelines.convergence, &measure_params, current)),
            }
        };
        let chunks = plan.iter().map(chunk).collect();
        let staging =
            device.buffer("staging", bytes.max(8 * n_blocks as u64), BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        packed.forget_received();
        Self { chunks, constraint, load, e, current: 0, snapshot, partials, sweep_params, staging, packed, device }
    }

    /// Records a batch of sweeps. Their parameters are written at once, so a batch must be
    /// submitted before the next is recorded.
    fn record(&mut self, sweeps: &[Sweep], encoder: &mut Commands) {
        let params = sweeps.iter().flat_map(|sweep| {
            self.chunks.iter().map(|chunk| relax_sweep::Params {
                first_row: chunk.first_row as u32,
                n_rows: chunk.n_rows as u32,
                relaxation: sweep.relaxation as f32,
                momentum: sweep.momentum as f32,
            })
        });
        self.device.write(&self.sweep_params, &slots(params));
        let mut pass = encoder.pass();
        let mut slot = 0;
        for _ in sweeps {
            for chunk in &self.chunks {
                let bound = (&chunk.relax_sweep[self.current], slot);
                self.device.dispatch(&mut pass, &self.device.pipelines.relax_sweep, bound, chunk.n_rows);
                slot += SLOT as u32;
            }
            self.current = 1 - self.current;
        }
    }

    /// Records the measure, and the copy of the correction for the next measure.
    fn record_measure(&self, encoder: &mut Commands) {
        let mut pass = encoder.pass();
        for (place, chunk) in self.chunks.iter().enumerate() {
            let bound = (&chunk.convergence[self.current], (place * SLOT) as u32);
            self.device.dispatch(&mut pass, &self.device.pipelines.convergence, bound, chunk.n_rows);
        }
        drop(pass);
        let bytes = 16 * self.packed.n_vertices() as u64;
        self.device.copy(encoder, &self.e[self.current], &self.snapshot, bytes);
    }
}

impl DeviceNetwork for GpuNetwork {
    fn epsilon(&self) -> f64 {
        f64::from(f32::EPSILON)
    }

    fn constrain(&mut self, constraint: &[Constraint]) -> Result<(), BackendError> {
        self.packed.constrain(constraint);
        self.device.guarded(|| {
            self.device.write(&self.constraint, self.packed.rows().constraint);
            self.packed.forget_received();
            Ok(())
        })
    }

    fn start(&mut self, load: &[DVec3]) -> Result<(), BackendError> {
        self.packed.start(load);
        self.device.guarded(|| {
            self.device.write(&self.load, self.packed.rows().load);
            self.packed.forget_received();
            let mut encoder = self.device.encoder();
            for buffer in [&self.e[0], &self.e[1], &self.snapshot] {
                self.device.clear(&mut encoder, buffer);
            }
            self.device.submit(encoder);
            Ok(())
        })
    }

    fn sweep(&mut self, sweeps: &[Sweep]) -> Result<Measure, BackendError> {
        let device = Arc::clone(&self.device);
        let partials: Vec<[f32; 2]> = device.guarded(|| {
            let mut encoder = device.encoder();
            let mut batches = sweeps.chunks(BATCH).peekable();
            while let Some(batch) = batches.next() {
                self.record(batch, &mut encoder);
                if batches.peek().is_some() {
                    device.submit(std::mem::replace(&mut encoder, device.encoder()));
                }
            }
            self.record_measure(&mut encoder);
            let n_blocks = self.packed.n_vertices().div_ceil(BLOCK);
            device.read(encoder, &self.partials, &self.staging, n_blocks)
        })?;
        Ok(self.packed.measure(&partials))
    }

    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError> {
        let n_vertices = self.packed.n_vertices();
        let e: Vec<[f32; 4]> = self
            .device
            .guarded(|| self.device.read(self.device.encoder(), &self.e[self.current], &self.staging, n_vertices))?;
        Ok(self.packed.correction(&e))
    }
}

/// Ranges of rows whose part of the matrix fits one binding. They consist of whole blocks, so a
/// block's partial sum does not depend on the split.
///
/// - `row_bytes`: most bytes of a row in an array of rows
pub(super) fn plan(row_start: &[u32], row_bytes: u64, device: &Device) -> Result<Vec<Range<usize>>, BackendError> {
    let n_rows = row_start.len() - 1;
    let bytes = |first: usize, end: usize| {
        let entries = u64::from(row_start[end] - row_start[first]) * size_of::<Entry>() as u64;
        entries.max(row_bytes * (end - first + 1) as u64)
    };
    let mut plan: Vec<Range<usize>> = Vec::new();
    for first in (0..n_rows).step_by(BLOCK) {
        let end = (first + BLOCK).min(n_rows);
        device.fits(bytes(first, end), device.max_chunk)?;
        match plan.last_mut() {
            Some(chunk) if bytes(chunk.start, end) <= device.max_chunk => chunk.end = end,
            _ => plan.push(first..end),
        }
    }
    Ok(plan)
}

/// A chunk's part of a matrix on the device: row starts, counted from the chunk's first entry, and
/// the entries.
pub(super) fn matrix(
    device: &Device,
    row_start: &[u32],
    columns: &[u32],
    values: &[f32],
    range: &Range<usize>,
) -> [Buffer; 2] {
    let starts = &row_start[range.start..=range.end];
    let (first, end) = (starts[0], starts[range.len()]);
    let of_chunk = first as usize..end as usize;
    let springs = columns[of_chunk.clone()].iter().zip(&values[of_chunk]);
    let entries: Vec<Entry> = springs.map(|(&column, &stiffness)| Entry { column, stiffness }).collect();
    let starts: Vec<u32> = starts.iter().map(|start| start - first).collect();
    [device.filled("row_start", &starts), device.filled("entries", &entries)]
}

fn measure_params_of(range: &Range<usize>) -> convergence::Params {
    convergence::Params { first_row: range.start as u32, n_rows: range.len() as u32 }
}

/// Parameters of dispatches, one slot each.
pub(super) fn slots<P: bytemuck::NoUninit>(params: impl Iterator<Item = P>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for params in params {
        let end = bytes.len() + SLOT;
        bytes.extend_from_slice(bytes_of(&params));
        bytes.resize(end, 0);
    }
    bytes
}
