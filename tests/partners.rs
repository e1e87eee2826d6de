//! Periodic planes: what stays with its partner, what is told, and what is refused.

mod common;

use common::aircraft::{Anyway, cpu, vertices_of};
use common::block::{CELL, block, builder, design, mapped, sections, set_up};
use common::carved::{carve, on};
use common::faults::bits_changed;
use glam::{DQuat, DVec3};
use idmesh::families::{Families, Role};
use idmesh::mesh::{FamilyId, TetMesh, Topology};
use idmesh::mover::{Design, Warning};
use idmesh::profile::Profile;
use idmesh::smoothing::QualityTarget;
use idmesh::volume::sliding::SurfaceFreedom;

const PLANE: Role = Role::PLANE;

fn partner_of(name: &str) -> Role {
    Role::Plane { flat: None, partner: Some(name.to_owned()) }
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

/// The sections at 0.3 and 1.55 turned by these angles about the middle of the wing, and raised.
fn turned(angles: [f64; 2]) -> Vec<Profile> {
    let mut sections = sections(&[0.3, 1.55]);
    let middle = DVec3::new(1.375, 0.0, 1.25);
    for (section, angle) in sections.iter_mut().zip(angles) {
        let turn = DQuat::from_rotation_y(angle);
        section.points.iter_mut().for_each(|point| *point = middle + turn * (*point - middle) + 0.05 * DVec3::Z);
    }
    sections
}

/// A wing from one periodic plane to the other, in a box periodic across y and z: its two ends want
/// to move differently. Partners stay apart by the same vector in one jump, in steps, and where
/// local optimisation runs.
///
/// Fails if `SHORTEST` is 0.5.
#[test]
fn periodic_planes_stay_periodic() {
    let mut by_steps = false;
    for (angles, quality) in
        [([0.1, 0.2], None), ([0.3, 0.5], Some(QualityTarget::Improve)), ([1.0, 1.2], Some(QualityTarget::Original))]
    {
        let mesh = block(8.0, |at| at);
        let [symmetry, floor] = ["side", "ceiling"].map(partner_of);
        // One of the two tables names the other.
        let role = |name: &str| match name {
            "wing" => Role::Wing,
            "symmetry" => symmetry.clone(),
            "floor" => floor.clone(),
            "side" | "ceiling" => PLANE,
            _ => Role::Fixed,
        };
        let mut mover = set_up(mesh, sections(&[0.3, 1.55]), role, quality);
        let design = design(turned(angles));
        let outcome = mover.update(&design).unwrap();
        let mesh = mover.mesh();
        by_steps |= outcome.path.steps > 1;
        assert!(
            outcome.is_valid() && outcome.warnings.is_empty(),
            "{angles:?}: {} {:?}",
            outcome.inverted,
            outcome.warnings
        );
        let across_y = partners(mesh, "symmetry", "side", 2.0 * DVec3::Y);
        let across_z = partners(mesh, "floor", "ceiling", 2.5 * DVec3::Z);
        for (pairs, [a, b]) in [(&across_y, ["symmetry", "side"]), (&across_z, ["floor", "ceiling"])] {
            let apart = farthest_apart(mesh, outcome.vertices(), pairs);
            assert!(apart < 3e-12, "{angles:?}: {a} and {b} are {apart:e} apart");
            for name in [a, b] {
                let told = outcome.families[name].max_distance_of_partners.unwrap();
                assert!((told - apart).abs() < 1e-15, "{told:e} {apart:e}");
            }
        }
        assert!(bits_changed(&mesh.vertices, outcome.vertices(), &vertices_of(mesh, "symmetry"), &[1]).is_empty());
        let slid = |&[a, _]: &[usize; 2]| outcome.displacement()[a].length();
        assert!(across_y.iter().map(slid).fold(0.0, f64::max) > 0.05);
        assert_eq!(outcome.smoothed.is_some(), quality.is_some(), "{angles:?}");
    }
    assert!(by_steps, "no design took steps");
}

/// The wing's ends get the mean of what the sections give them, and the wing between follows
/// smoothly: no dent beside them.
#[test]
fn a_wing_between_periodic_planes_has_no_dent() {
    let mesh = block(8.0, |at| at);
    let symmetry = partner_of("side");
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "symmetry" => symmetry.clone(),
        "side" => PLANE,
        _ => Role::Fixed,
    };
    let mut mover = set_up(mesh, sections(&[0.5, 1.5]), role, None);
    // Raised in proportion to y, by 0.1 from end to end: the ends want 0 and 0.1.
    let raised = |at: DVec3| at + 0.05 * at.y * DVec3::Z;
    let design = design(mapped(&sections(&[0.5, 1.5]), raised));
    let outcome = mover.update(&design).unwrap();
    let mesh = mover.mesh();
    for vertex in vertices_of(mesh, "wing") {
        let at = mesh.vertices[vertex];
        let found = outcome.displacement()[vertex].z;
        if at.y == 0.0 || at.y == 2.0 {
            assert!((found - 0.05).abs() < 1e-12, "{at}: {found}");
        } else if (0.5..=1.5).contains(&at.y) {
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
    for quality in [None, Some(QualityTarget::Improve)] {
        let symmetry = partner_of("side");
        let role = |name: &str| match name {
            "wing" => Role::Wing,
            "symmetry" => symmetry.clone(),
            "side" => PLANE,
            _ => Role::Fixed,
        };
        let mut mover = set_up(mesh.clone(), old.clone(), role, quality);
        let design = design(new.clone());
        let outcome = mover.update(&design).unwrap();
        assert!(outcome.is_valid() && outcome.converged, "{} {:?}", outcome.inverted, outcome.unconverged);
        let pairs = partners(&mesh, "symmetry", "side", CELL * DVec3::Y);
        assert!(farthest_apart(&mesh, outcome.vertices(), &pairs) < 1e-14);
        assert!(pairs.iter().any(|&[a, _]| outcome.displacement()[a].length() > 0.05));
    }
}

/// Nobody says that the planes are partners, and they part: a warning says how. By less than a
/// relaxation leaves open they do not.
///
/// Fails if `PARTED` of `warnings` is 0.1 or 1e-12.
#[test]
fn planes_that_part_unsaid_are_warned_of() {
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "symmetry" | "side" => PLANE,
        _ => Role::Fixed,
    };
    let mut mover = set_up(block(8.0, |at| at), sections(&[0.3, 1.55]), role, None);
    let pairs = partners(mover.mesh(), "symmetry", "side", 2.0 * DVec3::Y);
    let mut moved = |new| {
        let design = design(new);
        mover.update(&design).unwrap()
    };
    let outcome = moved(turned([0.1, 0.2]));
    assert!(outcome.is_valid() && outcome.families["side"].max_distance_of_partners.is_none());
    let [Warning::Parted { families, distance, .. }] = &outcome.warnings[..] else { panic!("{:?}", outcome.warnings) };
    assert_eq!(families, &["symmetry", "side"]);
    let alike = moved(sections(&[0.3, 1.55]));
    assert!(alike.warnings.is_empty(), "{:?}", alike.warnings);
    let apart = farthest_apart(mover.mesh(), outcome.vertices(), &pairs);
    assert!(apart > 0.01 && (apart - distance).abs() < 1e-15);
    let vertex = pairs[0][0];
    let mut amend = |stage: &str, motion: &mut Vec<DVec3>| {
        if stage == "volume" {
            motion[vertex] += 1e-9 * DVec3::X;
        }
    };
    let hardly = mover.update_amended(&design(sections(&[0.3, 1.55])), &mut amend).unwrap();
    assert!(hardly.warnings.is_empty(), "{:?}", hardly.warnings);
}

/// A stage that takes a vertex away from its partner is found out, unless by rounding alone.
///
/// Fails if `PARTED` of `reports` is 1e-3 or 1e-17.
#[test]
fn parted_partners_are_refused() {
    let mesh = block(8.0, |at| at);
    let symmetry = partner_of("side");
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "symmetry" => symmetry.clone(),
        "side" => PLANE,
        _ => Role::Fixed,
    };
    let mut mover = set_up(mesh, sections(&[0.3, 1.55]), role, None);
    let design = design(turned([0.1, 0.2]));
    let vertex =
        vertices_of(mover.mesh(), "side").into_iter().find(|&v| mover.mesh().vertices[v] == DVec3::new(0.5, 2.0, 0.5));
    let mut apart = |by: f64| {
        let mut amend = |stage: &str, motion: &mut Vec<DVec3>| {
            if stage == "volume" {
                motion[vertex.unwrap()].x += by;
            }
        };
        mover.update_amended(&design, &mut amend).unwrap()
    };
    assert!(apart(1e-12).is_valid());
    let outcome = apart(1e-11);
    assert!(!outcome.is_valid() && outcome.inverted == 0 && outcome.off_surface.is_empty());
    assert_eq!(outcome.parted.keys().collect::<Vec<_>>(), ["side", "symmetry"]);
    assert!((outcome.parted["side"].distance - 1e-11).abs() < 1e-13);
}

/// What the user prescribes is not changed: ends that move differently are refused in the end.
#[test]
fn prescribed_partners_must_move_alike() {
    let mesh = block(8.0, |at| at);
    let symmetry = partner_of("side");
    let role = |name: &str| match name {
        "wing" => Role::Prescribed,
        "symmetry" => symmetry.clone(),
        "side" => PLANE,
        _ => Role::Fixed,
    };
    let mut mover = set_up(mesh, Vec::new(), role, None);
    for (slope, valid) in [(0.0, true), (1e-9, false)] {
        let at = mover.family_vertices("wing").unwrap().iter().map(|&vertex| mover.mesh().vertices[vertex as usize]);
        let given: Vec<DVec3> = at.map(|at| (0.05 + slope * at.y) * DVec3::Z).collect();
        let design = Design::of_prescribed("wing", given.clone());
        let outcome = mover.update(&design).unwrap();
        assert_eq!(outcome.is_valid(), valid);
        assert_eq!(outcome.parted.contains_key("symmetry"), !valid);
        let kept = mover.family_vertices("wing").unwrap().iter().map(|&vertex| outcome.displacement()[vertex as usize]);
        assert!(kept.eq(given));
    }
}

#[test]
fn planes_that_are_no_partners_are_refused() {
    let refused = |mesh: TetMesh, role: &dyn Fn(&str) -> Role| {
        builder(mesh, sections(&[0.3, 1.55]), role).build(cpu()).err().unwrap().to_string()
    };
    let basic = |name: &str| if name == "wing" { Role::Wing } else { Role::Fixed };
    // The wing ends inside the box: two vertices of the far side are in no plane at the near one.
    let shorter = refused(block(5.0, |at| at), &|name| match name {
        "symmetry" => partner_of("side"),
        "side" => PLANE,
        name => basic(name),
    });
    assert!(
        shorter.contains("`symmetry` and `side` shall be partners: 2 of their 284 vertices have no partner"),
        "{shorter}"
    );
    let across = refused(block(8.0, |at| at), &|name| match name {
        "symmetry" => partner_of("floor"),
        "floor" => PLANE,
        name => basic(name),
    });
    assert!(across.contains("they are not parallel"), "{across}");
    let role = refused(block(8.0, |at| at), &|name| match name {
        "symmetry" => partner_of("side"),
        name => basic(name),
    });
    assert!(role.contains("the partner has another role"), "{role}");
    let two = refused(block(8.0, |at| at), &|name| match name {
        "symmetry" | "floor" => partner_of("side"),
        "side" => PLANE,
        name => basic(name),
    });
    assert!(two.contains("one of them has another partner already"), "{two}");
    let nobody = refused(block(8.0, |at| at), &|name| match name {
        "symmetry" => partner_of("sid*"),
        name => basic(name),
    });
    assert!(nobody.contains("`symmetry` and `sid*` shall be partners: the mesh has no such family"), "{nobody}");
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
    let held = refused(mesh, &|name| match name {
        "symmetry" => partner_of("side"),
        "side" => PLANE,
        name => basic(name),
    });
    assert!(held.contains("moves with the role wing, its partner at"), "{held}");
}

/// Side and symmetry plane as partners, in a block whose vertices stand elsewhere.
fn partners_in(place: impl Fn(DVec3) -> DVec3) -> Result<(), String> {
    let mesh = block(8.0, place);
    let surface = Topology::new(&mesh).unwrap().surface;
    let role = |name: &String| match name.as_str() {
        "wing" => Role::Wing,
        "symmetry" => Role::Plane { flat: Some(0.01), partner: Some("side".to_owned()) },
        "side" => Role::Plane { flat: Some(0.01), partner: None },
        _ => Role::Fixed,
    };
    let families = Families::new(&mesh, &surface, mesh.families.iter().map(role).collect());
    families.map(drop).map_err(|error| error.to_string())
}

/// One vertex of a plane stands beside its place, by 4e-4 and by 4e-3 of an edge. Where a cell is
/// 1e-4 wide, files carry no such digits: there it may do so by 5e-7 of the plane's size, which is
/// 3.9, and not by 5e-6.
///
/// Fails if `MATCH_EDGE` is 0.5 or 0, and if `MATCH` is 0.1 or 0.
#[test]
fn partners_match_within_the_digits_of_files() {
    let beside = |at: DVec3, by: f64| if at == DVec3::new(1.0, 2.0, 0.5) { at + by * DVec3::X } else { at };
    assert_eq!(partners_in(|at| beside(at, 1e-4)), Ok(()));
    let refused = partners_in(|at| beside(at, 1e-3)).unwrap_err();
    assert!(refused.contains("2 of their") && refused.contains("have no partner"), "{refused}");
    let narrow = |at: DVec3| if at.x == CELL { DVec3::new(1e-4, at.y, at.z) } else { at };
    assert_eq!(partners_in(|at| narrow(beside(at, 2e-6))), Ok(()));
    let refused = partners_in(|at| narrow(beside(at, 2e-5))).unwrap_err();
    assert!(refused.contains("2 of their") && refused.contains("have no partner"), "{refused}");
}

/// The far plane is tilted by the noise of a file, and by half a degree.
///
/// Fails if `PARALLEL` is 0.5 or 1e-12.
#[test]
fn partners_are_parallel() {
    let tilted = |by: f64| partners_in(|at| if at.y == 2.0 { at + by * (at.x - 1.5) * DVec3::Y } else { at });
    assert_eq!(tilted(1e-5), Ok(()));
    let refused = tilted(0.01).unwrap_err();
    assert!(refused.contains("they are not parallel"), "{refused}");
}

/// The vertices that may slide in local optimisation are not those of periodic planes.
#[test]
fn partners_do_not_slide() {
    let mesh = block(8.0, |at| at);
    let surface = Topology::new(&mesh).unwrap().surface;
    let sliding = |symmetry: Role| {
        let role = |name: &String| match name.as_str() {
            "wing" => Role::Wing,
            "symmetry" => symmetry.clone(),
            "side" => PLANE,
            _ => Role::Fixed,
        };
        let families = Families::new(&mesh, &surface, mesh.families.iter().map(role).collect()).unwrap();
        let vertices = SurfaceFreedom::new(&mesh, &surface, &families, &[]).vertices();
        let ends = vertices.iter().filter(|&&vertex| [0.0, 2.0].contains(&mesh.vertices[vertex as usize].y));
        (ends.count(), vertices.len())
    };
    let (ends, all) = sliding(PLANE);
    assert!(ends > 0);
    assert_eq!(sliding(partner_of("side")), (0, all - ends));
}
