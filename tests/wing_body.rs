//! Whole runs on half aircraft: every design leaves a valid mesh, true to its new profiles and to
//! its other surfaces.

mod common;

use common::aircraft::*;
use common::faults::*;
use glam::DVec3;
use idmesh::families::{Junction, Role, TipStart};
use idmesh::mesh::FamilyId;
use idmesh::mover::{FaultKind, Mover, Outcome};
use idmesh::profile::Profile;
use idmesh::smoothing::QualityTarget;

const SETS: [&str; 3] = ["small", "big", "planform"];
/// Springs keep the mean shape of the tets: mean beta stays within this share of the original's.
const MEAN_BETA: f64 = 0.02;

fn chord(profile: &Profile) -> f64 {
    let x = || profile.points.iter().map(|point| point.x);
    x().fold(f64::NEG_INFINITY, f64::max) - x().fold(f64::INFINITY, f64::min)
}

/// Moves to a design and checks all that must hold after any.
fn check(aircraft: Aircraft, mover: &mut Mover, set: &str) -> Outcome {
    let new = aircraft.profiles(set);
    let outcome = update(mover, new.clone());
    let mesh = mover.mesh();
    assert!(outcome.converged, "{set}: {:?}", outcome.unconverged);
    assert_eq!(faults(mesh, outcome.vertices()), [], "{set}");
    assert_eq!(outcome.inverted, 0, "{set}");
    assert!(outcome.folded.is_empty(), "{set}: {:?}", outcome.folded);
    assert!(outcome.is_valid(), "{set}: {} self-intersecting", outcome.self_intersecting.len());

    let [original, .., last] = &outcome.stages[..] else { panic!("{set}: no stages") };
    let ratio = last.beta_mean / original.beta_mean;
    assert!((ratio - 1.0).abs() < MEAN_BETA, "{set}: mean beta changed by a factor of {ratio}");
    // The report's figures are those of the mesh.
    let mean = outcome.beta.iter().sum::<f64>() / mesh.tets.len() as f64;
    assert_eq!((outcome.beta.len(), last.inverted), (mesh.tets.len(), 0));
    assert!((mean - last.beta_mean).abs() < 1e-12);
    let off = outcome.families["carenage"].max_distance_to_original_surface.unwrap();
    assert!(off <= 1e-9 * size(mesh), "{set}: {off:e} off the fuselage");
    let off = outcome.families["symmetry"].max_distance_to_plane.unwrap();
    assert!(off <= 1e-12 * size(mesh), "{set}: {off:e} off the symmetry plane");

    // From the wing's sections to the profiles, and from the profiles to the wing's triangles.
    let shortest = new.iter().map(chord).fold(f64::INFINITY, f64::min);
    let off = outcome.profiles["wing"].max_distance_to_new_profiles.unwrap() / shortest;
    assert!(off <= aircraft.section_tolerance, "{set}: a section of the wing is {off:e} chords off its profile");
    let wing = triangles_of(mesh, "wing");
    for profile in &new {
        let distances = profile.points.iter().map(|&point| distance_to(point, &wing, outcome.vertices()));
        let off = distances.max_by(f64::total_cmp).unwrap() / chord(profile);
        let number = profile.number;
        assert!(off <= aircraft.facet_tolerance, "{set}: profile {number} is {off:e} chords off the wing");
    }
    outcome
}

fn check_all(aircraft: Aircraft, planes: usize) {
    let mut mover = aircraft.mover(planes);
    for set in SETS {
        check(aircraft, &mut mover, &format!("{set}_{planes}"));
    }
}

#[test]
fn small_aircraft() {
    check_all(SMALL, 2);
}

#[test]
fn wing_body_with_two_profiles() {
    check_all(WING_BODY, 2);
}

#[test]
fn wing_body_with_five_profiles() {
    check_all(WING_BODY, 5);
}

#[test]
fn rounded_wingtip() {
    check_all(ROUND, 2);
}

/// The set was scaled so that moving the wing's vertices alone inverts 17.75 % of the tets (17
/// 338), as in the paper; how the displacement is interpolated changes that by some percent.
/// Without the other stages the mesh is lost.
#[test]
fn the_wing_alone_inverts_a_sixth_of_the_tets() {
    let mut mover = WING_BODY.mover(2);
    let outcome = update(&mut mover, WING_BODY.profiles("big_2"));
    let inverted = outcome.stages[1].inverted;
    assert!((16_000..18_500).contains(&inverted), "{inverted}");
    let sign_changes = outcome.original_beta.iter().zip(&outcome.beta).filter(|(a, b)| (**a > 0.0) != (**b > 0.0));
    assert_eq!(sign_changes.count(), 0);
}

/// With `old` left out of a case the old profiles are cut from the wing at the new ones' planes.
#[test]
fn cut_profiles_serve_as_well_as_given_ones() {
    use idmesh::profile::{Plane, cut};
    let mesh = WING_BODY.mesh();
    let new = WING_BODY.profiles("big_2");
    let planes: Vec<_> = new.iter().map(|p| (p.number, Plane::of_profile(p).unwrap())).collect();
    let wing: Vec<_> = triangles_of(&mesh, "wing").into_iter().map(|t| t.map(|vertex| vertex as u32)).collect();
    let old = cut::cut_at_planes(&mesh.vertices, &wing, &planes).unwrap();
    let cut = check(WING_BODY, &mut builder(mesh, old).build(cpu()).unwrap(), "big_2");
    let given = update(&mut WING_BODY.mover(2), new.clone());
    // The given ones are cut from facets, those cut here are what the vertices say: they differ by
    // the facets' sag.
    common::compare(given.vertices(), cut.vertices(), 2e-3 * chord(&new[0])).unwrap();
}

// ---- the checks themselves ----

#[test]
fn each_fault_is_seen() {
    let mesh = SMALL.mesh();
    assert_eq!(faults(&mesh, &mesh.vertices), []);
    let words = |vertex: usize, to: DVec3| {
        let mut moved = mesh.vertices.clone();
        moved[vertex] = to;
        let found = faults(&mesh, &moved);
        found.into_iter().map(|(word, _)| word).collect::<Vec<_>>()
    };
    let one_of = |family: &str, not_of: &[&str]| {
        let others: Vec<usize> = not_of.iter().flat_map(|other| vertices_of(&mesh, other)).collect();
        vertices_of(&mesh, family).into_iter().find(|vertex| !others.contains(vertex)).unwrap()
    };
    let next_up = |x: f64| f64::from_bits(x.to_bits() + 1);
    let vertex = one_of("farfield", &["symmetry"]);
    let at = mesh.vertices[vertex];
    assert_eq!(words(vertex, at.with_z(next_up(at.z))), ["farfield"]);
    let vertex = one_of("symmetry", &["farfield", "carenage"]);
    let at = mesh.vertices[vertex];
    assert_eq!(words(vertex, at.with_y(next_up(at.y))), ["symmetry"]);
    assert_eq!(words(vertex, at.with_x(at.x + 1e-9)), [] as [&str; 0]);
    let vertex = one_of("carenage", &["symmetry", "wing", "trailing_edge"]);
    let at = mesh.vertices[vertex];
    assert_eq!(words(vertex, at + 5e-4 * DVec3::new(0.0, at.y, at.z).normalize()), ["fuselage"]);
    // Where the wing stood the cylinder counts, and the facets beside it lie up to 0.02 inside.
    let root: Vec<usize> = junction(&mesh).into_iter().flatten().collect();
    let middle = root.iter().map(|&vertex| mesh.vertices[vertex]).sum::<DVec3>() / root.len() as f64;
    let around = DVec3::new(0.0, middle.y, middle.z).normalize();
    let on_cylinder = middle.with_y(0.0).with_z(0.0) + 0.5 * around;
    assert!(!words(root[0], on_cylinder).contains(&"fuselage"));
    assert!(words(root[0], on_cylinder + 0.03 * around).contains(&"fuselage"));
    assert!(words(root[0], on_cylinder - 0.03 * around).contains(&"fuselage"));
    // Through the tet opposite: inverted, and its own triangles are folded.
    let wing = one_of("wing", &["carenage", "wingtip", "trailing_edge"]);
    let far = mesh.vertices[one_of("farfield", &["symmetry"])];
    assert!(words(wing, -far).starts_with(&["inverted", "folded"]));
    assert_eq!(words(wing, DVec3::NAN), ["inverted", "folded"]);
}

#[test]
fn distance_to_triangles_is_that_to_their_nearest_point() {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
    for (at, distance) in [
        (DVec3::new(0.25, 0.25, -0.5), 0.5),
        (DVec3::new(-3.0, 0.5, 4.0), 5.0),
        (DVec3::new(1.0, 1.0, 0.0), 0.5f64.sqrt()),
        (DVec3::new(5.0, -3.0, 0.0), 5.0),
    ] {
        common::assert_close(distance_to(at, &[[0, 1, 2]], &corners), distance, 4.0 * f64::EPSILON);
    }
}

/// Springs alone leave 0.66 of the original's worst beta here: that calls for local optimisation,
/// which repairs it without touching a surface.
///
/// Fails if `ENOUGH` is 0.2, and if `IMPROVED` is 10.
#[test]
fn local_optimisation_repairs_what_springs_leave() {
    let worst = |beta: &[f64]| beta.iter().copied().fold(f64::INFINITY, f64::min);
    let run = |quality| {
        let builder = ROUND.builder(ROUND.profiles("old_2")).quality(quality);
        update(&mut builder.build(cpu()).unwrap(), ROUND.profiles("big_2"))
    };
    let (springs, repaired, improved) =
        (run(None), run(Some(QualityTarget::Original)), run(Some(QualityTarget::Improve)));
    let original = worst(&springs.original_beta);
    assert!(worst(&springs.beta) < 0.75 * original && springs.smoothed.is_none());
    assert!(worst(&repaired.beta) >= 0.99 * original && repaired.inverted == 0);
    assert!(worst(&improved.beta) >= 1.2 * original && improved.inverted == 0);
    let mesh = ROUND.mesh();
    for family in ["wing", "trailing_edge", "wingtip", "carenage", "farfield"] {
        for vertex in vertices_of(&mesh, family) {
            assert_eq!(repaired.vertices()[vertex], springs.vertices()[vertex], "{family}");
        }
    }
}

/// A collar of a family of its own parts a wing and its fuselage but for one vertex. A junction of
/// a single vertex has no chord, so what it misses is compared with the wing: rounding is no fault,
/// and a line along the span that misses the fuselage is one.
///
/// Fails if such a junction has a chord of zero length.
#[test]
fn a_junction_may_be_a_single_vertex() {
    let mut mesh = SMALL.mesh();
    let wing = vertices_of(&mesh, "wing");
    let fuselage = vertices_of(&mesh, "carenage");
    let junction: Vec<usize> = wing.into_iter().filter(|vertex| fuselage.binary_search(vertex).is_ok()).collect();
    let of_fuselage = triangles_of(&mesh, "carenage");
    let on_junction = |triangle: &[usize; 3]| triangle.iter().filter(|vertex| junction.contains(vertex)).count();
    // A vertex of the upper or lower side with a triangle of its own on the fuselage.
    let single = |vertex: &&usize| {
        let mut own = of_fuselage.iter().filter(|triangle| triangle.contains(vertex));
        let edge = vertices_of(&mesh, "trailing_edge");
        edge.binary_search(vertex).is_err() && own.any(|triangle| on_junction(triangle) == 1)
    };
    let single = *junction.iter().find(single).unwrap();
    let (carenage, collar) = (mesh.family("carenage").unwrap(), FamilyId(mesh.families.len() as u16));
    mesh.families.push("collar".to_owned());
    for (triangle, family) in mesh.triangles.iter().zip(&mut mesh.triangle_family) {
        let touches = |vertex: &u32| *vertex as usize != single && junction.contains(&(*vertex as usize));
        if *family == carenage && triangle.iter().any(touches) {
            *family = collar;
        }
    }
    let collar = Role::Attached { coefficient: 0.5, start: TipStart::Rigid, junction: Junction::Glued };
    let mut mover = builder(mesh, SMALL.profiles("old_2")).role("collar", collar).build(cpu()).unwrap();
    let rise = |by: f64| {
        let mut new = SMALL.profiles("old_2");
        new.iter_mut().for_each(|profile| profile.points.iter_mut().for_each(|at| at.z += by));
        new
    };
    for by in [1e-3, -2e-3, 5e-3] {
        let outcome = update(&mut mover, rise(by));
        assert!(outcome.displacement()[single].length() > 0.5 * by.abs());
        assert!(outcome.missed_surfaces.is_empty(), "{by}: {:?}", outcome.missed_surfaces);
    }
    let outcome = update(&mut mover, rise(2.0));
    let missed = outcome.missed_surfaces["wing"];
    assert_eq!((missed.vertex as usize, missed.vertices), (single, 1));
    assert!(missed.of_chord > 0.05 && missed.of_chord < 1.0, "{missed:?}");
    assert!(outcome.check().unwrap_err().faults.iter().any(|fault| fault.kind == FaultKind::MissedSurface));
}
