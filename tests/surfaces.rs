//! Surfaces that belong together: families that share vertices.

mod common;

use std::collections::BTreeMap;

use common::aircraft::{SMALL, cpu, mover, settings, vertices_of};
use common::carved::{carve, on};
use common::faults::{bits_changed, inverted};
use glam::{DQuat, DVec3};
use idmesh::mesh::{FamilyId, TetMesh};
use idmesh::mover::{Design, MoveError, Mover, Settings};
use idmesh::profile::{Plane, Profile, cut};
use idmesh::relaxation::{Accuracy, Method};
use idmesh::smoothing::Target;
use idmesh::stages::{Role, interior::MAX_STEPS};

/// The wing and its tip, moved as these say.
fn prescribed(wing: impl Fn(DVec3) -> DVec3, tip: impl Fn(DVec3) -> DVec3) -> (Mover, Design) {
    let mesh = SMALL.mesh();
    let mut settings = settings(&mesh, Vec::new());
    let [wing_family, tip_family] = ["wing", "wingtip"].map(|name| mesh.family(name).unwrap());
    settings.old_profiles.clear();
    settings.roles[wing_family.index()] = Role::Prescribed;
    settings.roles[tip_family.index()] = Role::Prescribed;
    let mover = mover(mesh, settings).unwrap();
    let displacement = |family: FamilyId, by: &dyn Fn(DVec3) -> DVec3| -> Vec<DVec3> {
        let vertices = mover.family_vertices(family).iter();
        vertices.map(|&vertex| by(mover.mesh().vertices[vertex as usize])).collect()
    };
    let prescribed =
        BTreeMap::from([(wing_family, displacement(wing_family, &wing)), (tip_family, displacement(tip_family, &tip))]);
    (mover, Design { prescribed, ..Design::default() })
}

#[test]
fn prescribed_families_that_agree_are_moved() {
    let bend = |at: DVec3| 0.01 * at.y * at.y * DVec3::Z;
    let (mut mover, design) = prescribed(bend, |at| bend(at) * (1.0 + 5e-7));
    mover.update(&design, &|_| {}).unwrap();
}

#[test]
fn prescribed_families_that_disagree_are_an_error() {
    let bend = |at: DVec3| 0.01 * at.y * at.y * DVec3::Z;
    let (mut mover, design) = prescribed(bend, |at| bend(at) + 1e-6 * DVec3::X);
    let shared: Vec<usize> = vertices_of(mover.mesh(), "wingtip");
    let wing = vertices_of(mover.mesh(), "wing");
    match mover.update(&design, &|_| {}).unwrap_err() {
        MoveError::Disagree { family, other, vertex, position, difference } => {
            let both = [&*family, &*other];
            assert!(both == ["wing", "wingtip"] || both == ["wingtip", "wing"], "{both:?}");
            assert!(shared.contains(&(vertex as usize)) && wing.contains(&(vertex as usize)));
            assert_eq!(position, mover.mesh().vertices[vertex as usize]);
            common::assert_close(difference, 1e-6, 1e-12);
        }
        error => panic!("{error}"),
    }
}

const CELLS: [usize; 3] = [12, 8, 10];
const CELL: f64 = 0.25;

/// A block of 3 x 2 cells for a wing, from the plane y = 0 on, `span` cells long, in a box whose sides y = 0 and z = 0 are
/// planes, and whose side y = 2 is a family of its own.
fn block(span: f64, place: impl Fn(DVec3) -> DVec3) -> TetMesh {
    let is_wing = |at: DVec3| at.x > 4.0 && at.x < 7.0 && at.y < span && at.z > 4.0 && at.z < 6.0;
    let family = |triangle| match triangle {
        _ if on(triangle, 1, 0.0) => "symmetry",
        _ if on(triangle, 2, 0.0) => "floor",
        _ if on(triangle, 1, 8.0) => "side",
        _ if [(0, 0.0), (0, 12.0), (2, 10.0)].into_iter().any(|(axis, value)| on(triangle, axis, value)) => "farfield",
        _ => "wing",
    };
    carve(CELLS, &["wing", "symmetry", "floor", "side", "farfield"], is_wing, family, |at| place(at * CELL))
}

/// Sections of the wing in planes y = const before it was placed.
fn sections(at: &[f64]) -> Vec<Profile> {
    let mesh = block(8.0, |at| at);
    let family = mesh.family("wing").unwrap();
    let own = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|&(_, &of)| of == family);
    let triangles: Vec<[u32; 3]> = own.map(|(&triangle, _)| triangle).collect();
    let plane = |(number, &y): (usize, &f64)| (number as i64, Plane { point: DVec3::Y * y, normal: DVec3::Y });
    cut::cut_at_planes(&mesh.vertices, &triangles, &at.iter().enumerate().map(plane).collect::<Vec<_>>()).unwrap()
}

fn mapped(profiles: &[Profile], map: impl Fn(DVec3) -> DVec3) -> Vec<Profile> {
    let points = |profile: &Profile| profile.points.iter().map(|&point| map(point)).collect();
    profiles.iter().map(|profile| Profile { number: profile.number, points: points(profile) }).collect()
}

fn set_up(mesh: TetMesh, old: Vec<Profile>, role: impl Fn(&str) -> Role, quality: Option<Target>) -> Mover {
    let settings = Settings {
        roles: mesh.families.iter().map(|name| role(name)).collect(),
        old_profiles: BTreeMap::from([(mesh.family("wing").unwrap(), old)]),
        springs: Default::default(),
        method: Method::Chebyshev,
        accuracy: Accuracy::default(),
        quality,
        max_steps: MAX_STEPS,
    };
    Mover::new(mesh, settings, cpu(), &|_| {}).unwrap()
}

fn design(mover: &Mover, new: Vec<Profile>) -> Design {
    Design { profiles: BTreeMap::from([(mover.mesh().family("wing").unwrap(), new)]), ..Design::default() }
}

/// Noise of up to 1e-4 on two planes that meet, in two attitudes: no vertex changes its distance from either, with and without
/// local optimisation.
#[test]
fn planes_that_are_not_quite_flat_keep_their_noise() {
    let noise = |at: DVec3| 1e-4 * (31.0 * at.x + 17.0 * at.y + 23.0 * at.z).sin();
    let noisy = |at: DVec3| {
        let y = if at.y == 0.0 { noise(at) } else { 0.0 };
        let z = if at.z == 0.0 { noise(at + DVec3::ONE) } else { 0.0 };
        at + DVec3::new(0.0, y, z)
    };
    let odd = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.7).normalize(), 0.4);
    for (turn, quality) in
        [(DQuat::IDENTITY, None), (DQuat::IDENTITY, Some(Target::Improve)), (odd, Some(Target::Improve))]
    {
        let mesh = block(5.0, |at| turn * noisy(at));
        let old = mapped(&sections(&[0.3, 1.1]), |at| turn * at);
        let role = |name: &str| match name {
            "wing" => Role::Wing,
            "symmetry" | "floor" => Role::Plane { flat: Some(1e-3) },
            _ => Role::Fixed,
        };
        let mut mover = set_up(mesh, old, role, quality);
        let pitch =
            |at: DVec3| DVec3::new(1.4, 0.0, 1.2) + DQuat::from_rotation_y(0.4) * (at - DVec3::new(1.4, 0.0, 1.25));
        let new = mapped(&sections(&[0.3, 1.1]), |at| turn * pitch(at));
        let design = design(&mover, new);
        let outcome = mover.update(&design, &|_| {}).unwrap();
        let mesh = mover.mesh();
        assert!(outcome.is_valid() && inverted(mesh, &outcome.vertices).is_empty());
        assert_eq!(outcome.smoothed.is_some_and(|done| done.moved > 100), quality.is_some());
        for (name, normal) in [("symmetry", turn * DVec3::Y), ("floor", turn * DVec3::Z)] {
            let vertices = vertices_of(mesh, name);
            let off = |&vertex: &usize| normal.dot(outcome.displacement[vertex]).abs();
            let slid = |&vertex: &usize| outcome.displacement[vertex].length();
            // The plane is fitted to the noise: its normal is that of the box to 1e-5 only where no axis is near.
            let allowed = if turn == DQuat::IDENTITY { 1e-14 } else { 2e-5 };
            assert!(vertices.iter().map(off).fold(0.0, f64::max) < allowed, "{name}");
            assert!(vertices.iter().map(slid).fold(0.0, f64::max) > 1e-3, "{name}");
            assert!(outcome.families[name].max_distance_to_plane.unwrap() < 1e-14, "{name}");
        }
        if turn == DQuat::IDENTITY {
            assert!(bits_changed(&mesh.vertices, &outcome.vertices, &vertices_of(mesh, "floor"), &[2]).is_empty());
        }
    }
}
