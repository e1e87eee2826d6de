//! What a correction leaves of the load; twin of `kernels/defect.wgsl`.

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
    /// Number of its rows.
    pub n_rows: u32,
}

/// Residual of a chunk of rows, limited to what each vertex may do.
///
/// - `first_row`: row of the chunk's first element
/// - `e` `[n_vertices]`: correction, in the unit of a displacement
/// - `defect` `[n_rows of the chunk]`: `P r`, see [`residual`] and [`project`]; its fourth component is 0
pub fn run<T: Real>(first_row: usize, rows: &Rows<T>, e: &[[T; 4]], defect: &mut [[T; 4]]) {
    for (row, defect) in (first_row..).zip(defect) {
        *defect = project(&rows.constraint[row], residual(rows, e, row));
    }
}
