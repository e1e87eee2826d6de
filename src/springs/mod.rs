//! The springs a volume network can be made of; one row in [`SPRINGS`] each.
//!
//! All are scalar per edge, so that x, y and z decouple. Formulas: longitudinal springs after Batina (AIAA J. 28(8),
//! 1990), torsional ones after Murayama, Nakahashi and Matsushima (AIAA 2002-0122): to an edge's stiffness each tet
//! around it adds `1 / sin^2` of the dihedral angle that faces the edge. As published the two are added, although one
//! has a unit and the other has none: the same mesh in millimetres moves differently. The default multiplies them.

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
}

/// Every kind of spring.
pub const SPRINGS: &[Springs] = &[
    Springs { name: "longitudinal", about: "1 / l (Batina)", length: Length::Inverse, torsion: Torsion::None },
    Springs {
        name: "torsional",
        about: "sum 1 / sin^2 of the facing angles, over l^2: free of units",
        length: Length::InverseSquare,
        torsion: Torsion::Product,
    },
    Springs {
        name: "murayama",
        about: "1 / l + sum 1 / sin^2 of the facing angles, as published: depends on the unit of length",
        length: Length::Inverse,
        torsion: Torsion::Sum,
    },
];

impl Springs {
    /// The springs of that name.
    pub fn named(name: &str) -> Option<&'static Self> {
        SPRINGS.iter().find(|springs| springs.name == name)
    }
}
