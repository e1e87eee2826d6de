//! A section as a smooth curve with two sides.
//!
//! The points of a profile lie on a smooth section, or on the facets of a mesh near one. Straight
//! lines between the points would bring the facets' corners into the displacement. So the curve is
//! the cubic spline through its knots, evaluated in small steps. The knots are the points, without
//! those that lie very close to a neighbour: a plane near a vertex makes such short pieces, whose
//! direction is noise.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::edges::{TrailingEdge, trailing_edge, trailing_edge_towards};
use super::path_boxes::PathBoxes;
use super::simple::crossing;
use super::{Plane, Profile, ProfileError, extent};

/// A point is no knot if its distance from a kept neighbour is less than this share of the spacing
/// around it. From 0.1 on the nose of a section of 26 points is lost, with an error of 1 % of the
/// chord in the match. Below 0.02 nothing changes.
const CLOSE: f64 = 0.03;

/// Least number of steps of a whole curve. With a leading edge of 1 % radius a step's chord is then
/// off the curve by at most h^2 / 8r = 5e-5 of the section's chord.
const STEPS: f64 = 1024.0;
/// Least and largest number of steps between two knots.
const STEPS_PER_PIECE: (f64, f64) = (4.0, 64.0);
/// The least number of steps between two knots shrinks where a curve would get more steps than
/// this, because many pieces are short and nearly straight.
const LEAST_STEPS_OF_ALL: f64 = 4.0 * STEPS;

/// An open section ends at the trailing edge on both sides: no point lies farther behind an end,
/// along the chord, than this share of the length, or than half the thickness of the base, which
/// may be oblique. A section that another body cuts short, or of one side of a wing, ends far
/// before the trailing edge on one side.
const BEHIND: f64 = 0.1;

/// The first point counts as repeated at the end if the two are closer than this share of the size.
const CLOSED: f64 = 1e-9;

/// A knot is a corner, at which the curve is not smooth, if the polygon turns there by more than
/// this angle in degrees. The leading edge of a coarse section turns by up to 90 degrees at one
/// point.
const CORNER: f64 = 100.0;

/// Places whose distance from the trailing edge is less than the largest one by less than this
/// share are leading edges as well. The two corners of a slab are; a section with a round leading
/// edge has one farthest place.
pub(super) const AS_FAR: f64 = 0.05;

/// Longest tangent of a piece, over its chord. A spline has tangents of length 1, and up to 1.3
/// where it turns by 90 degrees between two knots. Longer ones come from knots out of order; cut to
/// this length they make no loops.
pub(super) const LONGEST_TANGENT: f64 = 1.5;

/// The points of a profile in one direction, divided at the trailing edge.
#[derive(Clone, Debug)]
pub(super) struct Outline {
    /// Points from one side of the trailing edge round the leading edge to the other,
    /// counter-clockwise about the normal.
    pub sides: Vec<DVec3>,
    /// The base of a blunt trailing edge, if it is part of the curve: from the end of `sides` to
    /// its start. Otherwise empty.
    pub base: Vec<DVec3>,
    /// Whether the trailing edge is sharp: `sides` ends at its first point.
    pub joined: bool,
    /// The trailing edge of a closed profile, as places in its [`Ring`].
    pub edge: Option<TrailingEdge>,
    /// Whether the points run against their order in the [`Ring`].
    pub reversed: bool,
}

/// The distinct points of a profile. The first point of a closed one is not repeated.
pub(super) struct Ring {
    pub points: Vec<DVec3>,
    pub is_closed: bool,
}

impl Ring {
    /// The points of a profile.
    ///
    /// # Errors
    /// The errors of points that are no profile.
    pub fn of(profile: &Profile) -> Result<Self, ProfileError> {
        let mut points = profile.distinct_points()?;
        let size = extent(&points);
        let is_closed = points.len() > 3 && points[0].distance(points[points.len() - 1]) <= CLOSED * size;
        if is_closed {
            points.pop();
        }
        Ok(Self { points, is_closed })
    }
}

impl Outline {
    /// Divides a profile at the trailing edge.
    ///
    /// - `plane`: plane of the profile; the sides run counter-clockwise about its normal
    /// - `towards`: from the leading edge to the trailing edge of a closed profile; `None` if its
    ///   shape tells
    ///
    /// # Errors
    /// [`ProfileError::CrossesItself`], [`ProfileError::NotInOrder`],
    /// [`ProfileError::ProfileCutShort`], and the errors of points that are no profile.
    pub fn towards(profile: &Profile, plane: &Plane, towards: Option<DVec3>) -> Result<Self, ProfileError> {
        let Ring { points, is_closed } = Ring::of(profile)?;
        let of_ring = |points: &[DVec3]| match towards {
            Some(back) => trailing_edge_towards(points, back),
            None => trailing_edge(points),
        };
        let edge = is_closed.then(|| of_ring(&points));
        Self::divided(profile.number, points, edge, plane)
    }

    /// Divides a new profile at its trailing edge. If its shape leaves a doubt, its chord points as
    /// the old one.
    ///
    /// - `back`: from the leading edge to the trailing edge of the old section
    ///
    /// # Errors
    /// As [`Outline::towards`].
    pub fn like(profile: &Profile, plane: &Plane, back: DVec3) -> Result<Self, ProfileError> {
        let Ring { points, is_closed } = Ring::of(profile)?;
        let edge = is_closed.then(|| match trailing_edge(&points) {
            edge if edge.is_sure || edge.back.dot(back) > 0.0 => edge,
            _ => trailing_edge_towards(&points, back),
        });
        Self::divided(profile.number, points, edge, plane)
    }

    /// Divides points at a trailing edge.
    ///
    /// - `edge`: the edge of a closed curve, whose first point is not repeated; `None` if the curve
    ///   is open
    ///
    /// # Errors
    /// As [`Outline::towards`].
    pub fn divided(
        number: i64,
        mut points: Vec<DVec3>,
        edge: Option<TrailingEdge>,
        plane: &Plane,
    ) -> Result<Self, ProfileError> {
        let clockwise = twice_area(&points).dot(plane.normal) < 0.0;
        let closed = edge.is_some();
        let mut outline = if let Some(te) = edge {
            let n = points.len();
            points.rotate_left(te.start);
            points.push(points[0]);
            if te.end == te.start {
                Self { sides: points, base: Vec::new(), joined: true, edge, reversed: false }
            } else {
                let base = points.split_off((te.end + n - te.start) % n);
                points.push(base[0]);
                Self { sides: points, base, joined: false, edge, reversed: false }
            }
        } else {
            Self { sides: points, base: Vec::new(), joined: false, edge, reversed: false }
        };
        if clockwise {
            outline.sides.reverse();
            outline.base.reverse();
            outline.reversed = true;
        }
        if let Some(at) = disorder(&outline.sides) {
            return Err(ProfileError::NotInOrder { profile: number, at });
        }
        if let Some(at) = (!closed).then(|| short_end(&outline.sides)).flatten() {
            return Err(ProfileError::ProfileCutShort { profile: number, at });
        }
        match crossing(&outline.sides, plane) {
            Some(at) => Err(ProfileError::CrossesItself { profile: number, at }),
            None => Ok(outline),
        }
    }

    /// Number of its points. A common end of the sides and of the base counts once, and so does the
    /// end that joined sides share.
    pub fn n_points(&self) -> usize {
        let closing = usize::from(self.joined || !self.base.is_empty());
        self.sides.len() + self.base.len().saturating_sub(1) - closing
    }

    /// The places in the ring of the points of the sides and of the base, if all points of the
    /// outline are points of the ring.
    ///
    /// - `n`: points of the ring
    pub fn places(&self, n: usize) -> [Vec<usize>; 2] {
        let start = self.edge.map_or(0, |edge| edge.start);
        let [mut sides, mut base] = [&self.sides, &self.base].map(|points| (0..points.len()).collect::<Vec<_>>());
        base.iter_mut().for_each(|place| *place += sides.len() - 1);
        for places in [&mut sides, &mut base] {
            places.iter_mut().for_each(|place| *place = (*place + start) % n);
            if self.reversed {
                places.reverse();
            }
        }
        [sides, base]
    }

    /// Distance between the ends of the sides, in the mesh's unit.
    pub fn gap(&self) -> f64 {
        self.sides[0].distance(self.sides[self.sides.len() - 1])
    }
}

/// A turn by more than this angle, in degrees, is a turn back.
const BACK: f64 = 120.0;
/// Most turns back of a section. It turns back at its leading edge if that is a corner, at its
/// trailing edge if it starts elsewhere, and perhaps once at points that lie close together.
const TURNS_BACK: usize = 3;

/// The first turn back of a curve that turns back too often, as points do that are sorted by a
/// coordinate.
fn disorder(points: &[DVec3]) -> Option<DVec3> {
    let back = BACK.to_radians().cos();
    let turns = points.windows(3).filter(|corner| {
        let [before, after] = [corner[1] - corner[0], corner[2] - corner[1]].map(DVec3::normalize_or_zero);
        before.dot(after) < back
    });
    let turns: Vec<DVec3> = turns.map(|corner| corner[1]).collect();
    (turns.len() > TURNS_BACK).then(|| turns[0])
}

/// A smooth curve through knots, in small steps.
#[derive(Clone, Debug)]
pub(super) struct ProfileCurve {
    /// Indices of the points that are knots, ascending, including the first and the last point.
    pub knots: Vec<usize>,
    /// Index in `path` of each knot.
    pub knot_step: Vec<usize>,
    /// The points of the curve in small steps.
    pub path: Vec<DVec3>,
}

impl ProfileCurve {
    /// The curve through at least two points.
    pub fn new(points: &[DVec3]) -> Self {
        let knots = choose_knots(points);
        let at: Vec<DVec3> = knots.iter().map(|&i| points[i]).collect();
        let lengths: Vec<f64> = at.windows(2).map(|pair| pair[0].distance(pair[1])).collect();
        let total: f64 = lengths.iter().sum();
        let chords: Vec<DVec3> = at.windows(2).map(|pair| (pair[1] - pair[0]).normalize_or_zero()).collect();
        let tangents = tangents(&chords, &lengths);
        let least = (LEAST_STEPS_OF_ALL / lengths.len() as f64).ceil().clamp(1.0, STEPS_PER_PIECE.0);
        let mut path = Vec::new();
        let mut knot_step = vec![0];
        for (i, &length) in lengths.iter().enumerate() {
            let [start, end] = tangents[i].map(|tangent| tangent * length);
            // `max` first: the share of a curve without length is NaN, and it still gets its steps.
            let steps = (STEPS * length / total).ceil().max(least).min(STEPS_PER_PIECE.1);
            for step in 0..steps as usize {
                let t = step as f64 / steps;
                let (u, v) = (t * t, 1.0 - t);
                path.push(at[i] + (at[i + 1] - at[i]) * (u * (3.0 - 2.0 * t)) + start * (t * v * v) - end * (u * v));
            }
            knot_step.push(path.len());
        }
        path.extend(at.last());
        Self { knots, knot_step, path }
    }
}

/// Tangents at both ends of each piece, from the cubic spline through the knots (second derivative
/// continuous, zero at the ends). Each part between two corners has a spline of its own.
fn tangents(chords: &[DVec3], lengths: &[f64]) -> Vec<[DVec3; 2]> {
    let mut pieces = Vec::with_capacity(chords.len());
    let mut start = 0;
    for i in 1..=chords.len() {
        if i == chords.len() || is_corner(chords[i - 1], chords[i]) {
            let smooth = spline(&chords[start..i], &lengths[start..i]);
            pieces.extend(smooth.windows(2).map(|pair| [pair[0], pair[1]]));
            start = i;
        }
    }
    pieces
}

/// Whether the curve is not smooth between two pieces with these unit chords.
pub(super) fn is_corner(before: DVec3, after: DVec3) -> bool {
    before.dot(after) < CORNER.to_radians().cos()
}

/// Tangents of the natural cubic spline over pieces with given lengths and directions, by
/// elimination.
fn spline(chords: &[DVec3], lengths: &[f64]) -> Vec<DVec3> {
    let n = chords.len();
    // Row i of the system: `lower m[i-1] + diagonal m[i] + upper m[i+1] = value`.
    let row = |i: usize| match i {
        0 => (0.0, 2.0, 1.0, chords[0] * 3.0),
        _ if i == n => (1.0, 2.0, 0.0, chords[n - 1] * 3.0),
        _ => {
            let (l, r) = (1.0 / lengths[i - 1], 1.0 / lengths[i]);
            (l, 2.0 * (l + r), r, (chords[i - 1] * l + chords[i] * r) * 3.0)
        }
    };
    let (mut upper, mut m) = (vec![0.0; n + 1], vec![DVec3::ZERO; n + 1]);
    for i in 0..=n {
        let (l, d, u, value) = row(i);
        let (before, m_before) = if i == 0 { (0.0, DVec3::ZERO) } else { (upper[i - 1], m[i - 1]) };
        let pivot = d - l * before;
        upper[i] = u / pivot;
        m[i] = (value - m_before * l) / pivot;
    }
    for i in (0..n).rev() {
        m[i] = m[i] - m[i + 1] * upper[i];
    }
    m.into_iter().map(|m| m.clamp_length_max(LONGEST_TANGENT)).collect()
}

/// Indices of the points that become knots. Of two points too close together, the one with the
/// nearer other neighbour is removed, the closest pair first. A curve in the other direction has
/// the same knots.
fn choose_knots(points: &[DVec3]) -> Vec<usize> {
    let n = points.len();
    let lengths: Vec<f64> = points.windows(2).map(|pair| pair[0].distance(pair[1])).collect();
    let spacing = |i: usize| lengths[i.saturating_sub(2)..(i + 2).min(n - 1)].iter().copied().fold(0.0, f64::max);
    let spacings: Vec<f64> = (0..n).map(spacing).collect();
    let gap = |a: usize, b: usize| points[a].distance(points[b]);
    // Lengths below 1e-154 have a square of zero.
    let share = |a: usize, b: usize| if gap(a, b) > 0.0 { gap(a, b) / spacings[a].max(spacings[b]) } else { 0.0 };
    // The knot before and after each knot. The queue has the pairs that are too close, each by its
    // later knot, the closest pair first, and of equal ones the first pair.
    let mut before: Vec<Option<usize>> = (0..n).map(|i| i.checked_sub(1)).collect();
    let mut after: Vec<Option<usize>> = (0..n).map(|i| Some(i + 1).filter(|&next| next < n)).collect();
    let mut queue = BinaryHeap::new();
    // Shares are not negative, so their bits are in their order.
    let close = |a: usize, b: usize| Some(share(a, b)).filter(|&share| share < CLOSE).map(f64::to_bits);
    queue.extend((1..n).filter_map(|b| Some(Reverse((close(b - 1, b)?, b, b - 1)))));
    let mut is_knot = vec![true; n];
    let mut left = n;
    while left > 2
        && let Some(Reverse((_, b, a))) = queue.pop()
    {
        // A pair of which one point is gone.
        if !(is_knot[a] && is_knot[b]) {
            continue;
        }
        let to = |from: usize, other: Option<usize>| other.map_or(f64::INFINITY, |other| gap(from, other));
        let removed = if to(a, before[a]) < to(b, after[b]) { a } else { b };
        is_knot[removed] = false;
        left -= 1;
        let (previous, next) = (before[removed], after[removed]);
        previous.into_iter().for_each(|previous| after[previous] = next);
        next.into_iter().for_each(|next| before[next] = previous);
        if let (Some(previous), Some(next)) = (previous, next) {
            queue.extend(close(previous, next).map(|share| Reverse((share, next, previous))));
        }
    }
    (0..n).filter(|&i| is_knot[i]).collect()
}

/// A curve with arc length and common parameter at each step.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    /// Points of the curve `[n_steps]`, in the mesh's unit.
    pub path: Vec<DVec3>,
    /// Arc length from the start `[n_steps]`, in the mesh's unit.
    pub s: Vec<f64>,
    /// Common parameter at each step `[n_steps]`, ascending, without unit.
    pub tau: Vec<f64>,
}

impl Measured {
    /// Measures the two sides: tau is 0 at the start, 1 at the leading edge and 2 at the end.
    ///
    /// The leading edge is the point farthest from the middle of the trailing edge. The two corners
    /// of a blunt leading edge are about as far; there it lies between them. Along a side
    /// tau is the mean of two shares: of the arc length, and of the decrease of the distance from
    /// the trailing edge. The arc length alone shifts when the thickness changes. The distance
    /// alone is constant at the leading edge.
    pub fn sides(path: Vec<DVec3>) -> Self {
        let s = arc_length(&path);
        let n = path.len();
        let te = (path[0] + path[n - 1]) / 2.0;
        let d: Vec<f64> = path.iter().map(|p| p.distance(te)).collect();
        let (le_s, le_d) = leading_edge(&s, &d);
        let mut tau = vec![1.0; n];
        let mut measure = |steps: &mut dyn Iterator<Item = usize>, te_s: f64, te_d: f64, sign: f64| {
            let mut nearest: f64 = 0.0;
            for j in steps {
                let arc = ((s[j] - le_s) / (te_s - le_s)).clamp(0.0, 1.0);
                let chord = (le_d - d[j]) / (le_d - te_d);
                nearest = nearest.max(if chord.is_finite() { chord.clamp(0.0, 1.0) } else { arc });
                tau[j] = 1.0 + sign * (0.5 * arc + 0.5 * nearest);
            }
        };
        let middle = s.partition_point(|&x| x < le_s);
        measure(&mut (0..middle).rev(), s[0], d[0], -1.0);
        measure(&mut (middle..n), s[n - 1], d[n - 1], 1.0);
        Self { path, s, tau }
    }

    /// Measures a base: tau runs from 2 to 3 by arc length.
    pub fn base(path: Vec<DVec3>) -> Self {
        let s = arc_length(&path);
        let total = s.last().copied().unwrap_or(0.0);
        let tau = s.iter().map(|x| if total > 0.0 { 2.0 + x / total } else { 2.0 }).collect();
        Self { path, s, tau }
    }

    /// The point at a parameter.
    pub fn point(&self, tau: f64) -> DVec3 {
        let (i, t) = bracket(&self.tau, tau);
        self.path[i].lerp(self.path[i + 1], t)
    }

    /// The parameter of the point nearest to `at`, between two parameters.
    ///
    /// - `boxes`: of the path
    pub fn nearest(&self, boxes: &PathBoxes, at: DVec3, between: [f64; 2]) -> f64 {
        let (step, t) = self.nearest_step(boxes, at, between);
        self.tau[step] + (self.tau[step + 1] - self.tau[step]) * t
    }

    /// The step with the point nearest to `at`, and the share of the step before this point.
    pub fn nearest_step(&self, boxes: &PathBoxes, at: DVec3, between: [f64; 2]) -> (usize, f64) {
        let n = self.path.len();
        let first = self.tau.partition_point(|&tau| tau < between[0]).clamp(1, n - 1);
        let last = self.tau.partition_point(|&tau| tau <= between[1]).clamp(first, n - 1);
        boxes.nearest(&self.path, at, first - 1..last)
    }

    /// The point at a parameter, and the unit tangent there.
    pub fn point_and_tangent(&self, tau: f64) -> (DVec3, DVec3) {
        let (i, t) = bracket(&self.tau, tau);
        (self.path[i].lerp(self.path[i + 1], t), (self.path[i + 1] - self.path[i]).normalize_or_zero())
    }

    /// The arc length at a parameter, in the mesh's unit.
    pub fn arc(&self, tau: f64) -> f64 {
        let (i, t) = bracket(&self.tau, tau);
        self.s[i] + (self.s[i + 1] - self.s[i]) * t
    }
}

/// Arc length and distance from the trailing edge at the leading edge.
///
/// The weights of equally far places make the leading edge change continuously with the section.
/// One of two corners alone would be chosen by rounding.
///
/// - `s`, `d` `[n_steps]`: arc length, and distance from the middle of the trailing edge
pub(super) fn leading_edge(s: &[f64], d: &[f64]) -> (f64, f64) {
    let n = s.len();
    let i = (0..n).max_by(|&a, &b| d[a].total_cmp(&d[b])).unwrap_or(0).clamp(1, n.saturating_sub(2).max(1));
    let least = d[i] * (1.0 - AS_FAR);
    let is_peak = |j: &usize| d[*j] >= d[j - 1] && d[*j] > d[j + 1] && d[*j] > least;
    let peaks: Vec<usize> = (1..n.saturating_sub(1)).filter(is_peak).collect();
    if peaks.len() > 1 {
        let weight: f64 = peaks.iter().map(|&j| d[j] - least).sum();
        let le_s = peaks.iter().map(|&j| (d[j] - least) * s[j]).sum::<f64>() / weight;
        let (step, t) = bracket(s, le_s);
        return (le_s, d[step] + (d[step + 1] - d[step]) * t);
    }
    if n < 3 {
        return (s[i], d[i]);
    }
    // Vertex of the parabola through the farthest step and its neighbours.
    let (left, right) = (s[i] - s[i - 1], s[i + 1] - s[i]);
    let (before, after) = ((d[i] - d[i - 1]) / left, (d[i + 1] - d[i]) / right);
    let curvature = (after - before) / (left + right);
    let slope = (before * right + after * left) / (left + right);
    let shift = -slope / (2.0 * curvature);
    if !shift.is_finite() {
        return (s[i], d[i]);
    }
    let shift = shift.max(-0.5 * left).min(0.5 * right);
    (s[i] + shift, d[i] + (slope * shift + curvature * shift * shift))
}

pub(super) fn arc_length(path: &[DVec3]) -> Vec<f64> {
    let mut s = vec![0.0];
    s.extend(path.windows(2).scan(0.0, |sum, pair| {
        *sum += pair[0].distance(pair[1]);
        Some(*sum)
    }));
    s
}

/// The interval of ascending `values` (at least two) that contains `x`, and the share of the
/// interval before `x`, 0 to 1.
pub(super) fn bracket(values: &[f64], x: f64) -> (usize, f64) {
    let i = values.partition_point(|&v| v <= x).clamp(1, values.len() - 1) - 1;
    let gap = values[i + 1] - values[i];
    (i, if gap > 0.0 { ((x - values[i]) / gap).clamp(0.0, 1.0) } else { 0.0 })
}

/// The end of an open curve that is not at the trailing edge, if there is one.
pub(super) fn short_end(curve: &[DVec3]) -> Option<DVec3> {
    let Behind { end, by, length, base } = behind(curve)?;
    (by > f64::max(BEHIND * length, base / 2.0)).then_some(end)
}

/// How far an open curve reaches behind one of its ends, along its chord. Lengths are in the mesh's
/// unit.
pub(super) struct Behind {
    /// The end that lies farther before the rear.
    pub end: DVec3,
    /// Its distance from the rear.
    pub by: f64,
    /// Length of the curve.
    pub length: f64,
    /// Thickness between the two ends.
    pub base: f64,
}

/// The end of an open curve that lies farther before its rear. `None` for a curve without length.
pub(super) fn behind(curve: &[DVec3]) -> Option<Behind> {
    let (&first, &last) = (curve.first()?, curve.last()?);
    let middle = (first + last) / 2.0;
    let farther = |far: DVec3, &point: &DVec3| {
        if point.distance_squared(middle) > far.distance_squared(middle) { point } else { far }
    };
    let leading = curve.iter().fold(middle, farther);
    let chord = (middle - leading).try_normalize()?;
    let rear = curve.iter().map(|point| point.dot(chord)).fold(f64::NEG_INFINITY, f64::max);
    let length = rear - leading.dot(chord);
    let end = if first.dot(chord) < last.dot(chord) { first } else { last };
    let base = (last - first).reject_from_normalized(chord).length();
    Some(Behind { end, by: rear - end.dot(chord), length, base })
}

/// Twice the area vector of a curve, closed by a straight line from its end to its start.
pub(super) fn twice_area(curve: &[DVec3]) -> DVec3 {
    let Some(&origin) = curve.first() else { return DVec3::ZERO };
    curve.windows(2).map(|pair| (pair[0] - origin).cross(pair[1] - origin)).sum()
}

#[cfg(test)]
mod tests;
