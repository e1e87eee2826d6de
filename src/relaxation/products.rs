//! The derivative of an equilibrium: how the displacement of the vertices that move changes with
//! the displacement of the held ones and with the forces, and the transpose of that.
//!
//! An equilibrium is linear in both. So its derivative is another equilibrium of the same network,
//! which [`Relaxer::relax`] finds, and the transpose is one too, because the matrix is symmetric.
//! The tolerance is relative to the argument, whose unit is not the mesh's.

use glam::DVec3;

use super::{Convergence, Relaxer, Stopping};
use crate::{backend::BackendError, constraint::Constraint};

impl Relaxer {
    /// Change of the equilibrium.
    ///
    /// - `change` `[n_vertices]`: on entry the change of the displacement of held vertices, on exit
    ///   of all vertices, in any unit
    /// - `force` `[n_vertices]`: change of the forces, in the unit of stiffness times `change`
    /// - `stopping`: its tolerance is relative to the largest load in shortest edges
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
        change.iter_mut().for_each(|change| *change *= unit);
        let force: Option<Vec<DVec3>> = force.map(|force| force.iter().map(|force| *force * unit).collect());
        let convergence = self.relax(change, force.as_deref(), stopping)?;
        change.iter_mut().for_each(|change| *change /= unit);
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
        let load: Vec<DVec3> = gradient.iter().map(|gradient| *gradient * unit).collect();
        let convergence = self.relax(&mut by_force, Some(&load), stopping)?;
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

    /// The power of two that brings the largest load near one shortest edge. Multiplying by it
    /// changes no digit.
    fn unit(&self, displacement: &[DVec3], force: Option<&[DVec3]>) -> f64 {
        let network = self.network();
        let loads = network.residual(displacement, force);
        let loads = loads.iter().zip(&network.inverse_length).map(|(load, inverse)| load.abs().max_element() * inverse);
        let largest = loads.fold(0.0, f64::max);
        if largest > 0.0 { (-largest.log2().floor()).clamp(-1000.0, 1000.0).exp2() } else { 1.0 }
    }
}
