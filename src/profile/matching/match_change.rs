//! [`MatchChange`]: how the knots of an old section follow the points of its new profile.

use glam::DVec3;

use super::{Match, OldSection};
use crate::profile::Profile;
use crate::profile::curve::Outline;

/// Why a match with a point that the new profile does not have has no derivative.
const INSERTED: &str = "has its trailing edge between two of its points, where the match put it";

/// The derivative of [`OldSection::displacements`] by the points of the new profile.
#[derive(Clone, Debug)]
pub(in crate::profile) enum MatchChange {
    /// The match is point by point: the point of each knot.
    ByPoints(Vec<u32>),
}

impl Match {
    /// Why the match has no derivative, if it has none.
    pub fn why_not(&self) -> Option<&'static str> {
        match (self.by_index, self.has_own_points) {
            (_, false) => Some(INSERTED),
            (false, _) => Some("is matched with the old profile by measure, not point by point"),
            _ => None,
        }
    }
}

impl OldSection {
    /// The derivative of [`Self::displacements`] at a new profile. A profile that is the section's
    /// own has the derivative of the match point by point.
    ///
    /// # Errors
    /// Why there is none.
    pub fn match_change(&self, new: &Profile) -> Result<MatchChange, &'static str> {
        let matched = self.matched(new).map_err(|_| "has no match with the old profile")?;
        if let Some(why) = matched.why_not() {
            return Err(why);
        }
        let [sides, base] = places_in(new, &matched.outline)?;
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

impl MatchChange {
    /// Change of the knots' displacements.
    ///
    /// - `change` `[n_points]`: of the new profile's points
    pub fn forward(&self, change: &[DVec3]) -> Vec<DVec3> {
        match self {
            Self::ByPoints(places) => places.iter().map(|&place| change[place as usize]).collect(),
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
        }
        by_points
    }
}
