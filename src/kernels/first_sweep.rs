//! The first sweep over a spring network from a correction of zero. Twin of
//! `kernels/first_sweep.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::Real;
use super::constraint::project;
use super::row::Rows;

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

/// The first sweep over a chunk of rows: `e = P (relaxation * load)`. It has the bits of
/// [`relax_sweep::run`](super::relax_sweep::run) from zero without momentum, apart from signs of
/// zeros, and reads no spring.
///
/// - `first_row`: row of the chunk's first element
/// - `e` `[n_rows of the chunk]`: receives the correction, in the unit of a displacement. The
///   kernel sets the correction before the sweep to zero too, the CPU backend does so by itself
pub fn run<T: Real, const N: usize>(first_row: usize, rows: &Rows<T, N>, relaxation: T, e: &mut [[T; N]]) {
    for (row, e) in (first_row..).zip(e) {
        *e = project(&rows.constraint[row], rows.load(row).map(|load| relaxation * load));
    }
}
