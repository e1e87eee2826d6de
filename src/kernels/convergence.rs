//! Measures of the distance of a network from equilibrium. Twin of `kernels/convergence.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::Real;
use super::constraint::project;
use super::row::{Rows, residual};

/// Rows of one block: the size of the kernel's workgroup.
pub const BLOCK: usize = 256;

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// First row of the chunk, a multiple of [`BLOCK`].
    pub first_row: u32,
    /// Number of the chunk's rows.
    pub n_rows: u32,
}

/// Measures blocks of [`BLOCK`] rows: the sum of `|P r|^2`, and the largest
/// `|(e - snapshot) * inverse_length|^2`.
///
/// - `first_row`: first row of the first block, a multiple of [`BLOCK`]
/// - `e` `[n_vertices]`: correction, in the unit of a displacement
/// - `snapshot` `[rows of the blocks]`: the correction at the last measure
/// - `inverse_length` `[n_vertices]`: one over the length of each vertex's shortest edge
/// - `partials` `[blocks]`: sum and largest change of each block, NaN if the block has a NaN
///
/// Sums run over a binary tree, as in the kernel, so both sides round alike.
pub fn run<T: Real>(
    first_row: usize,
    rows: &Rows<T>,
    e: &[[T; 4]],
    snapshot: &[[T; 4]],
    inverse_length: &[T],
    partials: &mut [[T; 2]],
) {
    for ((first, snapshot), partial) in (first_row..).step_by(BLOCK).zip(snapshot.chunks(BLOCK)).zip(partials) {
        let mut sums = [T::ZERO; BLOCK];
        let mut largest = [T::ZERO; BLOCK];
        for (lane, snapshot) in snapshot.iter().enumerate() {
            let row = first + lane;
            let r = project(&rows.constraint[row], residual(rows, e, row));
            sums[lane] = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
            let d = [0, 1, 2].map(|axis| (e[row][axis] - snapshot[axis]) * inverse_length[row]);
            largest[lane] = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        }
        let mut half = BLOCK / 2;
        while half > 0 {
            for lane in 0..half {
                sums[lane] = sums[lane] + sums[lane + half];
                largest[lane] = largest[lane].max_magnitude(largest[lane + half]);
            }
            half /= 2;
        }
        *partial = [sums[0], largest[0]];
    }
}
