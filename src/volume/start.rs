//! Where a relaxation of the volume starts.
//!
//! The equilibrium does not depend on it, only how far it is away: in a loop whose designs lie close together the last one's is
//! nearer than the undeformed mesh. Found within the tolerance, the result then depends on what came before within the
//! tolerance, too.

use glam::DVec3;

use crate::{constraint::Constraint, relaxation::Convergence};

/// Where an update starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// The undeformed mesh: the result depends on the design alone, to the last bit.
    #[default]
    Undeformed,
    /// The last design that converged, in the volume's springs: fewer sweeps for designs that lie close together, and a result
    /// that depends on earlier ones within the tolerance. After a design that was reached in steps it is the undeformed mesh again.
    LastDesign,
}

/// The last equilibrium of a network, where updates start from it.
#[derive(Clone, Debug, Default)]
pub(super) struct Equilibrium {
    start: Start,
    last: Option<Vec<DVec3>>,
}

impl Equilibrium {
    /// Starts from somewhere else from now on; what was kept is forgotten.
    pub(super) fn start_from(&mut self, start: Start) {
        *self = Self { start, last: None };
    }

    /// Puts the vertices that may move where they were last.
    pub(super) fn recall(&self, constraint: &[Constraint], displacement: &mut [DVec3]) {
        for ((now, last), constraint) in displacement.iter_mut().zip(self.last.iter().flatten()).zip(constraint) {
            if *constraint != Constraint::Held {
                *now = *last;
            }
        }
    }

    /// Keeps what a relaxation came to, if it came to something.
    pub(super) fn keep(&mut self, convergence: &Convergence, displacement: &[DVec3]) {
        if self.start == Start::LastDesign && convergence.converged {
            let last = self.last.get_or_insert_default();
            last.clear();
            last.extend_from_slice(displacement);
        }
    }
}
