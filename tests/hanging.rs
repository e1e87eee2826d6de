//! Parts that hang from a wing: a pylon with its nacelle, and flap track fairings.
//!
//! The allowed distances are those that prototypes in another language measured on the same meshes
//! and profiles, with a margin.

mod common;

use std::collections::HashMap;

use common::aircraft::{Anyway, SMALL, cpu, triangles_of, vertices_of};
use common::parts::{self, mesh, profiles, rigid};
use glam::{DQuat, DVec3};
use idmesh::families::{Junction, RigidMotion, Role, SetupError, TipStart};
use idmesh::geometry::fitted_motion::FittedMotion;
use idmesh::mesh::{FamilyId, TetMesh};
use idmesh::mover::{Design, MoveError, Mover, MoverBuilder, Outcome, Warning};
use idmesh::profile::Profile;

const ATTACHED: Role = Role::Attached { coefficient: 0.5, start: TipStart::Rigid, junction: Junction::Glued };

/// The usual roles, and others for the parts, with default settings.
fn builder(name: &str, parts: &[(&str, Role)]) -> MoverBuilder {
    parts::builder(mesh(name), profiles(name, "old"), parts)
}

fn mover(name: &str, parts: &[(&str, Role)]) -> Mover {
    builder(name, parts).build(cpu()).unwrap()
}

fn update(mover: &mut Mover, new: Vec<Profile>) -> Outcome {
    mover.update(&Design::of_wing("wing", new)).unwrap()
}

/// Largest distance of a family's vertices from their own best rigid motion.
fn off_rigid(mesh: &TetMesh, moved: &[DVec3], family: &str) -> f64 {
    let pairs: Vec<_> =
        vertices_of(mesh, family).into_iter().map(|vertex| (mesh.vertices[vertex], moved[vertex], 1.0)).collect();
    let motion = FittedMotion::rigid(&pairs);
    pairs.iter().map(|&(from, to, _)| (from + motion.displacement(from)).distance(to)).fold(0.0, f64::max)
}

/// Number of a family's triangles whose normals point to the other side than the family's best
/// rigid motion has them.
fn turned_over(mesh: &TetMesh, moved: &[DVec3], family: &str) -> usize {
    let pairs: Vec<_> =
        vertices_of(mesh, family).into_iter().map(|vertex| (mesh.vertices[vertex], moved[vertex], 1.0)).collect();
    let rotation = FittedMotion::rigid(&pairs).rotation();
    let normal = |at: &[DVec3], [a, b, c]: [usize; 3]| (at[b] - at[a]).cross(at[c] - at[a]);
    let all = triangles_of(mesh, family);
    all.into_iter().filter(|&t| normal(moved, t).dot(rotation * normal(&mesh.vertices, t)) < 0.0).count()
}

/// The largest change of the angle between two triangles that share an edge, in degrees.
fn largest_kink(mesh: &TetMesh, moved: &[DVec3], families: &[&str]) -> f64 {
    let mut behind: HashMap<[usize; 2], [usize; 3]> = HashMap::new();
    let mut largest: f64 = 0.0;
    for triangle in families.iter().flat_map(|family| triangles_of(mesh, family)) {
        let [a, b, c] = triangle;
        for [a, b] in [[a, b], [b, c], [c, a]] {
            let Some(other) = behind.insert([a.min(b), a.max(b)], triangle) else { continue };
            let angle = |at: &[DVec3]| {
                let [one, two] = [triangle, other].map(|t| {
                    let [a, b, c] = t.map(|vertex| at[vertex]);
                    (b - a).cross(c - a)
                });
                one.angle_between(two).to_degrees()
            };
            largest = largest.max((angle(moved) - angle(&mesh.vertices)).abs());
        }
    }
    largest
}

#[test]
fn a_nacelle_goes_with_its_wing() {
    let mut mover = mover("nacelle", &[("pylon", ATTACHED), ("nacelle", rigid(RigidMotion::Root))]);
    let size = 40.0;
    for (set, turn, off) in
        [("small", 0.87, 0.0006), ("big", 1.43, 0.0055), ("planform", 3.37, 0.020), ("twist", 3.19, 0.0006)]
    {
        let outcome = update(&mut mover, profiles("nacelle", set));
        outcome.check().unwrap_or_else(|refused| panic!("{set}: {refused}"));
        let last = outcome.stages.last().unwrap();
        assert!(last.beta_min >= 0.0029 && last.beta_mean >= 0.0474, "{set}: {last:?}");
        assert!(outcome.folded.is_empty(), "{set}: {:?}", outcome.folded);
        let (mesh, moved) = (mover.mesh(), outcome.vertices());
        assert!(off_rigid(mesh, moved, "nacelle") <= 1e-12 * size, "{set}: {:e}", off_rigid(mesh, moved, "nacelle"));
        let nacelle = outcome.families["nacelle"];
        assert_eq!(nacelle.role, Some("rigid"));
        assert!((nacelle.turn_degrees.unwrap() - turn).abs() <= 0.05, "{set}: {nacelle:?}");
        let pylon = outcome.families["pylon"];
        assert_eq!(pylon.role, Some("attached"));
        assert!(pylon.max_distance_to_carried_surface.unwrap() <= off, "{set}: {pylon:?}");
        assert!(off_rigid(mesh, moved, "pylon") <= 1.5 * off, "{set}: {:e}", off_rigid(mesh, moved, "pylon"));
        let kink = largest_kink(mesh, moved, &["pylon", "nacelle", "wing"]);
        assert!(kink < 60.0, "{set}: {kink}");
    }
}

/// The pylon's role changes nothing of the wing, and unchanged profiles move nothing at all.
#[test]
fn the_wing_wins() {
    let new = profiles("nacelle", "planform");
    let tip = Role::Wingtip { coefficient: 0.5, start: TipStart::Affine };
    let mut hung = mover("nacelle", &[("pylon", ATTACHED), ("nacelle", rigid(RigidMotion::Root))]);
    let outcome = update(&mut hung, new.clone());
    // Springs of the volume move no vertex of the surface, and local optimisation would.
    assert!(outcome.smoothed.is_none());
    let as_tip = update(&mut mover("nacelle", &[("pylon", tip), ("nacelle", Role::Fixed)]), new);
    let wing = vertices_of(hung.mesh(), "wing");
    let pylon = vertices_of(hung.mesh(), "pylon");
    let shared: Vec<usize> = pylon.into_iter().filter(|vertex| wing.binary_search(vertex).is_ok()).collect();
    assert!(shared.len() > 20);
    for vertex in shared {
        assert_eq!(outcome.displacement()[vertex], as_tip.displacement()[vertex]);
    }
    let still = update(&mut hung, profiles("nacelle", "old"));
    assert_eq!(still.vertices(), hung.mesh().vertices);
}

#[test]
fn a_nacelle_keeps_its_attitude_or_stays() {
    let mover_of = |motion| mover("nacelle", &[("pylon", ATTACHED), ("nacelle", rigid(motion))]);
    for set in ["planform", "twist"] {
        let mut shifted = mover_of(RigidMotion::Translation);
        let outcome = update(&mut shifted, profiles("nacelle", set));
        outcome.check().unwrap();
        let report = outcome.families["nacelle"];
        assert_eq!(report.turn_degrees, Some(0.0));
        let shift = DVec3::from(report.shift.unwrap());
        assert!(shift.length() > 0.001);
        for vertex in vertices_of(shifted.mesh(), "nacelle") {
            assert!(outcome.displacement()[vertex].distance(shift) < 1e-14);
        }
        let mut still = mover_of(RigidMotion::None);
        let outcome = update(&mut still, profiles("nacelle", set));
        outcome.check().unwrap();
        for vertex in vertices_of(still.mesh(), "nacelle") {
            assert_eq!(outcome.vertices()[vertex], still.mesh().vertices[vertex]);
        }
    }
}

/// Three degrees nose up and lower, about a point of the junction; and moved so far inwards that
/// the pylon closes on the nacelle.
#[test]
fn a_nacelle_is_moved_against_its_wing() {
    let (turn, about) = (DVec3::new(0.0, 3.0, 0.0), DVec3::new(0.4, 1.6, -0.56));
    let shift = DVec3::new(0.0, 0.0, -0.05);
    let given = |turn, shift| [("pylon", ATTACHED), ("nacelle", rigid(RigidMotion::Given { turn, about, shift }))];
    let mut lower = mover("nacelle", &given(turn, shift));
    let outcome = update(&mut lower, profiles("nacelle", "small"));
    outcome.check().unwrap();
    assert!(outcome.stages.last().unwrap().beta_min >= 0.0029, "{:?}", outcome.stages);
    let rotation = DQuat::from_rotation_y(3f64.to_radians());
    for vertex in vertices_of(lower.mesh(), "nacelle") {
        let there = about + rotation * (lower.mesh().vertices[vertex] - about) + shift;
        assert!(outcome.vertices()[vertex].distance(there) < 1e-13);
    }
    let mut closing = mover("nacelle", &given(-turn, DVec3::new(0.05, 0.0, 0.03)));
    let refused = update(&mut closing, profiles("nacelle", "small")).check().unwrap_err();
    assert!(refused.message.contains("pylon") && refused.message.contains("nacelle"), "{refused}");
}

#[test]
fn fairings_keep_their_shape() {
    let mut mover = mover("fairings", &[("fairing_1", ATTACHED), ("fairing_2", ATTACHED)]);
    for (set, off) in [("small", 0.0035), ("big", 0.0063), ("planform", 0.031), ("twist", 0.0010)] {
        let outcome = update(&mut mover, profiles("fairings", set));
        outcome.check().unwrap_or_else(|refused| panic!("{set}: {refused}"));
        assert!(outcome.stages.last().unwrap().beta_min >= 0.0069, "{set}: {:?}", outcome.stages.last());
        for fairing in ["fairing_1", "fairing_2"] {
            let surface = outcome.families[fairing].max_distance_to_carried_surface.unwrap();
            assert!(surface <= off && surface > 0.0, "{set}: {fairing} {surface}");
            // Along the surface vertices may go a little farther.
            let own = off_rigid(mover.mesh(), outcome.vertices(), fairing);
            assert!(own <= 1.5 * off, "{set}: {fairing} {own}");
        }
    }
}

/// A chord half as long again as before creases a fairing at its ends, and no crease cuts the
/// fairing into parts. The triangles that it turns over are told all the same.
#[test]
fn a_part_that_is_creased_is_warned_of() {
    let mut mover = mover("fairings", &[("fairing_1", ATTACHED), ("fairing_2", ATTACHED)]);
    let longer = |profile: Profile| {
        let leading = profile.points.iter().copied().min_by(|a, b| a.x.total_cmp(&b.x)).unwrap();
        let factor = if profile.number == 0 { 1.0 } else { 1.5 };
        let points = profile.points.iter().map(|&at| leading + factor * (at - leading)).collect();
        Profile { points, ..profile }
    };
    let outcome = update(&mut mover, profiles("fairings", "old").into_iter().map(longer).collect());
    let turned = turned_over(mover.mesh(), outcome.vertices(), "fairing_1");
    assert!(turned > 0);
    let told = outcome.families["fairing_1"].folded_triangles;
    assert!(told.abs_diff(turned) <= turned / 2 && told > 0, "{told}, {turned}");
    let warned =
        |warning: &Warning| matches!(warning, Warning::Folded { families } if families.contains_key("fairing_1"));
    assert!(outcome.warnings.iter().any(warned), "{:?}", outcome.warnings);
    let unchanged = update(&mut mover, profiles("fairings", "small"));
    assert!(unchanged.folded.is_empty() && unchanged.warnings.is_empty(), "{:?}", unchanged.warnings);
}

/// A strip of the pylon, a quarter of its chord wide, as a family of its own.
///
/// Fails if each attached family has its own width.
#[test]
fn a_part_of_two_families_moves_as_one() {
    let new = profiles("nacelle", "planform");
    let parts = [("pylon", ATTACHED), ("nacelle", rigid(RigidMotion::Root))];
    let whole = update(&mut mover("nacelle", &parts), new.clone());
    let mut mesh = mesh("nacelle");
    let (pylon, on_pylon) = (mesh.family("pylon").unwrap(), vertices_of(&mesh, "pylon"));
    let strip = FamilyId(mesh.families.len() as u16);
    let (low, high) = vertices_of(&mesh, "pylon")
        .iter()
        .map(|&vertex| mesh.vertices[vertex].x)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    for (triangle, family) in mesh.triangles.iter().zip(&mut mesh.triangle_family) {
        let is_behind = triangle.iter().all(|&vertex| mesh.vertices[vertex as usize].x > low + 0.75 * (high - low));
        if *family == pylon && is_behind {
            *family = strip;
        }
    }
    mesh.families.push("strip".into());
    assert!(vertices_of(&mesh, "strip").len() > 20);
    let mut in_two = parts::builder(mesh, profiles("nacelle", "old"), &[&parts[..], &[("strip", ATTACHED)]].concat())
        .build(cpu())
        .unwrap();
    let in_two = update(&mut in_two, new);
    for vertex in on_pylon {
        let (one, other) = (whole.vertices()[vertex], in_two.vertices()[vertex]);
        assert!(one.distance(other) < 1e-9, "{one} {other}");
    }
}

/// Profiles that turn and shift as one body take pylon and nacelle with them as one body.
#[test]
fn a_rigid_motion_of_the_wing_is_the_assemblys() {
    let mut mover = mover("nacelle", &[("pylon", ATTACHED), ("nacelle", rigid(RigidMotion::Root))]);
    let shift = DVec3::new(0.02, 0.0, 0.03);
    let turn = DQuat::from_rotation_y(0.02);
    let moved = |at: DVec3| turn * at + shift;
    let mut new = profiles("nacelle", "old");
    new.iter_mut().for_each(|profile| profile.points.iter_mut().for_each(|at| *at = moved(*at)));
    let outcome = update(&mut mover, new);
    for family in ["pylon", "nacelle"] {
        for vertex in vertices_of(mover.mesh(), family) {
            let off = outcome.vertices()[vertex].distance(moved(mover.mesh().vertices[vertex]));
            assert!(off < 1e-10, "{family}: {off:e}");
        }
    }
}

fn refused(name: &str, parts: &[(&str, Role)]) -> SetupError {
    match builder(name, parts).build(cpu()).err() {
        Some(MoveError::Setup(error)) => error,
        other => panic!("{other:?}"),
    }
}

/// A tail without profiles on the fuselage: it stays to the bit while the wing moves and the
/// fuselage's vertices slide. Its end follows a given motion exactly, and the rest leads from the
/// fuselage to it.
///
/// Fails if vertices of the fuselage at the tail slide, or if the assembly has no root.
#[test]
fn parts_on_a_fuselage_rest_on_it() {
    let shift = DVec3::new(0.02, 0.0, 0.05);
    let given = RigidMotion::Given { turn: DVec3::ZERO, about: DVec3::ZERO, shift };
    for (motion, shift) in [(RigidMotion::Root, DVec3::ZERO), (RigidMotion::Translation, DVec3::ZERO), (given, shift)] {
        let parts = [("tail", ATTACHED), ("tail_te", ATTACHED), ("tail_tip", rigid(motion))];
        let mut mover = builder("tail", &parts).build(cpu()).unwrap();
        let outcome = mover.update(&Design::of_wing("wing", profiles("tail", "big"))).unwrap();
        let moved = outcome.valid().unwrap().vertices();
        let mesh = mover.mesh();
        let by = |vertex: usize| moved[vertex] - mesh.vertices[vertex];
        let carenage = vertices_of(mesh, "carenage");
        let tail: Vec<usize> = ["tail", "tail_te"].into_iter().flat_map(|family| vertices_of(mesh, family)).collect();
        let root: Vec<usize> = tail.iter().copied().filter(|vertex| carenage.contains(vertex)).collect();
        assert!(root.len() > 10 && carenage.iter().any(|&vertex| by(vertex).length() > 1e-3), "{motion:?}");
        assert!(root.iter().all(|&vertex| by(vertex) == DVec3::ZERO), "{motion:?}");
        for vertex in vertices_of(mesh, "tail_tip") {
            let off = by(vertex).distance(shift);
            assert!(if shift == DVec3::ZERO { off == 0.0 } else { off < 1e-14 }, "{motion:?}: {off:e}");
        }
        let largest = tail.iter().map(|&vertex| by(vertex).length()).fold(0.0, f64::max);
        assert!(largest <= shift.length() * (1.0 + 1e-9), "{motion:?}: {largest}");
        assert!(outcome.warnings.is_empty(), "{motion:?}: {:?}", outcome.warnings);
    }
}

#[test]
fn assemblies_without_a_known_motion_are_refused() {
    // The tail's end of the fuselage, and the far boundary, hang from nothing.
    let parts = [("pylon", Role::Fixed), ("nacelle", Role::Fixed), ("farfield", rigid(RigidMotion::Root))];
    assert!(matches!(refused("nacelle", &parts), SetupError::NoRoot { family, role: "rigid" } if family == "farfield"));
    // Symmetry plane and far boundary share a curve.
    let turn = DVec3::new(1.0, 0.0, 0.0);
    let motion = RigidMotion::Given { turn, about: DVec3::ZERO, shift: DVec3::ZERO };
    let parts = [("pylon", Role::Fixed), ("nacelle", Role::Fixed), ("farfield", rigid(motion))];
    assert!(matches!(refused("nacelle", &parts), SetupError::LeavesPlane { family, .. } if family == "farfield"));
}

/// The fuselage as one body that goes with the wing's root and ends in the symmetry plane.
///
/// Fails if the root's mirror image does not count.
#[test]
fn a_body_on_a_plane_stays_on_it() {
    let mut mover =
        SMALL.builder(SMALL.profiles("old_2")).role("carenage", rigid(RigidMotion::Root)).build(cpu()).unwrap();
    let outcome = update(&mut mover, SMALL.profiles("planform_2"));
    let mesh = mover.mesh();
    let (body, plane, wing) = (vertices_of(mesh, "carenage"), vertices_of(mesh, "symmetry"), vertices_of(mesh, "wing"));
    let shared: Vec<usize> = body.iter().copied().filter(|vertex| plane.contains(vertex)).collect();
    assert!(shared.len() > 5 && outcome.families["carenage"].turn_degrees.unwrap() > 0.01);
    for vertex in shared {
        assert!(outcome.displacement()[vertex].y.abs() < 1e-13, "{}", outcome.displacement()[vertex]);
    }
    // All of it but the root is turned as one.
    let edge = vertices_of(mesh, "trailing_edge");
    let own = body.into_iter().filter(|vertex| !wing.contains(vertex) && !edge.contains(vertex));
    let pairs: Vec<_> = own.map(|vertex| (mesh.vertices[vertex], outcome.vertices()[vertex], 1.0)).collect();
    let motion = FittedMotion::rigid(&pairs);
    for (from, to, _) in pairs {
        assert!((from + motion.displacement(from)).distance(to) < 1e-12);
    }
}

/// One triangle of the wingtip as a rigid family: two vertices are its root.
#[test]
fn a_root_on_a_line_is_refused() {
    let mut mesh = SMALL.mesh();
    let (tip, wing) = (mesh.family("wingtip").unwrap(), vertices_of(&mesh, "wing"));
    let of_tip = |pair: &(&[u32; 3], &FamilyId)| *pair.1 == tip;
    let on_wing = |triangle: &[u32; 3]| triangle.iter().filter(|&&vertex| wing.contains(&(vertex as usize))).count();
    let pairs = mesh.triangles.iter().zip(&mesh.triangle_family);
    let place = pairs.enumerate().find(|(_, pair)| of_tip(pair) && on_wing(pair.0) == 2).unwrap().0;
    mesh.triangle_family[place] = FamilyId(mesh.families.len() as u16);
    mesh.families.push("bit".into());
    let whole = common::aircraft::builder(mesh, SMALL.profiles("old_2"));
    let flat = Role::Plane { flat: Some(0.1), partner: None };
    let refused = whole.role("wingtip", flat).role("bit", rigid(RigidMotion::Root)).build(cpu()).err();
    match refused {
        Some(MoveError::Setup(SetupError::ThinRoot { family, vertices: 2 })) => assert_eq!(family, "bit"),
        other => panic!("{other:?}"),
    }
}

/// A rigid body that hangs from a wing without a band between: what the wing changes falls on one
/// row of triangles.
#[test]
fn a_body_that_is_torn_from_its_wing_is_told_of() {
    let mut mover = mover("nacelle", &[("pylon", rigid(RigidMotion::Root)), ("nacelle", rigid(RigidMotion::Root))]);
    let outcome = update(&mut mover, profiles("nacelle", "planform"));
    let strained = &outcome.strained["pylon"];
    assert!(strained.by == "wing" && strained.distance > 0.2 * strained.edge, "{strained:?}");
    assert!(outcome.check().unwrap_err().message.contains("the rigid family `pylon` is torn from `wing`"));
}

/// The rear half of the nacelle goes elsewhere than its front half, which tears the seam.
#[test]
fn a_body_that_is_torn_from_another_is_told_of() {
    let given = |z: f64| RigidMotion::Given { turn: DVec3::ZERO, about: DVec3::ZERO, shift: DVec3::Z * z };
    let run = |of_rear: f64| {
        let mesh = parts::halved(mesh("nacelle"), "nacelle", DVec3::X * 0.4);
        let parts = [("pylon", ATTACHED), ("nacelle", rigid(given(0.0))), ("nacelle_rear", rigid(given(of_rear)))];
        let builder = parts::builder(mesh, profiles("nacelle", "old"), &parts).quality(None);
        update(&mut builder.build(cpu()).unwrap(), profiles("nacelle", "small"))
    };
    assert!(run(0.0).strained.is_empty());
    let torn = run(0.02);
    let (family, strained) = torn.strained.first_key_value().unwrap();
    let other = if family == "nacelle" { "nacelle_rear" } else { "nacelle" };
    assert!(strained.by == other && (strained.distance - 0.02).abs() < 1e-12, "{family}: {strained:?}");
    let expected = format!("the rigid family `{family}` is torn from `{other}`");
    let refused = torn.check().unwrap_err();
    assert!(refused.message.contains(&expected), "{refused}");
    assert!(
        refused.hint.as_ref().unwrap().starts_with(&format!("give `{family}` the motion of `{other}`")),
        "{refused:?}"
    );
}
