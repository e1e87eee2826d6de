//! Relaxing a spring network to equilibrium: the one solver every stage uses.
//!
//! Equilibrium of vertex `i` is `sum_j k_ij (u_j - u_i) - anchor_i u_i = 0` (the segment springs of Batina, the
//! paper's first reference), a linear system with a symmetric M-matrix in which x, y and z decouple. [`Relaxer`] computes its
//! residual in f64, lets a [`crate::backend::DeviceNetwork`] sweep a correction, adds it, and repeats while the
//! backend's precision is coarser than what was asked. Differences from the paper: Chebyshev-accelerated sweeps beside
//! its plain Jacobi, and a stopping rule instead of a fixed number of sweeps.
//!
//! **Stopping rule.** `tolerance` bounds the estimated distance of each vertex from its converged place, as a fraction
//! of that vertex's shortest edge: it means the same on every mesh size and in every unit of length.

mod free_rows;
pub mod multigrid;
mod network;
mod relaxer;
mod schedule;
mod spectrum;

pub use free_rows::FreeRows;
pub use network::Network;
pub use relaxer::{Convergence, Relaxer};
pub use schedule::Method;
pub use spectrum::Spectrum;

/// How far to relax.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stopping {
    /// Largest estimated error of a vertex as a fraction of its shortest edge.
    pub tolerance: f64,
    /// Sweeps after which to stop unconverged.
    pub max_sweeps: usize,
}

impl Default for Stopping {
    /// 1e-4 of an edge: on a wing with 100 000 tets 1e-2 is already valid and 1e-3 changes no beta in its third digit.
    fn default() -> Self {
        Self { tolerance: 1e-4, max_sweeps: 200_000 }
    }
}
