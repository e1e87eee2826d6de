//! A list of commands for the device. It notes when passes over kernels begin and end, if times are
//! wanted.
//!
//! The device writes two time stamps for each pass. They are copied at the end of the submission,
//! and read when the host waits for an answer anyway. So times change neither results nor the
//! number of submissions and reads.

use std::ops::{Deref, DerefMut};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Mutex, PoisonError};

use bytemuck::pod_collect_to_vec;
use wgpu::{
    Buffer, BufferAsyncError, BufferDescriptor, BufferUsages, CommandBuffer, CommandEncoder, ComputePass,
    ComputePassDescriptor, ComputePassTimestampWrites, Device, MapMode, QUERY_SIZE, QuerySet, QuerySetDescriptor,
    QueryType, Queue,
};

/// Most passes of a submission that are timed. Those of 16 cycles over 10 levels are 336. A device
/// has sets of at most 4096 stamps.
const PASSES: u32 = 2048;

/// Commands that are recorded.
pub(super) struct Commands {
    encoder: CommandEncoder,
    stamps: Option<Stamps>,
}

/// The time stamps of a submission.
struct Stamps {
    set: QuerySet,
    used: u32,
}

/// Time stamps on their way to the host.
#[derive(Debug)]
struct Pending {
    staging: Buffer,
    mapped: Receiver<Result<(), BufferAsyncError>>,
}

/// The times of a device's kernels.
#[derive(Debug)]
pub(super) struct Clock {
    /// Nanoseconds of a tick.
    period: f64,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    pending: Vec<Pending>,
    seconds: f64,
}

impl Commands {
    pub(super) fn new(device: &Device, encoder: CommandEncoder, is_timed: bool) -> Self {
        let set = || {
            let (label, ty, count) = (Some("times"), QueryType::Timestamp, 2 * PASSES);
            device.create_query_set(&QuerySetDescriptor { label, ty, count })
        };
        Self { encoder, stamps: is_timed.then(|| Stamps { set: set(), used: 0 }) }
    }

    /// Begins a pass over kernels.
    pub(super) fn pass(&mut self) -> ComputePass<'_> {
        let timestamp_writes = self.stamps.as_mut().filter(|stamps| stamps.used < 2 * PASSES).map(|stamps| {
            let first = stamps.used;
            stamps.used += 2;
            ComputePassTimestampWrites {
                query_set: &stamps.set,
                beginning_of_pass_write_index: Some(first),
                end_of_pass_write_index: Some(first + 1),
            }
        });
        self.encoder.begin_compute_pass(&ComputePassDescriptor { label: None, timestamp_writes })
    }

    /// The commands, and the array that gets their time stamps.
    fn finish(mut self, device: &Device) -> (CommandBuffer, Option<Buffer>) {
        let stamps = self.stamps.filter(|stamps| stamps.used > 0).map(|Stamps { set, used }| {
            let size = u64::from(used * QUERY_SIZE);
            let buffer = |usage| {
                device.create_buffer(&BufferDescriptor { label: Some("times"), size, usage, mapped_at_creation: false })
            };
            let resolved = buffer(BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC);
            let staging = buffer(BufferUsages::COPY_DST | BufferUsages::MAP_READ);
            self.encoder.resolve_query_set(&set, 0..used, &resolved, 0);
            self.encoder.copy_buffer_to_buffer(&resolved, 0, &staging, 0, size);
            staging
        });
        (self.encoder.finish(), stamps)
    }
}

impl Deref for Commands {
    type Target = CommandEncoder;

    fn deref(&self) -> &CommandEncoder {
        &self.encoder
    }
}

impl DerefMut for Commands {
    fn deref_mut(&mut self) -> &mut CommandEncoder {
        &mut self.encoder
    }
}

impl Clock {
    pub(super) fn new(queue: &Queue) -> Self {
        Self { period: f64::from(queue.get_timestamp_period()), state: Mutex::default() }
    }

    /// Submits commands.
    pub(super) fn submit(clock: Option<&Self>, device: &Device, queue: &Queue, commands: Commands) {
        let (commands, stamps) = commands.finish(device);
        queue.submit([commands]);
        if let (Some(clock), Some(staging)) = (clock, stamps) {
            let (sender, mapped) = channel();
            // The clock outlives its device's answers. If it does not, nobody needs them.
            staging.map_async(MapMode::Read, .., move |result| drop(sender.send(result)));
            clock.state.lock().unwrap_or_else(PoisonError::into_inner).pending.push(Pending { staging, mapped });
        }
    }

    /// Adds the passes whose time stamps have arrived. The device's answers were waited for.
    pub(super) fn collect(&self) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let mut seconds = 0.0;
        state.pending.retain(|Pending { staging, mapped }| match mapped.try_recv() {
            Ok(Ok(())) => {
                if let Ok(view) = staging.get_mapped_range(..) {
                    let stamps: Vec<[u64; 2]> = pod_collect_to_vec(&view);
                    let ticks: u64 = stamps.iter().map(|[begin, end]| end.saturating_sub(*begin)).sum();
                    seconds += 1e-9 * self.period * ticks as f64;
                }
                false
            }
            // The device failed, which the caller finds.
            Ok(Err(_)) => false,
            Err(_) => true,
        });
        state.seconds += seconds;
    }

    /// Seconds of the passes so far.
    pub(super) fn seconds(&self) -> f64 {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).seconds
    }
}
