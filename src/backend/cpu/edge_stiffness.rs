//! Torsional stiffness of the edges of a tet mesh.

use crate::kernels::Real;
use crate::kernels::vector::{cross, dot};
use crate::mesh::edges::EDGE;

/// Edges and tets.
#[derive(Clone, Copy, Debug)]
pub struct Edges<'a, T> {
    /// Edges 01 02 03 12 13 23 of each tet `[n_tets]`, each stored as `edge * 2 + reversed`.
    pub tet_edges: &'a [[u32; 6]],
    /// Edge vectors `[n_edges]`, any unit; the fourth component is not used.
    pub edge_vector: &'a [[T; 4]],
}

/// Upper bound of `1 / sin^2` of one dihedral angle: `sin^2` is clamped below at 1e-6, also in a
/// flat tet.
const LARGEST: f64 = 1e6;

/// Tets whose edges are gathered together.
const BLOCK: usize = 32;

/// Local edges of the face opposite each local vertex.
const FACE: [[usize; 3]; 4] = [[3, 4, 5], [1, 2, 5], [0, 2, 4], [0, 1, 3]];

/// Local edges at each local vertex.
const STAR: [[usize; 3]; 4] = [[0, 1, 2], [0, 3, 4], [1, 3, 5], [2, 4, 5]];

/// Contributions of a chunk of tets to the torsional stiffness of their edges.
///
/// The stiffness of an edge is the sum over its tets, in their order.
///
/// - `first_tet`: tet of the chunk's first element
/// - `facing` `[tets of the chunk]`: receives `1 / sin^2` of the dihedral angle that faces each of
///   a tet's six edges, without unit
///
/// Source: Murayama, Nakahashi and Matsushima 2002.
pub fn run<T: Real>(first_tet: usize, edges: &Edges<T>, facing: &mut [[T; 6]]) {
    for (block, facing) in facing.chunks_mut(BLOCK).enumerate() {
        // The edge vectors of a block are gathered first, so that the processor loads many edges at
        // a time.
        let mut vectors = [[[T::ZERO; 3]; 6]; BLOCK];
        let first = first_tet + block * BLOCK;
        for (of_tet, edges_of_tet) in vectors.iter_mut().zip(&edges.tet_edges[first..first + facing.len()]) {
            for (vector, edge) in of_tet.iter_mut().zip(edges_of_tet) {
                *vector = xyz(&edges.edge_vector[*edge as usize / 2]);
            }
        }
        facing.iter_mut().zip(vectors).for_each(|(facing, vectors)| *facing = of_edges(vectors));
    }
}

/// `1 / sin^2` of the dihedral angles that face the six edges of a tet, at most 1e6. The angle at
/// the opposite edge faces an edge.
///
/// For edge ij and opposite edge kl: `sin^2 = 36 V^2 l_kl^2 / (S_i S_j)`, with `S_i = 4 A_i^2` of
/// the face opposite i. The formula has squares only, so the direction in which an edge is stored
/// does not matter.
fn of_edges<T: Real>(mut vectors: [[T; 3]; 6]) -> [T; 6] {
    let limit = T::from_f64(LARGEST);
    // The angle has no unit. The longest edge is scaled to 1, so squares of squares stay in the
    // range of f32.
    let longest = vectors.iter().map(|&v| dot(v, v)).fold(T::ZERO, T::max_magnitude);
    if longest == T::ZERO {
        return [limit; 6];
    }
    let scale = T::ONE / longest.sqrt();
    let mut squared = [T::ZERO; 6];
    for (vector, squared) in vectors.iter_mut().zip(&mut squared) {
        *vector = [vector[0] * scale, vector[1] * scale, vector[2] * scale];
        *squared = dot(*vector, *vector);
    }
    let (mut face, mut to_plane) = ([T::ZERO; 4], [T::ZERO; 4]);
    for vertex in 0..4 {
        let normal = area_vector(&vectors, &squared, FACE[vertex]);
        let volume = dot(shortest(&vectors, &squared, STAR[vertex]), normal);
        face[vertex] = dot(normal, normal);
        to_plane[vertex] = volume * volume / face[vertex];
    }
    let mut facing = [limit; 6];
    for (local, [i, j]) in EDGE.into_iter().enumerate() {
        let l_kl = squared[5 - local];
        if face[j] != T::ZERO && l_kl != T::ZERO {
            // Squared distances of j from line kl and from plane ikl. Two quotients keep every
            // product in the range of f32.
            let to_line = face[i] / l_kl;
            if to_line < limit * to_plane[j] {
                facing[local] = to_line / to_plane[j];
            }
        }
    }
    facing
}

#[inline(always)]
fn xyz<T: Real>(v: &[T; 4]) -> [T; 3] {
    [v[0], v[1], v[2]]
}

/// Twice the area vector, up to its sign, of the triangle with three of the edge vectors.
///
/// The two shorter edges are used. The angle between them is the triangle's largest, so a needle
/// loses no digits to cancellation.
#[inline(always)]
fn area_vector<T: Real>(vectors: &[[T; 3]; 6], squared: &[T; 6], [a, b, c]: [usize; 3]) -> [T; 3] {
    let [first, second] = if squared[c] >= squared[a] && squared[c] >= squared[b] {
        [a, b]
    } else if squared[b] >= squared[a] {
        [a, c]
    } else {
        [b, c]
    };
    cross(vectors[first], vectors[second])
}

#[inline(always)]
fn shortest<T: Real>(vectors: &[[T; 3]; 6], squared: &[T; 6], [a, b, c]: [usize; 3]) -> [T; 3] {
    let shortest = if squared[a] <= squared[b] && squared[a] <= squared[c] {
        a
    } else if squared[b] <= squared[c] {
        b
    } else {
        c
    };
    vectors[shortest]
}
