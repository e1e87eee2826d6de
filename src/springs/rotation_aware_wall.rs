//! [`super::rotation_aware`] springs that are stiffer towards moved walls, while rotations spread the more easily the
//! farther from them. The default.
//!
//! A body that turns shears the mesh around it by `r` times the gradient of the angle. This is least, and the same
//! everywhere, if the angle falls as the logarithm of the distance `r`: then whatever conducts it must be constant around a
//! long body, and fall as `1 / r` around a round one. In a mesh whose edges grow with `r`, an edge of stiffness `k` conducts
//! `k / l`, so `k` is to grow as `l` at most, and not at all at least. Between them is the torsional sum over a root of the
//! proximity to walls. The sum has no length, and ties the ends of edges across thin layers as firmly as `1 / l^2` would:
//! layers keep one rotation; `1 / l^2` itself is two powers too steep elsewhere.
//!
//! Measured with these springs on the wing of [`super`]'s tables, inverted tets at 120, 150 and 180 degrees of pitch: with
//! rotations spread by `1 / l^2` 234, 2192 and 3926; by the sum 0, 73 and 669; by the sum over the proximity to walls to the power of 1/4
//! 0, 10 and 263, of 1/2 0, 0 and 99, of 1 2, 67 and 1892. With 1/2 the mean beta is lower, 0.0556 against 0.0561 at 60 degrees
//! and 0.0513 against 0.0526 at 100. The springs' own power of the proximity to walls, 0, 1/2, 1 or 2, leaves 8, 0, 0 or 0 inverted tets
//! at 1 chord of bending, and a worst beta of 0.0096, 0.0070, 0.0027 or 6 inverted tets at 2 chords of heave.

use super::{Length, Springs, Stiffness, Torsion};

/// See the module.
pub const ROTATION_AWARE_WALL: Springs = Springs {
    name: "rotation-aware-wall",
    about: "rotation-aware, times (h / (d + h))^(1/2) at the distance d from moved walls, h their median edge; rotations \
            spread with the sum alone, over (h / (d + h))^(1/4)",
    stiffness: Stiffness { length: Length::Inverse, torsion: Torsion::Product, wall: 0.5 },
    rotation: Some(Stiffness { length: Length::None, torsion: Torsion::Product, wall: -0.25 }),
};
