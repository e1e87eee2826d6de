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

/// The variable of the environment that has a GPU time its kernels, with the value `1`.
#[cfg(feature = "gpu")]
const TIMES: &str = "IDMESH_GPU_TIMES";

/// The backend for a selection. `Gpu` never falls back to the CPU, because the user would report a
/// wrong timing.
///
/// # Errors
/// - [`BackendError::Variable`]: `IDMESH_GPU_VERTICES` is no number of vertices, or
///   `IDMESH_GPU_TIMES` neither `0` nor `1`
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
    let least_vertices = variable(VERTICES, "a number of vertices", |value| value.parse().ok())?;
    let times = variable(TIMES, "`0` or `1`", |value| ["0", "1"].iter().position(|&word| word == value))?;
    Ok(super::gpu::Bounds { least_vertices, times: times == Some(1), ..super::gpu::Bounds::default() })
}

/// The meaning of a variable of the environment; `None` if it is not set.
///
/// - `expected`: what it may be
#[cfg(feature = "gpu")]
fn variable<T>(
    name: &'static str,
    expected: &'static str,
    meaning: impl Fn(&str) -> Option<T>,
) -> Result<Option<T>, BackendError> {
    let Some(value) = std::env::var_os(name) else { return Ok(None) };
    let value = value.to_string_lossy().into_owned();
    match meaning(&value) {
        Some(meaning) => Ok(Some(meaning)),
        None => Err(BackendError::Variable { name, value, expected }),
    }
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
