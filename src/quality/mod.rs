//! Quality of tets: signed volume, the paper's beta, scaled Jacobian and shape. [`faults`] finds
//! inverted tets and folded triangles.

#[doc(hidden)]
pub mod faults;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::geometry::{corners, triangle_normal};

/// Signed volume of a tet, in the cube of the mesh's unit.
///
/// Positive if the fourth vertex lies on the side of the right-hand normal of the first three.
pub fn volume(tet: [DVec3; 4]) -> f64 {
    let [a, b, c, d] = tet;
    triangle_normal([a, b, c]).dot(d - a) / 6.0
}

/// Quality of a tet (paper eq. 1): `beta = V / l_max^3`, signed, without unit.
///
/// 0.11785 for the regular tet, zero or negative for an inverted one, NaN if all four vertices
/// coincide.
pub fn beta(tet: [DVec3; 4]) -> f64 {
    let [a, b, c, d] = tet;
    let longest = [b - a, c - a, d - a, c - b, d - b, d - c].into_iter().map(DVec3::length_squared).fold(0.0, f64::max);
    volume(tet) / (longest * longest.sqrt())
}

/// The lesser of two numbers; NaN if one is NaN.
pub(crate) fn lesser(a: f64, b: f64) -> f64 {
    if a.is_nan() || a <= b { a } else { b }
}

/// Scaled Jacobian of a corner tet, without unit: 1 if the three edges at its first vertex are
/// perpendicular. NaN if an edge has no length.
pub fn scaled_jacobian([a, b, c, d]: [DVec3; 4]) -> f64 {
    let edges = [b - a, c - a, d - a].map(|edge| edge / edge.length());
    edges[0].cross(edges[1]).dot(edges[2])
}

/// Shape of a corner tet against its undeformed shape, without unit: 1 if it was only moved, turned
/// or scaled, 0 or less if its volume is not positive.
pub fn shape(now: [DVec3; 4], undeformed: [DVec3; 4]) -> f64 {
    let edges = |[a, b, c, d]: [DVec3; 4]| DMat3::from_cols(b - a, c - a, d - a);
    let s = edges(now) * edges(undeformed).inverse();
    let determinant = s.determinant();
    let squares: f64 = s.to_cols_array().iter().map(|entry| entry * entry).sum();
    3.0 * determinant.signum() * determinant.abs().powf(2.0 / 3.0) / squares
}

/// Statistics of beta over a mesh, as in the paper's Table 1. Beta has no unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Smallest beta.
    pub min: f64,
    /// Largest beta.
    pub max: f64,
    /// Arithmetic mean of beta.
    pub mean: f64,
    /// Number of tets without positive volume.
    pub inverted: usize,
}

/// Beta of every tet `[n_tets]`.
///
/// - `vertices` `[n_vertices]`: positions, in any unit
pub fn betas(vertices: &[DVec3], tets: &[[u32; 4]]) -> Vec<f64> {
    tets.par_iter().map(|tet| beta(corners(vertices, *tet))).collect()
}

/// [`betas`] after a motion. A tet none of whose vertices moved keeps its value.
///
/// - `betas` `[n_tets]`: with the vertices at `from`
/// - `from`, `to` `[n_vertices]`: positions before and after, in the same unit
pub fn betas_after(mut betas: Vec<f64>, from: &[DVec3], to: &[DVec3], tets: &[[u32; 4]]) -> Vec<f64> {
    let moved: Vec<bool> = from.iter().zip(to).map(|(from, to)| from != to).collect();
    if moved.contains(&true) {
        betas.par_iter_mut().zip(tets).for_each(|(of_tet, tet)| {
            if tet.iter().any(|&vertex| moved[vertex as usize]) {
                *of_tet = beta(corners(to, *tet));
            }
        });
    }
    betas
}

impl Statistics {
    /// Statistics of the betas `[n_tets]`. A NaN counts as inverted, and makes minimum, maximum and
    /// mean NaN.
    pub fn new(betas: &[f64]) -> Self {
        // Independent lanes, which the processor computes at once.
        const LANES: usize = 8;
        let (mut min, mut max) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        let (mut sum, mut inverted) = ([0.0; LANES], [0; LANES]);
        let mut add = |lane: usize, beta: f64| {
            min[lane] = if beta < min[lane] { beta } else { min[lane] };
            max[lane] = if beta > max[lane] { beta } else { max[lane] };
            sum[lane] += beta;
            inverted[lane] += u64::from(faults::is_inverted(beta));
        };
        let (groups, rest) = betas.as_chunks::<LANES>();
        groups.iter().for_each(|group| (0..LANES).for_each(|lane| add(lane, group[lane])));
        rest.iter().enumerate().for_each(|(lane, &beta)| add(lane, beta));
        let mean = sum.iter().sum::<f64>() / betas.len() as f64;
        // Comparisons drop a NaN, but the sum keeps it.
        let or_nan = |value: f64| if mean.is_nan() { f64::NAN } else { value };
        Self {
            min: or_nan(min.into_iter().fold(f64::INFINITY, f64::min)),
            max: or_nan(max.into_iter().fold(f64::NEG_INFINITY, f64::max)),
            mean,
            inverted: inverted.iter().sum::<u64>() as usize,
        }
    }
}
