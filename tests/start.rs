//! Updates that start from the last design.

mod common;

use common::aircraft::*;
use common::{compare, compare_by};
use glam::DVec3;
use idmesh::mover::Mover;
use idmesh::profile::Profile;
use idmesh::relaxation::Stopping;
use idmesh::volume::Start;

/// Profiles raised by so much of their distance from the symmetry plane.
fn raised(old: &[Profile], share: f64) -> Vec<Profile> {
    let raise = |old: &Profile| {
        let points = old.points.iter().map(|at| *at + DVec3::Z * (share * at.y)).collect();
        Profile { number: old.number, points }
    };
    old.iter().map(raise).collect()
}

/// Each vertex's shortest edge, by the tets.
fn shortest_edges(mover: &Mover) -> Vec<f64> {
    let mesh = mover.mesh();
    let mut shortest = vec![f64::INFINITY; mesh.vertices.len()];
    for tet in &mesh.tets {
        for &a in tet {
            for &b in tet.iter().filter(|&&b| b != a) {
                let length = mesh.vertices[a as usize].distance(mesh.vertices[b as usize]);
                shortest[a as usize] = shortest[a as usize].min(length);
            }
        }
    }
    shortest
}

/// Both ends are estimated to be within 1e-4 shortest edges of the same equilibrium; an error of a
/// rotation moves a vertex by itself times some tens of edges.
///
/// Fails if `NORMAL` is 100 or 0.
#[test]
fn the_last_design_is_a_shorter_way_to_the_same_place() {
    for aircraft in [SMALL, WING_BODY] {
        let old = aircraft.profiles("old_2");
        let mut looped = aircraft.mover(2);
        let edges = shortest_edges(&looped);
        looped.start_from(Start::LastDesign);
        for (at, share) in [0.05, 0.051, 0.051, -0.03].into_iter().enumerate() {
            let design = raised(&old, share);
            let from_last = update(&mut looped, design.clone());
            let from_undeformed = update(&mut aircraft.mover(2), design);
            assert!(from_last.converged && from_undeformed.converged);
            let near = compare_by(from_undeformed.vertices(), from_last.vertices(), |vertex| 1e-3 * edges[vertex]);
            near.unwrap_or_else(|mismatch| panic!("{share}: {mismatch:?}"));
            let same = compare(from_undeformed.vertices(), from_last.vertices(), 0.0);
            let (few, many) = (from_last.solver.sweeps, from_undeformed.solver.sweeps);
            match at {
                // Nothing to start from yet.
                0 => assert!(same.is_ok() && few == many),
                1 | 2 => assert!(same.is_err() && few < many, "{share}: {few} sweeps, not fewer than {many}"),
                _ => assert!(same.is_err()),
            }
        }
    }
}

/// At a small tolerance nothing of the start is left: rotations and planes start from the last
/// design too, and end where they do from the undeformed mesh.
///
/// Fails if the rotations of surfaces see the last displacement of the planes beside them.
#[test]
fn the_start_does_not_show_at_a_small_tolerance() {
    let old = SMALL.profiles("old_2");
    let build = || {
        let stopping = Stopping { tolerance: 1e-10, ..Stopping::default() };
        SMALL.builder(old.clone()).stopping(stopping).build(cpu()).unwrap()
    };
    let mut looped = build();
    looped.start_from(Start::LastDesign);
    for share in [0.05, -0.03, 0.02] {
        let from_last = update(&mut looped, raised(&old, share));
        let from_undeformed = update(&mut build(), raised(&old, share));
        compare(from_undeformed.vertices(), from_last.vertices(), 1e-8).unwrap();
    }
}

/// Back at the undeformed mesh nothing of the last design is left.
#[test]
fn the_last_design_is_forgotten_on_request() {
    let mut mover = SMALL.mover(2);
    mover.start_from(Start::LastDesign);
    update(&mut mover, SMALL.profiles("planform_2"));
    mover.start_from(Start::Undeformed);
    let last = update(&mut mover, SMALL.profiles("big_2"));
    compare(update(&mut SMALL.mover(2), SMALL.profiles("big_2")).vertices(), last.vertices(), 0.0).unwrap();
}

/// A mover may be built on one thread and used on another.
#[test]
fn movers_are_send() {
    let mut mover = SMALL.mover(2);
    let here = update(&mut mover, SMALL.profiles("big_2"));
    let there = std::thread::spawn(move || update(&mut mover, SMALL.profiles("big_2"))).join().unwrap();
    compare(here.vertices(), there.vertices(), 0.0).unwrap();
}
