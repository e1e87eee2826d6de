//! One sweep over a spring network; twin of `kernels/relax_sweep.wgsl`.

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
    /// Factor of the residual, dimensionless.
    pub relaxation: f32,
    /// Factor of the last change, dimensionless.
    pub momentum: f32,
}

/// One sweep over a chunk of rows: `e_new = e + P (relaxation * r + momentum * (e - e_previous))`.
///
/// - `first_row`: row of the chunk's first element
/// - `e` `[n_vertices]`: correction, in the unit of a displacement
/// - `e_previous` `[n_rows of the chunk]`: on entry the correction one sweep earlier, on exit the new one; a row reads
///   no other row of it
///
/// `r` is [`residual`], `P` is [`project`]. A row without stiffness keeps its correction, and so does a held one.
///
/// Source: weighted Jacobi for `momentum = 0`; with both the second-order recurrence of Chebyshev semi-iteration
/// (Golub and Varga 1961).
pub fn run<T: Real>(
    first_row: usize,
    rows: &Rows<T>,
    relaxation: T,
    momentum: T,
    e: &[[T; 4]],
    e_previous: &mut [[T; 4]],
) {
    for (row, previous) in (first_row..).zip(e_previous) {
        let own = e[row];
        let r = residual(rows, e, row);
        let update = [
            relaxation * r[0] + momentum * (own[0] - previous[0]),
            relaxation * r[1] + momentum * (own[1] - previous[1]),
            relaxation * r[2] + momentum * (own[2] - previous[2]),
        ];
        let step = project(&rows.constraint[row], update);
        *previous = [own[0] + step[0], own[1] + step[1], own[2] + step[2], T::ZERO];
    }
}
