//! The last step of a multigrid cycle whose correction is in f64: acceleration by Chebyshev's
//! coefficients. Twin of `kernels/accelerate_double.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::Real;
use super::convergence::BLOCK;
use super::row::DoubleRows;

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// First row of the chunk, a multiple of [`BLOCK`].
    pub first_row: u32,
    /// Number of the chunk's rows.
    pub n_rows: u32,
    /// Place of the cycle's first block among the results of a batch.
    pub first_partial: u32,
    /// Not used.
    pub padding: u32,
    /// Factor of the cycle's correction, without unit.
    pub relaxation: f64,
    /// Factor of the last change, without unit.
    pub momentum: f64,
}

/// Accelerates blocks of [`BLOCK`] vertices: `e_new = e + P (relaxation c + momentum (e -
/// e_previous))`, with the correction `c` of the cycle. Both number types are those of the kernel,
/// so there is no other twin.
///
/// - `relaxation`, `momentum`: of each component. Of a design whose factors are 0 nothing changes
/// - `first_row`: first row of the first block, a multiple of [`BLOCK`]
/// - `rows`: `P` is [`DoubleRows::project`]
/// - `inverse_length` `[n_vertices]`: one over the length of each vertex's shortest edge
/// - `e` `[n_vertices]`: correction before the cycle, in the unit of a displacement
/// - `of_cycle` `[n_vertices]`: correction of the cycle, which began at zero
/// - `e_previous` `[rows of the blocks]`: on entry the correction one cycle earlier, on exit the
///   new correction
/// - `largest` `[blocks]`: receives the largest `|P (...) * inverse_length|^2` of each block, one
///   number for each design, NaN if the block has a NaN. Components that are left are 0
///
/// Source: Chebyshev semi-iteration (Golub and Varga 1961) with a cycle in place of a sweep.
#[allow(clippy::too_many_arguments)]
pub fn run<const N: usize>(
    [relaxation, momentum]: [[f64; N]; 2],
    first_row: usize,
    mut rows: impl DoubleRows<N>,
    inverse_length: &[f64],
    e: &[[f64; N]],
    of_cycle: &[[f32; N]],
    e_previous: &mut [[f64; N]],
    largest: &mut [[f64; N]],
) {
    for (block, (previous, largest)) in e_previous.chunks_mut(BLOCK).zip(largest).enumerate() {
        *largest = [0.0; N];
        for (row, previous) in (first_row + block * BLOCK..).zip(previous) {
            let (now, found) = (e[row], of_cycle[row]);
            let mut update = [0.0; N];
            for axis in 0..N {
                update[axis] =
                    relaxation[axis] * f64::from(found[axis]) + momentum[axis] * (now[axis] - previous[axis]);
            }
            let step = rows.project(row, update);
            for axis in 0..N {
                previous[axis] = now[axis] + step[axis];
            }
            for design in 0..N / 3 {
                let d = [0, 1, 2].map(|axis| step[3 * design + axis] * inverse_length[row]);
                let squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                largest[design] = largest[design].max_magnitude(squared);
            }
        }
    }
}
