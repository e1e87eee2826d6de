//! Bricks shaken inside, for the tests of local optimisation.
#![allow(dead_code, reason = "each test file uses a part of it")]

use glam::DVec3;
use idmesh::backend::{CpuBackend, Precision};
use idmesh::constraint::Constraint;
use idmesh::mesh::TetMesh;
use idmesh::quality;

pub const F64: CpuBackend = CpuBackend { precision: Precision::F64 };
pub const F32: CpuBackend = CpuBackend { precision: Precision::F32 };

/// Numbers in -1..1 that depend on their argument alone.
pub fn noise(n: usize) -> DVec3 {
    let one = |n: u64| {
        let x = (n + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (x ^ (x >> 27)) as f64 / u64::MAX as f64 * 2.0 - 1.0
    };
    DVec3::new(one(3 * n as u64), one(3 * n as u64 + 1), one(3 * n as u64 + 2))
}

/// Whether a vertex of the brick is on its surface.
pub fn on_boundary(at: DVec3) -> bool {
    at.min_element() == 0.0 || at.max_element() == 1.0
}

/// Boundary held, the rest free.
pub fn hold_boundary(mesh: &TetMesh) -> Vec<Constraint> {
    mesh.vertices.iter().map(|&at| if on_boundary(at) { Constraint::Held } else { Constraint::Free }).collect()
}

/// Vertices inside a face of the unit cube slide in it, those inside an edge slide on it, corners
/// stay.
pub fn slide_on_boundary(mesh: &TetMesh) -> Vec<Constraint> {
    let of_vertex = |&at: &DVec3| {
        let fixed: Vec<usize> = (0..3).filter(|&axis| at[axis] == 0.0 || at[axis] == 1.0).collect();
        match fixed[..] {
            [] => Constraint::Free,
            [axis] => Constraint::InPlane(DVec3::AXES[axis]),
            [a, b] => Constraint::OnLine(DVec3::AXES[3 - a - b]),
            _ => Constraint::Held,
        }
    };
    mesh.vertices.iter().map(of_vertex).collect()
}

/// The mesh with its free vertices displaced by up to `amount` in each direction, as their
/// constraints allow.
pub fn shaken(mesh: &TetMesh, constraint: &[Constraint], amount: f64) -> Vec<DVec3> {
    let place = |(vertex, &at): (usize, &DVec3)| at + constraint[vertex].limit(noise(vertex) * amount);
    mesh.vertices.iter().enumerate().map(place).collect()
}

/// How many tets are inverted, and the worst beta.
pub fn worst(mesh: &TetMesh, positions: &[DVec3]) -> (usize, f64) {
    let statistics = quality::Statistics::new(&quality::betas(positions, &mesh.tets));
    (statistics.inverted, statistics.min)
}

/// The vertex in the middle of a brick of an even number of cells a side.
pub fn middle(mesh: &TetMesh) -> usize {
    mesh.vertices.iter().position(|&at| at == DVec3::splat(0.5)).unwrap()
}
