//! Murayama's torsional sum (see [`super::murayama`]), multiplied by a longitudinal part instead of added to it: free of units.

use super::{Length, Springs, Stiffness, Torsion};

/// See the module.
pub const TORSIONAL: Springs = Springs {
    name: "torsional",
    about: "sum 1 / sin^2 of the facing angles, over l^2: free of units",
    stiffness: Stiffness { length: Length::InverseSquare, torsion: Torsion::Product, wall: 0.0 },
    rotation: None,
};
