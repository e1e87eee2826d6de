//! The derivative of [`VolumeNetwork::run`]: how the displacement of all vertices changes with the
//! displacement of the surfaces, and the transpose of that.
//!
//! Either takes as many relaxations as the run itself, with the same networks. What depends on the
//! displacement alone, the rotations, is kept from the run.

use std::borrow::Cow;

use glam::{DMat3, DQuat, DVec3};
use rayon::prelude::*;

use super::{
    rotation::change_of_forces,
    springs::{Tied, VolumeNetwork},
};
use crate::{
    backend::BackendError,
    families::even,
    geometry::rotation_vectors::{axial, cross_matrix, jacobian, outer},
    mesh::Displacement,
    relaxation::{Convergence, Network, Stopping},
    stage::{Kept, NoProduct},
};

impl VolumeNetwork {
    /// Change of the displacement.
    ///
    /// - `vertices` `[n_vertices]`: undeformed positions, in the mesh's unit
    /// - `kept`: of the run
    /// - `change` `[n_vertices]`: on entry of the surfaces' displacement, on exit of all vertices'
    ///
    /// # Errors
    /// The backend failed, or a rotation has no derivative.
    pub(super) fn forward(
        &mut self,
        vertices: &[DVec3],
        kept: &Kept,
        change: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        let rotations = self.kept_rotations(vertices, kept, stopping)?;
        let (force, spread) = match &mut self.rotation {
            None => (None, Convergence::nothing_to_do()),
            Some(rotation) => {
                let (vectors, spread) = rotation.forward(vertices, &kept.surfaces, change, stopping)?;
                let turn = |(vector, change): (&DVec3, &DVec3)| {
                    cross_matrix(jacobian(*vector) * *change) * DMat3::from_quat(DQuat::from_scaled_axis(*vector))
                };
                let turns: Vec<DMat3> = rotations.par_iter().zip(&vectors).map(turn).collect();
                (Some(change_of_forces(self.relaxer.network(), vertices, &turns)), spread)
            }
        };
        let mut convergence = self.relaxer.forward(change, force.as_deref(), stopping)?.and(spread);
        if let Some(Tied { relaxer, sets }) = &mut self.tied {
            sets.iter().for_each(|set| even(set, change, false));
            convergence = convergence.and(relaxer.forward(change, force.as_deref(), stopping)?);
        }
        Ok(convergence)
    }

    /// The transpose of [`Self::forward`].
    ///
    /// - `gradient` `[n_vertices]`: on entry the derivative of a number by the displacement of all
    ///   vertices, on exit by the displacement of the surfaces
    ///
    /// # Errors
    /// As for [`Self::forward`].
    pub(super) fn reverse(
        &mut self,
        vertices: &[DVec3],
        kept: &Kept,
        gradient: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        let mut convergence = Convergence::nothing_to_do();
        let mut by_force_of_tied = None;
        if let Some(Tied { relaxer, sets }) = &mut self.tied {
            let (by_force, of_tied) = relaxer.reverse(gradient, stopping)?;
            // A mean is its own transpose.
            sets.iter().for_each(|set| even(set, gradient, false));
            (by_force_of_tied, convergence) = (Some(by_force), of_tied);
        }
        let (mut by_force, of_all) = self.relaxer.reverse(gradient, stopping)?;
        convergence = convergence.and(of_all);
        let rotations = self.kept_rotations(vertices, kept, stopping)?;
        let Some(rotation) = &mut self.rotation else { return Ok(convergence) };
        // The forces pull in both relaxations.
        for (sum, tied) in by_force.iter_mut().zip(by_force_of_tied.iter().flatten()) {
            *sum += *tied;
        }
        let by_vectors = derivative_by_vectors(self.relaxer.network(), vertices, &rotations, &by_force);
        Ok(rotation.reverse(vertices, &kept.surfaces, by_vectors, gradient, stopping)?.and(convergence))
    }
}

impl VolumeNetwork {
    /// The rotation vectors of the run `[n_vertices]`. They are spread again if the device kept
    /// them, because another run may have replaced them.
    fn kept_rotations<'a>(
        &mut self,
        vertices: &[DVec3],
        kept: &'a Kept,
        stopping: &Stopping,
    ) -> Result<Cow<'a, [DVec3]>, BackendError> {
        if kept.rotations.is_empty() {
            return Ok(Cow::Owned(self.rotations(vertices, &kept.surfaces, stopping)?));
        }
        Ok(Cow::Borrowed(&kept.rotations))
    }
}

/// The derivative by the rotation vectors `[n_vertices]`, from the derivative by the forces of
/// [`change_of_forces`]. The vertices that are held have no forces.
fn derivative_by_vectors(
    network: &Network,
    positions: &[DVec3],
    rotations: &[DVec3],
    by_force: &[DVec3],
) -> Vec<DVec3> {
    let of_row = |row: usize| {
        let springs = network.graph.range(row).zip(network.graph.row(row));
        let by_turn = springs.fold(DMat3::ZERO, |sum, (entry, &neighbour)| {
            let neighbour = neighbour as usize;
            let rest = positions[row] - positions[neighbour];
            sum + outer((by_force[row] - by_force[neighbour]) * (0.5 * network.stiffness[entry]), rest)
        });
        let rotation = DMat3::from_quat(DQuat::from_scaled_axis(rotations[row]));
        jacobian(rotations[row]).transpose() * axial(by_turn * rotation.transpose())
    };
    (0..network.len()).into_par_iter().map(of_row).collect()
}
