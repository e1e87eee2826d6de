//! The end of a multigrid cycle; twin of `kernels/accelerate.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::Real;
use super::constraint::project;
use super::convergence::BLOCK;

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// Number of vertices.
    pub n_vertices: u32,
    /// Factor of the cycle's correction, dimensionless.
    pub relaxation: f32,
    /// Factor of the last change, dimensionless.
    pub momentum: f32,
    /// Not used.
    pub padding: u32,
}

/// Blocks of [`BLOCK`] vertices: `e_new = start + P (relaxation (e - start) + momentum (start - previous))`.
///
/// - `constraint` `[vertices of the blocks]`: see [`project`]. Cycles keep to it already; but with it, as in a sweep, no compiler
///   of shaders takes the sum apart and rounds otherwise
/// - `start`, `previous` `[vertices of the blocks]`: correction before the cycle, and one cycle earlier
/// - `e` `[vertices of the blocks]`: on entry the correction the cycle ended with, on exit the new one
/// - `inverse_length` `[vertices of the blocks]`: one over the length of each vertex's shortest edge
/// - `largest` `[blocks]`: largest `|P (...) * inverse_length|^2`; a NaN in a block comes out as NaN. Not taken from
///   `e_new - start`, which lavapipe rounded otherwise than this
///
/// Source: Chebyshev semi-iteration (Golub and Varga 1961) with a cycle in place of a sweep.
pub fn run<T: Real>(
    [relaxation, momentum]: [T; 2],
    constraint: &[[T; 4]],
    start: &[[T; 4]],
    previous: &[[T; 4]],
    inverse_length: &[T],
    e: &mut [[T; 4]],
    largest: &mut [T],
) {
    for (block, largest) in largest.iter_mut().enumerate() {
        let first = block * BLOCK;
        *largest = T::ZERO;
        for row in first..e.len().min(first + BLOCK) {
            let (found, origin, earlier) = (e[row], start[row], previous[row]);
            let update = [0, 1, 2]
                .map(|axis| relaxation * (found[axis] - origin[axis]) + momentum * (origin[axis] - earlier[axis]));
            let step = project(&constraint[row], update);
            let mut d = [T::ZERO; 3];
            for axis in 0..3 {
                e[row][axis] = origin[axis] + step[axis];
                d[axis] = step[axis] * inverse_length[row];
            }
            let squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            *largest = largest.max_magnitude(squared);
        }
    }
}
