//! Torsional springs as published by Murayama, Nakahashi and Matsushima (AIAA 2002-0122). Each tet
//! around an edge adds `1 / sin^2` of the dihedral angle that faces the edge to the edge's
//! longitudinal stiffness.
//!
//! The longitudinal summand has a unit and the torsional one has none, so the same mesh in
//! millimetres moves differently.

use super::{Length, Springs, Stiffness, Torsion};

/// Murayama's torsional springs; see the module.
pub const MURAYAMA: Springs = Springs {
    name: "murayama",
    about: "1 / l + sum 1 / sin^2 of the facing angles, as published: depends on the unit of length",
    stiffness: Stiffness { length: Length::Inverse, torsion: Torsion::Sum, wall: 0.0 },
    rotation: None,
};
