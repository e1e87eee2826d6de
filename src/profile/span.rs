//! Span coordinate of a point, and the weights of the planes there.
//!
//! Between two neighbouring planes a point has the signed distances `d_k` and `d_{k+1}`, and the
//! share `s = d_k / (d_k - d_{k+1})`. The share is exactly 0 on the one plane and 1 on the other.
//! Between parallel planes the span coordinate is `eta = eta_k + s (eta_{k+1} - eta_k)`. Between
//! planes that are not parallel, as at a winglet, it is
//!
//! ```text
//! eta = (1 - w) (eta_k + d_k) + w (eta_{k+1} + d_{k+1}),    w = s^2 (3 - 2 s)
//! ```
//!
//! So it grows by the distance from a plane on both sides of the plane, whatever the angle to the
//! next one. The first formula would make the displacement's slope jump there, and facets across
//! the plane would miss the profile. The difference of `eta` between two such planes is the length
//! of the arc that meets both at right angles. Beyond the outermost planes `eta` grows by the
//! distance.
//!
//! | planes | weights |
//! |---|---|
//! | 1 | the plane alone |
//! | 2 | linear |
//! | 3 and more | parabolas through neighbouring triples, blended linearly between the two planes they share (Overhauser); up to the outermost planes the first and the last parabola alone |
//!
//! On a plane only this plane counts. A function that is quadratic along the span is reproduced
//! between the outermost planes. Beyond them a *change* is constant. The *position* of the sections
//! continues as a straight line there, because a parabola would diverge.

use glam::DVec3;

use super::plane::main_direction;
use super::{Plane, Profile, ProfileError};

/// Planes are the same plane if their distance is less than this share of a chord.
const SAME_PLANE: f64 = 1e-6;

/// Two neighbouring planes are parallel if the sine of the angle between them is less.
const PARALLEL: f64 = 1e-6;

/// A normal that encloses an angle with a larger cosine with the reference has the reference's side
/// without a doubt. The angle is 75 degrees.
const CLEAR: f64 = 0.26;

/// Least cosine of the angle between the mean normal and a plane's. Planes that lean back have no
/// order along it.
const LEAST_ALONG: f64 = 1e-3;

/// Planes may intersect in the wing if the cosine of the angle between them is not less: 45
/// degrees. At a larger angle the sections have no order.
const LEAST_CROSSED: f64 = 0.7;

/// Least cosine of the angle, 18 degrees, between the normals of a surface and of the plane of a
/// section that stands on it.
const FLOOR: f64 = 0.95;

/// The formula for planes that are not parallel needs the middle of each section at least this
/// share of their distance beyond the other plane. Otherwise the planes intersect in the wing.
const APART: f64 = 0.1;

/// Planes in order along the span.
#[derive(Clone, Debug)]
pub(super) struct Span {
    /// Planes with normals on one side, ascending along the mean normal.
    pub planes: Vec<Plane>,
    /// Span coordinate of each plane, in the unit of the mesh.
    pub eta: Vec<f64>,
    /// Mean unit normal.
    pub normal: DVec3,
    /// Whether the planes of an interval enclose an angle `[n_planes - 1]`. Empty if no two do.
    turns: Vec<bool>,
}

/// Weights of the planes at one span coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SpanWeights {
    /// The first of at most four neighbouring planes.
    pub first: usize,
    /// Number of planes that count.
    pub count: usize,
    /// Weight of each plane, without unit. Their sum is 1.
    pub weight: [f64; 4],
    /// Derivative of each weight along the span coordinate, in one over length. Their sum is 0.
    pub slope: [f64; 4],
    /// The plane below, counted from `first`, and the share of the way to the next plane, 0 to 1.
    pub lower: usize,
    pub share: f64,
}

impl SpanWeights {
    /// One plane alone.
    pub fn only(plane: usize) -> Self {
        Self { first: plane, count: 1, weight: [1.0, 0.0, 0.0, 0.0], slope: [0.0; 4], lower: 0, share: 0.0 }
    }
}

impl Span {
    /// Orders the planes of profiles. Returns the order too, as indices into `profiles`.
    ///
    /// - `size`: a chord, in the mesh's unit; planes that are too close for this size are refused
    ///
    /// # Errors
    /// [`ProfileError::NoProfiles`], [`ProfileError::SamePlane`], [`ProfileError::LeansBack`], and
    /// the errors of [`Plane::of_profile`].
    pub fn new(profiles: &[Profile], size: f64) -> Result<(Self, Vec<usize>), ProfileError> {
        let mut planes = profiles.iter().map(Plane::of_profile).collect::<Result<Vec<_>, _>>()?;
        if planes.is_empty() {
            return Err(ProfileError::NoProfiles);
        }
        let reference = orient(&mut planes);
        let mean = main_direction(planes.iter().map(|plane| plane.normal).sum::<DVec3>().normalize_or(reference));
        if mean.dot(reference) < 0.0 {
            planes.iter_mut().for_each(|plane| plane.normal = -plane.normal);
        }
        let eta: Vec<f64> = planes.iter().map(|plane| plane.point.dot(mean)).collect();
        let mut order: Vec<usize> = (0..planes.len()).collect();
        order.sort_by(|&a, &b| eta[a].total_cmp(&eta[b]));
        for pair in order.windows(2) {
            let gap = eta[pair[1]] - eta[pair[0]];
            if !gap.is_finite() || gap <= SAME_PLANE * size {
                return Err(ProfileError::SamePlane {
                    first: profiles[pair[0]].number,
                    second: profiles[pair[1]].number,
                    gap,
                });
            }
        }
        if let Some(back) = planes.iter().position(|plane| plane.normal.dot(mean) < LEAST_ALONG) {
            return Err(ProfileError::LeansBack { profile: profiles[back].number });
        }
        let planes: Vec<Plane> = order.iter().map(|&i| planes[i]).collect();
        let mut eta: Vec<f64> = order.iter().map(|&i| eta[i]).collect();
        let arcs: Vec<Arc> = planes.windows(2).map(|pair| Arc::between(&pair[0], &pair[1])).collect();
        let is_back =
            |k: &usize| arcs[*k] == Arc::Crossed && planes[*k].normal.dot(planes[*k + 1].normal) < LEAST_CROSSED;
        if let Some(k) = (0..arcs.len()).find(is_back) {
            return Err(ProfileError::LeansBack { profile: profiles[order[k + 1]].number });
        }
        if arcs.iter().any(|arc| *arc != Arc::Parallel) {
            let projected = eta.clone();
            for (k, arc) in arcs.iter().enumerate() {
                eta[k + 1] = eta[k]
                    + match arc {
                        Arc::Parallel => planes[k].distance(planes[k + 1].point),
                        Arc::Turn(length) => *length,
                        Arc::Crossed => projected[k + 1] - projected[k],
                    };
            }
        }
        let mut turns: Vec<bool> = arcs.iter().map(|arc| matches!(arc, Arc::Turn(_))).collect();
        if !turns.contains(&true) {
            turns.clear();
        }
        Ok((Self { planes, eta, normal: mean, turns }, order))
    }

    /// The interval of each point, if planes turn along the span. There a plane that is continued
    /// far beyond its section may cross the wing once more, as the plane of an upright winglet's
    /// section does where the wing hangs down towards its tip.
    pub fn intervals(&self, points: &[DVec3]) -> Option<Vec<usize>> {
        (!self.turns.is_empty()).then(|| points.iter().map(|&point| self.coordinate(point).1).collect())
    }

    /// The section that stands on a surface in interval `k`, as a fence stands on a wing. `None`
    /// far from it.
    ///
    /// - `outward`: the surface's unit normal
    /// - `across`: of [`Self::across`]
    pub fn stands_on(&self, outward: DVec3, across: DVec3, k: usize) -> Option<usize> {
        if self.turns.get(k) != Some(&true) || across.dot(outward).abs() < FLOOR {
            return None;
        }
        let ways = [(k, -self.planes[k].normal), (k + 1, self.planes[k + 1].normal)];
        ways.into_iter().find(|(_, way)| way.dot(outward) > FLOOR).map(|(section, _)| section)
    }

    /// The direction about which sections run counter-clockwise at a span coordinate of interval
    /// `k`: a unit vector across them.
    pub fn across(&self, eta: f64, k: usize) -> DVec3 {
        if self.turns.is_empty() {
            return self.normal;
        }
        let Some(upper) = self.planes.get(k + 1) else { return self.planes[k].normal };
        let share = ((eta - self.eta[k]) / (self.eta[k + 1] - self.eta[k])).clamp(0.0, 1.0);
        self.planes[k].normal.lerp(upper.normal, share).normalize_or(self.normal)
    }

    /// Span coordinate of a point, and its interval: the index of the lower plane.
    pub fn coordinate(&self, point: DVec3) -> (f64, usize) {
        let n = self.planes.len();
        if n == 1 {
            return (self.eta[0], 0);
        }
        let distances = |k: usize| self.planes[k].distance(point);
        let k = (1..n - 1).find(|&k| distances(k) < 0.0).unwrap_or(n - 1) - 1;
        let (below, above) = (distances(k), distances(k + 1));
        let gap = self.eta[k + 1] - self.eta[k];
        if self.turns.get(k) == Some(&true) {
            let [low, high] = [self.eta[k] + below, self.eta[k + 1] + above];
            let eta = match (below > 0.0, above < 0.0) {
                (false, _) => low,
                (_, false) => high,
                _ => {
                    let s = below / (below - above);
                    let eta = low + (high - low) * (s * s * (3.0 - 2.0 * s));
                    eta.clamp(self.eta[k], self.eta[k + 1])
                }
            };
            return (eta, k);
        }
        // Planes that are not parallel intersect somewhere outside the wing. Near the intersection
        // the mean normal is used.
        let s = if below - above > 0.1 * gap {
            below / (below - above)
        } else {
            (point - self.planes[k].point).dot(self.normal) / gap
        };
        (self.eta[k] + s * gap, k)
    }

    /// Weights of a change at a span coordinate of interval `k`: constant beyond the outermost
    /// planes.
    pub fn change(&self, eta: f64, k: usize) -> SpanWeights {
        let [lowest, highest] = [self.eta[0], self.eta[self.eta.len() - 1]];
        let mut weights = self.inside(eta.clamp(lowest, highest), k);
        if eta < lowest || eta > highest {
            weights.slope = [0.0; 4];
        }
        weights
    }

    /// Weights of a position at a span coordinate of interval `k`: linear beyond the outermost
    /// planes.
    pub fn place(&self, eta: f64, k: usize) -> SpanWeights {
        let n = self.planes.len();
        if n >= 2 && (eta < self.eta[0] || eta > self.eta[n - 1]) { self.linear(eta, k) } else { self.inside(eta, k) }
    }

    fn linear(&self, eta: f64, k: usize) -> SpanWeights {
        let gap = self.eta[k + 1] - self.eta[k];
        let s = (eta - self.eta[k]) / gap;
        SpanWeights {
            first: k,
            count: 2,
            weight: [1.0 - s, s, 0.0, 0.0],
            slope: [-1.0 / gap, 1.0 / gap, 0.0, 0.0],
            lower: 0,
            share: s.clamp(0.0, 1.0),
        }
    }

    fn inside(&self, eta: f64, k: usize) -> SpanWeights {
        let n = self.planes.len();
        if n == 1 {
            return SpanWeights::only(0);
        }
        let mut weights = self.linear(eta, k);
        if n == 2 {
            return weights;
        }
        let (share, gap) = (weights.share, self.eta[k + 1] - self.eta[k]);
        (weights.weight, weights.slope) = ([0.0; 4], [0.0; 4]);
        if k == 0 || k + 2 >= n {
            weights.first = if k == 0 { 0 } else { n - 3 };
            weights.count = 3;
            let (weight, slope) = parabola(&self.eta[weights.first..weights.first + 3], eta);
            weights.weight[..3].copy_from_slice(&weight);
            weights.slope[..3].copy_from_slice(&slope);
        } else {
            weights.first = k - 1;
            weights.count = 4;
            let (low, low_slope) = parabola(&self.eta[k - 1..k + 2], eta);
            let (high, high_slope) = parabola(&self.eta[k..k + 3], eta);
            for i in 0..3 {
                weights.weight[i] += (1.0 - share) * low[i];
                weights.weight[i + 1] += share * high[i];
                weights.slope[i] += (1.0 - share) * low_slope[i] - low[i] / gap;
                weights.slope[i + 1] += share * high_slope[i] + high[i] / gap;
            }
        }
        weights.lower = k - weights.first;
        weights
    }
}

/// How one plane leads to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Arc {
    Parallel,
    /// By an arc of this length, in the mesh's unit.
    Turn(f64),
    /// The planes intersect in the wing.
    Crossed,
}

impl Arc {
    fn between(lower: &Plane, upper: &Plane) -> Self {
        if lower.normal.cross(upper.normal).length() < PARALLEL {
            return Self::Parallel;
        }
        let [up, down] = [lower.distance(upper.point), -upper.distance(lower.point)];
        if up.min(down) <= APART * lower.point.distance(upper.point) {
            return Self::Crossed;
        }
        let angle = lower.normal.angle_between(upper.normal);
        Self::Turn((up + down) / 2.0 * angle / angle.sin())
    }
}

/// Gives the normals of planes one side: the side along the span. Returns the normal to which most
/// others are nearly parallel.
///
/// At a winglet that stands upright the normals of wing and winglet are perpendicular, and do not
/// say which side is which. There the places of the sections do.
fn orient(planes: &mut [Plane]) -> DVec3 {
    let first = planes[0].normal;
    let mut reference = first;
    if planes.iter().any(|plane| plane.normal.dot(first).abs() < CLEAR) {
        let alike = |plane: &Plane| planes.iter().map(|other| plane.normal.dot(other.normal).abs()).sum::<f64>();
        let sums: Vec<f64> = planes.iter().map(alike).collect();
        reference = planes[(0..planes.len()).fold(0, |best, i| if sums[i] > sums[best] { i } else { best })].normal;
    }
    let mut open = Vec::new();
    let mut done = Vec::new();
    for (i, plane) in planes.iter_mut().enumerate() {
        let along = plane.normal.dot(reference);
        if along < 0.0 {
            plane.normal = -plane.normal;
        }
        if along.abs() < CLEAR { open.push((i, i, f64::INFINITY)) } else { done.push(i) }
    }
    // Each of the others with its nearest neighbour of those that have their side.
    while !open.is_empty() {
        for (i, near, square) in &mut open {
            for &j in &done {
                let distance = planes[*i].point.distance_squared(planes[j].point);
                if distance < *square {
                    (*near, *square) = (j, distance);
                }
            }
        }
        let next = (0..open.len()).fold(0, |best, at| if open[at].2 < open[best].2 { at } else { best });
        let (i, near, _) = open.swap_remove(next);
        let way = planes[i].point - planes[near].point;
        // The section comes after its neighbour on the span if it lies on the side of the
        // neighbour's normal.
        if way.dot(planes[i].normal) * way.dot(planes[near].normal) < 0.0 {
            planes[i].normal = -planes[i].normal;
        }
        done = vec![i];
    }
    reference
}

/// Values and derivatives at `x` of the three parabolas that are 1 at one of the nodes and 0 at the
/// others.
fn parabola(nodes: &[f64], x: f64) -> ([f64; 3], [f64; 3]) {
    let (mut value, mut slope) = ([0.0; 3], [0.0; 3]);
    for i in 0..3 {
        let (a, b) = (nodes[(i + 1) % 3], nodes[(i + 2) % 3]);
        let scale = (nodes[i] - a) * (nodes[i] - b);
        value[i] = (x - a) * (x - b) / scale;
        slope[i] = (2.0 * x - a - b) / scale;
    }
    (value, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A profile in the plane through `point` with the normal `normal`, which has no component
    /// along x.
    fn square(number: i64, point: DVec3, normal: DVec3) -> Profile {
        let up = DVec3::X.cross(normal);
        // Without the first point at the end the mean of the points is the middle.
        let corners = [[0.0, 0.1], [0.0, -0.1], [1.0, -0.1], [1.0, 0.1]];
        Profile { number, points: corners.iter().map(|[x, z]| point + DVec3::X * *x + up * *z).collect() }
    }

    /// Four sections of a straight wing and three of an upright winglet, with an arc of radius 0.5
    /// between.
    fn winglet(up: f64) -> Vec<Profile> {
        let side = |at: [f64; 2]| DVec3::new(0.0, at[0], up * at[1]);
        let wing = [0.0, 0.7, 1.4, 2.0].map(|y| (side([y, 0.0]), DVec3::Y));
        let winglet = [0.5, 0.7, 1.0].map(|z| (side([2.5, z]), DVec3::Z));
        let all = wing.into_iter().chain(winglet).enumerate();
        all.map(|(number, (point, normal))| square(number as i64, point, normal)).collect()
    }

    /// The coordinate is the length along the wing: on the wing and on the winglet, and on the arc
    /// to 3 % of its length. Just beyond a plane it grows by the distance.
    ///
    /// Fails if the first formula of the module is taken for all planes.
    #[test]
    fn the_coordinate_is_the_length_along_wing_and_winglet() {
        for up in [1.0, -1.0] {
            for order in [[0, 1, 2, 3, 4, 5, 6], [6, 5, 4, 3, 2, 1, 0], [4, 0, 6, 1, 5, 2, 3]] {
                let all = winglet(up);
                let given: Vec<Profile> = order.iter().map(|&i| all[i].clone()).collect();
                let (span, sorted) = Span::new(&given, 1.0).unwrap();
                let numbers: Vec<i64> = sorted.iter().map(|&i| given[i].number).collect();
                assert_eq!(numbers, [0, 1, 2, 3, 4, 5, 6], "up {up}, given {order:?}");
                let arc = 0.25 * std::f64::consts::PI;
                let at = |length: f64| match length {
                    length if length <= 2.0 => DVec3::new(0.3, length, 0.0),
                    length if length < 2.0 + arc => {
                        let (sin, cos) = ((length - 2.0) / 0.5).sin_cos();
                        DVec3::new(0.3, 2.0 + 0.5 * sin, up * (0.5 - 0.5 * cos))
                    }
                    length => DVec3::new(0.3, 2.5, up * (0.5 + length - 2.0 - arc)),
                };
                let start = span.coordinate(at(0.0)).0;
                let of = |length: f64| span.coordinate(at(length)).0 - start;
                for k in 0..=400 {
                    let length = -0.2 + 0.01 * f64::from(k);
                    let on_arc = (2.0..2.0 + arc).contains(&length);
                    let off = (of(length) - length).abs();
                    let limit = match on_arc {
                        false => 1e-12,
                        true if length < 2.015 => 0.1 * (length - 2.0) + 1e-12,
                        true => 0.03 * arc,
                    };
                    assert!(off < limit, "{off:e} at {length}, up {up}");
                }
                // The slope is 1 on both sides of the planes that end the arc.
                for end in [2.0, 2.0 + arc] {
                    for step in [-1e-6, 1e-6] {
                        let slope = (of(end + step) - of(end)) / step;
                        assert!((slope - 1.0).abs() < 1e-4, "{slope} at {end}");
                    }
                }
                // Sections run about the normals of their own planes.
                let last = span.coordinate(at(3.0));
                assert!(span.across(last.0, last.1).distance(up * DVec3::Z) < 1e-12);
                assert!(span.across(start, 0).distance(DVec3::Y) < 1e-12);
            }
        }
    }

    /// A winglet that leans back over its wing by 120 degrees is refused where its planes have no
    /// order along the mean normal.
    #[test]
    fn planes_that_lean_back_are_refused() {
        let angle = 120f64.to_radians();
        let wing = (0..12).map(|k| square(k, DVec3::new(0.0, f64::from(k as i32), 0.0), DVec3::Y));
        let tip = square(12, DVec3::new(0.0, 11.0, 1.0), DVec3::new(0.0, angle.cos(), angle.sin()));
        let refused = Span::new(&wing.chain([tip]).collect::<Vec<_>>(), 1.0).map(|_| ()).unwrap_err();
        assert!(matches!(refused, ProfileError::LeansBack { profile: 12 }), "{refused}");
    }

    /// Planes that are parallel have the coordinate of their common normal, to the bit.
    #[test]
    fn parallel_planes_have_the_distance_along_their_normal() {
        let given = [0.3, 1.7, 2.9].map(|y| square((10.0 * y) as i64, DVec3::new(0.2 * y, y, 0.1), DVec3::Y));
        let (span, _) = Span::new(&given, 1.0).unwrap();
        assert!(span.turns.is_empty() && span.eta == [0.3, 1.7, 2.9]);
        assert_eq!(span.coordinate(DVec3::new(5.0, 1.7, -3.0)), (1.7, 1));
    }

    /// Upright planes whose cosine with the mean normal is 3e-4 have no order along it, those with
    /// 3e-3 have one.
    ///
    /// Fails if `LEAST_ALONG` is 1e-4 or 1e-2.
    #[test]
    fn planes_across_the_mean_normal_are_refused() {
        for (along, is_refused) in [(3e-4, true), (3e-3, false)] {
            // The mean normal is that of twelve planes and of the tip's.
            let cos: f64 = along - 1.0 / 12.0;
            let tip = DVec3::new(0.0, cos, (1.0 - cos * cos).sqrt());
            let mean = (12.0 * DVec3::Y + tip).normalize();
            assert!((tip.dot(mean) / along - 1.0).abs() < 0.05, "{}", tip.dot(mean));
            let wing = (0..12).map(|k| square(k, DVec3::new(0.0, f64::from(k as i32), 0.0), DVec3::Y));
            let all: Vec<Profile> = wing.chain([square(12, DVec3::new(0.0, 11.5, 1.0), tip)]).collect();
            let found = Span::new(&all, 1.0).map(|_| ());
            let is_found = matches!(found, Err(ProfileError::LeansBack { profile: 12 }));
            assert_eq!(is_found, is_refused, "{along}: {found:?}");
            assert!(is_refused || found.is_ok(), "{found:?}");
        }
    }

    /// Planes that enclose an angle of 3e-7, as rounded files do, have the distance along their
    /// normal. Those that enclose 3e-6 turn.
    ///
    /// Fails if `PARALLEL` is 1e-7 or 1e-5.
    #[test]
    fn planes_that_are_parallel_but_for_rounding_do_not_turn() {
        for (angle, turns) in [(3e-7f64, false), (3e-6, true)] {
            let tip = square(1, DVec3::new(0.0, 2.0, 0.1), DVec3::new(0.0, angle.cos(), angle.sin()));
            let given = [square(0, DVec3::ZERO, DVec3::Y), tip];
            let (span, _) = Span::new(&given, 1.0).unwrap();
            assert_eq!(span.turns == [true], turns, "{angle}");
            assert!((span.eta[1] - span.eta[0] - 2.0).abs() < 1e-6, "{:?}", span.eta);
        }
    }
}
