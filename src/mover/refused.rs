//! [`Refused`]: the faults of a moved mesh that may not be used.
//!
//! [`Outcome::check`] finds the faults. Its message names each fault, the stage in which it began,
//! its place, and a remedy.

use std::{borrow::Cow, collections::BTreeMap, fmt};

use glam::DVec3;
use thiserror::Error;

use super::fault::{Fault, FaultKind, Place};
use super::simplex_view::SimplexView;
use super::{
    Beyond, CREASED, Crease, Deviation, Exceeded, MISSED, MISSED_SURFACE, Moved, Outcome, STRAINED, StageName,
    Strained, Warning, warnings::counts,
};
use crate::geometry::triangle_normal;
use crate::mesh::{self, CellName, HybridMesh, KindQuality, TetMesh, WorstCorner};
use crate::projection::crossing::crosses;
use crate::quality::{
    self,
    faults::{self, Cluster, is_inverted},
};
use crate::text::figures::{Shortest, place};

/// The condition that a refused result does not meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// Vertices have no finite position.
    NotFinite,
    /// The mesh is not valid; see [`Outcome::is_valid`].
    Invalid,
    /// A relaxation did not reach its tolerance.
    NotConverged,
}

/// A result that may not be used.
#[derive(Clone, PartialEq, Error)]
#[error("{message}")]
#[non_exhaustive]
pub struct Refused {
    /// The condition that the result does not meet.
    pub why: Why,
    /// The faults with their places.
    pub message: String,
    /// The faults one by one, the gravest first. There is at least one.
    pub faults: Vec<Fault>,
    /// A remedy to try.
    pub hint: Option<String>,
}

impl Refused {
    /// The message in lines, for a reader: each fault, and then what goes for all of them. One line
    /// if there is one fault.
    pub fn lines(&self) -> Vec<String> {
        let own: Vec<&str> = self.faults.iter().map(|fault| fault.message.as_str()).collect();
        // Relaxations that did not converge stand among what goes for all, where there are other
        // faults.
        let n = (0..=own.len()).rev().find(|&n| self.message.starts_with(&own[..n].join(JOINT))).unwrap_or(0);
        if n < 2 {
            return vec![self.message.clone()];
        }
        let rest = self.message[own[..n].join(JOINT).len()..].trim_start_matches("; ");
        let rest = (!rest.is_empty()).then(|| rest.to_owned());
        own[..n].iter().map(|text| (*text).to_owned()).chain(rest).collect()
    }
}

/// What stands between two faults in a message.
const JOINT: &str = ", and ";

/// As a program prints an error that it returns from `main`: the faults, and what may help.
impl fmt::Debug for Refused {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.hint {
            Some(hint) => write!(f, "{self}; hint: {hint}"),
            None => write!(f, "{self}"),
        }
    }
}

impl Outcome {
    /// Returns the moved mesh, if it is finite and valid and every relaxation converged.
    ///
    /// # Errors
    /// As [`Outcome::check`].
    pub fn valid(&self) -> Result<&Moved, Refused> {
        self.check()?;
        Ok(&self.moved)
    }

    /// Checks that the moved mesh is finite and valid ([`Outcome::is_valid`]), and that every
    /// relaxation converged.
    ///
    /// # Errors
    /// The first of these conditions that does not hold, in the order of [`Why`].
    pub fn check(&self) -> Result<(), Refused> {
        let lost = self.moved.vertices.iter().filter(|vertex| !vertex.is_finite()).count();
        if lost > 0 {
            let message = format!("not converged: {lost} vertices have no finite position");
            let fault = Fault { kind: FaultKind::NotFinite, count: lost, place: None, message: message.clone() };
            return Err(Refused { why: Why::NotFinite, message, faults: vec![fault], hint: None });
        }
        if !self.is_valid() {
            return Err(self.invalid());
        }
        if !self.found.converged {
            let fault = self.not_converged();
            let hint = Some(format!("{} in [solver]", more_sweeps(self)));
            return Err(Refused { why: Why::NotConverged, message: fault.message.clone(), faults: vec![fault], hint });
        }
        Ok(())
    }

    /// The faults of a mesh that is not valid: the stage in which they began, the place of the
    /// worst tet, and a remedy to try.
    fn invalid(&self) -> Refused {
        let view = SimplexView::new(&self.mesh, &self.others);
        let mesh = &*view.mesh;
        let beta = match view.cells.are_tets() {
            true => Cow::Borrowed(&self.beta),
            false => Cow::Owned(quality::betas(&self.moved.vertices, &mesh.tets)),
        };
        let clusters = faults::clusters(&self.moved.vertices, &mesh.tets, &beta);
        let family = |cluster: &Cluster| {
            let triangle = faults::nearest_triangle(&self.moved.vertices, &mesh.tets, &mesh.triangles, cluster)?;
            Some(mesh.families[mesh.triangle_family[triangle as usize].index()].as_str())
        };
        let moved = &self.moved.vertices;
        let mut faults: Vec<Fault> = Vec::new();
        let mut add = |kind, count, place, message| faults.push(Fault { kind, count, place, message });
        if self.inverted > 0 {
            // A cell whose corners are good and whose volume is not is in no cluster.
            let of_cell = || self.first_inverted(self.kinds.as_deref()?).map(|(_, _, at)| Place::new(at, None));
            let place = clusters.first().map(|worst| Place::new(worst.at, family(worst))).or_else(of_cell);
            let message = match &self.kinds {
                None => format!("{} of {} tets are inverted", self.inverted, self.beta.len()),
                Some(kinds) => self.inverted_cells(kinds),
            };
            add(FaultKind::Inverted, self.inverted, place, message);
        }
        if let Some(&first) = self.self_intersecting.first() {
            let mut by_family: BTreeMap<String, usize> = BTreeMap::new();
            for &face in &self.self_intersecting {
                let triangle = view.triangle_of(face);
                *by_family
                    .entry(mesh.families[mesh.triangle_family[triangle as usize].index()].clone())
                    .or_default() += 1;
            }
            let first = view.triangle_of(first);
            let message = format!(
                "the moved surface passes through itself ({}), first {}",
                counts(&by_family),
                passage(mesh, moved, first)
            );
            let place = Place::of_triangle(mesh, moved, first);
            add(FaultKind::SelfIntersecting, self.self_intersecting.len(), Some(place), message);
        }
        let deviations = [
            (FaultKind::OffSurface, &self.off_surface, "vertices left the surface they slide on"),
            (FaultKind::Parted, &self.parted, "partners in periodic planes are no longer apart by the same way"),
        ];
        for (kind, by_family, what) in deviations {
            let farther = |a: &(&String, &Deviation), b: &(&String, &Deviation)| a.1.distance.total_cmp(&b.1.distance);
            let Some((family, worst)) = by_family.iter().max_by(farther) else { continue };
            let each: Vec<_> = by_family
                .iter()
                .map(|(name, by)| {
                    let (count, at) = (by.vertices, short_place(moved[by.vertex]));
                    format!("{name} by {}, {count} vertices, the worst at {at}", Shortest(short(by.distance)))
                })
                .collect();
            let place = Place::new(moved[worst.vertex], Some(family));
            let count = by_family.values().map(|by| by.vertices).sum();
            let by = by_family.values().find_map(|by| by.prescribed).filter(|_| kind == FaultKind::OffSurface);
            let by = by.map(|by| format!("; `{}` prescribes where they are", self.mesh.families[by.index()]));
            add(kind, count, Some(place), format!("{what} ({}){}", each.join("; "), by.unwrap_or_default()));
        }
        for held in &self.held_back {
            let Some(Beyond { distance, edge, at }) = held.beyond else { continue };
            let message = format!(
                "`{}` holds vertices of `{}` back by more than their shortest edge, at {} by {} where that is {}",
                held.by,
                held.family,
                short_place(at),
                Shortest(short(distance)),
                Shortest(short(edge))
            );
            add(FaultKind::HeldBack, held.vertices, Some(Place::new(at, Some(&held.by))), message);
        }
        for (family, Strained { by, at, distance, edge }) in &self.strained {
            let message = format!(
                "the rigid family `{family}` is torn from `{by}`, at {} by {} where its shortest edge is {}, allowed is \
                 {STRAINED} of it: a family with the role attached between the two can give way",
                short_place(*at),
                Shortest(short(*distance)),
                Shortest(short(*edge))
            );
            add(FaultKind::Strained, 1, Some(Place::new(*at, Some(family))), message);
        }
        for (family, Crease { edges, degrees, at }) in &self.creased {
            let message = format!(
                "the rigid family `{family}` is creased beside the junction that slides on it: {edges} edges turn by up to \
                 {degrees:.0} degrees, the worst at {}, allowed are {CREASED}",
                short_place(*at)
            );
            add(FaultKind::Creased, *edges, Some(Place::new(*at, Some(family))), message);
        }
        for (wing, missed) in &self.missed_surfaces {
            let at = moved[missed.vertex as usize];
            let message = format!(
                "the junction of `{wing}` misses the surface beside it: the line along the span of {} vertices does not lead \
                 there, and the nearest point of the surface, at {}, is {:.2} % of the chord off the asked section, allowed is \
                 {} %",
                missed.vertices,
                short_place(at),
                100.0 * missed.of_chord,
                100.0 * MISSED_SURFACE
            );
            add(FaultKind::MissedSurface, missed.vertices, Some(Place::new(at, Some(wing))), message);
        }
        for (wing, missed) in &self.missed {
            let at = moved[missed.vertex];
            let message = format!(
                "the wing of `{wing}` misses its new profile {} by {:.2} % of the chord at {}, allowed is {} %",
                missed.profile,
                100.0 * missed.share,
                short_place(at),
                100.0 * MISSED
            );
            add(FaultKind::MissedProfiles, 1, Some(Place::new(at, Some(wing))), message);
        }
        let given = HybridMesh { mesh: &self.mesh, others: &self.others };
        let original = if self.exceeded.is_empty() { Vec::new() } else { self.originally_exceeded() };
        for exceeded in &self.exceeded {
            let mut message = exceeded.text(given, moved);
            let place = exceeded.worst(given, moved).map(|(_, at)| {
                let family = nearest_family(given, moved, at);
                message += &family.map_or(String::new(), |family| format!(" near `{family}`"));
                Place::new(at, family)
            });
            if let Some(before) = original.iter().find(|before| before.row.name == exceeded.row.name) {
                message += &format!("; that of the original mesh is {}", Shortest(short(before.value)));
            }
            faults.push(Fault { kind: FaultKind::BeyondLimit, count: exceeded.count, place, message });
        }
        let texts: Vec<_> = faults.iter().map(|fault| fault.message.as_str()).collect();
        let mut message = texts.join(JOINT);
        if let Some(worst) = clusters.first() {
            let near = family(worst).map(|family| format!(" near `{family}`")).unwrap_or_default();
            message += &format!("; {}, the worst tet at {}{near}", places(clusters.len()), short_place(worst.at));
        }
        if self.inverted > 0 {
            message += &format!("; inverted by stage: {}", stages(self));
        }
        if let Some((stage, count)) = self.folds.first() {
            message += &format!("; triangles folded first by stage {stage}: {count}");
        }
        if self.path.reached > 0.0 && self.path.reached < 1.0 {
            message += &format!("; valid meshes lead up to {:.0} % of the motion", 100.0 * self.path.reached);
        }
        if !self.converged {
            let fault = self.not_converged();
            message += &format!("; {}", fault.message);
            faults.push(fault);
        }
        Refused { why: Why::Invalid, message, faults, hint: Some(hint(self)) }
    }

    /// The limits that the original mesh does not keep.
    fn originally_exceeded(&self) -> Vec<Exceeded> {
        self.meter.limits.exceeded(self.original_solver_measures())
    }

    /// The inverted cells of each kind, and the first of them with its corner and its place.
    fn inverted_cells(&self, kinds: &[KindQuality]) -> String {
        let n_cells: usize = kinds.iter().map(|kind| kind.count).sum();
        let bad = kinds.iter().filter(|kind| kind.inverted > 0);
        let each: Vec<String> =
            bad.map(|kind| format!("{} of {} {}", kind.inverted, kind.count, kind.kind.plural())).collect();
        let first = self.first_inverted(kinds).map_or(String::new(), |(name, worst, at)| {
            let at = short_place(at);
            let volume = worst.volume;
            match worst.corner {
                Some(corner) => {
                    format!(
                        "; the first is {name}, whose corner at vertex {corner} has the volume {volume:.3e}, at {at}"
                    )
                }
                None => format!("; the first is {name}, whose volume as a whole is {volume:.3e}, at {at}"),
            }
        });
        format!("{} of {n_cells} cells are inverted ({}){first}", self.inverted, each.join(", "))
    }

    /// The first inverted cell, its worst corner, and the place of the corner or of the cell's
    /// middle.
    fn first_inverted(&self, kinds: &[KindQuality]) -> Option<(CellName, WorstCorner, DVec3)> {
        let mesh = HybridMesh { mesh: &self.mesh, others: &self.others };
        let moved = &self.moved.vertices;
        let bad = kinds.iter().find(|kind| kind.inverted > 0)?;
        let names = (0..bad.count).map(|index| CellName { kind: bad.kind, index });
        let worst = |name: CellName| (name, mesh::worst_corner(mesh.cell(name), moved));
        let (name, worst) = names.map(worst).find(|(_, worst)| is_inverted(worst.volume))?;
        let at = match worst.corner {
            Some(corner) => moved[corner as usize],
            None => mesh::middle_of_cell(mesh.cell(name), moved),
        };
        Some((name, worst, at))
    }

    /// The stages that did not converge, with the error that each left.
    fn not_converged(&self) -> Fault {
        let stages = self.unconverged.iter();
        // One sweep alone gives no measure.
        let left = |error: f64| match error.is_finite() {
            true => format!("about {error:.1e} of an edge left"),
            false => "too few sweeps to tell how much is left".to_owned(),
        };
        let stages: Vec<_> = stages.map(|(stage, error)| format!("{stage} ({})", left(*error))).collect();
        let message = format!("not converged: {}", stages.join(", "));
        Fault { kind: FaultKind::NotConverged, count: stages.len(), place: None, message }
    }
}

/// The family with the vertex nearest to a place.
fn nearest_family<'a>(mesh: HybridMesh<'a>, vertices: &[DVec3], at: DVec3) -> Option<&'a str> {
    let distance = |face: u32| {
        let of_vertices = mesh.face_vertices(face).iter().map(|&vertex| vertices[vertex as usize].distance_squared(at));
        of_vertices.fold(f64::INFINITY, f64::min)
    };
    let nearest = (0..mesh.n_faces() as u32).min_by(|&a, &b| distance(a).total_cmp(&distance(b)))?;
    Some(&mesh.mesh.families[mesh.family_of(nearest)?.index()])
}

/// Describes a self-intersection: the triangle `first`, the first triangle that crosses it, and the
/// distance and angle between the two before the motion.
fn passage(mesh: &TetMesh, moved: &[DVec3], first: u32) -> String {
    let of =
        |vertices: &[DVec3], triangle: u32| mesh.triangles[triangle as usize].map(|vertex| vertices[vertex as usize]);
    let middle = |[a, b, c]: [DVec3; 3]| (a + b + c) / 3.0;
    let place = |triangle: u32| {
        let family = &mesh.families[mesh.triangle_family[triangle as usize].index()];
        format!("`{family}` at {}", short_place(middle(of(moved, triangle))))
    };
    let crossing = |other: &u32| crosses(moved, mesh.triangles[first as usize], mesh.triangles[*other as usize]);
    let Some(other) = (0..mesh.triangles.len() as u32).find(crossing) else { return place(first) };
    let [one, two] = [first, other].map(|triangle| of(&mesh.vertices, triangle));
    // Planes at a small angle mean a thin surface, whether the normals point the same way or
    // opposite ways.
    let angle = triangle_normal(one).angle_between(triangle_normal(two)).to_degrees();
    format!(
        "{} with {}, which were {} apart before, their planes at {:.0} degrees",
        place(first),
        place(other),
        Shortest(short(middle(one).distance(middle(two)))),
        angle.min(180.0 - angle)
    )
}

fn places(n: usize) -> String {
    if n == 1 { "in one place".to_owned() } else { format!("in {n} places") }
}

/// `deformed 20, corrected 24, final 3`: the inverted tets at each stage after the first.
fn stages(outcome: &Outcome) -> String {
    let name = |name| match name {
        StageName::Original => "original",
        StageName::Deformed => "deformed",
        StageName::Corrected => "corrected",
        StageName::Final => "final",
    };
    let moved = outcome.stages.iter().filter(|stage| stage.name != StageName::Original);
    moved.map(|stage| format!("{} {}", name(stage.name), stage.inverted)).collect::<Vec<_>>().join(", ")
}

/// A remedy, and the profile that may be the cause.
fn hint(outcome: &Outcome) -> String {
    remedy(outcome) + &suspect(outcome).map_or(String::new(), |suspect| format!("; {suspect}"))
}

/// A check of profiles that is nearer to a refusal than this share is worth a word.
const SUSPECT: f64 = 0.5;

/// The profile that is odd or nearly refused, in words.
fn suspect(outcome: &Outcome) -> Option<String> {
    let odd = outcome.warnings.iter().find_map(|warning| match warning {
        Warning::OddProfile { wing, remark, .. } if remark.is_suspect() => {
            Some(format!("the most suspect of the profiles of `{wing}`: {remark}"))
        }
        _ => None,
    });
    let near = outcome.nearest_to_refusal.as_ref().filter(|(_, closeness)| closeness.share >= SUSPECT);
    odd.or_else(|| near.map(|(wing, closeness)| format!("of the profiles of `{wing}` {closeness}")))
}

fn remedy(outcome: &Outcome) -> String {
    if outcome.held_back.iter().any(|held| held.beyond.is_some()) {
        return "give what holds them a role that lets them move, such as carenage or plane, or profiles that leave them \
                where they are"
            .to_owned();
    }
    if !outcome.converged {
        return format!("the relaxation did not converge either: {} in [solver] first", more_sweeps(outcome));
    }
    if !outcome.self_intersecting.is_empty() {
        return format!("no volume fits a surface that passes through itself: {} first", correct(outcome));
    }
    if !outcome.creased.is_empty() {
        return "a smaller motion of the body against its wing; junction = \"glued\" in its table leaves its surface as it is"
            .to_owned();
    }
    if let Some((family, Strained { by, .. })) = outcome.strained.first_key_value() {
        return format!(
            "give `{family}` the motion of `{by}`, or put a family with the role attached between the two; one that slides \
             leaves both as they are"
        );
    }
    if !outcome.parted.is_empty() {
        return "partners that a design prescribes must move alike: correct their displacements first".to_owned();
    }
    if !outcome.folded.is_empty() {
        return format!(
            "the moved surface itself is folded ({}), and no volume fits it: {} first",
            counts(&outcome.folded),
            correct(outcome)
        );
    }
    if outcome.off_surface.values().any(|by| by.prescribed.is_some()) {
        return "the junction of a prescribed family is not slid back onto the surface, as that of a wing with profiles is: give \
                its vertices displacements that lead along the surface"
            .to_owned();
    }
    if outcome.inverted > 0 && !outcome.optimises {
        return "target = \"original\" in [quality] repairs tets; a smaller change of the surface keeps more of them valid"
            .to_owned();
    }
    if outcome.families.values().any(|family| family.max_slide.is_some_and(|slide| slide > 0.0)) {
        return "junction = \"glued\" in the tables of the parts whose junctions slide asks less of the surface beside them; or a \
                smaller change of the chord, or of the place of a body"
            .to_owned();
    }
    if outcome.inverted == 0 && !outcome.missed.is_empty() {
        return "a family that holds the wing back, or a change too uneven along the span for these profiles: give more of \
                them there"
            .to_owned();
    }
    if outcome.inverted == 0 && !outcome.exceeded.is_empty() {
        return match outcome.originally_exceeded().is_empty() {
            true => "a smaller change of the surface, target = \"improve\" in [quality], or other limits there",
            false => "no motion mends what the original mesh has itself: give limits in [quality] that it keeps",
        }
        .to_owned();
    }
    "a smaller change of the surface, or the same in another place, keeps more tets valid".to_owned()
}

/// What a user may correct of a surface.
fn correct(outcome: &Outcome) -> &'static str {
    match outcome.families.values().any(|family| family.turn_degrees.is_some()) {
        true => "correct its profiles, its displacements or the motions of its bodies",
        false => "correct its profiles or displacements",
    }
}

/// What may help a relaxation that did not converge.
fn more_sweeps(outcome: &Outcome) -> String {
    let other =
        outcome.failed.map_or(String::new(), |failed| format!("try method = \"{}\", or ", failed.other().name()));
    format!("{other}raise max_sweeps or tolerance")
}

fn short_place(at: DVec3) -> String {
    place(at.map(short))
}

/// A coordinate with six significant digits, without trailing zeros.
fn short(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_short() {
        assert_eq!(short(1.0 / 3.0).to_string(), "0.333333");
        assert_eq!(short(1.5).to_string(), "1.5");
    }
}
