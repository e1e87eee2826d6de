//! Families that share vertices, and planes that are not quite flat.

mod common;

use common::aircraft::{Anyway, SMALL, cpu, vertices_of};
use common::block::{CELL, block, design, mapped, sections, set_up};
use common::faults::{bits_changed, inverted};
use glam::{DQuat, DVec3};
use idmesh::families::{Families, Role, SetupError};
use idmesh::mesh::Topology;
use idmesh::mover::{Design, HeldBack, MoveError, Mover, Warning};
use idmesh::smoothing::QualityTarget;

/// The wing and its tip, moved as these say.
fn prescribed(wing: impl Fn(DVec3) -> DVec3, tip: impl Fn(DVec3) -> DVec3) -> (Mover, Design) {
    let builder = SMALL.builder(Vec::new()).role("wing", Role::Prescribed).role("wingtip", Role::Prescribed);
    let mover = builder.build(cpu()).unwrap();
    let displacement = |family: &str, by: &dyn Fn(DVec3) -> DVec3| -> Vec<DVec3> {
        let vertices = mover.family_vertices(family).unwrap().iter();
        vertices.map(|&vertex| by(mover.mesh().vertices[vertex as usize])).collect()
    };
    let design = Design::of_prescribed("wing", displacement("wing", &wing));
    let design = design.with_prescribed("wingtip", displacement("wingtip", &tip));
    (mover, design)
}

/// Fails if `AGREE` is 1e-12.
#[test]
fn prescribed_families_that_agree_are_moved() {
    let bend = |at: DVec3| 0.01 * at.y * at.y * DVec3::Z;
    let (mut mover, design) = prescribed(bend, |at| bend(at) * (1.0 + 5e-7));
    mover.update(&design).unwrap();
}

/// Fails if `AGREE` is 0.1.
#[test]
fn prescribed_families_that_disagree_are_an_error() {
    let bend = |at: DVec3| 0.01 * at.y * at.y * DVec3::Z;
    let (mut mover, design) = prescribed(bend, |at| bend(at) + 1e-6 * DVec3::X);
    let shared: Vec<usize> = vertices_of(mover.mesh(), "wingtip");
    let wing = vertices_of(mover.mesh(), "wing");
    match mover.update(&design).unwrap_err() {
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

/// Noise of up to 1e-4 on two planes that meet, in two attitudes: no vertex changes its distance
/// from either, with and without local optimisation.
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
        [(DQuat::IDENTITY, None), (DQuat::IDENTITY, Some(QualityTarget::Improve)), (odd, Some(QualityTarget::Improve))]
    {
        let mesh = block(5.0, |at| turn * noisy(at));
        let old = mapped(&sections(&[0.3, 1.55]), |at| turn * at);
        let role = |name: &str| match name {
            "wing" => Role::Wing,
            "symmetry" | "floor" => Role::Plane { flat: Some(1e-3), partner: None },
            _ => Role::Fixed,
        };
        let mut mover = set_up(mesh, old, role, quality);
        let pitch =
            |at: DVec3| DVec3::new(1.4, 0.0, 1.2) + DQuat::from_rotation_y(0.4) * (at - DVec3::new(1.4, 0.0, 1.25));
        let new = mapped(&sections(&[0.3, 1.55]), |at| turn * pitch(at));
        let design = design(new);
        let outcome = mover.update(&design).unwrap();
        let mesh = mover.mesh();
        assert!(outcome.is_valid() && inverted(mesh, outcome.vertices()).is_empty());
        assert_eq!(outcome.smoothed.is_some_and(|done| done.moved > 100), quality.is_some());
        for (name, normal) in [("symmetry", turn * DVec3::Y), ("floor", turn * DVec3::Z)] {
            let vertices = vertices_of(mesh, name);
            let off = |&vertex: &usize| normal.dot(outcome.displacement()[vertex]).abs();
            let slid = |&vertex: &usize| outcome.displacement()[vertex].length();
            // The plane is fitted to the noise: its normal is that of the box to 1e-5 only where no
            // axis is near.
            let allowed = if turn == DQuat::IDENTITY { 1e-14 } else { 2e-5 };
            assert!(vertices.iter().map(off).fold(0.0, f64::max) < allowed, "{name}");
            assert!(vertices.iter().map(slid).fold(0.0, f64::max) > 1e-3, "{name}");
            assert!(outcome.families[name].max_distance_to_plane.unwrap() < 1e-14, "{name}");
        }
        if turn == DQuat::IDENTITY {
            assert!(bits_changed(&mesh.vertices, outcome.vertices(), &vertices_of(mesh, "floor"), &[2]).is_empty());
        }
    }
}

/// A plane that shall be flat may have the noise of a file of seven digits, and no more.
///
/// Fails if `FLAT` of `shape` is 0.1 or 1e-14.
#[test]
fn planes_are_flat_to_the_digits_of_files() {
    let with = |noise: f64| {
        let mesh = block(5.0, |at| if at == DVec3::new(1.0, 0.0, 0.5) { at + noise * DVec3::Y } else { at });
        let surface = Topology::new(&mesh).unwrap().surface;
        let role = |name: &String| match name.as_str() {
            "wing" => Role::Wing,
            "symmetry" => Role::PLANE,
            _ => Role::Fixed,
        };
        Families::new(&mesh, &surface, mesh.families.iter().map(role).collect()).map(drop)
    };
    assert!(with(1e-7).is_ok());
    assert!(matches!(with(1e-4), Err(SetupError::NotPlane { .. })));
}

/// A wing that ends in a family that does not let its root go: how far it is kept back is known in
/// closed form.
///
/// Fails if `BACK` of `held_back` is 1e-1 or 1e-14, and if the volume expects no refusal.
#[test]
fn a_wing_that_is_held_back_is_told_of() {
    let [held, free] = [&Role::Fixed, &Role::PLANE];
    let moved = |symmetry: &Role, wing: &Role, by: f64, plane_by: f64| {
        let role = |name: &str| match name {
            "wing" => wing.clone(),
            "symmetry" => symmetry.clone(),
            _ => Role::Fixed,
        };
        let mut mover = set_up(block(5.0, |at| at), sections(&[0.3, 1.05]), role, None);
        let mut design = Design::default();
        for (name, role, by) in [("wing", wing, by), ("symmetry", symmetry, plane_by)] {
            let vertices = mover.family_vertices(name).unwrap().len();
            design = match role {
                Role::Wing => design.with_profiles(name, mapped(&sections(&[0.3, 1.05]), |at| at + by * DVec3::Z)),
                Role::Prescribed => design.with_prescribed(name, vec![by * DVec3::Z; vertices]),
                _ => design,
            };
        }
        mover.update(&design).unwrap()
    };
    for wing in &[Role::Wing, Role::Prescribed] {
        let outcome = moved(held, wing, 0.05, 0.0);
        assert!(outcome.is_valid());
        let [HeldBack { by, family, vertices, max_distance, at, beyond: None }] = &outcome.held_back[..] else {
            panic!("{:?}", outcome.held_back)
        };
        assert_eq!((by.as_str(), family.as_str(), *vertices, at.y), ("symmetry", "wing", 10, 0.0));
        common::assert_close(*max_distance, 0.05, 1e-12);
        assert!(matches!(&outcome.warnings[..], [Warning::HeldBack(_)]), "{:?}", outcome.warnings);
        let told = outcome.families["symmetry"].held_back.unwrap();
        assert_eq!((told.vertices, told.max_distance), (10, *max_distance));
        // The wing's edges are a cell long.
        let outcome = moved(held, wing, 0.3, 0.0);
        let beyond = outcome.held_back[0].beyond.unwrap();
        common::assert_close(beyond.distance, 0.3, 1e-12);
        assert_eq!((beyond.edge, beyond.at.y), (CELL, 0.0));
        assert!(!outcome.is_valid());
        // Nothing is tried for a result that is refused in any case, even where steps would help.
        let refused = moved(held, wing, 0.5, 0.0);
        assert!(refused.inverted > 0);
        assert_eq!((refused.path.steps, refused.path.given_up), (1, 0));
        assert!(moved(held, wing, 0.24, 0.0).held_back[0].beyond.is_none());
        assert!(moved(held, wing, 0.0, 0.0).held_back.is_empty());
        assert!(moved(free, wing, 0.05, 0.0).held_back.is_empty());
    }
    // What the symmetry plane's user has it do counts.
    let of_wing = |by: f64, plane_by: f64| {
        let outcome = moved(&Role::Prescribed, &Role::Wing, by, plane_by);
        outcome
            .held_back
            .into_iter()
            .filter(|held| held.family == "wing")
            .map(|held| held.max_distance)
            .collect::<Vec<_>>()
    };
    common::assert_close(of_wing(0.05, 0.03)[0], 0.02, 1e-12);
    assert!(of_wing(0.05, 0.05).is_empty());
    // The digits of a file hold nothing back.
    assert!(of_wing(0.05, 0.05 + 1e-11).is_empty());
}
