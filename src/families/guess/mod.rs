//! Guesses the roles of a mesh's families, from their shapes, their places and their names.
//!
//! Shapes and places decide as far as they can: which families are planes around the mesh, which
//! are the far boundary, which can be cut in sections like a wing's, and which touch these. Names
//! decide where shapes fit several roles, and make a guess more certain. [`guess`] gives a reason
//! for each role. A mesh in which nothing looks like a wing is an error, and no guess.
//!
//! `words` holds what names say, `sections` cuts families like a wing.

mod sections;
mod words;

use std::collections::BTreeSet;

use glam::DVec3;
use thiserror::Error;

use super::misplaced::{FAR, sides_of};
use super::shape::{FamilyShape, fit_plane};
use super::{RigidMotion, Role, SetupError, TipStart};
use crate::geometry::{bounds, triangle_normal};
use crate::mesh::{FamilyId, HybridMesh, half_edge::Surface, triangles_of_families};
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
    /// Its sections, by evenly spaced planes.
    pub sections: Sections,
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
}

/// A family this far off its plane, as a share of its size, may be a plane with noise.
const NOISE: f64 = 5e-3;

/// A plane family named so may have this much more noise.
const NAMED_NOISE: f64 = 5e-2;

/// The normals of a trailing edge's base are along the chord: least mean share.
const BASE: f64 = 0.6;

/// Share of the span at a wing's end in which a wingtip lies.
const TIP: f64 = 0.15;

/// A wingtip is at most this many chords long, and a fuselage is longer.
const LONG: f64 = 1.3;

/// So many families, the largest first, are tried as wings if no name tells which are.
const MOST_TRIED: usize = 24;

/// Guesses the role of each family.
///
/// # Errors
/// [`NoWing`]
pub fn guess(mesh: HybridMesh, surface: &Surface, known: &Known) -> Result<Guesses, NoWing> {
    let mut guesser = Guesser::new(mesh, surface, known);
    guesser.guess_surroundings();
    guesser.guess_wings()?;
    guesser.guess_followers();
    let Guesser { guesses, wings, .. } = guesser;
    let families = guesses.into_iter().map(|guess| guess.unwrap_or_else(resting)).collect();
    Ok(Guesses { families, wings })
}

/// The guess for a family about which nothing is known.
fn resting() -> Guess {
    let reason = "it touches nothing that moves".to_owned();
    Guess { role: Role::Fixed, certainty: Certainty::Likely, reason }
}

/// A wingtip with the usual options.
const TIP_ROLE: Role = Role::Wingtip { coefficient: 0.5, start: TipStart::Affine };

const HUNG_ROLE: Role = Role::Attached { coefficient: 0.5, start: TipStart::Rigid };

const BODY_ROLE: Role = Role::Rigid { motion: RigidMotion::Root };

/// A plane around the mesh.
#[derive(Clone, Copy)]
struct Around {
    flat: Option<f64>,
}

struct Guesser<'a> {
    mesh: HybridMesh<'a>,
    surface: &'a Surface,
    known: &'a Known<'a>,
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
        Self { mesh, surface, known, named, neighbours, areas, guesses, wings: Vec::new() }
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

    /// Families inside the volume, planes around the mesh, and the far boundary.
    fn guess_surroundings(&mut self) {
        let mut planes: Vec<Option<Around>> = vec![None; self.n_families()];
        for family in 0..self.n_families() {
            if self.known.inside[family] {
                self.set(family, Role::Interior, Certainty::Sure, "its faces lie inside the volume, between two cells");
            } else if self.surface.vertices_of(FamilyId(family as u16)).is_empty() {
                self.set(family, Role::Fixed, Certainty::Sure, "it has no faces");
            } else if !self.known.wing.contains(&FamilyId(family as u16)) {
                planes[family] = self.plane_around(family);
            }
        }
        let is_open = |guesser: &Self, family: usize| guesser.guesses[family].is_none() && planes[family].is_none();
        for part in self.parts(|guesser, family| is_open(guesser, family)) {
            let sides_of_part = self.sides(&part);
            for &family in &part {
                let sides = self.sides(&[family]);
                let is_named = self.says(family, Named::Far);
                let reason = match (sides, sides_of_part) {
                    _ if self.known.wing.contains(&FamilyId(family as u16)) => continue,
                    (6, _) => "the far boundary: it reaches all six sides of the mesh's box".to_owned(),
                    (own, _) if own >= FAR => {
                        format!("the far boundary: it reaches {own} of the six sides of the mesh's box")
                    }
                    (own, all) if own > 0 && all >= FAR => {
                        format!("a part of the far boundary, which reaches {all} of the six sides of the mesh's box")
                    }
                    _ if is_named => format!("its name says {}", self.word(family)),
                    _ => continue,
                };
                let touches_part = part.len() > 1
                    && sides >= FAR
                    && self.neighbours[family].iter().any(|other| part.contains(other) && self.sides(&[*other]) == 0);
                let certainty = match (is_named, touches_part) {
                    (_, true) => Certainty::Doubtful,
                    (true, _) => Certainty::Sure,
                    _ => Certainty::Likely,
                };
                self.set(family, Role::Fixed, certainty, reason);
            }
        }
        for family in 0..self.n_families() {
            let Some(Around { flat }) = planes[family] else { continue };
            let touches = |other: &usize| planes[*other].is_none() && self.guesses[*other].is_none();
            let body = self.neighbours[family].iter().copied().find(touches);
            let is_named =
                self.says(family, Named::Plane) || self.known.planes_of_file.contains(&FamilyId(family as u16));
            let noise = match flat {
                None => "flat".to_owned(),
                Some(flat) => format!("flat to {flat:e} of its size"),
            };
            let (is_plane, why) = match body {
                Some(body) => (true, format!("it touches {}", self.name(body))),
                None if is_named => (true, "it is called a plane".to_owned()),
                None => (false, "it touches nothing that moves".to_owned()),
            };
            let certainty = match (is_plane, is_named, flat) {
                (true, true, _) | (true, _, None) => Certainty::Sure,
                (true, ..) => Certainty::Doubtful,
                (false, ..) => Certainty::Likely,
            };
            let role = if is_plane { Role::Plane { flat, partner: None } } else { Role::Fixed };
            self.set(family, role, certainty, format!("{noise}, on a side of the mesh, and {why}"));
        }
    }

    /// The plane of a family that bounds the whole mesh on one side.
    fn plane_around(&self, family: usize) -> Option<Around> {
        let id = FamilyId(family as u16);
        let is_named = self.says(family, Named::Plane) || self.known.planes_of_file.contains(&id);
        let fit = |flat| fit_plane(self.mesh.mesh, self.surface, id, flat);
        let (shape, flat) = match fit(None) {
            Ok(shape) => (shape, None),
            Err(SetupError::NotPlane { least, .. }) if least <= if is_named { NAMED_NOISE } else { NOISE } => {
                (fit(Some(least)).ok()?, Some(least))
            }
            Err(_) => return None,
        };
        let FamilyShape::Plane(point, normal) = shape else { return None };
        let size = self.points(family).map(|at| at.distance(point)).fold(0.0, f64::max);
        let near = 2.0 * flat.unwrap_or(1e-6) * size;
        let all =
            self.surface.vertices().iter().map(|&vertex| normal.dot(self.mesh.vertices()[vertex as usize] - point));
        let (low, high) = all.fold((0.0, 0.0), |(low, high): (f64, f64), d| (low.min(d), high.max(d)));
        // A surface that is thin itself, such as a sheet, has all its vertices near every plane.
        (low >= -near || high <= near).then_some(Around { flat }).filter(|_| high - low > 4.0 * near)
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

    /// Number of the sides of the mesh's box that families reach together.
    fn sides(&self, families: &[usize]) -> usize {
        let all = self.surface.vertices().iter().map(|&vertex| self.mesh.vertices()[vertex as usize]);
        let own = families.iter().flat_map(|&family| self.points(family));
        bounds(all).zip(bounds(own)).map_or(0, |(all, own)| sides_of(all, own))
    }

    fn name(&self, family: usize) -> String {
        format!("`{}`", self.mesh.mesh.families[family])
    }

    fn word(&self, family: usize) -> String {
        self.named[family].map_or(String::new(), |(_, word)| format!("\"{word}\""))
    }

    fn sections(&self, families: &[usize]) -> Option<Sections> {
        self.cut(families).ok()
    }

    fn cut(&self, families: &[usize]) -> Result<Sections, String> {
        let ids: Vec<FamilyId> = families.iter().map(|&family| FamilyId(family as u16)).collect();
        Sections::of(self.mesh.vertices(), &triangles_of_families(self.mesh, &ids), self.known.planes)
    }

    fn is_open(&self, family: usize) -> bool {
        self.guesses[family].is_none()
    }

    /// Finds the wings, and gives their families the role.
    ///
    /// # Errors
    /// [`NoWing`]
    fn guess_wings(&mut self) -> Result<(), NoWing> {
        let asked: Vec<usize> = self.known.wing.iter().map(|family| family.index()).collect();
        if !asked.is_empty() {
            let sections = self.cut(&asked).map_err(|why| NoWing::NotCut {
                families: asked.iter().map(|&family| self.mesh.mesh.families[family].clone()).collect(),
                why,
            })?;
            self.take_wing(asked, sections, Certainty::Sure, "you name it as the wing");
        }
        // Families with a wing's name that touch are one wing.
        for part in self.parts(|guesser, family| guesser.is_open(family) && guesser.says(family, Named::Wing)) {
            if asked_touch(&self.neighbours, &self.wings, &part) {
                continue;
            }
            let why = format!("its name says {}", self.word(part[0]));
            if let Some(sections) = self.sections(&part) {
                self.take_wing(part, sections, Certainty::Sure, &why);
                continue;
            }
            // The rest of the section may have other names, such as those of strips at its edges.
            let strip = |family: &usize| self.is_open(*family) && !self.says(*family, Named::Fuselage);
            let around: BTreeSet<usize> = part.iter().flat_map(|&family| self.neighbours[family].clone()).collect();
            let with: Vec<usize> = around.into_iter().filter(strip).chain(part.iter().copied()).collect();
            let with: Vec<usize> = with.into_iter().collect::<BTreeSet<_>>().into_iter().collect();
            if let Some(sections) = self.sections(&with) {
                self.take_wing(with, sections, Certainty::Likely, "with its neighbours it has the sections of a wing");
            }
        }
        if self.wings.is_empty() {
            self.find_wing_by_shape();
        }
        if self.wings.is_empty() {
            let open = (0..self.n_families()).filter(|&family| self.is_open(family));
            let bodies = open.map(|family| self.mesh.mesh.families[family].clone()).collect();
            return Err(NoWing::NoneFound { families: self.mesh.mesh.families.clone(), bodies });
        }
        Ok(())
    }

    /// Finds a wing without a name: one family, two that touch, or all that are joined.
    fn find_wing_by_shape(&mut self) {
        let may_be = |guesser: &Self, family: usize| guesser.is_open(family) && guesser.named[family].is_none();
        let mut open: Vec<usize> = (0..self.n_families()).filter(|&family| may_be(self, family)).collect();
        open.sort_by(|&a, &b| self.areas[b].total_cmp(&self.areas[a]));
        open.truncate(MOST_TRIED);
        let mut tried: Vec<Vec<usize>> = open.iter().map(|&family| vec![family]).collect();
        tried.extend(self.parts(may_be).into_iter().filter(|part| part.len() > 1));
        for (index, &one) in open.iter().enumerate() {
            let touching = open[index + 1..].iter().filter(|&other| self.neighbours[one].contains(other));
            tried.extend(touching.map(|&other| vec![one.min(other), one.max(other)]));
        }
        let found = tried.into_iter().find_map(|families| Some((self.sections(&families)?, families)));
        let Some((sections, families)) = found else { return };
        let together = if families.len() > 1 { "together with its neighbours " } else { "" };
        self.take_wing(families, sections, Certainty::Likely, &format!("{together}it has the sections of a wing"));
    }

    /// Makes families a wing, with strips beside them that belong to its section.
    fn take_wing(&mut self, mut families: Vec<usize>, mut sections: Sections, certainty: Certainty, why: &str) {
        let own: Vec<usize> = families.clone();
        let around: BTreeSet<usize> = own.iter().flat_map(|&family| self.neighbours[family].clone()).collect();
        for strip in around.into_iter().filter(|&family| self.is_open(family) && !own.contains(&family)) {
            let is_free = self.named[strip].is_none_or(|(named, _)| named == Named::TrailingEdge);
            if !is_free || !self.spans(strip, &sections) || self.faces(strip, sections.chordwise) > BASE {
                continue;
            }
            let with: Vec<usize> = families.iter().copied().chain([strip]).collect();
            if let Some(wider) = self.sections(&with) {
                (families, sections) = (with, wider);
            }
        }
        families.sort_unstable();
        let text = sections.in_words();
        for &family in &families {
            let (certainty, why) = match own.contains(&family) {
                true => (certainty, why.to_owned()),
                false => (Certainty::Likely, "a strip along the span, which belongs to the wing's section".to_owned()),
            };
            self.set(family, Role::Wing, certainty, format!("{why}; {text}"));
        }
        let families = families.into_iter().map(|family| FamilyId(family as u16)).collect();
        self.wings.push(GuessedWing { families, sections });
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

    /// The families that follow the wings, and those that stay.
    fn guess_followers(&mut self) {
        // From the wings outward: a tip behind a winglet touches no wing itself.
        loop {
            let moves = |guess: &Option<Guess>| {
                guess
                    .as_ref()
                    .is_some_and(|guess| matches!(guess.role, Role::Wing | Role::TrailingEdge | Role::Wingtip { .. }))
            };
            let beside =
                |family: usize| self.neighbours[family].iter().copied().find(|&other| moves(&self.guesses[other]));
            let next: Vec<(usize, usize)> = (0..self.n_families())
                .filter(|&family| self.is_open(family))
                .filter_map(|family| Some((family, beside(family)?)))
                .collect();
            if next.is_empty() {
                break;
            }
            for (family, other) in next {
                self.guess_follower(family, other);
            }
        }
        self.join_tips();
        for family in 0..self.n_families() {
            if self.is_open(family) {
                let certainty = match self.says(family, Named::Wing) {
                    true => Certainty::Doubtful,
                    false => Certainty::Likely,
                };
                self.set(family, Role::Fixed, certainty, "it touches no wing and nothing that follows one");
            }
        }
    }

    /// Whether a family was guessed to hang from a wing.
    fn hangs(&self, family: usize) -> bool {
        self.guesses[family]
            .as_ref()
            .is_some_and(|guess| matches!(guess.role, Role::Attached { .. } | Role::Rigid { .. }))
    }

    /// Wingtips that touch attached families are attached too: what hangs together has one start.
    fn join_tips(&mut self) {
        let is_tip = |guesser: &Self, family: usize| {
            guesser.guesses[family].as_ref().is_some_and(|guess| matches!(guess.role, Role::Wingtip { .. }))
        };
        let joins = |guesser: &Self, family: usize| {
            let hung = guesser.neighbours[family].iter().copied().find(|&other| guesser.hangs(other))?;
            is_tip(guesser, family).then_some((family, hung))
        };
        while let Some((family, hung)) = (0..self.n_families()).find_map(|family| joins(self, family)) {
            let reason = format!("it touches {}, with which it hangs together", self.name(hung));
            self.set(family, HUNG_ROLE, Certainty::Likely, reason);
        }
    }

    /// - `other`: a neighbour that moves
    fn guess_follower(&mut self, family: usize, other: usize) {
        let touches = format!("it touches {}", self.name(other));
        let word = self.named[family].map(|(named, _)| named);
        let nearest = self.nearest_wing(family);
        let sections = &self.wings[nearest].sections;
        let [low, high] = self.along(family, sections.chordwise);
        let length = (high - low) / sections.longest_chord;
        let is_base = self.faces(family, sections.chordwise) > BASE && self.spans(family, sections);
        let [from, to] = sections.span;
        let reach = TIP * (to - from);
        // A wing that is whole has a tip at each end.
        let places: Vec<f64> = self.points(family).map(|at| at.dot(sections.normal)).collect();
        let is_at_end = length <= LONG && places.iter().all(|&at| at >= to - reach || at <= from + reach);
        let is_flat = fit_plane(self.mesh.mesh, self.surface, FamilyId(family as u16), None).is_ok();
        let says = |guesser: &Self| format!("its name says {}", guesser.word(family));
        let long = format!("it is {length:.1} chords long");
        let (role, certainty, reason) = match word {
            Some(Named::TrailingEdge) if is_base => {
                (Role::TrailingEdge, Certainty::Sure, format!("{}, and its faces look along the chord", says(self)))
            }
            Some(Named::TrailingEdge) => {
                (Role::TrailingEdge, Certainty::Doubtful, format!("{} and {touches}", says(self)))
            }
            Some(Named::Wingtip) if is_at_end => {
                (TIP_ROLE, Certainty::Sure, format!("{}, and it lies at an end of the span", says(self)))
            }
            Some(Named::Wingtip) => (TIP_ROLE, Certainty::Doubtful, format!("{} and {touches}", says(self))),
            Some(Named::Fuselage) if !is_flat => {
                (Role::Carenage, Certainty::Sure, format!("{} and {touches}", says(self)))
            }
            Some(Named::Body) if self.hangs(other) => {
                (BODY_ROLE, Certainty::Likely, format!("{} and {touches}, from which it hangs", says(self)))
            }
            Some(Named::Carried | Named::Body) => (
                HUNG_ROLE,
                Certainty::Likely,
                format!("{} and {touches}, which carries it and keeps its shape", says(self)),
            ),
            Some(Named::Far) => (Role::Fixed, Certainty::Doubtful, format!("{}, although {touches}", says(self))),
            _ if is_base => {
                (Role::TrailingEdge, Certainty::Likely, format!("{touches}, and its faces look along the chord"))
            }
            _ if self.hangs(other) => (HUNG_ROLE, Certainty::Likely, format!("{touches}, from which it hangs")),
            _ if is_at_end => (TIP_ROLE, Certainty::Likely, format!("{touches} and lies at an end of the span")),
            _ if length > LONG && !is_flat => (Role::Carenage, Certainty::Likely, format!("{touches}, and {long}")),
            _ => (TIP_ROLE, Certainty::Doubtful, format!("{touches}, which carries it and keeps its shape")),
        };
        self.set(family, role, certainty, reason);
    }

    /// The wing whose sections are nearest to the middle of a family.
    fn nearest_wing(&self, family: usize) -> usize {
        let middle =
            |points: &mut dyn Iterator<Item = DVec3>| bounds(points).map_or(DVec3::ZERO, |[a, b]| 0.5 * (a + b));
        let own = middle(&mut self.points(family));
        let distance = |wing: &GuessedWing| {
            let points = wing.families.iter().flat_map(|family| self.points(family.index()));
            points.map(|at| at.distance_squared(own)).fold(f64::INFINITY, f64::min)
        };
        let distances: Vec<f64> = self.wings.iter().map(distance).collect();
        (0..distances.len()).min_by(|&a, &b| distances[a].total_cmp(&distances[b])).unwrap_or(0)
    }
}

/// Whether some families touch a wing.
fn asked_touch(neighbours: &[BTreeSet<usize>], wings: &[GuessedWing], families: &[usize]) -> bool {
    let is_wing = |other: &usize| wings.iter().any(|wing| wing.families.contains(&FamilyId(*other as u16)));
    families.iter().any(|&family| neighbours[family].iter().any(is_wing))
}
