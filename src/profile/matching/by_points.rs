//! [`ProfileMatch`]: the choice between the two matches, and the match point by point as it is
//! asked for.
//!
//! Without a choice each design decides, see [`super`]. A loop that moves the old profile's own
//! points may then cross from one match to the other, and its function jumps there. So a loop
//! chooses once.

use serde::Serialize;

use super::super::curve::{Outline, Ring};
use super::super::{Plane, Profile, ProfileError};
use super::OldSection;

/// A closed profile has its points in another order if its trailing edge is farther from the point
/// that takes the place of the old one than this share of the section's length.
const ELSEWHERE: f64 = 0.25;

/// How the points of a new profile are matched with those of the old one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ProfileMatch {
    /// Point by point: both have as many points, in the same order.
    Points,
    /// By the length along the curve, whatever the points are.
    Measure,
}

/// The names of the matches, as cases and reports have them.
pub const PROFILE_MATCHES: [(&str, ProfileMatch); 2] =
    [("points", ProfileMatch::Points), ("measure", ProfileMatch::Measure)];

impl ProfileMatch {
    /// The match with a name.
    pub fn named(name: &str) -> Option<Self> {
        PROFILE_MATCHES.iter().find(|(known, _)| *known == name).map(|&(_, by)| by)
    }
}

impl OldSection {
    /// The new profile, divided at the points at which this section is divided.
    ///
    /// - `plane`: of the new profile, its normal on the side of the section's
    ///
    /// # Errors
    /// [`ProfileError::PointCounts`], [`ProfileError::PointOrder`], and the errors of points that
    /// are no profile.
    pub(super) fn outline_by_points(&self, new: &Profile, plane: &Plane) -> Result<Outline, ProfileError> {
        let profile = new.number;
        let Ring { points, is_closed } = Ring::of(new)?;
        let n_old = self.outline.n_points();
        let was_closed = self.outline.edge.is_some();
        if points.len() != n_old || is_closed != was_closed {
            // The first point of a closed curve is repeated at its end.
            let counts = [(points.len(), is_closed), (n_old, was_closed)];
            let [new, old] = counts.map(|(n, is_closed)| n + usize::from(is_closed));
            return Err(ProfileError::PointCounts { profile, new, old, closed: [is_closed, was_closed] });
        }
        let outline = Outline::divided(profile, points, self.outline.edge, plane)?;
        if outline.reversed != self.outline.reversed {
            return Err(ProfileError::PointOrder { profile, what: "its points run in the opposite direction" });
        }
        let own = Outline::like(new, plane, self.back())?;
        let middle = |outline: &Outline| (outline.sides[0] + outline.sides[outline.sides.len() - 1]) / 2.0;
        let apart = middle(&outline).distance(middle(&own));
        if own.edge.is_some_and(|edge| edge.is_sure) && apart > ELSEWHERE * self.length {
            return Err(ProfileError::PointOrder { profile, what: "its points begin elsewhere" });
        }
        Ok(outline)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::MatchChange;
    use super::*;

    /// A symmetric section of 12 % of the chord with a sharp trailing edge.
    ///
    /// - `parameters`: of its points, from -1 to 1 along the curve
    fn section(parameters: impl Iterator<Item = f64>) -> Profile {
        let at = |t: f64| {
            let x = t * t;
            let round = 0.2969 * t.abs() - 0.126 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1036 * x.powi(4);
            DVec3::new(x, 0.0, -0.6 * round * t.signum())
        };
        Profile { number: 7, points: parameters.map(at).collect() }
    }

    fn even(n: i32) -> impl Iterator<Item = f64> {
        (-n..=n).map(move |i| f64::from(i) / f64::from(n))
    }

    fn old() -> OldSection {
        let old = section(even(40));
        OldSection::new(&old, &Plane::of_profile(&old).unwrap()).unwrap()
    }

    /// The old curve with small waves, and points that slide along it.
    ///
    /// - `by`: the farthest slide, as a parameter
    fn slid(by: f64) -> Profile {
        let mut new = section(even(40).map(|t| t + by * (std::f64::consts::PI * t).sin()));
        for at in &mut new.points {
            at.z += 2e-3 * at.x * (1.0 - at.x) * (9.0 * at.x).sin();
        }
        new
    }

    /// Among designs whose points slide a little farther each time, some are on either side of the
    /// switch. The choice takes each of them to the match that was asked for: point by point every
    /// knot goes to the point of its number, by measure no knot slides as far as the points do.
    ///
    /// Fails if `matched` or `is_by_index` does not look at the choice.
    #[test]
    fn the_choice_is_kept_on_both_sides_of_the_switch() {
        let free = old();
        let chosen = [ProfileMatch::Points, ProfileMatch::Measure].map(|by| old().matched_by(Some(by)));
        let mut seen = Vec::new();
        for step in 0..12 {
            let by = 1e-5 * 2.0_f64.powi(step);
            let new = slid(by);
            let [points, measure] = [&chosen[0], &chosen[1]].map(|section| section.displacements(&new).unwrap());
            assert_eq!((points.by, measure.by), (ProfileMatch::Points, ProfileMatch::Measure));
            for (knot, moved) in free.knots().iter().zip(&points.knots) {
                // The sides may run against the points of the file.
                let place = free.profile().points.iter().position(|at| at == knot).unwrap();
                assert!((*knot + *moved).distance(new.points[place]) < 1e-15, "{step}");
            }
            let farthest = |knots: &[DVec3]| knots.iter().map(|by| by.x.abs()).fold(0.0, f64::max);
            if by > 1e-2 {
                assert!(farthest(&points.knots) > 3.0 * farthest(&measure.knots), "{step}");
            }
            let own = free.displacements(&new).unwrap();
            assert_eq!(own, if own.by == ProfileMatch::Points { points } else { measure }, "{step}");
            seen.push(own.by);
        }
        seen.dedup();
        assert_eq!(seen, [ProfileMatch::Points, ProfileMatch::Measure]);
    }

    /// Fails if counts, ends or order are not compared.
    #[test]
    fn points_that_do_not_pair_are_refused() {
        let by_points = old().matched_by(Some(ProfileMatch::Points));
        let refused = |new: &Profile| by_points.displacements(new).unwrap_err();
        let counts = |new, old, closed| ProfileError::PointCounts { profile: 7, new, old, closed };
        assert_eq!(refused(&section(even(41))), counts(83, 81, [true, true]));
        let mut open = slid(0.0);
        open.points[0].z += 1e-3;
        assert_eq!(refused(&open), counts(81, 81, [false, true]));
        let message = refused(&section(even(41))).to_string();
        assert!(message.contains("profile 7") && message.contains("83 points") && message.contains("81 points"));
        for same in [slid(0.0), section(even(40))] {
            assert!(by_points.displacements(&same).is_ok());
            let mut reversed = same.clone();
            reversed.points.reverse();
            assert!(matches!(refused(&reversed), ProfileError::PointOrder { profile: 7, .. }));
            let mut elsewhere = same;
            elsewhere.points.pop();
            elsewhere.points.rotate_left(30);
            elsewhere.points.push(elsewhere.points[0]);
            assert!(matches!(refused(&elsewhere), ProfileError::PointOrder { profile: 7, .. }));
        }
    }

    /// Point by point the derivative is the point's own change. By measure it is the limit of
    /// differences also where each design would decide for points.
    #[test]
    fn derivatives_are_of_the_match_that_was_asked_for() {
        let new = slid(1e-5);
        let direction: Vec<DVec3> =
            new.points.iter().map(|at| DVec3::new(0.5 * at.x, 0.0, (3.0 * at.x).sin() + 0.3 * at.z)).collect();
        let forward = |by| {
            let section = old().matched_by(Some(by));
            let change = section.match_change(&new).unwrap();
            assert_eq!(matches!(change, MatchChange::ByPoints(_)), by == ProfileMatch::Points);
            (change.forward(&direction), section)
        };
        let (change, section) = forward(ProfileMatch::Points);
        for (knot, change) in section.knots().iter().zip(&change) {
            let place = section.profile().points.iter().position(|at| at == knot).unwrap();
            assert!(change.distance(direction[place]) == 0.0);
        }
        let (change, section) = forward(ProfileMatch::Measure);
        let apart = [1e-6, 1e-7].map(|h| {
            let [plus, minus] = [h, -h].map(|h| {
                let points = new.points.iter().zip(&direction).map(|(at, by)| *at + *by * h).collect();
                section.displacements(&Profile { points, ..new.clone() }).unwrap().knots
            });
            let pairs = plus.iter().zip(&minus).zip(&change);
            pairs.map(|((plus, minus), by)| ((*plus - *minus) / (2.0 * h) - *by).length()).fold(0.0, f64::max)
        });
        assert!(apart[0].min(apart[1]) < 1e-6, "{apart:?}");
    }
}
