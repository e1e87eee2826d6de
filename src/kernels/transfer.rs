//! Transfer between two levels of a multigrid hierarchy, in either direction. Twin of
//! `kernels/transfer.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::Real;
use super::constraint::project;

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// First row of the chunk, a multiple of 256.
    pub first_row: u32,
    /// Number of the chunk's rows.
    pub n_rows: u32,
    /// Factor of the target's old value, without unit.
    pub keep: f32,
    /// Not used.
    pub padding: u32,
}

/// Weights between the vertices of two levels, in the layout of the twin.
#[derive(Clone, Copy, Debug)]
pub struct Weights<'a, T> {
    /// Start of each row in `columns` and `weights` `[n_targets + 1]`.
    pub row_start: &'a [u32],
    /// Source vertex of each entry `[n_entries]`.
    pub columns: &'a [u32],
    /// Weight of each entry `[n_entries]`, without unit.
    pub weights: &'a [T],
}

/// Transfers a chunk of rows: `target_i = keep target_i + P_i sum_j w_ij source_j`.
///
/// - `first_row`: row of the chunk's first element
/// - `constraint` `[n_targets]`: `P` is [`project`]
/// - `source` `[n_sources]`: in the unit of a displacement; with `N = 4` the fourth component is 0
/// - `target` `[n_rows of the chunk]`: with `N = 4` the fourth component does not change
pub fn run<T: Real, const N: usize>(
    first_row: usize,
    weights: &Weights<T>,
    constraint: &[[T; 4]],
    keep: T,
    source: &[[T; N]],
    target: &mut [[T; N]],
) {
    for (row, target) in (first_row..).zip(target) {
        let range = weights.row_start[row] as usize..weights.row_start[row + 1] as usize;
        // Four components, one of them idle, fill whole vector registers.
        let mut sum = [T::ZERO; N];
        for (&column, &weight) in weights.columns[range.clone()].iter().zip(&weights.weights[range]) {
            let source = &source[column as usize];
            for axis in 0..N {
                sum[axis] = sum[axis] + weight * source[axis];
            }
        }
        let sum = project(&constraint[row], sum);
        // What is not kept is not read either: a pass that diverged may have left a NaN.
        for axis in 0..N / 3 * 3 {
            let old = if keep == T::ZERO { T::ZERO } else { target[axis] };
            target[axis] = keep * old + sum[axis];
        }
    }
}
