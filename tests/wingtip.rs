//! The wingtip between its two ends: coefficient 1, a plain spring network, and coefficient 0,
//! carried with its boundary.

mod common;

use std::collections::BTreeSet;

use common::aircraft::*;
use glam::{DQuat, DVec3};
use idmesh::families::{Role, TipStart};
use idmesh::geometry::fitted_motion::FittedMotion;
use idmesh::mesh::{FamilyId, TetMesh};
use idmesh::mover::{Mover, Outcome, Warning};
use idmesh::profile::Profile;
use idmesh::relaxation::Stopping;

/// Relaxed this far, what is left of the springs' forces is rounding.
const EXACT: Stopping = Stopping { tolerance: 1e-11, max_sweeps: 1_000_000 };

fn with_tip(coefficient: f64, start: TipStart) -> Mover {
    let builder = WING_BODY.builder(WING_BODY.profiles("old_2")).stopping(EXACT);
    builder.role("wingtip", Role::Wingtip { coefficient, start }).build(cpu()).unwrap()
}

fn moved(coefficient: f64, start: TipStart, new: Vec<Profile>) -> (TetMesh, Outcome) {
    let mut mover = with_tip(coefficient, start);
    let outcome = update(&mut mover, new);
    (mover.mesh().clone(), outcome)
}

/// The old profiles, mapped.
fn mapped(map: impl Fn(DVec3) -> DVec3) -> Vec<Profile> {
    let mut profiles = WING_BODY.profiles("old_2");
    profiles.iter_mut().flat_map(|profile| &mut profile.points).for_each(|point| *point = map(*point));
    profiles
}

/// The tip's vertices that are on no other family.
fn inside(mesh: &TetMesh) -> Vec<usize> {
    let placed: BTreeSet<usize> =
        ["wing", "trailing_edge"].iter().flat_map(|family| vertices_of(mesh, family)).collect();
    let inside: Vec<usize> =
        vertices_of(mesh, "wingtip").into_iter().filter(|vertex| !placed.contains(vertex)).collect();
    assert!(inside.len() > 100, "{}", inside.len());
    inside
}

/// Largest sum of spring forces `(u_j - u_i) / l_ij` on an inner vertex, over the largest single
/// one.
fn unbalance(mesh: &TetMesh, u: &[DVec3]) -> f64 {
    let edges: BTreeSet<[usize; 2]> = triangles_of(mesh, "wingtip")
        .into_iter()
        .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    let mut force = vec![DVec3::ZERO; u.len()];
    let mut largest: f64 = 0.0;
    for &[a, b] in &edges {
        let pull = (u[b] - u[a]) / mesh.vertices[a].distance(mesh.vertices[b]);
        force[a] += pull;
        force[b] -= pull;
        largest = largest.max(pull.length());
    }
    inside(mesh).into_iter().map(|vertex| force[vertex].length()).fold(0.0, f64::max) / largest
}

fn largest_move(outcome: &Outcome, vertices: &[usize]) -> f64 {
    vertices.iter().map(|&vertex| outcome.displacement()[vertex].length()).fold(0.0, f64::max)
}

fn assert_equilibrium(start: TipStart) {
    let (mesh, outcome) = moved(1.0, start, WING_BODY.profiles("planform_2"));
    assert!(outcome.converged, "{:?}", outcome.unconverged);
    let left = unbalance(&mesh, outcome.displacement());
    assert!(left < 1e-9, "no equilibrium: {left:e} of the largest force is left");
    let mut wrong = outcome.displacement().to_vec();
    wrong[inside(&mesh)[3]].x += 1e-7;
    assert!(unbalance(&mesh, &wrong) > 1e-9);
}

#[test]
fn coefficient_1_from_the_original_is_spring_equilibrium() {
    assert_equilibrium(TipStart::Original);
}

/// Rounding of displacements of about 0.3 at coordinates of about 4.
const ROUNDING: f64 = 1e-12;

/// The design turns the whole wing rigidly: so does the tip, whatever it starts from but where it
/// was.
#[test]
fn coefficient_0_is_carried_rigidly() {
    let turn = DQuat::from_axis_angle(DVec3::new(0.1, 1.0, 0.05).normalize(), 0.03);
    let rigid = |at: DVec3| turn * at + DVec3::new(0.01, 0.0, 0.05);
    for start in [TipStart::Affine, TipStart::Rigid] {
        let (mesh, outcome) = moved(0.0, start, mapped(rigid));
        for vertex in inside(&mesh) {
            let off = outcome.vertices()[vertex].distance(rigid(mesh.vertices[vertex]));
            assert!(off < ROUNDING, "{start:?}: vertex {vertex} is {off:e} off");
        }
    }
}

/// A stretch and a shear in the plane of the flat tip are followed by the affine start, not by the
/// rigid one.
#[test]
fn an_affine_motion_of_the_boundary_is_followed_at_every_coefficient() {
    let affine = |at: DVec3| DVec3::new(1.05 * at.x + 0.1 * at.z, at.y, 0.9 * at.z + 0.02 * at.x);
    let off = |coefficient, start| {
        let (mesh, outcome) = moved(coefficient, start, mapped(affine));
        let off = |&vertex: &usize| outcome.vertices()[vertex].distance(affine(mesh.vertices[vertex]));
        inside(&mesh).iter().map(off).fold(0.0, f64::max)
    };
    for coefficient in [0.0, 0.5, 1.0] {
        assert!(
            off(coefficient, TipStart::Affine) < ROUNDING,
            "{coefficient}: {:e}",
            off(coefficient, TipStart::Affine)
        );
    }
    assert!(off(0.0, TipStart::Rigid) > 1e-3);
}

/// Whatever the boundary does: a rigid start keeps all distances inside.
#[test]
fn a_rigid_start_keeps_distances_for_any_design() {
    let (mesh, outcome) = moved(0.0, TipStart::Rigid, WING_BODY.profiles("planform_2"));
    let inside = inside(&mesh);
    assert!(largest_move(&outcome, &inside) > 0.1);
    for pair in inside.windows(2) {
        let distance = |at: &[DVec3]| at[pair[0]].distance(at[pair[1]]);
        common::assert_close(distance(outcome.vertices()), distance(&mesh.vertices), ROUNDING);
    }
}

/// The paper's words: the conservative springs pull back to the original place, at coefficient 0
/// all the way.
#[test]
fn coefficient_0_from_the_original_keeps_inner_vertices_in_their_places() {
    let (mesh, outcome) = moved(0.0, TipStart::Original, WING_BODY.profiles("planform_2"));
    let inside = inside(&mesh);
    assert!(common::faults::bits_changed(&mesh.vertices, outcome.vertices(), &inside, &[0, 1, 2]).is_empty());
    assert!(largest_move(&outcome, &vertices_of(&mesh, "wingtip")) > 0.1);
}

/// From the original start a larger coefficient lets the inside follow further, and never further
/// than the boundary.
#[test]
fn a_larger_coefficient_follows_further() {
    let follow = |coefficient| {
        let (mesh, outcome) = moved(coefficient, TipStart::Original, mapped(|at| at + DVec3::Z));
        let inside = inside(&mesh);
        inside.iter().map(|&vertex| outcome.displacement()[vertex].z).sum::<f64>() / inside.len() as f64
    };
    let follows = [0.0, 0.1, 0.5, 0.9, 1.0].map(follow);
    assert!(follows.windows(2).all(|pair| pair[0] < pair[1]), "{follows:?}");
    assert_eq!(follows[0], 0.0);
    common::assert_close(follows[4], 1.0, 1e-9);
}

/// The same mesh with the tip's triangles in three families: before and behind the middle of the
/// chord, and, on no other family's boundary, those inside.
fn in_three(coefficients: [f64; 3], start: TipStart) -> Mover {
    let mut mesh = WING_BODY.mesh();
    let inside: BTreeSet<usize> = inside(&mesh).into_iter().collect();
    let tip = mesh.family("wingtip").unwrap();
    let at = vertices_of(&mesh, "wingtip").into_iter().map(|vertex| mesh.vertices[vertex].x);
    let (low, high) = at.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    for (triangle, family) in mesh.triangles.iter().zip(&mut mesh.triangle_family).filter(|(_, family)| **family == tip)
    {
        let core = triangle.iter().all(|&vertex| inside.contains(&(vertex as usize)));
        let behind = mesh.vertices[triangle[0] as usize].x > 0.5 * (low + high);
        let further = FamilyId(mesh.families.len() as u16 + u16::from(core));
        *family = if core || behind { further } else { tip };
    }
    mesh.families.extend(["tip_behind".to_owned(), "tip_core".to_owned()]);
    let mut builder = builder(mesh, WING_BODY.profiles("old_2")).stopping(EXACT);
    for (name, coefficient) in ["wingtip", "tip_behind", "tip_core"].into_iter().zip(coefficients) {
        builder = builder.role(name, Role::Wingtip { coefficient, start });
    }
    builder.build(cpu()).unwrap()
}

/// Without conservative springs the families make no difference: there is no seam.
#[test]
fn families_that_touch_are_one_tip() {
    for start in [TipStart::Affine, TipStart::Original] {
        let (mesh, whole) = moved(1.0, start, WING_BODY.profiles("planform_2"));
        let parts = update(&mut in_three([1.0; 3], start), WING_BODY.profiles("planform_2"));
        assert!(largest_move(&whole, &inside(&mesh)) > 0.1);
        for vertex in inside(&mesh) {
            let off = parts.vertices()[vertex].distance(whole.vertices()[vertex]);
            assert!(off < 1e-9, "{start:?}: vertex {vertex} is {off:e} off");
        }
    }
}

/// A family that borders on no wing goes with those around it: rigidly, at every coefficient.
#[test]
fn families_that_touch_turn_together() {
    let turn = DQuat::from_axis_angle(DVec3::new(0.1, 1.0, 0.05).normalize(), 0.03);
    let rigid = |at: DVec3| turn * at + DVec3::new(0.01, 0.0, 0.05);
    for coefficients in [[0.5; 3], [0.0, 0.3, 1.0], [1.0, 0.0, 0.5]] {
        let mut mover = in_three(coefficients, TipStart::Affine);
        let core = vertices_of(mover.mesh(), "tip_core");
        assert!(core.len() > 50, "{}", core.len());
        let outcome = update(&mut mover, mapped(rigid));
        let mesh = mover.mesh();
        for vertex in ["wingtip", "tip_behind", "tip_core"].iter().flat_map(|family| vertices_of(mesh, family)) {
            let off = outcome.vertices()[vertex].distance(rigid(mesh.vertices[vertex]));
            assert!(off < 1e-9, "{coefficients:?}: vertex {vertex} is {off:e} off");
        }
        for vertex in core {
            let off = outcome.vertices()[vertex].distance(rigid(mesh.vertices[vertex]));
            assert!(off < ROUNDING, "{coefficients:?}: vertex {vertex} is {off:e} off");
        }
    }
}

/// Each family keeps its own coefficient, the smaller one on a curve they share: one of 0 is moved
/// like a rigid body.
#[test]
fn each_family_keeps_its_coefficient() {
    let mut mover = in_three([1.0, 1.0, 0.0], TipStart::Rigid);
    let outcome = update(&mut mover, WING_BODY.profiles("planform_2"));
    let mesh = mover.mesh();
    let core = vertices_of(mesh, "tip_core");
    let stretch = |pair: &[usize]| {
        let distance = |at: &[DVec3]| at[pair[0]].distance(at[pair[1]]);
        (distance(outcome.vertices()) / distance(&mesh.vertices) - 1.0).abs()
    };
    assert!(core.windows(2).map(stretch).fold(0.0, f64::max) < 1e-9);
    assert!(vertices_of(mesh, "tip_behind").windows(2).map(stretch).fold(0.0, f64::max) > 1e-3);
}

/// Where the boundary is finer it counts no more: the best motion balances its residuals over the
/// boundary's length.
#[test]
fn the_best_motion_is_that_of_the_boundary_s_length() {
    let (mesh, outcome) = moved(0.0, TipStart::Rigid, WING_BODY.profiles("planform_2"));
    let pair = |vertex: usize| (mesh.vertices[vertex], outcome.vertices()[vertex], 1.0);
    let motion = FittedMotion::rigid(&inside(&mesh).into_iter().map(pair).collect::<Vec<_>>());
    let edges = |family: &str| {
        let edges = triangles_of(&mesh, family).into_iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]);
        edges.map(|[a, b]| [a.min(b), a.max(b)]).collect::<BTreeSet<_>>()
    };
    let boundary = &edges("wingtip") & &(&edges("wing") | &edges("trailing_edge"));
    let left = |vertex: usize| motion.displacement(mesh.vertices[vertex]) - outcome.displacement()[vertex];
    let by_length: DVec3 =
        boundary.iter().map(|&[a, b]| 0.5 * mesh.vertices[a].distance(mesh.vertices[b]) * (left(a) + left(b))).sum();
    let by_number: DVec3 = boundary.iter().flatten().map(|&vertex| left(vertex)).sum::<DVec3>() / boundary.len() as f64;
    assert!(by_length.length() < 1e-9 && by_number.length() > 1e-4, "{by_length} {by_number}");
}

#[test]
fn families_that_touch_start_alike() {
    let mut mesh = WING_BODY.mesh();
    let tip = mesh.family("wingtip").unwrap();
    let second = FamilyId(mesh.families.len() as u16);
    *mesh.triangle_family.iter_mut().find(|family| **family == tip).unwrap() = second;
    mesh.families.push("tip_behind".into());
    let builder = builder(mesh, WING_BODY.profiles("old_2"));
    let behind = Role::Wingtip { coefficient: 0.5, start: TipStart::Rigid };
    let error = builder.role("tip_behind", behind).build(cpu()).err().unwrap().to_string();
    assert!(error.starts_with("the families `wingtip` and `tip_behind` are wingtips or attached"), "{error}");
}

/// What borders on nothing that an earlier stage places has nothing to follow.
#[test]
fn a_tip_that_nothing_holds_stays() {
    let tip = Role::Wingtip { coefficient: 0.5, start: TipStart::Affine };
    let mut mover = SMALL.builder(SMALL.profiles("old_2")).role("farfield", tip).build(cpu()).unwrap();
    let outcome = update(&mut mover, SMALL.profiles("big_2"));
    assert_eq!(outcome.warnings, [Warning::LooseTip { families: vec!["farfield".into()] }]);
    let unmoved = update(&mut mover, SMALL.profiles("old_2"));
    assert!(unmoved.warnings.is_empty());
    let mesh = mover.mesh();
    let farfield = vertices_of(mesh, "farfield");
    assert!(common::faults::bits_changed(&mesh.vertices, outcome.vertices(), &farfield, &[0, 1, 2]).is_empty());
}
