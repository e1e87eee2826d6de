//! The families that follow the wings, and those that stay.

use glam::DVec3;

use super::words::Named;
use super::{BASE, Certainty, Guess, GuessedWing, Guesser};
use crate::families::shape::fit_plane;
use crate::families::{Junction, RigidMotion, Role, TipStart};
use crate::geometry::bounds;
use crate::mesh::FamilyId;

/// Share of the span at a wing's end in which a wingtip lies.
const TIP: f64 = 0.15;

/// A wingtip closes the end of the wing: it reaches at least this near to it, as a share of the
/// span. A fence that stands on the wing inside its tip does not.
const END: f64 = 1e-3;

/// A wingtip is at most this many chords long, and a fuselage is longer.
const LONG: f64 = 1.3;

/// A wingtip with the usual options.
const TIP_ROLE: Role = Role::Wingtip { coefficient: 0.5, start: TipStart::Affine };

/// A part that hangs from a wing, with the usual options.
const HUNG_ROLE: Role = Role::Attached { coefficient: 0.5, start: TipStart::Rigid, junction: Junction::Glued };

/// A body that such a part carries.
const BODY_ROLE: Role = Role::Rigid { motion: RigidMotion::Root, junction: Junction::Glued };

impl Guesser<'_> {
    /// The families that follow the wings, and those that stay.
    pub(super) fn guess_followers(&mut self) {
        // From the wings outward: a tip behind a winglet touches no wing itself.
        loop {
            let moves = |guess: &Option<Guess>| {
                let role = guess.as_ref().map(|guess| &guess.role);
                matches!(role, Some(Role::Wing | Role::TrailingEdge | Role::Wingtip { .. }))
                    || matches!(role, Some(Role::Attached { .. } | Role::Rigid { .. }))
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
        let role = self.guesses[family].as_ref().map(|guess| &guess.role);
        matches!(role, Some(Role::Attached { .. } | Role::Rigid { .. }))
    }

    /// Wingtips that touch attached families are attached too: what hangs together has one start.
    fn join_tips(&mut self) {
        let joins = |guesser: &Self, family: usize| {
            let role = guesser.guesses[family].as_ref().map(|guess| &guess.role);
            let hung = guesser.neighbours[family].iter().copied().find(|&other| guesser.hangs(other))?;
            matches!(role, Some(Role::Wingtip { .. })).then_some((family, hung))
        };
        while let Some((family, hung)) = (0..self.n_families()).find_map(|family| joins(self, family)) {
            let reason = format!("it touches {}, with which it hangs together", self.name(hung));
            self.set(family, HUNG_ROLE, Certainty::Likely, reason);
        }
    }

    /// - `other`: a neighbour that moves
    fn guess_follower(&mut self, family: usize, other: usize) {
        let touches = format!("it touches {}", self.name(other));
        let nearest = self.nearest_wing(family);
        // Base and end of a winglet that is a wing have its name.
        let is_of_winglet = self.wings[nearest].continues.is_some();
        let word =
            self.named[family].map(|(named, _)| named).filter(|&named| !is_of_winglet || named != Named::Carried);
        let sections = &self.wings[nearest].sections;
        let [low, high] = self.along(family, sections.chordwise);
        let length = (high - low) / sections.longest_chord;
        let is_base = self.faces(family, sections.chordwise) > BASE && self.spans(family, sections);
        let [from, to] = sections.span;
        let reach = TIP * (to - from);
        // A wing that is whole has a tip at each end.
        let places: Vec<f64> = self.points(family).map(|at| at.dot(sections.normal)).collect();
        let is_at_end = length <= LONG
            && places.iter().all(|&at| at >= to - reach || at <= from + reach)
            && places.iter().any(|&at| at >= to - END * (to - from) || at <= from + END * (to - from));
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
            _ if self.hangs(other) && self.areas[family] > self.areas[other] => (
                BODY_ROLE,
                Certainty::Likely,
                format!("{touches}, from which it hangs, and has the larger surface of the two"),
            ),
            _ if self.hangs(other) => (HUNG_ROLE, Certainty::Likely, format!("{touches}, from which it hangs")),
            _ if is_at_end => (TIP_ROLE, Certainty::Likely, format!("{touches} and lies at an end of the span")),
            _ if length > LONG && !is_flat => (Role::Carenage, Certainty::Likely, format!("{touches}, and {long}")),
            _ => (HUNG_ROLE, Certainty::Doubtful, format!("{touches}, which carries it and keeps its shape")),
        };
        // A part of the wing that could not be cut together with it.
        let wing: Vec<usize> = self.wings[nearest].families.iter().map(|family| family.index()).collect();
        let is_free = word.is_none() && self.neighbours[family].iter().any(|other| wing.contains(other));
        if is_free && self.continued(&wing, &self.wings[nearest].sections, family).is_some() {
            let reason =
                format!("{reason}; but it has sections of a wing itself, and continues this one along the span");
            self.set(family, role, Certainty::Doubtful, reason);
            return;
        }
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
