//! Aircraft that lack families, end in a plane or have several wings, in closed form.
//!
//! All are carved out of a box of 12 x 8 x 10 cells of 0.25, with the symmetry plane at y = 0.

mod common;

use std::collections::BTreeMap;

use common::aircraft::{cpu, vertices_of};
use common::carved::{carve, on};
use common::faults::{bits_changed, folded, inverted};
use glam::{DQuat, DVec3};
use idmesh::families::{Role, TipStart};
use idmesh::mesh::TetMesh;
use idmesh::mover::{Design, Mover, Outcome, Settings};
use idmesh::profile::{Plane, Profile, cut};
use idmesh::relaxation::{Method, Stopping};
use idmesh::stages::WingProfiles;
use idmesh::volume::MAX_STEPS;

const CELLS: [usize; 3] = [12, 8, 10];
const CELL: f64 = 0.25;
/// Rounding at coordinates of about 3.
const ROUNDING: f64 = 1e-12;

fn within(at: DVec3, low: [f64; 3], high: [f64; 3]) -> bool {
    at.cmpgt(DVec3::from_array(low)).all() && at.cmplt(DVec3::from_array(high)).all()
}

/// `symmetry` on the box's side y = 0, `farfield` on its others, and what is left.
fn outer(triangle: [DVec3; 3]) -> Option<&'static str> {
    if on(triangle, 1, 0.0) {
        return Some("symmetry");
    }
    let far = (0..3).any(|axis| on(triangle, axis, 0.0) || on(triangle, axis, CELLS[axis] as f64));
    far.then_some("farfield")
}

/// A block of 3 x `span` x 2 cells for a wing.
fn is_block(at: DVec3, from: f64, to: f64) -> bool {
    within(at, [4.0, from, 4.0], [7.0, to, 6.0])
}

fn set_up(mesh: TetMesh, old: &[(&str, Vec<Profile>)]) -> Mover {
    let role = |name: &String| match name.as_str() {
        "wing" | "tail" => Role::Wing,
        "trailing_edge" => Role::TrailingEdge,
        "wingtip" => Role::Wingtip { coefficient: 0.5, start: TipStart::default() },
        "symmetry" | "wall" => Role::PLANE,
        _ => Role::Fixed,
    };
    let settings = Settings {
        roles: mesh.families.iter().map(role).collect(),
        wings: old
            .iter()
            .map(|(name, profiles)| WingProfiles::new(name, mesh.family(name).unwrap(), profiles.clone()))
            .collect(),
        springs: Default::default(),
        method: Method::Chebyshev,
        stopping: Stopping { tolerance: 1e-10, ..Stopping::default() },
        // Springs alone: local optimisation would hide what they do, and its thresholds amplify rounding.
        quality: None,
        max_steps: MAX_STEPS,
    };
    Mover::new(mesh, settings, cpu(), &|_| {}).unwrap()
}

/// Profiles of a wing, cut at these `y`.
fn sections(mesh: &TetMesh, family: &str, at: &[f64]) -> Vec<Profile> {
    let family = mesh.family(family).unwrap();
    let own = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|&(_, &of)| of == family);
    let triangles: Vec<[u32; 3]> = own.map(|(&triangle, _)| triangle).collect();
    let plane = |(number, &y): (usize, &f64)| (number as i64, Plane { point: DVec3::Y * y, normal: DVec3::Y });
    // Blocks have flat facets, which are the surface itself.
    let section = |(number, plane)| Profile { number, points: cut::cut(&mesh.vertices, &triangles, &plane).unwrap() };
    at.iter().enumerate().map(plane).map(section).collect()
}

fn mapped(profiles: &[Profile], map: impl Fn(DVec3) -> DVec3) -> Vec<Profile> {
    let points = |profile: &Profile| profile.points.iter().map(|&point| map(point)).collect();
    profiles.iter().map(|profile| Profile { number: profile.number, points: points(profile) }).collect()
}

/// Moves to a design that leaves a valid mesh, with the symmetry plane and the farfield in their places to the bit.
fn run(mover: &mut Mover, new: &[(&str, Vec<Profile>)]) -> Outcome {
    let profiles: BTreeMap<String, _> = new.iter().map(|(name, new)| (name.to_string(), new.clone())).collect();
    let outcome = mover.update(&Design { profiles, ..Design::default() }, &|_| {}).unwrap();
    let mesh = mover.mesh();
    assert!(outcome.converged, "{:?}", outcome.unconverged);
    assert!(inverted(mesh, &outcome.vertices).is_empty());
    assert!(folded(mesh, &outcome.vertices).is_empty());
    let moved_bits =
        |name: &str, axes: &[usize]| bits_changed(&mesh.vertices, &outcome.vertices, &vertices_of(mesh, name), axes);
    assert!(moved_bits("farfield", &[0, 1, 2]).is_empty());
    assert!(moved_bits("symmetry", &[1]).is_empty());
    outcome
}

/// Every vertex of a family is where the map puts it.
#[track_caller]
fn assert_mapped(mesh: &TetMesh, outcome: &Outcome, family: &str, map: impl Fn(DVec3) -> DVec3) {
    for vertex in vertices_of(mesh, family) {
        let (at, found) = (mesh.vertices[vertex], outcome.vertices[vertex]);
        assert!(found.distance(map(at)) < ROUNDING, "{family} {at}: expected {}, found {found}", map(at));
    }
}

#[test]
#[should_panic(expected = "wing [")]
fn a_vertex_out_of_place_is_seen() {
    let mesh = bare_wing();
    let old = sections(&mesh, "wing", &[0.3, 1.1]);
    let mut mover = set_up(mesh, &[("wing", old.clone())]);
    let mut outcome = run(&mut mover, &[("wing", old)]);
    assert_mapped(mover.mesh(), &outcome, "wing", |at| at);
    outcome.vertices[vertices_of(mover.mesh(), "wing")[7]].z += 1e-11;
    assert_mapped(mover.mesh(), &outcome, "wing", |at| at);
}

/// A block from the symmetry plane on, all its faces of one family: no trailing edge, no wingtip, no fuselage.
fn bare_wing() -> TetMesh {
    let family = |triangle| outer(triangle).unwrap_or("wing");
    carve(CELLS, &["wing", "symmetry", "farfield"], |at| is_block(at, 0.0, 5.0), family, |at| at * CELL)
}

/// Fails if `ALIKE` of `edges` is 1.
#[test]
fn bare_wing_is_translated() {
    let mesh = bare_wing();
    let old = sections(&mesh, "wing", &[0.3, 1.1]);
    let mut mover = set_up(mesh, &[("wing", old.clone())]);
    let by = DVec3::new(0.06, 0.0, 0.11);
    let outcome = run(&mut mover, &[("wing", mapped(&old, |at| at + by))]);
    assert_mapped(mover.mesh(), &outcome, "wing", |at| at + by);
}

/// Thicker, longer and swept up: affine, in the planes of the profiles. Its root slides in the symmetry plane.
#[test]
fn bare_wing_changes_affinely() {
    let mesh = bare_wing();
    let old = sections(&mesh, "wing", &[0.3, 1.1]);
    let mut mover = set_up(mesh, &[("wing", old.clone())]);
    let affine = |at: DVec3| DVec3::new(1.1 * at.x - 0.1, at.y, 1.2 * at.z - 0.25 + 0.1 * at.y);
    let outcome = run(&mut mover, &[("wing", mapped(&old, affine))]);
    assert_mapped(mover.mesh(), &outcome, "wing", affine);
}

/// One profile gives its displacement to the whole wing.
#[test]
fn one_profile_translates_the_wing() {
    let mesh = bare_wing();
    let old = sections(&mesh, "wing", &[0.7]);
    let mut mover = set_up(mesh, &[("wing", old.clone())]);
    let by = DVec3::new(-0.05, 0.0, 0.07);
    let outcome = run(&mut mover, &[("wing", mapped(&old, |at| at + by))]);
    assert_mapped(mover.mesh(), &outcome, "wing", |at| at + by);
}

/// The wing is tilted about an axis along x, and its root leaves the symmetry plane. It slides back along the wing's
/// own straight lines, which are the tilted y direction; beyond the strip at the root the wing is tilted and no more.
#[test]
fn the_root_of_a_tilted_wing_slides_along_it_into_the_plane() {
    let mesh = bare_wing();
    // Three cells apart: the two sections have the same points, so lines of equal parameter are straight to rounding.
    let old = sections(&mesh, "wing", &[0.3, 1.05]);
    let mut mover = set_up(mesh, &[("wing", old.clone())]);
    let (turn, pivot) = (DQuat::from_rotation_x(0.1), DVec3::new(0.0, 0.3, 1.25));
    let tilted = |at: DVec3| pivot + turn * (at - pivot);
    let along = turn * DVec3::Y;
    let outcome = run(&mut mover, &[("wing", mapped(&old, tilted))]);
    let mesh = mover.mesh();
    let (mut root, mut outside) = (0, 0);
    for vertex in vertices_of(mesh, "wing") {
        let (at, found) = (mesh.vertices[vertex], outcome.vertices[vertex]);
        if at.y == 0.0 {
            let expected = tilted(at) - along * (tilted(at).y / along.y);
            assert!(found.distance(expected) < ROUNDING, "{at}: expected {expected}, found {found}");
            root += 1;
        } else if at.y > 0.5 {
            assert!(found.distance(tilted(at)) < ROUNDING, "{at}: expected {}, found {found}", tilted(at));
            outside += 1;
        }
    }
    assert_eq!((root, outside), (10, 10 + 10 + 12));
}

/// A wing from wall to wall, all in an odd attitude: no plane is a coordinate plane, and both ends stay in theirs.
#[test]
fn wing_between_two_oblique_walls_is_translated_along_them() {
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.7).normalize(), 0.4);
    let family = |triangle| match outer(triangle) {
        Some("farfield") if on(triangle, 1, CELLS[1] as f64) => "wall",
        Some(name) => name,
        None => "wing",
    };
    let families = ["wing", "symmetry", "wall", "farfield"];
    let straight = carve(CELLS, &families, |at| is_block(at, 0.0, 8.0), family, |at| at * CELL);
    let old = mapped(&sections(&straight, "wing", &[0.3, 1.7]), |at| turn * at);
    let mesh = TetMesh { vertices: straight.vertices.iter().map(|&at| turn * at).collect(), ..straight };
    let mut mover = set_up(mesh, &[("wing", old.clone())]);
    let by = turn * DVec3::new(0.06, 0.0, 0.11);
    let profiles = BTreeMap::from([("wing".to_owned(), mapped(&old, |at| at + by))]);
    let outcome = mover.update(&Design { profiles, ..Design::default() }, &|_| {}).unwrap();
    let mesh = mover.mesh();
    assert!(outcome.converged && inverted(mesh, &outcome.vertices).is_empty());
    assert_mapped(mesh, &outcome, "wing", |at| at + by);
    for (name, height) in [("symmetry", 0.0), ("wall", CELLS[1] as f64 * CELL)] {
        let vertices = vertices_of(mesh, name);
        let off = |&vertex: &usize| ((turn.inverse() * outcome.vertices[vertex]).y - height).abs();
        assert!(vertices.iter().map(off).fold(0.0, f64::max) < ROUNDING, "{name}");
        // They slide: not only the wing's own ends move.
        assert!(vertices.iter().filter(|&&vertex| outcome.displacement[vertex].length() > 1e-3).count() > 40, "{name}");
        assert!(outcome.families[name].max_distance_to_plane.unwrap() < ROUNDING);
    }
}

/// A wedge, sharp behind: the diagonal planes of 4 x 4 cells, drawn out to a chord of 2 and a height of 0.5.
#[test]
fn sharp_wing_with_a_wingtip_is_translated() {
    let is_wedge = |at: DVec3| within(at, [4.0, 0.0, 3.0], [8.0, 5.0, 7.0]) && at.x - 4.0 > at.z - 3.0;
    let family = |triangle| match outer(triangle) {
        Some(name) => name,
        None if on(triangle, 1, 5.0) => "wingtip",
        None => "wing",
    };
    // The wedge's edge at x = 4 becomes the trailing edge by half a turn about y.
    let place = |at: DVec3| DVec3::new((12.0 - at.x) * 0.5, at.y * CELL, (10.0 - at.z) * 0.125);
    let mesh = carve(CELLS, &["wing", "wingtip", "symmetry", "farfield"], is_wedge, family, place);
    let old = sections(&mesh, "wing", &[0.3, 1.1]);
    let mut mover = set_up(mesh, &[("wing", old.clone())]);
    let by = DVec3::new(0.06, 0.0, 0.04);
    let outcome = run(&mut mover, &[("wing", mapped(&old, |at| at + by))]);
    assert_mapped(mover.mesh(), &outcome, "wing", |at| at + by);
    assert_mapped(mover.mesh(), &outcome, "wingtip", |at| at + by);
}

/// A blunt wing whose trailing edge and tip are families of their own.
#[test]
fn blunt_wing_is_translated_with_its_trailing_edge_and_tip() {
    let family = |triangle| match outer(triangle) {
        Some(name) => name,
        None if on(triangle, 1, 5.0) => "wingtip",
        None if on(triangle, 0, 7.0) => "trailing_edge",
        None => "wing",
    };
    let families = ["wing", "trailing_edge", "wingtip", "symmetry", "farfield"];
    let mesh = carve(CELLS, &families, |at| is_block(at, 0.0, 5.0), family, |at| at * CELL);
    let old = sections(&mesh, "wing", &[0.3, 1.1]);
    let mut mover = set_up(mesh, &[("wing", old.clone())]);
    let by = DVec3::new(0.06, 0.0, 0.11);
    let outcome = run(&mut mover, &[("wing", mapped(&old, |at| at + by))]);
    for family in &families[..3] {
        assert_mapped(mover.mesh(), &outcome, family, |at| at + by);
    }
}

/// A wing on the symmetry plane and a tail that touches nothing, each with its own profiles.
#[test]
fn two_wings_follow_their_own_profiles() {
    let is_tail = |at: DVec3| within(at, [9.0, 2.0, 4.0], [11.0, 6.0, 5.0]);
    let family = |triangle: [DVec3; 3]| match outer(triangle) {
        Some(name) => name,
        None if triangle.iter().all(|at| at.x > 8.0) => "tail",
        None => "wing",
    };
    let families = ["tail", "wing", "symmetry", "farfield"];
    let mesh = carve(CELLS, &families, |at| is_block(at, 0.0, 5.0) || is_tail(at), family, |at| at * CELL);
    let wing = sections(&mesh, "wing", &[0.3, 1.1]);
    let tail = sections(&mesh, "tail", &[0.6, 0.9, 1.4]);
    let mut mover = set_up(mesh, &[("wing", wing.clone()), ("tail", tail.clone())]);
    let (up, down) = (DVec3::new(0.02, 0.0, 0.1), DVec3::new(-0.03, 0.0, -0.08));
    let both = [("wing", mapped(&wing, |at| at + up)), ("tail", mapped(&tail, |at| at + down))];
    let outcome = run(&mut mover, &both);
    assert_mapped(mover.mesh(), &outcome, "wing", |at| at + up);
    assert_mapped(mover.mesh(), &outcome, "tail", |at| at + down);
    assert_eq!(outcome.profiles.len(), 2);
    assert!(outcome.profiles.values().all(|report| report.max_distance_to_new_profiles.unwrap() < ROUNDING));

    // Only the tail: the wing stays to the bit.
    let outcome = run(&mut mover, &[("wing", wing), both[1].clone()]);
    let mesh = mover.mesh();
    let moved = bits_changed(&mesh.vertices, &outcome.vertices, &vertices_of(mesh, "wing"), &[0, 1, 2]);
    assert!(moved.is_empty());
    assert_mapped(mesh, &outcome, "tail", |at| at + down);
}
