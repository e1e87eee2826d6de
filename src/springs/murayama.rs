//! Torsional springs as published by Murayama, Nakahashi and Matsushima (AIAA 2002-0122): to an edge's stiffness each tet
//! around it adds `1 / sin^2` of the dihedral angle that faces the edge.
//!
//! One summand has a unit and the other has none: the same mesh in millimetres moves differently.

use super::{Length, Springs, Stiffness, Torsion};

/// See the module.
pub const MURAYAMA: Springs = Springs {
    name: "murayama",
    about: "1 / l + sum 1 / sin^2 of the facing angles, as published: depends on the unit of length",
    stiffness: Stiffness { length: Length::Inverse, torsion: Torsion::Sum, wall: 0.0 },
    rotation: None,
};
