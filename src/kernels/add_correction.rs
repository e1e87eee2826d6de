//! The end of a pass: its correction is added to the displacement. Twin of
//! `kernels/add_correction.wgsl`.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

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

/// The largest squared correction of a block of vertices, in shortest edges;
/// [`LARGEST`](super::block::LARGEST) if one is not finite. Both numbers are those of the kernel,
/// so there is no other twin.
///
/// - `block`: correction, and one over the length of the shortest edge, of at most 256 vertices
pub fn run(block: impl Iterator<Item = (DVec3, f64)>) -> f64 {
    let squared = |(correction, inverse_length): (DVec3, f64)| bounded(square(correction * inverse_length));
    joined(block.map(squared), f64::max)
}

/// The square of a vector, in the order of operations of the kernels.
#[inline(always)]
pub(super) fn square(v: DVec3) -> f64 {
    v.x * v.x + v.y * v.y + v.z * v.z
}
