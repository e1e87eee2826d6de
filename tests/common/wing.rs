//! Analytic wings, cut and lofted.
#![allow(dead_code, reason = "each test file uses a part of it")]

use glam::{DMat3, DVec3};
use idmesh::mesh::corners::Face;
use idmesh::profile::{Plane, Profile, ProfileError, ProfileInterpolation, WingSurface, cut};

/// A lofted NACA wing: swept, tapered, twisted, with dihedral.
#[derive(Clone, Copy)]
pub struct Wing {
    /// Thickness at the trailing edge, in chords; 0 is a sharp one.
    pub te: f64,
    /// Greatest thickness, in chords.
    pub thickness: f64,
    /// Points around a section.
    pub around: usize,
    /// Rows of vertices along the span.
    pub rows: usize,
    /// Twist at the root and its change to the tip, degrees. With taper it makes the wing leave its
    /// loft between planes.
    pub twist: [f64; 2],
    /// Whether the base of a blunt trailing edge belongs to the wing.
    pub base: bool,
}

pub const BLUNT: Wing = Wing { te: 0.015, thickness: 0.12, around: 81, rows: 21, twist: [2.0, -3.0], base: false };
pub const SHARP: Wing = Wing { te: 0.0, thickness: 0.12, around: 81, rows: 21, twist: [2.0, -3.0], base: false };
pub const SPAN: f64 = 4.0;
pub const CHORD: f64 = 2.0;

pub struct Surface {
    pub vertices: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    pub normals: Vec<DVec3>,
}

impl Wing {
    /// Section point: `t` from -1 (lower trailing edge) over 0 (leading edge) to 1 (upper trailing
    /// edge), at span `y`.
    pub fn point(&self, t: f64, y: f64) -> DVec3 {
        let f = y / SPAN;
        let chord = CHORD + (0.8 - CHORD) * f;
        let x = t * t;
        let half = 5.0
            * self.thickness
            * (0.2969 * t.abs() - 0.126 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1036 * x.powi(4))
            + 0.5 * self.te * x;
        // At t = -1 and 1 the polynomial is zero only to rounding, and a sharp edge is one vertex.
        let half = if self.te == 0.0 && t.abs() == 1.0 { 0.0 } else { half };
        let z = 0.06 * x * (1.0 - x) + half * t.signum();
        let (sin, cos) = (self.twist[0] + self.twist[1] * f).to_radians().sin_cos();
        let (dx, dz) = ((x - 0.25) * chord, z * chord);
        DVec3::new(0.45 * y + 0.25 * chord + dx * cos + dz * sin, y, 0.07 * y - dx * sin + dz * cos)
    }

    pub fn surface(&self) -> Surface {
        // The last point of a sharp section is its first.
        let columns = if self.te == 0.0 { self.around - 1 } else { self.around };
        let row = |j: usize| {
            let y = SPAN * j as f64 / (self.rows - 1) as f64;
            (0..columns).map(|i| self.point(2.0 * i as f64 / (self.around - 1) as f64 - 1.0, y)).collect()
        };
        let rows: Vec<Vec<DVec3>> = (0..self.rows).map(row).collect();
        Surface::through(&rows, self.te == 0.0 || self.base)
    }
}

impl Surface {
    /// The surface through rows of vertices along the span, each from the lower side of the
    /// trailing edge to the upper one.
    ///
    /// - `closed`: whether triangles lead from the last vertex of a row to its first
    pub fn through(rows: &[Vec<DVec3>], closed: bool) -> Self {
        let columns = rows[0].len();
        let vertices = rows.concat();
        let at = |i: usize, j: usize| (j * columns + i % columns) as u32;
        let mut triangles = Vec::new();
        for j in 0..rows.len() - 1 {
            for i in 0..if closed { columns } else { columns - 1 } {
                let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                let [a, b, c, d] = corners;
                let halves = if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
                triangles.extend(halves);
            }
        }
        let mut normals = vec![DVec3::ZERO; vertices.len()];
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|v| vertices[v as usize]);
            triangle.iter().for_each(|&v| normals[v as usize] += (c - a).cross(b - a));
        }
        let mut normals: Vec<DVec3> = normals.into_iter().map(|n| n.normalize_or_zero()).collect();
        if normals[3 * columns / 4].z < 0.0 {
            normals.iter_mut().for_each(|n| *n = -*n);
        }
        Self { vertices, triangles, normals }
    }

    pub fn cut(&self, stations: &[f64]) -> Vec<Profile> {
        let planes: Vec<(i64, Plane)> = stations.iter().enumerate().map(|(i, &y)| (i as i64, at_y(y))).collect();
        cut::cut_at_planes(&self.vertices, &self.triangles, &planes).unwrap()
    }

    pub fn faces(&self) -> Vec<Face> {
        self.triangles.iter().copied().map(Face::of_triangle).collect()
    }

    pub fn interpolation(&self, old: &[Profile]) -> Result<ProfileInterpolation, ProfileError> {
        let (positions, normals, faces) = (&self.vertices, &self.normals, &self.faces());
        ProfileInterpolation::new(old, &WingSurface { positions, normals, faces, ..WingSurface::default() })
    }

    pub fn loft(&self, old: &[Profile]) -> ProfileInterpolation {
        self.interpolation(old).unwrap()
    }
}

pub fn at_y(y: f64) -> Plane {
    Plane { point: DVec3::Y * y, normal: DVec3::Y }
}

pub fn mapped(profiles: &[Profile], map: impl Fn(DVec3) -> DVec3) -> Vec<Profile> {
    let map = |p: &Profile| Profile { number: p.number, points: p.points.iter().map(|&p| map(p)).collect() };
    profiles.iter().map(map).collect()
}

/// A section of `n` points of the analytic wing, crowded at its ends unlike a cut's.
pub fn resampled(wing: &Wing, y: f64, n: usize) -> Vec<DVec3> {
    let t = |i: usize| -(std::f64::consts::PI * i as f64 / (n - 1) as f64).cos();
    (0..n).map(|i| wing.point(t(i).clamp(-1.0, 1.0), y)).collect()
}

/// A moderate affine map with shear, stretch, rotation and shift, no axis left alone.
pub fn affine(p: DVec3) -> DVec3 {
    let m = DMat3::from_cols(DVec3::new(1.07, 0.02, -0.03), DVec3::new(0.11, 0.98, 0.09), DVec3::new(0.04, -0.05, 1.4));
    m * p + DVec3::new(0.3, -0.1, 0.2)
}
