//! The springs of a volume network. Each kind has a file, with its formula and source, and a row in
//! [`SPRINGS`].
//!
//! Every spring is a scalar per edge, so x, y and z decouple. A case names one kind;
//! `rotation-aware-wall` is the default.
//!
//! The first two tables show how far each kind moves a mesh by itself, in one jump and without
//! local optimisation. A wing of 102 341 tets (worst beta 0.0126, mean 0.0591) was pitched in one
//! call by 10, 20, 30, 40, 60, 80, 100, 120, 150 and 180 degrees. A dash stands for inverted tets.
//!
//! | springs | first inverted | worst, mean beta at 60 | at 100 | inverted at 120, 150, 180 | sweeps at 60 |
//! |---|---|---|---|---|---|
//! | longitudinal | 30 | - | - | 36688, 42159, 43656 | 66 |
//! | torsional | 40 | - | - | 39598, 44916, 46295 | 60 |
//! | torsional-wall | 60 | - | - | 43240, 48570, 49953 | 48 |
//! | murayama | 30 | - | - | 34803, 40197, 41703 | 72 |
//! | rotation-aware | 120 | 0.0072, 0.0564 | 0.0005, 0.0532 | 106, 2605, 5006 | 144 |
//! | **rotation-aware-wall** | 150 | 0.0112, 0.0561 | 0.0036, 0.0526 | 0, 10, 263 | 158 |
//!
//! The same wing was heaved by 1, 2 and 3 chords, and bent up by 0.5, 1 and 2 chords at its tips.
//! The table shows the worst beta, or in brackets the number of inverted tets.
//!
//! | springs | heave 1 | 2 | 3 | bending 0.5 | 1 | 2 |
//! |---|---|---|---|---|---|---|
//! | longitudinal | 0.0121 | 0.0096 | (9) | 0.0018 | (139) | (1447) |
//! | torsional | 0.0126 | (2) | (143) | 0.0094 | (8) | (283) |
//! | torsional-wall | 0.0093 | (31) | (417) | 0.0094 | 0.0049 | (59) |
//! | murayama | 0.0101 | (2) | (29) | (10) | (332) | (3288) |
//! | rotation-aware | 0.0120 | 0.0096 | (15) | 0.0086 | (3) | (247) |
//! | **rotation-aware-wall** | 0.0125 | 0.0070 | (59) | 0.0101 | 0.0018 | (54) |
//!
//! Wing-bodies were moved by their profiles. The design "shape" is thicker, has more camber and a
//! raised tip; the design "planform" changes the planform. For a mesh of 97 694 tets the table
//! shows worst and mean beta, each over the original mesh's value. For a mesh of 351 830 tets with
//! ten layers of thin tets at the walls it shows the number of inverted tets, and the heights of
//! the tets on the wing over their original heights: the first and the last percentile.
//!
//! | springs | shape: worst, mean | planform: worst, mean | sweeps | layers, shape: inverted, heights | planform | sweeps |
//! |---|---|---|---|---|---|---|
//! | longitudinal | 0.954, 0.999 | 0.813, 0.990 | 42, 42 | 33205, 0.011 to 2.816 | 12322, 0.050 to 3.597 | 80, 90 |
//! | torsional | 0.939, 0.999 | 0.806, 0.990 | 42, 42 | 0, 0.954 to 1.017 | 0, 0.955 to 1.028 | 80, 80 |
//! | torsional-wall | 0.938, 0.999 | 0.806, 0.990 | 40, 40 | 0, 0.954 to 1.017 | 0, 0.955 to 1.028 | 60, 60 |
//! | murayama | 0.953, 0.999 | 0.814, 0.989 | 45, 54 | 2, 0.918 to 1.006 | 23, 0.932 to 1.033 | 108, 108 |
//! | rotation-aware | 0.910, 1.001 | 0.814, 0.993 | 90, 90 | 0, 0.990 to 1.008 | 0, 0.986 to 1.011 | 170, 180 |
//! | **rotation-aware-wall** | 0.907, 1.001 | 0.838, 0.993 | 108, 108 | 0, 0.990 to 1.008 | 0, 0.986 to 1.011 | 185, 185 |
//!
//! `rotation-aware-wall` carries the largest rotations and bends, and keeps thin layers as well as
//! any other kind. The costs of this kind are a mean beta that is 1 % lower from 60 degrees on,
//! because more of the large tets deform; a smaller range in pure heave; and a tenth of a second
//! more of set-up on these meshes.

pub mod longitudinal;
pub mod murayama;
pub mod rotation_aware;
pub mod rotation_aware_wall;
pub mod torsional;
pub mod torsional_wall;
pub mod wall_proximity;

pub use wall_proximity::wall_proximity;

/// One kind of spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Springs {
    /// The name in a case file.
    pub name: &'static str,
    /// A description in one line.
    pub about: &'static str,
    /// Stiffness of the springs.
    pub stiffness: Stiffness,
    /// Stiffness of the springs that spread the rotations of the moved surfaces. With it, rest
    /// edges turn with their ends; with `None` they keep their direction.
    pub rotation: Option<Stiffness>,
}

/// Longitudinal part of an edge spring: `1 / l^p`, with the edge's length `l`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Length {
    /// `p = 0`: the part is 1.
    None,
    /// `1 / l`, as published by Batina (1990).
    Inverse,
    /// `1 / l^2`.
    InverseSquare,
}

/// Torsional part of an edge spring: `s = sum over the edge's tets of 1 / sin^2` of the dihedral
/// angle that faces the edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Torsion {
    /// No torsional part. The stiffness is the longitudinal part.
    None,
    /// The stiffness is the longitudinal part times `s`. The ratio of two stiffnesses has no unit.
    /// Not in the paper.
    Product,
    /// The stiffness is the longitudinal part plus `s`, as published by Murayama, Nakahashi and
    /// Matsushima 2002. The ratio of two stiffnesses depends on the unit of length.
    Sum,
}

/// Formula for the stiffness of the springs of a network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stiffness {
    /// The longitudinal part.
    pub length: Length,
    /// The torsional part.
    pub torsion: Torsion,
    /// Power of the edge's [`wall_proximity()`] to the moved walls, a factor of the stiffness. With
    /// a positive power springs are stiffer near walls, with a negative power softer.
    pub wall: f64,
}

/// All kinds of springs.
pub const SPRINGS: &[Springs] = &[
    longitudinal::LONGITUDINAL,
    torsional::TORSIONAL,
    torsional_wall::TORSIONAL_WALL,
    murayama::MURAYAMA,
    rotation_aware::ROTATION_AWARE,
    rotation_aware_wall::ROTATION_AWARE_WALL,
];

impl Default for &'static Springs {
    fn default() -> Self {
        Springs::named("rotation-aware-wall").expect("the default is in the table")
    }
}

impl Springs {
    /// The kind of springs with this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        SPRINGS.iter().find(|springs| springs.name == name)
    }

    /// Whether the springs, or those that spread rotations, have a torsional part.
    pub fn are_torsional(&self) -> bool {
        [Some(self.stiffness), self.rotation].into_iter().flatten().any(|of| of.torsion != Torsion::None)
    }
}

impl Stiffness {
    /// Stiffness of an edge without the factor for the proximity to walls: the stiffness on a wall.
    /// Infinite for an edge of length 0, unless the stiffness does not depend on the length.
    ///
    /// - `length`: length of the edge, in the mesh's unit
    /// - `sum`: sum of `1 / sin^2` of the dihedral angles that face the edge, without unit
    pub fn on_wall(&self, length: f64, sum: f64) -> f64 {
        let longitudinal = match self.length {
            Length::None => 1.0,
            Length::Inverse => 1.0 / length,
            Length::InverseSquare => 1.0 / (length * length),
        };
        match self.torsion {
            Torsion::None => longitudinal,
            Torsion::Product => longitudinal * sum,
            Torsion::Sum => longitudinal + sum,
        }
    }
}
