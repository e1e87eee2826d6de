//! Quality of tets: signed volume, the paper's beta, scaled Jacobian and shape. [`faults`] finds
//! inverted tets and folded triangles.

#[doc(hidden)]
pub mod faults;

use glam::DVec3;
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
/// 0.11785 for the regular tet, zero or negative for an inverted one, 0 if all four vertices
/// coincide, NaN if a coordinate is not finite.
pub fn beta(tet: [DVec3; 4]) -> f64 {
    let [a, b, c, d] = tet;
    let longest = [b - a, c - a, d - a, c - b, d - b, d - c].into_iter().map(DVec3::length_squared).fold(0.0, f64::max);
    let volume = volume(tet);
    // Without a length the volume is 0, or NaN.
    if longest == 0.0 { volume } else { volume / (longest * longest.sqrt()) }
}

/// The lesser of two numbers; NaN if one is NaN.
pub(crate) fn lesser(a: f64, b: f64) -> f64 {
    if a.is_nan() || a <= b { a } else { b }
}

/// The three edges at the first vertex of a tet.
pub(crate) fn edges_of_corner([a, b, c, d]: [DVec3; 4]) -> [DVec3; 3] {
    [b - a, c - a, d - a]
}

/// Six times the volume of a corner tet, by its three edges.
pub(crate) fn determinant([u, v, w]: [DVec3; 3]) -> f64 {
    u.cross(v).dot(w)
}

/// Scaled Jacobian of a corner tet, without unit: 1 if the three edges at its first vertex are
/// perpendicular. 0 if an edge has no length, NaN if a coordinate is not finite.
pub fn scaled_jacobian(tet: [DVec3; 4]) -> f64 {
    let edges = edges_of_corner(tet);
    let squares = edges.map(DVec3::length_squared).iter().product::<f64>();
    if squares == 0.0 { 0.0 } else { determinant(edges) / squares.sqrt() }
}

/// Shape of a corner tet against its undeformed shape, without unit: 1 if it was only moved, turned
/// or scaled, 0 or less if its volume is not positive.
pub fn shape(now: [DVec3; 4], undeformed: [DVec3; 4]) -> f64 {
    shape_cubed(edges_of_corner(now), edges_of_corner(undeformed)).cbrt()
}

/// The cube of the shape of a corner tet, by its three edges; see [`shape`]. It grows with the
/// shape, and needs no root.
///
/// The shape is `3 s^(2/3) / |S|^2` with `S = A W^-1` and `s = det S`. With the edges `a` of `A`,
/// `w` of `W` and `r_1 = w_2 x w_3` (and so on), `|S|^2 det(W)^2` is the sum of
/// `(a_i . a_j) (r_i . r_j)`.
pub(crate) fn shape_cubed(now: [DVec3; 3], undeformed: [DVec3; 3]) -> f64 {
    let [w1, w2, w3] = undeformed;
    let r = [w2.cross(w3), w3.cross(w1), w1.cross(w2)];
    let of_undeformed = w1.dot(r[0]);
    let both = |i: usize, j: usize| now[i].dot(now[j]) * r[i].dot(r[j]);
    let sum = both(0, 0) + both(1, 1) + both(2, 2) + 2.0 * (both(0, 1) + both(1, 2) + both(2, 0));
    let s = determinant(now) / of_undeformed;
    let squares = sum / (of_undeformed * of_undeformed);
    27.0 * s * s.abs() / (squares * squares * squares)
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

/// Numbers of a block of [`Partial`].
const BLOCK: usize = 4096;

/// Statistics of a block of betas. Those of a mesh are joined from its blocks in turn, so they do
/// not depend on the number of threads, and few changed betas call for few blocks.
#[derive(Clone, Copy, Debug)]
pub struct Partial {
    min: f64,
    max: f64,
    sum: f64,
    inverted: usize,
}

impl Partial {
    /// Of each block of betas `[n_tets]`.
    pub fn of_blocks(betas: &[f64]) -> Vec<Self> {
        betas.par_chunks(BLOCK).map(Self::new).collect()
    }

    /// - `block`: at most [`BLOCK`] betas
    fn new(block: &[f64]) -> Self {
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
        let (groups, rest) = block.as_chunks::<LANES>();
        groups.iter().for_each(|group| (0..LANES).for_each(|lane| add(lane, group[lane])));
        rest.iter().enumerate().for_each(|(lane, &beta)| add(lane, beta));
        Self {
            min: min.into_iter().fold(f64::INFINITY, f64::min),
            max: max.into_iter().fold(f64::NEG_INFINITY, f64::max),
            sum: sum.iter().sum(),
            inverted: inverted.iter().sum::<u64>() as usize,
        }
    }
}

impl Statistics {
    /// Statistics of the betas `[n_tets]`. A NaN counts as inverted, and makes minimum, maximum and
    /// mean NaN.
    pub fn new(betas: &[f64]) -> Self {
        Self::joined(&Partial::of_blocks(betas), betas.len())
    }

    /// [`Self::new`] of betas of which some have changed, to the bit.
    ///
    /// - `betas` `[n_tets]`, `partials`: before the change, and of their blocks
    /// - `changed`: tets and their betas, in ascending order
    pub fn of_changed(betas: &[f64], partials: &[Partial], changed: &[(u32, f64)]) -> Self {
        let mut partials = partials.to_vec();
        let of_block = |changed: &[(u32, f64)]| {
            let block = changed[0].0 as usize / BLOCK;
            let first = block * BLOCK;
            let mut now = betas[first..betas.len().min(first + BLOCK)].to_vec();
            changed.iter().for_each(|&(tet, beta)| now[tet as usize - first] = beta);
            (block, Partial::new(&now))
        };
        let blocks: Vec<&[(u32, f64)]> =
            changed.chunk_by(|(one, _), (other, _)| *one as usize / BLOCK == *other as usize / BLOCK).collect();
        let made: Vec<(usize, Partial)> = blocks.into_par_iter().map(of_block).collect();
        made.into_iter().for_each(|(block, partial)| partials[block] = partial);
        Self::joined(&partials, betas.len())
    }

    fn joined(partials: &[Partial], n_tets: usize) -> Self {
        let mean = partials.iter().map(|block| block.sum).sum::<f64>() / n_tets as f64;
        // Comparisons drop a NaN, but the sum keeps it.
        let or_nan = |value: f64| if mean.is_nan() { f64::NAN } else { value };
        Self {
            min: or_nan(partials.iter().map(|block| block.min).fold(f64::INFINITY, f64::min)),
            max: or_nan(partials.iter().map(|block| block.max).fold(f64::NEG_INFINITY, f64::max)),
            mean,
            inverted: partials.iter().map(|block| block.inverted).sum(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{BLOCK, Partial, Statistics};

    /// Changed betas give what all betas give, to the bit: none, one, some in one block, one in
    /// each block, all, and one that is not a number.
    #[test]
    fn few_changed_betas_give_what_all_give() {
        let betas: Vec<f64> = (0..3 * BLOCK + 77).map(|n| 0.06 * (1.0 + (n as f64 * 0.7).sin())).collect();
        let partials = Partial::of_blocks(&betas);
        let last = betas.len() - 1;
        let some: [Vec<usize>; 6] = [
            vec![],
            vec![BLOCK],
            vec![3, 7, BLOCK - 1],
            vec![0, BLOCK, 2 * BLOCK, last],
            (0..betas.len()).collect(),
            vec![BLOCK + 5],
        ];
        for (case, tets) in some.iter().enumerate() {
            let mut now = betas.clone();
            let value = |tet: usize| if case == 5 { f64::NAN } else { -0.01 + 1e-5 * tet as f64 };
            tets.iter().for_each(|&tet| now[tet] = value(tet));
            let changed: Vec<(u32, f64)> = tets.iter().map(|&tet| (tet as u32, value(tet))).collect();
            let bits = |of: Statistics| ([of.min, of.max, of.mean].map(f64::to_bits), of.inverted);
            assert_eq!(
                bits(Statistics::of_changed(&betas, &partials, &changed)),
                bits(Statistics::new(&now)),
                "{case}"
            );
        }
    }

    /// Against plain sums over all betas.
    #[test]
    fn statistics_are_those_of_all_betas() {
        let betas: Vec<f64> = (0..2 * BLOCK + 9).map(|n| 0.1 * (n as f64 * 1.3).cos()).collect();
        let Statistics { min, max, mean, inverted } = Statistics::new(&betas);
        assert_eq!(min, betas.iter().copied().fold(f64::INFINITY, f64::min));
        assert_eq!(max, betas.iter().copied().fold(f64::NEG_INFINITY, f64::max));
        assert!((mean - betas.iter().sum::<f64>() / betas.len() as f64).abs() < 1e-16);
        assert_eq!(inverted, betas.iter().filter(|&&beta| beta <= 0.0).count());
    }
}
