//! Matches an old and a new profile by a common parameter.
//!
//! Both curves are measured from the trailing edge over the leading edge (see `curve`). An affine
//! map changes this measure: a thicker section has relatively longer curves. So the best affine map
//! of the old section onto the new one is fitted first, and the mapped section is measured. Fit and
//! match are iterated a few times. An affine change with another sampling is then matched to 1e-3
//! of the chord along the curve.
//!
//! New profiles with the old number of points may be meant point by point. The match point by point
//! is taken if it is nearer to an affine map than the measured one.
//!
//! [`ProfileMatch`] makes the choice for all designs of a loop.
//!
//! The paper (3.1, step 1) resamples the old profile to the points of the new one.

mod by_points;
mod carried_edge;
mod match_change;
mod measured_change;
mod plane_affine;
mod tape;

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

pub use by_points::{PROFILE_MATCHES, ProfileMatch};
use carried_edge::CarriedEdge;
pub(super) use match_change::MatchChange;
pub(super) use plane_affine::PlaneAffine;

use super::curve::{Measured, Outline, ProfileCurve, bracket};
use super::edges::farthest;
use super::path_boxes::PathBoxes;
use super::{Plane, Profile, ProfileError, extent};

/// Iterations of fit and match. The first has most of the effect. For a blunt section 40 % thicker,
/// 5 iterations leave 1e-3 of the chord along the curve, and 20 leave 6e-4.
const TURNS: usize = 6;

/// New points with the old number of points are matched point by point, unless an affine map
/// explains the displacement worse than with the measured match, by more than this factor in what
/// is left.
const POINT_BY_POINT: f64 = 2.0;

/// Iterations of the fit across the curve. The third changes nothing any more.
const STRAIGHT_TURNS: usize = 3;
/// The nearest point of the new curve is searched within this parameter distance from the measured
/// match.
const NEAR: f64 = 0.05;
/// Root-mean-square distance between the affinely mapped knots and the new curve, as a share of the
/// section's length, for which knots move a quarter of the way to their nearest points. A larger
/// change is no affine one, and keeps the measured match.
const STRAIGHT: f64 = 0.001;
/// A smaller share of the way counts as zero. Far from the curve, rounding could decide which point
/// is nearest.
const NOTHING: f64 = 0.05;
/// Nearest points are not taken if knots come closer together than this share of their distance in
/// the measured match.
const CROWDED: f64 = 0.5;

/// Profiles that agree to this share of their largest coordinate are the same. Files hold 12
/// digits.
const IDENTICAL: f64 = 1e-11;

/// A new profile lies on an affine image of the old one if an affine map leaves no more than this
/// share of the section's length of a match by measure. Nearer than this the choices of the match
/// change from design to design.
const AFFINE: f64 = 1e-6;

/// Why a match by measure with such a profile has a kink.
const ON_AFFINE_IMAGE: &str = "lies on an affine image of the old one, where a match by measure has a kink";

/// One old profile, prepared for matches with any number of new ones.
#[derive(Clone, Debug)]
pub(super) struct OldSection {
    profile: Profile,
    plane: Plane,
    /// The given direction to the trailing edge.
    towards: Option<DVec3>,
    /// How new profiles are matched; `None` if each design decides.
    by: Option<ProfileMatch>,
    /// Extent of the profile, which loops over points ask for.
    length: f64,
    outline: Outline,
    sides: ProfileCurve,
    base: Option<ProfileCurve>,
    /// The two sides with parameter and arc length.
    pub measured: Measured,
    /// The base of a blunt trailing edge, if it is part of the curve.
    pub measured_base: Option<Measured>,
    affine: PlaneAffine,
}

impl OldSection {
    pub fn new(profile: &Profile, plane: &Plane) -> Result<Self, ProfileError> {
        Self::towards(profile, plane, None)
    }

    /// The section with its trailing edge in a direction.
    ///
    /// - `towards`: from the leading edge to the trailing edge; `None` if the shape tells
    pub fn towards(profile: &Profile, plane: &Plane, towards: Option<DVec3>) -> Result<Self, ProfileError> {
        let outline = Outline::towards(profile, plane, towards)?;
        let sides = ProfileCurve::new(&outline.sides);
        let base = (outline.base.len() >= 2).then(|| ProfileCurve::new(&outline.base));
        let measured = Measured::sides(sides.path.clone());
        let measured_base = base.as_ref().map(|base| Measured::base(base.path.clone()));
        let knots: Vec<DVec3> = sides.knots.iter().map(|&i| outline.sides[i]).collect();
        let arcs: Vec<f64> = sides.knot_step.iter().map(|&i| measured.s[i]).collect();
        let affine = PlaneAffine::new(plane, &knots, &arcs);
        let length = extent(&profile.points);
        let (profile, plane) = (profile.clone(), *plane);
        let by = None;
        Ok(Self { profile, plane, towards, by, length, outline, sides, base, measured, measured_base, affine })
    }

    /// The section with the choice of how new profiles are matched.
    pub fn matched_by(self, by: Option<ProfileMatch>) -> Self {
        Self { by, ..self }
    }

    /// Positions of the knots: first of the sides, then of the base.
    pub fn knots(&self) -> Vec<DVec3> {
        let side = self.sides.knots.iter().map(|&i| self.outline.sides[i]);
        let base = self.base.iter().flat_map(|base| base.knots.iter().map(|&i| self.outline.base[i]));
        side.chain(base).collect()
    }

    /// Arc length at the knots of the sides.
    pub fn side_arcs(&self) -> Vec<f64> {
        self.sides.knot_step.iter().map(|&i| self.measured.s[i]).collect()
    }

    /// Arc length at the knots of the base, if there is one.
    pub fn base_arcs(&self) -> Option<Vec<f64>> {
        let (base, measured) = (self.base.as_ref()?, self.measured_base.as_ref()?);
        Some(base.knot_step.iter().map(|&i| measured.s[i]).collect())
    }

    /// Common parameter of the knots, in their order.
    pub fn knot_parameters(&self) -> Vec<f64> {
        let sides = self.sides.knot_step.iter().map(|&i| self.measured.tau[i]);
        let base = self.base.iter().zip(&self.measured_base);
        sides.chain(base.flat_map(|(base, measured)| base.knot_step.iter().map(|&i| measured.tau[i]))).collect()
    }

    /// Whether a profile has the section's points, in the same or the opposite order.
    pub fn is_same(&self, new: &Profile) -> bool {
        identical(&self.profile.points, &new.points)
    }

    /// The displacement from the section to the new profile. Exactly zero if both are the same.
    ///
    /// # Errors
    /// The new profile is no plane curve, or cannot be matched point by point as it must be.
    pub fn displacements(&self, new: &Profile) -> Result<KnotDisplacements, ProfileError> {
        let old = self.knots();
        if self.is_same(new) {
            // The match that was asked for may not be possible, or have no derivative.
            let asked = self.by.map(|by| self.matched(new).map(|matched| (by, self.why_not(&matched)))).transpose()?;
            let (by, why_not) = asked.unwrap_or((ProfileMatch::Points, None));
            return Ok(KnotDisplacements { knots: vec![DVec3::ZERO; old.len()], by, why_not, kink: None });
        }
        let matched = self.matched(new)?;
        let by = if matched.by_index { ProfileMatch::Points } else { ProfileMatch::Measure };
        let why_not = self.why_not(&matched);
        let is_affine = matched.residual <= AFFINE * self.length();
        let kink = (!matched.by_index && is_affine).then_some(ON_AFFINE_IMAGE);
        let steps = self.sides.knot_step.iter().map(|&step| matched.tau[step]);
        let mut targets: Vec<DVec3> = match matched.by_index() {
            Some(outline) => self.sides.knots.iter().map(|&i| outline.sides[i]).collect(),
            None => steps.map(|tau| matched.new.point(tau)).collect(),
        };
        if self.outline.joined {
            // One vertex of a sharp edge cannot go to both corners of a blunt one.
            let last = targets.len() - 1;
            let middle = (targets[0] + targets[last]) / 2.0;
            (targets[0], targets[last]) = (middle, middle);
        }
        if let (Some(base), Some(measured)) = (&self.base, &self.measured_base) {
            match matched.by_index() {
                Some(outline) => targets.extend(base.knots.iter().map(|&i| outline.base[i])),
                None => targets.extend(base.knot_step.iter().map(|&i| matched.new_base.point(measured.tau[i]))),
            }
        }
        let knots = targets.into_iter().zip(old).map(|(new, old)| new - old).collect();
        Ok(KnotDisplacements { knots, by, why_not, kink })
    }

    /// The fit of affine maps of the section's plane to displacements of the knots of its sides.
    pub fn affine(&self) -> &PlaneAffine {
        &self.affine
    }

    /// The affine map of the section's plane that fits displacements of its knots best, as the
    /// displacement of a point.
    pub fn affine_change(&self, displacement: &[DVec3]) -> impl Fn(DVec3) -> DVec3 {
        let displacement = &displacement[..self.sides.knots.len()];
        let (mut map, _) = self.affine.fit(displacement);
        // A second fit of what is left removes the rounding of the first.
        let left: Vec<DVec3> =
            self.affine.knots.iter().zip(displacement).map(|(&p, &d)| d - self.affine.evaluate(&map, p)).collect();
        for (coefficient, more) in map.iter_mut().zip(self.affine.fit(&left).0) {
            *coefficient += more;
        }
        move |point| self.affine.evaluate(&map, point)
    }

    /// Alternation of the knots' displacements across the curve, as a share of the section's
    /// length: the root mean square of the distance from the straight line between the two
    /// neighbours' displacements. The affine part is removed first.
    pub fn roughness(&self, displacement: &[DVec3]) -> f64 {
        let affine = self.affine_change(displacement);
        let knots = &self.affine.knots;
        let left: Vec<DVec3> = knots.iter().zip(displacement).map(|(&p, &d)| d - affine(p)).collect();
        let arcs = self.side_arcs();
        let off = (1..knots.len().saturating_sub(1)).map(|j| {
            let share = (arcs[j] - arcs[j - 1]) / (arcs[j + 1] - arcs[j - 1]).max(f64::MIN_POSITIVE);
            let off = left[j] - left[j - 1].lerp(left[j + 1], share);
            off.reject_from_normalized((knots[j + 1] - knots[j - 1]).normalize_or(self.plane.normal)).length_squared()
        });
        (off.sum::<f64>() / knots.len() as f64).sqrt() / self.length()
    }

    /// The profile as given.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The plane of the section.
    pub fn plane(&self) -> &Plane {
        &self.plane
    }

    /// The profile as given, its plane, and the given direction to the trailing edge.
    pub fn into_profile(self) -> (Profile, Plane, Option<DVec3>) {
        (self.profile, self.plane, self.towards)
    }

    /// From the leading edge to the middle of the trailing edge.
    pub fn back(&self) -> DVec3 {
        let sides = &self.outline.sides;
        let trailing = (sides[0] + sides[sides.len() - 1]) / 2.0;
        trailing - sides[farthest(sides, trailing)]
    }

    /// The section with its chord along the one of another section.
    ///
    /// # Errors
    /// The trailing edge is at no end in this direction.
    pub fn along(self, other: &Self) -> Result<Self, ProfileError> {
        match self.outline.edge {
            Some(_) if self.back().dot(other.back()) < 0.0 => {
                Self::towards(&self.profile, &self.plane, Some(other.back()))
            }
            _ => Ok(self),
        }
    }

    /// Extent of the section, in the mesh's unit: about its chord.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Centre of the section: the mean of its curve.
    pub fn middle(&self) -> DVec3 {
        self.affine.centre
    }

    /// Distance between the ends of the two sides: the thickness of a blunt trailing edge.
    pub fn gap(&self) -> f64 {
        self.outline.gap()
    }

    /// The section with displaced knots, in the order of [`Self::knots`].
    pub fn displaced(&self, displacement: &[DVec3]) -> Profile {
        let mut points: Vec<DVec3> = self.knots().iter().zip(displacement).map(|(&p, &d)| p + d).collect();
        if self.base.is_some() {
            // The base begins at the end of the sides and ends at their start.
            points.remove(self.sides.knots.len());
        }
        if self.outline.joined {
            let first = points[0];
            points.pop();
            points.push(first);
        }
        Profile { number: self.profile.number, points }
    }

    /// Points of the two sides, in small steps.
    pub fn path(&self) -> &[DVec3] {
        &self.measured.path
    }

    /// Points of the base, in small steps, if the base is part of the curve.
    pub fn base_path(&self) -> Option<&[DVec3]> {
        self.base.as_ref().map(|base| base.path.as_slice())
    }

    /// The points as given, divided at the trailing edge.
    pub fn outline(&self) -> &Outline {
        &self.outline
    }

    fn matched(&self, new: &Profile) -> Result<Match, ProfileError> {
        let mut plane = Plane::of_profile(new)?;
        if plane.normal.dot(self.plane.normal) < 0.0 {
            plane.normal = -plane.normal;
        }
        if self.by == Some(ProfileMatch::Points) {
            return Ok(Match { by_index: true, ..self.matched_to(self.outline_by_points(new, &plane)?, &plane) });
        }
        let own = self.matched_to(Outline::like(new, &plane, self.back())?, &plane);
        let carried = CarriedEdge { old: self, new, plane: &plane, own: &own };
        match carried.outline()? {
            Some(outline) => {
                let has_own_points = outline.n_points() == own.outline.n_points();
                Ok(Match { has_own_points, ..self.matched_to(outline, &plane) })
            }
            None => Ok(own),
        }
    }

    /// The new profile, divided at the trailing edge that the match takes.
    ///
    /// # Errors
    /// The new profile is no plane curve.
    pub fn outline_of(&self, new: &Profile) -> Result<Outline, ProfileError> {
        Ok(self.matched(new)?.outline)
    }

    /// The match with a new profile that is divided at its trailing edge.
    fn matched_to(&self, outline: Outline, plane: &Plane) -> Match {
        let measured = Measured::sides(ProfileCurve::new(&outline.sides).path);
        let ends = [outline.sides[outline.sides.len() - 1], outline.sides[0]];
        let base = if outline.base.len() >= 2 { ProfileCurve::new(&outline.base).path } else { ends.to_vec() };

        let old: Vec<DVec3> = self.sides.knots.iter().map(|&i| self.outline.sides[i]).collect();
        let mut tau = self.measured.tau.clone();
        let mut best = (f64::INFINITY, tau.clone());
        for _ in 0..TURNS {
            let target = |(&step, &old): (&usize, &DVec3)| measured.point(tau[step]) - old;
            let moved: Vec<DVec3> = self.sides.knot_step.iter().zip(&old).map(target).collect();
            let (map, residual) = self.affine.fit(&moved);
            if residual < best.0 {
                best = (residual, tau);
            }
            let mapped = self.sides.path.iter().map(|&p| p + self.affine.evaluate(&map, p)).collect();
            tau = Measured::sides(mapped).tau;
        }
        let best = self.settled(best, &measured, plane);
        let same_counts = outline.sides.len() == self.outline.sides.len()
            && outline.base.len() == self.outline.base.len()
            && outline.joined == self.outline.joined;
        let by_index = same_counts && self.is_by_index(&outline, best.0);
        let (residual, tau) = best;
        let new_base = Measured::base(base);
        Match { tau, residual, new: measured, new_base, outline, plane: *plane, by_index, has_own_points: true }
    }

    /// Whether new points are meant point by point: an affine map explains this match about as well
    /// as the measured one.
    ///
    /// - `outline`: the new points, as many as the old ones
    /// - `residual`: of the measured match
    fn is_by_index(&self, outline: &Outline, residual: f64) -> bool {
        if self.by == Some(ProfileMatch::Measure) {
            return false;
        }
        let moved: Vec<DVec3> = self.sides.knots.iter().map(|&i| outline.sides[i] - self.outline.sides[i]).collect();
        self.affine.fit(&moved).1 <= f64::max(POINT_BY_POINT * residual, IDENTICAL * self.length())
    }
}

impl OldSection {
    /// Corrects a measured match where the new curve is nearly an affine map of the old one: the
    /// knots then go straight across the curve.
    ///
    /// Lengths along two samplings of one curve differ by 1e-3, so a measured match is off by as
    /// much along the curve. Here an affine map brings the knots onto the new curve, at any place
    /// along it. If all knots come close to the curve, each takes its nearest point. Fit and
    /// nearest points are iterated.
    fn settled(&self, matched: (f64, Vec<f64>), new: &Measured, plane: &Plane) -> (f64, Vec<f64>) {
        let knots = &self.affine.knots;
        let steps = &self.sides.knot_step;
        let start: Vec<f64> = steps.iter().map(|&step| matched.1[step]).collect();
        let mut tau = start.clone();
        let mut nearest: Vec<(DVec3, DVec3)> = start.iter().map(|&tau| new.point_and_tangent(tau)).collect();
        let boxes = PathBoxes::new(&new.path);
        let mut off = 0.0;
        for _ in 0..STRAIGHT_TURNS {
            let Some(map) = self.affine.fit_across(plane, &nearest) else { return matched };
            off = 0.0;
            let inner: Vec<_> = (1..tau.len() - 1)
                .into_par_iter()
                .map(|j| {
                    let at = knots[j] + self.affine.evaluate(&map, knots[j]);
                    let tau = new.nearest(&boxes, at, [start[j] - NEAR, start[j] + NEAR]);
                    let nearest = new.point_and_tangent(tau);
                    (tau, nearest, (nearest.0.distance(at) * self.affine.weights[j]).powi(2))
                })
                .collect();
            for (j, (of_knot, point, square)) in (1..).zip(inner) {
                (tau[j], nearest[j]) = (of_knot, point);
                off += square;
            }
        }
        // One share for all knots: a knot that is near by chance must not pass its neighbours.
        let off = off.sqrt() / (STRAIGHT * self.length());
        let share = ((1.0 + off * off).powi(-2) - NOTHING) / (1.0 - NOTHING);
        if share <= 0.0 {
            return matched;
        }
        for (tau, &start) in tau.iter_mut().zip(&start) {
            *tau = start + (*tau - start) * share;
        }
        let crowded = |j: usize| tau[j + 1] - tau[j] < CROWDED * (start[j + 1] - start[j]);
        if (0..tau.len() - 1).any(crowded) {
            return matched;
        }
        let moved: Vec<DVec3> = tau.iter().zip(knots).map(|(&tau, &knot)| new.point(tau) - knot).collect();
        let residual = self.affine.fit(&moved).1;
        // Between knots the parameters keep their relative distances.
        let mut all = matched.1;
        for j in 0..tau.len() - 1 {
            let shifts = [tau[j] - start[j], tau[j + 1] - start[j + 1]];
            let last = if j + 2 == tau.len() { steps[j + 1] + 1 } else { steps[j + 1] };
            for (i, value) in all[steps[j]..last].iter_mut().enumerate() {
                let share = i as f64 / (steps[j + 1] - steps[j]) as f64;
                *value += shifts[0] + (shifts[1] - shifts[0]) * share;
            }
        }
        (residual, all)
    }
}

/// How the knots of a section move to a new profile.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct KnotDisplacements {
    /// Displacement of each knot, in the order of [`OldSection::knots`], in the mesh's unit.
    pub knots: Vec<DVec3>,
    /// The match that was made.
    pub by: ProfileMatch,
    /// Why the displacements have no derivative by the points of the new profile, if they have
    /// none.
    pub why_not: Option<&'static str>,
    /// Why the derivative is that of one side alone, if it is.
    pub kink: Option<&'static str>,
}

/// The match of an old section with a new one.
struct Match {
    /// Parameter on the new curve for each step of the old one.
    tau: Vec<f64>,
    new: Measured,
    new_base: Measured,
    /// Root mean square of what an affine map leaves of the measured displacements.
    residual: f64,
    /// The new points.
    outline: Outline,
    /// The plane of the new profile, its normal on the side of the old one's.
    plane: Plane,
    /// Whether the match is point by point.
    by_index: bool,
    /// Whether all points are the new profile's own. A carried trailing edge may add one.
    has_own_points: bool,
}

impl Match {
    /// The new points, if the match is point by point.
    fn by_index(&self) -> Option<&Outline> {
        self.by_index.then_some(&self.outline)
    }
}

/// The point of the new profile for each point of an old one, in the order of `old`.
///
/// - `old`, `new`: two profiles with one number; any numbers of points, directions and starting
///   points
///
/// [`super::ProfileInterpolation`] matches in the same way. This function shows the match itself.
///
/// # Errors
/// The errors of profiles that are no plane curves, see [`Plane::of_profile`].
pub fn match_points(old: &Profile, new: &Profile) -> Result<Vec<DVec3>, ProfileError> {
    let section = OldSection::new(old, &Plane::of_profile(old)?)?;
    if identical(&old.points, &new.points) {
        return Ok(old.points.clone());
    }
    let matched = section.matched(new)?;
    let mut targets = Vec::new();
    for (i, &point) in section.outline.sides.iter().enumerate() {
        // Between knots a point keeps its share of the piece's length.
        let piece = section.sides.knots.partition_point(|&k| k <= i).clamp(1, section.sides.knots.len() - 1) - 1;
        let ends = [piece, piece + 1].map(|k| (section.sides.knots[k], section.sides.knot_step[k]));
        let [from, to] = ends.map(|(knot, _)| section.outline.sides[knot].distance(point));
        let arc = [0, 1].map(|k: usize| section.measured.s[ends[k].1]);
        let arc = arc[0] + (arc[1] - arc[0]) * if from + to > 0.0 { from / (from + to) } else { 0.0 };
        let (step, t) = bracket(&section.measured.s, arc);
        let tau = matched.tau[step] + (matched.tau[step + 1] - matched.tau[step]) * t;
        targets.push((point, matched.by_index().map_or_else(|| matched.new.point(tau), |o| o.sides[i])));
    }
    if let Some(base) = &section.measured_base {
        for (i, &point) in section.outline.base.iter().enumerate() {
            let nearest = |a: &usize, b: &usize| {
                base.path[*a].distance_squared(point).total_cmp(&base.path[*b].distance_squared(point))
            };
            let step = (0..base.path.len()).min_by(nearest).unwrap_or(0);
            let by_measure = || matched.new_base.point(base.tau[step]);
            targets.push((point, matched.by_index().map_or_else(by_measure, |o| o.base[i])));
        }
    }
    // Back to the order of the file: the same points, with another start and direction.
    let mut by_place: HashMap<[u64; 3], DVec3> = HashMap::with_capacity(targets.len());
    let bits = |p: &DVec3| p.to_array().map(f64::to_bits);
    targets.iter().for_each(|(p, target)| _ = by_place.entry(bits(p)).or_insert(*target));
    let find = |p: &DVec3| {
        if let Some(target) = by_place.get(&bits(p)) {
            return *target;
        }
        let found = targets.iter().min_by(|a, b| a.0.distance_squared(*p).total_cmp(&b.0.distance_squared(*p)));
        found.map_or(*p, |target| target.1)
    };
    Ok(old.points.iter().map(find).collect())
}

/// Whether two profiles have the same points, in the same or the opposite order.
pub(super) fn identical(old: &[DVec3], new: &[DVec3]) -> bool {
    let largest = old.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let close = |(a, b): (&DVec3, &DVec3)| (*a - *b).abs().max_element() <= IDENTICAL * largest;
    old.len() == new.len() && (old.iter().zip(new).all(close) || old.iter().rev().zip(new).all(close))
}
