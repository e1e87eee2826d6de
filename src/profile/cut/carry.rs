//! Sections from a wing's vertices instead of its facets.
//!
//! A plane cuts facets below the smooth surface, on a coarse mesh by half a percent of the chord.
//! The ends of the edges that cross the plane are vertices on the surface. Each of them is carried
//! into the plane along the wing's span-wise direction. Two sections give this direction at equal
//! parameter (see `curve`): the plane's own section, and a second section, the guide, in a parallel
//! plane on the vertex's side. On a ruled surface, which a wing is between its kinks, this
//! direction lies in the surface.
//!
//! The first directions come from flat cuts. Each iteration takes the directions from the sections
//! of carried vertices, and reduces the error by the ratio of the vertex's distance to the guide's
//! distance. After a few iterations the error is gone.
//!
//! The ends of an open section, and the corners of a sharp trailing edge, stay where the wing's
//! edge lines cross the plane.
//!
//! A bridge through a part (see `bridge`) is made anew between the carried pieces.
//!
//! The paper cuts old profiles from the facets.

use std::collections::HashMap;

use glam::DVec3;

use super::bridge::Bridge;
use super::flat::{FlatSection, flat_section};
use crate::geometry::nearest_on_segment;
use crate::profile::curve::{Measured, ProfileCurve, arc_length, bracket};
use crate::profile::distance::max_distance;
use crate::profile::{Plane, extent};

/// Iterations of directions and sections. The third changes a point by less than 1e-5 of the chord
/// on wings of 25 points a chord.
const TURNS: usize = 4;

/// Distance of a guide from the plane, over the largest distance of a vertex beside the plane, if
/// the wing reaches there.
const FAR: f64 = 6.0;
/// Least distance of a guide from the plane, as a share of the section's length, if the wing
/// reaches there.
const GUIDE: f64 = 0.25;
/// Shares of the guide's distance that are tried in turn where the wing ends before. A guide nearer
/// than twice a vertex's distance would make errors grow.
const NEARER: [f64; 4] = [1.0, 0.75, 0.5, 0.34];

/// Bent lines are taken if their section turns by less than this share of the turn with straight
/// lines. On a straight wing both are alike, and rounding must not decide.
const SMOOTHER: f64 = 0.9;

/// Bent lines are tried if the section turns by more than this many times the turn of the flat cut.
const ROUGH: f64 = 1.05;

/// A carried section is refused if it turns by more than this many times the turn of the flat cut.
const ROUGHER: f64 = 1.2;

/// Facets with a smaller sag, as a share of the section's length, count as the surface itself.
const FLAT: f64 = 1e-6;

/// A carried section is refused if a vertex arrives farther from the flat cut than this share of
/// the section's length: facets have less sag.
const LOST: f64 = 0.05;

/// A guide belongs to the same wing if its length is within this factor of the section's length.
const ALIKE: f64 = 1.5;

/// A carried vertex is left out if it is nearer to a kept one than this share of the spacing along
/// the section. The vertices next to the plane are kept first.
const CROWDED: f64 = 0.15;

/// The section defined by the vertices beside a plane, in the order of the flat cut.
///
/// It equals the flat cut if no complete section in the distance of a guide gives the direction on
/// either side.
///
/// - `vertices` `[n_vertices]`: positions, in the mesh's unit
/// - `faces`: the wing's triangles and quadrilaterals
pub(in crate::profile) fn carried(
    vertices: &[DVec3],
    faces: &[impl AsRef<[u32]>],
    plane: &Plane,
    flat: &FlatSection,
) -> Vec<DVec3> {
    let mut strips = vec![Strip::new(vertices, *plane, flat)];
    let length = strips[0].length;
    let way = strips[0].beside.iter().map(|beside| beside.height.abs()).fold(0.0, f64::max);
    let away = f64::max(FAR * way, GUIDE * length);
    for side in [-1.0, 1.0] {
        let guide = NEARER.iter().find_map(|share| {
            let at = Plane { point: plane.point + plane.normal * (side * share * away), normal: plane.normal };
            let flat_guide = flat_section(vertices, faces, &at).ok()?;
            let of_same_kind =
                flat_guide.is_closed() == flat.is_closed() && flat_guide.base.is_some() == flat.base.is_some();
            let strip = of_same_kind.then(|| Strip::new(vertices, at, &flat_guide))?;
            (strip.length < ALIKE * length && length < ALIKE * strip.length).then_some(strip)
        });
        match guide {
            Some(guide) if side < 0.0 => strips.insert(0, guide),
            Some(guide) => strips.push(guide),
            None => {}
        }
    }
    if strips.len() == 1 {
        return flat.points();
    }
    let own = strips.iter().position(|strip| strip.plane.point == plane.point).unwrap_or(0);
    let flat = flat.points();
    let along = |lines| {
        let mut strips = strips.clone();
        for _ in 0..TURNS {
            let carried: Vec<Vec<DVec3>> = (0..strips.len()).map(|i| strips[i].carry(&strips, i, lines)).collect();
            let between = between_guides(&strips, own);
            for (i, (strip, carried)) in strips.iter_mut().zip(carried).enumerate() {
                strip.take(carried, between.as_deref().filter(|_| i == own));
            }
        }
        strips.swap_remove(own).points
    };
    let mut carried = along(Lines::Straight);
    if strips.len() == 3 && turning(&carried) > ROUGH * turning(&flat) {
        let bent = along(Lines::Bent);
        carried = if turning(&bent) < SMOOTHER * turning(&carried) { bent } else { carried };
    }
    let found = |carried: &Vec<DVec3>| {
        let off = max_distance(carried, &flat);
        (FLAT * length..LOST * length).contains(&off) && turning(carried) <= ROUGHER * turning(&flat)
    };
    if found(&carried) { carried } else { flat }
}

/// The shape of the wing's span-wise lines near the plane. At a kink the wing has straight lines on
/// both sides. A wing bent along its span has curved ones. The shape with the smoother section is
/// taken.
#[derive(Clone, Copy)]
enum Lines {
    /// Straight from the plane to the guide on either side.
    Straight,
    /// Parabolas through both guides.
    Bent,
}

/// Total angle by which a curve turns, in radians; left and right turns count alike.
fn turning(points: &[DVec3]) -> f64 {
    points.windows(3).map(|corner| (corner[1] - corner[0]).angle_between(corner[2] - corner[1])).sum()
}

/// The displacement into a plane from a height above it, along the parabola through all sections at
/// one parameter.
fn bent(into: &Strip, strips: &[Strip], tau: f64, height: f64) -> DVec3 {
    let heights: Vec<f64> = strips.iter().map(|strip| into.plane.distance(strip.plane.point)).collect();
    let weight = |i: usize, x: f64| -> f64 {
        let others = heights.iter().enumerate().filter(|&(j, _)| j != i);
        others.map(|(_, other)| (x - other) / (heights[i] - other)).product()
    };
    let way = |i: usize| strips[i].line.point(tau) * (weight(i, 0.0) - weight(i, height));
    (0..strips.len()).map(way).sum()
}

/// The section between two guides: straight lines join them at equal parameter. `None` if a guide
/// is missing, or if the section has no bridge.
fn between_guides(strips: &[Strip], own: usize) -> Option<Vec<DVec3>> {
    let ([low, middle, high], 1) = (strips, own) else { return None };
    if middle.bridges.is_empty() {
        return None;
    }
    let [below, above] = [low, high].map(|guide| middle.plane.distance(guide.plane.point));
    let share = below / (below - above);
    let line = low.line.path.iter().zip(&low.line.tau);
    Some(line.map(|(&point, &tau)| point.lerp(high.line.point(tau), share)).collect())
}

/// A plane's section with the vertices beside the plane.
#[derive(Clone)]
struct Strip {
    plane: Plane,
    beside: Vec<Beside>,
    /// First and last point, and the corner where a base begins. They do not change.
    corners: Vec<DVec3>,
    closed: bool,
    /// The bridges of the section, each with a share of the arc length inside it, ascending.
    bridges: Vec<(f64, Bridge)>,
    /// The section after the last iteration.
    points: Vec<DVec3>,
    line: Line,
    /// Extent of the section, in the mesh's unit.
    length: f64,
}

/// A vertex at an edge that crosses the plane.
#[derive(Clone)]
struct Beside {
    position: DVec3,
    /// Signed distance from the plane.
    height: f64,
    /// Range of shares of the section's arc length in which the vertex's parameter is searched:
    /// around the crossings of its edges.
    window: [f64; 2],
    /// Position of the vertex's first crossing along the section, and distance to the next vertex
    /// on its side of the plane.
    order: f64,
    spacing: f64,
    /// Approximate direction of the section there. At a thin leading edge it distinguishes the two
    /// sides.
    along: DVec3,
}

/// A section in small steps, with the common parameter.
#[derive(Clone)]
struct Line {
    path: Vec<DVec3>,
    tau: Vec<f64>,
    /// Share of the arc length at each step.
    share: Vec<f64>,
}

impl Line {
    fn new(points: &[DVec3], base: Option<usize>) -> Self {
        let sides = Measured::sides(ProfileCurve::new(&points[..=base.unwrap_or(points.len() - 1)]).path);
        let (mut path, mut tau) = (sides.path, sides.tau);
        if let Some(base) = base {
            let base = Measured::base(ProfileCurve::new(&points[base..]).path);
            path.extend(&base.path[1..]);
            tau.extend(&base.tau[1..]);
        }
        let arc = arc_length(&path);
        let total = arc[arc.len() - 1].max(f64::MIN_POSITIVE);
        Self { path, tau, share: arc.iter().map(|s| s / total).collect() }
    }

    /// Parameter and share of arc length of the point nearest to `at`, between two shares of the
    /// arc length.
    ///
    /// - `along`: only steps in this direction count; with zero all steps count
    fn nearest(&self, at: DVec3, window: [f64; 2], along: DVec3) -> (f64, f64) {
        let n = self.path.len();
        let first = self.share.partition_point(|&share| share < window[0]).clamp(1, n - 1);
        let last = self.share.partition_point(|&share| share <= window[1]).clamp(first, n - 1);
        let candidates = |looking: bool| {
            let steps = (first..=last)
                .filter(move |&step| !looking || (self.path[step] - self.path[step - 1]).dot(along) > 0.0);
            let all = steps.map(|step| {
                let (point, t) = nearest_on_segment(at, self.path[step - 1], self.path[step]);
                (point.distance_squared(at), step, t)
            });
            all.min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let (_, step, t) = candidates(true).or_else(|| candidates(false)).unwrap_or((0.0, 1, 0.0));
        let between = |values: &[f64]| values[step - 1] + (values[step] - values[step - 1]) * t;
        (between(&self.tau), between(&self.share))
    }

    fn point(&self, tau: f64) -> DVec3 {
        let (i, t) = bracket(&self.tau, tau);
        self.path[i].lerp(self.path[i + 1], t)
    }
}

impl Strip {
    fn new(vertices: &[DVec3], plane: Plane, flat: &FlatSection) -> Self {
        let points = flat.points();
        let arc = arc_length(&points);
        let total = arc[arc.len() - 1].max(f64::MIN_POSITIVE);
        let n = points.len();
        let mut found: HashMap<u32, Beside> = HashMap::new();
        for (i, crossing) in flat.crossings.iter().enumerate() {
            // The ends do not change.
            if i == 0 || i + 1 == n || Some(i) == flat.base {
                continue;
            }
            for end in crossing.edges.iter().flatten() {
                let position = vertices[*end as usize];
                let height = plane.distance(position);
                let reach = 1.5 * position.distance(crossing.at);
                let window = [(arc[i] - reach) / total, (arc[i] + reach) / total];
                let order = arc[i] / total;
                let beside = found.entry(*end).or_insert(Beside {
                    position,
                    height,
                    window,
                    order,
                    spacing: f64::INFINITY,
                    along: DVec3::ZERO,
                });
                beside.window = [beside.window[0].min(window[0]), beside.window[1].max(window[1])];
                beside.along += points[i + 1] - points[i - 1];
            }
        }
        let mut beside: Vec<Beside> = found.into_values().collect();
        // If all vertices on one side lie in the plane, they are the section.
        let (below, above) = beside.iter().fold((0.0, 0.0), |(l, h), b| (f64::min(l, b.height), f64::max(h, b.height)));
        if (below == 0.0 || above == 0.0) && beside.iter().any(|beside| beside.height == 0.0) {
            beside.retain(|beside| beside.height == 0.0);
        }
        let key = |b: &Beside| (b.order, b.position.x, b.position.y, b.position.z);
        beside.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
        for above in [false, true] {
            let side: Vec<usize> = (0..beside.len()).filter(|&i| (beside[i].height >= 0.0) == above).collect();
            for pair in side.windows(2) {
                let gap = beside[pair[0]].position.distance(beside[pair[1]].position);
                for &i in pair {
                    beside[i].spacing = beside[i].spacing.min(gap);
                }
            }
        }
        let corners = [Some(0), flat.base, Some(n - 1)].into_iter().flatten().map(|i| points[i]).collect();
        let line = Line::new(&points, flat.base);
        let length = extent(&points);
        let runs = flat.bridge_runs().into_iter();
        let bridges = runs.map(|(run, bridge)| ((arc[run.start] + arc[run.end - 1]) / (2.0 * total), bridge.clone()));
        let bridges = bridges.collect();
        Self { plane, beside, corners, closed: flat.is_closed(), bridges, points, line, length }
    }

    /// The point at which each vertex beside the plane arrives in it. `strips[own]` is `self`.
    fn carry(&self, strips: &[Self], own: usize, lines: Lines) -> Vec<DVec3> {
        let carry = |beside: &Beside| {
            // The pair of sections on the vertex's side of the plane, or the other pair where the
            // wing ends.
            let low = if beside.height < 0.0 { own.saturating_sub(1) } else { own.min(strips.len().saturating_sub(2)) };
            let straight = beside.position - self.plane.normal * beside.height;
            let mut at = straight;
            for _ in 0..3 {
                let (tau, _) = self.line.nearest(at, beside.window, beside.along);
                at = beside.position
                    + match lines {
                        Lines::Straight => {
                            let along = strips[low + 1].line.point(tau) - strips[low].line.point(tau);
                            along * (-beside.height / along.dot(self.plane.normal))
                        }
                        Lines::Bent => bent(self, strips, tau, beside.height),
                    };
            }
            at - self.plane.normal * self.plane.distance(at)
        };
        self.beside.iter().map(carry).collect()
    }

    /// Makes the section of the carried vertices.
    ///
    /// - `between`: a curve like the section, from the guides
    fn take(&mut self, carried: Vec<DVec3>, between: Option<&[DVec3]>) {
        let last = self.corners.len() - 1;
        // The shares of the arc length order the points. Corners keep the ends of their sides.
        let corner_shares: Vec<f64> = match last {
            2 => vec![0.0, self.line.nearest(self.corners[1], [0.0, 1.0], DVec3::ZERO).1, 1.0],
            _ => vec![0.0, 1.0],
        };
        let mut kept: Vec<(f64, DVec3)> = corner_shares.iter().copied().zip(self.corners.iter().copied()).collect();
        let mut order: Vec<usize> = (0..carried.len()).filter(|&i| carried[i].is_finite()).collect();
        order.sort_by(|&a, &b| self.beside[a].height.abs().total_cmp(&self.beside[b].height.abs()).then(a.cmp(&b)));
        for i in order {
            let (_, share) = self.line.nearest(carried[i], self.beside[i].window, self.beside[i].along);
            let place = kept.partition_point(|other| other.0 <= share).clamp(1, kept.len() - 1);
            let near = |other: &(f64, DVec3)| other.1.distance(carried[i]) < CROWDED * self.beside[i].spacing;
            if !near(&kept[place - 1]) && !near(&kept[place]) {
                kept.insert(place, (share, carried[i]));
            }
        }
        let mut inside = Vec::new();
        for (middle, bridge) in self.bridges.iter().rev() {
            let place = kept.partition_point(|other| other.0 <= *middle);
            let (before, after): (Vec<DVec3>, Vec<DVec3>) = (
                kept[..place].iter().rev().map(|other| other.1).collect(),
                kept[place..].iter().map(|other| other.1).collect(),
            );
            let points = bridge.points(&before, &after, &self.plane, between);
            inside.push(points[points.len() / 2]);
            kept.splice(place..place, points.into_iter().map(|point| (*middle, point)));
        }
        let base = (last == 2).then(|| kept.iter().position(|other| other.1 == self.corners[1])).flatten();
        self.points = kept.into_iter().map(|(_, point)| point).collect();
        debug_assert!(!self.closed || self.points.first() == self.points.last());
        self.line = Line::new(&self.points, base);
        for ((middle, _), point) in self.bridges.iter_mut().zip(inside.into_iter().rev()) {
            *middle = self.line.nearest(point, [0.0, 1.0], DVec3::ZERO).1;
        }
    }
}
