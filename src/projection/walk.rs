//! Closest points near a vertex of a moved surface, found by a walk: from triangle to triangle of
//! one smooth part, or along a curve.
//!
//! A vertex slides by a few edges at most. So a walk is shorter than a search, needs no tree, and
//! never ends on the other side of a thin trailing edge.

use glam::DVec3;

use super::Closest;
use crate::geometry::{self, closest_on_triangle, nearest_on_segment, triangle_normal, unit_normal};
use crate::mesh::csr::Csr;

/// A surface in smooth parts. A walk does not leave its part.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// Points `[n_points]`, in any unit.
    pub points: &'a [DVec3],
    /// Triangles `[n_triangles]`.
    pub triangles: &'a [[u32; 3]],
    /// Triangles around each point: `n_points` rows.
    pub around: &'a Csr,
    /// The part of each triangle `[n_triangles]`.
    pub part: &'a [u32],
}

impl Parts<'_> {
    /// The point of a part nearest to `at` that a walk from triangle `start` reaches. Each step of
    /// the walk reduces the distance. Among equally near triangles the first one reached wins.
    pub fn closest(&self, start: u32, at: DVec3) -> Closest {
        let mut best = self.on(start, at);
        loop {
            let before = best.triangle;
            for other in self.triangles[before as usize].into_iter().flat_map(|point| self.of_part(point, start)) {
                let on = self.on(other, at);
                if on.distance_squared < best.distance_squared {
                    best = on;
                }
            }
            if best.triangle == before {
                return best;
            }
        }
    }

    /// The triangle nearest to `at` of those around a point that belong to the part of `triangle`.
    pub fn nearest_around(&self, point: u32, triangle: u32, at: DVec3) -> u32 {
        let around = self.of_part(point, triangle).map(|other| self.on(other, at));
        around.min_by(|a, b| a.distance_squared.total_cmp(&b.distance_squared)).map_or(triangle, |on| on.triangle)
    }

    /// Unit normal of a part at one of its points, continuous across edges.
    pub fn normal(&self, on: &Closest) -> DVec3 {
        let [a, b, c] = self.triangles[on.triangle as usize].map(|point| self.point_normal(point, on.triangle));
        let [u, v, w] = on.barycentric;
        (a * u + b * v + c * w).normalize_or_zero()
    }

    /// The point of a curved triangle over a point of its flat one: half-way between the flat
    /// triangle and the mean of the tangent planes at its corners (Phong tessellation; Boubekeur
    /// and Alexa, ACM Trans. Graph. 27(5), 2008, with the weight 1/2, which is exact for quadrics
    /// with their own normals). Corners stay where they are, and the surface is continuous across
    /// edges.
    pub fn curved(&self, on: &Closest) -> DVec3 {
        let corners = self.corners(on.triangle);
        let normals = self.triangles[on.triangle as usize].map(|point| self.point_normal(point, on.triangle));
        let planes = (0..3).map(|k| {
            let rise = (corners[k] - on.point).dot(normals[k]);
            on.barycentric[k] * rise * normals[k]
        });
        on.point + 0.5 * planes.sum::<DVec3>()
    }

    /// Unit normal of one triangle.
    pub fn facet_normal(&self, triangle: u32) -> DVec3 {
        unit_normal(self.corners(triangle))
    }

    /// Unit normal at a point of the part of `triangle`, weighted by area.
    pub fn point_normal(&self, point: u32, triangle: u32) -> DVec3 {
        let area = self.of_part(point, triangle).map(|triangle| triangle_normal(self.corners(triangle)));
        area.sum::<DVec3>().normalize_or_zero()
    }

    /// The triangles around a point in the same part as `triangle`.
    pub fn of_part(&self, point: u32, triangle: u32) -> impl Iterator<Item = u32> {
        let part = self.part[triangle as usize];
        self.around.row(point as usize).iter().copied().filter(move |&other| self.part[other as usize] == part)
    }

    fn corners(&self, triangle: u32) -> [DVec3; 3] {
        geometry::corners(self.points, self.triangles[triangle as usize])
    }

    fn on(&self, triangle: u32, at: DVec3) -> Closest {
        let (point, barycentric) = closest_on_triangle(at, self.corners(triangle));
        Closest { point, triangle, barycentric, distance_squared: point.distance_squared(at) }
    }
}

/// A point of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnCurve {
    /// The point itself.
    pub point: DVec3,
    /// The end points of its segment.
    pub segment: [u32; 2],
    /// Parameter along the segment, 0 to 1.
    pub fraction: f64,
}

/// Curves of straight segments between points.
#[derive(Clone, Copy, Debug)]
pub struct Curves<'a, F> {
    /// Points `[n_points]`, in any unit.
    pub points: &'a [DVec3],
    /// The two neighbours of an inner point of a curve. `None` at the ends of curves, where walks
    /// stop.
    pub beside: F,
}

impl<F: Fn(u32) -> Option<[u32; 2]>> Curves<'_, F> {
    /// The point of the curve nearest to `at` that a walk from `start` reaches, where `start` is an
    /// inner point. Each step of the walk reduces the distance.
    pub fn closest(&self, start: u32, at: DVec3) -> OnCurve {
        let beside = (self.beside)(start).unwrap_or([start; 2]);
        let mut best = self.on([start, beside[0]], at);
        for first in beside {
            let mut segment = [start, first];
            loop {
                let on = self.on(segment, at);
                if on.point.distance_squared(at) < best.point.distance_squared(at) {
                    best = on;
                }
                let [from, to] = segment;
                match (self.beside)(to) {
                    Some([a, b]) if on.fraction == 1.0 && to != start => segment = [to, if a == from { b } else { a }],
                    _ => break,
                }
            }
        }
        best
    }

    /// Unit direction of the curve at one of its points, continuous across points.
    pub fn direction(&self, on: &OnCurve) -> DVec3 {
        let [from, to] = on.segment;
        let along = self.point(to) - self.point(from);
        let at_end = |end: u32| {
            let direction = (self.beside)(end).map_or(along, |[a, b]| self.point(b) - self.point(a));
            (direction * direction.dot(along).signum()).normalize_or_zero()
        };
        at_end(from).lerp(at_end(to), on.fraction).normalize_or_zero()
    }

    fn point(&self, of: u32) -> DVec3 {
        self.points[of as usize]
    }

    fn on(&self, segment: [u32; 2], at: DVec3) -> OnCurve {
        let [a, b] = segment.map(|end| self.point(end));
        let (point, fraction) = nearest_on_segment(at, a, b);
        // An end point of the segment keeps its bits.
        let point = if fraction == 1.0 { b } else { point };
        OnCurve { point, segment, fraction }
    }
}
