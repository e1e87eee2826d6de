//! What a vertex may do when everything around it moves. Stages say it, networks and optimisation
//! keep to it, devices know a packed form of it ([`crate::kernels::constraint`]).

use glam::DVec3;

/// What a vertex of a network may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constraint {
    /// Moves freely.
    Free,
    /// Stays at its prescribed displacement.
    Held,
    /// Moves perpendicular to this unit normal only.
    InPlane(DVec3),
    /// Moves along this unit direction only.
    OnLine(DVec3),
}

impl Constraint {
    /// The part of a motion that the constraint allows.
    pub fn limit(&self, motion: DVec3) -> DVec3 {
        match *self {
            Self::Free => motion,
            Self::Held => DVec3::ZERO,
            Self::InPlane(normal) => motion - normal * normal.dot(motion),
            Self::OnLine(direction) => direction * direction.dot(motion),
        }
    }
}
