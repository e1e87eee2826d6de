//! Loads of springs whose rest edges turn with their ends. Twin of `kernels/rest_load.wgsl`.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::turn::Turn;

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// First row of the chunk; 0 if the rows are listed.
    pub first_row: u32,
    /// Number of rows.
    pub n_rows: u32,
    /// 1 if the rows are listed, otherwise 0.
    pub is_listed: u32,
    /// Not used.
    pub padding: u32,
    /// One over the unit of the loads in the unit of the positions, a power of two.
    pub scale: f64,
}

/// Load of a row: `sum_j k_ij ((R_i + R_j) / 2 - 1) (X_i - X_j)`, in the unit of a displacement.
/// Both numbers are those of the kernel, so there is no other twin.
///
/// - `springs`: neighbour and stiffness over the row's total, in CSR order
/// - `positions` `[n_vertices]`: undeformed, in the mesh's unit
/// - `turns` `[n_vertices]`: the rotations R
#[inline(always)]
pub fn run(springs: impl Iterator<Item = (u32, f64)>, positions: &[DVec3], turns: &[Turn], row: usize) -> DVec3 {
    let own = positions[row];
    let (mut by_others, mut arms) = (DVec3::ZERO, DVec3::ZERO);
    for (other, k) in springs {
        let other = other as usize;
        let arm = own - positions[other];
        arms += k * arm;
        by_others += k * turns[other].half_displacement(arm);
    }
    turns[row].half_displacement(arms) + by_others
}
