//! [`Agreed`]: the sections of one wing have their trailing edges on the same side.
//!
//! Where the shape of a section leaves a doubt, the other sections decide (see `edges`). The chords
//! of all sections whose shape tells are added up. A section whose chord points the other way is
//! divided at its other end. The paper has open sections alone, which end at the trailing edge.

use glam::DVec3;

use super::curve::{Ring, twice_area};
use super::edges::{TrailingEdge, farthest, trailing_edge, trailing_edge_towards};
use super::{Plane, Profile, ProfileError};

/// A section whose shape tells is overruled if its chord points away from the sum of the chords by
/// a greater angle, in degrees. A propeller's sections differ by less.
const REVERSED: f64 = 120.0;

/// The sides on which the sections of a wing have their trailing edges.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Agreed {
    /// From the leading edge to the trailing edge of each profile that does not have it where its
    /// own shape tells `[n_profiles]`; `None` for the others.
    pub towards: Vec<Option<DVec3>>,
    /// Whether the shape of no section tells which end is the trailing edge.
    pub in_doubt: bool,
}

impl Agreed {
    /// - `profiles`: of one wing, in any order and direction. Points that are no profile have no
    ///   say.
    pub fn of<'p>(profiles: impl IntoIterator<Item = &'p Profile>) -> Self {
        let chords: Vec<Option<Chord>> = profiles.into_iter().map(|profile| chord(profile).ok()).collect();
        let is_sure = chords.iter().flatten().any(|chord| chord.is_sure);
        let counted = chords.iter().flatten().filter(|chord| chord.is_sure == is_sure);
        let back: DVec3 = counted.map(|chord| chord.back).sum();
        let overruled = |chord: &Chord| {
            let least =
                if chord.is_sure { REVERSED.to_radians().cos() * chord.back.length() * back.length() } else { 0.0 };
            (chord.is_closed && chord.back.dot(back) < least).then_some(back)
        };
        let towards = chords.iter().map(|chord| chord.as_ref().and_then(overruled)).collect();
        Self { towards, in_doubt: !is_sure }
    }
}

/// The chord of a profile.
struct Chord {
    /// From the leading edge to the trailing edge.
    back: DVec3,
    is_closed: bool,
    is_sure: bool,
}

fn chord(profile: &Profile) -> Result<Chord, ProfileError> {
    let Ring { points, is_closed } = Ring::of(profile)?;
    if is_closed {
        let TrailingEdge { back, is_sure, .. } = trailing_edge(&points);
        return Ok(Chord { back, is_closed, is_sure });
    }
    let trailing = (points[0] + points[points.len() - 1]) / 2.0;
    let leading = points[farthest(&points, trailing)];
    Ok(Chord { back: trailing - leading, is_closed, is_sure: true })
}

/// Lets the closed profiles of a wing start at the trailing edge on which its sections agree, as
/// they are cut: from the lower corner of the trailing edge along the lower side. Returns what they
/// agree on. Profiles that start there keep every bit.
///
/// - `planes` `[n_profiles]`: of the profiles
pub(crate) fn align(profiles: &mut [Profile], planes: &[Plane]) -> Agreed {
    let agreed = Agreed::of(profiles.iter());
    for ((profile, plane), towards) in profiles.iter_mut().zip(planes).zip(&agreed.towards) {
        let (Some(back), Ok(Ring { mut points, .. })) = (*towards, Ring::of(profile)) else { continue };
        let TrailingEdge { start, end, .. } = trailing_edge_towards(&points, back);
        let up = if plane.normal.z.abs() < 0.9 { DVec3::Z } else { DVec3::Y };
        // The curve turns from forward to up.
        let runs_below = twice_area(&points).dot((-back).cross(up)) > 0.0;
        if runs_below {
            points.rotate_left(start);
        } else {
            points.rotate_left(end);
            points[1..].reverse();
        }
        points.push(points[0]);
        profile.points = points;
    }
    agreed
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A closed profile in the plane at `y`, from the corner with the greatest x.
    fn profile(y: f64, corners: &[(f64, f64)]) -> Profile {
        let mut points: Vec<DVec3> = corners.iter().map(|&(x, z)| DVec3::new(x, y, z)).collect();
        points.push(points[0]);
        Profile { number: 0, points }
    }

    /// An airfoil with its trailing edge at x = 0, the flow along -x, and diamonds beside it. Their
    /// shapes leave a doubt, and the airfoil decides. Without it they have their trailing edges at
    /// the greater x.
    ///
    /// Fails if sections in doubt have a say.
    #[test]
    fn clear_sections_decide() {
        let airfoil =
            [(0.0, 0.0), (0.5, 0.05), (0.8, 0.06), (0.97, 0.03), (1.0, 0.0), (0.97, -0.03), (0.8, -0.06), (0.5, -0.05)];
        let diamond = [(1.0, 0.0), (0.5, 0.04), (0.0, 0.0), (0.5, -0.04)];
        let plane = |y: f64| Plane { point: DVec3::Y * y, normal: DVec3::Y };
        let planes = [plane(0.0), plane(1.0), plane(2.0)];
        let mut profiles = [profile(0.0, &diamond), profile(1.0, &airfoil), profile(2.0, &diamond)];
        let before = profiles[1].clone();
        let agreed = align(&mut profiles, &planes);
        assert!(!agreed.in_doubt && agreed.towards.iter().map(Option::is_some).eq([true, false, true]), "{agreed:?}");
        assert_eq!(profiles[1], before);
        for diamond in [&profiles[0], &profiles[2]] {
            let xs: Vec<f64> = diamond.points.iter().map(|point| point.x).collect();
            assert_eq!(xs, [0.0, 0.5, 1.0, 0.5, 0.0]);
            // From the trailing edge along the lower side.
            assert!(diamond.points[1].z < 0.0, "{diamond:?}");
        }
        let alone = align(&mut [profile(0.0, &diamond), profile(1.0, &diamond)], &planes[..2]);
        assert!(alone.in_doubt && alone.towards == [None, None], "{alone:?}");
    }

    /// A section whose shape tells is overruled by two others, and one that is turned by a right
    /// angle is not.
    ///
    /// Fails if `REVERSED` is 60 or 190.
    #[test]
    fn one_reversed_section_is_overruled() {
        let airfoil = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let corners = [
                (1.0, 0.0),
                (0.5, 0.05),
                (0.2, 0.06),
                (0.03, 0.03),
                (0.0, 0.0),
                (0.03, -0.03),
                (0.2, -0.06),
                (0.5, -0.05),
            ];
            profile(0.0, &corners.map(|(x, z)| (cos * x - sin * z, sin * x + cos * z)))
        };
        for (degrees, overruled) in [(90.0, false), (180.0, true)] {
            let agreed = Agreed::of(&[airfoil(0.0), airfoil(degrees), airfoil(5.0)]);
            assert!(agreed.towards.iter().map(Option::is_some).eq([false, overruled, false]), "{degrees} {agreed:?}");
        }
    }
}
