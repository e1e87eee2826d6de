//! Local quality optimisation on a GPU: one dispatch a colour.

use std::sync::Arc;

use glam::DVec3;
use wgpu::{BindGroup, Buffer, BufferUsages, ComputePassDescriptor};

use super::device::Device;
use super::network::{SLOT, slots};
use crate::backend::smoother::{PackedTets, tolerance};
use crate::backend::{BackendError, Constraint, DeviceSmoother, SmoothingData, SmoothingSweeps};
use crate::kernels::smooth_vertices::{PASSES, Params};

/// Most dispatches in one submission: a submission of seconds would have a display's driver reset its GPU.
const BATCH: usize = 256;

/// A mesh in the GPU's memory. Buffers and bindings are made once.
pub(super) struct GpuSmoother {
    device: Arc<Device>,
    packed: PackedTets<f32>,
    vertices: Buffer,
    constraint: Buffer,
    base: Buffer,
    correction: Buffer,
    staging: Buffer,
    params: Option<Slots>,
    /// All that does not change, by name.
    constant: Vec<(&'static str, Buffer)>,
}

impl GpuSmoother {
    pub(super) fn new(device: Arc<Device>, data: &SmoothingData) -> Result<Self, BackendError> {
        let packed = PackedTets::new(data);
        let tets = packed.tets();
        let n_vertices = packed.n_vertices() as u64;
        for bytes in [size_of_val(tets.base) as u64, size_of_val(tets.vertex_tets) as u64, 16 * n_vertices] {
            device.fits(bytes, device.max_chunk)?;
        }
        device.rows_fit(tets.row_start, PASSES, "vertex")?;
        let of_device = Arc::clone(&device);
        of_device.guarded(|| {
            let tets = packed.tets();
            let constant = vec![
                ("row_start", device.filled("row_start", tets.row_start)),
                ("vertex_tets", device.filled("vertex_tets", tets.vertex_tets)),
                ("tets", device.filled("tets", tets.tets)),
                ("inverse_target", device.filled("inverse_target", tets.inverse_target)),
            ];
            let all = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
            let vertices = device.buffer("vertices", 4 * n_vertices, all);
            let base = device.buffer("base", size_of_val(tets.base) as u64, all);
            let correction = device.buffer("correction", 16 * n_vertices, all);
            let constraint = device.filled("constraint", tets.constraint);
            let staging = device.buffer("staging", 16 * n_vertices, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
            Ok(Self { vertices, constraint, base, correction, staging, params: None, constant, packed, device })
        })
    }

    /// Room for the parameters of this many dispatches.
    fn slots(&mut self, n_dispatches: usize) -> &Slots {
        let fitting = self.params.take().filter(|slots| slots.count >= n_dispatches);
        let slots = fitting.unwrap_or_else(|| {
            let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
            let params = self.device.buffer("parameters", (n_dispatches * SLOT) as u64, usage);
            let mut buffers = vec![
                ("params", &params),
                ("vertices", &self.vertices),
                ("constraint", &self.constraint),
                ("base", &self.base),
                ("correction", &self.correction),
            ];
            buffers.extend(self.constant.iter().map(|(name, buffer)| (*name, buffer)));
            let group = self.device.bind(&self.device.smooth_vertices, &buffers);
            Slots { params, group, count: n_dispatches }
        });
        self.params.insert(slots)
    }
}

/// Parameters of the colours' dispatches, and what they are bound with.
struct Slots {
    params: Buffer,
    group: BindGroup,
    count: usize,
}

impl DeviceSmoother for GpuSmoother {
    fn constrain(&mut self, constraint: &[Constraint]) -> Result<(), BackendError> {
        self.packed.constrain(constraint);
        self.device.guarded(|| {
            self.device.write(&self.constraint, self.packed.tets().constraint);
            Ok(())
        })
    }

    fn start(&mut self, positions: &[DVec3]) -> Result<(), BackendError> {
        self.packed.start(positions);
        self.device.guarded(|| {
            self.device.write(&self.base, self.packed.tets().base);
            let mut encoder = self.device.encoder();
            encoder.clear_buffer(&self.correction, 0, None);
            self.device.submit(encoder);
            Ok(())
        })
    }

    fn sweep(&mut self, sweeps: &SmoothingSweeps) -> Result<(), BackendError> {
        let device = Arc::clone(&self.device);
        let colours: Vec<&[u32]> =
            sweeps.colours.iter().map(Vec::as_slice).filter(|colour| !colour.is_empty()).collect();
        let mut first = 0;
        let params = colours.iter().map(|colour| {
            let params = Params {
                first,
                n_vertices: colour.len() as u32,
                power: sweeps.power,
                delta_squared: sweeps.delta_squared as f32,
                tolerance: tolerance(f64::from(f32::EPSILON)) as f32,
            };
            first += params.n_vertices;
            params
        });
        let params = slots(params);
        device.guarded(|| {
            device.write(&self.vertices, &colours.concat());
            let slots = self.slots(colours.len());
            device.write(&slots.params, &params);
            let dispatches: Vec<usize> = (0..sweeps.count).flat_map(|_| 0..colours.len()).collect();
            for batch in dispatches.chunks(BATCH) {
                let mut encoder = device.encoder();
                let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
                pass.set_pipeline(&device.smooth_vertices.pipeline);
                for &colour in batch {
                    pass.set_bind_group(0, &slots.group, &[(colour * SLOT) as u32]);
                    let (x, y) = device.workgroups(colours[colour].len(), &device.smooth_vertices);
                    pass.dispatch_workgroups(x, y, 1);
                }
                drop(pass);
                device.submit(encoder);
            }
            Ok(())
        })
    }

    fn correction(&mut self) -> Result<Vec<DVec3>, BackendError> {
        let n_vertices = self.packed.n_vertices();
        let encoder = self.device.encoder();
        let correction: Vec<[f32; 4]> =
            self.device.guarded(|| self.device.read(encoder, &self.correction, &self.staging, n_vertices))?;
        Ok(self.packed.correction(&correction))
    }
}
