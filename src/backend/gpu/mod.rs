//! The GPU backend: WGSL compute shaders through wgpu, in f32.
//!
//! It runs on any adapter with WebGPU's default limits and uses no optional feature. A network's
//! matrix may be larger than one storage binding. It is then split into chunks of rows, each with
//! buffers of its own.

mod adapter;
mod device;
mod edges;
mod hierarchy;
mod network;
mod pipeline;
mod smoother;

use std::sync::Arc;

pub use adapter::{Choice, adapters};
use device::Device;

use super::{Backend, BackendError, BackendInfo, DeviceNetwork, DeviceSmoother, EdgeStiffness, LevelData, NetworkData};

/// Bounds tighter than the adapter's own. With them tests reach code that otherwise only the
/// largest meshes reach.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bounds {
    /// Most bytes in one binding of a matrix or of a chunk of edges.
    pub matrix_bytes: Option<u64>,
    /// Most workgroups in one dimension.
    pub workgroups: Option<u32>,
}

/// The GPU backend.
#[derive(Clone, Debug)]
pub struct GpuBackend {
    device: Arc<Device>,
}

impl GpuBackend {
    /// Opens the best adapter of this choice.
    ///
    /// # Errors
    /// - [`BackendError::NoAdapter`]: there is none
    /// - [`BackendError::Device`]: the adapter does not open, or does not compile the kernels
    pub fn new(choice: Choice) -> Result<Self, BackendError> {
        Self::with_bounds(choice, Bounds::default())
    }

    /// [`GpuBackend::new`] within these bounds.
    ///
    /// # Errors
    /// As for [`GpuBackend::new`].
    pub fn with_bounds(choice: Choice, bounds: Bounds) -> Result<Self, BackendError> {
        Ok(Self { device: Arc::new(Device::open(&adapter::choose(choice)?, bounds)?) })
    }

    /// Whether the adapter is a software adapter, which runs on the CPU. A software adapter rounds
    /// each operation as the CPU does; hardware may contract `a * b + c`.
    pub fn is_software(&self) -> bool {
        self.device.info.device_type == wgpu::DeviceType::Cpu
    }
}

impl Backend for GpuBackend {
    fn info(&self) -> BackendInfo {
        BackendInfo { kind: "gpu", adapter: self.device.info.name.clone(), driver: adapter::driver(&self.device.info) }
    }

    fn epsilon(&self) -> f64 {
        f64::from(f32::EPSILON)
    }

    fn edge_stiffness(&self, input: &EdgeStiffness) -> Result<Vec<f64>, BackendError> {
        edges::stiffness(&self.device, input)
    }

    fn upload(&self, network: &NetworkData) -> Result<Box<dyn DeviceNetwork>, BackendError> {
        Ok(Box::new(network::GpuNetwork::new(Arc::clone(&self.device), network)?))
    }

    fn upload_hierarchy(&self, levels: &[LevelData]) -> Result<Box<dyn DeviceNetwork>, BackendError> {
        Ok(Box::new(hierarchy::GpuHierarchy::new(Arc::clone(&self.device), levels)?))
    }

    fn smoother(&self) -> Box<dyn DeviceSmoother> {
        Box::new(smoother::GpuSmoother::new(Arc::clone(&self.device)))
    }
}
