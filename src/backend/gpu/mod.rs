//! The GPU backend: WGSL compute shaders through wgpu, in f32.
//!
//! Works on any adapter with WebGPU's default limits: no optional feature is asked for. A network's matrix may be larger
//! than one storage binding: it is split into chunks of rows with buffers of their own.

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

/// Bounds tighter than the adapter's own, so that tests reach what otherwise only the largest meshes do.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bounds {
    /// Most bytes in one binding of a matrix or of a chunk of edges.
    pub matrix_bytes: Option<u64>,
    /// Most workgroups in one dimension.
    pub workgroups: Option<u32>,
}

/// Relaxes networks on a GPU.
#[derive(Clone, Debug)]
pub struct GpuBackend {
    device: Arc<Device>,
}

impl GpuBackend {
    /// Opens the best adapter of this choice.
    ///
    /// # Errors
    /// [`BackendError::NoAdapter`] if there is none, [`BackendError::Device`] if it refuses to open or to compile the
    /// kernels.
    pub fn new(choice: Choice) -> Result<Self, BackendError> {
        Self::with_bounds(choice, Bounds::default())
    }

    /// As [`GpuBackend::new`], within these bounds.
    ///
    /// # Errors
    /// As [`GpuBackend::new`].
    pub fn with_bounds(choice: Choice, bounds: Bounds) -> Result<Self, BackendError> {
        Ok(Self { device: Arc::new(Device::open(&adapter::choose(choice)?, bounds)?) })
    }

    /// Whether the adapter is the CPU in disguise. Such an adapter rounds each operation as the CPU does; hardware may
    /// contract `a * b + c`.
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
