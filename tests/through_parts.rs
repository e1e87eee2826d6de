//! Sections of a wing through the parts that stand on it: a pylon, and fairings across the trailing
//! edge.
//!
//! The wing of these meshes is known in closed form: straight lines join two sections of a
//! four-digit NACA profile with a wedge.

mod common;

use common::aircraft::{Anyway, cpu, vertices_of};
use common::parts::{builder, mesh, profiles};
use glam::DVec3;
use idmesh::families::{Junction, RigidMotion, Role, SetupError, TipStart};
use idmesh::geometry::nearest_on_segment;
use idmesh::mesh::{FamilyId, TetMesh, faces_of_families};
use idmesh::mover::{Design, MoveError, Mover, Outcome, Warning};
use idmesh::profile::cut::{Gap, Junctions, cut_at_planes, cut_at_planes_through_parts};
use idmesh::profile::{Plane, Profile, ProfileError};

const ATTACHED: Role = Role::Attached { coefficient: 0.5, start: TipStart::Rigid, junction: Junction::Glued };
const PYLON: [(&str, Role); 2] =
    [("pylon", ATTACHED), ("nacelle", Role::Rigid { motion: RigidMotion::Root, junction: Junction::Glued })];
const FAIRINGS: [(&str, Role); 2] = [("fairing_1", ATTACHED), ("fairing_2", ATTACHED)];

fn at_y(y: f64) -> Plane {
    Plane { point: DVec3::Y * y, normal: DVec3::Y }
}

/// The chord in a plane.
fn chord(y: f64) -> f64 {
    2.0 + (0.8 - 2.0) * y / 4.0
}

/// A point of the wing.
///
/// - `side`: 1 for the upper side, -1 for the lower one
/// - `x`: from the leading edge to the trailing edge, as a share of the chord
fn on_wing(y: f64, side: f64, x: f64) -> DVec3 {
    let section = |y: f64| {
        let mix = |root: f64, tip: f64| root + (tip - root) * y / 4.0;
        let (twist, thickness) = (mix(2.0, -1.0).to_radians(), mix(0.13, 0.105));
        let (m, p) = (0.018, 0.42);
        let root = 0.2969 * x.sqrt() - 0.1260 * x - 0.3516 * x.powi(2) + 0.2843 * x.powi(3) - 0.1036 * x.powi(4);
        let half = 5.0 * thickness * root + 0.5 * 0.015 * x;
        let camber = match x < p {
            true => m / p.powi(2) * (2.0 * p * x - x * x),
            false => m / (1.0 - p).powi(2) * (1.0 - 2.0 * p + 2.0 * p * x - x * x),
        };
        let (dx, dz) = ((x - 0.25) * chord(y), (camber + side * half) * chord(y));
        let quarter = DVec3::new(y * 24f64.to_radians().tan() + 0.25 * chord(y), y, -0.2 + y * 4f64.to_radians().tan());
        quarter + DVec3::new(dx * twist.cos() + dz * twist.sin(), 0.0, dz * twist.cos() - dx * twist.sin())
    };
    let at = section(0.05).lerp(section(4.0), (y - 0.05) / 3.95);
    DVec3::new(at.x, y, at.z)
}

/// Largest distance of points in a plane from the wing, in chords.
fn off_wing(y: f64, points: &[DVec3]) -> f64 {
    let side = |side: f64| (0..=400).map(move |k| on_wing(y, side, (f64::from(k) / 400.0).powi(2)));
    let around: Vec<DVec3> = side(-1.0).collect::<Vec<_>>().into_iter().rev().chain(side(1.0)).collect();
    let distance = |&at: &DVec3| {
        let to = around.windows(2).map(|ends| nearest_on_segment(at, ends[0], ends[1]).0.distance(at));
        to.fold(f64::INFINITY, f64::min)
    };
    points.iter().map(distance).fold(0.0, f64::max) / chord(y)
}

/// The sections of families, with the gaps at all others.
fn sections(mesh: &TetMesh, wing: &[&str], planes: &[f64]) -> Result<Vec<(Profile, Vec<Gap>)>, ProfileError> {
    let wing: Vec<FamilyId> = wing.iter().map(|name| mesh.family(name).unwrap()).collect();
    let junctions = Junctions::of_mesh(mesh.into(), &wing, |_| true);
    let planes: Vec<_> = (10..).zip(planes.iter().copied().map(at_y)).collect();
    cut_at_planes_through_parts(&mesh.vertices, &faces_of_families(mesh.into(), &wing), &planes, &junctions)
}

fn update(mover: &mut Mover, new: Vec<Profile>) -> Outcome {
    mover.update(&Design::of_wing("wing", new)).unwrap()
}

/// The sections are the wing's own as if there were no part: within 2e-4 of the chord, their
/// corners at the trailing edge to rounding, and with points all along the gap.
///
/// Fails with a cubic in place of the wing's sections beside the part: 7e-3.
#[test]
fn a_section_through_a_part_is_the_wings() {
    for (name, part, planes) in [
        ("nacelle", "pylon", &[1.575, 1.6, 1.62][..]),
        // At 1.2 and 2.405 the fairings do not reach the trailing edge, at 2.45 one is all round
        // it.
        ("fairings", "fairing", &[1.2, 1.25, 1.3, 2.405, 2.42, 2.45]),
    ] {
        let mesh = mesh(name);
        for (&y, (profile, gaps)) in planes.iter().zip(sections(&mesh, &["wing"], planes).unwrap()) {
            let off = off_wing(y, &profile.points);
            assert!(off < 2e-4, "{name} {y}: {off:e}");
            let ends = [profile.points[0], profile.points[profile.points.len() - 1]];
            for (end, side) in ends.into_iter().zip([-1.0, 1.0]) {
                assert!(end.distance(on_wing(y, side, 1.0)) < 1e-9, "{name} {y}: {end}");
            }
            assert!(!gaps.is_empty() && gaps.iter().all(|gap| gap.family.starts_with(part)), "{name} {y}: {gaps:?}");
            let longest = profile.points.windows(2).map(|pair| pair[0].distance(pair[1])).fold(0.0, f64::max);
            assert!(longest < 0.05 * chord(y) && gaps[0].length > 2.0 * longest, "{name} {y}: {longest} {gaps:?}");
            assert_eq!(gaps.len(), if y == 2.45 { 2 } else { 1 }, "{name} {y}");
        }
    }
}

/// Where the base of the trailing edge belongs to the wing, a section through the pylon is closed.
/// Through a fairing it has no lower corner: nothing is guessed there.
#[test]
fn a_closed_section_through_a_part_is_closed() {
    let (profile, gaps) = sections(&mesh("nacelle"), &["wing", "trailing_edge"], &[1.6]).unwrap().remove(0);
    assert_eq!(gaps.len(), 1);
    let points = &profile.points;
    assert_eq!(points[0], points[points.len() - 1]);
    assert!(points[0].distance(on_wing(1.6, -1.0, 1.0)) < 1e-9, "{}", points[0]);
    let upper = points.iter().position(|at| at.distance(on_wing(1.6, 1.0, 1.0)) < 1e-9).unwrap();
    let off = off_wing(1.6, &points[..=upper]);
    assert!(off < 2e-4 && upper > 100 && points.len() > upper + 2, "{off:e} {upper}");
    let refused = sections(&mesh("fairings"), &["wing", "trailing_edge"], &[1.25]).unwrap_err();
    assert!(refused.to_string().contains("`fairing_1`"), "{refused}");
}

/// A section that misses the parts has the bits of one that is cut without looking for them.
#[test]
fn a_section_beside_a_part_keeps_its_bits() {
    let mesh = mesh("fairings");
    let wing = faces_of_families((&mesh).into(), &[mesh.family("wing").unwrap()]);
    let planes = [0.8, 1.1, 2.0, 3.62];
    let plain = cut_at_planes(&mesh.vertices, &wing, &(10..).zip(planes.map(at_y)).collect::<Vec<_>>()).unwrap();
    let through = sections(&mesh, &["wing"], &planes).unwrap();
    assert!(through.iter().all(|(_, gaps)| gaps.is_empty()));
    assert_eq!(through.into_iter().map(|(profile, _)| profile).collect::<Vec<_>>(), plain);
}

/// Old profiles that miss the parts, and one through each part of a mesh.
fn with_parts(name: &str, mesh: &TetMesh) -> Vec<Profile> {
    let planes: &[f64] = if name == "nacelle" { &[1.6] } else { &[1.25, 2.45] };
    let mut old = profiles(name, "old");
    // The pylon's own station has a profile in the file already, cut by another program.
    old.retain(|profile| planes.iter().all(|y| (profile.points[0].y - y).abs() > 1e-6));
    old.extend(sections(mesh, &["wing"], planes).unwrap().into_iter().map(|(profile, _)| profile));
    old
}

/// A smooth change that no affine map of the sections is: bent, thicker and more cambered.
fn changed(at: DVec3) -> DVec3 {
    let outward = at.y / 4.0;
    let along = (at.x - at.y * 24f64.to_radians().tan()) / chord(at.y);
    let middle = -0.2 + at.y * 4f64.to_radians().tan();
    let camber = 0.02 * chord(at.y) * along * (1.0 - along) * outward;
    DVec3::new(at.x + 0.03 * outward, at.y, middle + (at.z - middle) * (1.0 + 0.2 * outward) + 0.2 * outward + camber)
}

/// Unchanged profiles move nothing, to the last bit. Changed ones move the wing as those move it
/// that miss the parts, and a warning names the parts.
#[test]
fn profiles_through_parts_move_the_wing_alike() {
    for (name, parts, families) in
        [("nacelle", &PYLON, &["pylon"][..]), ("fairings", &FAIRINGS, &["fairing_1", "fairing_2"])]
    {
        let mesh = mesh(name);
        let moved = |old: &[Profile]| -> Vec<Profile> {
            let points = |old: &Profile| old.points.iter().map(|&at| changed(at)).collect();
            old.iter().map(|old| Profile { number: old.number, points: points(old) }).collect()
        };
        let (beside, through) = (profiles(name, "old"), with_parts(name, &mesh));
        let mut mover = builder(mesh.clone(), through.clone(), parts).build(cpu()).unwrap();
        let still = update(&mut mover, through.clone());
        assert_eq!(still.vertices(), mesh.vertices, "{name}");
        let outcome = update(&mut mover, moved(&through));
        outcome.check().unwrap_or_else(|refused| panic!("{name}: {refused}"));
        let found: Vec<&str> = outcome
            .warnings
            .iter()
            .filter_map(|warning| match warning {
                Warning::Bridged { wing, gaps } if wing == "wing" => Some(gaps),
                _ => None,
            })
            .flatten()
            .map(|(_, gap)| gap.family.as_str())
            .collect();
        assert!(families.iter().all(|family| found.contains(family)), "{name}: {found:?}");
        let mut other = builder(mesh.clone(), beside.clone(), parts).build(cpu()).unwrap();
        let reference = update(&mut other, moved(&beside));
        assert!(!reference.warnings.iter().any(|warning| matches!(warning, Warning::Bridged { .. })), "{name}");
        let off = |outcome: &Outcome| {
            let wing = vertices_of(&mesh, "wing").into_iter().filter(|&vertex| {
                let y = mesh.vertices[vertex].y;
                (0.8..3.62).contains(&y)
            });
            let off = |vertex: usize| outcome.vertices()[vertex].distance(changed(mesh.vertices[vertex]));
            wing.map(|vertex| off(vertex) / chord(mesh.vertices[vertex].y)).fold(0.0, f64::max)
        };
        // A part of a degree-2 change along the span remains, which more profiles only make
        // smaller.
        assert!(off(&outcome) <= 1.05 * off(&reference) + 1e-4, "{name}: {:e} {:e}", off(&outcome), off(&reference));
        let report = &outcome.profiles["wing"];
        assert!(report.not_measured.is_none() && report.max_distance_to_new_profiles.unwrap() < 0.01, "{report:?}");
        let sections = &outcome.sections["wing"];
        assert_eq!(sections.len(), through.len(), "{name}");
    }
}

/// The wing in an upper and a lower family.
fn in_halves(name: &str) -> TetMesh {
    let mut mesh = mesh(name);
    let (wing, lower) = (mesh.family("wing").unwrap(), FamilyId(mesh.families.len() as u16));
    mesh.families.push("lower".to_owned());
    for (triangle, family) in mesh.triangles.iter().zip(&mut mesh.triangle_family) {
        if *family != wing {
            continue;
        }
        let at = triangle.iter().map(|&vertex| mesh.vertices[vertex as usize]).sum::<DVec3>() / 3.0;
        let sides = [-1.0, 1.0].map(|side| {
            let all = (0..=400).map(|k| on_wing(at.y, side, (f64::from(k) / 400.0).powi(2)).distance(at));
            all.fold(f64::INFINITY, f64::min)
        });
        if sides[0] < sides[1] {
            *family = lower;
        }
    }
    mesh
}

/// Half a wing has no section, and the other half is no part to bridge.
#[test]
fn half_a_wing_is_refused() {
    let mesh = in_halves("fairings");
    assert!(sections(&mesh, &["wing", "lower"], &[1.7]).is_ok());
    for half in ["wing", "lower"] {
        for y in [0.8, 1.25, 1.7, 2.45, 3.9] {
            match sections(&mesh, &[half], &[y]) {
                Err(error @ (ProfileError::CutShort { .. } | ProfileError::Pieces { .. } | ProfileError::Gap(_))) => {
                    let other = if half == "wing" { "`lower`" } else { "`wing`" };
                    let message = error.to_string();
                    assert!(message.contains(other) || message.contains("`fairing_"), "{half} {y}: {message}");
                }
                other => panic!("{half} {y}: {other:?}"),
            }
        }
    }
    // A profile of one side, in a file.
    let side = |number: i64, y: f64| {
        let points = (0..=60).map(|k| on_wing(y, 1.0, (f64::from(k) / 60.0).powi(2))).collect();
        Profile { number, points }
    };
    let refused = builder(crate::mesh("fairings"), vec![side(0, 0.8), side(1, 3.62)], &FAIRINGS).build(cpu()).err();
    match refused {
        Some(MoveError::Setup(SetupError::Profiles {
            family,
            error: ProfileError::ProfileCutShort { profile: 0, .. },
        })) => {
            assert_eq!(family, "wing");
        }
        other => panic!("{other:?}"),
    }
}

/// A panel of the wing that is no family of it, a part that has the leading edge or the trailing
/// edge in it, and one that takes most of one side.
#[test]
fn what_cannot_be_guessed_is_refused() {
    let panel = |along: std::ops::Range<f64>, span: std::ops::Range<f64>, sides: &[f64]| {
        let mut mesh = mesh("nacelle");
        let wing = ["wing", "trailing_edge"].map(|name| mesh.family(name).unwrap());
        let own = FamilyId(mesh.families.len() as u16);
        mesh.families.push("panel".to_owned());
        for (triangle, family) in mesh.triangles.iter().zip(&mut mesh.triangle_family) {
            let at = triangle.iter().map(|&vertex| mesh.vertices[vertex as usize]).sum::<DVec3>() / 3.0;
            let x = (at.x - on_wing(at.y, 1.0, 0.0).x) / chord(at.y);
            let upper = on_wing(at.y, 1.0, x.clamp(0.0, 1.0)).z;
            let lower = on_wing(at.y, -1.0, x.clamp(0.0, 1.0)).z;
            let side = if (at.z - upper).abs() < (at.z - lower).abs() { 1.0 } else { -1.0 };
            if wing.contains(family) && along.contains(&x) && span.contains(&at.y) && sides.contains(&side) {
                *family = own;
            }
        }
        mesh
    };
    let refused = |mesh: TetMesh, why: &str| match sections(&mesh, &["wing", "trailing_edge"], &[2.5]) {
        Err(error @ (ProfileError::Gap(_) | ProfileError::CutShort { .. })) => {
            let message = error.to_string();
            assert!(message.contains("`panel`") && message.contains(why), "{why}: {message}");
        }
        other => panic!("{why}: {other:?}"),
    };
    let part = 2.3..2.7;
    assert!(sections(&panel(0.2..0.7, part.clone(), &[1.0]), &["wing", "trailing_edge"], &[2.5]).is_ok());
    refused(panel(0.2..0.7, 1.9..3.5, &[1.0]), "as a panel of the wing is");
    refused(panel(0.1..0.9, part.clone(), &[1.0]), "% of the section's length");
    refused(panel(-0.1..0.1, part.clone(), &[-1.0, 1.0]), "the leading or the trailing edge is in it");
    refused(panel(0.6..1.1, part.clone(), &[-1.0, 1.0]), "the leading or the trailing edge is in it");
    match sections(&panel(-0.1..0.1, part.clone(), &[-1.0, 1.0]), &["wing"], &[2.5]) {
        Err(ProfileError::Gap(gap)) => {
            assert_eq!((&*gap.family, &*gap.why), ("panel", "it is no gap of one side alone"))
        }
        other => panic!("{other:?}"),
    }
    // Another wing is no part, whatever it covers.
    let mesh = panel(0.2..0.7, part, &[1.0]);
    let wing = [mesh.family("wing").unwrap()];
    let junctions = Junctions::of_mesh((&mesh).into(), &wing, |family| mesh.families[family.index()] != "panel");
    let faces = faces_of_families((&mesh).into(), &wing);
    let refused = cut_at_planes_through_parts(&mesh.vertices, &faces, &[(0, at_y(2.5))], &junctions).unwrap_err();
    assert!(matches!(&refused, ProfileError::Gap(gap) if gap.family == "panel"), "{refused}");
}

/// A profile in a file that ends at a fairing does not say what lies beyond.
#[test]
fn a_profile_that_ends_at_a_part_is_refused() {
    let mesh = mesh("fairings");
    let mut old = with_parts("fairings", &mesh);
    let cut = old.iter_mut().find(|profile| (profile.points[0].y - 1.25).abs() < 1e-9).unwrap();
    let number = cut.number;
    cut.points.retain(|at| at.z > on_wing(1.25, -1.0, 0.5).z.max(-1.0) || at.x < on_wing(1.25, -1.0, 0.5).x);
    let from = cut.points.iter().position(|at| at.x < on_wing(1.25, -1.0, 0.5).x).unwrap();
    cut.points.drain(..from);
    match builder(mesh, old, &FAIRINGS).build(cpu()).err() {
        Some(MoveError::Setup(SetupError::Profiles {
            error: ProfileError::ProfileCutShort { profile, .. }, ..
        })) => {
            assert_eq!(profile, number);
        }
        other => panic!("{other:?}"),
    }
}

/// A base 40 % thinner: the arcs of the trailing edge on the fairings go with both of its sides.
///
/// Fails if the arcs start from the springs alone: the surface passes through itself.
#[test]
fn a_trailing_edge_between_fairings_becomes_thinner() {
    let mesh = mesh("fairings");
    let old = profiles("fairings", "old");
    let mut mover = builder(mesh.clone(), old.clone(), &FAIRINGS).build(cpu()).unwrap();
    let factor = 0.6;
    let thinner = |profile: &Profile| {
        let nose = profile.points.iter().copied().reduce(|a, b| if b.x < a.x { b } else { a }).unwrap();
        let thin = |at: &DVec3| DVec3::new(at.x, at.y, nose.z + (at.z - nose.z) * factor);
        Profile { number: profile.number, points: profile.points.iter().map(thin).collect() }
    };
    let outcome = update(&mut mover, old.iter().map(thinner).collect());
    outcome.check().unwrap_or_else(|refused| panic!("{factor}: {refused}"));
    assert!(outcome.folded.is_empty() && outcome.stages.last().unwrap().beta_min > 0.008, "{factor}");
    // The fairing's arc keeps its share of the base's height.
    let edge = vertices_of(&mesh, "trailing_edge");
    let arc = vertices_of(&mesh, "fairing_1").into_iter().filter(|vertex| edge.binary_search(vertex).is_ok());
    for vertex in arc {
        let (from, to) = (mesh.vertices[vertex], outcome.vertices()[vertex]);
        let share = |at: DVec3, factor: f64| {
            let nose = on_wing(from.y, 1.0, 0.0).z;
            let [low, high] = [-1.0, 1.0].map(|side| nose + (on_wing(from.y, side, 1.0).z - nose) * factor);
            (at.z - low) / (high - low)
        };
        assert!((share(from, 1.0) - share(to, factor)).abs() < 0.03, "{factor}: {from} {to}");
    }
}

/// What an old profile has in a gap is a guess, as the bridge is: 2 % of the length off the bridge
/// is as good. 5 % off is another wing.
///
/// Fails if `IN_GAP` is 0.003 or 0.3.
#[test]
fn a_profile_may_guess_otherwise_in_a_gap() {
    let mesh = mesh("nacelle");
    let old = with_parts("nacelle", &mesh);
    let on_pylon = vertices_of(&mesh, "pylon");
    let rim: Vec<f64> = vertices_of(&mesh, "wing")
        .into_iter()
        .filter(|vertex| on_pylon.binary_search(vertex).is_ok())
        .map(|vertex| mesh.vertices[vertex].x)
        .collect();
    let [from, to] = [rim.iter().copied().fold(f64::INFINITY, f64::min), rim.iter().copied().fold(0.0, f64::max)];
    let with = |share: f64| {
        let mut old = old.clone();
        let through = old.iter_mut().find(|profile| (profile.points[0].y - 1.6).abs() < 1e-9).unwrap();
        let mut moved = 0;
        for at in &mut through.points {
            let along = (at.x - from) / (to - from);
            let x = (at.x - on_wing(1.6, 1.0, 0.0).x) / chord(1.6);
            let is_lower = at.distance(on_wing(1.6, -1.0, x.clamp(0.0, 1.0))) < 0.03;
            if is_lower && (0.0..1.0).contains(&along) {
                at.z -= share * chord(1.6) * (std::f64::consts::PI * along).sin().powi(2);
                moved += 1;
            }
        }
        assert!(moved > 10, "{moved}");
        builder(mesh.clone(), old, &PYLON).build(cpu()).err()
    };
    assert!(with(0.02).is_none(), "{:?}", with(0.02));
    match with(0.05) {
        Some(MoveError::Setup(SetupError::Profiles { error: ProfileError::OffWing { share, .. }, .. })) => {
            assert!((0.01..0.06).contains(&share), "{share}");
        }
        other => panic!("{other:?}"),
    }
}
