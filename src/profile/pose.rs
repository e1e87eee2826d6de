//! [`Pose`]: where a section stands in space, and how large it is, in the terms in which a case
//! places an airfoil.

use glam::DVec3;

use super::curve::{Outline, ProfileCurve, arc_length, bracket, leading_edge};
use super::files::SpanAxis;
use super::{Plane, Profile, ProfileError};

/// Number of places along the chord at which the thickness is measured. A thickness that is
/// quadratic about its maximum is then known to 1e-5 of itself.
const PLACES: usize = 400;

/// A coordinate below this share of the chord is rounding, and is zero; so is an angle below this
/// in radians.
const ROUNDING: f64 = 1e-12;

/// Place, size and twist of a section. An airfoil with a chord of 1 and its leading edge at the
/// origin takes this place by a [`Placement`](super::Placement) with the same values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The point of the section that is farthest from the middle of its trailing edge, or between
    /// two that are about as far, in the mesh's unit.
    pub leading_edge: DVec3,
    /// Distance of the leading edge from the middle of the trailing edge, in the mesh's unit.
    pub chord: f64,
    /// The axis across the section's plane, and the nose-up rotation in degrees. `None` if no
    /// placement has this plane.
    pub twist: Option<(SpanAxis, f64)>,
    /// Largest thickness across the chord, in chords.
    pub thickness: f64,
    /// Distance between both sides at the trailing edge, in chords. 0 for a sharp one.
    pub trailing_edge: f64,
}

impl Pose {
    /// Measures a section.
    ///
    /// - `plane`: plane of the section
    ///
    /// # Errors
    /// The points are no section: [`ProfileError::TooFewPoints`], [`ProfileError::NotInOrder`],
    /// [`ProfileError::ProfileCutShort`], [`ProfileError::CrossesItself`] and those of points that
    /// are no profile.
    pub fn of(profile: &Profile, plane: &Plane) -> Result<Self, ProfileError> {
        Self::towards(profile, plane, None)
    }

    /// Measures a section with its trailing edge in a direction.
    ///
    /// - `towards`: from the leading edge to the trailing edge; `None` if the shape tells
    pub(crate) fn towards(profile: &Profile, plane: &Plane, towards: Option<DVec3>) -> Result<Self, ProfileError> {
        let outline = Outline::towards(profile, plane, towards)?;
        let [first, last] = [outline.sides[0], outline.sides[outline.sides.len() - 1]];
        let end = 0.5 * (first + last);
        let path = ProfileCurve::new(&outline.sides).path;
        let s = arc_length(&path);
        let d: Vec<f64> = path.iter().map(|point| point.distance(end)).collect();
        let (step, t) = bracket(&s, leading_edge(&s, &d).0);
        let nose = path[step].lerp(path[step + 1], t);
        let chord = nose.distance(end);
        let exact = |x: f64, size: f64| if x.abs() <= ROUNDING * size { 0.0 } else { x };
        let back = end - nose;
        let axis = [(SpanAxis::Y, DVec3::Y, back.z), (SpanAxis::Z, DVec3::Z, back.y)];
        let axis = axis.into_iter().find(|(_, normal, _)| plane.normal.abs() == *normal);
        Ok(Self {
            leading_edge: DVec3::from_array(nose.to_array().map(|x| exact(x, chord))),
            chord,
            twist: axis.map(|(span, _, up)| (span, exact(-up.atan2(back.x), 1.0).to_degrees())),
            thickness: thickness(&path, nose, back / chord, plane.normal) / chord,
            trailing_edge: if outline.joined { 0.0 } else { outline.gap() / chord },
        })
    }
}

/// Largest extent of a curve across its chord, in the curve's unit.
///
/// - `nose`: the beginning of the chord
/// - `along`: unit vector along the chord
/// - `normal`: unit normal of the curve's plane
fn thickness(path: &[DVec3], nose: DVec3, along: DVec3, normal: DVec3) -> f64 {
    let across = normal.cross(along);
    let points: Vec<[f64; 2]> = path.iter().map(|&at| [(at - nose).dot(along), (at - nose).dot(across)]).collect();
    let length = points.iter().map(|point| point[0]).fold(0.0, f64::max);
    // Lowest and highest point of the curve at each place.
    let mut extents = [(f64::INFINITY, f64::NEG_INFINITY); PLACES + 1];
    let place = |x: f64| x / length * PLACES as f64;
    for pair in points.windows(2) {
        let [[x0, y0], [x1, y1]] = [pair[0], pair[1]];
        let [low, high] = [place(x0.min(x1)).ceil().max(0.0), place(x0.max(x1)).floor().min(PLACES as f64)];
        if x0 == x1 || low > high {
            continue;
        }
        let [low, high] = [low as usize, high as usize];
        for (index, extent) in (low..).zip(&mut extents[low..=high]) {
            let x = index as f64 * length / PLACES as f64;
            let y = y0 + (y1 - y0) * (x - x0) / (x1 - x0);
            *extent = (extent.0.min(y), extent.1.max(y));
        }
    }
    extents.into_iter().map(|(low, high)| high - low).filter(|thick| thick.is_finite()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::profile::Placement;

    /// Half the thickness of a NACA 0012 (Abbott and von Doenhoff) that ends with `base`.
    fn half(x: f64, base: f64) -> f64 {
        let open =
            |x: f64| 0.6 * (0.2969 * x.sqrt() - 0.1260 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1036 * x.powi(4));
        open(x) + x * (0.5 * base - open(1.0))
    }

    fn section(placement: &Placement, base: f64, n: i32) -> Profile {
        let point = |i: i32| {
            let x = 0.5 * (1.0 - (std::f64::consts::PI * f64::from(i) / f64::from(n)).cos());
            placement.place(DVec2::new(x, f64::from(i.signum()) * half(x, base)))
        };
        Profile { number: 0, points: (-n..=n).map(point).collect() }
    }

    /// A symmetric airfoil is found where it was placed, whichever direction its points have and
    /// however few they are. Its greatest thickness is 12 % of the chord.
    #[test]
    fn a_placed_airfoil_is_found_where_it_is() {
        for (span, normal) in [(SpanAxis::Y, DVec3::Y), (SpanAxis::Z, DVec3::Z)] {
            for (chord, twist, base) in [(0.8, -3.0, 0.0), (2.0e3, 12.0, 0.01), (1.0, 0.0, 0.002)] {
                let placement = Placement { chord, twist, position: chord * DVec3::new(1.0, 2.0, -0.5), span };
                for (n, tolerance) in [(12, 2e-3), (80, 1e-4)] {
                    let mut profile = section(&placement, base, n);
                    for _ in 0..2 {
                        profile.points.reverse();
                        let plane = Plane { point: placement.position, normal };
                        let pose = Pose::of(&profile, &plane).unwrap();
                        let off = pose.leading_edge.distance(placement.position);
                        assert!(off <= tolerance * chord, "{n} {pose:?}");
                        assert!((pose.chord / chord - 1.0).abs() <= tolerance, "{n} {pose:?}");
                        let (axis, found) = pose.twist.unwrap();
                        assert!(axis == span && (found - twist).abs() <= 1e-6, "{n} {pose:?}");
                        assert!((pose.thickness - 0.12).abs() <= 0.12 * tolerance + 2e-4 + 0.4 * base, "{n} {pose:?}");
                        assert!((pose.trailing_edge - base).abs() <= 1e-9, "{n} {pose:?}");
                    }
                }
            }
        }
    }

    /// What rounding leaves of a zero is zero, and the smallest place and twist that somebody may
    /// mean are not.
    ///
    /// Fails if `ROUNDING` is 0 or 1e-6.
    #[test]
    fn rounding_is_no_place() {
        for (small, is_rounding) in [(1e-14, true), (1e-7, false)] {
            let position = DVec3::new(1.0, 2.0, small);
            let placement = Placement { chord: 1.0, twist: small.to_degrees(), position, span: SpanAxis::Y };
            let plane = Plane { point: position, normal: DVec3::Y };
            let pose = Pose::of(&section(&placement, 0.0, 40), &plane).unwrap();
            let found = [pose.leading_edge.z, pose.twist.unwrap().1.to_radians()];
            let expected = if is_rounding { 0.0 } else { small };
            assert!(found.iter().all(|found| (found - expected).abs() <= 1e-3 * expected), "{found:?}");
        }
    }

    /// The thickness x (1 - x)^2 is greatest at a third of the chord, with 4 / 27, and is known to
    /// 1e-5 of itself.
    ///
    /// Fails if `PLACES` is 100.
    #[test]
    fn the_thickness_is_known_between_the_places() {
        let n = 3000;
        let point = |i: i32| {
            let x = f64::from(i.abs()) / f64::from(n);
            DVec3::new(x, 0.0, 0.5 * f64::from(i.signum()) * x * (1.0 - x).powi(2))
        };
        let path: Vec<DVec3> = (-n..=n).map(point).collect();
        let found = thickness(&path, DVec3::ZERO, DVec3::X, DVec3::Y);
        assert!((found / (4.0 / 27.0) - 1.0).abs() < 1e-5, "{found}");
    }

    /// No placement has an oblique plane, or one across the chord's axis.
    #[test]
    fn other_planes_have_no_twist() {
        let placement = Placement { chord: 1.0, twist: 0.0, position: DVec3::ZERO, span: SpanAxis::Y };
        let mut profile = section(&placement, 0.0, 40);
        profile.points.iter_mut().for_each(|point| *point = DVec3::new(0.0, point.x, point.z));
        let pose = Pose::of(&profile, &Plane { point: DVec3::ZERO, normal: DVec3::X }).unwrap();
        assert_eq!(pose.twist, None);
        assert!((pose.chord - 1.0).abs() < 1e-4);
    }
}
