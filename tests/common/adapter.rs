//! The adapter GPU tests run on.

use idmesh::backend::Precision;
use idmesh::backend::gpu::{Bounds, Choice, GpuBackend};

/// The adapter under test in f32, for networks of every size.
pub fn single() -> Option<GpuBackend> {
    gpu(Bounds { arithmetic: Some(Precision::F32), least_vertices: Some(0), ..Bounds::default() })
}

/// The adapter under test; none where the user said so.
pub fn gpu(bounds: Bounds) -> Option<GpuBackend> {
    if std::env::var("IDMESH_TEST_GPU").is_ok_and(|value| value == "off") {
        let thread = std::thread::current();
        eprintln!("SKIPPED by IDMESH_TEST_GPU=off: {}", thread.name().unwrap_or("a GPU test"));
        return None;
    }
    match GpuBackend::with_bounds(Choice::Any, bounds) {
        Ok(backend) => Some(backend),
        Err(error) => panic!("{error}; to go without, set IDMESH_TEST_GPU=off"),
    }
}
