//! Start of the volume's relaxations.
//!
//! The equilibrium does not depend on the start, but the number of sweeps does. In a loop over
//! similar designs the last equilibrium is nearer than the undeformed mesh. The result then depends
//! on earlier designs, within the tolerance.

use glam::DVec3;

use crate::{constraint::Constraint, relaxation::Convergence};

/// The start of an update.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// The undeformed mesh. The result depends on the design alone, to the last bit.
    #[default]
    Undeformed,
    /// The last design whose springs converged. Similar designs need fewer sweeps, and the result
    /// depends on earlier designs within the tolerance. After a design reached in steps the next
    /// update starts from the undeformed mesh.
    LastDesign,
}

/// The last equilibrium of a network, for updates that start from it.
#[derive(Clone, Debug, Default)]
pub(super) struct Equilibrium {
    start: Start,
    last: Option<Vec<DVec3>>,
}

impl Equilibrium {
    /// Sets the start of further relaxations and forgets the last equilibrium.
    pub(super) fn start_from(&mut self, start: Start) {
        *self = Self { start, last: None };
    }

    /// Whether relaxations start from the undeformed mesh.
    pub(super) fn is_undeformed(&self) -> bool {
        self.start == Start::Undeformed
    }

    /// Sets the vertices that may move to their last displacement.
    pub(super) fn recall(&self, constraint: &[Constraint], displacement: &mut [DVec3]) {
        for ((now, last), constraint) in displacement.iter_mut().zip(self.last.iter().flatten()).zip(constraint) {
            if *constraint != Constraint::Held {
                *now = *last;
            }
        }
    }

    /// Keeps the result of a relaxation, if it converged and a later update starts from it.
    pub(super) fn keep(&mut self, convergence: &Convergence, displacement: &[DVec3]) {
        if self.start == Start::LastDesign && convergence.converged {
            let last = self.last.get_or_insert_default();
            last.clear();
            last.extend_from_slice(displacement);
        }
    }
}
