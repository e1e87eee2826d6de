//! [`Constraint`]: the directions in which a vertex may move.
//!
//! Stages set constraints. Networks and local optimisation keep them. Devices hold them in a packed
//! form ([`crate::kernels::constraint`]).

use glam::DVec3;

/// The constraint of a vertex: the directions in which it may move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constraint {
    /// The vertex moves freely.
    Free,
    /// The vertex keeps its prescribed displacement.
    Held,
    /// The vertex moves only perpendicular to this unit normal.
    InPlane(DVec3),
    /// The vertex moves only along this unit direction.
    OnLine(DVec3),
}

impl Constraint {
    /// The part of a vector that the constraint allows, in the vector's unit.
    pub fn limit(&self, motion: DVec3) -> DVec3 {
        match *self {
            Self::Free => motion,
            Self::Held => DVec3::ZERO,
            Self::InPlane(normal) => motion - normal * normal.dot(motion),
            Self::OnLine(direction) => direction * direction.dot(motion),
        }
    }
}
