//! The tets around moving vertices, shared by the kernels of local optimisation. Twin of
//! `kernels/star.wgsl`.

use super::Real;
use super::vector::{difference, dot, scaled, sum};

/// Steps tried before a vertex stays. Each is half of the one before.
pub(super) const HALVINGS: u32 = 8;

/// The tets around some vertices in the layout of the twins. The moving vertices come first.
#[derive(Clone, Copy, Debug)]
pub struct Star<'a, T> {
    /// Start of each moving vertex's tets in `vertex_tets` `[n_moving + 1]`.
    pub row_start: &'a [u32],
    /// Tets around each moving vertex, each stored as `tet * 4 + local vertex`.
    pub vertex_tets: &'a [u32],
    /// Vertices of each tet `[n_tets]`.
    pub tets: &'a [[u32; 4]],
    /// A matrix of each tet at zero correction `[n_tets]`, its three columns one after another.
    /// Each kernel defines its matrix.
    pub base: &'a [[T; 9]],
    /// Constraint of each moving vertex `[n_moving]`: unit normal or direction, and a
    /// [`kind`](super::constraint::kind).
    pub constraint: &'a [[T; 4]],
    /// A ball for each moving vertex `[n_moving]`: its centre, in the same unit and from the same
    /// origin as a correction, and its radius, at most [`FAR`]. The vertex stays inside the ball.
    pub reach: &'a [[T; 4]],
}

/// The radius for a vertex that may go anywhere. Its square is in the range of f32.
pub const FAR: f64 = 1e18;

impl<'a, T: Real> Star<'a, T> {
    /// The tets around a moving vertex, each stored as `tet * 4 + local vertex`.
    #[inline(always)]
    pub fn around(&self, vertex: usize) -> &'a [u32] {
        &self.vertex_tets[self.row_start[vertex] as usize..self.row_start[vertex + 1] as usize]
    }

    /// The point of a moving vertex's ball that is nearest to `at`.
    #[inline(always)]
    pub(super) fn within(&self, vertex: usize, at: [T; 3]) -> [T; 3] {
        let [x, y, z, far] = self.reach[vertex];
        let away = difference(at, [x, y, z]);
        let squared = dot(away, away);
        if squared > far * far { sum([x, y, z], scaled(away, far / squared.sqrt())) } else { at }
    }
}
