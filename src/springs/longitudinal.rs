//! Batina's longitudinal springs (AIAA J. 28(8), 1990): the shorter an edge, the stiffer its
//! spring.
//!
//! The springs do not resist changes of angles, so layers of thin tets fold. Longitudinal springs
//! resist a rotation as if it were a strain.

use super::{Length, Springs, Stiffness, Torsion};

/// Longitudinal springs; see the module.
pub const LONGITUDINAL: Springs = Springs {
    name: "longitudinal",
    about: "1 / l (Batina)",
    stiffness: Stiffness { length: Length::Inverse, torsion: Torsion::None, wall: 0.0 },
    rotation: None,
};
