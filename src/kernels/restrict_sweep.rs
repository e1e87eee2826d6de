//! The load of a coarser level of a multigrid hierarchy, and the level's first sweep from a
//! correction of zero. Twin of `kernels/restrict_sweep.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::row::Rows;
use super::transfer::Weights;
use super::{Real, first_sweep, transfer};

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
    /// Not used.
    pub padding: u32,
}

/// Transfers the defect of the next finer level, and takes the first sweep: [`transfer::run`] and
/// [`first_sweep::run`] over all rows of a level.
///
/// - `constraint` `[n_targets]`: of the level that receives
/// - `source` `[n_sources]`: the defect, in the unit of a displacement; the fourth component is 0
/// - `load` `[n_targets]`: receives the load; the fourth component does not change
/// - `e` `[n_targets]`: receives the correction. The kernel sets the correction before the sweep to
///   zero too
pub fn run<T: Real>(
    weights: &Weights<T>,
    constraint: &[[T; 4]],
    relaxation: T,
    source: &[[T; 4]],
    load: &mut [[T; 4]],
    e: &mut [[T; 4]],
) {
    transfer::run(0, weights, constraint, T::ZERO, source, load);
    // A first sweep reads no springs.
    let rows = Rows { row_start: &[], columns: &[], stiffness: &[], constraint, load, anchor: &[] };
    first_sweep::run(0, &rows, relaxation, e);
}
