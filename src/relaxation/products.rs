//! The derivative of an equilibrium: how the displacement of the vertices that move changes with
//! the displacement of the held ones and with the forces, and the transpose of that.
//!
//! An equilibrium is linear in both. So its derivative is another equilibrium of the same network,
//! which [`Relaxer::relax`] finds, and the transpose is one too, because the matrix is symmetric.
//! The tolerance is relative to the argument, whose unit is not the mesh's.

use glam::DVec3;

use super::{Convergence, Relaxer, Stopping};
use crate::{backend::BackendError, constraint::Constraint};

/// Most relaxations of one product. The first is enough unless edges differ widely in length.
const ROUNDS: usize = 6;

impl Relaxer {
    /// Change of the equilibrium.
    ///
    /// - `change` `[n_vertices]`: on entry the change of the displacement of held vertices, on exit
    ///   of all vertices, in any unit
    /// - `force` `[n_vertices]`: change of the forces, in the unit of stiffness times `change`
    /// - `stopping`: its tolerance is relative to the argument
    ///
    /// # Errors
    /// The device failed.
    pub fn forward(
        &mut self,
        change: &mut [DVec3],
        force: Option<&[DVec3]>,
        stopping: &Stopping,
    ) -> Result<Convergence, BackendError> {
        for (change, constraint) in change.iter_mut().zip(&self.network().constraint) {
            if *constraint != Constraint::Held {
                *change = DVec3::ZERO;
            }
        }
        let unit = self.unit(change, force);
        let mut scaled: Vec<DVec3> = change.iter().map(|change| *change * unit).collect();
        let load = force.map(|force| self.network().loads(force, unit));
        let convergence = self.relax_relative(&mut scaled, load.as_deref(), stopping)?;
        for ((change, scaled), constraint) in change.iter_mut().zip(scaled).zip(&self.network().constraint) {
            if *constraint != Constraint::Held {
                *change = scaled / unit;
            }
        }
        Ok(convergence)
    }

    /// The transpose of [`Self::forward`]. Returns the derivative by the forces `[n_vertices]`, in
    /// the unit of `gradient` over stiffness.
    ///
    /// - `gradient` `[n_vertices]`: on entry the derivative of a number by the displacement of all
    ///   vertices, in any unit; on exit by the displacement of held vertices, and zero elsewhere
    /// - `stopping`: as for [`Self::forward`]
    ///
    /// # Errors
    /// The device failed.
    pub fn reverse(
        &mut self,
        gradient: &mut [DVec3],
        stopping: &Stopping,
    ) -> Result<(Vec<DVec3>, Convergence), BackendError> {
        let mut by_force = vec![DVec3::ZERO; gradient.len()];
        let unit = self.unit(&by_force, Some(gradient));
        let load = self.network().loads(gradient, unit);
        let convergence = self.relax_relative(&mut by_force, Some(&load), stopping)?;
        by_force.iter_mut().for_each(|by_force| *by_force /= unit);
        let network = self.network();
        for (row, gradient) in gradient.iter_mut().enumerate() {
            if network.constraint[row] == Constraint::Held {
                let springs = network.graph.row(row).iter().zip(&network.stiffness[network.graph.range(row)]);
                *gradient += springs.fold(DVec3::ZERO, |sum, (&v, &stiffness)| sum + stiffness * by_force[v as usize]);
            } else {
                *gradient = DVec3::ZERO;
            }
        }
        Ok((by_force, convergence))
    }

    /// Relaxes until the estimated error is within the tolerance of each vertex's shortest edge,
    /// and until the residual has fallen by the tolerance. The argument is no displacement. So
    /// where edges differ widely in length, an error that is small in long edges may be large all
    /// the same.
    fn relax_relative(
        &mut self,
        displacement: &mut [DVec3],
        load: Option<&[DVec3]>,
        stopping: &Stopping,
    ) -> Result<Convergence, BackendError> {
        let mut total = self.relax(displacement, load, stopping)?;
        let mut tolerance = stopping.tolerance;
        for _ in 1..ROUNDS {
            if !total.converged || total.relative_residual <= stopping.tolerance {
                break;
            }
            tolerance *= 0.5 * stopping.tolerance / total.relative_residual;
            let max_sweeps = stopping.max_sweeps.saturating_sub(total.sweeps);
            let round = self.relax(displacement, load, &Stopping { tolerance, max_sweeps })?;
            total.sweeps += round.sweeps;
            total.relative_residual *= round.relative_residual;
            total.history = total.history.and(round.history);
        }
        total.converged &= total.relative_residual <= stopping.tolerance;
        total.error = total.error.max(total.relative_residual);
        Ok(total)
    }

    /// The factor by which the largest load becomes one shortest edge.
    fn unit(&self, displacement: &[DVec3], force: Option<&[DVec3]>) -> f64 {
        let network = self.network();
        let load = force.map(|force| network.loads(force, 1.0));
        let loads = network.residual(displacement, load.as_deref());
        let loads = loads.iter().zip(&network.inverse_length).map(|(load, inverse)| load.abs().max_element() * inverse);
        let largest = loads.fold(0.0, f64::max);
        if largest > 0.0 { 1.0 / largest.max(f64::MIN_POSITIVE) } else { 1.0 }
    }
}
