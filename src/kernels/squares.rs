//! Sums of squares of a residual. Twin of `kernels/squares.wgsl`.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::add_correction::square;
use super::block::{bounded, joined};

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// Number of vertices.
    pub n_vertices: u32,
    /// Not used.
    pub padding: u32,
}

/// The sum of the squares of a block of residuals; [`LARGEST`](super::block::LARGEST) if it is not
/// finite. Both numbers are those of the kernel, so there is no other twin.
///
/// - `block`: at most 256 residuals
pub fn run(block: impl Iterator<Item = DVec3>) -> f64 {
    bounded(joined(block.map(square), |a, b| a + b))
}
