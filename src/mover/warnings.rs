//! What a user should know of a result that is valid.

use std::{collections::BTreeMap, fmt};

use glam::DVec3;

use super::{Design, HeldBack, Mover};
use crate::profile::Missed;

/// Planes that match are said to have parted beyond this fraction of their size: less is the
/// tolerance of relaxations.
const PARTED: f64 = 1e-6;

/// Something about a result that may be wrong.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// Two plane families match vertex for vertex, nobody calls them partners, and they no longer
    /// match.
    Parted {
        /// The families.
        families: [String; 2],
        /// Largest distance of two matching vertices from where they would match.
        distance: f64,
        /// Where the first of these two was.
        at: DVec3,
    },
    /// A family holds vertices that the design moves with another.
    HeldBack(HeldBack),
    /// Planes of profiles cross no edge of their wing, as that of a section inside the fuselage:
    /// nothing tells whether the wing has these profiles.
    NotJudged {
        /// The wing.
        wing: String,
        /// Numbers of the profiles.
        profiles: Vec<i64>,
    },
    /// Wingtip families border on nothing that follows a wing: they stay.
    LooseTip {
        /// The families.
        families: Vec<String>,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Parted { families: [one, other], distance, at } => write!(
                f,
                "the planes `{one}` and `{other}` matched vertex for vertex and no longer do: up to {distance:.3e} apart, at \
                 ({}, {}, {}); if they are periodic, partner = \"{other}\" in the table of `{one}` keeps them so",
                at.x, at.y, at.z
            ),
            Self::HeldBack(HeldBack { by, family, vertices, max_distance, at, .. }) => write!(
                f,
                "`{by}` holds {vertices} vertices of `{family}` back from where the design has them, by up to \
                 {max_distance:.3e}, at ({}, {}, {}): `{family}` is bent there",
                at.x, at.y, at.z
            ),
            Self::NotJudged { wing, profiles } => write!(
                f,
                "the planes of the profiles {profiles:?} cross no edge of the wing of `{wing}`: whether it has them cannot be \
                 judged"
            ),
            Self::LooseTip { families } => write!(
                f,
                "wingtips that touch nothing that moves with a wing stay where they are: {}; is `wingtip` their role?",
                families.join(", ")
            ),
        }
    }
}

impl Mover {
    /// What a user should know of the mesh moved to `vertices`, in the mover's order.
    ///
    /// - `missed`: how far each wing misses the profiles it can be judged by
    pub(super) fn warnings(
        &self,
        vertices: &[DVec3],
        held_back: &[HeldBack],
        design: &Design,
        missed: &BTreeMap<String, Vec<Missed>>,
    ) -> Vec<Warning> {
        let name = |family: &crate::mesh::FamilyId| self.mesh.families[family.index()].clone();
        let original = &self.ordered.vertices;
        let parted = self.families.partners.alike.iter().filter_map(|pair| {
            let (distance, vertex) = pair.apart(original, vertices);
            let families = [name(&pair.families[0]), name(&pair.families[1])];
            let at = original[vertex as usize];
            (distance > PARTED * self.size_of(pair.families[0])).then_some(Warning::Parted { families, distance, at })
        });
        let loose = self.wingtips.loose().map(|tip| Warning::LooseTip { families: tip.iter().map(name).collect() });
        let nothing_moves = original == vertices;
        let held_back = held_back.iter().cloned().map(Warning::HeldBack);
        let not_judged = missed.iter().filter_map(|(wing, missed)| {
            let is_judged = |number: i64| missed.iter().any(|missed| missed.profile == number);
            let numbers = design.profiles.get(wing)?.iter().map(|profile| profile.number);
            let profiles: Vec<i64> = numbers.filter(|&number| !is_judged(number)).collect();
            (!profiles.is_empty()).then(|| Warning::NotJudged { wing: wing.clone(), profiles })
        });
        parted.chain(loose.filter(|_| !nothing_moves)).chain(held_back).chain(not_judged).collect()
    }
}
