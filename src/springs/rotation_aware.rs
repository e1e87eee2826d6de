//! Springs whose rest edges turn with the moved surfaces (see [`crate::volume::rotation`]): a rotation is no strain to them.
//!
//! Rotations are spread with `1 / l^2`, which keeps them nearly constant where edges are short, at the walls. They then fall
//! off over the large tets half-way to the outer boundary, and those are what large rotations invert.

use super::{Length, Springs, Stiffness, Torsion};

/// See the module.
pub const ROTATION_AWARE: Springs = Springs {
    name: "rotation-aware",
    about: "sum 1 / sin^2 of the facing angles, over l, and rest edges that turn with the moved surfaces",
    stiffness: Stiffness { length: Length::Inverse, torsion: Torsion::Product, wall: 0.0 },
    rotation: Some(Stiffness { length: Length::InverseSquare, torsion: Torsion::None, wall: 0.0 }),
};
