//! Wings with winglets: one set of profiles for both, and two sets that share a curve.
//!
//! The allowed distances and qualities are those that prototypes in another language measured on
//! the same meshes and profiles, with a margin.

mod common;

use std::sync::Arc;

use common::aircraft::{Anyway, cpu, file, role, triangles_of, vertices_of};
use common::parts::{mesh, profiles};
use glam::{DQuat, DVec3};
use idmesh::backend::Backend;
use idmesh::case::Case;
use idmesh::families::{Role, SetupError};
use idmesh::mesh::{FamilyId, TetMesh};
use idmesh::mover::{Design, MoveError, Mover, MoverBuilder, Outcome, SPRINGS, SharedCurve, Warning};
use idmesh::profile::Profile;
use idmesh::projection::TriangleTree;

const MESHES: [&str; 2] = ["blended", "fence"];
const SETS: [&str; 4] = ["small", "big", "planform", "twist"];
const BOTH: [&str; 2] = ["wing", "winglet"];
/// The profiles of the wing have the numbers 0 to 4, those of the winglet 5 to 7.
const OF_WING: std::ops::Range<i64> = 0..5;
const OF_WINGLET: std::ops::Range<i64> = 5..8;

fn of(profiles: &[Profile], numbers: std::ops::Range<i64>) -> Vec<Profile> {
    profiles.iter().filter(|profile| numbers.contains(&profile.number)).cloned().collect()
}

/// The usual roles, default settings, and no profiles yet.
fn base(mesh: TetMesh) -> MoverBuilder {
    let of = |name: &str| match name {
        "winglet" => Some(Role::Wing),
        "winglet_te" => Some(Role::TrailingEdge),
        "winglet_tip" => role("wingtip"),
        _ => role(name),
    };
    let roles: Vec<_> = mesh.families.iter().filter_map(|name| Some((name.clone(), of(name)?))).collect();
    roles.into_iter().fold(Mover::builder(mesh), |builder, (family, role)| builder.role(&family, role))
}

fn of_one(mesh: TetMesh, old: Vec<Profile>, backend: Arc<dyn Backend>) -> Mover {
    base(mesh).wing("outer", &BOTH, old, None).build(backend).unwrap()
}

/// A mover with profiles of its own for each of the two, in this order.
fn of_two(name: &str, order: [&str; 2]) -> MoverBuilder {
    let old = profiles(name, "old");
    let numbers = |wing: &str| if wing == "wing" { OF_WING } else { OF_WINGLET };
    order.iter().fold(base(mesh(name)), |builder, wing| builder.old_profiles(wing, of(&old, numbers(wing))))
}

fn two(new: &[Profile]) -> Design {
    Design::of_wing("wing", of(new, OF_WING)).with_profiles("winglet", of(new, OF_WINGLET))
}

fn mapped(profiles: &[Profile], map: impl Fn(DVec3) -> DVec3) -> Vec<Profile> {
    let points = |profile: &Profile| profile.points.iter().map(|&at| map(at)).collect();
    profiles.iter().map(|profile| Profile { number: profile.number, points: points(profile) }).collect()
}

fn shared(mesh: &TetMesh) -> Vec<usize> {
    let winglet = vertices_of(mesh, "winglet");
    vertices_of(mesh, "wing").into_iter().filter(|vertex| winglet.binary_search(vertex).is_ok()).collect()
}

/// Least and greatest ratio of the lengths of a family's edges that end on the shared curve.
fn stretch(mesh: &TetMesh, moved: &[DVec3], family: &str) -> [f64; 2] {
    let curve = shared(mesh);
    let on = |vertex: usize| curve.binary_search(&vertex).is_ok();
    let edges = triangles_of(mesh, family).into_iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]);
    let ratios = edges
        .filter(|&[a, b]| on(a) != on(b))
        .map(|[a, b]| moved[a].distance(moved[b]) / mesh.vertices[a].distance(mesh.vertices[b]));
    ratios.fold([f64::INFINITY, 0.0], |[low, high], ratio| [f64::min(low, ratio), f64::max(high, ratio)])
}

fn distance_to_triangle(at: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)].iter().all(|&(from, to)| (to - from).cross(at - from).dot(normal) >= 0.0);
    if inside {
        return ((at - a).dot(normal) / normal.length()).abs();
    }
    let to_segment = |(from, to): (DVec3, DVec3)| {
        let share = ((at - from).dot(to - from) / from.distance_squared(to)).clamp(0.0, 1.0);
        at.distance(from.lerp(to, share))
    };
    [(a, b), (b, c), (c, a)].into_iter().map(to_segment).fold(f64::INFINITY, f64::min)
}

/// Largest distance of a profile's point from the moved wing and winglet.
fn off_surface(mesh: &TetMesh, moved: &[DVec3], profiles: &[Profile]) -> f64 {
    let all = BOTH.iter().flat_map(|family| triangles_of(mesh, family));
    let triangles: Vec<[DVec3; 3]> = all.map(|triangle| triangle.map(|vertex| moved[vertex])).collect();
    let off = |&at: &DVec3| {
        let near = triangles.iter().filter(|corners| corners[0].distance_squared(at) < 0.01);
        near.map(|&corners| distance_to_triangle(at, corners)).fold(f64::INFINITY, f64::min)
    };
    profiles.iter().flat_map(|profile| &profile.points).map(off).fold(0.0, f64::max)
}

/// Fails if the wing behind a fence has the parameters of the fence's other side: edges are
/// stretched 1.33 times in the set `big`, which makes the wing thicker and not the fence.
#[test]
fn one_set_of_profiles_moves_wing_and_winglet() {
    for name in MESHES {
        let mut mover = of_one(mesh(name), profiles(name, "old"), cpu());
        for set in SETS {
            let new = profiles(name, set);
            let outcome = mover.update(&Design::of_wing("outer", new.clone())).unwrap();
            outcome.check().unwrap_or_else(|refused| panic!("{name} {set}: {refused}"));
            let last = outcome.stages.last().unwrap();
            assert!(last.beta_min >= 0.0070, "{name} {set}: {last:?}");
            assert!(outcome.folded.is_empty() && outcome.warnings.is_empty(), "{name} {set}: {:?}", outcome.warnings);
            let [low, high] = stretch(mover.mesh(), outcome.vertices(), "wing");
            assert!(low >= 0.8 && high <= 1.2, "{name} {set}: {low} {high}");
            let off = off_surface(mover.mesh(), outcome.vertices(), &new);
            assert!(off < 0.0025, "{name} {set}: {off}");
            // The loft and each of its families have the distance from all profiles.
            let report = &outcome.profiles["outer"];
            assert!(report.max_distance_to_new_profiles.unwrap() < 0.0025 && report.shared_curves.is_empty());
            assert!(BOTH.iter().all(|family| outcome.profiles[*family] == *report), "{name} {set}");
        }
    }
}

/// A rigid motion of all profiles, some of them in planes that stand upright, is the wing's and the
/// winglet's. Near the fuselage the wing slides.
#[test]
fn a_rigid_motion_of_all_profiles_is_that_of_wing_and_winglet() {
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.02, 0.05, -0.03);
    let moved = |at: DVec3| turn * at + DVec3::new(0.03, -0.02, 0.05);
    for name in MESHES {
        let mut mover = of_one(mesh(name), profiles(name, "old"), cpu());
        let new = mapped(&profiles(name, "old"), moved);
        let outcome = mover.update(&Design::of_wing("outer", new)).unwrap();
        let mesh = mover.mesh();
        let all = BOTH.iter().flat_map(|family| vertices_of(mesh, family));
        for vertex in all.filter(|&vertex| mesh.vertices[vertex].y > 1.5) {
            let off = outcome.vertices()[vertex].distance(moved(mesh.vertices[vertex]));
            assert!(off < 1e-12, "{name}: {off:e} at {}", mesh.vertices[vertex]);
        }
    }
}

#[test]
fn unchanged_profiles_move_nothing() {
    for name in MESHES {
        let old = profiles(name, "old");
        let mut one = of_one(mesh(name), old.clone(), cpu());
        let outcome = one.update(&Design::of_wing("outer", old.clone())).unwrap();
        assert_eq!(outcome.vertices(), one.mesh().vertices, "{name}");
        let mut separate = of_two(name, BOTH).build(cpu()).unwrap();
        let outcome = separate.update(&two(&old)).unwrap();
        assert_eq!(outcome.vertices(), separate.mesh().vertices, "{name}");
        assert_eq!(outcome.warnings, []);
    }
}

/// In a unit that is 1024 times smaller each number is 1024 times as large, to the bit.
#[test]
fn another_unit_changes_no_bit() {
    let factor = 1024.0;
    for order in [None, Some(BOTH)] {
        let run = |factor: f64| {
            let mut mesh = mesh("blended");
            mesh.vertices.iter_mut().for_each(|at| *at *= factor);
            let [old, new] = ["old", "big"].map(|set| mapped(&profiles("blended", set), |at| factor * at));
            let (builder, design) = match order {
                None => (base(mesh).wing("outer", &BOTH, old, None), Design::of_wing("outer", new)),
                Some([one, other]) => {
                    let builder = base(mesh).old_profiles(one, of(&old, OF_WING));
                    (builder.old_profiles(other, of(&old, OF_WINGLET)), two(&new))
                }
            };
            builder.build(cpu()).unwrap().update(&design).unwrap()
        };
        let (small, large) = (run(1.0), run(factor));
        for (one, other) in small.vertices().iter().zip(large.vertices()) {
            assert_eq!(*one * factor, *other);
        }
    }
}

/// A fence below the wing is the mirror image of one above it. Its sections stand in planes that
/// are perpendicular to those of the wing, so their normals do not say on which side they are.
///
/// Fails if such normals keep the side of their largest component.
#[test]
fn a_fence_may_point_down() {
    let down = |at: DVec3| DVec3::new(at.x, at.y, -at.z);
    let (old, new) = (profiles("fence", "old"), profiles("fence", "planform"));
    let up = of_one(mesh("fence"), old.clone(), cpu()).update(&Design::of_wing("outer", new.clone())).unwrap();
    let mut mesh = mesh("fence");
    mesh.vertices.iter_mut().for_each(|at| *at = down(*at));
    mesh.tets.iter_mut().for_each(|tet| tet.swap(2, 3));
    // In another order of the profiles those of the fence come first.
    let reversed = |profiles: &[Profile]| mapped(profiles, down).into_iter().rev().collect::<Vec<_>>();
    let mut mover = of_one(mesh, reversed(&old), cpu());
    let outcome = mover.update(&Design::of_wing("outer", reversed(&new))).unwrap();
    outcome.check().unwrap();
    for vertex in BOTH.iter().flat_map(|family| vertices_of(mover.mesh(), family)) {
        let apart = outcome.vertices()[vertex].distance(down(up.vertices()[vertex]));
        assert!(apart < 1e-5, "{apart:e} at {}", mover.mesh().vertices[vertex]);
    }
}

/// A wing that hangs down towards its tip by 17 degrees: the planes of the fence's sections,
/// continued inwards, cross it once more.
///
/// Fails if vertices of that crossing are compared with the fence's profile.
#[test]
fn a_plane_may_cross_the_wing_far_from_its_section() {
    let hanging = |at: DVec3| at - 0.3 * (at.y - 3.6).min(0.0) * DVec3::Z;
    let [old, new] = ["old", "planform"].map(|set| mapped(&profiles("fence", set), hanging));
    let mut mesh = mesh("fence");
    mesh.vertices.iter_mut().for_each(|at| *at = hanging(*at));
    let fence = old.iter().find(|profile| profile.number == OF_WINGLET.start).unwrap().points[0].z;
    let beyond = vertices_of(&mesh, "wing").into_iter().filter(|&vertex| mesh.vertices[vertex].z > fence);
    assert!(beyond.count() > 100);
    let mut mover = of_one(mesh, old, cpu());
    let outcome = mover.update(&Design::of_wing("outer", new.clone())).unwrap();
    outcome.check().unwrap();
    let off = off_surface(mover.mesh(), outcome.vertices(), &new);
    assert!(off < 0.0025, "{off}");
    // The vertices tell that the profiles are there. The facets' cut is not one curve.
    let report = &outcome.profiles["outer"];
    assert!(report.max_miss_of_vertices.unwrap() < 1e-3 && report.not_measured.is_some(), "{report:?}");
}

/// The curve that the second wing gives way at.
fn curve_of(outcome: &Outcome, second: &str) -> SharedCurve {
    let [curve] = &outcome.profiles[second].shared_curves[..] else { panic!("{:?}", outcome.profiles) };
    curve.clone()
}

/// The first of two wings moves the shared curve as it would without the other. Far from the curve
/// the second one moves by its own profiles alone.
#[test]
fn the_first_wing_has_the_shared_curve() {
    for name in MESHES {
        let new = profiles(name, "planform");
        let mesh = mesh(name);
        let curve = shared(&mesh);
        let run = |order| {
            let outcome = of_two(name, order).quality(None).build(cpu()).unwrap().update(&two(&new)).unwrap();
            assert_eq!(outcome.inverted, 0, "{name}");
            assert!(outcome.missed.is_empty() && outcome.folded.is_empty(), "{name}: {:?}", outcome.missed);
            outcome
        };
        let by_wing = run(BOTH);
        let by_winglet = run(["winglet", "wing"]);
        let alone = {
            let attached = Role::named("attached", Default::default()).unwrap();
            let parts = ["winglet", "winglet_te", if name == "fence" { "winglet_tip" } else { "wingtip" }];
            let builder = parts.iter().fold(base(mesh.clone()), |builder, part| builder.role(part, attached.clone()));
            let mut mover = builder.old_profiles("wing", of(&profiles(name, "old"), OF_WING)).build(cpu()).unwrap();
            mover.update(&Design::of_wing("wing", of(&new, OF_WING))).unwrap()
        };
        let mut largest: f64 = 0.0;
        for &vertex in &curve {
            assert_eq!(by_wing.displacement()[vertex], alone.displacement()[vertex], "{name}");
            largest = largest.max(by_wing.displacement()[vertex].distance(by_winglet.displacement()[vertex]));
        }
        let told = curve_of(&by_wing, "winglet");
        assert_eq!((told.owner.as_str(), told.vertices), ("wing", curve.len()));
        assert!((told.max_difference - largest).abs() < 1e-12, "{name}: {told:?} {largest}");
        assert!(by_wing.profiles["wing"].shared_curves.is_empty());
        let swapped = curve_of(&by_winglet, "wing");
        assert_eq!((swapped.owner.as_str(), swapped.vertices), ("winglet", curve.len()));
        assert!((swapped.max_difference - largest).abs() < 1e-12, "{name}: {swapped:?}");
        // Each gives way within a quarter of the chord, and before its first section.
        let chord = told.max_difference / told.of_chord;
        assert!((0.4..1.0).contains(&chord), "{name}: {chord}");
        let distance = |vertex: usize| {
            curve
                .iter()
                .map(|&other| mesh.vertices[vertex].distance(mesh.vertices[other]))
                .fold(f64::INFINITY, f64::min)
        };
        let mut gave_way = 0;
        for vertex in vertices_of(&mesh, "winglet") {
            let apart = by_wing.displacement()[vertex].distance(by_winglet.displacement()[vertex]);
            if distance(vertex) > 0.25 * chord + 0.06 {
                assert!(apart == 0.0, "{name}: {apart:e}");
            } else if apart > 0.0 && distance(vertex) > 0.0 {
                gave_way += 1;
            }
        }
        assert!(gave_way > 20, "{name}: {gave_way}");
        // So no row of triangles takes all of the difference: without a strip 4 to 6.
        let [low, high] = stretch(&mesh, by_wing.vertices(), "winglet");
        assert!(low > 0.7 && high < 1.5, "{name}: {low} {high}");
        let [low, high] = stretch(&mesh, by_wing.vertices(), "wing");
        assert!(low > 0.8 && high < 1.2, "{name}: {low} {high}");
    }
}

/// The design of the prototypes differs at the curve by 6 % of the chord. A shift of both by as
/// much differs by rounding, and a shift of the winglet alone by what it is.
#[test]
fn a_difference_is_told_of() {
    let mut mover = of_two("blended", BOTH).build(cpu()).unwrap();
    let warned = |outcome: &Outcome| {
        let told = outcome.warnings.iter().filter(|warning| matches!(warning, Warning::SharedCurve { .. }));
        told.map(ToString::to_string).collect::<Vec<_>>()
    };
    let outcome = mover.update(&two(&profiles("blended", "planform"))).unwrap();
    outcome.check().unwrap();
    let curve = curve_of(&outcome, "winglet");
    assert!((0.05..0.08).contains(&curve.of_chord), "{curve:?}");
    let [text] = &warned(&outcome)[..] else { panic!("{:?}", outcome.warnings) };
    let expected = format!("by up to {:.2} % of the chord", 100.0 * curve.of_chord);
    assert!(text.contains("`wing`") && text.contains("`winglet`") && text.contains(&expected), "{text}");
    let shift = DVec3::new(0.01, 0.02, 0.05);
    let old = profiles("blended", "old");
    let outcome = mover.update(&two(&mapped(&old, |at| at + shift))).unwrap();
    assert!(curve_of(&outcome, "winglet").max_difference < 1e-13 && warned(&outcome).is_empty());
    for (share, is_told) in [(0.0045, false), (0.0055, true)] {
        let first = old.iter().find(|profile| profile.number == OF_WINGLET.start).unwrap();
        let chord = first.points.iter().map(|at| at.distance(first.points[0])).fold(0.0, f64::max);
        let by = share * chord;
        let new = Design::of_wing("wing", of(&old, OF_WING))
            .with_profiles("winglet", mapped(&of(&old, OF_WINGLET), |at| at + by * DVec3::Y));
        let outcome = mover.update(&new).unwrap();
        let curve = curve_of(&outcome, "winglet");
        // The chord is the diagonal of the section's box, and here about the distance of its ends.
        assert!((curve.max_difference - by).abs() < 1e-12 && (curve.of_chord / share - 1.0).abs() < 0.02, "{curve:?}");
        assert_eq!(!warned(&outcome).is_empty(), is_told, "{share}");
    }
}

/// A motion for which one jump is too far ends in the same surfaces when it is followed in steps: a
/// twist of 57 degrees, with springs that know nothing of rotations.
#[test]
fn steps_end_where_the_jump_does() {
    let springs = SPRINGS.iter().find(|springs| springs.name == "longitudinal").unwrap();
    let turned = |at: DVec3| {
        let share = ((at.y - 0.8) / 2.65).clamp(0.0, 1.0);
        let about = DVec3::new(0.9 + 1.1 * share, at.y, 0.0);
        about + DQuat::from_rotation_y(share) * (at - about)
    };
    let old = profiles("blended", "old");
    let mut new = mapped(&of(&old, OF_WING), turned);
    new.extend(mapped(&of(&old, OF_WINGLET), |at| turned(at) + DVec3::new(0.0, 0.005, 0.005)));
    let run = |builder: MoverBuilder| builder.build(cpu()).unwrap().update(&two(&new)).unwrap();
    let builder = || of_two("blended", BOTH).springs(springs);
    let (jump, steps) = (run(builder().max_steps(1).quality(None)), run(builder()));
    assert!(jump.inverted > 0 && steps.path.steps > 1 && steps.path.reached == 1.0, "{:?}", steps.path);
    assert_eq!(steps.inverted, 0);
    assert!(curve_of(&steps, "winglet").max_difference > 0.005);
    // Local optimisation lets vertices slide a little in the end, and they stay on their surface.
    let triangles: Vec<[u32; 3]> = BOTH
        .iter()
        .flat_map(|family| triangles_of(steps.mesh(), family))
        .map(|triangle| triangle.map(|v| v as u32))
        .collect();
    let surface = TriangleTree::new(jump.vertices(), &triangles);
    for vertex in BOTH.iter().flat_map(|family| vertices_of(steps.mesh(), family)) {
        let at = steps.vertices()[vertex];
        let (apart, off) = (jump.vertices()[vertex].distance(at), surface.closest(at).point.distance(at));
        assert!(apart < 0.01 && off < 1e-4, "{apart:e} {off:e}");
    }
}

fn refused(builder: MoverBuilder) -> SetupError {
    match builder.build(cpu()).err() {
        Some(MoveError::Setup(error)) => error,
        other => panic!("{other:?}"),
    }
}

#[test]
fn wings_that_mean_nothing_are_refused() {
    let old = || profiles("blended", "old");
    let given = |families: &[&str]| base(mesh("blended")).wing("outer", families, old(), None);
    assert!(matches!(refused(given(&[])), SetupError::NoFamilies { wing } if wing == "outer"));
    assert!(matches!(refused(given(&["wing", "winglet", "wing"])),
        SetupError::FamilyTwice { family, .. } if family == "wing"));
    assert!(matches!(refused(given(&["wing", "fin"])), SetupError::UnknownFamily { name, .. } if name == "fin"));
    assert!(matches!(refused(given(&["wing", "winglet", "carenage"])),
        SetupError::NoWing { family, .. } if family == "carenage"));
    assert!(matches!(refused(given(&["wing"])), SetupError::NoProfiles { family } if family == "winglet"));
    assert!(matches!(refused(given(&BOTH).old_profiles("winglet", of(&old(), OF_WINGLET))),
        SetupError::SeveralProfiles { family } if family == "winglet"));
    let swapped = base(mesh("blended")).wing("winglet", &["wing"], of(&old(), OF_WING), None);
    assert!(matches!(
        refused(swapped.wing("wing", &["winglet"], of(&old(), OF_WINGLET), None)),
        SetupError::WingNames { .. }
    ));
    let twice = base(mesh("blended")).wing("one", &["wing"], of(&old(), OF_WING), None);
    assert!(matches!(refused(twice.wing("one", &["winglet"], of(&old(), OF_WINGLET), None)),
        SetupError::WingNames { wing } if wing == "one"));
}

/// A wing may be several parts that share no vertex, as where an engine parts it. A part without a
/// section moves in no known way.
#[test]
fn a_part_of_a_wing_needs_a_section() {
    let mut mesh = mesh("blended");
    let (wing, gap) = (mesh.family("wing").unwrap(), FamilyId(mesh.families.len() as u16));
    mesh.families.push("gap".into());
    for (triangle, family) in mesh.triangles.iter().zip(&mut mesh.triangle_family) {
        let y = triangle.iter().map(|&vertex| mesh.vertices[vertex as usize].y).sum::<f64>() / 3.0;
        if *family == wing && (1.0..1.2).contains(&y) {
            *family = gap;
        }
    }
    let inner = FamilyId(mesh.families.len() as u16);
    mesh.families.push("inner".into());
    for (triangle, family) in mesh.triangles.iter().zip(&mut mesh.triangle_family) {
        let y = triangle.iter().map(|&vertex| mesh.vertices[vertex as usize].y).sum::<f64>() / 3.0;
        if *family == wing && y < 1.0 {
            *family = inner;
        }
    }
    let with = |numbers: &[i64]| {
        let old = profiles("blended", "old").into_iter().filter(|profile| numbers.contains(&profile.number)).collect();
        let base = base(mesh.clone()).role("inner", Role::Wing).role("gap", Role::Fixed);
        base.wing("outer", &["inner", "wing", "winglet"], old, None)
    };
    assert!(with(&[0, 1, 2, 3, 4, 5, 6, 7]).build(cpu()).is_ok());
    assert!(matches!(refused(with(&[1, 2, 3, 4, 5, 6, 7])),
        SetupError::Apart { wing, family } if (wing.as_str(), family.as_str()) == ("outer", "inner")));
}

/// The order of the tables in a case file counts, not that of their names.
#[test]
fn the_first_table_of_a_case_has_the_shared_curve() {
    let folder = std::env::temp_dir().join(format!("idmesh-winglets-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let write = |name: &str, profiles: &[Profile]| {
        let mut text = String::from("profile,x,y,z\n");
        for Profile { number, points } in profiles {
            points.iter().for_each(|at| text += &format!("{number},{},{},{}\n", at.x, at.y, at.z));
        }
        std::fs::write(folder.join(name), text).unwrap();
    };
    let [old, new] = ["old", "big"].map(|set| profiles("blended", set));
    for (kind, all) in [("old", &old), ("new", &new)] {
        write(&format!("wing-{kind}.csv"), &of(all, OF_WING));
        write(&format!("winglet-{kind}.csv"), &of(all, OF_WINGLET));
    }
    let roles = "[family.wing]\nrole = \"wing\"\n[family.winglet]\nrole = \"wing\"\n[family.winglet_te]\nrole = \
                 \"trailing-edge\"\n[family.trailing_edge]\nrole = \"trailing-edge\"\n[family.wingtip]\nrole = \
                 \"wingtip\"\n[family.carenage]\nrole = \"carenage\"\n[family.symmetry]\nrole = \
                 \"plane\"\n[family.farfield]\nrole = \"fixed\"\n";
    let load = |tables: &str| {
        let mesh = file("tests/data/aircraft/blended.msh.gz");
        let path = folder.join("case.toml");
        std::fs::write(&path, format!("mesh = '{}'\n{tables}\n{roles}", mesh.display())).unwrap();
        Case::load(&path).map_err(Box::new)
    };
    let table = |wing: &str| format!("[profiles.{wing}]\nold = \"{wing}-old.csv\"\nnew = \"{wing}-new.csv\"\n");
    for (order, second) in [(BOTH, "winglet"), (["winglet", "wing"], "wing")] {
        let loaded = load(&(table(order[0]) + &table(order[1]))).unwrap();
        let outcome = loaded.mover(cpu()).unwrap().update(&loaded.design).unwrap();
        assert_eq!(curve_of(&outcome, second).owner, order[0]);
    }
    let files = "old = [\"wing-old.csv\", \"winglet-old.csv\"]\nnew = [\"wing-new.csv\", \"winglet-new.csv\"]\n";
    let loaded = load(&format!("[profiles.outer]\nfamilies = [\"wing\", \"winglet\"]\n{files}")).unwrap();
    let outcome = loaded.mover(cpu()).unwrap().update(&loaded.design).unwrap();
    let direct = of_one(mesh("blended"), old, cpu()).update(&Design::of_wing("outer", new)).unwrap();
    assert_eq!(outcome.vertices(), direct.vertices());

    let message = |families: &str, more: &str| {
        let error = load(&format!("[profiles.outer]\nfamilies = {families}\n{files}{more}")).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("case.toml:"), "{text}");
        text
    };
    let both = "[\"wing\", \"winglet\"]";
    for (families, more, expected) in [
        ("[]", "", "`profiles.outer.families` is an empty list, expected at least one family"),
        ("[\"wing\", \"winglet\", \"wing\"]", "", "`families` has `wing` twice"),
        ("[\"wing\", \"wingled\"]", "", "there is no table [family.wingled]"),
        ("[\"wing\", \"carenage\"]", "", "`carenage`, whose role is \"carenage\""),
        ("[\"wing\"]", "", "family `winglet` is a wing, but there is no table [profiles.winglet]"),
        (both, &table("winglet"), "family `winglet` is in [profiles.outer] and in [profiles.winglet]"),
    ] {
        let found = message(families, more);
        assert!(found.contains(expected), "{found}");
    }
    let crossed = "[profiles.winglet]\nfamilies = \"wing\"\nnew = \"wing-new.csv\"\n[profiles.wing]\nfamilies = \
                   \"winglet\"\nnew = \"winglet-new.csv\"\n";
    let error = load(crossed).unwrap_err().to_string();
    assert!(error.contains("has the name of a family that is in"), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// CPU and GPU agree to 1e-5 of the largest displacement.
#[cfg(feature = "gpu")]
#[test]
fn gpu_moves_wing_and_winglet_as_the_cpu_does() {
    use idmesh::relaxation::Method;
    let Some(gpu) = common::adapter::single() else { return };
    let gpu: Arc<dyn Backend> = Arc::new(gpu);
    let new = profiles("fence", "planform");
    for design in [Design::of_wing("outer", new.clone()), two(&new)] {
        let run = |backend: Arc<dyn Backend>| {
            let builder = match design.profiles.contains_key("outer") {
                true => base(mesh("fence")).wing("outer", &BOTH, profiles("fence", "old"), None),
                false => of_two("fence", BOTH),
            };
            let mut mover = builder.method(Method::Chebyshev).quality(None).build(backend).unwrap();
            mover.update(&design).unwrap()
        };
        let (one, other) = (run(cpu()), run(Arc::clone(&gpu)));
        let largest = one.displacement().iter().map(|d| d.length()).fold(0.0, f64::max);
        common::compare(one.displacement(), other.displacement(), 1e-5 * largest).unwrap();
        assert!(common::compare(one.displacement(), other.displacement(), 0.0).is_err());
    }
}
