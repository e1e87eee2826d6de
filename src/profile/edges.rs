//! Finds the trailing edge of a closed section.
//!
//! The leading and the trailing edge are the two ends of a section's greatest length, and the
//! trailing edge is the thinner end. The corners near this end decide: one sharp corner is a sharp
//! trailing edge. Two corners are a blunt trailing edge, with its base between them. Without
//! corners the trailing edge is round and starts at the farthest point.

use glam::DVec3;

/// The trailing edge of a closed section. `start` and `end` are the indices of its two corners.
/// From `start` the curve runs forward round the leading edge to `end`. A blunt base runs forward
/// from `end` to `start`. At a sharp trailing edge the two indices are equal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TrailingEdge {
    pub start: usize,
    pub end: usize,
    /// Whether the turns of the curve leave no doubt. At a round edge of few points they do: each
    /// point turns about as much as a corner.
    pub is_clear: bool,
}

impl TrailingEdge {
    /// Whether another curve with as many points has its edge at the same points.
    pub fn is_at(&self, other: &Self) -> bool {
        (self.start, self.end) == (other.start, other.end)
    }
}

/// Corners are searched within this share of the section's length from its end. Blunt trailing
/// edges are up to about 3 % thick and may be oblique. At 10 % the kink of a flap could count as a
/// corner.
const REACH: f64 = 0.06;

/// The thickness of the two ends is compared at this share of the length. There a NACA section is 4
/// to 6 times thicker at the leading edge.
const PROBE: f64 = 0.04;

/// Two ends count as alike (a diamond) if their thicknesses differ by less than this factor. Then
/// the end nearer to the first point is the trailing edge, because profile files begin there.
const ALIKE: f64 = 1.3;

/// Least turn of a sharp trailing edge, in degrees: an edge angle of at most 55 degrees. A square
/// base turns twice by 90.
const SHARP: f64 = 125.0;
/// Least turn of a corner of a blunt trailing edge, in degrees.
pub(super) const CORNER: f64 = 40.0;

/// The turns at corners are clear if the next turn near the edge is below this share of the least
/// of them.
const CLEAR: f64 = 0.5;

/// Finds the trailing edge of a closed curve of at least three different points. The first point is
/// not repeated.
pub(super) fn trailing_edge(points: &[DVec3]) -> TrailingEdge {
    let n = points.len();
    let centre = points.iter().sum::<DVec3>() / n.max(1) as f64;
    let far = farthest(points, points[farthest(points, centre)]);
    let (p, q) = (farthest(points, points[far]), far);
    let first_is_nearer = points[0].distance_squared(points[p]) <= points[0].distance_squared(points[q]);
    let (near, other) = if first_is_nearer { (p, q) } else { (q, p) };
    let (near_width, other_width) = (width(points, near, other), width(points, other, near));
    let (te, le) = if near_width <= ALIKE * other_width { (near, other) } else { (other, near) };

    let axis = points[le] - points[te];
    let length = axis.length();
    let within = |i: usize| (points[i] - points[te]).dot(axis) <= REACH * length * length;
    let mut region = vec![te];
    for step in [1, n - 1] {
        let mut i = (te + step) % n;
        while i != te && within(i) {
            region.push(i);
            i = (i + step) % n;
        }
    }
    region.sort_unstable();
    region.dedup();
    let mut corners: Vec<(f64, usize)> = region.into_iter().map(|i| (turn(points, i), i)).collect();
    corners.sort_by(|a, b| b.0.total_cmp(&a.0));
    let clear = |n: usize| corners.get(n).is_none_or(|&(next, _)| next < CLEAR * corners[n - 1].0);
    match corners[..] {
        [(first, a), (second, b), ..] if first < SHARP && second >= CORNER && first + second >= SHARP => {
            // Of the two ways between the corners, the base is the one without the leading edge.
            let le_after_a = (le + n - a) % n < (b + n - a) % n;
            let (start, end) = if le_after_a { (a, b) } else { (b, a) };
            TrailingEdge { start, end, is_clear: clear(2) }
        }
        [(first, a), ..] if first >= CORNER => TrailingEdge { start: a, end: a, is_clear: clear(1) },
        _ => TrailingEdge { start: te, end: te, is_clear: false },
    }
}

/// The index of the point farthest from a place.
pub(super) fn farthest(points: &[DVec3], from: DVec3) -> usize {
    let key = |i: &usize| points[*i].distance_squared(from);
    (0..points.len()).max_by(|a, b| key(a).total_cmp(&key(b))).unwrap_or(0)
}

/// Thickness of a closed curve near its end `end`, measured towards `other`.
fn width(points: &[DVec3], end: usize, other: usize) -> f64 {
    let n = points.len();
    let axis = points[other] - points[end];
    let along = |i: usize| (points[i] - points[end]).dot(axis) / axis.length_squared();
    let crossing = |step: usize| {
        let mut i = end;
        for _ in 0..n {
            let next = (i + step) % n;
            let (a, b) = (along(i), along(next));
            if b > PROBE {
                return points[i].lerp(points[next], ((PROBE - a) / (b - a)).clamp(0.0, 1.0));
            }
            i = next;
        }
        points[other]
    };
    crossing(1).distance(crossing(n - 1))
}

/// Angle in degrees by which a closed curve turns at a point.
pub(super) fn turn(points: &[DVec3], i: usize) -> f64 {
    let n = points.len();
    let (before, after) = (points[i] - points[(i + n - 1) % n], points[(i + 1) % n] - points[i]);
    before.angle_between(after).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(corners: &[(f64, f64)]) -> Vec<DVec3> {
        corners.iter().map(|&(x, z)| DVec3::new(x, 0.0, z)).collect()
    }

    /// An oblique base: its lower corner stands 0.02 before the upper one. Both are corners of the
    /// trailing edge.
    ///
    /// Fails if `REACH` is 0.005.
    #[test]
    fn both_corners_of_an_oblique_base_are_found() {
        let section = points(&[
            (1.0, 0.03),
            (0.5, 0.06),
            (0.2, 0.06),
            (0.05, 0.04),
            (0.0, 0.0),
            (0.05, -0.04),
            (0.2, -0.06),
            (0.5, -0.06),
            (0.98, -0.02),
        ]);
        assert_eq!(trailing_edge(&section), TrailingEdge { start: 0, end: 8, is_clear: true });
    }

    /// The round end of a section whose sides are 0.024 apart, from its farthest point to the upper
    /// side. It turns by 15 to 25 degrees at a point, the most in the middle.
    fn round_end() -> Vec<(f64, f64)> {
        let at = |degrees: f64| (degrees.to_radians().cos(), degrees.to_radians().sin());
        [0.0, 20.0, 40.0, 70.0, 80.0].map(at).map(|(x, z)| (0.988 + 0.012 * x, 0.012 * z)).to_vec()
    }

    /// A section from its farthest point round to its farthest point, from its upper half.
    fn symmetric(upper: &[(f64, f64)]) -> Vec<DVec3> {
        let lower: Vec<(f64, f64)> = upper[1..].iter().rev().map(|&(x, z)| (x, -z)).filter(|at| at.1 != 0.0).collect();
        points(&[upper, &lower].concat())
    }

    /// A flap is down by 45 degrees over the last fifth, and its end is round: its kinks are no
    /// trailing edge, the end is.
    ///
    /// Fails if `REACH` is 0.3.
    #[test]
    fn the_kink_of_a_flap_is_no_trailing_edge() {
        let front = [(0.8, 0.012), (0.5, 0.05), (0.2, 0.06), (0.05, 0.04), (0.0, 0.0)];
        let mut section = symmetric(&[&round_end(), &front[..]].concat());
        let turn = glam::DQuat::from_rotation_y(std::f64::consts::FRAC_PI_4);
        let hinge = DVec3::new(0.8, 0.0, 0.0);
        section.iter_mut().filter(|at| at.x > 0.81).for_each(|at| *at = hinge + turn * (*at - hinge));
        let TrailingEdge { start, end, .. } = trailing_edge(&section);
        assert!(start == end && section[start].distance(section[0]) < 0.03, "{start} {end}");
    }

    /// No point of a round end is a corner, and the trailing edge is the farthest one.
    ///
    /// Fails if `CORNER` is 5.
    #[test]
    fn a_round_end_begins_at_its_farthest_point() {
        let front = [(0.96, 0.02), (0.5, 0.06), (0.2, 0.08), (0.05, 0.05), (0.0, 0.0)];
        let section = symmetric(&[&round_end(), &front[..]].concat());
        assert_eq!(trailing_edge(&section), TrailingEdge { start: 0, end: 0, is_clear: false });
    }
}
