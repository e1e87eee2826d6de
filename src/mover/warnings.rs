//! [`Warning`]: remarks on a result that do not make it invalid.
//!
//! The command line prints the warnings of each design.

use std::{
    collections::{BTreeMap, HashSet},
    fmt,
};

use glam::DVec3;

use super::{CREASED, Crease, Design, HeldBack, Mover};
use crate::families::{Misplaced, Role};
use crate::profile::cut::Gap;
use crate::profile::{Missed, Remark};
use crate::smoothing::Smoothed;
use crate::stages::SharedCurve;
use crate::text::figures::place;

/// A warning tells that planes have parted if the distance exceeds this fraction of their size.
/// Smaller distances come from the tolerance of relaxations.
const PARTED: f64 = 1e-6;

/// A warning tells of layers that local optimisation changed by more than this share.
const LAYERS: f64 = 0.04;
/// A warning tells of edges that become longer than so many times their length. Beside the acute
/// corner of a pylon on its nacelle, motions of a tenth of the chord stretch edges five times.
const STRETCHED: f64 = 6.0;
/// A warning tells of a curve that two wings move differently by more than this share of the chord.
const DIFFERENT: f64 = 5e-3;

/// A remark on a result that may be wrong.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// Surface triangles are turned over against the triangles around them.
    Folded {
        /// The number of these triangles, by family name; see [`crate::quality::faults::folded`].
        families: BTreeMap<String, usize>,
    },
    /// Edges of the surface turn by more than [`super::CREASED`] degrees in families that are not
    /// folded.
    Creased {
        /// The edges, by family name. Edges between two families count in the one that is placed
        /// later.
        families: BTreeMap<String, Crease>,
    },
    /// Edges of attached families, or of bodies on which junctions slide, become much longer.
    Stretched {
        /// The largest ratio of an edge's length to its length before, by family name.
        families: BTreeMap<String, f64>,
    },
    /// Two plane families matched vertex for vertex and no longer match. No role makes them
    /// partners.
    Parted {
        /// The families.
        families: [String; 2],
        /// Largest change of the vector between two matching vertices, in the mesh's unit.
        distance: f64,
        /// Original position of the first of these two vertices.
        at: DVec3,
    },
    /// A family holds vertices that the design moves with another family.
    HeldBack(HeldBack),
    /// Old profiles pass through parts that stand on their wing, and are bridged there.
    Bridged {
        /// The wing.
        wing: String,
        /// The gaps, each with the number of its profile.
        gaps: Vec<(i64, Gap)>,
    },
    /// Planes of profiles cross no edge of their wing, such as the plane of a section inside the
    /// fuselage. So it cannot be checked whether the wing has these profiles.
    NotJudged {
        /// The wing.
        wing: String,
        /// Numbers of the profiles.
        profiles: Vec<i64>,
    },
    /// Local optimisation of inverted or nearly inverted cells changed the thickness of layers.
    LayersChanged {
        /// Largest change of an edge between layers, as a share of its length.
        share: f64,
    },
    /// Wingtip families border on no vertex that an earlier stage places, or on no family that
    /// moves, so they stay.
    LooseTip {
        /// The families.
        families: Vec<String>,
    },
    /// A new profile may not be what was meant.
    OddProfile {
        /// The wing.
        wing: String,
        /// What is odd.
        remark: Remark,
        /// Number of further profiles of the wing with a remark of the same kind.
        others: usize,
    },
    /// The profiles of two wings move a curve of both wings differently.
    SharedCurve {
        /// The second of the wings, which gives way.
        wing: String,
        /// The curve, with the wing that keeps it.
        curve: SharedCurve,
    },
    /// A family has a role that cannot be meant.
    Misplaced {
        /// The family.
        family: String,
        /// The name of its role.
        role: &'static str,
        /// What the family is, or is not.
        misplaced: Misplaced,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Folded { families } => {
                write!(f, "surface triangles turned over against those around them: {}", counts(families))
            }
            Self::Creased { families } => {
                let of_family = |(family, Crease { edges, degrees, at }): (&String, &Crease)| {
                    format!("{edges} of `{family}`, by up to {degrees:.0} degrees at {}", place(*at))
                };
                let families: Vec<String> = families.iter().map(of_family).collect();
                write!(
                    f,
                    "edges of the surface turn by more than {CREASED} degrees: {}; the surface has a crease there that it had \
                     not, or has lost one",
                    families.join("; ")
                )
            }
            Self::Stretched { families } => {
                let of_family = |(family, ratio): (&String, &f64)| format!("`{family}` {ratio:.1} times");
                let families: Vec<String> = families.iter().map(of_family).collect();
                write!(f, "edges are stretched, so that triangles are coarse there: {}", families.join(", "))
            }
            Self::Parted { families: [one, other], distance, at } => write!(
                f,
                "the planes `{one}` and `{other}` matched vertex for vertex and no longer do: up to {distance:.3e} apart, at \
                 {}; if they are periodic, partner = \"{other}\" in the table of `{one}` keeps them so",
                place(*at)
            ),
            Self::HeldBack(HeldBack { by, family, vertices, max_distance, at, .. }) => write!(
                f,
                "`{by}` holds {vertices} vertices of `{family}` back from where the design has them, by up to \
                 {max_distance:.3e}, at {}: `{family}` is bent there",
                place(*at)
            ),
            Self::Bridged { wing, gaps } => {
                let gaps: Vec<String> = gaps.iter().map(|(profile, gap)| format!("{profile} through {gap}")).collect();
                write!(
                    f,
                    "old profiles of `{wing}` pass through parts on the wing, where their shape is a guess: {}; planes beside \
                     the parts need no guess",
                    gaps.join("; ")
                )
            }
            Self::NotJudged { wing, profiles } => write!(
                f,
                "the planes of the profiles {profiles:?} cross no edge of the wing of `{wing}`: whether it has them cannot be \
                 judged"
            ),
            Self::LayersChanged { share } => write!(
                f,
                "local optimisation of inverted or nearly inverted cells changed the thickness of layers by up to {:.0} %; smaller \
                 motions keep layers",
                100.0 * share
            ),
            Self::LooseTip { families } => write!(
                f,
                "wingtips that touch nothing that moves with a wing stay where they are: {}; is `wingtip` their role?",
                families.join(", ")
            ),
            Self::OddProfile { wing, remark, others: 0 } => write!(f, "profiles of `{wing}`: {remark}"),
            Self::OddProfile { wing, remark, others } => {
                write!(f, "profiles of `{wing}`: {remark} (and so it is with {others} more)")
            }
            Self::SharedCurve { wing, curve } => {
                let SharedCurve { owner, vertices, max_difference, of_chord, at, .. } = curve;
                write!(
                    f,
                    "the profiles of `{owner}` and of `{wing}` move the {vertices} vertices that the two share differently, by up \
                     to {:.2} % of the chord ({max_difference:.3e}), at {}: `{owner}`, whose profiles are given first, has them, \
                     and `{wing}` gives way beside them; one table of profiles for the families of both leaves no difference",
                    100.0 * of_chord,
                    place(DVec3::from(*at))
                )
            }
            Self::Misplaced { family, role, misplaced } => match misplaced {
                Misplaced::Untouched => write!(
                    f,
                    "`{family}` has the role {role}, but touches nothing that moves with a wing, so it stays where it is; is \
                     `{role}` its role?"
                ),
                Misplaced::Far(sides) => write!(
                    f,
                    "`{family}` has the role {role}, but reaches {sides} of the six sides of the mesh's box, as a far boundary \
                     does: it moves with the wing; is `{role}` its role?"
                ),
                Misplaced::Flat => {
                    write!(f, "`{family}` has the role {role}, but all of it lies in one plane; is `plane` its role?")
                }
            },
        }
    }
}

/// The warnings of odd profiles, one for each wing and kind of remark.
fn odd<'a>(remarks: impl Iterator<Item = (&'a str, &'a Remark)>) -> Vec<Warning> {
    let mut warnings: Vec<Warning> = Vec::new();
    for (of, found) in remarks {
        let kind = std::mem::discriminant(found);
        let others = warnings.iter_mut().find_map(|warning| match warning {
            Warning::OddProfile { wing, remark, others } if wing == of && std::mem::discriminant(remark) == kind => {
                Some(others)
            }
            _ => None,
        });
        match others {
            Some(others) => *others += 1,
            None => {
                warnings.push(Warning::OddProfile { wing: of.to_owned(), remark: found.clone(), others: 0 });
            }
        }
    }
    warnings
}

/// The warning of edges that become much longer, if some do.
///
/// - `longest`: the largest ratio of an edge's length to its length before, by family
pub(super) fn stretched<'a>(longest: impl Iterator<Item = (&'a String, f64)>) -> Option<Warning> {
    let too_long = longest.filter(|&(_, ratio)| ratio > STRETCHED);
    let families: BTreeMap<String, f64> = too_long.map(|(family, ratio)| (family.clone(), ratio)).collect();
    (!families.is_empty()).then_some(Warning::Stretched { families })
}

/// A list of counts by family, such as `wing 3, wingtip 1`.
pub(super) fn counts(of: &BTreeMap<String, usize>) -> String {
    of.iter().map(|(family, count)| format!("{family} {count}")).collect::<Vec<_>>().join(", ")
}

impl Mover {
    /// The warnings for the moved mesh.
    ///
    /// - `vertices` `[n_vertices]`: moved positions in the mover's order, in the mesh's unit
    /// - `missed`: the worst vertex of each profile, by wing; profiles with planes that cross no
    ///   edge are left out
    /// - `folded`, `creased`: the number of folded triangles and the creased edges of each family
    ///   that has some
    /// - `smoothed`: what local optimisation did
    pub(super) fn warnings(
        &self,
        vertices: &[DVec3],
        held_back: &[HeldBack],
        design: &Design,
        missed: &BTreeMap<String, Vec<Missed>>,
        (folded, mut creased): (&BTreeMap<String, usize>, BTreeMap<String, Crease>),
        smoothed: Option<Smoothed>,
    ) -> Vec<Warning> {
        creased.retain(|family, _| !folded.contains_key(family));
        let creases = (!creased.is_empty()).then_some(Warning::Creased { families: creased });
        let folds = (!folded.is_empty()).then(|| Warning::Folded { families: folded.clone() });
        let name = |family: &crate::mesh::FamilyId| self.mesh.families[family.index()].clone();
        let original = &self.ordered.vertices;
        let parted = self.families.partners.alike.iter().filter_map(|pair| {
            let (distance, vertex) = pair.apart(original, vertices);
            let families = [name(&pair.families[0]), name(&pair.families[1])];
            let at = original[vertex as usize];
            (distance > PARTED * self.size_of(pair.families[0])).then_some(Warning::Parted { families, distance, at })
        });
        let loose =
            self.stages.attached.loose().map(|tip| Warning::LooseTip { families: tip.iter().map(name).collect() });
        let is_loose = |family: &crate::mesh::FamilyId| self.stages.attached.loose().any(|tip| tip.contains(family));
        let misplaced =
            self.families.misplaced.iter().filter(|(family, _)| !is_loose(family)).map(|(family, misplaced)| {
                let role = &self.families.roles[family.index()];
                match (role, misplaced) {
                    (Role::Wingtip { .. }, Misplaced::Untouched) => Warning::LooseTip { families: vec![name(family)] },
                    _ => Warning::Misplaced { family: name(family), role: role.name(), misplaced: *misplaced },
                }
            });
        let of_wings = self.stages.wings.gaps().filter(|(_, gaps)| !gaps.is_empty());
        let bridged = of_wings.map(|(wing, gaps)| Warning::Bridged { wing: wing.to_owned(), gaps: gaps.to_vec() });
        let nothing_moves = original == vertices;
        let held_back = held_back.iter().cloned().map(Warning::HeldBack);
        let not_judged = missed.iter().filter_map(|(wing, missed)| {
            let judged: HashSet<i64> = missed.iter().map(|missed| missed.profile).collect();
            let numbers = design.profiles.get(wing)?.iter().map(|profile| profile.number);
            let profiles: Vec<i64> = numbers.filter(|number| !judged.contains(number)).collect();
            (!profiles.is_empty()).then(|| Warning::NotJudged { wing: wing.clone(), profiles })
        });
        let layers = smoothed.map(|smoothed| smoothed.layers_changed).filter(|&share| share > LAYERS);
        let layers = layers.map(|share| Warning::LayersChanged { share });
        let different = self.stages.wings.shared_curves().filter(|(_, curve)| curve.of_chord > DIFFERENT);
        let different =
            different.map(|(wing, curve)| Warning::SharedCurve { wing: wing.to_owned(), curve: curve.clone() });
        folds
            .into_iter()
            .chain(creases)
            .chain(layers)
            .chain(bridged)
            .chain(odd(self.stages.wings.remarks()))
            .chain(different)
            .chain(parted)
            .chain(loose.chain(misplaced).filter(|_| !nothing_moves))
            .chain(held_back)
            .chain(not_judged)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One remark a wing and kind stands for all of them.
    #[test]
    fn odd_profiles_are_told_once() {
        let open = |profile| Remark::Open { profile, gap: 0.25 };
        let alone = Remark::Alone { profile: 4, reach: 2.0, chord: 1.0 };
        let (one, two, three) = (open(1), open(2), open(3));
        let all = [("wing", &one), ("wing", &alone), ("tail", &two), ("wing", &three)];
        let texts: Vec<String> = odd(all.into_iter()).iter().map(Warning::to_string).collect();
        assert_eq!(texts.len(), 3, "{texts:?}");
        assert!(texts[0].starts_with("profiles of `wing`: profile 1: "), "{texts:?}");
        assert!(texts[0].ends_with("(and so it is with 1 more)"), "{texts:?}");
        assert!(texts[1].starts_with("profiles of `wing`: profile 4 is the only one"), "{texts:?}");
        assert!(texts[2].starts_with("profiles of `tail`: profile 2: ") && !texts[2].contains("more)"), "{texts:?}");
    }

    #[test]
    fn folds_are_told_by_family() {
        let families = BTreeMap::from([("wing".to_owned(), 3), ("tip".to_owned(), 1)]);
        assert!(Warning::Folded { families }.to_string().ends_with(": tip 1, wing 3"));
    }
}
