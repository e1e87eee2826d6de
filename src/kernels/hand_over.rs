//! The load that a multigrid cycle in f32 receives from a correction in f64. Twin of
//! `kernels/hand_over.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::row::DoubleRows;

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// First row of the chunk, a multiple of 256.
    pub first_row: u32,
    /// Number of the chunk's rows.
    pub n_rows: u32,
    /// 1 if the correction is zero everywhere, otherwise 0.
    pub is_zero: u32,
    /// Not used.
    pub padding: u32,
}

/// Hands the projected residual of a chunk of rows over, rounded to f32. Both number types are
/// those of the kernel, so there is no other twin.
///
/// - `first_row`: row of the chunk's first element
/// - `e` `[n_vertices]`: correction, in the unit of a displacement; `None` if it is zero
///   everywhere. The residual is then the load, and no spring is read
/// - `handed` `[n_rows of the chunk]`: receives `P r`, see [`project`] and [`residual`]; with
///   `N = 4` the fourth component does not change
///
/// [`project`]: super::constraint::project
/// [`residual`]: super::row::residual
pub fn run<const N: usize>(
    first_row: usize,
    mut rows: impl DoubleRows<N>,
    e: Option<&[[f64; N]]>,
    handed: &mut [[f32; N]],
) {
    for (row, handed) in (first_row..).zip(handed) {
        let left = match e {
            None => rows.load(row),
            Some(e) => rows.residual(e, row),
        };
        let left = rows.project(row, left);
        for axis in 0..N / 3 * 3 {
            handed[axis] = left[axis] as f32;
        }
    }
}
