//! Springs whose rest edges turn with the moved surfaces (see [`crate::volume::rotation`]). A
//! rotation does not strain these springs.
//!
//! Rotations are spread with the stiffness `1 / l^2`. Near the walls edges are short, and the
//! rotation is nearly constant. The rotation falls off over the large tets half-way to the outer
//! boundary, so large rotations invert these tets first.

use super::{Length, Springs, Stiffness, Torsion};

/// Rotation-aware springs; see the module.
pub const ROTATION_AWARE: Springs = Springs {
    name: "rotation-aware",
    about: "sum 1 / sin^2 of the facing angles, over l, and rest edges that turn with the moved surfaces",
    stiffness: Stiffness { length: Length::Inverse, torsion: Torsion::Product, wall: 0.0 },
    rotation: Some(Stiffness { length: Length::InverseSquare, torsion: Torsion::None, wall: 0.0 }),
};
