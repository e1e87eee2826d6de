//! Selection of the backend: the user's choice, or the best one available.

use super::cpu::CpuBackend;
use super::{Backend, BackendError, Precision};

/// The user's choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Selection {
    /// A hardware GPU if there is one, otherwise the CPU in f64.
    #[default]
    Auto,
    /// A GPU: a hardware adapter if there is one, otherwise a software adapter, otherwise an error.
    Gpu,
    /// The CPU in f64.
    Cpu,
}

/// The variable of the environment with the number of moving vertices from which a GPU relaxes a
/// network; see [`Backend::takes`].
#[cfg(feature = "gpu")]
const VERTICES: &str = "IDMESH_GPU_VERTICES";

/// The backend for a selection. `Gpu` never falls back to the CPU, because the user would report a
/// wrong timing.
///
/// # Errors
/// - [`BackendError::Variable`]: `IDMESH_GPU_VERTICES` is no number of vertices
/// - [`BackendError::NoAdapter`]: the user chose a GPU and there is none
/// - [`BackendError::Device`]: the selected adapter does not start
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
    Ok(Box::new(super::gpu::GpuBackend::with_bounds(super::gpu::Choice::Any, bounds()?)?))
}

#[cfg(feature = "gpu")]
fn hardware_gpu() -> Result<Box<dyn Backend>, BackendError> {
    Ok(Box::new(super::gpu::GpuBackend::with_bounds(super::gpu::Choice::Hardware, bounds()?)?))
}

#[cfg(feature = "gpu")]
fn bounds() -> Result<super::gpu::Bounds, BackendError> {
    let wrong = |value: String| BackendError::Variable { name: VERTICES, value, expected: "a number of vertices" };
    let least_vertices = match std::env::var_os(VERTICES) {
        None => None,
        Some(value) => {
            let value = value.to_string_lossy().into_owned();
            Some(value.parse().map_err(|_| wrong(value))?)
        }
    };
    Ok(super::gpu::Bounds { least_vertices, ..super::gpu::Bounds::default() })
}

#[cfg(feature = "gpu")]
pub use super::gpu::adapters;

#[cfg(not(feature = "gpu"))]
fn gpu() -> Result<Box<dyn Backend>, BackendError> {
    Err(BackendError::NoAdapter("this idmesh was built without the gpu feature".to_owned()))
}

#[cfg(not(feature = "gpu"))]
use gpu as hardware_gpu;

/// The system's adapters: none, because this idmesh was built without the gpu feature.
#[cfg(not(feature = "gpu"))]
pub fn adapters() -> Vec<super::AdapterSummary> {
    Vec::new()
}
