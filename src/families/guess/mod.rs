//! Guesses the roles of a mesh's families, from their shapes, their places and their names.
//!
//! Shapes and places decide as far as they can: which families are planes around the mesh, which
//! are the far boundary, which can be cut in sections like a wing's, and which touch these. Names
//! decide where shapes fit several roles, and make a guess more certain. [`guess`] gives a reason
//! for each role. A mesh in which nothing looks like a wing is an error, and no guess.
//!
//! | file | holds |
//! |---|---|
//! | `surroundings`, `wings`, `winglets`, `followers` | the parts of a guess, in this order |
//! | `sections` | cuts families as a wing is cut |
//! | `words` | what names say |

mod followers;
mod sections;
mod surroundings;
mod winglets;
mod wings;
mod words;

use std::collections::BTreeSet;

use glam::DVec3;
use thiserror::Error;

use super::Role;
use super::misplaced::sides_of;
use crate::geometry::{bounds, triangle_normal};
use crate::mesh::{FamilyId, HybridMesh, half_edge::Surface};
use crate::profile::Plane;
use crate::text::nearest::quoted;

pub use sections::Sections;
use words::{Named, named};

/// How certain a guess is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Certainty {
    /// Another role fits as well: the user should look at it.
    Doubtful,
    /// Shape or name say so.
    Likely,
    /// Shape and name agree, or nothing else is possible.
    Sure,
}

impl Certainty {
    /// The name in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Doubtful => "doubtful",
            Self::Likely => "likely",
            Self::Sure => "sure",
        }
    }
}

/// The guessed role of a family.
#[derive(Clone, Debug)]
pub struct Guess {
    /// The role.
    pub role: Role,
    /// How certain it is.
    pub certainty: Certainty,
    /// Why, in words.
    pub reason: String,
}

/// A wing: the families that make it up, and its sections.
#[derive(Clone, Debug)]
pub struct GuessedWing {
    /// The families, ascending.
    pub families: Vec<FamilyId>,
    /// Its sections, by evenly spaced planes. Those of its winglets come last.
    pub sections: Sections,
    /// The plane in which the other half is the mirror image of the sections, if the families hold
    /// two halves.
    pub mirror: Option<Plane>,
    /// The wing that goes on in this winglet.
    continues: Option<usize>,
}

impl GuessedWing {
    /// Adds a winglet.
    fn join(&mut self, winglet: Self) {
        self.families.extend(winglet.families);
        self.families.sort_unstable();
        self.sections.join(winglet.sections);
    }
}

/// What was guessed about a mesh.
#[derive(Clone, Debug)]
pub struct Guesses {
    /// A guess for each family `[n_families]`.
    pub families: Vec<Guess>,
    /// At least one.
    pub wings: Vec<GuessedWing>,
}

/// Nothing in the mesh looks like a wing.
#[derive(Clone, Debug, Error)]
pub enum NoWing {
    /// No family and no families together have sections like a wing's.
    #[error(
        "no family looks like a wing: none, alone or with a neighbour, has sections with a trailing edge along y or z; the \
         mesh has {}{}",
        quoted(families),
        if bodies.is_empty() { "; all of these are planes or the far boundary".to_owned() }
            else { format!(", of which neither plane nor far boundary are {}", quoted(bodies)) }
    )]
    NoneFound {
        /// The families of the mesh.
        families: Vec<String>,
        /// Those that are neither planes around the mesh nor its far boundary.
        bodies: Vec<String>,
    },
    /// The families that the user names cannot be cut in sections.
    #[error("{} cannot be cut in sections like a wing's: {why}", quoted(families))]
    NotCut {
        /// The families.
        families: Vec<String>,
        /// Why the plane in the middle of the span gives no section.
        why: String,
    },
}

/// What the caller knows about the mesh.
#[derive(Clone, Debug)]
pub struct Known<'a> {
    /// The families of one wing, if the user names them.
    pub wing: &'a [FamilyId],
    /// Number of sections of a wing.
    pub planes: usize,
    /// Whether all faces of a family lie inside the volume `[n_families]`.
    pub inside: &'a [bool],
    /// Families that the mesh file calls planes of symmetry or cyclic.
    pub planes_of_file: &'a [FamilyId],
    /// Whether winglets and the other half of an aircraft may join a wing.
    pub joins: bool,
}

/// The normals of a trailing edge's base are along the chord: least mean share.
const BASE: f64 = 0.6;

/// Guesses the role of each family.
///
/// # Errors
/// [`NoWing`]
pub fn guess(mesh: HybridMesh, surface: &Surface, known: &Known) -> Result<Guesses, NoWing> {
    let mut guesser = Guesser::new(mesh, surface, known);
    guesser.guess_surroundings();
    guesser.guess_wings()?;
    if known.joins {
        guesser.guess_winglets();
    }
    guesser.guess_followers();
    guesser.join_winglets();
    if known.joins {
        guesser.join_halves();
    }
    let Guesser { guesses, wings, .. } = guesser;
    let families = guesses.into_iter().map(|guess| guess.unwrap_or_else(resting)).collect();
    Ok(Guesses { families, wings })
}

/// The guess for a family about which nothing is known.
fn resting() -> Guess {
    let reason = "it touches nothing that moves".to_owned();
    Guess { role: Role::Fixed, certainty: Certainty::Likely, reason }
}

struct Guesser<'a> {
    mesh: HybridMesh<'a>,
    surface: &'a Surface,
    known: &'a Known<'a>,
    /// The box of the surface, in the mesh's unit.
    mesh_box: Option<[DVec3; 2]>,
    /// What the names say `[n_families]`.
    named: Vec<Option<(Named, &'static str)>>,
    /// The families at whose edges a family ends `[n_families]`.
    neighbours: Vec<BTreeSet<usize>>,
    /// Area of each family `[n_families]`, in the mesh's unit squared.
    areas: Vec<f64>,
    guesses: Vec<Option<Guess>>,
    wings: Vec<GuessedWing>,
}

impl<'a> Guesser<'a> {
    fn new(mesh: HybridMesh<'a>, surface: &'a Surface, known: &'a Known<'a>) -> Self {
        let families = &mesh.mesh.families;
        let mut neighbours = vec![BTreeSet::new(); families.len()];
        for half_edge in 0..surface.opposite.len() as u32 {
            let (own, other) = (surface.family[half_edge as usize / 3], surface.family_behind(half_edge));
            if own != other {
                neighbours[own.index()].insert(other.index());
            }
        }
        let mut areas = vec![0.0; families.len()];
        for (corners, family) in surface.triangles.iter().zip(&surface.family) {
            areas[family.index()] += 0.5 * triangle_normal(corners.map(|v| mesh.vertices()[v as usize])).length();
        }
        let named = families.iter().map(|name| named(name)).collect();
        let guesses = vec![None; families.len()];
        let mesh_box = bounds(surface.vertices().iter().map(|&vertex| mesh.vertices()[vertex as usize]));
        Self { mesh, surface, known, mesh_box, named, neighbours, areas, guesses, wings: Vec::new() }
    }

    fn says(&self, family: usize, named: Named) -> bool {
        self.named[family].is_some_and(|(found, _)| found == named)
    }

    fn set(&mut self, family: usize, role: Role, certainty: Certainty, reason: impl Into<String>) {
        self.guesses[family] = Some(Guess { role, certainty, reason: reason.into() });
    }

    fn n_families(&self) -> usize {
        self.guesses.len()
    }

    fn points(&self, family: usize) -> impl Iterator<Item = DVec3> + '_ {
        let vertices = self.surface.vertices_of(FamilyId(family as u16));
        vertices.iter().map(|&vertex| self.mesh.vertices()[vertex as usize])
    }

    /// Families that are joined by edges, among those that a function chooses. Each part ascends.
    fn parts(&self, is_in: impl Fn(&Self, usize) -> bool) -> Vec<Vec<usize>> {
        let mut seen = vec![false; self.n_families()];
        let mut parts = Vec::new();
        for first in 0..self.n_families() {
            if seen[first] || !is_in(self, first) {
                continue;
            }
            seen[first] = true;
            let mut part = vec![first];
            let mut at = 0;
            while let Some(&family) = part.get(at) {
                for &other in &self.neighbours[family] {
                    if !seen[other] && is_in(self, other) {
                        seen[other] = true;
                        part.push(other);
                    }
                }
                at += 1;
            }
            part.sort_unstable();
            parts.push(part);
        }
        parts
    }

    /// Makes each winglet a part of its wing.
    fn join_winglets(&mut self) {
        let (winglets, mut wings): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.wings).into_iter().partition(|wing| wing.continues.is_some());
        // Winglets stand after all wings, whose places they therefore know.
        for winglet in winglets {
            if let Some(wing) = winglet.continues.and_then(|wing| wings.get_mut(wing)) {
                wing.join(winglet);
            }
        }
        self.wings = wings;
    }

    /// Makes two wings that are each other's mirror image one, whose sections are those of the
    /// first.
    fn join_halves(&mut self) {
        let Some(normal) = self.wings.first().map(|wing| wing.sections.normal) else { return };
        let is_asked = |wing: &GuessedWing| wing.families.iter().any(|family| self.known.wing.contains(family));
        let mut open = std::mem::take(&mut self.wings);
        open.reverse();
        let mut wings = Vec::new();
        while let Some(mut wing) = open.pop() {
            let image = |other: &GuessedWing| match is_asked(&wing) || is_asked(other) {
                true => None,
                false => wing.sections.mirror(&other.sections, normal),
            };
            let found = open.iter().enumerate().rev().find_map(|(at, other)| Some((at, image(other)?)));
            if let Some((at, place)) = found {
                // Rounding of a plane through the origin.
                let [from, to] = wing.sections.span;
                let place = if place.abs() < 1e-6 * (to - from) { 0.0 } else { place };
                let other = open.remove(at);
                wing.families.extend(other.families);
                wing.families.sort_unstable();
                wing.mirror = Some(Plane { point: normal * place, normal });
            }
            wings.push(wing);
        }
        self.wings = wings;
    }

    /// Number of the sides of the mesh's box that families reach together.
    fn sides(&self, families: &[usize]) -> usize {
        let own = families.iter().flat_map(|&family| self.points(family));
        self.mesh_box.zip(bounds(own)).map_or(0, |(all, own)| sides_of(all, own))
    }

    fn name(&self, family: usize) -> String {
        format!("`{}`", self.mesh.mesh.families[family])
    }

    fn word(&self, family: usize) -> String {
        self.named[family].map_or(String::new(), |(_, word)| format!("\"{word}\""))
    }

    fn is_open(&self, family: usize) -> bool {
        self.guesses[family].is_none()
    }

    /// Whether a family runs along at least half of the span of a wing.
    fn spans(&self, family: usize, sections: &Sections) -> bool {
        let [low, high] = self.along(family, sections.normal);
        let [from, to] = sections.span;
        high.min(to) - low.max(from) >= 0.5 * (to - from)
    }

    /// Extent of a family along a direction, in the mesh's unit.
    fn along(&self, family: usize, direction: DVec3) -> [f64; 2] {
        let distances = self.points(family).map(|at| at.dot(direction));
        distances.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], d| [low.min(d), high.max(d)])
    }

    /// Mean of the absolute cosine between the normals of a family and a direction, by area.
    fn faces(&self, family: usize, direction: DVec3) -> f64 {
        let triangles = self.surface.corners_of(FamilyId(family as u16));
        let normals = triangles.map(|corners| triangle_normal(corners.map(|v| self.mesh.vertices()[v as usize])));
        let (along, all) = normals
            .fold((0.0, 0.0), |(along, all), normal| (along + normal.dot(direction).abs(), all + normal.length()));
        if all > 0.0 { along / all } else { 0.0 }
    }
}
