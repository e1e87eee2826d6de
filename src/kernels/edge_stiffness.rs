//! Stiffness of each edge of a tet mesh; twin of `kernels/edge_stiffness.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::Real;

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// Number of edges to compute.
    pub n_edges: u32,
    /// Longitudinal part, 0: 1, 1: `1 / l`, 2: `1 / l^2`.
    pub power: u32,
    /// 0: no torsional part, 1: longitudinal part times `s`, 2: longitudinal part plus `s`.
    pub torsion: u32,
    /// Factor of `s` in the sum: lengths arrive scaled, `s` has no length to scale.
    pub sum_factor: f32,
}

/// Edges and tets as the twin reads them.
#[derive(Clone, Copy, Debug)]
pub struct Edges<'a, T> {
    /// Where each edge's tets start in `edge_tets` `[n_edges + 1]`.
    pub edge_start: &'a [u32],
    /// Tets around each edge `[n_entries]`, each entry `tet * 6 + local edge`.
    pub edge_tets: &'a [u32],
    /// Edges 01 02 03 12 13 23 of each tet `[n_tets]`, each `edge * 2 + reversed`.
    pub tet_edges: &'a [[u32; 6]],
    /// Edge vectors `[n_edges]`, any unit; the fourth component is not used.
    pub edge_vector: &'a [[T; 4]],
    /// Longitudinal part, 0: 1, 1: `1 / l`, 2: `1 / l^2`.
    pub power: u32,
    /// 0: no torsional part, 1: longitudinal part times `s`, 2: longitudinal part plus `sum_factor * s`.
    pub torsion: u32,
    /// Factor of `s` in the sum.
    pub sum_factor: T,
}

/// Most that `1 / sin^2` of one dihedral angle counts: `sin^2` is clamped below at 1e-6, also in a flat tet.
const LARGEST: f64 = 1e6;

/// For local edge ij the local edges ik il jk jl kl, with k < l the other two vertices.
const AROUND: [[usize; 5]; 6] =
    [[1, 2, 3, 4, 5], [0, 2, 3, 5, 4], [0, 1, 4, 5, 3], [0, 4, 1, 5, 2], [0, 3, 2, 5, 1], [1, 3, 2, 4, 0]];

/// Stiffness of a chunk of edges.
///
/// - `first_edge`: edge of the chunk's first element
/// - `facing` `[n_tets]`: what [`facing()`] gives; the kernel finds it anew for each edge. Not read without torsional part
/// - `stiffness` `[edges of the chunk]`: `1 / l^power`, times or plus the sum over the edge's tets of
///   [`facing()`]; infinite for an edge without length, but for power 0
///
/// Source: longitudinal part Batina 1990; torsional part Murayama, Nakahashi and Matsushima 2002, which adds it
/// (`torsion = 2`); the product is ours: it has no unit to depend on.
pub fn run<T: Real>(first_edge: usize, edges: &Edges<T>, facing: &[[T; 6]], stiffness: &mut [T]) {
    for (edge, stiffness) in (first_edge..).zip(stiffness) {
        let along = xyz(&edges.edge_vector[edge]);
        let squared = dot(along, along);
        let longitudinal = match edges.power {
            0 => T::ONE,
            1 => T::ONE / squared.sqrt(),
            _ => T::ONE / squared,
        };
        if edges.torsion == 0 {
            *stiffness = longitudinal;
            continue;
        }
        let mut s = T::ZERO;
        for &entry in &edges.edge_tets[edges.edge_start[edge] as usize..edges.edge_start[edge + 1] as usize] {
            s = s + facing[entry as usize / 6][entry as usize % 6];
        }
        *stiffness = if edges.torsion == 1 { longitudinal * s } else { longitudinal + s * edges.sum_factor };
    }
}

/// `1 / sin^2` of the dihedral angles that face the six edges of a tet, that is of the angles at the opposite edges; at most
/// 1e6.
///
/// For edge ij and opposite edge kl: `sin^2 = 36 V^2 l_kl^2 / (S_i S_j)`, `S_i = 4 A_i^2` of the face opposite i.
/// Squares only, so the direction in which an edge is stored does not matter.
pub fn facing<T: Real>(edges: &Edges<T>, tet: usize) -> [T; 6] {
    let vectors = edges.tet_edges[tet].map(|edge| xyz(&edges.edge_vector[edge as usize / 2]));
    // The angle has no unit: the longest edge becomes 1, so that squares of squares stay inside f32.
    let longest = vectors.iter().fold(T::ZERO, |longest, v| longest.max(dot(*v, *v)));
    if longest == T::ZERO {
        return [T::from_f64(LARGEST); 6];
    }
    let scale = T::ONE / longest.sqrt();
    let vectors = vectors.map(|v| v.map(|component| component * scale));
    [0, 1, 2, 3, 4, 5].map(|local| inverse_sin_squared(&vectors, local))
}

/// As [`facing()`], for one edge of a tet with edges of length at most 1.
#[inline(always)]
fn inverse_sin_squared<T: Real>(vectors: &[[T; 3]; 6], local: usize) -> T {
    let ij = vectors[local];
    let [ik, il, jk, jl, kl] = AROUND[local].map(|local| vectors[local]);
    let limit = T::from_f64(LARGEST);
    let normal_i = area_vector(jk, jl, kl);
    let normal_j = area_vector(ik, il, kl);
    let s_i = dot(normal_i, normal_i);
    let s_j = dot(normal_j, normal_j);
    let l_kl = dot(kl, kl);
    let volume = dot(shortest(ij, jk, jl), normal_j);
    if s_j == T::ZERO || l_kl == T::ZERO {
        return limit;
    }
    // Squared distance of j from line kl and from plane ikl: two quotients, so no product leaves f32.
    let to_line = s_i / l_kl;
    let to_plane = volume * volume / s_j;
    if to_line < limit * to_plane { to_line / to_plane } else { limit }
}

#[inline(always)]
fn xyz<T: Real>(v: &[T; 4]) -> [T; 3] {
    [v[0], v[1], v[2]]
}

#[inline(always)]
fn dot<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Twice the area vector (up to sign) of the triangle with these three edges. From its two shorter edges: the angle
/// between them is the triangle's largest, so a needle loses nothing to cancellation.
#[inline(always)]
fn area_vector<T: Real>(a: [T; 3], b: [T; 3], c: [T; 3]) -> [T; 3] {
    let (aa, bb, cc) = (dot(a, a), dot(b, b), dot(c, c));
    if cc >= aa && cc >= bb {
        cross(a, b)
    } else if bb >= aa {
        cross(a, c)
    } else {
        cross(b, c)
    }
}

#[inline(always)]
fn shortest<T: Real>(a: [T; 3], b: [T; 3], c: [T; 3]) -> [T; 3] {
    let (aa, bb, cc) = (dot(a, a), dot(b, b), dot(c, c));
    if aa <= bb && aa <= cc {
        a
    } else if bb <= cc {
        b
    } else {
        c
    }
}
