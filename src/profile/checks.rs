//! Checks of profiles before the wing moves: old profiles that do not belong to the wing, and new
//! profiles that are no changed old ones. The paper has no such checks.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::chord::{Chord, begins_at_nose};
use super::curve::Outline;
use super::cut::{Gap, Junctions, carried, flat_section_through};
use super::distance::distance;
use super::edges::TrailingEdge;
use super::kept::KeptSection;
use super::matching::OldSection;
use super::near::Near;
use super::section::{OwnForms, OwnSection};
use super::span::Span;
use super::spanwise::along_span;
use super::wing_surface::WingSurface;
use super::{Plane, Profile, ProfileError, Remark, extent};
use crate::mesh::corners::Face;
use crate::text::figures::length;

/// Largest distance between an old profile and the wing's section in its plane, as a share of the
/// section's length.
const OFF_WING: f64 = 0.01;

/// A point of an old profile that is nearer to a bridge of the wing's section than this share of
/// the section's length is in the gap, where the section is a guess.
const IN_GAP: f64 = 0.03;

/// Vertices beside a profile outside the wing are at its end if their distance from the profile's
/// plane exceeds the nearest vertex's by less than the first share of the profile's length. Their
/// distance from the straight interpolation between the profiles, which ignores kinks, must be less
/// than the second share.
const AT_END: f64 = 0.1;
const OFF_END: f64 = 0.05;

/// A vertex belongs to a cap, or to its rim, if the cosine of the angle between its normal and the
/// plane's normal is greater: an angle below 75 degrees.
const CAP: f64 = 0.26;

/// Least cosine of the angle between the planes of an old and a new section: 75 degrees.
const TURNED: f64 = 0.26;

/// Largest length of the curve round a section, over the section's extent. For a circle it is pi.
const ROUND: f64 = 3.3;

/// Largest factor between the lengths of profiles of one section. Inverse design changes the chord
/// by less, and units of length differ by more.
const SIZE: f64 = 2.5;

/// Largest extent of a wing across its span, over the length of a section, because of sweep.
const WING_SIZE: f64 = 30.0;

/// Largest way of a section, over the wing's extent.
const FAR: f64 = 2.0;

/// Two neighbouring sections are in the wrong order if one has passed the other by this share of
/// their distance.
const PASSED: f64 = 0.5;

/// Two profiles lie in one plane if no point of one is farther from the other's plane than this
/// share of a chord.
const SAME_PLANE: f64 = 1e-6;

/// Least thickness of a blunt trailing edge of an old profile, as a share of its length.
const BLUNT: f64 = 2e-3;
/// A new trailing edge is closed if it is thinner than this share of the old one.
const CLOSED: f64 = 0.05;

/// The check that comes nearest to refusing the profiles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Closeness {
    /// 0 far from a refusal, 1 at a refusal.
    pub share: f64,
    /// The check, in words.
    pub what: String,
}

impl Closeness {
    /// The nearer one of two checks to a refusal.
    pub fn max(self, other: Self) -> Self {
        if other.share > self.share { other } else { self }
    }

    fn of_size(profile: i64, times: f64, of: &str) -> Self {
        Self {
            share: times.ln().abs() / SIZE.ln(),
            what: format!("profile {profile} is {times:.2} times as long as {of} (refused beyond {SIZE})"),
        }
    }
}

impl std::fmt::Display for Closeness {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}, {:.0} % of the way to being refused, is the most suspect", self.what, 100.0 * self.share)
    }
}

/// What is needed of the wing's own section beside a given one.
pub(super) struct OwnOf {
    /// Its forms.
    pub forms: OwnForms,
    /// The gaps of the section, if the given profile is the wing's own section with its bridges.
    pub gaps: Vec<Gap>,
}

/// Compares old profiles with the wing's own sections in their planes. Returns what is needed of
/// the wing's own sections, where the wing can be cut.
///
/// # Errors
/// [`ProfileError::OffWing`], [`ProfileError::Size`], and [`ProfileError::PlaneMisses`] if all
/// planes miss the wing.
pub(super) fn against_wing(
    sections: &[KeptSection],
    span: &Span,
    surface: &WingSurface,
) -> Result<(Vec<Option<OwnOf>>, Closeness), ProfileError> {
    let WingSurface { positions, faces, junctions, .. } = *surface;
    let mut closeness = Closeness::default();
    if faces.is_empty() {
        return Ok((sections.iter().map(|_| None).collect(), closeness));
    }
    let mut own = Vec::with_capacity(sections.len());
    let mut why_not = None;
    // The outer error tells that the wing has no section there, the inner one that the two differ.
    let compared = |(section, plane): (&KeptSection, &Plane)| {
        let found = own_section(section.profile().number, plane, positions, faces, junctions)?;
        let section = section.section();
        Ok(compare(&section, &found).and_then(|near| Ok((found.beside(&section)?, near))))
    };
    let found: Vec<Result<_, ProfileError>> = sections.par_iter().zip(&span.planes).map(compared).collect();
    for found in found {
        match found {
            Ok(found) => {
                let (forms, near) = found?;
                closeness = closeness.max(near);
                own.push(Some(forms));
            }
            Err(error) => {
                why_not = why_not.or(Some(error));
                own.push(None);
            }
        }
    }
    if own.iter().all(Option::is_none) {
        let across: Vec<DVec3> = positions.iter().map(|p| p.reject_from_normalized(span.normal)).collect();
        for section in sections {
            let times = section.length() / extent(&across).max(f64::MIN_POSITIVE);
            if !(WING_SIZE.recip()..=SIZE).contains(&times) {
                return Err(ProfileError::Size { profile: section.profile().number, times, of: "the wing" });
            }
        }
        if let Some(error @ ProfileError::PlaneMisses { .. }) = why_not {
            return Err(error);
        }
    }
    Ok((own, closeness))
}

/// Refuses an old profile whose plane misses the wing, if no straight interpolation to the next
/// profile reaches the wing's end.
///
/// - `compared`: whether a section was compared with the wing's own
/// - `off` `[n_positions]`: distance of the wing's vertices from the interpolated section
///
/// # Errors
/// [`ProfileError::OffWing`]
pub(super) fn beside_wing(
    sections: &[KeptSection],
    compared: &[bool],
    span: &Span,
    surface: &WingSurface,
    off: &[f64],
) -> Result<(), ProfileError> {
    let alone = sections.iter().zip(&span.planes).zip(compared).filter(|(_, compared)| !**compared);
    for ((section, plane), _) in alone {
        let heights: Vec<f64> = surface.positions.iter().map(|&position| plane.distance(position)).collect();
        let (low, high) = heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
        if surface.faces.is_empty() || low < 0.0 && high > 0.0 {
            continue;
        }
        let nearest = low.abs().min(high.abs());
        // A cap that closes the wing lies inside the section.
        let is_cap = surface.normals.iter().map(|outward| outward.dot(plane.normal).abs() > CAP);
        let at_end = heights.iter().map(|height| height.abs() <= nearest + AT_END * section.length());
        let at_end = at_end.zip(is_cap).map(|(at_end, is_cap)| at_end && !is_cap);
        let distance = at_end.zip(off).filter(|(at_end, _)| *at_end).map(|(_, &off)| off).fold(0.0, f64::max);
        if distance > OFF_END * section.length() {
            let (profile, share) = (section.profile().number, distance / section.length());
            return Err(ProfileError::OffWing { profile, distance, share });
        }
    }
    Ok(())
}

/// The wing's own section in a plane.
struct Own {
    section: OwnSection,
    gaps: Vec<Gap>,
    /// The points of each bridge.
    bridges: Vec<Vec<DVec3>>,
}

impl Own {
    /// Keeps what may be needed beside a given section.
    ///
    /// # Errors
    /// A form has no chord along the given section's.
    fn beside(self, given: &OldSection) -> Result<OwnOf, ProfileError> {
        let forms = self.section.beside(given)?;
        let gaps = if forms.is_given() { self.gaps } else { Vec::new() };
        Ok(OwnOf { forms, gaps })
    }
}

fn own_section(
    number: i64,
    plane: &Plane,
    positions: &[DVec3],
    faces: &[Face],
    junctions: Option<&Junctions>,
) -> Result<Own, ProfileError> {
    let flat = flat_section_through(positions, faces, plane, junctions)?;
    let carried = carried(positions, faces, plane, &flat);
    let points = flat.points();
    let bridges = flat.bridge_runs().into_iter().map(|(run, _)| points[run].to_vec()).collect();
    let section = OwnSection::new(number, flat.points(), carried, plane)?;
    Ok(Own { section, gaps: flat.gaps(), bridges })
}

fn compare(section: &OldSection, own: &Own) -> Result<Closeness, ProfileError> {
    let Own { section: own, bridges, .. } = own;
    let profile = section.profile().number;
    let length = own.carried.length();
    let times = section.length() / length;
    if !(SIZE.recip()..=SIZE).contains(&times) {
        return Err(ProfileError::Size { profile, times, of: "the wing's section there" });
    }
    // The base of a blunt trailing edge may belong to one of the two only.
    // A profile of few points may stand for a smooth curve or for straight lines.
    let off = |point: DVec3, from: &Near| from.curve(point).min(from.closed_lines(point));
    let (carried, flat, near) = (Near::new(&own.carried), Near::new(&own.flat), Near::new(section));
    let is_known = |point: &&DVec3| bridges.iter().all(|bridge| distance(**point, bridge) > IN_GAP * length);
    let given = section.profile().points.iter().filter(is_known);
    let given = given.map(|&point| off(point, &carried).min(off(point, &flat)));
    let wing = own.carried.profile().points.iter().filter(is_known).map(|&point| off(point, &near));
    let furthest = given.chain(wing).fold(0.0, f64::max);
    if furthest > OFF_WING * length {
        return Err(ProfileError::OffWing { profile, distance: furthest, share: furthest / length });
    }
    let share = furthest / (OFF_WING * length);
    let off = 100.0 * furthest / length;
    let what = format!(
        "the old profile {profile} is {off:.2} % of its length off the wing (refused beyond {} %)",
        100.0 * OFF_WING
    );
    Ok(Closeness { share, what }.max(Closeness::of_size(profile, times, "the wing's section there")))
}

/// Compares the lengths of old and new profiles with the same number. So a wrong unit of length is
/// found before other faults.
///
/// # Errors
/// [`ProfileError::Size`] for the first new profile that is much larger or smaller than its old
/// one.
pub fn compare_sizes(old: &[Profile], new: &[Profile]) -> Result<(), ProfileError> {
    // Of two profiles with one number the first counts.
    let by_number: HashMap<i64, &Profile> = old.iter().rev().map(|old| (old.number, old)).collect();
    for new in new {
        let Some(old) = by_number.get(&new.number) else { continue };
        // Other checks find profiles that are no curve at all.
        if new.distinct_points().is_err() {
            continue;
        }
        of_size(new, extent(&old.points))?;
    }
    Ok(())
}

fn of_size(new: &Profile, old: f64) -> Result<(), ProfileError> {
    let times = extent(&new.points) / old;
    if (SIZE.recip()..=SIZE).contains(&times) || times.is_nan() {
        return Ok(());
    }
    Err(ProfileError::Size { profile: new.number, times, of: "the old one" })
}

/// Compares new profiles with the old ones. Returns the check that comes nearest to refusing them,
/// and what is odd about them.
///
/// - `new`: in the order of the sections
/// - `wing`: extent of the wing, in the mesh's unit
/// - `ends`: least and greatest place of the wing along the span's normal
///
/// # Errors
/// The variants of [`ProfileError`] for new profiles that are no changed old ones.
pub(super) fn against_old(
    old: &[KeptSection],
    new: &[&Profile],
    span: &Span,
    wing: f64,
    ends: [f64; 2],
) -> Result<(Closeness, Vec<Remark>), ProfileError> {
    let mut closeness = Closeness::default();
    let mut remarks = Vec::new();
    let (mut middles, mut planes, mut moves) = (Vec::new(), Vec::new(), Vec::new());
    for (section, new) in old.iter().zip(new) {
        let profile = new.number;
        let plane = Plane::of_profile(new)?;
        of_size(new, section.length())?;
        if plane.normal.dot(section.plane().normal).abs() < TURNED {
            return Err(ProfileError::Turned { profile });
        }
        let around: f64 = new.points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        if around > ROUND * extent(&new.points) {
            return Err(ProfileError::NotInOrder { profile, at: new.points[0] });
        }
        closeness = closeness.max(Closeness::of_size(profile, extent(&new.points) / section.length(), "the old one"));
        let points = new.distinct_points()?;
        let middle = points.iter().sum::<DVec3>() / points.len() as f64;
        middles.push(middle);
        let way = middle.distance(section.middle());
        let far = FAR * wing.max(section.length());
        if way > far {
            return Err(ProfileError::FarAway { profile, distance: way, wing });
        }
        let [lies, refused] = [way, far].map(|value| length(value, far));
        let what = format!("profile {profile} lies {lies} away from the old one (refused beyond {refused})");
        closeness = closeness.max(Closeness { share: way / far, what });
        planes.push(plane);
        if section.is_same(new) {
            moves.push([section.chord().middle.dot(span.normal); 2]);
            continue;
        }
        let side = section.plane().normal;
        let plane = if plane.normal.dot(side) < 0.0 { Plane { normal: -plane.normal, ..plane } } else { plane };
        let mut outline = Outline::like(new, &plane, section.chord().back())?;
        let is_like = |edge: TrailingEdge| {
            edge.is_clear && section.is_edge_clear() && (outline.gap() == 0.0) == (section.gap() == 0.0)
        };
        // The match may carry the old edge to the new profile.
        if outline.edge.is_some_and(|edge| !is_like(edge)) {
            outline = section.section().outline_of(new)?;
        }
        let chord = Chord::new(&outline, plane.normal);
        if section.chord().is_reversed(&chord) && begins_at_nose(&outline) {
            return Err(ProfileError::Swapped { profile });
        }
        if section.gap() > BLUNT * section.length() && outline.gap() < CLOSED * section.gap() {
            return Err(ProfileError::Sharp { profile, old: section.gap(), new: outline.gap() });
        }
        remarks.extend(section.chord().compare(&chord, profile, [section.gap(), outline.gap()])?);
        moves.push([section.chord().middle, chord.middle].map(|middle| middle.dot(span.normal)));
    }
    in_one_plane(new, &planes)?;
    remarks.extend(along_span(new, span, &moves, ends));
    // A section that has passed none before it lies, up to rounding, ahead of all of them in this
    // measure. Only the others are compared pair by pair.
    let place = |i: usize| middles[i].dot(span.normal) + PASSED * span.eta[i];
    let rounding = 1e-9 * (0..middles.len()).map(|i| place(i).abs()).fold(0.0, f64::max);
    let mut ahead_of_all = f64::NEG_INFINITY;
    for i in 0..middles.len() {
        if place(i) > ahead_of_all + rounding {
            ahead_of_all = place(i);
            continue;
        }
        for j in 0..i {
            let ahead = (middles[i] - middles[j]).dot(span.normal);
            if ahead < -PASSED * (span.eta[i] - span.eta[j]) {
                return Err(ProfileError::Order { first: new[j].number, second: new[i].number });
            }
        }
    }
    Ok((closeness, remarks))
}

/// Refuses two new profiles in one plane.
///
/// - `planes`: of the profiles
fn in_one_plane(new: &[&Profile], planes: &[Plane]) -> Result<(), ProfileError> {
    // Profiles in one plane are neighbours in the order of the planes' distances from the origin,
    // or at least in the order of the span.
    let mut order: Vec<usize> = (0..new.len()).collect();
    let height = |&i: &usize| planes[i].point.dot(planes[i].normal);
    order.sort_by(|a, b| height(a).total_cmp(&height(b)));
    let pairs = order.windows(2).map(|pair| [pair[0].min(pair[1]), pair[0].max(pair[1])]);
    for [one, other] in pairs.chain((1..new.len()).map(|i| [i - 1, i])) {
        let (first, second) = (new[one], new[other]);
        let off = second.points.iter().map(|&point| planes[one].distance(point).abs()).fold(0.0, f64::max);
        if off <= SAME_PLANE * extent(&first.points) {
            return Err(ProfileError::OnePlane { first: first.number, second: second.number });
        }
    }
    Ok(())
}
