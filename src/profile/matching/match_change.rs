//! [`MatchChange`]: how the knots of an old section follow the points of its new profile.

use glam::DVec3;

use super::measured_change::{MOST_STEPS, MeasuredChange};
use super::{Match, OldSection, ProfileMatch, TURNS};
use crate::profile::curve::Outline;
use crate::profile::{Plane, Profile};

/// Why a profile that has no match has no derivative. An update of such a profile fails.
const NO_MATCH: &str = "has no match with the old profile";

/// Why a match with a point that the new profile does not have has no derivative.
const INSERTED: &str = "has its trailing edge between two of its points, where the match put it";

/// The derivative of [`OldSection::displacements`] by the points of the new profile.
#[derive(Clone, Debug)]
pub(in crate::profile) enum MatchChange {
    /// The match is point by point: the point of each knot.
    ByPoints(Vec<u32>),
    /// The match is by measure, from the old section to the new profile. Its derivative is made
    /// when it is asked for, because it takes some megabytes.
    ByMeasure {
        /// The old profile, its plane, and its given direction to the trailing edge.
        old: Box<(Profile, Plane, Option<DVec3>)>,
        /// How the section matches new profiles.
        by: Option<ProfileMatch>,
        /// The new profile.
        new: Profile,
    },
}

impl OldSection {
    /// Why a match has no derivative, if it has none.
    pub(super) fn why_not(&self, matched: &Match) -> Option<&'static str> {
        let steps = matched.new.path.len() + matched.new_base.path.len() + TURNS * self.sides.path.len();
        match (matched.by_index, matched.has_own_points) {
            (_, false) => Some(INSERTED),
            (false, _) if steps > MOST_STEPS => Some("is matched by measure, and has too many points for a derivative"),
            _ => None,
        }
    }

    /// The derivative of [`Self::displacements`] at a new profile. A profile that is the section's
    /// own has the derivative of the match point by point.
    ///
    /// # Errors
    /// Why there is none.
    pub fn match_change(&self, new: &Profile) -> Result<MatchChange, &'static str> {
        let matched = self.matched(new).map_err(|_| NO_MATCH)?;
        if let Some(why) = self.why_not(&matched) {
            return Err(why);
        }
        let [sides, base] = places_in(new, &matched.outline)?;
        if !matched.by_index {
            let old = (self.profile.clone(), self.plane, self.towards);
            return Ok(MatchChange::ByMeasure { old: Box::new(old), by: self.by, new: new.clone() });
        }
        let of_sides = self.sides.knots.iter().map(|&i| sides[i]);
        let of_base = self.base.iter().flat_map(|base| &base.knots).map(|&i| base[i]);
        Ok(MatchChange::ByPoints(of_sides.chain(of_base).collect()))
    }
}

/// The places in a profile of the points of its outline's sides and base. Of points that are
/// repeated one after the other, or at the end of a closed profile, the first counts.
///
/// # Errors
/// The outline has other points.
fn places_in(profile: &Profile, outline: &Outline) -> Result<[Vec<u32>; 2], &'static str> {
    let points = &profile.points;
    let distinct: Vec<usize> = (0..points.len()).filter(|&i| i == 0 || points[i] != points[i - 1]).collect();
    let n = outline.n_points();
    let is_of = |place: usize, point: &DVec3| distinct.get(place).is_some_and(|&at| points[at] == *point);
    let [sides, base] = outline.places(n);
    let all_of = |places: &[usize], of: &[DVec3]| places.iter().zip(of).all(|(&place, point)| is_of(place, point));
    if !(all_of(&sides, &outline.sides) && all_of(&base, &outline.base)) {
        return Err(INSERTED);
    }
    Ok([sides, base].map(|places| places.into_iter().map(|place| distinct[place] as u32).collect()))
}

/// The derivative of a match by measure.
fn measured_change(old: &(Profile, Plane, Option<DVec3>), by: Option<ProfileMatch>, new: &Profile) -> MeasuredChange {
    let (profile, plane, towards) = old;
    let section = OldSection::towards(profile, plane, *towards).expect("the profile was made a section before");
    let section = section.matched_by(by);
    let matched = section.matched(new).expect("the profile was matched before");
    let places = places_in(new, &matched.outline).expect("the places were found before");
    MeasuredChange::new(&section, new, &matched, &places)
}

impl MatchChange {
    /// Change of the knots' displacements.
    ///
    /// - `change` `[n_points]`: of the new profile's points
    pub fn forward(&self, change: &[DVec3]) -> Vec<DVec3> {
        match self {
            Self::ByPoints(places) => places.iter().map(|&place| change[place as usize]).collect(),
            Self::ByMeasure { old, by, new } => measured_change(old, *by, new).forward(change),
        }
    }

    /// The transpose of [`Self::forward`].
    ///
    /// - `by_knots`: derivative by the knots' displacements
    /// - `n_points`: of the new profile
    pub fn reverse(&self, by_knots: &[DVec3], n_points: usize) -> Vec<DVec3> {
        let mut by_points = vec![DVec3::ZERO; n_points];
        match self {
            Self::ByPoints(places) => {
                places.iter().zip(by_knots).for_each(|(&place, by)| by_points[place as usize] += *by);
            }
            Self::ByMeasure { old, by, new } => by_points = measured_change(old, *by, new).reverse(by_knots),
        }
        by_points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A NACA section of 12 % of the chord with a base of this thickness, from the upper side of
    /// the trailing edge on. Its stations are nearer to each other at the leading edge.
    fn airfoil(n: i32, base: f64, closed: bool) -> Profile {
        let at = |i: i32| {
            let t = f64::from(i) / f64::from(n);
            let x = t * t;
            let round = 0.2969 * t.abs() - 0.126 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1036 * x.powi(4);
            let half = if base == 0.0 && i.abs() == n { 0.0 } else { 0.6 * round + 0.5 * base * x };
            DVec3::new(x, 0.0, -half * t.signum())
        };
        let mut points: Vec<DVec3> = (-n..=n).map(at).collect();
        if closed && base > 0.0 {
            points.push(points[0]);
        }
        Profile { number: 0, points }
    }

    /// A slab with square ends, with points on all sides.
    fn slab(n: i32) -> Profile {
        let share = |i: i32| f64::from(i) / f64::from(n);
        let upper = (0..=n).map(|i| DVec3::new(1.0 - share(i), 0.0, 0.05));
        let lower = (0..=n).map(|i| DVec3::new(share(i), 0.0, -0.05));
        let mut points: Vec<DVec3> = upper.chain(lower).collect();
        points.push(points[0]);
        Profile { number: 0, points }
    }

    /// A profile that is an affine map of the old one's curve, one that is nearly so, one with a
    /// bump, and one in a tilted plane.
    fn changed(profile: &Profile) -> [Profile; 4] {
        let affine = |at: DVec3| DVec3::new(1.05 * at.x + 0.02 * at.z, 0.0, 1.2 * at.z + 0.1 * at.x);
        let nearly = |at: DVec3| affine(at) + DVec3::Z * 3e-4 * (4.0 * at.x).sin();
        let bump = |at: DVec3| affine(at) + DVec3::Z * 0.04 * (-30.0 * (at.x - 0.4).powi(2)).exp();
        let tilted = |at: DVec3| affine(at) + DVec3::Y * (0.3 * affine(at).x - 0.4 * affine(at).z);
        [&affine as &dyn Fn(DVec3) -> DVec3, &nearly, &bump, &tilted].map(|map| {
            let points = profile.points.iter().map(|&at| map(at)).collect();
            Profile { points, ..profile.clone() }
        })
    }

    /// A smooth direction in a profile's plane, which tilts.
    ///
    /// - `tilted`: whether the plane is the tilted one
    fn direction(new: &Profile, tilted: bool) -> Vec<DVec3> {
        let tilt = if tilted { 1.0 } else { 0.0 };
        let at = |at: &DVec3| {
            let (x, z) = (0.5 * (2.0 * at.z).cos() * at.x, (3.0 * at.x).sin() + 0.3 * at.z);
            DVec3::new(x, 0.2 * at.x + tilt * (0.3 * x - 0.4 * z), z)
        };
        new.points.iter().map(at).collect()
    }

    /// Forward is the limit of differences, and reverse its transpose.
    ///
    /// The choices of a match by measure change, and its values jump, within 1e-6 of a profile that
    /// is an affine map, so of some steps the best one counts. Maps of the old points themselves
    /// that are nearly affine are matched point by point or by measure; they are left out.
    ///
    /// Fails if the trailing edge does not move the parameters, or if the fit across the curve has
    /// constant tangents.
    #[test]
    fn matches_have_their_derivatives() {
        let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
        let norm = |all: &[DVec3]| dot(all, all).sqrt();
        let mut reversed = airfoil(20, 0.0, true);
        reversed.points.reverse();
        for (what, old, new, by_points) in [
            ("sharp", airfoil(20, 0.0, true), airfoil(27, 0.0, true), false),
            ("open", airfoil(20, 0.01, false), airfoil(33, 0.01, false), false),
            ("with base", airfoil(20, 0.03, true), airfoil(26, 0.03, true), false),
            ("sharp to blunt", airfoil(20, 0.0, true), airfoil(20, 0.02, false), false),
            ("slab", slab(10), slab(13), false),
            ("own points", airfoil(20, 0.03, true), airfoil(20, 0.03, true), true),
            ("the other way", airfoil(20, 0.0, true), reversed, true),
        ] {
            let section = OldSection::new(&old, &Plane::of_profile(&old).unwrap()).unwrap();
            for (k, new) in changed(&new).into_iter().enumerate().skip(if by_points { 2 } else { 0 }) {
                let change = section.match_change(&new).unwrap();
                assert_eq!(matches!(change, MatchChange::ByPoints(_)), by_points, "{what} {k}");
                let direction = direction(&new, k == 3);
                let forward = change.forward(&direction);
                let off = [1e-6, 1e-7, 1e-8].map(|h| {
                    let [plus, minus] = [h, -h].map(|h| {
                        let points = new.points.iter().zip(&direction).map(|(at, by)| *at + *by * h).collect();
                        section.displacements(&Profile { points, ..new.clone() }).unwrap().knots
                    });
                    let difference = plus.iter().zip(&minus).map(|(plus, minus)| (*plus - *minus) / (2.0 * h));
                    norm(&difference.zip(&forward).map(|(by, exact)| by - *exact).collect::<Vec<_>>())
                });
                let off = off.into_iter().fold(f64::INFINITY, f64::min) / norm(&forward);
                assert!(off < 1e-7, "{what} {k}: {off:e}");
                let seed: Vec<DVec3> = (0..forward.len()).map(|i| DVec3::new(1.0, 0.3, (i as f64).sin())).collect();
                let gradient = change.reverse(&seed, new.points.len());
                let apart = (dot(&seed, &forward) - dot(&gradient, &direction)).abs();
                assert!(apart < 1e-12 * norm(&seed) * norm(&forward), "{what} {k}: {apart:e}");
            }
        }
    }

    /// A curve of straight pieces has corners. A knot may be nearest to one of them over 1e-5 of
    /// the chord, and stays there.
    ///
    /// Fails if such a knot goes on along the steps beside the corner.
    #[test]
    fn knots_at_corners_have_their_derivative() {
        let old = airfoil(40, 0.01, true);
        let section = OldSection::new(&old, &Plane::of_profile(&old).unwrap()).unwrap();
        for k in 0..20 {
            let phase = f64::from(k);
            let moved = |at: DVec3| at + DVec3::new(0.004 * (2.0 * at.x).sin(), 0.0, 0.01 * (4.0 * at.x + phase).sin());
            let points: Vec<DVec3> = old.points.iter().map(|&at| moved(at)).collect();
            let between = |pair: &[DVec3]| [0.0, 0.4, 0.8].map(|share| pair[0].lerp(pair[1], share));
            let mut finer: Vec<DVec3> = points.windows(2).flat_map(between).collect();
            finer.push(points[0]);
            let new = Profile { points: finer, ..old.clone() };
            let direction: Vec<DVec3> = new.points.iter().map(|at| DVec3::Z * (3.0 * at.x).cos()).collect();
            let forward = section.match_change(&new).unwrap().forward(&direction);
            let off = [1e-6, 1e-7].map(|h| {
                let [plus, minus] = [h, -h].map(|h| {
                    let points = new.points.iter().zip(&direction).map(|(at, by)| *at + *by * h).collect();
                    section.displacements(&Profile { points, ..new.clone() }).unwrap().knots
                });
                let differences = plus.iter().zip(&minus).map(|(plus, minus)| (*plus - *minus) / (2.0 * h));
                differences.zip(&forward).map(|(by, exact)| by.distance(*exact)).fold(0.0, f64::max)
            });
            let off = off.into_iter().fold(f64::INFINITY, f64::min);
            assert!(off < 1e-5, "{k}: {off:e}");
        }
    }

    /// Own points that move smoothly come near corners between steps of the new curve. The
    /// derivative is that of designs 1e-12 away all the same.
    ///
    /// Fails if rounding of the tape may lead a knot to another step than the match took.
    #[test]
    fn the_derivative_does_not_jump_by_rounding() {
        let old = airfoil(40, 0.01, true);
        let section = OldSection::new(&old, &Plane::of_profile(&old).unwrap()).unwrap();
        let section = section.matched_by(Some(ProfileMatch::Measure));
        for k in 0..15 {
            let phase = f64::from(k);
            let moved = |at: DVec3| at + DVec3::new(0.004 * (2.0 * at.x).sin(), 0.0, 0.01 * (4.0 * at.x + phase).sin());
            let at = |by: f64| {
                let points = old.points.iter().map(|&at| moved(at) + DVec3::Z * by * (3.0 * at.x).cos()).collect();
                let new = Profile { points, ..old.clone() };
                let direction: Vec<DVec3> = new.points.iter().map(|at| DVec3::Z * (3.0 * at.x).cos()).collect();
                section.match_change(&new).unwrap().forward(&direction)
            };
            let [one, other] = [0.0, 1e-12].map(at);
            let apart = one.iter().zip(&other).map(|(one, other)| one.distance(*other)).fold(0.0, f64::max);
            assert!(apart < 1e-6, "{k}: {apart:e}");
        }
    }

    /// A match that puts the trailing edge between two points, and one of very many points.
    #[test]
    fn what_has_no_derivative_says_why() {
        let (old, new) = (airfoil(20, 0.0, true), airfoil(27, 0.0, true));
        let section = OldSection::new(&old, &Plane::of_profile(&old).unwrap()).unwrap();
        let mut matched = section.matched(&new).unwrap();
        assert_eq!(section.why_not(&matched), None);
        assert!(places_in(&new, &matched.outline).is_ok());
        matched.outline.sides[3].z += 1e-9;
        assert_eq!(places_in(&new, &matched.outline).err(), Some(INSERTED));
        matched.has_own_points = false;
        assert_eq!(section.why_not(&matched), Some(INSERTED));
        let matched = section.matched(&airfoil(110_000, 0.0, true)).unwrap();
        assert!(section.why_not(&matched).unwrap().contains("too many points"));
    }
}
