//! [`MatchChange`]: how the knots of an old section follow the points of its new profile.

use glam::DVec3;

use super::measured_change::{MOST_STEPS, MeasuredChange};
use super::{Match, OldSection, TURNS};
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
            return Ok(MatchChange::ByMeasure { old: Box::new(old), new: new.clone() });
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
fn measured_change(old: &(Profile, Plane, Option<DVec3>), new: &Profile) -> MeasuredChange {
    let (profile, plane, towards) = old;
    let section = OldSection::towards(profile, plane, *towards).expect("the profile was made a section before");
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
            Self::ByMeasure { old, new } => measured_change(old, new).forward(change),
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
            Self::ByMeasure { old, new } => by_points = measured_change(old, new).reverse(by_knots),
        }
        by_points
    }
}
