//! The memory that a mover takes, estimated before it is set up.

use crate::mesh::HybridMesh;
use crate::profile::SECTIONS_AT_ONCE;
use crate::stages::WingProfiles;

/// Bytes that a mover takes at most for each tet, updates included and the given mesh excluded. A
/// jump alone takes half of it on the heap; local optimisation and what the allocator keeps come on
/// top.
const OF_TET: u64 = 530;

/// Bytes for each corner tet of a cell that is no tet: its share of edges, rows and local
/// optimisation, counted from the sizes of these arrays.
const OF_CORNER: u64 = 400;

/// Bytes for each family: its networks and its shape. Measured with 2 220 carenages of one triangle
/// each, which took 30 MB more than one carenage of all these triangles.
const OF_FAMILY: u64 = 14_000;

/// Bytes for each old profile of a wing, and for each of its points. Measured with 20 000 profiles
/// of 40 points.
const OF_PROFILE: u64 = 4_000;
const OF_POINT: u64 = 150;
/// Bytes for the smooth curves through a profile and through the wing's own section in its plane,
/// and for each point of the profile. At most [`SECTIONS_AT_ONCE`] sections have their curves at
/// one time. Measured with profiles of 1 000 points; a profile of many more points takes a third of
/// it for each.
const OF_CURVES: u64 = 220_000;
const OF_CURVES_AT_POINT: u64 = 1_000;

/// Bytes that a mover of this mesh with these wings takes at most.
pub(super) fn bytes(mesh: HybridMesh, wings: &[WingProfiles]) -> u64 {
    let points = wings.iter().flat_map(|wing| &wing.old).map(|profile| profile.points.len() as u64);
    let mut n_points: Vec<u64> = points.collect();
    n_points.sort_unstable_by(|a, b| b.cmp(a));
    let kept: u64 = n_points.iter().map(|points| OF_PROFILE + OF_POINT * points).sum();
    let largest = n_points.iter().take(SECTIONS_AT_ONCE);
    let curves: u64 = largest.map(|points| OF_CURVES + OF_CURVES_AT_POINT * points).sum();
    let of_cells = OF_TET * mesh.mesh.tets.len() as u64 + OF_CORNER * mesh.others.n_corner_tets() as u64;
    of_cells + OF_FAMILY * mesh.mesh.families.len() as u64 + kept + curves
}
