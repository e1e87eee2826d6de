//! The default: [`super::rotation_aware`] springs that are stiffer near moved walls. Rotations
//! spread the more easily, the farther an edge is from the walls.
//!
//! A turning body shears the mesh around it by `r` times the gradient of the angle, at the distance
//! `r`. The largest shear is least if the shear is the same everywhere, so the angle should fall as
//! the logarithm of `r`. Then the conductance for the angle must be constant around a long body,
//! and fall as `1 / r` around a round body. In a mesh whose edges grow with `r`, an edge of
//! stiffness `k` has the conductance `k / l`. So `k` should grow at most as `l`, and at least stay
//! constant.
//!
//! The torsional sum over a root of the proximity to walls lies between these limits. The sum does
//! not depend on the length, and ties the ends of edges across thin layers as firmly as `1 / l^2`
//! would, so a layer keeps one rotation. Away from the walls `1 / l^2` is two powers too steep.
//!
//! The table shows the inverted tets on the wing of [`super`]'s tables at 120, 150 and 180 degrees
//! of pitch, and the mean beta at 60 and 100 degrees, for different stiffnesses that spread the
//! rotations.
//!
//! | rotations spread with | at 120 | at 150 | at 180 | mean beta at 60, 100 |
//! |---|---|---|---|---|
//! | `1 / l^2` | 234 | 2192 | 3926 | |
//! | the sum | 0 | 73 | 669 | |
//! | the sum over proximity to the power of 1/4 (used) | 0 | 10 | 263 | 0.0561, 0.0526 |
//! | the sum over proximity to the power of 1/2 | 0 | 0 | 99 | 0.0556, 0.0513 |
//! | the sum over proximity | 2 | 67 | 1892 | |
//!
//! The springs' own power of the proximity was chosen in the same way.
//!
//! | power | inverted tets at 1 chord of bending | at 2 chords of heave |
//! |---|---|---|
//! | 0 | 8 | worst beta 0.0096 |
//! | 1/2 (used) | 0 | worst beta 0.0070 |
//! | 1 | 0 | worst beta 0.0027 |
//! | 2 | 0 | 6 inverted tets |

use super::{Length, Springs, Stiffness, Torsion};

/// Rotation-aware springs, stiffer near walls; see the module.
pub const ROTATION_AWARE_WALL: Springs = Springs {
    name: "rotation-aware-wall",
    about: "rotation-aware, times (h / (d + h))^(1/2) at the distance d from moved walls, h their median edge; rotations \
            spread with the sum alone, over (h / (d + h))^(1/4)",
    stiffness: Stiffness { length: Length::Inverse, torsion: Torsion::Product, wall: 0.5 },
    rotation: Some(Stiffness { length: Length::None, torsion: Torsion::Product, wall: -0.25 }),
};
