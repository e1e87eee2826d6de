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

/// What the kernel writes for a block with a change that is not finite.
pub const LARGEST: f64 = 1.7e308;

/// Accelerates blocks of [`BLOCK`] vertices: `e_new = e + P (relaxation c + momentum (e -
/// e_previous))`, with the correction `c` of the cycle. Both number types are those of the kernel,
/// so there is no other twin.
///
/// - `first_row`: first row of the first block, a multiple of [`BLOCK`]
/// - `rows`: `P` is [`DoubleRows::project`]
/// - `inverse_length` `[n_vertices]`: one over the length of each vertex's shortest edge
/// - `e` `[n_vertices]`: correction before the cycle, in the unit of a displacement
/// - `of_cycle` `[n_vertices]`: correction of the cycle, which began at zero
/// - `e_previous` `[rows of the blocks]`: on entry the correction one cycle earlier, on exit the
///   new correction
/// - `largest` `[blocks]`: receives the largest `|P (...) * inverse_length|^2` of each block, NaN
///   if the block has a NaN
///
/// Source: Chebyshev semi-iteration (Golub and Varga 1961) with a cycle in place of a sweep.
#[allow(clippy::too_many_arguments)]
pub fn run(
    [relaxation, momentum]: [f64; 2],
    first_row: usize,
    mut rows: impl DoubleRows,
    inverse_length: &[f64],
    e: &[[f64; 4]],
    of_cycle: &[[f32; 4]],
    e_previous: &mut [[f64; 4]],
    largest: &mut [f64],
) {
    for (block, (previous, largest)) in e_previous.chunks_mut(BLOCK).zip(largest).enumerate() {
        *largest = 0.0;
        for (row, previous) in (first_row + block * BLOCK..).zip(previous) {
            let (now, found) = (e[row], of_cycle[row]);
            let update =
                [0, 1, 2].map(|axis| relaxation * f64::from(found[axis]) + momentum * (now[axis] - previous[axis]));
            let [x, y, z] = rows.project(row, update);
            *previous = [now[0] + x, now[1] + y, now[2] + z, 0.0];
            let squared = [x, y, z].iter().map(|step| (step * inverse_length[row]).powi(2)).sum();
            *largest = largest.max_magnitude(squared);
        }
    }
}
