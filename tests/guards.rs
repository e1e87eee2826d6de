//! No stage can break the mesh unseen: each is made to, on purpose, and the result is refused.

#[path = "common/aircraft.rs"]
#[allow(dead_code, reason = "only a part is used here")]
mod aircraft;
#[path = "common/faults.rs"]
#[allow(dead_code, reason = "only a part is used here")]
mod faults;

use std::collections::BTreeSet;

use aircraft::{Anyway, SMALL, triangles_of, vertices_of};
use glam::DVec3;
use idmesh::mesh::TetMesh;
use idmesh::mover::{Design, FaultKind, Mover, Outcome};

/// Moves to the set `big`, with vertices put elsewhere once a stage has ended.
fn update(mover: &mut Mover, stage: &str, put: &[(usize, DVec3)]) -> Outcome {
    let design = Design::of_wing("wing", SMALL.profiles("big_2"));
    let original = mover.mesh().vertices.clone();
    let mut stages = Vec::new();
    let mut amend = |ended: &str, motion: &mut Vec<DVec3>| {
        stages.push(ended.to_owned());
        if ended == stage {
            put.iter().for_each(|&(vertex, by)| motion[vertex] += by);
        }
        assert_eq!(motion.len(), original.len());
    };
    let outcome = mover.update_amended(&design, &mut amend).unwrap();
    assert_eq!(stages, ["wing", "trailing edge", "rigid", "attached", "carenage", "planes", "volume"]);
    outcome
}

/// A vertex of this family and no other, and a way for it across one of its triangles and as far
/// again beyond: that turns the triangle over.
fn across(mesh: &TetMesh, family: &str) -> (usize, DVec3) {
    let others: BTreeSet<usize> =
        mesh.families.iter().filter(|name| *name != family).flat_map(|name| vertices_of(mesh, name)).collect();
    let own = |vertex: &usize| !others.contains(vertex);
    let triangles = triangles_of(mesh, family);
    // All three vertices inside the family, the vertex and those of the edge it crosses.
    let triangle = triangles.iter().find(|triangle| triangle.iter().all(own));
    let triangle = triangle.unwrap_or_else(|| triangles.iter().find(|triangle| triangle.iter().any(own)).unwrap());
    let first = triangle.iter().position(own).unwrap();
    let [at, b, c] = [0, 1, 2].map(|k| mesh.vertices[triangle[(first + k) % 3]]);
    (triangle[first], 2.0 * (0.5 * (b + c) - at))
}

/// What breaks nothing is not refused, or the guards would be of no use.
///
/// Fails if, of `carry`, `FAR` is 40, all `NEARER` are 1, or `ALIKE` is 1.02; if `REACH` of the
/// wing is 0.1, `SAME_FORM` 1e-2, or `MOST_ROUNDS` 1.
#[test]
fn an_untouched_update_is_good() {
    let outcome = update(&mut SMALL.mover(2), "none", &[]);
    assert!(outcome.is_valid() && outcome.converged);
    assert!(outcome.folds.is_empty() && outcome.folded.is_empty() && outcome.off_surface.is_empty());
}

#[test]
fn a_triangle_turned_over_by_a_surface_stage_is_refused() {
    let mut mover = SMALL.mover(2);
    let broken = [
        ("wing", "wing"),
        ("trailing edge", "trailing_edge"),
        ("attached", "wingtip"),
        ("carenage", "carenage"),
        ("planes", "symmetry"),
    ];
    for (stage, family) in broken {
        let fault = across(mover.mesh(), family);
        let outcome = update(&mut mover, stage, &[fault]);
        // The volume stage lets the vertices of planes slide on: there it undoes the fault.
        let repaired = stage == "planes";
        assert_eq!(outcome.is_valid(), repaired, "{stage}: {} inverted", outcome.inverted);
        assert_eq!(faults::inverted(mover.mesh(), outcome.vertices()).len(), outcome.inverted, "{stage}");
        let (first, count) = outcome.folds[0];
        assert!(first == stage && count > 0, "{stage}: {:?}", outcome.folds);
        assert_eq!(outcome.folded.contains_key(family), !repaired, "{stage}: {:?}", outcome.folded);
        assert!(outcome.stages[2].inverted > 0, "{stage}");
    }
}

#[test]
fn a_tet_turned_over_in_the_end_is_refused() {
    let mut mover = SMALL.mover(2);
    let mesh = mover.mesh();
    let surface: BTreeSet<usize> = mesh.families.iter().flat_map(|name| vertices_of(mesh, name)).collect();
    let tet = *mesh.tets.iter().find(|tet| !surface.contains(&(tet[0] as usize))).unwrap();
    let [at, b, c, d] = tet.map(|vertex| mesh.vertices[vertex as usize]);
    let fault = (tet[0] as usize, 2.0 * ((b + c + d) / 3.0 - at));
    let outcome = update(&mut mover, "volume", &[fault]);
    assert!(!outcome.is_valid() && outcome.inverted > 0);
    assert_eq!(faults::inverted(mover.mesh(), outcome.vertices()).len(), outcome.inverted);
    assert_eq!(outcome.stages[3].inverted, outcome.inverted);
    let fault = &outcome.check().unwrap_err().faults[0];
    assert_eq!((fault.kind, fault.count), (FaultKind::Inverted, outcome.inverted));
    let at = DVec3::from_array(fault.place.as_ref().unwrap().at);
    assert!(at.distance(outcome.vertices()[tet[0] as usize]) < 1.0, "{at}");
}

/// A ten thousandth of a chord, which inverts nothing. A hundred millionth is rounding.
///
/// Fails if `OFF_SURFACE` is 0.1 or 1e-12.
#[test]
fn a_vertex_that_leaves_its_surface_is_refused() {
    let mut mover = SMALL.mover(2);
    for (stage, family) in
        [("carenage", "carenage"), ("volume", "carenage"), ("planes", "symmetry"), ("volume", "symmetry")]
    {
        let (vertex, _) = across(mover.mesh(), family);
        let outcome = update(&mut mover, stage, &[(vertex, DVec3::new(0.0, 2e-4, 2e-4))]);
        assert_eq!(outcome.inverted, 0, "{stage}");
        assert!(!outcome.is_valid(), "{stage} {family}");
        assert_eq!(outcome.off_surface.keys().collect::<Vec<_>>(), [family], "{stage}");
        // The fault names the one vertex, also where no tet is inverted.
        let deviation = outcome.off_surface[family];
        assert_eq!((deviation.vertices, deviation.vertex), (1, vertex), "{stage}");
        let fault = &outcome.check().unwrap_err().faults[0];
        assert_eq!((fault.kind, fault.count), (FaultKind::OffSurface, 1), "{stage}");
        let place = fault.place.as_ref().unwrap();
        assert_eq!(
            (place.at, place.family.as_deref()),
            (outcome.vertices()[vertex].to_array(), Some(family)),
            "{stage}"
        );
        if stage == "volume" {
            assert!(update(&mut mover, stage, &[(vertex, DVec3::new(0.0, 1e-8, 1e-8))]).is_valid(), "{family}");
        }
    }
}

/// Half a percent of the chord is more than a wing may miss its profile by, along the span it may
/// go far.
///
/// Fails if `MISSED` is 0.02 or 1e-5.
#[test]
fn a_wing_that_misses_its_profile_is_refused() {
    let mut mover = SMALL.mover(2);
    let mesh = mover.mesh();
    let inside = |vertex: usize| {
        !["carenage", "trailing_edge", "wingtip"].iter().any(|name| vertices_of(mesh, name).contains(&vertex))
    };
    // Beside the profile in the plane y = 1, whose chord is 1.7.
    let beside =
        vertices_of(mesh, "wing").into_iter().filter(|&v| inside(v) && (0.9..1.1).contains(&mesh.vertices[v].y));
    let put = |by: DVec3| beside.clone().map(|vertex| (vertex, by)).collect::<Vec<_>>();
    let (up, along) = (put(0.0085 * DVec3::Z), put(0.0085 * DVec3::Y));
    assert!(up.len() > 5);
    let outcome = update(&mut mover, "planes", &up);
    let missed = outcome.missed["wing"];
    assert!(!outcome.is_valid() && missed.profile == 0 && (0.002..0.006).contains(&missed.share), "{missed:?}");
    assert!(up.iter().any(|&(vertex, _)| vertex == missed.vertex));
    let faults = outcome.check().unwrap_err().faults;
    assert!(faults.iter().any(|fault| fault.kind == FaultKind::MissedProfiles && fault.count == 1), "{faults:?}");
    assert!(update(&mut mover, "planes", &along).missed.is_empty());
}
