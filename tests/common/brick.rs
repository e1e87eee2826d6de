//! A brick of tets, built without the crate's own topology.

use std::collections::HashMap;

use glam::{DQuat, DVec3};
use idmesh::backend::{Backend, EdgeStiffness};
use idmesh::constraint::Constraint;
use idmesh::mesh::csr::Csr;
use idmesh::springs::{Length, Stiffness, Torsion};

use super::Network;

/// A brick of cubes, six tets each around a common diagonal, with jittered inner vertices.
pub struct Brick {
    pub points: Vec<DVec3>,
    pub tets: Vec<[u32; 4]>,
    pub edges: Vec<[u32; 2]>,
    pub edge_vector: Vec<DVec3>,
    pub edge_tets: Csr,
    pub tet_edges: Vec<[u32; 6]>,
    pub on_boundary: Vec<bool>,
}

/// A number in -1..1 that depends on its argument alone.
pub fn noise(n: usize) -> f64 {
    let mut x = (n as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x ^ (x >> 31)) as f64 / u64::MAX as f64 * 2.0 - 1.0
}

/// A vector of such numbers.
pub fn noise_vector(n: usize) -> DVec3 {
    DVec3::new(noise(3 * n), noise(3 * n + 1), noise(3 * n + 2))
}

impl Brick {
    /// A brick with `n` cubes a side. Cubes are of side 1 but for `layers` of them at the bottom,
    /// of height 1e-5 like the boundary layer on a wing. It stands askew, so that no plane of it is
    /// a coordinate plane.
    pub fn new(n: usize, layers: usize) -> Self {
        let side = n + 1;
        let heights: Vec<f64> =
            (0..side).map(|k| if k <= layers { k as f64 * 1e-5 } else { (k - layers) as f64 }).collect();
        let id = |i: usize, j: usize, k: usize| ((k * side + j) * side + i) as u32;
        let mut points = Vec::new();
        let mut on_boundary = Vec::new();
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        for (k, &height) in heights.iter().enumerate() {
            for j in 0..side {
                for i in 0..side {
                    let boundary = [i, j, k].iter().any(|&at| at == 0 || at == n);
                    let gap = if k <= layers { 1e-5 } else { 1.0 };
                    let jitter = noise_vector(points.len()) * DVec3::new(0.2, 0.2, 0.2 * gap);
                    let at = DVec3::new(i as f64, j as f64, height);
                    points.push(turn * (at + if boundary { DVec3::ZERO } else { jitter }));
                    on_boundary.push(boundary);
                }
            }
        }
        let mut tets = Vec::new();
        for k in 0..n {
            for j in 0..n {
                for i in 0..n {
                    for (a, b) in [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)] {
                        let mut at = [i, j, k];
                        let mut tet = [id(i, j, k); 4];
                        at[a] += 1;
                        tet[1] = id(at[0], at[1], at[2]);
                        at[b] += 1;
                        tet[2] = id(at[0], at[1], at[2]);
                        tet[3] = id(i + 1, j + 1, k + 1);
                        tets.push(tet);
                    }
                }
            }
        }
        Self::from_tets(points, tets, on_boundary)
    }

    /// The edges of some tets.
    pub fn from_tets(points: Vec<DVec3>, tets: Vec<[u32; 4]>, on_boundary: Vec<bool>) -> Self {
        let mut number = HashMap::new();
        let mut edges: Vec<[u32; 2]> = Vec::new();
        let tet_edges: Vec<[u32; 6]> = tets
            .iter()
            .map(|tet| {
                [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)].map(|(a, b)| {
                    let (a, b) = (tet[a], tet[b]);
                    let edge = *number.entry((a.min(b), a.max(b))).or_insert_with(|| {
                        // Some edges run from the greater to the smaller vertex.
                        edges.push(if noise(edges.len()) > 0.0 { [a, b] } else { [b, a] });
                        edges.len() as u32 - 1
                    });
                    edge * 2 + u32::from(edges[edge as usize] != [a, b])
                })
            })
            .collect();
        let entries = tet_edges.iter().enumerate().flat_map(|(tet, of_tet)| {
            of_tet.iter().enumerate().map(move |(local, &edge)| (edge / 2, (tet * 6 + local) as u32))
        });
        Self {
            edge_vector: edges.iter().map(|&[a, b]| points[b as usize] - points[a as usize]).collect(),
            edge_tets: Csr::from_pairs(edges.len(), entries),
            points,
            tets,
            edges,
            tet_edges,
            on_boundary,
        }
    }

    pub fn stiffness_input(&self) -> EdgeStiffness<'_> {
        EdgeStiffness { edge_vector: &self.edge_vector, edge_tets: &self.edge_tets, tet_edges: &self.tet_edges }
    }

    /// Stiffness of each edge, away from walls.
    pub fn stiffness(&self, backend: &dyn Backend, length: Length, torsion: Torsion) -> Vec<f64> {
        let sums = backend.edge_stiffness(&self.stiffness_input()).unwrap();
        let stiffness = Stiffness { length, torsion, wall: 0.0 };
        self.edge_vector.iter().zip(sums).map(|(edge, sum)| stiffness.on_wall(edge.length(), sum)).collect()
    }

    /// The network of the edges with this stiffness, its boundary held.
    pub fn network(&self, stiffness: &[f64]) -> Network {
        let springs: Vec<_> = self.edges.iter().zip(stiffness).map(|(&[a, b], &k)| (a, b, k)).collect();
        let mut network = Network::new(self.points.len(), &springs);
        for (vertex, &on_boundary) in self.on_boundary.iter().enumerate() {
            if on_boundary {
                network.constraint[vertex] = Constraint::Held;
            }
        }
        network.inverse_length.fill(0.0);
        for (&[a, b], v) in self.edges.iter().zip(&self.edge_vector) {
            for vertex in [a, b] {
                let inverse = &mut network.inverse_length[vertex as usize];
                *inverse = inverse.max(v.length().recip());
            }
        }
        network
    }
}
