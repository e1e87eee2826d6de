//! Bridges of a section through parts that stand on the wing.
//!
//! A pylon or a fairing takes a piece out of a wing's surface, so a plane through it cuts a section
//! with a gap. [`bridged`] joins the pieces by a cubic across the gap, with the tangents of both
//! ends. The points of the bridge count as points of the section, but no vertex is there.
//!
//! A cubic does not follow the curve of a leading edge. So the section of the vertices (see
//! `carry`) takes the shape of the wing's own sections on both sides of the part, shifted to the
//! ends of the gap. Where the wing has no such sections, the cubic stays.
//!
//! The two ends of a gap lie on one loop of the surface's edge ([`Junctions`]). Where a fairing
//! crosses the trailing edge, only one end is left. The other end is then the corner of the
//! trailing edge: the point at which the plane meets the straight line between the two places where
//! the trailing edge ends on the fairing. There the wing's faces beside the fairing give the
//! tangent.
//!
//! What cannot be guessed is refused: a gap round the leading or the trailing edge, a gap of most
//! of a chord, and a gap that is wider along the span than the section is long, which is a panel of
//! the wing. The paper has no such parts.

use std::collections::BTreeMap;

use glam::DVec3;

use super::crossings::{Crossing, crossing, is_closed, points_of};
use super::junctions::{JunctionPlace, Junctions};
use crate::geometry::nearest_on_segment;
use crate::profile::curve::{Behind, arc_length, behind, bracket, short_end};
use crate::profile::edges::farthest;
use crate::profile::error::{ShortEnd, UnbridgedGap};
use crate::profile::{Plane, ProfileError, extent};

/// An end leads into a gap if its tangent points to the other end within this angle, in degrees.
/// Round a leading or a trailing edge both ends point away from each other.
const SMOOTH: f64 = 40.0;

/// A sharp trailing edge turns by at least this angle, in degrees.
const SHARP: f64 = 125.0;

/// Largest gap, as a share of the section's length. A pylon takes half of one side. A family that
/// takes all of it is one side of the wing.
const WIDEST: f64 = 0.75;

/// An end farther before the section's rear than this share of the section's length is not at the
/// trailing edge, if it lies on a part. (An end on nothing known may lie farther before it.)
const BEFORE_REAR: f64 = 0.005;

/// Points nearer together than this share of the section's length are one point.
const SAME: f64 = 1e-6;

/// Both ends of a section are at its trailing edge, on a base that is thinner than this share of
/// the length. Blunt trailing edges are up to about 3 % thick.
const THICK: f64 = 0.06;

/// The tangent at an end is that of the parabola fitted to the points within this share of the
/// section's length.
const NEAR_END: f64 = 0.04;
/// A curve that is like the section is within this share of the section's length at both ends of a
/// gap.
const ALIKE: f64 = 0.03;
/// Longest way along such a curve, over the gap.
const LONGEST: f64 = 1.2;

/// Least number of points of this fit, if the piece has as many.
const FITTED: usize = 4;

/// A gap of a section that is bridged.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::profile) struct Bridge {
    /// The family in the gap.
    pub family: String,
    /// Distance between the ends of the gap, in the mesh's unit.
    pub gap: f64,
    /// The distance as a share of the section's length.
    pub share: f64,
    /// The ends of the gap.
    pub ends: [DVec3; 2],
    /// Distance between the points of the bridge, in the mesh's unit.
    spacing: f64,
    /// The end at the trailing edge, if there is one.
    corner: Option<Corner>,
}

/// An end of a bridge at the trailing edge, where the section does not go on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Corner {
    at: DVec3,
    /// The unit tangent into the gap, if it is known.
    tangent: Option<DVec3>,
}

impl Bridge {
    /// The points between two pieces of a section, in order from the first.
    ///
    /// - `before`, `after`: the points of the pieces, each from the gap onwards
    /// - `like`: a curve of small steps that is like the section, if there is one
    pub fn points(&self, before: &[DVec3], after: &[DVec3], plane: &Plane, like: Option<&[DVec3]>) -> Vec<DVec3> {
        let (Some(&from), Some(&to)) = (before.first(), after.first()) else { return Vec::new() };
        let pieces = (from.distance(to) / self.spacing).ceil().clamp(4.0, 400.0);
        if let Some(points) = like.and_then(|like| self.along(like, from, to, pieces as usize)) {
            return points;
        }
        let reach = self.gap / self.share.max(f64::MIN_POSITIVE) * NEAR_END;
        // The tangents into the gap.
        let [leaving, arriving] = [before, after].map(|piece| match self.corner {
            Some(corner) if corner.at == piece[0] => corner.tangent,
            _ => Some(tangent(piece, reach)),
        });
        let gap = from.distance(to);
        let chord = to - from;
        let (start, end) = match (leaving.map(|t| t * gap), arriving.map(|t| -t * gap)) {
            (Some(start), Some(end)) => (start, end),
            // No second derivative at an end without a tangent.
            (Some(start), None) => (start, (chord * 3.0 - start) / 2.0),
            (None, Some(end)) => ((chord * 3.0 - end) / 2.0, end),
            (None, None) => (chord, chord),
        };
        let at = |k: usize| {
            let t = k as f64 / pieces;
            let (u, v) = (t * t, 1.0 - t);
            let point = from + chord * (u * (3.0 - 2.0 * t)) + start * (t * v * v) - end * (u * v);
            point - plane.normal * plane.distance(point)
        };
        (1..pieces as usize).map(at).collect()
    }

    /// The points of a curve between two points near it, shifted so that the curve passes through
    /// both. `None` if the curve is not like the section there.
    fn along(&self, like: &[DVec3], from: DVec3, to: DVec3, pieces: usize) -> Option<Vec<DVec3>> {
        let arc = arc_length(like);
        let nearest = |at: DVec3| {
            let steps = like.windows(2).enumerate().map(|(step, ends)| {
                let (point, t) = nearest_on_segment(at, ends[0], ends[1]);
                (at.distance(point), point, arc[step] + (arc[step + 1] - arc[step]) * t)
            });
            steps.min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let [(off_from, on_from, start), (off_to, on_to, end)] = [nearest(from)?, nearest(to)?];
        let length = self.gap / self.share.max(f64::MIN_POSITIVE);
        // Round the leading edge the way is much longer than the gap.
        if off_from.max(off_to) > ALIKE * length || (end - start).abs() > LONGEST * from.distance(to) {
            return None;
        }
        let at = |k: usize| {
            let share = k as f64 / pieces as f64;
            let (step, t) = bracket(&arc, start + (end - start) * share);
            like[step].lerp(like[step + 1], t) + (from - on_from).lerp(to - on_to, share)
        };
        Some((1..pieces).map(at).collect())
    }
}

/// Checks that the leading and the trailing edge of a section are on the wing, not on a bridge.
///
/// - `curve`: in the order of [`super::cut()`]
/// - `base`: the first point of a blunt base, if the base is part of the curve
///
/// # Errors
/// [`ProfileError::Gap`]
pub(super) fn check_edges(
    curve: &[Crossing],
    base: Option<usize>,
    bridges: &[Bridge],
    plane: &Plane,
) -> Result<(), ProfileError> {
    let points = points_of(curve);
    let nose = farthest(&points, (points[0] + points[points.len() - 1]) / 2.0);
    let is_guessed = |place: &usize| curve[*place].edges.is_empty();
    // An open section may end at a corner of the trailing edge that a part covers.
    let start = is_closed(curve).then_some(0);
    let found = [Some(nose), start, base].into_iter().flatten().find(is_guessed);
    let Some(place) = found else { return Ok(()) };
    let of = |bridge: &&Bridge| bridge.ends.map(|end| end.distance(points[place])).iter().sum::<f64>() / bridge.gap;
    let bridge = bridges.iter().min_by(|a, b| of(a).total_cmp(&of(b))).expect("a guessed point is of a bridge");
    let (normal, family, ends) = (plane.normal, bridge.family.clone(), bridge.ends);
    let why = format!("the {} edge is in it", if place == nose { "leading" } else { "trailing" });
    Err(ProfileError::Gap(Box::new(UnbridgedGap { normal, at: plane.point.dot(normal), family, ends, why })))
}

/// The unit tangent out of a piece at its first point.
fn tangent(piece: &[DVec3], reach: f64) -> DVec3 {
    let end = piece[0];
    let mut arc = 0.0;
    let mut near: Vec<(f64, DVec3)> = Vec::new();
    for pair in piece.windows(2) {
        arc += pair[0].distance(pair[1]);
        if arc > reach && near.len() >= FITTED {
            break;
        }
        near.push((arc, pair[1] - end));
    }
    // The parabola `a s + b s^2` through the end, by least squares.
    let sum = |power: i32| near.iter().map(|&(s, _)| s.powi(power)).sum::<f64>();
    let of = |power: i32| near.iter().map(|&(s, off)| off * s.powi(power)).sum::<DVec3>();
    let (s2, s3, s4) = (sum(2), sum(3), sum(4));
    let determinant = s2 * s4 - s3 * s3;
    let along = if determinant > 1e-9 * s2 * s4 { (of(1) * s4 - of(2) * s3) / determinant } else { of(1) };
    -along.normalize_or_zero()
}

/// An end of a piece of a section.
#[derive(Clone, Copy, Debug)]
struct End {
    piece: usize,
    /// Whether this is the last point of the piece.
    is_last: bool,
    at: DVec3,
    /// The unit tangent out of the piece, and that of its last segment alone. A base is thinner
    /// than the points that give the tangent extend.
    out: DVec3,
    last_segment: DVec3,
    place: JunctionPlace,
}

impl End {
    /// Angle between the tangent and the way to a point, in degrees.
    fn turn_to(&self, at: DVec3) -> f64 {
        self.out.angle_between(at - self.at).to_degrees()
    }

    /// Whether another end is the same one.
    fn is(&self, other: &Self) -> bool {
        (self.piece, self.is_last) == (other.piece, other.is_last)
    }
}

/// What two ends on one loop of the surface's edge are.
enum Pair {
    /// The ends of a gap.
    Gap(End, End),
    /// The end of a gap, and a sharp trailing edge, at which the gap ends.
    ToTrailingEdge(End, End),
    /// The ends of the section.
    Open(End, End),
}

impl Pair {
    fn of([one, other]: [End; 2], junctions: &Junctions) -> Self {
        let is_smooth = |a: &End, b: &End| a.turn_to(b.at) < SMOOTH;
        let turn = |b: &End, to: DVec3| b.last_segment.angle_between(to - b.at).to_degrees();
        let is_sharp = |a: &End, b: &End| is_smooth(a, b) && turn(b, a.at) > SHARP;
        // At a blunt trailing edge the loop runs along the edge between the two ends.
        let alike = junctions.is_on_run(one.place, other.place);
        match () {
            () if is_smooth(&one, &other) && is_smooth(&other, &one) => Self::Gap(one, other),
            () if alike && is_sharp(&one, &other) => Self::ToTrailingEdge(one, other),
            () if alike && is_sharp(&other, &one) => Self::ToTrailingEdge(other, one),
            () => Self::Open(one, other),
        }
    }
}

/// A section as one curve, and its bridges.
pub(super) type Joined = (Vec<Crossing>, Vec<Bridge>);

/// The wing, its edge and the plane of one section.
struct Section<'a, F> {
    vertices: &'a [DVec3],
    faces: &'a [F],
    plane: &'a Plane,
    junctions: &'a Junctions,
    /// Length of all pieces together.
    length: f64,
    /// Mean distance of the pieces' points.
    spacing: f64,
}

/// The pieces of a section as one curve, and its bridges. `None` if nothing is bridged.
///
/// - `curves`: the pieces, in any order
/// - `vertices`, `faces`: of the wing
///
/// # Errors
/// [`ProfileError::Gap`] and [`ProfileError::CutShort`]: a gap is not to be guessed.
pub(super) fn bridged(
    curves: &[Vec<Crossing>],
    vertices: &[DVec3],
    faces: &[impl AsRef<[u32]>],
    plane: &Plane,
    junctions: &Junctions,
) -> Result<Option<Joined>, ProfileError> {
    if curves.iter().any(|curve| is_closed(curve) || curve.len() < 2) {
        return Ok(None);
    }
    let pieces: Vec<Vec<DVec3>> = curves.iter().map(|curve| points_of(curve)).collect();
    let length = extent(&pieces.concat());
    let lengths = pieces.iter().flat_map(|piece| piece.windows(2)).map(|pair| pair[0].distance(pair[1]));
    let spacing = lengths.sum::<f64>() / pieces.iter().map(|piece| piece.len() - 1).sum::<usize>() as f64;
    let section = Section { vertices, faces, plane, junctions, length, spacing };
    let mut by_loop: BTreeMap<usize, Vec<End>> = BTreeMap::new();
    for (piece, curve) in curves.iter().enumerate() {
        for is_last in [false, true] {
            let end = if is_last { curve.last() } else { curve.first() };
            let Some((end, place)) = end.and_then(|end| Some((end, section.place(end)?))) else { return Ok(None) };
            let mut inward = pieces[piece].clone();
            if is_last {
                inward.reverse();
            }
            let out = tangent(&inward, NEAR_END * length);
            let last_segment = (inward[0] - inward[1]).normalize_or_zero();
            by_loop.entry(place.of_loop).or_default().push(End {
                piece,
                is_last,
                at: end.at,
                out,
                last_segment,
                place,
            });
        }
    }
    let mut pairs = Vec::new();
    for ends in by_loop.into_values() {
        let Some(of_loop) = in_pairs(ends, junctions) else { return Ok(None) };
        pairs.extend(of_loop.into_iter().map(|ends| Pair::of(ends, junctions)));
    }
    section.joined(curves, &pairs)
}

/// The ends on one loop in pairs. Of more than two, those that lie on one run of edges beside a
/// family belong together: a fairing that reaches the trailing edge elsewhere shares the trailing
/// edge's loop.
fn in_pairs(mut ends: Vec<End>, junctions: &Junctions) -> Option<Vec<[End; 2]>> {
    let mut pairs = Vec::new();
    let mut place = 0;
    while ends.len() > 2 && place < ends.len() {
        let run: Vec<usize> = (0..ends.len())
            .filter(|&other| other == place || junctions.is_on_run(ends[place].place, ends[other].place))
            .collect();
        match run[..] {
            [one, other] => {
                let other = ends.remove(other);
                pairs.push([ends.remove(one), other]);
                place = 0;
            }
            _ => place += 1,
        }
    }
    pairs.push(ends.try_into().ok()?);
    Some(pairs)
}

impl<F: AsRef<[u32]>> Section<'_, F> {
    fn place(&self, end: &Crossing) -> Option<JunctionPlace> {
        end.edges.iter().find_map(|&edge| self.junctions.place(edge))
    }

    /// Joins the pieces across their gaps.
    fn joined(&self, curves: &[Vec<Crossing>], pairs: &[Pair]) -> Result<Option<Joined>, ProfileError> {
        let open: Vec<(&End, &End)> = pairs
            .iter()
            .filter_map(|pair| match pair {
                Pair::Open(one, other) => Some((one, other)),
                _ => None,
            })
            .collect();
        if open.len() > 1 {
            // One of them is the trailing edge, the other a gap whose ends do not see each other.
            let on_part = |end: &End| self.junctions.is_bridged(end.place.family);
            let is_gap = |(one, other): &&(&End, &End)| {
                one.place.family == other.place.family && on_part(one) && self.width(one, other) <= self.length
            };
            let narrowest = |pair: &&(&End, &End)| self.width(pair.0, pair.1);
            let gap = open.iter().filter(is_gap).min_by(|a, b| narrowest(a).total_cmp(&narrowest(b)));
            return match gap {
                Some((one, other)) => Err(self.refused(one, other.at, "it is no gap of one side alone".to_owned())),
                None => Ok(None),
            };
        }
        let gaps: Vec<(&End, &End, bool)> = pairs
            .iter()
            .filter_map(|pair| match pair {
                Pair::Gap(one, other) => Some((one, other, false)),
                Pair::ToTrailingEdge(one, edge) => Some((one, edge, true)),
                Pair::Open(..) => None,
            })
            .collect();
        let start = open.first().map_or_else(|| gaps[0].1, |(one, _)| one);
        let mut curve: Vec<Crossing> = Vec::new();
        let mut bridges = Vec::new();
        let (mut piece, mut from_last) = (start.piece, start.is_last);
        for _ in 0..curves.len() {
            let mut next = curves[piece].clone();
            if from_last {
                next.reverse();
            }
            curve.extend(next);
            let is_here = |end: &End| end.piece == piece && end.is_last != from_last;
            let gap = gaps.iter().find_map(|&(one, other, to_edge)| match () {
                () if is_here(one) => Some((one, other, to_edge, other)),
                () if is_here(other) => Some((one, other, to_edge, one)),
                () => None,
            });
            let Some((one, other, to_edge, beyond)) = gap else { break };
            let corner = to_edge.then_some(Corner { at: other.at, tangent: None });
            let bridge = self.bridge(one, other.at, self.width(one, other), corner)?;
            if !to_edge && !self.junctions.is_bridged(other.place.family) {
                return Err(self.not_a_part(other, one.at));
            }
            let mut after = points_of(&curves[beyond.piece]);
            if beyond.is_last {
                after.reverse();
            }
            let before: Vec<DVec3> = curve.iter().rev().map(|crossing| crossing.at).collect();
            let points = bridge.points(&before, &after, self.plane, None);
            curve.extend(points.into_iter().map(|at| Crossing { at, edges: Vec::new() }));
            bridges.push(bridge);
            (piece, from_last) = (beyond.piece, beyond.is_last);
            if beyond.is(start) {
                curve.push(curve[0].clone());
            }
        }
        let joined: usize = curve.iter().filter(|crossing| !crossing.edges.is_empty()).count();
        let all: usize = curves.iter().map(Vec::len).sum();
        if joined < all {
            return Ok(None);
        }
        if let Some(&(one, other)) = open.first() {
            // The end that is farther from the trailing edge first, because its corner tells where
            // the rear of the section is.
            for _ in 0..2 {
                bridges.extend(self.to_corner(one, other, &mut curve)?);
            }
            self.check_trailing_edge(one, other, &curve)?;
            if bridges.is_empty() {
                return Ok(None);
            }
            if let Some(position) = short_end(&points_of(&curve)) {
                return Err(self.cut_short(one, other, position));
            }
        }
        Ok(Some((curve, bridges)))
    }

    /// A bridge from an end to a point.
    ///
    /// - `width`: of the gap, along the plane's normal
    fn bridge(&self, from: &End, to: DVec3, width: f64, corner: Option<Corner>) -> Result<Bridge, ProfileError> {
        if !self.junctions.is_bridged(from.place.family) {
            return Err(self.not_a_part(from, to));
        }
        let gap = from.at.distance(to);
        let share = gap / self.length;
        if share > WIDEST {
            let why = format!(
                "it is {:.0} % of the section's length, expected at most {:.0} %: one side of the wing may be missing",
                100.0 * share,
                100.0 * WIDEST
            );
            return Err(self.refused(from, to, why));
        }
        if width > self.length {
            let why = format!(
                "along the span it is {:.1} times as wide as the section is long, as a panel of the wing is, which belongs \
                 to the wing's families",
                width / self.length
            );
            return Err(self.refused(from, to, why));
        }
        let family = self.junctions.name(from.place.family).to_owned();
        Ok(Bridge { family, gap, share, ends: [from.at, to], spacing: self.spacing, corner })
    }

    /// Leads a section on to the corner of the trailing edge, if it ends before it on a part.
    ///
    /// - `one`, `other`: the ends of the curve before anything was added
    fn to_corner(&self, one: &End, other: &End, curve: &mut Vec<Crossing>) -> Result<Option<Bridge>, ProfileError> {
        let Some(Behind { end, by, .. }) = behind(&points_of(curve)) else { return Ok(None) };
        let (end, other) = match () {
            () if one.at == end => (one, other),
            () if other.at == end => (other, one),
            () => return Ok(None),
        };
        if by <= BEFORE_REAR * self.length || !self.junctions.is_bridged(end.place.family) {
            return Ok(None);
        }
        // The trailing edge: on it the other end lies, or it goes on at both ends of the part.
        let edge = Some(other.place.family).filter(|&family| family != end.place.family);
        let edge = edge.filter(|&family| Some(family) != self.junctions.beside_run(other.place));
        let run = edge.or_else(|| self.junctions.beside_run(end.place));
        let run = run.and_then(|edge| self.junctions.run_beside(end.place, edge));
        let Some(run) = run else { return Ok(None) };
        let (Some(&first), Some(&last)) = (run.first(), run.last()) else { return Ok(None) };
        let [a, b] = [first, last].map(|vertex| self.vertices[vertex as usize]);
        // A wide run is no part: a trailing edge of two families, or the other side of the wing.
        let width = self.width_of(&run);
        if self.plane.distance(a) * self.plane.distance(b) >= 0.0 || width > self.length {
            return Ok(None);
        }
        let at = crossing(a, b, self.plane);
        let into = end.at - at;
        let tangent = [first, last].map(|vertex| self.tangent_at(vertex, into)).iter().sum::<DVec3>();
        let tangent = tangent.normalize_or_zero();
        let is_smooth = end.turn_to(at) < SMOOTH && tangent.angle_between(into).to_degrees() < SMOOTH;
        if into.length() < SAME * self.length {
            return Ok(None);
        }
        if !is_smooth || tangent == DVec3::ZERO {
            return Err(self.cut_short(end, other, end.at));
        }
        let corner = Corner { at, tangent: Some(tangent) };
        let bridge = self.bridge(end, at, width, Some(corner))?;
        if curve.last().is_none_or(|crossing| crossing.at != end.at) {
            curve.reverse();
        }
        let before: Vec<DVec3> = curve.iter().rev().map(|crossing| crossing.at).collect();
        let points = bridge.points(&before, &[at], self.plane, None);
        curve.extend(points.into_iter().chain([at]).map(|at| Crossing { at, edges: Vec::new() }));
        Ok(Some(bridge))
    }

    /// Refuses a section that ends on both sides at a part that has the trailing edge in it.
    ///
    /// - `one`, `other`: the ends of the curve before anything was added
    fn check_trailing_edge(&self, one: &End, other: &End, curve: &[Crossing]) -> Result<(), ProfileError> {
        let Some(Behind { base, .. }) = behind(&points_of(curve)) else { return Ok(()) };
        let is_part = self.junctions.is_bridged(one.place.family) && one.place.family == other.place.family;
        let is_narrow = || self.width_of(&self.junctions.run_of(one.place)) <= self.length;
        if is_part && base > THICK * self.length && is_narrow() {
            return Err(self.refused(one, other.at, "the leading or the trailing edge is in it".to_owned()));
        }
        Ok(())
    }

    /// The direction in the plane along the wing's faces at a vertex, on the side of `into`.
    fn tangent_at(&self, vertex: u32, into: DVec3) -> DVec3 {
        let of_vertex = self.faces.iter().map(AsRef::as_ref).filter(|corners| corners.contains(&vertex));
        let normals = of_vertex.map(|corners| {
            let [a, b, c] = [0, 1, 2].map(|k| self.vertices[corners[k] as usize]);
            (b - a).cross(c - a)
        });
        // The faces may have any orientation.
        let normal =
            normals.fold(DVec3::ZERO, |sum, normal| if sum.dot(normal) < 0.0 { sum - normal } else { sum + normal });
        let along = normal.cross(self.plane.normal).normalize_or_zero();
        if along.dot(into) < 0.0 { -along } else { along }
    }

    /// Extent along the plane's normal of the families in the gap between two ends.
    fn width(&self, one: &End, other: &End) -> f64 {
        let runs = [one, other].map(|end| self.junctions.run_of(end.place));
        self.width_of(&runs.concat())
    }

    fn width_of(&self, run: &[u32]) -> f64 {
        let heights = run.iter().map(|&vertex| self.plane.distance(self.vertices[vertex as usize]));
        let (low, high) = heights.fold((0.0, 0.0), |(low, high), x| (f64::min(low, x), f64::max(high, x)));
        high - low
    }

    fn refused(&self, from: &End, to: DVec3, why: String) -> ProfileError {
        let (normal, family) = (self.plane.normal, self.junctions.name(from.place.family).to_owned());
        let at = self.plane.point.dot(normal);
        ProfileError::Gap(Box::new(UnbridgedGap { normal, at, family, ends: [from.at, to], why }))
    }

    fn cut_short(&self, one: &End, other: &End, position: DVec3) -> ProfileError {
        let normal = self.plane.normal;
        let families = [one, other].map(|end| self.junctions.name(end.place.family).to_owned()).to_vec();
        ProfileError::CutShort {
            normal,
            at: self.plane.point.dot(normal),
            end: Box::new(ShortEnd { position, families }),
        }
    }

    fn not_a_part(&self, from: &End, to: DVec3) -> ProfileError {
        let why = "a family with its role is no part through which a section is bridged".to_owned();
        self.refused(from, to, why)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bridge over a gap of 0.4 in a section of length 1 whose sides run straight to the gap: its
    /// height in the middle. The curve that is like the section has an arch of height `arch` over
    /// the gap, and is `off` above the section.
    fn middle(off: f64, arch: f64) -> f64 {
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let ends = [at(0.3, 0.0), at(0.7, 0.0)];
        let bridge = Bridge { family: "part".to_owned(), gap: 0.4, share: 0.4, ends, spacing: 0.01, corner: None };
        let before: Vec<DVec3> = (0..=30).map(|k| at(0.3 - 0.01 * f64::from(k), 0.0)).collect();
        let after: Vec<DVec3> = (0..=30).map(|k| at(0.7 + 0.01 * f64::from(k), 0.0)).collect();
        let like: Vec<DVec3> = (0..=200)
            .map(|k| 0.005 * f64::from(k))
            .map(|x| at(x, off + arch * (std::f64::consts::PI * ((x - 0.3) / 0.4).clamp(0.0, 1.0)).sin()))
            .collect();
        let plane = Plane { point: DVec3::ZERO, normal: DVec3::Z };
        let points = bridge.points(&before, &after, &plane, Some(&like));
        points[points.len() / 2].y
    }

    /// A curve 2 % of the length off the section gives the bridge its arch, one 4.5 % off is
    /// another curve: then the bridge is straight, as its sides are.
    ///
    /// Fails if `ALIKE` is 0.003 or 0.3.
    #[test]
    fn a_bridge_follows_a_curve_near_its_ends() {
        assert!((middle(0.02, 0.05) - 0.05).abs() < 1e-3, "{}", middle(0.02, 0.05));
        assert!(middle(0.045, 0.05).abs() < 1e-12, "{}", middle(0.045, 0.05));
    }

    /// An arch that makes the way 4 % longer is followed, one that makes it 50 % longer is not.
    ///
    /// Fails if `LONGEST` is 0.12 or 12.
    #[test]
    fn a_bridge_follows_no_long_way_round() {
        assert!((middle(0.0, 0.05) - 0.05).abs() < 1e-3, "{}", middle(0.0, 0.05));
        assert!(middle(0.0, 0.2).abs() < 1e-12, "{}", middle(0.0, 0.2));
    }
}
