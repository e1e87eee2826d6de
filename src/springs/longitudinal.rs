//! Batina's springs (AIAA J. 28(8), 1990): the shorter the stiffer.
//!
//! They see no angle: layers of thin tets fold, and a rotation is a strain to them.

use super::{Length, Springs, Stiffness, Torsion};

/// See the module.
pub const LONGITUDINAL: Springs = Springs {
    name: "longitudinal",
    about: "1 / l (Batina)",
    stiffness: Stiffness { length: Length::Inverse, torsion: Torsion::None, wall: 0.0 },
    rotation: None,
};
