//! What lets surface vertices slide during a run.

use glam::DVec3;

use crate::backend::Ball;
use crate::constraint::Constraint;

/// Surfaces and curves for vertices to slide on, which are otherwise held.
pub trait SurfaceMotion: Sync {
    /// What a vertex on its surface or curve may do there, to first order.
    fn tangent(&self, vertex: u32, at: DVec3) -> Constraint;

    /// How far the vertex may slide; `None` if anywhere.
    fn reach(&self, vertex: u32) -> Option<Ball>;

    /// The place near `at` on the vertex's surface or curve.
    fn back(&self, vertex: u32, at: DVec3) -> DVec3;

    /// How many triangles of the surface are folded when its vertices are at these positions `[n_vertices]`.
    fn folded(&self, at: &[DVec3]) -> usize;
}
