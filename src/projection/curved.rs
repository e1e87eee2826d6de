//! [`CurvedSurface`]: a piece of a moved surface whose triangles are curved, with its holes closed.
//!
//! A vertex that slides by an edge or more on flat triangles would leave the curved surface by the
//! sag of the facets. On curved triangles it leaves it by much less.

mod change;

pub use change::{BesideChange, CurvedChange};

use std::collections::HashMap;

use glam::DVec3;

use super::Closest;
use super::continuation::{self, ContinuationError};
use super::walk::Parts;
use crate::geometry::{self, diagonal, unit_normal};
use crate::mesh::csr::Csr;

/// Cosine of the least angle, 60 degrees, of a sharp edge. The corners of a trailing edge are
/// sharper; the facets of a coarse leading edge are not.
const SHARP: f64 = 0.5;

/// Cosine of the least angle, 20 degrees, between two triangles at a point where the surface turns
/// too much for a vertex to slide: on a leading edge curved triangles miss the surface by a tenth
/// of an edge.
const TURNS: f64 = 0.939_692_620_785_908_4;

/// A surface in smooth parts, on which vertices slide.
#[derive(Clone, Debug)]
pub struct CurvedSurface {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    around: Csr,
    part: Vec<u32>,
    size: f64,
}

/// A point of a [`CurvedSurface`] that has triangles.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    point: u32,
    triangle: u32,
}

/// A point beside a [`CurvedSurface`].
#[derive(Clone, Copy, Debug)]
pub struct Beside {
    /// The point of the surface under it.
    pub foot: DVec3,
    /// Its height above the surface, along the surface's normal, in the unit of the points.
    pub height: f64,
    /// The triangle of the foot.
    pub triangle: u32,
}

impl CurvedSurface {
    /// Makes the surface.
    ///
    /// - `points` `[n_points]`: in any unit
    /// - `triangles` `[n_triangles]`: oriented
    /// - `rims`: the loops around the holes that are closed, each in order
    ///
    /// # Errors
    /// A hole cannot be closed.
    pub fn new(
        mut points: Vec<DVec3>,
        mut triangles: Vec<[u32; 3]>,
        rims: &[Vec<u32>],
    ) -> Result<Self, ContinuationError> {
        let (own_points, own) = (points.clone(), triangles.clone());
        for rim in rims {
            let patch = continuation::close(&own_points, &own, rim)?;
            let (old, new) = (own_points.len() as u32, points.len() as u32);
            points.extend(patch.points);
            triangles.extend(patch.triangles.into_iter().map(|t| t.map(|v| if v < old { v } else { v - old + new })));
        }
        let corners = triangles.iter().enumerate().flat_map(|(index, t)| t.map(|point| (point, index as u32)));
        let corners: Vec<(u32, u32)> = corners.collect();
        let around = Csr::from_pairs(points.len(), corners.into_iter());
        let part = parts(&points, &triangles);
        let size = diagonal(points.iter().copied());
        Ok(Self { points, triangles, around, part, size })
    }

    /// Diagonal of the surface's bounding box, in the unit of the points.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// A point of the surface as a start for [`Self::beside`]. `None` if it has no triangle.
    pub fn start_at(&self, point: u32) -> Option<Start> {
        self.around.row(point as usize).first().map(|&triangle| Start { point, triangle })
    }

    /// The place of `at` beside the smooth parts at `start`: beside the part whose foot is nearest.
    /// So at a sharp edge the order of the triangles does not matter.
    pub fn beside(&self, start: Start, at: DVec3) -> Beside {
        self.found(start, at).1
    }

    /// [`Self::beside`], with the point of the flat triangle.
    fn found(&self, start: Start, at: DVec3) -> (Closest, Beside) {
        let around = self.around.row(start.point as usize);
        let part = |triangle: u32| self.part[triangle as usize];
        let mut nearest = self.beside_part(start, at);
        for (k, &triangle) in around.iter().enumerate().skip(1) {
            if around[..k].iter().any(|&before| part(before) == part(triangle)) {
                continue;
            }
            let other = self.beside_part(Start { triangle, ..start }, at);
            if other.1.foot.distance_squared(at) < nearest.1.foot.distance_squared(at) {
                nearest = other;
            }
        }
        nearest
    }

    /// The place of `at` beside the part of a start's triangle.
    fn beside_part(&self, start: Start, at: DVec3) -> (Closest, Beside) {
        let parts = self.parts();
        let on = parts.closest(parts.nearest_around(start.point, start.triangle, at), at);
        let foot = parts.curved(&on);
        (on, Beside { foot, height: (at - foot).dot(parts.normal(&on)), triangle: on.triangle })
    }

    /// The longest edge of a triangle, in the unit of the points.
    pub fn longest_edge(&self, triangle: u32) -> f64 {
        let [a, b, c] = geometry::corners(&self.points, self.triangles[triangle as usize]);
        a.distance(b).max(b.distance(c)).max(c.distance(a))
    }

    /// Whether the surface has a sharp edge or an end at a point.
    pub fn is_sharp(&self, point: u32) -> bool {
        let around = self.around.row(point as usize);
        let mut ends: HashMap<u32, usize> = HashMap::new();
        for &triangle in around {
            for end in self.triangles[triangle as usize].into_iter().filter(|&end| end != point) {
                *ends.entry(end).or_default() += 1;
            }
        }
        let part = around.first().map(|&triangle| self.part[triangle as usize]);
        around.iter().any(|&triangle| Some(self.part[triangle as usize]) != part) || ends.values().any(|&n| n != 2)
    }

    /// Whether the surface turns by more than 20 degrees at a point, as on a leading edge.
    pub fn turns(&self, point: u32) -> bool {
        let corners = |triangle: u32| geometry::corners(&self.points, self.triangles[triangle as usize]);
        let around = self.around.row(point as usize).iter();
        let normals: Vec<DVec3> = around.map(|&triangle| unit_normal(corners(triangle))).collect();
        normals.iter().any(|one| normals.iter().any(|other| one.dot(*other) < TURNS))
    }

    fn parts(&self) -> Parts<'_> {
        Parts { points: &self.points, triangles: &self.triangles, around: &self.around, part: &self.part }
    }
}

/// Numbers the smooth parts `[n_triangles]`.
fn parts(points: &[DVec3], triangles: &[[u32; 3]]) -> Vec<u32> {
    let normals: Vec<DVec3> = triangles.iter().map(|&t| unit_normal(geometry::corners(points, t))).collect();
    let mut beside: HashMap<[u32; 2], Vec<u32>> = HashMap::new();
    for (index, &[a, b, c]) in triangles.iter().enumerate() {
        for [a, b] in [[a, b], [b, c], [c, a]] {
            beside.entry([a.min(b), a.max(b)]).or_default().push(index as u32);
        }
    }
    let mut part = vec![u32::MAX; triangles.len()];
    for first in 0..triangles.len() as u32 {
        if part[first as usize] != u32::MAX {
            continue;
        }
        part[first as usize] = first;
        let mut front = vec![first];
        while let Some(triangle) = front.pop() {
            let [a, b, c] = triangles[triangle as usize];
            for [a, b] in [[a, b], [b, c], [c, a]] {
                let smooth = |other: &&u32| normals[triangle as usize].dot(normals[**other as usize]) >= SHARP;
                for &other in beside[&[a.min(b), a.max(b)]].iter().filter(smooth) {
                    if part[other as usize] == u32::MAX {
                        part[other as usize] = first;
                        front.push(other);
                    }
                }
            }
        }
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lattice on a paraboloid with a hole: the foot of a point above it lies on the paraboloid
    /// ten times nearer than flat triangles, which sag by 2e-3, also in the hole.
    ///
    /// Fails if triangles are flat.
    #[test]
    fn feet_lie_on_the_curved_surface() {
        let (n, h) = (12u32, 0.1);
        let height = |x: f64, y: f64| 0.5 * (0.8 * x * x + 0.3 * x * y + 0.4 * y * y);
        let at = |i: u32, j: u32| {
            let [x, y] = [i, j].map(|k| h * (k as f64 - 6.0));
            DVec3::new(x, y, height(x, y))
        };
        let points: Vec<DVec3> = (0..=n).flat_map(|j| (0..=n).map(move |i| at(i, j))).collect();
        let number = |i: u32, j: u32| j * (n + 1) + i;
        let in_hole = |i: u32, j: u32| (5..7).contains(&i) && (5..7).contains(&j);
        let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).filter(|&(i, j)| !in_hole(i, j));
        let triangles: Vec<[u32; 3]> = cells
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        // Clockwise, as the boundary of the surface around it runs.
        let rim: Vec<u32> =
            [(5, 5), (5, 6), (5, 7), (6, 7), (7, 7), (7, 6), (7, 5), (6, 5)].map(|(i, j)| number(i, j)).to_vec();
        let surface = CurvedSurface::new(points, triangles, &[rim]).unwrap();
        let start = surface.start_at(number(5, 5)).unwrap();
        for (x, y) in [(0.03, 0.04), (-0.22, 0.17), (0.18, -0.27), (0.0, 0.0), (-0.05, 0.02)] {
            let beside = surface.beside(start, DVec3::new(x, y, height(x, y) + 0.02));
            let off = (beside.foot.z - height(beside.foot.x, beside.foot.y)).abs();
            assert!(off < 1.5e-4, "{x} {y}: {off:e}");
            assert!((beside.height - 0.02).abs() < 1e-3, "{x} {y}: {beside:?}");
        }
        assert!(!surface.is_sharp(number(3, 3)) && surface.is_sharp(number(0, 3)));
    }

    /// At the edge of a cube the foot lies on the nearer side, whatever the order of the triangles.
    ///
    /// Fails if the side of the first triangle has the foot.
    #[test]
    fn feet_at_a_sharp_edge_lie_on_the_nearer_side() {
        let points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, -1), (1, 0, -1)];
        let points: Vec<DVec3> =
            points.iter().map(|&(x, y, z)| DVec3::new(f64::from(x), f64::from(y), f64::from(z))).collect();
        let mut triangles = vec![[0, 1, 2], [0, 2, 3], [0, 4, 5], [0, 5, 1]];
        for _ in 0..4 {
            triangles.rotate_left(1);
            let surface = CurvedSurface::new(points.clone(), triangles.clone(), &[]).unwrap();
            let start = surface.start_at(0).unwrap();
            for (at, foot) in [
                (DVec3::new(0.5, 0.3, 0.01), DVec3::new(0.5, 0.3, 0.0)),
                (DVec3::new(0.5, -0.02, -0.4), DVec3::new(0.5, 0.0, -0.4)),
            ] {
                assert!(surface.beside(start, at).foot.distance(foot) < 1e-15, "{triangles:?}");
            }
        }
    }
}
