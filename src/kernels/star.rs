//! What the kernels that move vertices within the tets around them share; twin of `kernels/star.wgsl`.

use super::Real;
use super::vector::{difference, dot, scaled, sum};

/// Steps tried before a vertex stays, each half the one before.
pub(super) const HALVINGS: u32 = 8;

/// Tets around some vertices as the twins read them. The vertices that move are the first ones.
#[derive(Clone, Copy, Debug)]
pub struct Star<'a, T> {
    /// Where each moving vertex's tets start in `vertex_tets` `[n_moving + 1]`.
    pub row_start: &'a [u32],
    /// Tets around each moving vertex, each entry `tet * 4 + local vertex`.
    pub vertex_tets: &'a [u32],
    /// Vertices of each tet `[n_tets]`.
    pub tets: &'a [[u32; 4]],
    /// A matrix of each tet at zero correction `[n_tets]`, its three columns one after another: see the kernels.
    pub base: &'a [[T; 9]],
    /// Unit normal or direction, and a [`kind`](super::constraint::kind) `[n_moving]`.
    pub constraint: &'a [[T; 4]],
    /// A place, counted as the correction is, and how far from it a vertex may be `[n_moving]`; at most [`FAR`].
    pub reach: &'a [[T; 4]],
}

/// The reach of a vertex that may go anywhere: its square is inside f32.
pub const FAR: f64 = 1e18;

impl<'a, T: Real> Star<'a, T> {
    /// The tets around a moving vertex.
    #[inline(always)]
    pub fn around(&self, vertex: usize) -> &'a [u32] {
        &self.vertex_tets[self.row_start[vertex] as usize..self.row_start[vertex + 1] as usize]
    }

    /// The place nearest to `at` within a moving vertex's reach.
    #[inline(always)]
    pub(super) fn within(&self, vertex: usize, at: [T; 3]) -> [T; 3] {
        let [x, y, z, far] = self.reach[vertex];
        let away = difference(at, [x, y, z]);
        let squared = dot(away, away);
        if squared > far * far { sum([x, y, z], scaled(away, far / squared.sqrt())) } else { at }
    }
}
