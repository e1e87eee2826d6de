//! The springs a volume network can be made of; one row in [`SPRINGS`] each.
//!
//! All are scalar per edge, so that x, y and z decouple. Formulas: longitudinal springs after Batina (AIAA J. 28(8),
//! 1990), torsional ones after Murayama, Nakahashi and Matsushima (AIAA 2002-0122): to an edge's stiffness each tet
//! around it adds `1 / sin^2` of the dihedral angle that faces the edge. As published the two are added, although one
//! has a unit and the other has none: the same mesh in millimetres moves differently. `torsional` multiplies them instead.
//!
//! The default also lets the rest edges turn with the moved surfaces (see [`crate::stages::rotation`]). Measured on a wing
//! of 102 341 tets pitched by 10, 20, 30, 40, 60, 80, 100 and 120 degrees in one call, without any repair: `murayama` and
//! `longitudinal` invert tets from 30 degrees, `torsional` from 40, rest edges that turn with `1 / l` from 100, with
//! `sum / l^2` from 80, with `sum / l` from 120. On a mesh with ten layers of thin tets at the wall `1 / l` inverts
//! thousands of them, turned or not; the torsional sum keeps them all.

use crate::backend::{Length, Torsion};

/// One kind of spring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Springs {
    /// The word for it in a case.
    pub name: &'static str,
    /// What it does, in one line.
    pub about: &'static str,
    /// Its longitudinal part.
    pub length: Length,
    /// Its torsional part.
    pub torsion: Torsion,
    /// Whether its rest edge turns with its ends.
    pub turns: bool,
}

/// Every kind of spring.
pub const SPRINGS: &[Springs] = &[
    Springs {
        name: "longitudinal",
        about: "1 / l (Batina)",
        length: Length::Inverse,
        torsion: Torsion::None,
        turns: false,
    },
    Springs {
        name: "torsional",
        about: "sum 1 / sin^2 of the facing angles, over l^2: free of units",
        length: Length::InverseSquare,
        torsion: Torsion::Product,
        turns: false,
    },
    Springs {
        name: "murayama",
        about: "1 / l + sum 1 / sin^2 of the facing angles, as published: depends on the unit of length",
        length: Length::Inverse,
        torsion: Torsion::Sum,
        turns: false,
    },
    Springs {
        name: "rotation-aware",
        about: "sum 1 / sin^2 of the facing angles, over l, and rest edges that turn with the moved surfaces",
        length: Length::Inverse,
        torsion: Torsion::Product,
        turns: true,
    },
];

impl Default for &'static Springs {
    fn default() -> Self {
        Springs::named("rotation-aware").expect("the default is in the table")
    }
}

impl Springs {
    /// The springs of that name.
    pub fn named(name: &str) -> Option<&'static Self> {
        SPRINGS.iter().find(|springs| springs.name == name)
    }
}
