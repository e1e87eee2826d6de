//! What must not change a result: where and in which unit the aircraft stands, how often and on how many threads it is
//! moved, and a design that changes nothing.

mod common;

use common::aircraft::*;
use common::faults::{bits_changed, size};
use common::{Mismatch, compare};
use glam::{DQuat, DVec3};
use idmesh::mesh::TetMesh;
use idmesh::mover::{Mover, Outcome};
use idmesh::profile::{Plane, Profile, cut};

fn changed(old: &[DVec3], new: &[DVec3]) -> usize {
    let all: Vec<usize> = (0..old.len()).collect();
    bits_changed(old, new, &all, &[0, 1, 2]).len()
}

fn largest(displacement: &[DVec3]) -> f64 {
    displacement.iter().map(|d| d.length()).fold(0.0, f64::max)
}

// ---- nothing to do ----

fn cut_like(mesh: &TetMesh, profiles: &[Profile]) -> Vec<Profile> {
    let planes: Vec<_> = profiles.iter().map(|p| (p.number, Plane::of_profile(p).unwrap())).collect();
    let wing: Vec<_> = triangles_of(mesh, "wing").into_iter().map(|t| t.map(|vertex| vertex as u32)).collect();
    cut::cut_at_planes(&mesh.vertices, &wing, &planes).unwrap()
}

#[track_caller]
fn assert_unmoved(mover: &mut Mover, new: Vec<Profile>) {
    let outcome = update(mover, new);
    assert_eq!(changed(&mover.mesh().vertices, &outcome.vertices), 0);
    assert_eq!(outcome.beta, outcome.original_beta);
    assert!(outcome.converged);
}

#[test]
fn old_profiles_as_new_ones_change_no_bit() {
    for (aircraft, planes) in [(SMALL, 2), (WING_BODY, 2), (WING_BODY, 5), (ROUND, 2)] {
        let old = aircraft.profiles(&format!("old_{planes}"));
        assert_unmoved(&mut aircraft.mover(planes), old);
    }
}

/// Both sides cut from the mesh: at the planes of the new profiles, which are the old ones.
#[test]
fn profiles_cut_from_the_mesh_change_no_bit() {
    for aircraft in [SMALL, WING_BODY, ROUND] {
        let mesh = aircraft.mesh();
        let old = cut_like(&mesh, &aircraft.profiles("old_2"));
        let settings = settings(&mesh, old.clone());
        assert_unmoved(&mut mover(mesh, settings).unwrap(), old);
    }
}

/// The files carry twelve decimals, so new profiles read from one and old ones cut from the mesh differ by rounding.
#[test]
fn old_profiles_from_a_file_against_cut_ones_move_by_rounding() {
    for aircraft in [SMALL, WING_BODY, ROUND] {
        let mesh = aircraft.mesh();
        let new = aircraft.profiles("old_2");
        let settings = settings(&mesh, cut_like(&mesh, &new));
        let mut mover = mover(mesh, settings).unwrap();
        let outcome = update(&mut mover, new);
        let moved = largest(&outcome.displacement);
        assert!(moved <= 1e-9 * size(mover.mesh()), "{moved:e}");
    }
}

// ---- where it stands ----

struct Stance {
    turn: DQuat,
    scale: f64,
    shift: DVec3,
}

impl Stance {
    /// Askew by an angle, in millimetres and away from the origin.
    fn odd(angle: f64) -> Self {
        let turn = DQuat::from_axis_angle(DVec3::new(0.3, -1.0, 0.7).normalize(), angle);
        Self { turn, scale: 1000.0, shift: DVec3::new(300.0, -70.0, 11.0) }
    }

    fn vector(&self, v: DVec3) -> DVec3 {
        self.turn * v * self.scale
    }

    fn points(&self, points: &[DVec3]) -> Vec<DVec3> {
        points.iter().map(|&point| self.vector(point) + self.shift).collect()
    }

    fn profiles(&self, profiles: Vec<Profile>) -> Vec<Profile> {
        profiles.into_iter().map(|p| Profile { number: p.number, points: self.points(&p.points) }).collect()
    }
}

/// The displacement of an aircraft that stands so, brought back.
fn displacement_standing(aircraft: Aircraft, stance: &Stance, set: &str) -> Vec<DVec3> {
    let mut mesh = aircraft.mesh();
    mesh.vertices = stance.points(&mesh.vertices);
    let settings = settings(&mesh, stance.profiles(aircraft.profiles("old_2")));
    let mut mover = mover(mesh, settings).unwrap();
    let outcome = update(&mut mover, stance.profiles(aircraft.profiles(set)));
    assert!(outcome.converged && outcome.inverted == 0);
    outcome.displacement.iter().map(|&d| stance.turn.inverse() * d / stance.scale).collect()
}

/// Rounding only: 1e-6 of the largest displacement, in every vertex.
fn compare_motion(expected: &[DVec3], found: &[DVec3]) -> Result<(), Mismatch> {
    compare(expected, found, 1e-6 * largest(expected))
}

#[track_caller]
fn assert_moves_along(aircraft: Aircraft, stance: &Stance, set: &str) {
    let expected = update(&mut aircraft.mover(2), aircraft.profiles(set)).displacement;
    let found = displacement_standing(aircraft, stance, set);
    if let Err(mismatch) = compare_motion(&expected, &found) {
        panic!("{set}: not the same motion, largest {}: {mismatch:?}", largest(&expected));
    }
}

#[test]
fn motion_turns_and_scales_with_a_small_aircraft() {
    for angle in [0.3, 2.1] {
        assert_moves_along(SMALL, &Stance::odd(angle), "big_2");
        assert_moves_along(SMALL, &Stance::odd(angle), "planform_2");
    }
}

#[test]
fn motion_turns_and_scales_with_a_large_aircraft() {
    assert_moves_along(WING_BODY, &Stance::odd(0.3), "big_2");
}

/// Fails if, of `curve`, `CORNER` is 30 or `LONGEST_TANGENT` 0.3, if `POINT_BY_POINT` is 100, and if `FLAT` of `fitted_motion` is
/// 0.
#[test]
fn motion_turns_and_scales_with_a_rounded_wingtip() {
    assert_moves_along(ROUND, &Stance::odd(-0.5), "planform_2");
}

/// Sections are followed about the span's direction, whose sign is that of its largest coordinate: once, which points
/// became knots depended on it, and an aircraft on its back moved otherwise by 6e-4 of the largest displacement.
#[test]
fn motion_turns_with_an_aircraft_on_its_back() {
    let on_its_back = DQuat::from_rotation_x(std::f64::consts::PI);
    assert_moves_along(WING_BODY, &Stance { turn: on_its_back, scale: 1.0, shift: DVec3::ZERO }, "big_2");
}

#[test]
fn equivariance_rejects_one_wrong_vertex_and_a_wrong_unit() {
    let expected = update(&mut SMALL.mover(2), SMALL.profiles("big_2")).displacement;
    let mut wrong = expected.clone();
    wrong[700].y += 2e-6 * largest(&expected);
    assert_eq!(compare_motion(&expected, &wrong).unwrap_err().worst_vertex, 700);
    // The same new profiles, with the numbers of a thousandth too large a unit.
    let stance = Stance { turn: DQuat::IDENTITY, scale: 1.001, shift: DVec3::ZERO };
    let off: Vec<DVec3> = expected.iter().map(|&d| stance.vector(d)).collect();
    assert!(compare_motion(&expected, &off).is_err());
}

// ---- how often, on how many threads, after what ----

fn assert_same(first: &Outcome, second: &Outcome) {
    assert_eq!(changed(&first.vertices, &second.vertices), 0);
    assert_eq!(changed(&first.displacement, &second.displacement), 0);
    assert_eq!(first.solver, second.solver);
    assert_eq!(first.beta, second.beta);
}

#[test]
fn a_result_depends_on_the_design_alone() {
    for aircraft in [SMALL, WING_BODY] {
        let mut mover = aircraft.mover(2);
        let first = update(&mut mover, aircraft.profiles("big_2"));
        let other = update(&mut mover, aircraft.profiles("planform_2"));
        assert!(changed(&first.vertices, &other.vertices) > 1000);
        let again = update(&mut mover, aircraft.profiles("big_2"));
        assert_same(&first, &again);
        let fresh = update(&mut aircraft.mover(2), aircraft.profiles("big_2"));
        assert_same(&first, &fresh);
    }
}

/// A design that cannot be used leaves nothing behind either.
#[test]
fn a_refused_design_changes_no_later_result() {
    let mut mover = SMALL.mover(2);
    let first = update(&mut mover, SMALL.profiles("big_2"));
    let mut unpaired = SMALL.profiles("planform_2");
    unpaired.pop();
    let refused = design(unpaired);
    assert!(mover.update(&refused, &|_| {}).is_err());
    assert!(mover.update(&Default::default(), &|_| {}).is_err());
    assert_same(&first, &update(&mut mover, SMALL.profiles("big_2")));
}

#[test]
fn threads_change_no_bit() {
    let on = |threads: usize, aircraft: Aircraft| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| update(&mut aircraft.mover(2), aircraft.profiles("big_2")))
    };
    for aircraft in [SMALL, WING_BODY] {
        let single = on(1, aircraft);
        for threads in [2, 3] {
            assert_same(&single, &on(threads, aircraft));
        }
    }
}

/// Numbers of profiles pair them; neither their order in the file nor the direction of their points matters.
#[test]
fn order_of_the_profiles_changes_the_result_by_rounding_only() {
    let expected = update(&mut SMALL.mover(2), SMALL.profiles("big_2")).displacement;
    let mesh = SMALL.mesh();
    let mut old = SMALL.profiles("old_2");
    old.reverse();
    let mut new = SMALL.profiles("big_2");
    new.iter_mut().for_each(|profile| profile.points.reverse());
    let settings = settings(&mesh, old);
    let found = update(&mut mover(mesh, settings).unwrap(), new).displacement;
    compare(&expected, &found, 1e-12 * largest(&expected)).unwrap();
}

// ---- bits that must survive ----

/// A vertex no tet uses stays; a coordinate of -0 stays -0 where it does not move, also beside one that does.
#[test]
fn unused_vertices_and_minus_zero_survive() {
    let mut mesh = SMALL.mesh();
    let lost = DVec3::new(-0.0, 123.0, 0.25);
    mesh.vertices.push(lost);
    let symmetry = vertices_of(&mesh, "symmetry");
    for &vertex in &symmetry {
        mesh.vertices[vertex].y = -0.0;
    }
    let settings = settings(&mesh, SMALL.profiles("old_2"));
    let mut mover = mover(mesh, settings).unwrap();
    for design in [SMALL.profiles("planform_2"), SMALL.profiles("old_2")] {
        let outcome = update(&mut mover, design);
        let at = outcome.vertices.last().unwrap();
        assert_eq!(at.to_array().map(f64::to_bits), lost.to_array().map(f64::to_bits));
        for &vertex in &symmetry {
            assert_eq!(outcome.vertices[vertex].y.to_bits(), (-0.0f64).to_bits());
        }
        assert_eq!(outcome.inverted, 0);
    }
}
