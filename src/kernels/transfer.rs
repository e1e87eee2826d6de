//! From one level of a hierarchy of networks to the next, either way; twin of `kernels/transfer.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::Real;
use super::constraint::project;

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// First row of the chunk, a multiple of 256.
    pub first_row: u32,
    /// Number of its rows.
    pub n_rows: u32,
    /// Factor of what stands in the target.
    pub keep: f32,
    /// Not used.
    pub padding: u32,
}

/// Weights between the vertices of two levels as the twin reads them.
#[derive(Clone, Copy, Debug)]
pub struct Weights<'a, T> {
    /// Where each row starts in `columns` and `weights` `[n_targets + 1]`.
    pub row_start: &'a [u32],
    /// Sources `[n_entries]`.
    pub columns: &'a [u32],
    /// Weight of each source `[n_entries]`.
    pub weights: &'a [T],
}

/// A chunk of rows: `target_i = keep target_i + P_i sum_j w_ij source_j`. The fourth component of `target` stays.
///
/// - `first_row`: row of the chunk's first element
/// - `constraint` `[n_targets]`: see [`project`]
/// - `source` `[n_sources]`: its fourth component is 0
/// - `target` `[n_rows of the chunk]`
pub fn run<T: Real>(
    first_row: usize,
    weights: &Weights<T>,
    constraint: &[[T; 4]],
    keep: T,
    source: &[[T; 4]],
    target: &mut [[T; 4]],
) {
    for (row, target) in (first_row..).zip(target) {
        let range = weights.row_start[row] as usize..weights.row_start[row + 1] as usize;
        // Four components, of which one is idle: they fill whole vector registers.
        let mut sum = [T::ZERO; 4];
        for (&column, &weight) in weights.columns[range.clone()].iter().zip(&weights.weights[range]) {
            let source = &source[column as usize];
            for axis in 0..4 {
                sum[axis] = sum[axis] + weight * source[axis];
            }
        }
        let sum = project(&constraint[row], sum);
        let keep = [keep, keep, keep, T::ONE];
        for axis in 0..4 {
            target[axis] = keep[axis] * target[axis] + sum[axis];
        }
    }
}
