//! The wings: families that planes across their span cut in sections.

use std::collections::BTreeSet;

use super::words::Named;
use super::{BASE, Certainty, GuessedWing, Guesser, NoWing, Sections};
use crate::families::Role;
use crate::mesh::{FamilyId, triangles_of_families};

/// So many families, the largest first, are tried as wings if no name tells which are.
const MOST_TRIED: usize = 24;

/// Two families that continue each other along the span overlap by at most this share of the
/// shorter one: their common edge need not lie in a plane.
const OVERLAP: f64 = 0.25;

impl Guesser<'_> {
    fn sections(&self, families: &[usize]) -> Option<Sections> {
        self.cut(families).ok()
    }

    fn cut(&self, families: &[usize]) -> Result<Sections, String> {
        let ids: Vec<FamilyId> = families.iter().map(|&family| FamilyId(family as u16)).collect();
        Sections::of(self.mesh.vertices(), &triangles_of_families(self.mesh, &ids), self.known.planes)
    }

    /// Finds the wings, and gives their families the role.
    ///
    /// # Errors
    /// [`NoWing`]
    pub(super) fn guess_wings(&mut self) -> Result<(), NoWing> {
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
            if self.touch_a_wing(&part) {
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
            let with: BTreeSet<usize> = around.into_iter().filter(strip).chain(part.iter().copied()).collect();
            let with: Vec<usize> = with.into_iter().collect();
            if let Some(sections) = self.sections(&with) {
                self.take_wing(with, sections, Certainty::Likely, "with its neighbours it has the sections of a wing");
            }
        }
        if self.wings.is_empty() {
            while self.find_wing_by_shape() {}
        }
        if self.wings.is_empty() {
            let open = (0..self.n_families()).filter(|&family| self.is_open(family));
            let bodies = open.map(|family| self.mesh.mesh.families[family].clone()).collect();
            return Err(NoWing::NoneFound { families: self.mesh.mesh.families.clone(), bodies });
        }
        Ok(())
    }

    /// Finds a wing without a name that touches no other wing: one family, two that touch, or all
    /// that are joined. Returns whether there is one.
    fn find_wing_by_shape(&mut self) -> bool {
        let may_be = |guesser: &Self, family: usize| {
            guesser.is_open(family) && guesser.named[family].is_none() && !guesser.touch_a_wing(&[family])
        };
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
        let Some((sections, families)) = found else { return false };
        let together = if families.len() > 1 { "together with its neighbours " } else { "" };
        self.take_wing(families, sections, Certainty::Likely, &format!("{together}it has the sections of a wing"));
        true
    }

    /// The sections of a wing with a family that continues it along the span: that has sections
    /// of its own, across the same axis, and hardly overlaps the wing.
    pub(super) fn continued(&self, wing: &[usize], sections: &Sections, family: usize) -> Option<Sections> {
        let [low, high] = self.along(family, sections.normal);
        let [from, to] = sections.span;
        let overlap = high.min(to) - low.max(from);
        if overlap > OVERLAP * (high - low).min(to - from) {
            return None;
        }
        let own = self.sections(&[family])?;
        if own.normal.dot(sections.normal).abs() < 0.5 {
            return None;
        }
        self.sections(&wing.iter().copied().chain([family]).collect::<Vec<_>>())
    }

    /// Makes families a wing, with strips beside them that belong to its section, and families that
    /// continue it along the span.
    fn take_wing(&mut self, mut families: Vec<usize>, mut sections: Sections, certainty: Certainty, why: &str) {
        let named = self.known.wing.iter().any(|family| families.contains(&family.index()));
        let mut longer = Vec::new();
        // A wing may be divided more than once.
        loop {
            let around: BTreeSet<usize> = families.iter().flat_map(|&family| self.neighbours[family].clone()).collect();
            let free = |family: &usize| {
                !named && self.is_open(*family) && !families.contains(family) && self.named[*family].is_none()
            };
            let next = around
                .into_iter()
                .filter(free)
                .find_map(|family| Some((self.continued(&families, &sections, family)?, family)));
            let Some((with, family)) = next else { break };
            sections = with;
            families.push(family);
            longer.push(family);
        }
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
        let mut text = sections.in_words();
        let jump = sections.jump();
        if let Some([number, chord, next]) = &jump {
            text += &format!(
                "; but the chord of section {number} is {chord}, and {next} beside it: \
                 the family may hold a fuselage too, and a family of its own for each is better"
            );
        }
        for &family in &families {
            let (certainty, why) = match own.contains(&family) {
                _ if longer.contains(&family) => (
                    Certainty::Likely,
                    "it has sections of a wing itself, and continues this one along the span".to_owned(),
                ),
                true => (certainty, why.to_owned()),
                false => (Certainty::Likely, "a strip along the span, which belongs to the wing's section".to_owned()),
            };
            let certainty = if jump.is_some() { Certainty::Doubtful } else { certainty };
            self.set(family, Role::Wing, certainty, format!("{why}; {text}"));
        }
        let families = families.into_iter().map(|family| FamilyId(family as u16)).collect();
        self.wings.push(GuessedWing { families, sections, mirror: None, continues: None });
    }

    /// Whether some families touch a wing.
    fn touch_a_wing(&self, families: &[usize]) -> bool {
        let is_wing = |other: &usize| self.wings.iter().any(|wing| wing.families.contains(&FamilyId(*other as u16)));
        families.iter().any(|&family| self.neighbours[family].iter().any(is_wing))
    }
}
