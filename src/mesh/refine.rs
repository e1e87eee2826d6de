//! Uniform refinement: every tet is cut into eight.

use glam::DVec3;
use rayon::prelude::*;

use super::{MeshError, TetMesh, edges::EDGE, edges::TetEdges, validate};

/// Cuts every tet at the middles of its edges into eight, and every boundary triangle into four of
/// the same family.
///
/// The vertices of the mesh come first, then the middles of its edges in the order of [`TetEdges`].
/// The eight pieces of a tet follow one another. Four pieces are the tet at half its size. The
/// octahedron between them is cut along the shortest of its three diagonals, which gives the best
/// shapes. Surfaces stay flat between the old vertices.
///
/// # Errors
/// The mesh is not valid; see [`validate()`].
pub fn refine(mesh: &TetMesh) -> Result<TetMesh, MeshError> {
    validate(mesh)?;
    let n = mesh.vertices.len();
    let TetEdges { edges, tet_edges, .. } = TetEdges::new(n, &mesh.tets);
    let middle = |&[a, b]: &[u32; 2]| 0.5 * mesh.vertices[a as usize] + 0.5 * mesh.vertices[b as usize];
    let mut vertices = mesh.vertices.clone();
    vertices.par_extend(edges.par_iter().map(middle));
    let middle_of = |edge: u32| n as u32 + edge;
    let pieces =
        |(tet, of_tet): (&[u32; 4], &[u32; 6])| pieces_of_tet(*tet, of_tet.map(|edge| middle_of(edge / 2)), &vertices);
    let tets = mesh.tets.par_iter().zip(&tet_edges).flat_map_iter(pieces).collect();
    let triangles = mesh.triangles.par_iter().flat_map_iter(|&[a, b, c]| {
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[from, to]| {
            let edge = edges.binary_search(&[from.min(to), from.max(to)]);
            middle_of(edge.expect("a boundary triangle is a face of a tet") as u32)
        });
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    });
    let triangles = triangles.collect();
    let triangle_family = mesh.triangle_family.iter().flat_map(|&family| [family; 4]).collect();
    Ok(TetMesh { vertices, tets, triangles, triangle_family, families: mesh.families.clone() })
}

/// The eight pieces of a tet, given the middles of its edges in the order of [`EDGE`].
pub(super) fn pieces_of_tet(corners: [u32; 4], middles: [u32; 6], vertices: &[DVec3]) -> [[u32; 4]; 8] {
    let between = |a: usize, b: usize| {
        let edge = EDGE.iter().position(|edge| *edge == [a.min(b), a.max(b)]);
        middles[edge.expect("two different corners span an edge")]
    };
    // Even permutations of the corners. In each, another of the three diagonals joins the middles
    // of the edges 01 and 23.
    let turned = [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2]];
    let diagonal = |[a, b, c, d]: [usize; 4]| {
        let [from, to] = [between(a, b), between(c, d)].map(|vertex| vertices[vertex as usize]);
        from.distance_squared(to)
    };
    let shortest = |best, other| if diagonal(other) < diagonal(best) { other } else { best };
    let [a, b, c, d] = turned.into_iter().reduce(shortest).expect("there are three");
    let ring = [between(a, c), between(a, d), between(b, d), between(b, c)];
    let around = |at: usize| [between(a, b), between(c, d), ring[at], ring[(at + 1) % 4]];
    let [p, q, r, s] = corners;
    [
        [p, between(0, 1), between(0, 2), between(0, 3)],
        [between(0, 1), q, between(1, 2), between(1, 3)],
        [between(0, 2), between(1, 2), r, between(2, 3)],
        [between(0, 3), between(1, 3), between(2, 3), s],
        around(0),
        around(1),
        around(2),
        around(3),
    ]
}
