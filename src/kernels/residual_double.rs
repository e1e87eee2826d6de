//! Residual of a displacement in f64. Twin of `kernels/residual_double.wgsl`.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

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
    /// 1 if the springs have loads of their own, otherwise 0.
    pub has_rest: u32,
}

/// Residual of a row before its constraint: `sum_j k_ij (u_j - u_i) - anchor_i u_i + load_i`, in
/// the unit of `displacement`. Both numbers are those of the kernel, which has no anchors, so there
/// is no other twin.
///
/// - `springs`: neighbour and stiffness over the row's total, in CSR order
/// - `anchor`: over the row's total
/// - `displacement` `[n_vertices]`
#[inline(always)]
pub fn run(
    springs: impl Iterator<Item = (u32, f64)>,
    anchor: f64,
    load: Option<DVec3>,
    displacement: &[DVec3],
    row: usize,
) -> DVec3 {
    let own = displacement[row];
    let pulls = springs.fold(DVec3::ZERO, |sum, (other, k)| sum + k * (displacement[other as usize] - own));
    let sum = if anchor == 0.0 { pulls } else { pulls - anchor * own };
    load.map_or(sum, |load| sum + load)
}
