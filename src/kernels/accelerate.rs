//! The last step of a multigrid cycle: acceleration by Chebyshev's coefficients. Twin of
//! `kernels/accelerate.wgsl`.

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
    /// Factor of the cycle's correction, without unit.
    pub relaxation: f32,
    /// Factor of the last change, without unit.
    pub momentum: f32,
    /// Place of the cycle's first block among the results of a batch.
    pub first_partial: u32,
}

/// Accelerates blocks of [`BLOCK`] vertices: `e_new = start + P (relaxation (e - start) + momentum
/// (start - previous))`.
///
/// - `constraint` `[vertices of the blocks]`: `P` is [`project`]. A cycle keeps to the constraints
///   already. The product with `P` stays because without it compilers of shaders rearrange the sum,
///   which then rounds differently
/// - `start`, `previous` `[vertices of the blocks]`: correction before the cycle, and one cycle
///   earlier, in the unit of a displacement
/// - `e` `[vertices of the blocks]`: on entry the correction at the end of the cycle, on exit the
///   new correction
/// - `inverse_length` `[vertices of the blocks]`: one over the length of each vertex's shortest
///   edge
/// - `largest` `[blocks]`: largest `|P (...) * inverse_length|^2` of each block, NaN if the block
///   has a NaN. The difference `e_new - start` is not used: lavapipe rounds it differently
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
