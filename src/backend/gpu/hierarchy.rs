//! A hierarchy of networks on a GPU, in f32. Multigrid cycles run without data transfers to the
//! CPU.

use std::sync::Arc;

use glam::DVec3;
use wgpu::{BindGroup, Buffer, BufferUsages};

use super::commands::Commands;
use super::device::Device;
use super::levels::{BATCH, Levels, Start, measures, uniform, vector};
use super::network::{SLOT, slots};
use crate::backend::{BackendError, DeviceNetwork, LevelData, Measure, Sweep};
use crate::constraint::Constraint;
use crate::kernels::convergence::BLOCK;
use crate::kernels::{Real, accelerate};

/// A hierarchy in the GPU's memory.
pub(super) struct GpuHierarchy {
    device: Arc<Device>,
    levels: Levels,
    /// The finest level's correction before the cycle, and one cycle earlier. Cycles exchange the
    /// two arrays.
    starts: [Buffer; 2],
    /// Index of the array with the correction one cycle earlier.
    earlier: usize,
    /// Whether the pass begins, and the corrections have to become zero.
    begins: bool,
    /// Largest changes `[BATCH][blocks]`.
    partials: Buffer,
    /// Parameters of the last step of each cycle of a batch `[BATCH]`, one slot each.
    end_params: Buffer,
    /// Bindings for either index.
    end: [BindGroup; 2],
    staging: Buffer,
}

impl GpuHierarchy {
    pub(super) fn new(device: Arc<Device>, levels: &[LevelData]) -> Result<Self, BackendError> {
        let of_device = Arc::clone(&device);
        of_device.guarded(|| Self::allocate(device, levels))
    }

    fn allocate(device: Arc<Device>, data: &[LevelData]) -> Result<Self, BackendError> {
        let mut levels = Levels::new(&device, data, Start::Correction, 4)?;
        let finest = levels.finest();
        let bytes = 16 * finest.packed.n_vertices() as u64;
        let of_changes = (4 * BATCH * finest.packed.n_vertices().div_ceil(BLOCK)) as u64;
        let starts = ["start", "previous"].map(|label| vector(&device, label, bytes));
        let partials = vector(&device, "partials", of_changes);
        let end_params = uniform(&device, BATCH);
        let inverse_length = device.filled("inverse_length", finest.packed.inverse_length());
        let bind = |earlier: usize| {
            let buffers = [
                ("params", &end_params),
                ("start", &starts[1 - earlier]),
                ("previous", &starts[earlier]),
                ("constraint", &finest.constraint),
                ("inverse_length", &inverse_length),
                ("e", &finest.e[finest.ends_in]),
                ("partials", &partials),
            ];
            device.bind(&device.pipelines.accelerate, &buffers)
        };
        let end = [0, 1].map(bind);
        levels.forget_received();
        let staging = device.buffer("staging", bytes.max(of_changes), BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        Ok(Self { levels, starts, earlier: 1, begins: true, partials, end_params, end, staging, device })
    }

    /// Commands for a submission, first those that begin a pass.
    fn encoder(&mut self) -> Commands {
        let mut encoder = self.device.encoder();
        if std::mem::take(&mut self.begins) {
            let [e, e_previous] = &self.levels.finest().e;
            for buffer in [e, e_previous, &self.starts[self.earlier]] {
                self.device.clear(&mut encoder, buffer);
            }
        }
        encoder
    }

    /// Runs at most [`BATCH`] cycles. Returns the change by each.
    fn run(&mut self, sweeps: &[Sweep]) -> Result<Vec<f64>, BackendError> {
        let device = Arc::clone(&self.device);
        let n_vertices = self.levels.finest().packed.n_vertices();
        let n_blocks = n_vertices.div_ceil(BLOCK);
        let partials: Vec<f32> = device.guarded(|| {
            let mut encoder = self.encoder();
            let params = sweeps.iter().enumerate().map(|(cycle, sweep)| accelerate::Params {
                n_vertices: n_vertices as u32,
                relaxation: sweep.relaxation as f32,
                momentum: sweep.momentum as f32,
                first_partial: (cycle * n_blocks) as u32,
            });
            device.write(&self.end_params, &slots(params));
            for cycle in 0..sweeps.len() {
                self.record(cycle, &mut encoder);
                self.earlier = 1 - self.earlier;
            }
            device.read(encoder, &self.partials, &self.staging, sweeps.len() * n_blocks)
        })?;
        let greatest =
            |of_cycle: &[f32]| of_cycle.iter().fold(0.0f32, |largest, &block| largest.max_magnitude(block)).to_f64();
        let packed = &self.levels.finest().packed;
        Ok(partials.chunks(n_blocks.max(1)).map(|of_cycle| packed.change(greatest(of_cycle))).collect())
    }

    /// Records a cycle of a batch.
    fn record(&self, cycle: usize, encoder: &mut Commands) {
        let Self { device, levels, starts, earlier, .. } = self;
        let finest = levels.finest();
        let n_vertices = finest.packed.n_vertices();
        let bytes = 16 * n_vertices as u64;
        device.copy(encoder, &finest.e[0], &starts[1 - earlier], bytes);
        levels.record_cycle(device, encoder);
        let mut pass = encoder.pass();
        let bound = (&self.end[*earlier], (cycle * SLOT) as u32);
        device.dispatch(&mut pass, &device.pipelines.accelerate, bound, n_vertices);
        drop(pass);
        if finest.ends_in != 0 {
            device.copy(encoder, &finest.e[finest.ends_in], &finest.e[0], bytes);
        }
    }
}

impl DeviceNetwork for GpuHierarchy {
    fn epsilon(&self) -> f64 {
        f64::from(f32::EPSILON)
    }

    fn constrain(&mut self, constraint: &[Constraint]) -> Result<(), BackendError> {
        let device = Arc::clone(&self.device);
        device.guarded(|| {
            self.levels.constrain(&device, constraint);
            Ok(())
        })
    }

    fn start(&mut self, load: &[DVec3]) -> Result<(), BackendError> {
        let finest = self.levels.finest_mut();
        finest.packed.start(load);
        self.begins = true;
        self.device.guarded(|| {
            self.device.write(&finest.load, finest.packed.rows().load);
            finest.packed.forget_received();
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
        let finest = self.levels.finest();
        let n_vertices = finest.packed.n_vertices();
        let e: Vec<[f32; 4]> = device.guarded(|| device.read(encoder, &finest.e[0], &self.staging, n_vertices))?;
        Ok(finest.packed.correction(&e))
    }
}
