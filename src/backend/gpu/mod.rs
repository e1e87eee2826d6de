//! The GPU backend: WGSL compute shaders through wgpu.
//!
//! It runs on any adapter with WebGPU's default limits. Where the adapter has numbers in f64 and
//! passes a test at its start, loads and corrections of multigrid cycles are in f64, as on the CPU;
//! elsewhere all is in f32. A network's matrix may be larger than one storage binding. It is then
//! split into chunks of rows, each with buffers of its own.

mod adapter;
mod coarse;
mod commands;
mod copying;
mod device;
mod double_hierarchy;
mod hierarchy;
mod levels;
mod network;
mod pipeline;
mod residency;
mod smoother;
mod start_test;
mod start_test_resident;

use std::sync::Arc;

pub use adapter::Choice;
use device::Device;
use pipeline::Pipeline;
pub use start_test::StartTest;
use wgpu::Adapter;

use super::{
    AdapterSummary, Backend, BackendError, BackendInfo, CpuBackend, DeviceNetwork, DeviceSmoother, DeviceTimes,
    DeviceWork, EdgeStiffness, LevelData, NetworkData, Precision,
};
use crate::kernels::OfDoubleKernels;

/// Number of moving vertices from which a network is relaxed on the GPU. The sweeps of a smaller
/// network take the CPU less time than a GPU's answers take. Not measured on hardware.
const LEAST_VERTICES: usize = 10_000;

/// Bounds tighter than the adapter's own, and what is measured. With the bounds tests reach code
/// that otherwise only the largest meshes or other adapters reach.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bounds {
    /// Most bytes in one binding of a matrix.
    pub matrix_bytes: Option<u64>,
    /// Most workgroups in one dimension.
    pub workgroups: Option<u32>,
    /// `F32`: the arithmetic of an adapter without f64.
    pub arithmetic: Option<Precision>,
    /// Number of moving vertices from which the GPU relaxes a network.
    pub least_vertices: Option<usize>,
    /// Whether the GPU times its kernels, where the adapter has time stamps.
    pub times: bool,
}

/// The GPU backend.
#[derive(Clone, Debug)]
pub struct GpuBackend {
    device: Arc<Device>,
    least_vertices: usize,
}

/// The system's adapters that can run the kernels, the preferred one first. Each is opened, because
/// its arithmetic shows only then.
pub fn adapters() -> Vec<AdapterSummary> {
    adapter::adapters(|adapter| open(adapter, Bounds::default()).map_or(Precision::F32, |device| device.arithmetic()))
}

/// Opens an adapter, and tests its arithmetic.
fn open(adapter: &Adapter, bounds: Bounds) -> Result<Device, BackendError> {
    let mut device = Device::open(adapter, bounds)?;
    let kernels = device.double_pipelines.take();
    if let Some(kernels) = kernels {
        device.start_tests = start_tests(&device, &kernels);
        device.double_pipelines = Some(kernels).filter(|_| device.start_tests.iter().all(|test| test.passes));
    }
    Ok(device)
}

/// Tests the device's kernels in f64.
fn start_tests(device: &Device, kernels: &OfDoubleKernels<Pipeline>) -> Vec<StartTest> {
    let (of_cycles, of_residencies) = (start_test::run(device, kernels), start_test_resident::run(device, kernels));
    of_cycles.into_iter().chain(of_residencies).collect()
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
        let device = Arc::new(open(&adapter::choose(choice)?, bounds)?);
        Ok(Self { device, least_vertices: bounds.least_vertices.unwrap_or(LEAST_VERTICES) })
    }

    /// What the tests of the kernels in f64 found when the adapter was opened. Empty if it has no
    /// f64.
    pub fn start_tests(&self) -> &[StartTest] {
        &self.device.start_tests
    }

    /// Whether the adapter is a software adapter, which runs on the CPU. A software adapter rounds
    /// each operation as the CPU does; hardware may contract `a * b + c`.
    pub fn is_software(&self) -> bool {
        self.device.info.device_type == wgpu::DeviceType::Cpu
    }
}

impl Backend for GpuBackend {
    fn info(&self) -> BackendInfo {
        BackendInfo {
            kind: "gpu",
            adapter: self.device.info.name.clone(),
            driver: adapter::driver(&self.device.info),
            arithmetic: self.device.arithmetic(),
        }
    }

    fn work(&self) -> Option<DeviceWork> {
        Some(self.device.work())
    }

    fn times(&self) -> Option<DeviceTimes> {
        Some(self.device.times())
    }

    fn copying(&self) -> Result<Option<f64>, BackendError> {
        copying::copying(&self.device).map(Some)
    }

    fn takes(&self, n_moving: usize) -> bool {
        n_moving >= self.least_vertices
    }

    fn edge_stiffness(&self, input: &EdgeStiffness) -> Result<Vec<f64>, BackendError> {
        CpuBackend::new(Precision::F64).edge_stiffness(input)
    }

    fn upload(&self, network: &NetworkData) -> Result<Box<dyn DeviceNetwork>, BackendError> {
        Ok(Box::new(network::GpuNetwork::new(Arc::clone(&self.device), network)?))
    }

    fn upload_hierarchy(&self, levels: &[LevelData]) -> Result<Box<dyn DeviceNetwork>, BackendError> {
        let device = Arc::clone(&self.device);
        Ok(match self.device.arithmetic() {
            Precision::F64 => Box::new(double_hierarchy::GpuDoubleHierarchy::new(device, levels)?),
            Precision::F32 => Box::new(hierarchy::GpuHierarchy::new(device, levels)?),
        })
    }

    fn smoother(&self) -> Box<dyn DeviceSmoother> {
        Box::new(smoother::GpuSmoother::new(Arc::clone(&self.device)))
    }
}
