//! Where the wing's edges cross the profiles' planes, and what the facets make of the displacement there.
//!
//! A wing of facets moves by its vertices. Even if every vertex moves exactly right, the section between two of them is the
//! straight line between their displacements and misses the new profile: on a coarse mesh by half a percent of the
//! chord. The ends of the edges that cross a plane are therefore corrected until the crossings go where the profile says:
//! a damped least-squares problem. Undamped, a strip of triangles has nearly as many crossings as vertices, and vertices on
//! either side of the plane would be played off against each other.
//!
//! Its normal equations follow from the mesh alone and are factored once. Along a section each vertex is tied to the few next
//! to it: numbered breadth first, the factor has little more entries than the matrix.

use glam::DVec3;
use nalgebra::DMatrix;
use nalgebra_sparse::{CooMatrix, CscMatrix, factorization::CscCholesky};

use crate::mesh::csr::Csr;

/// Weight of the square of the correction against that of what is missing: what varies slowly along the section is
/// corrected to 0.2 %, what alternates from vertex to vertex is left.
const DAMPING: f64 = 1e-3;

/// What the corrections of the vertices beside the planes follow from.
#[derive(Debug)]
pub(super) struct Corrector {
    crossings: Vec<Crossing>,
    /// The vertices at the crossings' ends, in the order of the unknowns.
    vertices: Vec<u32>,
    /// Of the normal equations.
    factor: CscCholesky<f64>,
}

/// One edge that crosses one plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// Its ends, as places among the wing's vertices.
    pub ends: [u32; 2],
    /// Where it crosses: 0 at the first end, 1 at the second.
    pub at: f64,
}

/// The edges that cross any of the planes.
///
/// - `distances` `[n_planes][n_vertices]`: signed distance of each vertex from each plane
/// - `edges`: pairs of places among the vertices
pub(super) fn find(distances: &[Vec<f64>], edges: &[[u32; 2]]) -> Vec<Crossing> {
    let crossing = |distances: &Vec<f64>, ends: [u32; 2]| {
        let [a, b] = ends.map(|end| distances[end as usize]);
        let at = a / (a - b);
        // A vertex on the plane has the profile's displacement already; distances that overflow cross nowhere.
        (a * b < 0.0 && at.is_finite()).then_some(Crossing { ends, at })
    };
    distances.iter().flat_map(|distances| edges.iter().filter_map(move |&ends| crossing(distances, ends))).collect()
}

impl Corrector {
    /// Factors the normal equations of these crossings of edges between `n_vertices` vertices.
    pub(super) fn new(crossings: Vec<Crossing>, n_vertices: usize) -> Self {
        let ends = crossings.iter().flat_map(|&Crossing { ends: [a, b], .. }| [(a, b), (b, a)]);
        let graph = Csr::from_pairs(n_vertices, ends);
        let vertices = graph.breadth_first(|vertex| !graph.row(vertex).is_empty());
        let mut place = vec![0; n_vertices];
        vertices.iter().enumerate().for_each(|(at, &vertex)| place[vertex as usize] = at);
        let mut matrix = CooMatrix::new(vertices.len(), vertices.len());
        (0..vertices.len()).for_each(|at| matrix.push(at, at, DAMPING));
        for crossing in &crossings {
            let ends = crossing.weighted_ends().map(|(end, weight)| (place[end], weight));
            for (row, of_row) in ends {
                ends.iter().for_each(|&(column, of_column)| matrix.push(row, column, of_row * of_column));
            }
        }
        let factor =
            CscCholesky::factor(&CscMatrix::from(&matrix)).expect("damped normal equations are positive definite");
        Self { crossings, vertices, factor }
    }

    /// Number of crossings.
    pub(super) fn n_crossings(&self) -> usize {
        self.crossings.len()
    }

    /// Corrects displacements `[n_vertices]` so that the crossings move by `target` `[n_crossings]`.
    pub(super) fn correct(&self, target: &[DVec3], displacement: &mut [DVec3]) {
        let mut pull = vec![DVec3::ZERO; displacement.len()];
        for (crossing, &target) in self.crossings.iter().zip(target) {
            let missing = target - crossing.between(displacement);
            crossing.weighted_ends().into_iter().for_each(|(end, weight)| pull[end] += missing * weight);
        }
        let pull = |at: usize, axis: usize| pull[self.vertices[at] as usize][axis];
        let mut correction = DMatrix::from_fn(self.vertices.len(), 3, pull);
        self.factor.solve_mut(&mut correction);
        for (at, &vertex) in self.vertices.iter().enumerate() {
            displacement[vertex as usize] += DVec3::from_array([0, 1, 2].map(|axis| correction[(at, axis)]));
        }
    }
}

impl Crossing {
    fn weighted_ends(&self) -> [(usize, f64); 2] {
        [(self.ends[0] as usize, 1.0 - self.at), (self.ends[1] as usize, self.at)]
    }

    /// The value at the crossing of what is linear between the vertices.
    fn between(&self, values: &[DVec3]) -> DVec3 {
        let [(a, weight_a), (b, weight_b)] = self.weighted_ends();
        values[a] * weight_a + values[b] * weight_b
    }
}
