//! Relaxation of a spring network to equilibrium: the one solver of every stage.
//!
//! The equilibrium of vertex `i` is `sum_j k_ij (u_j - u_i) - anchor_i u_i = 0` (the segment
//! springs of Batina, the paper's first reference). The equilibrium is a linear system with a
//! symmetric M-matrix, in which x, y and z decouple.
//!
//! A [`Relaxer`] is made once per network. The relaxer computes the residual in f64, lets a
//! [`crate::backend::DeviceNetwork`] sweep a correction, and adds the correction. The relaxer
//! repeats these steps while the precision of the backend is coarser than the tolerance.
//!
//! A device may be given several batches at once, because the stopping rule says how many are
//! needed at least. The result is that of one batch after another.
//!
//! Differences from the paper: Chebyshev-accelerated sweeps and multigrid cycles beside plain
//! Jacobi sweeps, and a stopping rule instead of a fixed number of sweeps.
//!
//! **Stopping rule.** `tolerance` bounds the estimated distance of each vertex from its converged
//! position, as a fraction of the vertex's shortest edge. So it has the same meaning on every mesh
//! size and in every unit of length.

mod free_rows;
mod history;
pub mod multigrid;
mod network;
mod pass;
mod products;
mod relaxer;
mod schedule;
mod spectrum;

pub use free_rows::{FreeRows, MovingGraph};
pub use history::{History, Relaxation};
pub use network::Network;
pub use relaxer::{Convergence, Relaxer, Unrelaxed};
pub use schedule::Method;
pub use spectrum::Spectrum;

/// The stopping rule of a relaxation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stopping {
    /// Largest estimated error of a vertex, as a fraction of its shortest edge.
    pub tolerance: f64,
    /// Sweeps, or cycles of multigrid, after which a relaxation ends without convergence.
    pub max_sweeps: usize,
}

impl Default for Stopping {
    /// A tolerance of 1e-4 of an edge. On a wing with 100 000 tets the mesh is valid with 1e-2, and
    /// with 1e-3 no beta changes in its third digit.
    fn default() -> Self {
        Self { tolerance: 1e-4, max_sweeps: 200_000 }
    }
}
