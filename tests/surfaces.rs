//! Surfaces that belong together: families that share vertices.

mod common;

use std::collections::BTreeMap;

use common::aircraft::{SMALL, cpu, mover, settings, vertices_of};
use common::carved::{carve, on};
use common::faults::{bits_changed, inverted};
use glam::{DQuat, DVec3};
use idmesh::mesh::{FamilyId, TetMesh, Topology};
use idmesh::mover::{Design, HeldBack, MoveError, Mover, Settings, Warning};
use idmesh::profile::{Plane, Profile, cut};
use idmesh::relaxation::{Accuracy, Method};
use idmesh::smoothing::Target;
use idmesh::stages::{Families, Role, interior::MAX_STEPS, sliding::Slides};

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

/// A block of 3 x 2 cells for a wing, from the plane y = 0 on, `span` cells long, in a box of which each side across y
/// and z is a family of its own.
fn block(span: f64, place: impl Fn(DVec3) -> DVec3) -> TetMesh {
    let is_wing = |at: DVec3| at.x > 4.0 && at.x < 7.0 && at.y < span && at.z > 4.0 && at.z < 6.0;
    let family = |triangle| match triangle {
        _ if on(triangle, 1, 0.0) => "symmetry",
        _ if on(triangle, 2, 0.0) => "floor",
        _ if on(triangle, 1, 8.0) => "side",
        _ if on(triangle, 2, 10.0) => "ceiling",
        _ if [(0, 0.0), (0, 12.0)].into_iter().any(|(axis, value)| on(triangle, axis, value)) => "farfield",
        _ => "wing",
    };
    carve(CELLS, &["wing", "symmetry", "side", "floor", "ceiling", "farfield"], is_wing, family, |at| place(at * CELL))
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
            "symmetry" | "floor" => Role::Plane { flat: Some(1e-3), partner: None },
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

const PLANE: Role = Role::PLANE;

fn partner_of(mesh: &TetMesh, name: &str) -> Role {
    Role::Plane { flat: None, partner: mesh.family(name) }
}

/// Vertices of the family and those `shift` from them, found by their coordinates.
fn partners(mesh: &TetMesh, family: &str, other: &str, shift: DVec3) -> Vec<[usize; 2]> {
    let others = vertices_of(mesh, other);
    let beside = |at: DVec3| others.iter().copied().find(|&vertex| mesh.vertices[vertex].distance(at + shift) < 1e-9);
    vertices_of(mesh, family).into_iter().map(|vertex| [vertex, beside(mesh.vertices[vertex]).unwrap()]).collect()
}

fn farthest_apart(mesh: &TetMesh, moved: &[DVec3], pairs: &[[usize; 2]]) -> f64 {
    let across = |at: &[DVec3], [a, b]: [usize; 2]| at[b] - at[a];
    pairs.iter().map(|&pair| across(moved, pair).distance(across(&mesh.vertices, pair))).fold(0.0, f64::max)
}

/// The sections at 0.3 and 1.1 turned by these angles about the middle of the wing, and raised.
fn turned(angles: [f64; 2]) -> Vec<Profile> {
    let mut sections = sections(&[0.3, 1.1]);
    let middle = DVec3::new(1.375, 0.0, 1.25);
    for (section, angle) in sections.iter_mut().zip(angles) {
        let turn = DQuat::from_rotation_y(angle);
        section.points.iter_mut().for_each(|point| *point = middle + turn * (*point - middle) + 0.05 * DVec3::Z);
    }
    sections
}

/// A wing from one periodic plane to the other, in a box periodic across y and z: its two ends want to move differently.
/// Partners stay apart by the same vector in one jump, in steps, and where local optimisation runs.
#[test]
fn periodic_planes_stay_periodic() {
    let mut by_steps = false;
    for (angles, quality) in
        [([0.1, 0.2], None), ([0.3, 0.5], Some(Target::Improve)), ([1.0, 1.2], Some(Target::Original))]
    {
        let mesh = block(8.0, |at| at);
        let [symmetry, floor] = ["side", "ceiling"].map(|name| partner_of(&mesh, name));
        // One of the two tables names the other.
        let role = |name: &str| match name {
            "wing" => Role::Wing,
            "symmetry" => symmetry,
            "floor" => floor,
            "side" | "ceiling" => PLANE,
            _ => Role::Fixed,
        };
        let mut mover = set_up(mesh, sections(&[0.3, 1.1]), role, quality);
        let design = design(&mover, turned(angles));
        let outcome = mover.update(&design, &|_| {}).unwrap();
        let mesh = mover.mesh();
        by_steps |= outcome.path.steps > 1;
        assert!(outcome.is_valid() && outcome.warnings.is_empty(), "{angles:?}: {:?}", outcome.warnings);
        let across_y = partners(mesh, "symmetry", "side", 2.0 * DVec3::Y);
        let across_z = partners(mesh, "floor", "ceiling", 2.5 * DVec3::Z);
        for (pairs, [a, b]) in [(&across_y, ["symmetry", "side"]), (&across_z, ["floor", "ceiling"])] {
            let apart = farthest_apart(mesh, &outcome.vertices, pairs);
            assert!(apart < 3e-12, "{angles:?}: {a} and {b} are {apart:e} apart");
            for name in [a, b] {
                let told = outcome.families[name].max_distance_of_partners.unwrap();
                assert!((told - apart).abs() < 1e-15, "{told:e} {apart:e}");
            }
        }
        assert!(bits_changed(&mesh.vertices, &outcome.vertices, &vertices_of(mesh, "symmetry"), &[1]).is_empty());
        let slid = |&[a, _]: &[usize; 2]| outcome.displacement[a].length();
        assert!(across_y.iter().map(slid).fold(0.0, f64::max) > 0.05);
        assert_eq!(outcome.smoothed.is_some(), quality.is_some(), "{angles:?}");
    }
    assert!(by_steps, "no design took steps");
}

/// The wing's ends get the mean of what the sections give them, and the wing between follows smoothly: no dent beside them.
#[test]
fn a_wing_between_periodic_planes_has_no_dent() {
    let mesh = block(8.0, |at| at);
    let symmetry = partner_of(&mesh, "side");
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "symmetry" => symmetry,
        "side" => PLANE,
        _ => Role::Fixed,
    };
    let mut mover = set_up(mesh, sections(&[0.3, 1.1]), role, None);
    // Raised in proportion to y, by 0.1 from end to end: the ends want 0 and 0.1.
    let raised = |at: DVec3| at + 0.05 * at.y * DVec3::Z;
    let design = design(&mover, mapped(&sections(&[0.3, 1.1]), raised));
    let outcome = mover.update(&design, &|_| {}).unwrap();
    let mesh = mover.mesh();
    for vertex in vertices_of(mesh, "wing") {
        let at = mesh.vertices[vertex];
        let found = outcome.displacement[vertex].z;
        if at.y == 0.0 || at.y == 2.0 {
            assert!((found - 0.05).abs() < 1e-12, "{at}: {found}");
        } else if (0.7..1.3).contains(&at.y) {
            assert!((found - 0.05 * at.y).abs() < 1e-12, "{at}: {found}");
        } else {
            // The rest of the 0.05 that the end is off dies away beside it.
            let left = (found - 0.05 * at.y).abs();
            assert!(left > 0.002 && left < 0.048, "{at}: {found}");
        }
    }
}

/// One cell between the planes: every vertex has its partner, and edges join partners.
#[test]
fn a_mesh_of_one_layer_stays_periodic() {
    let is_wing = |at: DVec3| at.x > 4.0 && at.x < 7.0 && at.z > 4.0 && at.z < 6.0;
    let family = |triangle| match triangle {
        _ if on(triangle, 1, 0.0) => "symmetry",
        _ if on(triangle, 1, 1.0) => "side",
        _ if [(0, 0.0), (0, 12.0), (2, 0.0), (2, 10.0)].into_iter().any(|(axis, value)| on(triangle, axis, value)) => {
            "farfield"
        }
        _ => "wing",
    };
    let mesh = carve([12, 1, 10], &["wing", "symmetry", "side", "farfield"], is_wing, family, |at| at * CELL);
    let old = mapped(&sections(&[0.3])[..1], |at| DVec3::new(at.x, 0.1, at.z));
    let middle = DVec3::new(1.375, 0.0, 1.25);
    let turn = DQuat::from_rotation_y(0.3);
    let new = mapped(&old, |at| middle + turn * (at - middle));
    for quality in [None, Some(Target::Improve)] {
        let symmetry = partner_of(&mesh, "side");
        let role = |name: &str| match name {
            "wing" => Role::Wing,
            "symmetry" => symmetry,
            "side" => PLANE,
            _ => Role::Fixed,
        };
        let mut mover = set_up(mesh.clone(), old.clone(), role, quality);
        let design = design(&mover, new.clone());
        let outcome = mover.update(&design, &|_| {}).unwrap();
        assert!(outcome.is_valid() && outcome.converged, "{} {:?}", outcome.inverted, outcome.unconverged);
        let pairs = partners(&mesh, "symmetry", "side", CELL * DVec3::Y);
        assert!(farthest_apart(&mesh, &outcome.vertices, &pairs) < 1e-14);
        assert!(pairs.iter().any(|&[a, _]| outcome.displacement[a].length() > 0.05));
    }
}

/// Nobody says that the planes are partners, and they part: a warning says how.
#[test]
fn planes_that_part_unsaid_are_warned_of() {
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "symmetry" | "side" => PLANE,
        _ => Role::Fixed,
    };
    let mut mover = set_up(block(8.0, |at| at), sections(&[0.3, 1.1]), role, None);
    let pairs = partners(mover.mesh(), "symmetry", "side", 2.0 * DVec3::Y);
    let mut moved = |new| {
        let design = design(&mover, new);
        mover.update(&design, &|_| {}).unwrap()
    };
    let outcome = moved(turned([0.1, 0.2]));
    assert!(outcome.is_valid() && outcome.families["side"].max_distance_of_partners.is_none());
    let [Warning::Parted { families, distance, .. }] = &outcome.warnings[..] else { panic!("{:?}", outcome.warnings) };
    assert_eq!(families, &["symmetry", "side"]);
    let alike = moved(sections(&[0.3, 1.1]));
    assert!(alike.warnings.is_empty(), "{:?}", alike.warnings);
    let apart = farthest_apart(mover.mesh(), &outcome.vertices, &pairs);
    assert!(apart > 0.01 && (apart - distance).abs() < 1e-15);
}

/// A stage that takes a vertex away from its partner is found out.
#[test]
fn parted_partners_are_refused() {
    let mesh = block(8.0, |at| at);
    let symmetry = partner_of(&mesh, "side");
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "symmetry" => symmetry,
        "side" => PLANE,
        _ => Role::Fixed,
    };
    let mut mover = set_up(mesh, sections(&[0.3, 1.1]), role, None);
    let design = design(&mover, turned([0.1, 0.2]));
    let vertex =
        vertices_of(mover.mesh(), "side").into_iter().find(|&v| mover.mesh().vertices[v] == DVec3::new(0.5, 2.0, 0.5));
    let mut amend = |stage: &str, motion: &mut Vec<DVec3>| {
        if stage == "volume" {
            motion[vertex.unwrap()].x += 1e-11;
        }
    };
    let outcome = mover.update_amended(&design, &|_| {}, &mut amend).unwrap();
    assert!(!outcome.is_valid() && outcome.inverted == 0 && outcome.strayed.is_empty());
    assert_eq!(outcome.parted.keys().collect::<Vec<_>>(), ["side", "symmetry"]);
    assert!((outcome.parted["side"] - 1e-11).abs() < 1e-13);
}

/// What the user prescribes is not changed: ends that move differently are refused in the end.
#[test]
fn prescribed_partners_must_move_alike() {
    let mesh = block(8.0, |at| at);
    let symmetry = partner_of(&mesh, "side");
    let role = |name: &str| match name {
        "wing" => Role::Prescribed,
        "symmetry" => symmetry,
        "side" => PLANE,
        _ => Role::Fixed,
    };
    let mut mover = set_up(mesh, Vec::new(), role, None);
    let wing = mover.mesh().family("wing").unwrap();
    for (slope, valid) in [(0.0, true), (1e-9, false)] {
        let at = mover.family_vertices(wing).iter().map(|&vertex| mover.mesh().vertices[vertex as usize]);
        let given: Vec<DVec3> = at.map(|at| (0.05 + slope * at.y) * DVec3::Z).collect();
        let design = Design { prescribed: BTreeMap::from([(wing, given.clone())]), ..Design::default() };
        let outcome = mover.update(&design, &|_| {}).unwrap();
        assert_eq!(outcome.is_valid(), valid);
        assert_eq!(outcome.parted.contains_key("symmetry"), !valid);
        let kept = mover.family_vertices(wing).iter().map(|&vertex| outcome.displacement[vertex as usize]);
        assert!(kept.eq(given));
    }
}

#[test]
fn planes_that_are_no_partners_are_refused() {
    let refused = |mesh: TetMesh, role: &dyn Fn(&TetMesh, &str) -> Role| {
        let settings = Settings {
            roles: mesh.families.iter().map(|name| role(&mesh, name)).collect(),
            old_profiles: BTreeMap::from([(mesh.family("wing").unwrap(), sections(&[0.3, 1.1]))]),
            ..settings(&SMALL.mesh(), Vec::new())
        };
        Mover::new(mesh, settings, cpu(), &|_| {}).err().unwrap().to_string()
    };
    let basic = |name: &str| if name == "wing" { Role::Wing } else { Role::Fixed };
    // The wing ends inside the box: two vertices of the far side are in no plane at the near one.
    let shorter = refused(block(5.0, |at| at), &|mesh, name| match name {
        "symmetry" => partner_of(mesh, "side"),
        "side" => PLANE,
        name => basic(name),
    });
    assert!(
        shorter.contains("`symmetry` and `side` shall be partners: 2 of their 284 vertices have no partner"),
        "{shorter}"
    );
    let across = refused(block(8.0, |at| at), &|mesh, name| match name {
        "symmetry" => partner_of(mesh, "floor"),
        "floor" => PLANE,
        name => basic(name),
    });
    assert!(across.contains("they are not parallel"), "{across}");
    let role = refused(block(8.0, |at| at), &|mesh, name| match name {
        "symmetry" => partner_of(mesh, "side"),
        name => basic(name),
    });
    assert!(role.contains("the partner has another role"), "{role}");
    let two = refused(block(8.0, |at| at), &|mesh, name| match name {
        "symmetry" | "floor" => partner_of(mesh, "side"),
        "side" => PLANE,
        name => basic(name),
    });
    assert!(two.contains("one of them has another partner already"), "{two}");
    // One end of the wing is held.
    let mut mesh = block(8.0, |at| at);
    let wing = mesh.family("wing").unwrap();
    mesh.families.push("stub".into());
    let stub = FamilyId(mesh.families.len() as u16 - 1);
    for (triangle, family) in mesh.triangles.iter().zip(&mut mesh.triangle_family) {
        if *family == wing && triangle.iter().all(|&vertex| mesh.vertices[vertex as usize].y > 1.7) {
            *family = stub;
        }
    }
    let held = refused(mesh, &|mesh, name| match name {
        "symmetry" => partner_of(mesh, "side"),
        "side" => PLANE,
        name => basic(name),
    });
    assert!(held.contains("moves with the role wing, its partner at"), "{held}");
}

/// The vertices that may slide in local optimisation are not those of periodic planes.
#[test]
fn partners_do_not_slide() {
    let mesh = block(8.0, |at| at);
    let surface = Topology::new(&mesh).unwrap().surface;
    let sliding = |symmetry: Role| {
        let role = |name: &String| match name.as_str() {
            "wing" => Role::Wing,
            "symmetry" => symmetry,
            "side" => PLANE,
            _ => Role::Fixed,
        };
        let families = Families::new(&mesh, &surface, mesh.families.iter().map(role).collect()).unwrap();
        let vertices = Slides::new(&mesh, &surface, &families).vertices();
        let ends = vertices.iter().filter(|&&vertex| [0.0, 2.0].contains(&mesh.vertices[vertex as usize].y));
        (ends.count(), vertices.len())
    };
    let (ends, all) = sliding(PLANE);
    assert!(ends > 0);
    assert_eq!(sliding(partner_of(&mesh, "side")), (0, all - ends));
}

/// A wing that ends in a family that does not let its root go: how far it is kept back is known in closed form.
#[test]
fn a_wing_that_is_held_back_is_told_of() {
    let [held, free] = [Role::Fixed, PLANE];
    let moved = |symmetry: Role, wing: Role, by: f64, plane_by: f64| {
        let role = |name: &str| match name {
            "wing" => wing,
            "symmetry" => symmetry,
            _ => Role::Fixed,
        };
        let mut mover = set_up(block(5.0, |at| at), sections(&[0.3, 1.1]), role, None);
        let mut design = design(&mover, mapped(&sections(&[0.3, 1.1]), |at| at + by * DVec3::Z));
        for (name, by) in [("wing", by), ("symmetry", plane_by)] {
            let family = mover.mesh().family(name).unwrap();
            design.prescribed.insert(family, vec![by * DVec3::Z; mover.family_vertices(family).len()]);
        }
        mover.update(&design, &|_| {}).unwrap()
    };
    for wing in [Role::Wing, Role::Prescribed] {
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
        assert!(moved(held, wing, 0.24, 0.0).held_back[0].beyond.is_none());
        assert!(moved(held, wing, 0.0, 0.0).held_back.is_empty());
        assert!(moved(free, wing, 0.05, 0.0).held_back.is_empty());
    }
    // What the symmetry plane's user has it do counts.
    let of_wing = |by: f64, plane_by: f64| {
        let outcome = moved(Role::Prescribed, Role::Wing, by, plane_by);
        outcome
            .held_back
            .into_iter()
            .filter(|held| held.family == "wing")
            .map(|held| held.max_distance)
            .collect::<Vec<_>>()
    };
    common::assert_close(of_wing(0.05, 0.03)[0], 0.02, 1e-12);
    assert!(of_wing(0.05, 0.05).is_empty());
}
