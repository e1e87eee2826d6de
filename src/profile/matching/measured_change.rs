//! The derivative of a match by measure, through its iterations as they ran.
//!
//! The match is made once more on a [`Tape`], by the same formulas and with the same choices:
//! knots, steps, corners, the leading edge, the best turn, nearest steps. Within one set of choices
//! the match is smooth. Where a choice changes it jumps by 1e-7 to 5e-6 of the chord, which no
//! derivative shows.

use glam::DVec3;

use super::tape::{Number, Tape, Vector, constant, fixed, value};
use super::{CROWDED, Match, NEAR, NOTHING, OldSection, STRAIGHT, STRAIGHT_TURNS, TURNS};
use crate::profile::Profile;
use crate::profile::curve::{AS_FAR, LONGEST_TANGENT, Measured, ProfileCurve, bracket, is_corner};
use crate::profile::path_boxes::PathBoxes;
use crate::profile::tilt::Tilt;

/// Most steps of the curves of one match. Each takes about 300 bytes on the tape.
pub(super) const MOST_STEPS: usize = 200_000;

/// A match by measure on a tape.
pub(super) struct MeasuredChange {
    tape: Tape,
    /// The place of each knot on the new profile.
    pub targets: Vec<Vector>,
}

impl MeasuredChange {
    /// - `places`: in the new profile, of the points of its outline's sides and base
    pub fn new(old: &OldSection, new: &Profile, matched: &Match, places: &[Vec<u32>; 2]) -> Self {
        let (mut tape, points) = Tape::new(&new.points);
        let [sides, base] = places.each_ref().map(|of| of.iter().map(|&i| points[i as usize]).collect::<Vec<_>>());
        let normal = normal(&mut tape, &points, new, matched.plane.normal);
        let path = smooth(&mut tape, &sides);
        let mut curve = MeasuredCurve::sides(&mut tape, path);
        let knots = old.affine.knots.clone();

        let mut tau: Vec<Number> = old.sides.knot_step.iter().map(|&i| constant(old.measured.tau[i])).collect();
        let mut best = (f64::INFINITY, tau.clone());
        for turn in 0..TURNS {
            let moved: Vec<Vector> = tau
                .iter()
                .zip(&knots)
                .map(|(&tau, &knot)| {
                    let point = curve.point(&mut tape, tau);
                    tape.sum_of(&[(point, 1.0), (fixed(knot), -1.0)])
                })
                .collect();
            let (_, residual) = old.affine.fit(&moved.iter().map(|&moved| value(moved)).collect::<Vec<_>>());
            if residual < best.0 {
                best = (residual, tau);
            }
            if turn + 1 == TURNS {
                break;
            }
            let map = fit(&mut tape, old, &moved);
            let mapped = old.sides.path.iter().map(|&at| mapped(&mut tape, old, &map, at)).collect();
            let mut mapped = MeasuredCurve::sides(&mut tape, mapped);
            tau = old.sides.knot_step.iter().map(|&step| mapped.tau(&mut tape, step)).collect();
        }
        let tau = settled(&mut tape, old, &mut curve, best.1, normal);

        let mut targets: Vec<Vector> = tau.into_iter().map(|tau| curve.point(&mut tape, tau)).collect();
        if old.outline.joined {
            let last = targets.len() - 1;
            let middle = tape.sum_of(&[(targets[0], 0.5), (targets[last], 0.5)]);
            (targets[0], targets[last]) = (middle, middle);
        }
        if let (Some(of_old), Some(measured)) = (&old.base, &old.measured_base) {
            let path = if base.len() >= 2 { smooth(&mut tape, &base) } else { vec![sides[sides.len() - 1], sides[0]] };
            let mut curve = MeasuredCurve::base(&mut tape, path);
            let of_knot = |&step: &usize| curve.point(&mut tape, constant(measured.tau[step]));
            targets.extend(of_old.knot_step.iter().map(of_knot).collect::<Vec<_>>());
        }
        Self { tape, targets }
    }

    pub fn forward(&self, change: &[DVec3]) -> Vec<DVec3> {
        self.tape.forward(change, &self.targets)
    }

    pub fn reverse(&self, by_knots: &[DVec3]) -> Vec<DVec3> {
        self.tape.reverse(&self.targets, by_knots)
    }
}

/// The unit normal of the new profile's plane.
fn normal(tape: &mut Tape, points: &[Vector], new: &Profile, normal: DVec3) -> Vector {
    let Tilt { by_points, .. } = Tilt::new(normal, new);
    std::array::from_fn(|axis| {
        let of_point = |(i, by): &(usize, DVec3)| {
            let by = by.reject_from_normalized(normal)[axis];
            [0, 1, 2].map(|along| (points[*i][along], by * normal[along]))
        };
        tape.number(normal[axis], by_points.iter().flat_map(of_point))
    })
}

/// The smooth curve through points, as [`ProfileCurve`].
fn smooth(tape: &mut Tape, points: &[Vector]) -> Vec<Vector> {
    let ProfileCurve { knots, knot_step, .. } =
        ProfileCurve::new(&points.iter().map(|&at| value(at)).collect::<Vec<_>>());
    let at: Vec<Vector> = knots.iter().map(|&i| points[i]).collect();
    let lengths: Vec<Number> = at.windows(2).map(|pair| tape.farther(constant(0.0), pair[0], pair[1])).collect();
    let chords: Vec<Vector> = at
        .windows(2)
        .map(|pair| {
            let way = tape.sum_of(&[(pair[1], 1.0), (pair[0], -1.0)]);
            tape.unit(way)
        })
        .collect();
    let mut tangents: Vec<[Vector; 2]> = Vec::with_capacity(chords.len());
    let mut start = 0;
    for i in 1..=chords.len() {
        if i == chords.len() || is_corner(value(chords[i - 1]), value(chords[i])) {
            let of_part = spline(tape, &chords[start..i], &lengths[start..i]);
            tangents.extend(of_part.windows(2).map(|pair| [pair[0], pair[1]]));
            start = i;
        }
    }
    let mut path = Vec::with_capacity(knot_step[knot_step.len() - 1] + 1);
    for (i, &length) in lengths.iter().enumerate() {
        let [start, end] = tangents[i].map(|tangent| tape.scaled(tangent, length));
        let steps = knot_step[i + 1] - knot_step[i];
        for step in 0..steps {
            let t = step as f64 / steps as f64;
            let (u, v) = (t * t, 1.0 - t);
            let on_way = u * (3.0 - 2.0 * t);
            path.push(tape.sum_of(&[(at[i], 1.0 - on_way), (at[i + 1], on_way), (start, t * v * v), (end, -(u * v))]));
        }
    }
    path.extend(at.last());
    path
}

/// Tangents of the natural cubic spline, by elimination.
fn spline(tape: &mut Tape, chords: &[Vector], lengths: &[Number]) -> Vec<Vector> {
    let n = chords.len();
    let (mut upper, mut m): (Vec<Number>, Vec<Vector>) = (Vec::with_capacity(n + 1), Vec::with_capacity(n + 1));
    for i in 0..=n {
        let (l, d, u, right) = match i {
            0 => (constant(0.0), constant(2.0), constant(1.0), tape.sum_of(&[(chords[0], 3.0)])),
            _ if i == n => (constant(1.0), constant(2.0), constant(0.0), tape.sum_of(&[(chords[n - 1], 3.0)])),
            _ => {
                let [l, r] = [lengths[i - 1], lengths[i]].map(|length| tape.div(constant(1.0), length));
                let d = tape.sum(&[(l, 2.0), (r, 2.0)]);
                let [before, after] = [(chords[i - 1], l), (chords[i], r)].map(|(chord, by)| tape.scaled(chord, by));
                (l, d, r, tape.sum_of(&[(before, 3.0), (after, 3.0)]))
            }
        };
        let (pivot, right) = if i == 0 {
            (d, right)
        } else {
            let (off, known) = (tape.mul(l, upper[i - 1]), tape.scaled(m[i - 1], l));
            (tape.sub(d, off), tape.sum_of(&[(right, 1.0), (known, -1.0)]))
        };
        upper.push(tape.div(u, pivot));
        m.push(right.map(|number| tape.div(number, pivot)));
    }
    for i in (0..n).rev() {
        let known = tape.scaled(m[i + 1], upper[i]);
        m[i] = tape.sum_of(&[(m[i], 1.0), (known, -1.0)]);
    }
    m.into_iter()
        .map(|m| {
            if value(m).length() <= LONGEST_TANGENT {
                return m;
            }
            let unit = tape.unit(m);
            tape.sum_of(&[(unit, LONGEST_TANGENT)])
        })
        .collect()
}

/// The map that [`super::PlaneAffine::fit`] fits to the knots' displacements.
fn fit(tape: &mut Tape, old: &OldSection, moved: &[Vector]) -> [Vector; 3] {
    [0, 1, 2].map(|i| {
        let mut unit = [DVec3::ZERO; 3];
        unit[i] = DVec3::X;
        let shares = old.affine.fit_reverse(&unit);
        let terms: Vec<(Vector, f64)> = moved.iter().zip(shares).map(|(&moved, share)| (moved, share.x)).collect();
        tape.sum_of(&terms)
    })
}

/// A point of the old section, moved by a map.
fn mapped(tape: &mut Tape, old: &OldSection, map: &[Vector; 3], at: DVec3) -> Vector {
    let [one, a, b] = old.affine.basis(at);
    tape.sum_of(&[(fixed(at), 1.0), (map[0], one), (map[1], a), (map[2], b)])
}

/// What the mapped curve's nearest points to the old knots make of a match, as
/// [`OldSection::settled`].
fn settled(
    tape: &mut Tape,
    old: &OldSection,
    new: &mut MeasuredCurve,
    start: Vec<Number>,
    normal: Vector,
) -> Vec<Number> {
    let knots = &old.affine.knots;
    let last = knots.len() - 1;
    let mut tau = start.clone();
    let mut nearest: Vec<(Vector, Vector)> = start.iter().map(|&tau| new.point_and_tangent(tape, tau)).collect();
    let boxes = PathBoxes::new(&new.measured.path);
    let mut off = constant(0.0);
    for _ in 0..STRAIGHT_TURNS {
        let Some(map) = fit_across(tape, old, &nearest, normal) else { return start };
        let mut squares = Vec::with_capacity(knots.len());
        for j in 1..last {
            let at = mapped(tape, old, &map, knots[j]);
            let range = [start[j].value - NEAR, start[j].value + NEAR];
            tau[j] = new.nearest(tape, &boxes, at, range);
            nearest[j] = new.point_and_tangent(tape, tau[j]);
            let way = tape.sum_of(&[(nearest[j].0, 1.0), (at, -1.0)]);
            let square = tape.dot(way, way);
            squares.push((square, old.affine.weights[j].powi(2)));
        }
        off = tape.sum(&squares);
    }
    // As the shares of the way are: a smooth function of the square of the distance.
    let square = tape.sum(&[(off, (STRAIGHT * old.length()).powi(-2))]);
    let share = ((1.0 + square.value).powi(-2) - NOTHING) / (1.0 - NOTHING);
    if share <= 0.0 {
        return start;
    }
    let share = tape.number(share, [(square, -2.0 * (1.0 + square.value).powi(-3) / (1.0 - NOTHING))]);
    for (tau, &start) in tau.iter_mut().zip(&start) {
        let way = tape.sub(*tau, start);
        let way = tape.mul(way, share);
        *tau = tape.add(start, way);
    }
    let apart = |of: &[Number], j: usize| of[j + 1].value - of[j].value;
    if (0..last).any(|j| apart(&tau, j) < CROWDED * apart(&start, j)) {
        return start;
    }
    tau
}

/// The map of [`super::PlaneAffine::fit_across`]. `M x = r` has the change
/// `dx = M^-1 (dr - dM x)`, and M and r are sums over knots and directions.
fn fit_across(tape: &mut Tape, old: &OldSection, targets: &[(Vector, Vector)], normal: Vector) -> Option<[Vector; 3]> {
    let affine = &old.affine;
    let across = value(normal);
    let (u, v) = across.any_orthonormal_pair();
    // The pair turns with the normal by the shortest way. Another pair gives the same map.
    let [u, v] = [u, v].map(|axis| {
        std::array::from_fn(|i| {
            let by = (0..3).map(|j| (normal[j], -across[i] * axis[j]));
            tape.number(axis[i], by)
        })
    });
    /// One term of the sums: the place's row, its direction along u and v, its height and weight.
    struct Term {
        row: [f64; 3],
        along: [Number; 2],
        height: Number,
        weight: f64,
    }
    let last = targets.len() - 1;
    let mut terms = Vec::with_capacity(targets.len() + 2);
    for (j, (&knot, &(target, tangent))) in affine.knots.iter().zip(targets).enumerate() {
        let row = affine.basis(knot);
        let way = tape.sum_of(&[(target, 1.0), (fixed(knot), -1.0)]);
        if j == 0 || j == last {
            for (axis, along) in [(u, [1.0, 0.0]), (v, [0.0, 1.0])] {
                let height = tape.dot(way, axis);
                terms.push(Term { row, along: along.map(constant), height, weight: super::plane_affine::END });
            }
        } else {
            let direction = tape.cross(normal, tangent);
            let along = [u, v].map(|axis| tape.dot(direction, axis));
            let height = tape.dot(way, direction);
            terms.push(Term { row, along, height, weight: affine.weights[j].powi(2) });
        }
    }
    let (mut matrix, mut right) = (nalgebra::Matrix6::<f64>::zeros(), nalgebra::Vector6::<f64>::zeros());
    for Term { row, along, height, weight } in &terms {
        let row = nalgebra::Vector6::from_fn(|i, _| row[i % 3] * along[i / 3].value);
        matrix += row * row.transpose() * *weight;
        right += row * (height.value * weight);
    }
    let factor = matrix.cholesky()?;
    let (solution, inverse) = (factor.solve(&right), factor.inverse());
    let split = |of: &dyn Fn(usize) -> f64, row: &[f64; 3]| {
        [0, 3].map(|first| (0..3).map(|i| of(first + i) * row[i]).sum::<f64>())
    };
    let mut unknown = |i: usize| {
        let by = terms.iter().flat_map(|Term { row, along, height, weight }| {
            let [x_u, x_v] = split(&|k| solution[k], row);
            let [y_u, y_v] = split(&|k| inverse[(i, k)], row);
            let [a, b] = along.map(|along| along.value);
            let left = height.value - (a * x_u + b * x_v);
            let own = a * y_u + b * y_v;
            [
                (along[0], weight * (y_u * left - own * x_u)),
                (along[1], weight * (y_v * left - own * x_v)),
                (*height, weight * own),
            ]
        });
        tape.number(solution[i], by.collect::<Vec<_>>())
    };
    let unknowns: [Number; 6] = std::array::from_fn(&mut unknown);
    let mut map = [0, 1, 2].map(|i| {
        let [along_u, along_v] = [tape.scaled(u, unknowns[i]), tape.scaled(v, unknowns[i + 3])];
        tape.sum_of(&[(along_u, 1.0), (along_v, 1.0)])
    });
    let share = 1.0 / targets.len() as f64;
    let middle: Vec<(Vector, f64)> = targets.iter().map(|target| (target.0, share)).collect();
    let of_knots = affine.knots.iter().sum::<DVec3>() * share;
    let middle = tape.sum_of(&[&middle[..], &[(fixed(of_knots), -1.0)]].concat());
    let height = tape.dot(middle, normal);
    let shift = tape.scaled(normal, height);
    map[0] = tape.sum_of(&[(map[0], 1.0), (shift, 1.0)]);
    Some(map)
}

/// Of what the larger of two shares is made, at a step of a curve.
#[derive(Clone, Copy)]
enum Share {
    Constant(f64),
    Arc(usize),
    Chord(usize),
}

/// [`Measured`] on a tape. A parameter goes onto the tape when it is asked for.
struct MeasuredCurve {
    path: Vec<Vector>,
    s: Vec<Number>,
    /// The parameters so far.
    tau: Vec<Option<Number>>,
    measured: Measured,
    kind: Kind,
}

/// How a curve is measured.
enum Kind {
    Sides(Sides),
    Base,
}

/// What the parameters of two sides are made of.
struct Sides {
    /// Middle of the trailing edge.
    edge: Vector,
    /// Arc length and distance from the trailing edge at the leading edge.
    leading: [Number; 2],
    /// Distance of the first and the last point from the middle of the trailing edge.
    ends: [Number; 2],
    /// The first step beyond the leading edge.
    middle: usize,
    /// Each step's share by the distance from the trailing edge.
    nearest: Vec<Share>,
}

/// Arc length at each point of a path.
fn arcs(tape: &mut Tape, path: &[Vector]) -> Vec<Number> {
    let mut s = Vec::with_capacity(path.len());
    s.push(constant(0.0));
    for pair in path.windows(2) {
        let next = tape.farther(s[s.len() - 1], pair[0], pair[1]);
        s.push(next);
    }
    s
}

impl MeasuredCurve {
    fn base(tape: &mut Tape, path: Vec<Vector>) -> Self {
        let s = arcs(tape, &path);
        let measured = Measured::base(path.iter().map(|&at| value(at)).collect());
        Self { tau: vec![None; path.len()], path, s, measured, kind: Kind::Base }
    }

    fn sides(tape: &mut Tape, path: Vec<Vector>) -> Self {
        let s = arcs(tape, &path);
        let n = path.len();
        let edge = tape.sum_of(&[(path[0], 0.5), (path[n - 1], 0.5)]);
        let d: Vec<f64> = path.iter().map(|&at| value(at).distance(value(edge))).collect();
        let mut distance = |j: usize| tape.farther(constant(0.0), edge, path[j]);
        let ends = [distance(0), distance(n - 1)];
        let leading = leading_edge(tape, &path, edge, &s, &d);
        let [le_s, le_d] = leading.map(|number| number.value);
        let middle = s.partition_point(|s| s.value < le_s);
        let mut nearest = vec![Share::Constant(0.0); n];
        let mut measure = |steps: &mut dyn Iterator<Item = usize>, te_s: f64, te_d: f64| {
            let (mut largest, mut of_largest) = (0.0, Share::Constant(0.0));
            for j in steps {
                let arc = (s[j].value - le_s) / (te_s - le_s);
                let chord = (le_d - d[j]) / (le_d - te_d);
                let (share, made_of) = if chord.is_finite() { (chord, Share::Chord(j)) } else { (arc, Share::Arc(j)) };
                if share.clamp(0.0, 1.0) > largest {
                    largest = share.clamp(0.0, 1.0);
                    of_largest = if share >= 1.0 { Share::Constant(1.0) } else { made_of };
                }
                nearest[j] = of_largest;
            }
        };
        measure(&mut (0..middle).rev(), s[0].value, d[0]);
        measure(&mut (middle..n), s[n - 1].value, d[n - 1]);
        let measured = Measured::sides(path.iter().map(|&at| value(at)).collect());
        let kind = Kind::Sides(Sides { edge, leading, ends, middle, nearest });
        Self { tau: vec![None; n], path, s, measured, kind }
    }

    /// The parameter of a step.
    fn tau(&mut self, tape: &mut Tape, step: usize) -> Number {
        if let Some(tau) = self.tau[step] {
            return tau;
        }
        let n = self.path.len();
        let tau = match &self.kind {
            Kind::Base if self.s[n - 1].value > 0.0 => {
                let share = tape.div(self.s[step], self.s[n - 1]);
                tape.add(share, constant(2.0))
            }
            Kind::Base => constant(2.0),
            Kind::Sides(Sides { edge, leading: [le_s, le_d], ends, middle, nearest }) => {
                let (te, sign) = if step < *middle { (0, -1.0) } else { (n - 1, 1.0) };
                let te_d = ends[usize::from(te > 0)];
                let arc = |tape: &mut Tape, step: usize| {
                    let (way, whole) = (tape.sub(self.s[step], *le_s), tape.sub(self.s[te], *le_s));
                    let share = tape.div(way, whole);
                    if (0.0..=1.0).contains(&share.value) { share } else { constant(share.value.clamp(0.0, 1.0)) }
                };
                let of_arc = arc(tape, step);
                let of_chord = match nearest[step] {
                    Share::Constant(share) => constant(share),
                    Share::Arc(step) => arc(tape, step),
                    Share::Chord(step) => {
                        let d = tape.farther(constant(0.0), *edge, self.path[step]);
                        let (way, whole) = (tape.sub(*le_d, d), tape.sub(*le_d, te_d));
                        tape.div(way, whole)
                    }
                };
                tape.sum(&[(constant(1.0), 1.0), (of_arc, 0.5 * sign), (of_chord, 0.5 * sign)])
            }
        };
        // Rounding of the tape's own must not lead to another step than the match took.
        let tau = tape.number(self.measured.tau[step], [(tau, 1.0)]);
        self.tau[step] = Some(tau);
        tau
    }

    /// The step with a parameter, and the share of the step before it.
    fn bracket(&mut self, tape: &mut Tape, tau: Number) -> (usize, Number) {
        let (step, t) = bracket(&self.measured.tau, tau.value);
        if t <= 0.0 || t >= 1.0 {
            // Within the curve the share goes on into the step, and stops at the ends.
            let inside = tau.value > self.measured.tau[0] && tau.value < self.measured.tau[self.path.len() - 1];
            if !inside || self.measured.tau[step + 1] <= self.measured.tau[step] {
                return (step, constant(t));
            }
        }
        let (before, after) = (self.tau(tape, step), self.tau(tape, step + 1));
        let (way, whole) = (tape.sub(tau, before), tape.sub(after, before));
        (step, tape.div(way, whole))
    }

    fn point(&mut self, tape: &mut Tape, tau: Number) -> Vector {
        let (step, t) = self.bracket(tape, tau);
        tape.lerp(self.path[step], self.path[step + 1], t)
    }

    fn point_and_tangent(&mut self, tape: &mut Tape, tau: Number) -> (Vector, Vector) {
        let (step, t) = self.bracket(tape, tau);
        let way = tape.sum_of(&[(self.path[step + 1], 1.0), (self.path[step], -1.0)]);
        (tape.lerp(self.path[step], self.path[step + 1], t), tape.unit(way))
    }

    /// As [`Measured::nearest`].
    fn nearest(&mut self, tape: &mut Tape, boxes: &PathBoxes, at: Vector, between: [f64; 2]) -> Number {
        let (step, t) = self.measured.nearest_step(boxes, value(at), between);
        let [from, to] = [step, step + 1].map(|step| self.tau(tape, step));
        if t <= 0.0 {
            return from;
        }
        let whole = from.value + (to.value - from.value) * t;
        if t >= 1.0 {
            return tape.number(whole, [(to, 1.0)]);
        }
        let way = tape.sum_of(&[(self.path[step + 1], 1.0), (self.path[step], -1.0)]);
        let off = tape.sum_of(&[(at, 1.0), (self.path[step], -1.0)]);
        let (along, square) = (tape.dot(off, way), tape.dot(way, way));
        let (share, of_step) = (tape.div(along, square), tape.sub(to, from));
        let part = tape.mul(share, of_step);
        let tau = tape.add(from, part);
        tape.number(whole, [(tau, 1.0)])
    }
}

/// Arc length and distance from the trailing edge at the leading edge, as
/// [`crate::profile::curve::leading_edge`].
///
/// - `d` `[n_steps]`: distance from the middle of the trailing edge
fn leading_edge(tape: &mut Tape, path: &[Vector], edge: Vector, s: &[Number], d: &[f64]) -> [Number; 2] {
    let n = s.len();
    let distance = |tape: &mut Tape, j: usize| tape.farther(constant(0.0), edge, path[j]);
    let i = (0..n).max_by(|&a, &b| d[a].total_cmp(&d[b])).unwrap_or(0).clamp(1, n.saturating_sub(2).max(1));
    let least = d[i] * (1.0 - AS_FAR);
    let is_peak = |j: &usize| d[*j] >= d[j - 1] && d[*j] > d[j + 1] && d[*j] > least;
    let peaks: Vec<usize> = (1..n.saturating_sub(1)).filter(is_peak).collect();
    let farthest = distance(tape, i);
    if peaks.len() > 1 {
        let (mut weight, mut moment) = (constant(0.0), constant(0.0));
        for &j in &peaks {
            let of_peak = distance(tape, j);
            let of_peak = tape.sum(&[(of_peak, 1.0), (farthest, AS_FAR - 1.0)]);
            let by = tape.mul(of_peak, s[j]);
            (weight, moment) = (tape.add(weight, of_peak), tape.add(moment, by));
        }
        let le_s = tape.div(moment, weight);
        let values: Vec<f64> = s.iter().map(|s| s.value).collect();
        let (step, _) = bracket(&values, le_s.value);
        let (way, whole) = (tape.sub(le_s, s[step]), tape.sub(s[step + 1], s[step]));
        let t = tape.div(way, whole);
        let [from, to] = [distance(tape, step), distance(tape, step + 1)];
        let rise = tape.sub(to, from);
        let part = tape.mul(rise, t);
        return [le_s, tape.add(from, part)];
    }
    if n < 3 {
        return [s[i], farthest];
    }
    let (left, right) = (tape.sub(s[i], s[i - 1]), tape.sub(s[i + 1], s[i]));
    let [d_before, d_after] = [distance(tape, i - 1), distance(tape, i + 1)];
    let [before, after] = [(farthest, d_before, left), (d_after, farthest, right)].map(|(to, from, length)| {
        let rise = tape.sub(to, from);
        tape.div(rise, length)
    });
    let both = tape.add(left, right);
    let bend = tape.sub(after, before);
    let curvature = tape.div(bend, both);
    let (one, other) = (tape.mul(before, right), tape.mul(after, left));
    let slope = tape.add(one, other);
    let slope = tape.div(slope, both);
    let twice = tape.sum(&[(curvature, -2.0)]);
    let shift = tape.div(slope, twice);
    if !shift.value.is_finite() {
        return [s[i], farthest];
    }
    let shift = match shift.value {
        shift if shift < -0.5 * left.value => tape.sum(&[(left, -0.5)]),
        shift if shift > 0.5 * right.value => tape.sum(&[(right, 0.5)]),
        _ => shift,
    };
    let square = tape.mul(shift, shift);
    let (rise, bow) = (tape.mul(slope, shift), tape.mul(curvature, square));
    [tape.add(s[i], shift), tape.sum(&[(farthest, 1.0), (rise, 1.0), (bow, 1.0)])]
}
