//! What several test files share.
#![allow(dead_code, reason = "each test file uses a part of it")]

#[cfg(feature = "gpu")]
pub mod adapter;
pub mod aircraft;
pub mod block;
pub mod brick;
pub mod carved;
pub mod faults;
pub mod parts;

use std::sync::Arc;

use glam::DVec3;
use idmesh::backend::NetworkData;
use idmesh::constraint::Constraint;
use idmesh::mesh::csr::Csr;

/// Where two results differ most, beyond what they may.
#[derive(Debug)]
pub struct Mismatch {
    /// The vertex (or edge) it is at; the first one missing where the lengths differ.
    pub worst_vertex: usize,
    /// Expected value there.
    pub expected: f64,
    /// Value found there.
    pub found: f64,
}

/// Compares component by component, and names the vertex that is worst in terms of its tolerance.
///
/// - `tolerance`: what a component may differ by, per vertex; 0 asks for equal bits
///
/// A NaN on either side is a difference beyond all others: `f64::max` would drop it and let a dead
/// kernel pass.
pub fn compare_by(expected: &[DVec3], found: &[DVec3], tolerance: impl Fn(usize) -> f64) -> Result<(), Mismatch> {
    if expected.len() != found.len() {
        let worst_vertex = expected.len().min(found.len());
        return Err(Mismatch { worst_vertex, expected: expected.len() as f64, found: found.len() as f64 });
    }
    // Above zero: beyond the tolerance. NaN counts as infinitely far.
    let excess = |vertex: usize, a: f64, b: f64| {
        let allowed = tolerance(vertex);
        if a.is_nan() || b.is_nan() {
            f64::INFINITY
        } else if a.to_bits() == b.to_bits() {
            f64::NEG_INFINITY
        } else if allowed == 0.0 {
            // Equal numbers of different bits (0 and -0) differ too.
            (a - b).abs() + f64::MIN_POSITIVE
        } else {
            (a - b).abs() / allowed - 1.0
        }
    };
    let components = expected.iter().zip(found).enumerate().flat_map(|(vertex, (a, b))| {
        let (a, b) = (a.to_array(), b.to_array());
        (0..3).map(move |axis| (excess(vertex, a[axis], b[axis]), vertex, a[axis], b[axis]))
    });
    match components.max_by(|x, y| x.0.total_cmp(&y.0)) {
        Some((excess, worst_vertex, expected, found)) if excess > 0.0 => {
            Err(Mismatch { worst_vertex, expected, found })
        }
        _ => Ok(()),
    }
}

/// As [`compare_by`], with one tolerance for all.
pub fn compare(expected: &[DVec3], found: &[DVec3], tolerance: f64) -> Result<(), Mismatch> {
    compare_by(expected, found, |_| tolerance)
}

/// Numbers as the first components of vectors, for [`compare`].
pub fn as_vectors(numbers: &[f64]) -> Vec<DVec3> {
    numbers.iter().map(|&number| DVec3::new(number, 0.0, 0.0)).collect()
}

/// Fails with what differs.
#[track_caller]
pub fn assert_close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "found {found}, expected {expected} +- {tolerance}");
}

/// A network that owns its arrays.
#[derive(Clone, Debug)]
pub struct Network {
    pub graph: Arc<Csr>,
    pub stiffness: Vec<f64>,
    pub anchor: Vec<f64>,
    pub inverse_length: Vec<f64>,
    pub constraint: Vec<Constraint>,
}

impl Network {
    /// Free vertices joined by springs `(vertex, vertex, stiffness)`, without anchors, of unit
    /// length.
    pub fn new(n_vertices: usize, springs: &[(u32, u32, f64)]) -> Self {
        let both = || springs.iter().flat_map(|&(i, j, k)| [(i, j, k), (j, i, k)]);
        let graph = Csr::from_pairs(n_vertices, both().map(|(i, j, _)| (i, j)));
        // Stable: within a row the springs keep their order, as in `from_pairs`.
        let mut by_row: Vec<_> = both().collect();
        by_row.sort_by_key(|spring| spring.0);
        Self {
            graph: Arc::new(graph),
            stiffness: by_row.into_iter().map(|spring| spring.2).collect(),
            anchor: vec![0.0; n_vertices],
            inverse_length: vec![1.0; n_vertices],
            constraint: vec![Constraint::Free; n_vertices],
        }
    }

    pub fn data(&self) -> NetworkData<'_> {
        NetworkData {
            graph: &self.graph,
            stiffness: &self.stiffness,
            anchor: &self.anchor,
            inverse_length: &self.inverse_length,
            constraint: &self.constraint,
        }
    }

    pub fn n_vertices(&self) -> usize {
        self.anchor.len()
    }

    /// Longest row.
    pub fn max_valence(&self) -> usize {
        (0..self.n_vertices()).map(|row| self.graph.row(row).len()).max().unwrap_or(0)
    }
}
