//! The residual of a correction: the part of the load that the correction does not balance. Twin of
//! `kernels/defect.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::Real;
use super::constraint::project;
use super::row::{Rows, residual};

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// First row of the chunk, a multiple of 256.
    pub first_row: u32,
    /// Number of the chunk's rows.
    pub n_rows: u32,
}

/// Residual of a chunk of rows, projected on the directions of each vertex's constraint.
///
/// - `first_row`: row of the chunk's first element
/// - `e` `[n_vertices]`: correction, in the unit of a displacement
/// - `defect` `[n_rows of the chunk]`: receives `P r`, see [`project`] and [`residual`]; with
///   `N = 4` the fourth component is 0
pub fn run<T: Real, const N: usize>(first_row: usize, rows: &Rows<T, N>, e: &[[T; N]], defect: &mut [[T; N]]) {
    for (row, defect) in (first_row..).zip(defect) {
        *defect = project(&rows.constraint[row], residual(rows, e, row));
    }
}
