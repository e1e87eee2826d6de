//! Finds the trailing edge of a closed section.
//!
//! The leading and the trailing edge are the two ends of a section's greatest length. An end with
//! two corners of about 90 degrees close together is a base. Neither the first point nor the
//! direction of the points matters.
//!
//! | the two ends | the trailing edge is |
//! |---|---|
//! | one is clearly thinner, and the other is no base | the thinner end |
//! | one is a base, and the other is thinner or as thin | the base, unless the area lies nearer to it and its sides open as those of a coarse nose |
//! | one is such a base whose sides do not open, and the other is sharp: a wedge, or a plate with a sharp edge | in doubt |
//! | as thin as each other, both sharp: a diamond or a lens | in doubt |
//! | as thin as each other, any others | the end that is clearly farther from the centre of the area, then a sharp end before a round one |
//! | as thin as each other, in all of this | in doubt |
//!
//! In doubt the trailing edge is the end with the greater x, because most meshes have their flow
//! along +x. A caller that knows better, from other sections of the wing or from the old section of
//! a new one, gives the direction to the trailing edge.
//!
//! The corners near this end divide the curve: one sharp corner is a sharp trailing edge. Two
//! corners are a blunt trailing edge, with its base between them. Without corners the trailing edge
//! is round and starts at the farthest point.

use glam::DVec3;

/// The trailing edge of a closed section. `start` and `end` are the indices of its two corners.
/// From `start` the curve runs forward round the leading edge to `end`. A blunt base runs forward
/// from `end` to `start`. At a sharp trailing edge the two indices are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TrailingEdge {
    pub start: usize,
    pub end: usize,
    /// Whether the turns of the curve leave no doubt. At a round edge of few points they do: each
    /// point turns about as much as a corner.
    pub is_clear: bool,
    /// Whether the shape tells the trailing edge from the leading edge.
    pub is_sure: bool,
    /// From the leading edge to the trailing edge, in the curve's unit.
    pub back: DVec3,
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

/// Two ends count as alike (a diamond) if their thicknesses differ by less than this factor.
const ALIKE: f64 = 1.3;

/// The centre of the area is clearly nearer to one end if it is off the middle by this share of the
/// length. A NACA section has it 0.08 before the middle, and 0.045 with a base of 3 %.
const OFF_MIDDLE: f64 = 0.02;

/// An end is a base if its sides open by at most this angle in degrees, and if it is thinner than
/// this share of the length. Two points of a coarse nose open by 40 degrees and more, of a thin
/// section by less.
const OPENING: f64 = 45.0;
const THICK: f64 = 0.2;
/// Sides that open by less than this angle, in degrees, are those of a wedge or of a plate.
const PARALLEL: f64 = 5.0;
/// The sides of a coarse nose open by more than this angle, in degrees: by 22 at a section 5 %
/// thick.
const COARSE: f64 = 12.0;
/// The centre of the area is nearer to a round nose than the middle by about this share of the
/// length: by 0.08 for a NACA section.
const OF_NOSE: f64 = 0.06;

/// Least turn of a sharp trailing edge, in degrees: an edge angle of at most 55 degrees. A square
/// base turns twice by 90.
const SHARP: f64 = 125.0;
/// Least turn of a corner of a blunt trailing edge, in degrees.
pub(super) const CORNER: f64 = 40.0;

/// The turns at corners are clear if the next turn near the edge is below this share of the least
/// of them.
const CLEAR: f64 = 0.5;

/// Finds the trailing edge of a closed curve of at least three different points by its shape. The
/// first point is not repeated.
pub(super) fn trailing_edge(points: &[DVec3]) -> TrailingEdge {
    let [p, q] = ends(points);
    let [one, other] = [edge_at(points, p, q), edge_at(points, q, p)];
    let along_x = points[p].x > points[q].x;
    let by_x = || (along_x, false);
    let widths = [width(points, p, q), width(points, q, p)];
    // Positive if the centre of the area is nearer to q, as a share of the length.
    let axis = points[q] - points[p];
    let off = (centre(points) - points[p]).dot(axis) / axis.length_squared() - 0.5;
    // Whether a base is the trailing edge, if it is not thinner than the other end. `None` is a
    // doubt. The area is nearer to it by a share of the length.
    let of_base = |opening: f64, nearer: f64, end: End| match end {
        End::Sharp if opening < PARALLEL => None,
        _ if nearer <= OFF_MIDDLE => Some(true),
        _ => Some(opening < COARSE && nearer < OF_NOSE),
    };
    let is_alike = widths[0] <= ALIKE * widths[1] && widths[1] <= ALIKE * widths[0];
    let p_is_thinner = widths[0] < widths[1];
    let (is_p, is_sure) = match (one.1, other.1) {
        (End::Base(opening), end) if !matches!(end, End::Base(_)) && (is_alike || !p_is_thinner) => {
            of_base(opening, -off, end).map_or_else(by_x, |is_base| (is_base, true))
        }
        (end, End::Base(opening)) if !matches!(end, End::Base(_)) && (is_alike || p_is_thinner) => {
            of_base(opening, off, end).map_or_else(by_x, |is_base| (!is_base, true))
        }
        _ if !is_alike => (p_is_thinner, true),
        (End::Sharp, End::Sharp) => by_x(),
        _ if off.abs() > OFF_MIDDLE => (off > 0.0, true),
        (End::Sharp, End::Round) => (true, true),
        (End::Round, End::Sharp) => (false, true),
        _ => by_x(),
    };
    TrailingEdge { is_sure, ..if is_p { one.0 } else { other.0 } }
}

/// The trailing edge of a closed curve at the end in a direction, whatever the shape.
///
/// - `back`: from the leading edge to the trailing edge
pub(super) fn trailing_edge_towards(points: &[DVec3], back: DVec3) -> TrailingEdge {
    let [p, q] = ends(points);
    let [te, le] = if (points[p] - points[q]).dot(back) > 0.0 { [p, q] } else { [q, p] };
    edge_at(points, te, le).0
}

/// The thinner end of a curve. Of two ends that are alike, the one nearer to the first point.
pub(super) fn thinner_end(points: &[DVec3]) -> usize {
    let [p, q] = ends(points);
    let first_is_nearer = points[0].distance_squared(points[p]) <= points[0].distance_squared(points[q]);
    let (near, other) = if first_is_nearer { (p, q) } else { (q, p) };
    if width(points, near, other) <= ALIKE * width(points, other, near) { near } else { other }
}

/// The two ends of a curve's greatest length.
fn ends(points: &[DVec3]) -> [usize; 2] {
    let centre = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    let far = farthest(points, points[farthest(points, centre)]);
    [farthest(points, points[far]), far]
}

/// The form of an end of a section.
#[derive(Clone, Copy, Debug, PartialEq)]
enum End {
    /// One sharp corner.
    Sharp,
    /// Two corners with a base between them, and the angle by which the sides open, in degrees.
    Base(f64),
    /// Neither.
    Round,
}

/// The trailing edge of a closed curve, if it is at the end `te`, and the form of this end.
fn edge_at(points: &[DVec3], te: usize, le: usize) -> (TrailingEdge, End) {
    let n = points.len();
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
    let edge = |start, end, is_clear| TrailingEdge { start, end, is_clear, is_sure: true, back: -axis };
    match corners[..] {
        [(first, a), (second, b), ..] if first < SHARP && second >= CORNER && first + second >= SHARP => {
            // Of the two ways between the corners, the base is the one without the leading edge.
            let le_after_a = (le + n - a) % n < (b + n - a) % n;
            let (start, end) = if le_after_a { (a, b) } else { (b, a) };
            let opening = 180.0 - first - second;
            let is_base = clear(2) && opening <= OPENING && points[a].distance(points[b]) <= THICK * length;
            (edge(start, end, clear(2)), if is_base { End::Base(opening) } else { End::Round })
        }
        [(first, a), ..] if first >= CORNER => {
            (edge(a, a, clear(1)), if first >= SHARP { End::Sharp } else { End::Round })
        }
        _ => (edge(te, te, false), End::Round),
    }
}

/// The centre of the area within a plane closed curve.
fn centre(points: &[DVec3]) -> DVec3 {
    let of_pair = |pair: &[DVec3]| (pair[0] - points[0]).cross(pair[1] - points[0]);
    let normal = points.windows(2).map(of_pair).sum::<DVec3>().normalize_or_zero();
    let (mut area, mut moment) = (0.0, DVec3::ZERO);
    for pair in points.windows(2) {
        let of_triangle = of_pair(pair).dot(normal);
        area += of_triangle;
        moment += (pair[0] + pair[1] - 2.0 * points[0]) * (of_triangle / 3.0);
    }
    if area > 0.0 { points[0] + moment / area } else { points.iter().sum::<DVec3>() / points.len() as f64 }
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
        let TrailingEdge { start, end, is_clear, is_sure, .. } = trailing_edge(&section);
        assert_eq!((start, end, is_clear, is_sure), (0, 8, true, true));
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
        let TrailingEdge { start, end, is_clear, .. } = trailing_edge(&section);
        assert_eq!((start, end, is_clear), (0, 0, false));
    }

    /// A NACA section of 12 % with a base, at few stations.
    fn airfoil(stations: &[f64], base: f64) -> Vec<(f64, f64)> {
        let half = |x: f64| {
            let round = 0.2969 * x.sqrt() - 0.126 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1036 * x.powi(4);
            0.6 * round + 0.5 * base * x
        };
        let lower = stations.iter().rev().map(|&x| (x, -half(x)));
        let upper = stations.iter().filter(|&&x| half(x) > 0.0).map(|&x| (x, half(x)));
        lower.chain(upper.filter(|&(x, _)| x < 1.0 || base > 0.0)).collect()
    }

    /// The trailing edge is at x = 1 for every first point, in both directions, and when the
    /// section is turned by any angle. Sections: a coarse airfoil with bases of 3 % and 8 % of the
    /// chord, one whose nose is a facet and whose edge is sharp, and sharp noses before a base.
    ///
    /// Fails if the thinner end counts without its form, or in doubt the end near the first point.
    #[test]
    fn a_base_is_found_from_any_start() {
        let coarse = [0.0, 0.08, 0.2, 0.4, 0.6, 0.8, 1.0];
        let faceted = [0.012, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0];
        let hexagon = |base: f64| {
            vec![(1.0, -base), (0.7, -0.025), (0.3, -0.025), (0.0, 0.0), (0.3, 0.025), (0.7, 0.025), (1.0, base)]
        };
        let sections = [
            airfoil(&coarse, 0.03),
            airfoil(&coarse, 0.08),
            airfoil(&faceted, 0.0),
            airfoil(&faceted, 0.03),
            hexagon(0.0075),
            hexagon(0.002),
        ];
        for (k, section) in sections.iter().enumerate() {
            let section = points(section);
            let n = section.len();
            for degrees in [0.0, 60.0, 175.0, 270.0] {
                let turn = glam::DQuat::from_rotation_y(f64::to_radians(degrees));
                for start in 0..n {
                    let mut ring: Vec<DVec3> = section.iter().map(|&at| turn * at).collect();
                    ring.rotate_left(start);
                    for _ in 0..2 {
                        ring.reverse();
                        let TrailingEdge { start, end, is_sure, back, .. } = trailing_edge(&ring);
                        let corners = [start, end].map(|corner| turn.inverse() * ring[corner]);
                        assert!(
                            is_sure && corners.iter().all(|at| at.x == 1.0 || at.x > 1.0 - 1e-12),
                            "{k} {corners:?}"
                        );
                        assert!((turn.inverse() * back).x > 0.8, "{k} {back}");
                        // The start is the first point after the base.
                        assert_eq!(start == end, k == 2, "{k}");
                    }
                }
            }
        }
    }

    /// A diamond and a lens look alike from both sides: their trailing edge is at the greater x,
    /// for every first point and in both directions, and a caller may say another direction.
    ///
    /// Fails if in doubt the end near the first point is the trailing edge.
    #[test]
    fn in_doubt_the_trailing_edge_has_the_greater_x() {
        let diamond = vec![(1.0, 0.0), (0.75, 0.02), (0.5, 0.04), (0.0, 0.0), (0.5, -0.04), (0.75, -0.02)];
        let lens = [1.0, 0.9, 0.7, 0.5, 0.3, 0.1, 0.0].map(|x: f64| (x, 0.2 * x * (1.0 - x)));
        for section in [points(&diamond), symmetric(&lens)] {
            for start in 0..section.len() {
                let mut ring = section.clone();
                ring.rotate_left(start);
                for _ in 0..2 {
                    ring.reverse();
                    let edge = trailing_edge(&ring);
                    assert!(!edge.is_sure && ring[edge.start].x == 1.0 && edge.start == edge.end, "{edge:?}");
                    let other = trailing_edge_towards(&ring, DVec3::new(-1.0, 0.0, 0.1));
                    assert!(ring[other.start].x == 0.0, "{other:?}");
                }
            }
        }
    }

    /// Both ends of an oval are round and alike, so the side of its thicker half tells the leading
    /// edge: not if the centre of its area is 1 % off the middle, but if it is 4 % off.
    ///
    /// Fails if `OFF_MIDDLE` is 0.002 or 0.2.
    #[test]
    fn an_oval_has_its_leading_edge_at_the_thicker_half() {
        for (share, is_told) in [(0.01, false), (0.04, true)] {
            for towards in [-1.0, 1.0] {
                let at = |degrees: f64| {
                    let (sin, cos) = degrees.to_radians().sin_cos();
                    let x = 0.5 - 0.5 * cos;
                    // The centre of the area is 0.1545 times this share off the middle.
                    let thicker = 1.0 + share / 0.1545 * towards * (std::f64::consts::TAU * x).sin();
                    (x, 0.1 * sin * thicker)
                };
                let oval = points(&(0..72).map(|k| at(5.0 * f64::from(k) + 1.0)).collect::<Vec<_>>());
                let off = 0.5 - centre(&oval).x;
                assert!((off / (towards * share) - 1.0).abs() < 0.02, "{off}");
                let found = trailing_edge(&oval);
                assert_eq!(found.is_sure, is_told, "{share}");
                if is_told {
                    assert_eq!(oval[found.start].x > 0.5, towards > 0.0);
                }
            }
        }
    }
}
