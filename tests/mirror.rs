//! A full aircraft made of a half and its mirror image: both halves move alike.

mod common;

use std::collections::BTreeMap;

use common::aircraft::{Aircraft, SMALL, WING_BODY, mover, settings, triangles_of};
use glam::DVec3;
use idmesh::families::Role;
use idmesh::mesh::{FamilyId, TetMesh};
use idmesh::mover::Design;
use idmesh::profile::{Plane, Profile};
use idmesh::stages::WingProfiles;

const LEFT: f64 = -1.0;

fn mirrored(at: DVec3) -> DVec3 {
    DVec3::new(at.x, LEFT * at.y, at.z)
}

/// The whole aircraft of a half one, joined in the symmetry plane y = 0; the twin of each vertex. The left half's wing is a
/// family of its own.
fn whole(half: &TetMesh) -> (TetMesh, Vec<u32>) {
    let n = half.vertices.len() as u32;
    let mut vertices = half.vertices.clone();
    let mut twin: Vec<u32> = (0..n).collect();
    for (twin, &at) in twin.iter_mut().zip(&half.vertices) {
        if at.y.abs() > 1e-9 {
            *twin = vertices.len() as u32;
            vertices.push(mirrored(at));
        }
    }
    let symmetry = half.family("symmetry").unwrap();
    let mut families = half.families.clone();
    families.push("wing_left".to_owned());
    let left = FamilyId(families.len() as u16 - 1);
    let wing = half.family("wing").unwrap();
    let mut mesh = TetMesh { vertices, families, ..half.clone() };
    mesh.triangles.clear();
    mesh.triangle_family.clear();
    for (triangle, &family) in
        half.triangles.iter().zip(&half.triangle_family).filter(|(_, family)| **family != symmetry)
    {
        let [a, b, c] = triangle.map(|vertex| twin[vertex as usize]);
        mesh.triangles.extend([*triangle, [a, c, b]]);
        mesh.triangle_family.extend([family, if family == wing { left } else { family }]);
    }
    for tet in &half.tets {
        let [a, b, c, d] = tet.map(|vertex| twin[vertex as usize]);
        mesh.tets.push([a, b, d, c]);
    }
    // The emptied family stays without triangles.
    (mesh, twin)
}

fn check(aircraft: Aircraft, set: &str) {
    let half = aircraft.mesh();
    let (mesh, twin) = whole(&half);
    let (old, new) = (aircraft.profiles("old_2"), aircraft.profiles(set));
    let [right, left] = ["wing", "wing_left"].map(|name| mesh.family(name).unwrap());
    let y = Plane { point: DVec3::ZERO, normal: DVec3::Y };
    let of_left = |profiles: &[Profile]| -> Vec<Profile> {
        let points = |profile: &Profile| profile.points.iter().map(|&at| mirrored(at)).collect();
        profiles.iter().map(|profile| Profile { number: profile.number, points: points(profile) }).collect()
    };
    let one =
        WingProfiles { families: vec![right, left], mirror: Some(y), ..WingProfiles::new("wing", right, old.clone()) };
    let two = vec![WingProfiles::new("wing", right, old.clone()), WingProfiles::new("left", left, of_left(&old))];
    for wings in [vec![one], two] {
        let mut roles = settings(&half, old.clone()).roles;
        roles.push(Role::Wing);
        let profiles: BTreeMap<String, _> = wings
            .iter()
            .map(|wing| (wing.name.clone(), if wing.name == "left" { of_left(&new) } else { new.clone() }))
            .collect();
        let settings = idmesh::mover::Settings { roles, wings, ..settings(&half, old.clone()) };
        let mut mover = mover(mesh.clone(), settings).unwrap();
        let outcome = mover.update(&Design { profiles, ..Design::default() }, &|_| {}).unwrap();
        assert_eq!(outcome.inverted, 0, "{set}");
        assert!(outcome.missed.is_empty(), "{set}: {:?}", outcome.missed);
        let apart = triangles_of(&mesh, "wing")
            .into_iter()
            .flatten()
            .map(|vertex| outcome.vertices[twin[vertex] as usize].distance(mirrored(outcome.vertices[vertex])));
        let apart = apart.fold(0.0, f64::max);
        // The span is 8 or 4.
        assert!(apart < 4e-12, "{set}: {apart:e}");
    }
}

/// Fails if `ON_MIRROR` is -1.
#[test]
fn both_halves_of_a_small_aircraft_move_alike() {
    check(SMALL, "planform_2");
    check(SMALL, "big_2");
}

#[test]
fn both_halves_of_a_wing_body_move_alike() {
    check(WING_BODY, "planform_2");
}
