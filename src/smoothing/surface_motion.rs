//! The interface through which surface vertices slide during local optimisation.

use glam::DVec3;

use crate::backend::Ball;
use crate::constraint::Constraint;

/// Surfaces and curves on which otherwise held vertices slide.
pub trait SurfaceMotion: Sync {
    /// The directions in which a vertex on its surface or curve may slide, to first order.
    ///
    /// - `at`: position of the vertex, in the mesh's unit
    fn tangent(&self, vertex: u32, at: DVec3) -> Constraint;

    /// The ball that the vertex must not leave; `None` if there is no limit.
    fn reach(&self, vertex: u32) -> Option<Ball>;

    /// The point of the vertex's surface or curve near `at`, in the mesh's unit.
    fn back(&self, vertex: u32, at: DVec3) -> DVec3;

    /// Number of folded triangles of the surface for these positions of the vertices
    /// `[n_vertices]`.
    fn folded(&self, at: &[DVec3]) -> usize;
}
