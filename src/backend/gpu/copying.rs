//! How fast a device copies its own memory, for benchmarks.

use std::time::Instant;

use wgpu::BufferUsages;

use super::BackendError;
use super::device::Device;
use super::levels::vector;

/// Bytes of the array that is copied: more than a cache holds.
const BYTES: u64 = 256 << 20;

/// The copies go on for at least this long, s.
const LEAST_SECONDS: f64 = 0.1;

/// Bytes a second that a device reads and writes when it copies an array.
///
/// # Errors
/// The device failed.
pub(super) fn copying(device: &Device) -> Result<f64, BackendError> {
    device.guarded(|| {
        let bytes = BYTES.min(device.max_array);
        let [from, to] = ["from", "to"].map(|label| vector(device, label, bytes));
        let staging = device.buffer("staging", 16, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        let mut copies = 1;
        loop {
            let mut commands = device.encoder();
            (0..copies).for_each(|_| device.copy(&mut commands, &from, &to, bytes));
            let start = Instant::now();
            device.read::<u32>(commands, &to, &staging, 4)?;
            let seconds = start.elapsed().as_secs_f64();
            if seconds >= LEAST_SECONDS {
                return Ok((2 * bytes * copies) as f64 / seconds);
            }
            copies *= 2;
        }
    })
}
