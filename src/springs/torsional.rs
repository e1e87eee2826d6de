//! Murayama's torsional sum (see [`super::murayama`]), multiplied by a longitudinal part instead of
//! added to it.
//!
//! The ratio of two stiffnesses has no unit, so the same mesh in millimetres moves alike.

use super::{Length, Springs, Stiffness, Torsion};

/// Torsional springs; see the module.
pub const TORSIONAL: Springs = Springs {
    name: "torsional",
    about: "sum 1 / sin^2 of the facing angles, over l^2: free of units",
    stiffness: Stiffness { length: Length::InverseSquare, torsion: Torsion::Product, wall: 0.0 },
    rotation: None,
};
