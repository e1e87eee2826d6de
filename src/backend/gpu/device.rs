//! An open device: its buffers, its errors, and the transfer of data from it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use bytemuck::{NoUninit, Pod, cast_slice, pod_collect_to_vec};
use wgpu::{
    Adapter, AdapterInfo, BindGroup, Buffer, BufferDescriptor, BufferUsages, CommandEncoderDescriptor, ComputePass,
    DeviceDescriptor, ErrorFilter, Features, MapMode, PollType, Queue,
};

use super::adapter::{double, max_binding, required_limits, times};
use super::commands::{Clock, Commands};
use super::pipeline::{Pipeline, Window};
use super::{BackendError, Bounds, StartTest};
use crate::backend::{DeviceTimes, DeviceWork, Precision};
use crate::kernels::{OfDoubleKernels, OfKernels, place};

/// Most neighbours or tets in a loop of one invocation. Mesa's software adapter silently ends an
/// invocation after 65 535 iterations of all its loops together. The reduction in a workgroup takes
/// a few of them.
pub(super) const MAX_ROW: u32 = 60_000;

/// Time limit for another thread to pass on an answer of the device.
const HANDED_ON: Duration = Duration::from_secs(10);

/// An open device with its compiled kernels.
#[derive(Debug)]
pub(super) struct Device {
    device: wgpu::Device,
    queue: Queue,
    pub(super) info: AdapterInfo,
    /// The first failure outside an error scope. The device cannot be used after it.
    failure: Arc<Mutex<Option<String>>>,
    /// Most bytes of one array.
    pub(super) max_array: u64,
    /// Most bytes of one array of a chunk.
    pub(super) max_chunk: u64,
    /// Most workgroups in one dimension of a dispatch.
    max_workgroups: u32,
    pub(super) pipelines: OfKernels<Pipeline>,
    /// The kernels with numbers in f64; `None` if the device does not compute in f64.
    pub(super) double_pipelines: Option<OfDoubleKernels<Pipeline>>,
    /// What the tests of these kernels found.
    pub(super) start_tests: Vec<StartTest>,
    work: Counters,
    /// Nanoseconds of waiting for answers.
    waiting: AtomicU64,
    /// The times of kernels, if they are wanted and the device has them.
    clock: Option<Clock>,
}

/// See [`DeviceWork`].
#[derive(Debug, Default)]
struct Counters {
    bytes_up: AtomicU64,
    bytes_down: AtomicU64,
    submissions: AtomicU64,
    reads: AtomicU64,
    dispatches: AtomicU64,
    copies: AtomicU64,
    clears: AtomicU64,
}

fn count(counter: &AtomicU64, by: u64) {
    counter.fetch_add(by, Ordering::Relaxed);
}

impl Device {
    pub(super) fn open(adapter: &Adapter, bounds: Bounds) -> Result<Self, BackendError> {
        let info = adapter.get_info();
        let fail = |message: String| BackendError::Device { adapter: info.name.clone(), message };
        let wanted_times = if bounds.times { times(adapter) } else { Features::empty() };
        let descriptor = DeviceDescriptor {
            label: Some("idmesh"),
            required_limits: required_limits(adapter),
            required_features: double(adapter) | wanted_times,
            ..DeviceDescriptor::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| fail(error.to_string()))?;
        let failure = Arc::new(Mutex::new(None));
        let record = |failure: &Mutex<Option<String>>, message: String| {
            failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(message);
        };
        // wgpu's own handler panics.
        let uncaptured = Arc::clone(&failure);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| record(&uncaptured, error.to_string())));
        let lost = Arc::clone(&failure);
        device.set_device_lost_callback(move |_, message| record(&lost, format!("device lost: {message}")));

        let limits = device.limits();
        let max_array = max_binding(&limits);
        let (pipelines, error) = catching(&device, || OfKernels::new(|kernel| Pipeline::new(&device, kernel)));
        if let Some(message) = error {
            return Err(fail(message));
        }
        let mut opened = Self {
            max_chunk: bounds.matrix_bytes.unwrap_or(max_array).min(max_array),
            max_workgroups: bounds.workgroups.unwrap_or(u32::MAX).min(limits.max_compute_workgroups_per_dimension),
            pipelines: pipelines.map_err(fail)?,
            double_pipelines: None,
            start_tests: Vec::new(),
            work: Counters::default(),
            waiting: AtomicU64::new(0),
            clock: (!wanted_times.is_empty()).then(|| Clock::new(&queue)),
            device,
            queue,
            failure,
            max_array,
            info,
        };
        if !double(adapter).is_empty() && bounds.arithmetic != Some(Precision::F32) {
            let of_device = &opened.device;
            // An adapter that cannot compile these kernels computes in f32.
            let (kernels, error) =
                catching(of_device, || OfDoubleKernels::new(|kernel| Pipeline::new(of_device, kernel)));
            if let (Ok(kernels), None) = (kernels, error) {
                opened.double_pipelines = Some(kernels);
            }
        }
        Ok(opened)
    }

    /// Compiles a kernel of this text.
    #[cfg(test)]
    pub(super) fn compile(&self, name: &'static str, source: &str) -> Result<Pipeline, String> {
        let source = String::leak(source.to_owned());
        Pipeline::new(&self.device, &crate::kernels::Kernel { name, parts: &[], source })
    }

    /// The number type of the loads and corrections of cycles.
    pub(super) fn arithmetic(&self) -> Precision {
        if self.double_pipelines.is_some() { Precision::F64 } else { Precision::F32 }
    }

    /// The work since the device was opened.
    pub(super) fn work(&self) -> DeviceWork {
        let Counters { bytes_up, bytes_down, submissions, reads, dispatches, copies, clears } = &self.work;
        let [bytes_up, bytes_down, submissions, reads, dispatches, copies, clears] =
            [bytes_up, bytes_down, submissions, reads, dispatches, copies, clears].map(|of| of.load(Ordering::Relaxed));
        DeviceWork { bytes_up, bytes_down, submissions, reads, dispatches, copies, clears }
    }

    /// Seconds since the device was opened.
    pub(super) fn times(&self) -> DeviceTimes {
        let waiting = 1e-9 * self.waiting.load(Ordering::Relaxed) as f64;
        DeviceTimes { waiting, kernels: self.clock.as_ref().map(Clock::seconds) }
    }

    /// The error of the device with this message.
    pub(super) fn error(&self, message: impl Into<String>) -> BackendError {
        BackendError::Device { adapter: self.info.name.clone(), message: message.into() }
    }

    /// Refuses an array larger than one binding.
    ///
    /// # Errors
    /// [`BackendError::TooLarge`]
    pub(super) fn fits(&self, needed: u64, available: u64) -> Result<(), BackendError> {
        if needed <= available {
            return Ok(());
        }
        Err(BackendError::TooLarge { adapter: self.info.name.clone(), needed, available })
    }

    /// Refuses rows that are too long for a kernel's loop.
    ///
    /// - `passes`: number of loops of an invocation over its row
    ///
    /// # Errors
    /// [`BackendError::Device`]
    pub(super) fn rows_fit(&self, row_start: &[u32], passes: u32, what: &str) -> Result<(), BackendError> {
        let most = MAX_ROW / passes;
        match row_start.windows(2).position(|ends| ends[1] - ends[0] > most) {
            None => Ok(()),
            Some(row) => Err(self.error(format!(
                "{what} {row} has {} neighbours, a kernel takes at most {most}",
                row_start[row + 1] - row_start[row]
            ))),
        }
    }

    /// Runs work and turns errors that wgpu reports separately into the error of the result.
    pub(super) fn guarded<R>(&self, work: impl FnOnce() -> Result<R, BackendError>) -> Result<R, BackendError> {
        let (result, error) = catching(&self.device, work);
        if let Some(message) = error {
            return Err(self.error(message));
        }
        let failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        match &*failure {
            Some(message) => Err(self.error(message.clone())),
            None => result,
        }
    }

    /// A buffer with this many bytes. It is never empty, because an empty buffer cannot be bound.
    pub(super) fn buffer(&self, label: &str, size: u64, usage: BufferUsages) -> Buffer {
        let size = size.max(16).next_multiple_of(4);
        self.device.create_buffer(&BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
    }

    /// A storage buffer with these contents.
    pub(super) fn filled<T: NoUninit>(&self, label: &str, data: &[T]) -> Buffer {
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let buffer = self.buffer(label, size_of_val(data) as u64, usage);
        self.write(&buffer, data);
        buffer
    }

    /// Replaces a buffer's contents before the commands of the next submission.
    pub(super) fn write<T: NoUninit>(&self, buffer: &Buffer, data: &[T]) {
        self.write_from(buffer, 0, data);
    }

    pub(super) fn bind(&self, pipeline: &Pipeline, buffers: &[(&str, &Buffer)]) -> BindGroup {
        self.bind_windows(pipeline, buffers, &[])
    }

    /// [`Self::bind`] with buffers of which a part is bound.
    pub(super) fn bind_windows(
        &self,
        pipeline: &Pipeline,
        buffers: &[(&str, &Buffer)],
        windows: &[(&str, Window)],
    ) -> BindGroup {
        pipeline.bind(&self.device, buffers, windows)
    }

    pub(super) fn encoder(&self) -> Commands {
        let encoder = self.device.create_command_encoder(&CommandEncoderDescriptor::default());
        Commands::new(&self.device, encoder, self.clock.is_some())
    }

    pub(super) fn submit(&self, commands: Commands) {
        count(&self.work.submissions, 1);
        Clock::submit(self.clock.as_ref(), &self.device, &self.queue, commands);
    }

    /// Records a kernel with so many invocations.
    ///
    /// - `offset`: of its parameters in their buffer, in bytes
    pub(super) fn dispatch(
        &self,
        pass: &mut ComputePass,
        pipeline: &Pipeline,
        (group, offset): (&BindGroup, u32),
        n_invocations: usize,
    ) {
        pass.set_pipeline(&pipeline.pipeline);
        pass.set_bind_group(0, group, &[offset]);
        let (x, y) = place::workgroups(n_invocations as u32, pipeline.workgroup_size, self.max_workgroups);
        pass.dispatch_workgroups(x, y, 1);
        count(&self.work.dispatches, 1);
    }

    /// Records the copy of the first bytes of an array.
    pub(super) fn copy(&self, encoder: &mut Commands, from: &Buffer, to: &Buffer, bytes: u64) {
        encoder.copy_buffer_to_buffer(from, 0, to, 0, bytes);
        count(&self.work.copies, 1);
    }

    /// Records that an array is set to zero.
    pub(super) fn clear(&self, encoder: &mut Commands, buffer: &Buffer) {
        self.clear_first(encoder, buffer, None);
    }

    /// Records that the first bytes of an array are set to zero.
    pub(super) fn clear_first(&self, encoder: &mut Commands, buffer: &Buffer, bytes: Option<u64>) {
        encoder.clear_buffer(buffer, 0, bytes);
        count(&self.work.clears, 1);
    }

    /// Replaces a part of a buffer before the commands of the next submission.
    ///
    /// - `first`: first byte of the part, a multiple of 4
    pub(super) fn write_from<T: NoUninit>(&self, buffer: &Buffer, first: u64, data: &[T]) {
        if !data.is_empty() {
            count(&self.work.bytes_up, size_of_val(data) as u64);
            self.queue.write_buffer(buffer, first, cast_slice(data));
        }
    }

    /// Submits the commands, waits, and returns the first `n` elements of `source`, through the
    /// buffer `staging`.
    pub(super) fn read<T: Pod>(
        &self,
        encoder: Commands,
        source: &Buffer,
        staging: &Buffer,
        n: usize,
    ) -> Result<Vec<T>, BackendError> {
        self.read_parts(encoder, &[(source, 0, n)], staging)
    }

    /// [`Self::read`] of several buffers, one after another.
    ///
    /// - `parts`: buffer, first byte and number of elements
    pub(super) fn read_parts<T: Pod>(
        &self,
        mut encoder: Commands,
        parts: &[(&Buffer, u64, usize)],
        staging: &Buffer,
    ) -> Result<Vec<T>, BackendError> {
        let mut size = 0;
        for &(source, first, n) in parts {
            let bytes = (n * size_of::<T>()) as u64;
            if bytes > 0 {
                encoder.copy_buffer_to_buffer(source, first, staging, size, bytes);
                count(&self.work.copies, 1);
            }
            size += bytes;
        }
        self.submit(encoder);
        if size == 0 {
            return Ok(Vec::new());
        }
        count(&self.work.reads, 1);
        count(&self.work.bytes_down, size);
        let (sender, receiver) = channel();
        // The receiver outlives the wait below. If it does not, nobody needs the message.
        staging.map_async(MapMode::Read, 0..size, move |result| drop(sender.send(result)));
        // wgpu panics if the device is lost during the wait.
        let begin = Instant::now();
        let waited = catch_unwind(AssertUnwindSafe(|| self.device.poll(PollType::wait_indefinitely())));
        count(&self.waiting, begin.elapsed().as_nanos() as u64);
        match waited {
            Err(_) => return Err(self.error("device lost")),
            Ok(Err(error)) => return Err(self.error(error.to_string())),
            Ok(Ok(_)) => {}
        }
        // Another waiting thread may have received the answer, and may not have passed it on yet.
        match receiver.recv_timeout(HANDED_ON) {
            Ok(Ok(())) => {}
            _ => return Err(self.error("the device did not hand back its results")),
        }
        self.clock.iter().for_each(Clock::collect);
        let mapped = staging.get_mapped_range(0..size).map_err(|error| self.error(error.to_string()))?;
        let data = pod_collect_to_vec(&mapped);
        drop(mapped);
        staging.unmap();
        Ok(data)
    }
}

/// Runs work. Returns its result and the first error that wgpu reported meanwhile.
fn catching<R>(device: &wgpu::Device, work: impl FnOnce() -> R) -> (R, Option<String>) {
    let filters = [ErrorFilter::Validation, ErrorFilter::OutOfMemory, ErrorFilter::Internal];
    let scopes = filters.map(|filter| device.push_error_scope(filter));
    let result = work();
    let errors = scopes.into_iter().rev().filter_map(|scope| pollster::block_on(scope.pop()));
    // All scopes must be popped, so the loop has no early end.
    let first = errors.map(|error| error.to_string()).fold(None, |first: Option<String>, error| first.or(Some(error)));
    (result, first)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::super::adapter::choose;
    use super::super::network::GpuNetwork;
    use super::super::{Bounds, Choice};
    use super::Device;
    use crate::backend::{BackendError, DeviceNetwork, NetworkData};
    use crate::constraint::Constraint;
    use crate::mesh::csr::Csr;

    /// Without handlers wgpu panics at an invalid operation and at a lost device.
    #[test]
    fn failures_are_errors() {
        if std::env::var("IDMESH_TEST_GPU").is_ok_and(|value| value == "off") {
            eprintln!("SKIPPED by IDMESH_TEST_GPU=off: failures_are_errors");
            return;
        }
        let device = Arc::new(Device::open(&choose(Choice::Any).unwrap(), Bounds::default()).unwrap());
        let graph = Arc::new(Csr::from_pairs(2, [(0, 1), (1, 0)].into_iter()));
        let network = NetworkData {
            graph: &graph,
            stiffness: &[1.0, 1.0],
            anchor: &[0.0, 0.0],
            inverse_length: &[1.0, 1.0],
            constraint: &[Constraint::Held, Constraint::Free],
        };
        let mut network = GpuNetwork::new(Arc::clone(&device), &network).unwrap();

        // A copy longer than its buffer is refused, and only that.
        let small = device.filled("small", &[0u32; 4]);
        let refused = device.guarded(|| {
            device.write(&small, &[0u32; 8]);
            Ok(())
        });
        assert!(matches!(refused, Err(BackendError::Device { .. })), "{refused:?}");
        network.start(&[DVec3::ONE; 2]).unwrap();
        network.sweep(&[]).unwrap();

        device.device.destroy();
        // Nothing is waited for here, so the loss may show only at the next result.
        drop(network.start(&[DVec3::ONE; 2]));
        assert!(matches!(network.sweep(&[]), Err(BackendError::Device { .. })));
        assert!(matches!(network.correction(), Err(BackendError::Device { .. })));
    }
}
