//! Which backend computes: what the user asked for, or the best there is.

use super::cpu::{CpuBackend, Precision};
use super::{Backend, BackendError};

/// What the user asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Selection {
    /// A hardware GPU if there is one, else the CPU in f64.
    #[default]
    Auto,
    /// A GPU: hardware first, else a software adapter; an error if there is neither.
    Gpu,
    /// The CPU in f64.
    Cpu,
}

/// An adapter the system offers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterSummary {
    /// Its name.
    pub name: String,
    /// `"discrete GPU"`, `"integrated GPU"`, `"virtual GPU"`, `"software"` or `"other"`.
    pub kind: &'static str,
    /// Driver name and version.
    pub driver: String,
    /// The interface it is reached through: `"vulkan"`, `"metal"`, `"dx12"`.
    pub api: String,
    /// Most bytes one array may have on it.
    pub max_array_bytes: u64,
    /// Whether [`Selection::Auto`] takes it.
    pub auto: bool,
}

/// The backend for a selection. `Gpu` never falls back to the CPU: the caller would report the wrong timing.
///
/// # Errors
/// [`BackendError::NoAdapter`] if a GPU is asked for and there is none, [`BackendError::Device`] if the chosen one
/// refuses to start.
pub fn select(selection: Selection) -> Result<Box<dyn Backend>, BackendError> {
    match selection {
        Selection::Cpu => Ok(Box::new(CpuBackend::new(Precision::F64))),
        Selection::Gpu => gpu(),
        Selection::Auto => match hardware_gpu() {
            Err(BackendError::NoAdapter(_)) => Ok(Box::new(CpuBackend::new(Precision::F64))),
            found => found,
        },
    }
}

#[cfg(feature = "gpu")]
fn gpu() -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(super::gpu::GpuBackend::new(super::gpu::Choice::Any)?))
}

#[cfg(feature = "gpu")]
fn hardware_gpu() -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(super::gpu::GpuBackend::new(super::gpu::Choice::Hardware)?))
}

#[cfg(feature = "gpu")]
pub use super::gpu::adapters;

#[cfg(not(feature = "gpu"))]
fn gpu() -> Result<Box<dyn Backend>, BackendError> {
    Err(BackendError::NoAdapter("this idmesh was built without the gpu feature".to_owned()))
}

#[cfg(not(feature = "gpu"))]
use gpu as hardware_gpu;

/// The adapters the system offers: none, as this idmesh was built without the gpu feature.
#[cfg(not(feature = "gpu"))]
pub fn adapters() -> Vec<AdapterSummary> {
    Vec::new()
}
