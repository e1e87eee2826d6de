//! Continuation of a surface across a hole, for vertices that move into the hole.
//!
//! A carenage ends at the wing's root. If the new root is thinner, the junction moves into the old
//! root, where there is no original surface. The paper does not treat this case.
//!
//! Here a polyharmonic spline closes the hole: the triharmonic interpolant `r^4 ln r` with
//! quadratic terms, through the rim and the surface around it, over the rim's own plane. At the rim
//! it has the tangents and the curvature of the surface, and it reproduces a paraboloid exactly.
//! The biharmonic (thin plate) spline is too flat: across a cylinder it lost 3 % of the sagitta.
//! The spline is sampled on a triangular lattice and triangulated, so one search serves the surface
//! and its continuation.

mod change;

pub use change::FillingChange;

use glam::{DVec2, DVec3};
use nalgebra::{DMatrix, DVector};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use thiserror::Error;

use crate::geometry::{corners, nearest_on_segment, triangle_normal, unit_normal};
use crate::text::figures::near;

/// An error of a continuation.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ContinuationError {
    /// The projection of the rim on its own plane crosses itself.
    #[error(
        "the hole's rim near {} folds over itself when seen along its axis; the surface cannot be continued across it",
        near(*at)
    )]
    RimFolds {
        /// A point of the rim, in the mesh's unit.
        at: DVec3,
    },
    /// The interpolation has no solution.
    #[error("the surface around the hole near {} does not determine a continuation", near(*at))]
    Undetermined {
        /// A point of the rim, in the mesh's unit.
        at: DVec3,
    },
}

/// Points and triangles that close a hole.
#[derive(Clone, Debug, Default)]
pub struct HoleFilling {
    /// New points, in the mesh's unit. Their numbers follow the numbers of the old points.
    pub points: Vec<DVec3>,
    /// Triangles of old points (the rim) and new points, oriented like the surface around.
    pub triangles: Vec<[u32; 3]>,
}

/// Most samples that the spline interpolates. The cost of its dense system grows with the third
/// power.
const MOST_SAMPLES: usize = 400;

/// Coordinates in the chart, which are about 1, are alike if they differ by less.
const ALIKE: f64 = 1e-9;

/// Closes a hole in a surface.
///
/// - `points` `[n_points]`: in any unit
/// - `triangles` `[n_triangles]`: the surface, as indices into `points`
/// - `rim`: vertices of the loop around the hole, in order
///
/// # Errors
/// - [`ContinuationError::RimFolds`]: the rim crosses itself when seen along its axis
/// - [`ContinuationError::Undetermined`]: the rim is too degenerate to carry a surface
pub fn close(points: &[DVec3], triangles: &[[u32; 3]], rim: &[u32]) -> Result<HoleFilling, ContinuationError> {
    let Patch { chart, spline, inside, faces, .. } = Patch::new(points, triangles, rim)?;
    let vertex = |corner: usize| match corner.checked_sub(rim.len()) {
        None => rim[corner],
        Some(new) => (points.len() + new) as u32,
    };
    Ok(HoleFilling {
        points: inside.iter().map(|&flat| chart.lift(flat, spline.height(flat))).collect(),
        triangles: faces.into_iter().map(|face| face.map(vertex)).collect(),
    })
}

/// What closes a hole, over its chart.
struct Patch {
    chart: Chart,
    samples: Vec<Sample>,
    spline: Spline,
    /// The new points.
    inside: Vec<DVec2>,
    /// Triangles of the rim's and the new points.
    faces: Vec<[usize; 3]>,
}

impl Patch {
    /// Arguments and errors as for [`close`].
    fn new(points: &[DVec3], triangles: &[[u32; 3]], rim: &[u32]) -> Result<Self, ContinuationError> {
        let rim_points: Vec<DVec3> = rim.iter().map(|&vertex| points[vertex as usize]).collect();
        let chart = Chart::new(&rim_points, points, triangles, rim);
        let polygon: Vec<DVec2> = rim_points.iter().map(|&point| chart.flat(point)).collect();
        let samples = samples(points, triangles, rim, &chart, &polygon);
        let undetermined = || ContinuationError::Undetermined { at: rim_points[0] };
        let spline = Spline::new(&samples).ok_or_else(undetermined)?;
        let (inside, faces) = triangulate(&polygon).ok_or(ContinuationError::RimFolds { at: rim_points[0] })?;
        Ok(Self { chart, samples, spline, inside, faces })
    }
}

/// Coordinates over the rim's plane, scaled by the size of the rim.
#[derive(Debug)]
struct Chart {
    origin: DVec3,
    axes: [DVec3; 3],
    size: f64,
}

impl Chart {
    fn new(rim_points: &[DVec3], points: &[DVec3], triangles: &[[u32; 3]], rim: &[u32]) -> Self {
        let n = rim_points.len() as f64;
        let origin = rim_points.iter().sum::<DVec3>() / n;
        let area: DVec3 = (0..rim_points.len())
            .map(|at| (rim_points[at] - origin).cross(rim_points[(at + 1) % rim_points.len()] - origin))
            .sum();
        let on_rim: std::collections::HashSet<u32> = rim.iter().copied().collect();
        let outward: DVec3 = triangles
            .iter()
            .filter(|triangle| triangle.iter().any(|vertex| on_rim.contains(vertex)))
            .map(|triangle| triangle_normal(corners(points, *triangle)))
            .sum();
        let normal = area.normalize_or(DVec3::Z) * if area.dot(outward) < 0.0 { -1.0 } else { 1.0 };
        // The axes come from the rim's own shape, so the continuation turns and scales with the
        // mesh.
        let (u, v) = normal.any_orthonormal_pair();
        let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
        for &point in rim_points {
            let (a, b) = ((point - origin).dot(u), (point - origin).dot(v));
            uu += a * a;
            uv += a * b;
            vv += b * b;
        }
        let angle = 0.5 * f64::atan2(2.0 * uv, uu - vv);
        let mut first = u * angle.cos() + v * angle.sin();
        if rim_points.iter().map(|&point| (point - origin).dot(first).powi(3)).sum::<f64>() < 0.0 {
            first = -first;
        }
        let size = rim_points.iter().map(|point| point.distance(origin)).fold(0.0, f64::max);
        Self { origin, axes: [first, normal.cross(first), normal], size }
    }

    fn flat(&self, point: DVec3) -> DVec2 {
        let offset = (point - self.origin) / self.size;
        DVec2::new(offset.dot(self.axes[0]), offset.dot(self.axes[1]))
    }

    fn height(&self, point: DVec3) -> f64 {
        (point - self.origin).dot(self.axes[2]) / self.size
    }

    fn lift(&self, flat: DVec2, height: f64) -> DVec3 {
        self.origin + self.size * (flat.x * self.axes[0] + flat.y * self.axes[1] + height * self.axes[2])
    }
}

/// A point at whose place in the chart the spline has the point's height.
#[derive(Debug)]
struct Sample {
    point: u32,
    flat: DVec2,
    height: f64,
}

/// Heights of the rim's vertices and of vertices around it: the surface within one width of the
/// hole, as far as it is a graph over the rim's plane.
///
/// Where they are too many, the order in which some are left out comes from their places in the
/// chart. So it depends neither on the numbers of the vertices nor on the first vertex of the rim,
/// and that of a mirror image is the mirror image.
fn samples(points: &[DVec3], triangles: &[[u32; 3]], rim: &[u32], chart: &Chart, polygon: &[DVec2]) -> Vec<Sample> {
    let narrow = polygon.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max)
        - polygon.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    let longest =
        (0..polygon.len()).map(|at| polygon[at].distance(polygon[(at + 1) % polygon.len()])).fold(0.0, f64::max);
    let reach = narrow.max(3.0 * longest).min(1.0);
    let mut around = std::collections::BTreeSet::new();
    for triangle in triangles {
        let facing = unit_normal(corners(points, *triangle)).dot(chart.axes[2]);
        if facing > 0.3 {
            around.extend(triangle);
        }
    }
    rim.iter().for_each(|vertex| {
        around.remove(vertex);
    });
    let sample = |point: u32, flat: DVec2| Sample { point, flat, height: chart.height(points[point as usize]) };
    let mut around: Vec<Sample> = around
        .into_iter()
        .map(|&vertex| sample(vertex, chart.flat(points[vertex as usize])))
        .filter(|&Sample { flat, .. }| distance_to_polygon(flat, polygon) < reach && !inside(flat, polygon))
        .collect();
    // The chart of a mirror image has the other hand.
    let hand = if polygon.iter().map(|p| p.y.powi(3)).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
    // Rounded, so that rounding does not order vertices of the same place along an axis.
    let place = |flat: DVec2| [flat.x, hand * flat.y].map(|x| (x / ALIKE).round() as i64);
    around.sort_by_key(|sample| place(sample.flat));
    let n = rim.len();
    let first = (0..n).max_by_key(|&at| place(polygon[at])).unwrap_or(0);
    let on_rim = (0..n).map(|k| if hand > 0.0 { (first + k) % n } else { (first + n - k) % n });
    let thin = |count: usize, most: usize| count.div_ceil(most.max(1)).max(1);
    let rim_step = thin(rim.len(), MOST_SAMPLES / 2);
    let around_step = thin(around.len(), MOST_SAMPLES - rim.len().div_ceil(rim_step));
    on_rim
        .step_by(rim_step)
        .map(|at| sample(rim[at], polygon[at]))
        .chain(around.into_iter().step_by(around_step))
        .collect()
}

#[derive(Debug)]
struct Spline {
    centres: Vec<DVec2>,
    coefficients: Vec<f64>,
}

impl Spline {
    fn new(samples: &[Sample]) -> Option<Self> {
        let n = samples.len();
        if n < TERMS {
            return None;
        }
        let mut right = DVector::zeros(n + TERMS);
        samples.iter().enumerate().for_each(|(i, sample)| right[i] = sample.height);
        let coefficients: Vec<f64> = Self::matrix(samples).lu().solve(&right)?.iter().copied().collect();
        let centres = samples.iter().map(|sample| sample.flat).collect();
        coefficients.iter().all(|c| c.is_finite()).then_some(Self { centres, coefficients })
    }

    /// The matrix of the coefficients, which is symmetric.
    fn matrix(samples: &[Sample]) -> DMatrix<f64> {
        let n = samples.len();
        let mut matrix = DMatrix::zeros(n + TERMS, n + TERMS);
        for (i, &Sample { flat: p, .. }) in samples.iter().enumerate() {
            for (j, &Sample { flat: q, .. }) in samples.iter().enumerate() {
                matrix[(i, j)] = kernel(p.distance_squared(q));
            }
            for (k, term) in quadratic(p).into_iter().enumerate() {
                matrix[(i, n + k)] = term;
                matrix[(n + k, i)] = term;
            }
        }
        matrix
    }

    fn height(&self, at: DVec2) -> f64 {
        let n = self.centres.len();
        let bent: f64 = self
            .centres
            .iter()
            .zip(&self.coefficients)
            .map(|(&centre, &weight)| weight * kernel(at.distance_squared(centre)))
            .sum();
        bent + quadratic(at).iter().zip(&self.coefficients[n..]).map(|(term, weight)| term * weight).sum::<f64>()
    }
}

const TERMS: usize = 6;

fn quadratic(p: DVec2) -> [f64; TERMS] {
    [1.0, p.x, p.y, p.x * p.x, p.x * p.y, p.y * p.y]
}

/// `r^4 ln r`, from the squared radius.
fn kernel(r_squared: f64) -> f64 {
    if r_squared > 0.0 { 0.5 * r_squared * r_squared * r_squared.ln() } else { 0.0 }
}

/// Least distance of the inner points in the chart. The chart spans [-1, 1], so there are some ten
/// thousand of them at most.
const LEAST_SPACING: f64 = 0.01;

/// The median length of a polygon's edges.
fn middle_edge(polygon: &[DVec2]) -> f64 {
    let n = polygon.len();
    let mut edges: Vec<f64> = (0..n).map(|at| polygon[at].distance(polygon[(at + 1) % n])).collect();
    edges.sort_unstable_by(f64::total_cmp);
    edges[n / 2]
}

/// Points inside the polygon, and triangles of the polygon's and the inner points,
/// counter-clockwise. `None` if the polygon crosses itself.
fn triangulate(polygon: &[DVec2]) -> Option<(Vec<DVec2>, Vec<[usize; 3]>)> {
    let n = polygon.len();
    let spacing = middle_edge(polygon).max(LEAST_SPACING);
    let mut cdt: ConstrainedDelaunayTriangulation<Point2<f64>> = ConstrainedDelaunayTriangulation::new();
    let mut handles = Vec::with_capacity(n);
    for point in polygon {
        let handle = cdt.insert(Point2::new(point.x, point.y)).ok()?;
        if handle.index() != handles.len() {
            return None;
        }
        handles.push(handle);
    }
    for at in 0..n {
        let (from, to) = (handles[at], handles[(at + 1) % n]);
        if !cdt.can_add_constraint(from, to) {
            return None;
        }
        cdt.add_constraint(from, to);
    }
    let mut points = Vec::new();
    // A triangular lattice. No four of its points lie on an empty circle, so rounding cannot change
    // the triangulation.
    let rows = (1.0 / (spacing * 0.75f64.sqrt())).ceil() as i64;
    let columns = (1.0 / spacing).ceil() as i64 + 1;
    for row in -rows..=rows {
        for column in -columns..=columns {
            let shift = if row % 2 == 0 { 0.0 } else { 0.5 };
            let point = DVec2::new((column as f64 + shift) * spacing, row as f64 * spacing * 0.75f64.sqrt());
            if inside(point, polygon) && distance_to_polygon(point, polygon) > 0.4 * spacing {
                cdt.insert(Point2::new(point.x, point.y)).ok()?;
                points.push(point);
            }
        }
    }
    let faces = cdt
        .inner_faces()
        .map(|face| {
            face.vertices().map(|vertex| (vertex.index(), DVec2::new(vertex.position().x, vertex.position().y)))
        })
        .filter(|corners| inside(corners.iter().map(|&(_, point)| point).sum::<DVec2>() / 3.0, polygon))
        .map(|corners| corners.map(|(index, _)| index))
        .collect();
    Some((points, faces))
}

/// Whether a point lies inside a polygon, by the number of edges that a ray crosses.
fn inside(point: DVec2, polygon: &[DVec2]) -> bool {
    let n = polygon.len();
    (0..n)
        .filter(|&at| {
            let (a, b) = (polygon[at], polygon[(at + 1) % n]);
            (a.y > point.y) != (b.y > point.y) && point.x < a.x + (b.x - a.x) * (point.y - a.y) / (b.y - a.y)
        })
        .count()
        % 2
        == 1
}

fn distance_to_polygon(point: DVec2, polygon: &[DVec2]) -> f64 {
    let n = polygon.len();
    (0..n)
        .map(|at| {
            let [point, a, b] = [point, polygon[at], polygon[(at + 1) % n]].map(|at| at.extend(0.0));
            point.distance(nearest_on_segment(point, a, b).0)
        })
        .fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An egg-shaped hole in a lattice, with more vertices on its rim and around it than are
    /// sampled. The mirror image of the surface, with other numbers and another first vertex of the
    /// rim, is closed by the mirror image.
    ///
    /// Fails if samples are left out in the order of the vertices' numbers, or along the rim from
    /// its first vertex.
    #[test]
    fn a_mirror_image_is_closed_by_the_mirror_image() {
        let (n, h) = (190i32, 0.0231);
        let height = |x: f64, y: f64| 0.1 * x * x - 0.2 * (0.7 * x).sin() * y + 0.3 * (y - 0.2 * x).cos();
        let number = |i: i32, j: i32| (j * (n + 1) + i) as u32;
        let is_inside = |i: i32, j: i32| {
            let [x, y] = [i, j].map(|k| h * (f64::from(k) + 0.5 - 0.5 * f64::from(n)));
            x * x * (1.0 + 0.2 * x) + y * y * (1.5 + 0.3 * y) < 1.7
        };
        let points: Vec<DVec3> = (0..=n)
            .flat_map(|j| (0..=n).map(move |i| [i, j].map(|k| h * (f64::from(k) - 0.5 * f64::from(n)))))
            .map(|[x, y]| DVec3::new(x, y, height(x, y)))
            .collect();
        let mut triangles = Vec::new();
        let mut next_on_rim = std::collections::BTreeMap::new();
        for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
            let corners = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
            if !is_inside(i, j) {
                triangles.extend([[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]);
                continue;
            }
            for (side, (di, dj)) in [(0, -1), (1, 0), (0, 1), (-1, 0)].into_iter().enumerate() {
                if !is_inside(i + di, j + dj) {
                    next_on_rim.insert(corners[side], corners[(side + 1) % 4]);
                }
            }
        }
        let start = *next_on_rim.keys().next().unwrap();
        let mut rim = vec![start];
        while next_on_rim[rim.last().unwrap()] != start {
            rim.push(next_on_rim[rim.last().unwrap()]);
        }
        let filling = close(&points, &triangles, &rim).unwrap();
        // Every third vertex of the rim is a sample: others from another first vertex, or the other
        // way round.
        assert!(rim.len() > MOST_SAMPLES && rim.len() < 3 * MOST_SAMPLES / 2 && rim.len() % 3 != 0, "{}", rim.len());

        let mirrored = |at: DVec3| DVec3::new(at.x, -at.y, at.z);
        let all = points.len() as u32;
        let renumbered = |vertex: u32| (vertex * 7 + 3) % all;
        assert_ne!(all % 7, 0);
        let mut other_points = vec![DVec3::ZERO; points.len()];
        (0..all).for_each(|vertex| other_points[renumbered(vertex) as usize] = mirrored(points[vertex as usize]));
        let other_triangles: Vec<[u32; 3]> =
            triangles.iter().rev().map(|&[a, b, c]| [c, b, a].map(renumbered)).collect();
        let mut other_rim: Vec<u32> = rim.iter().rev().map(|&vertex| renumbered(vertex)).collect();
        other_rim.rotate_left(4);
        let other = close(&other_points, &other_triangles, &other_rim).unwrap();
        assert_eq!(other.points.len(), filling.points.len());
        for &at in filling.points.iter().step_by(20) {
            let off = other.points.iter().map(|&point| mirrored(point).distance(at)).fold(f64::INFINITY, f64::min);
            assert!(off < 1e-9, "{at}: {off:e}");
        }
    }
}
