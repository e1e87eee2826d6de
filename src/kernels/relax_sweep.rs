//! One sweep over a spring network. Twin of `kernels/relax_sweep.wgsl`.

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
    /// Factor of the residual, without unit.
    pub relaxation: f32,
    /// Factor of the last change, without unit.
    pub momentum: f32,
}

/// One sweep over a chunk of rows: `e_new = e + P (relaxation * r + momentum * (e - e_previous))`.
///
/// - `first_row`: row of the chunk's first element
/// - `e` `[n_vertices]`: correction, in the unit of a displacement
/// - `e_previous` `[n_rows of the chunk]`: on entry the correction one sweep earlier, on exit the
///   new correction. A row reads only its own element. With `N = 4` the fourth components of `e`
///   and `e_previous` are 0
///
/// `r` is [`residual`], `P` is [`project`]. A row without stiffness keeps its correction, and so
/// does a held one.
///
/// Source: weighted Jacobi for `momentum = 0`; with both factors the second-order recurrence of
/// Chebyshev semi-iteration (Golub and Varga 1961).
pub fn run<T: Real, const N: usize>(
    first_row: usize,
    rows: &Rows<T, N>,
    relaxation: T,
    momentum: T,
    e: &[[T; N]],
    e_previous: &mut [[T; N]],
) {
    for (row, previous) in (first_row..).zip(e_previous) {
        let own = e[row];
        let r = residual(rows, e, row);
        let mut update = [T::ZERO; N];
        for axis in 0..N {
            update[axis] = relaxation * r[axis] + momentum * (own[axis] - previous[axis]);
        }
        let step = project(&rows.constraint[row], update);
        for axis in 0..N {
            previous[axis] = own[axis] + step[axis];
        }
    }
}
