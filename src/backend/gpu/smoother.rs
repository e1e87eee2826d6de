//! Local optimisation on a GPU: one dispatch per colour.

use std::sync::Arc;

use bytemuck::NoUninit;
use glam::DVec3;
use wgpu::{BindGroup, Buffer, BufferUsages};

use super::device::Device;
use super::network::{SLOT, slots};
use super::pipeline::Pipeline;
use crate::backend::smoother::{PackedPatch, tolerance};
use crate::backend::{BackendError, DeviceSmoother, SmoothingObjective, SmoothingPatch};
use crate::kernels::{raise_worst_beta, smooth_vertices};

/// Most dispatches in one submission. A submission of several seconds would make a display's driver
/// reset its GPU.
const BATCH: usize = 256;

/// Local optimisation in the GPU's memory.
pub(super) struct GpuSmoother {
    device: Arc<Device>,
    room: Option<Room>,
}

/// Buffers for patches up to a size, and their bindings.
struct Room {
    buffers: Vec<(&'static str, Buffer)>,
    staging: Buffer,
    smooth_vertices: BindGroup,
    raise_worst_beta: BindGroup,
}

impl Room {
    fn new(device: &Device, sizes: &[(&'static str, u64)]) -> Self {
        let storage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let uniform = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let buffer = |&(name, size): &(&'static str, u64)| {
            // The next patch is often a little larger, so the size is rounded up, at most to the
            // size of a binding.
            let size = size.next_power_of_two().min(device.max_array).max(size);
            (name, device.buffer(name, size, if name == "params" { uniform } else { storage }))
        };
        let buffers: Vec<_> = sizes.iter().map(buffer).collect();
        let named: Vec<_> = buffers.iter().map(|(name, buffer)| (*name, buffer)).collect();
        let smooth_vertices = device.bind(&device.pipelines.smooth_vertices, &named);
        let raise_worst_beta = device.bind(&device.pipelines.raise_worst_beta, &named);
        let size = buffers.iter().find(|(name, _)| *name == "correction").map_or(0, |(_, buffer)| buffer.size());
        let staging = device.buffer("staging", size, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        Self { buffers, staging, smooth_vertices, raise_worst_beta }
    }

    fn holds(&self, sizes: &[(&'static str, u64)]) -> bool {
        self.buffers.iter().zip(sizes).all(|((_, buffer), (_, size))| buffer.size() >= *size)
    }

    fn buffer(&self, name: &str) -> &Buffer {
        let found = self.buffers.iter().find(|(found, _)| *found == name);
        found.map(|(_, buffer)| buffer).unwrap_or_else(|| panic!("no buffer for `{name}`"))
    }
}

impl GpuSmoother {
    pub(super) fn new(device: Arc<Device>) -> Self {
        Self { device, room: None }
    }

    /// Dispatches all colours, `count` times.
    ///
    /// - `params`: parameters of a colour, from its first vertex and its number of vertices
    fn dispatch<P: NoUninit>(
        &self,
        (pipeline, group): (&Pipeline, &BindGroup),
        params: impl Fn(u32, u32) -> P,
        patch: &SmoothingPatch,
        count: usize,
        room: &Room,
    ) {
        let of_colour = |colour: &std::ops::Range<u32>| params(colour.start, colour.end - colour.start);
        self.device.write(room.buffer("params"), &slots(patch.colours.iter().map(of_colour)));
        let dispatches: Vec<usize> = (0..count).flat_map(|_| 0..patch.colours.len()).collect();
        for batch in dispatches.chunks(BATCH) {
            let mut encoder = self.device.encoder();
            let mut pass = encoder.pass();
            for &colour in batch {
                let bound = (group, (colour * SLOT) as u32);
                self.device.dispatch(&mut pass, pipeline, bound, patch.colours[colour].len());
            }
            drop(pass);
            self.device.submit(encoder);
        }
    }
}

impl DeviceSmoother for GpuSmoother {
    fn sweep(
        &mut self,
        patch: &SmoothingPatch,
        objective: &SmoothingObjective,
        count: usize,
    ) -> Result<Vec<DVec3>, BackendError> {
        let packed = PackedPatch::<f32>::new(patch, objective);
        let star = packed.star(patch);
        let passes = match objective {
            SmoothingObjective::Shape { .. } => smooth_vertices::PASSES,
            SmoothingObjective::Beta { .. } => raise_worst_beta::PASSES,
        };
        self.device.rows_fit(star.row_start, passes, "vertex")?;
        let correction = vec![[0f32; 4]; patch.positions.len()];
        let sizes = [
            ("row_start", size_of_val(star.row_start)),
            ("vertex_tets", size_of_val(star.vertex_tets)),
            ("tets", size_of_val(star.tets)),
            ("base", size_of_val(star.base)),
            ("constraint", size_of_val(star.constraint)),
            ("reach", size_of_val(star.reach)),
            ("correction", size_of_val(&correction[..])),
            ("inverse_target", size_of_val(packed.inverse_target())),
            ("params", patch.colours.len() * SLOT),
        ]
        .map(|(name, size)| (name, size as u64));
        for (_, size) in sizes {
            self.device.fits(size, self.device.max_chunk)?;
        }
        let device = Arc::clone(&self.device);
        device
            .guarded(|| {
                let room = match self.room.take().filter(|room| room.holds(&sizes)) {
                    Some(room) => room,
                    None => Room::new(&device, &sizes),
                };
                device.write(room.buffer("row_start"), star.row_start);
                device.write(room.buffer("vertex_tets"), star.vertex_tets);
                device.write(room.buffer("tets"), star.tets);
                device.write(room.buffer("base"), star.base);
                device.write(room.buffer("constraint"), star.constraint);
                device.write(room.buffer("reach"), star.reach);
                device.write(room.buffer("correction"), &correction);
                device.write(room.buffer("inverse_target"), packed.inverse_target());
                match *objective {
                    SmoothingObjective::Shape { power, size, delta_squared, .. } => {
                        let tolerance = tolerance(f64::from(f32::EPSILON)) as f32;
                        let delta_squared = delta_squared as f32;
                        let params = |first, n_vertices| smooth_vertices::Params {
                            first,
                            n_vertices,
                            power,
                            size,
                            delta_squared,
                            tolerance,
                        };
                        self.dispatch(
                            (&device.pipelines.smooth_vertices, &room.smooth_vertices),
                            params,
                            patch,
                            count,
                            &room,
                        );
                    }
                    SmoothingObjective::Beta { goal, gain } => {
                        let (six_goal, gain) = ((6.0 * goal) as f32, gain as f32);
                        let params = |first, n_vertices| raise_worst_beta::Params { first, n_vertices, six_goal, gain };
                        self.dispatch(
                            (&device.pipelines.raise_worst_beta, &room.raise_worst_beta),
                            params,
                            patch,
                            count,
                            &room,
                        );
                    }
                }
                let found = device.read(device.encoder(), room.buffer("correction"), &room.staging, correction.len());
                self.room = Some(room);
                found
            })
            .map(|found: Vec<[f32; 4]>| packed.correction(&found))
    }
}
