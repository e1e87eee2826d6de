//! [`super::torsional`] springs that are stiffer near moved walls (see
//! [`super::wall_proximity()`]).
//!
//! The tets at the wall keep their shape longer, and the tets far from it deform more. On the wing
//! of [`super`]'s tables the exponents 0, 1, 2 and 3 leave 111, 38, 17 and 12 inverted tets at 60
//! degrees of pitch, but 2, 10, 31 and 139 at 2 chords of heave.

use super::{Length, Springs, Stiffness, Torsion};

/// Torsional springs, stiffer near walls; see the module.
pub const TORSIONAL_WALL: Springs = Springs {
    name: "torsional-wall",
    about: "torsional, times (h / (d + h))^2 at the distance d from moved walls, h their median edge",
    stiffness: Stiffness { length: Length::InverseSquare, torsion: Torsion::Product, wall: 2.0 },
    rotation: None,
};
