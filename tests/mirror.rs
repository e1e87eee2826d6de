//! A full aircraft made of a half and its mirror image: both halves move alike.

mod common;

use common::aircraft::{Aircraft, Anyway, SMALL, WING_BODY, builder, cpu, role, triangles_of, vertices_of};
use common::parts::{mesh, profiles, rigid};
use glam::DVec3;
use idmesh::families::{Junction, RigidMotion, Role, TipStart};
use idmesh::mesh::{FamilyId, TetMesh};
use idmesh::mover::{Design, Mover, MoverBuilder, Outcome};
use idmesh::profile::{Plane, Profile};
use idmesh::relaxation::Stopping;

const LEFT: f64 = -1.0;

fn mirrored(at: DVec3) -> DVec3 {
    DVec3::new(at.x, LEFT * at.y, at.z)
}

fn left(profiles: &[Profile]) -> Vec<Profile> {
    let points = |profile: &Profile| profile.points.iter().map(|&at| mirrored(at)).collect();
    profiles.iter().map(|profile| Profile { number: profile.number, points: points(profile) }).collect()
}

fn symmetry() -> Plane {
    Plane { point: DVec3::ZERO, normal: DVec3::Y }
}

/// The whole aircraft of a half one, joined in the symmetry plane y = 0; the twin of each vertex.
/// The left halves of some families are families of their own, `NAME_left`.
///
/// The left half has another order of vertices and triangles than the right one, and its triangles
/// begin with other corners.
fn whole(half: &TetMesh, sided: &[&str]) -> (TetMesh, Vec<u32>) {
    let n = half.vertices.len() as u32;
    let mut vertices = half.vertices.clone();
    let mut twin: Vec<u32> = (0..n).collect();
    for (twin, at) in twin.iter_mut().zip(&half.vertices).rev() {
        if at.y.abs() > 1e-9 {
            *twin = vertices.len() as u32;
            vertices.push(mirrored(*at));
        }
    }
    let of_plane = half.family("symmetry").unwrap();
    let mut families = half.families.clone();
    let mut left: Vec<FamilyId> = (0..families.len() as u16).map(FamilyId).collect();
    for family in sided {
        left[half.family(family).unwrap().index()] = FamilyId(families.len() as u16);
        families.push(format!("{family}_left"));
    }
    let mut mesh = TetMesh { vertices, families, ..half.clone() };
    let all = half.triangles.iter().zip(&half.triangle_family).filter(|(_, family)| **family != of_plane);
    let (triangles, of): (Vec<_>, Vec<_>) = all.clone().map(|(triangle, family)| (*triangle, *family)).unzip();
    (mesh.triangles, mesh.triangle_family) = (triangles, of);
    for (triangle, family) in all.rev() {
        let [a, b, c] = triangle.map(|vertex| twin[vertex as usize]);
        mesh.triangles.push([b, a, c]);
        mesh.triangle_family.push(left[family.index()]);
    }
    for tet in half.tets.iter().rev() {
        let [a, b, c, d] = tet.map(|vertex| twin[vertex as usize]);
        mesh.tets.push([a, b, d, c]);
    }
    // The emptied family stays without triangles.
    (mesh, twin)
}

fn check(aircraft: Aircraft, set: &str) {
    let half = aircraft.mesh();
    let (mesh, twin) = whole(&half, &["wing"]);
    let (old, new) = (aircraft.profiles("old_2"), aircraft.profiles(set));
    let base = || builder(mesh.clone(), Vec::new()).role("wing_left", Role::Wing);
    let one = base().wing("wing", &["wing", "wing_left"], old.clone(), Some(symmetry()));
    let two = base().old_profiles("wing", old.clone()).old_profiles("wing_left", left(&old));
    let design = Design::of_wing("wing", new.clone());
    for (builder, design) in [(one, design.clone()), (two, design.with_profiles("wing_left", left(&new)))] {
        let mut mover = builder.build(cpu()).unwrap();
        let outcome = mover.update(&design).unwrap();
        assert_eq!(outcome.inverted, 0, "{set}");
        assert!(outcome.missed.is_empty(), "{set}: {:?}", outcome.missed);
        let apart = triangles_of(&mesh, "wing")
            .into_iter()
            .flatten()
            .map(|vertex| outcome.vertices()[twin[vertex] as usize].distance(mirrored(outcome.vertices()[vertex])));
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

/// The largest distance of a vertex from the mirror image of its twin.
fn apart(outcome: &Outcome, twin: &[u32]) -> f64 {
    let moved = outcome.vertices();
    let of = |(vertex, &twin): (usize, &u32)| moved[twin as usize].distance(mirrored(moved[vertex]));
    twin.iter().enumerate().map(of).fold(0.0, f64::max)
}

/// A whole aircraft with the usual roles on both sides and default settings; its wings, each with
/// the numbers of its profiles, by a mirror plane or by tables for each side.
struct Sides {
    name: &'static str,
    wings: &'static [(&'static str, std::ops::Range<i64>)],
    by_mirror: bool,
}

impl Sides {
    fn of(&self, wing: &std::ops::Range<i64>, set: &str) -> Vec<Profile> {
        profiles(self.name, set).into_iter().filter(|profile| wing.contains(&profile.number)).collect()
    }

    fn builder(&self, whole: TetMesh, role_of: impl Fn(&str) -> Option<Role>) -> MoverBuilder {
        let roles = whole.families.iter().filter_map(|name| {
            let of = name.strip_suffix("_left").unwrap_or(name);
            Some((name.clone(), role_of(of).or_else(|| role(of))?))
        });
        let builder = roles
            .collect::<Vec<_>>()
            .into_iter()
            .fold(Mover::builder(whole), |builder, (name, role)| builder.role(&name, role));
        self.wings.iter().fold(builder, |builder, (wing, numbers)| {
            let (other, old) = (format!("{wing}_left"), self.of(numbers, "old"));
            match self.by_mirror {
                true => builder.wing(wing, &[wing, &other], old, Some(symmetry())),
                false => builder.old_profiles(wing, old.clone()).old_profiles(&other, left(&old)),
            }
        })
    }

    fn design(&self, set: &str) -> Design {
        self.wings.iter().fold(Design::default(), |design, (wing, numbers)| {
            let new = self.of(numbers, set);
            let design = design.with_profiles(wing, new.clone());
            if self.by_mirror { design } else { design.with_profiles(&format!("{wing}_left"), left(&new)) }
        })
    }
}

/// Pylons and nacelles on both sides, in families of their own for each side or for both: valid
/// with the usual settings, and with a tight tolerance the mirror image to 1e-9 of an aircraft of
/// span 8.
///
/// Fails if a foot at a sharp edge of the pylon lies on the part of its first triangle (3e-6), or
/// if both nacelles of a family have one motion. In the last row the pylons slide on their
/// nacelles.
#[test]
fn pylons_and_nacelles_on_both_sides_move_alike() {
    let half = mesh("nacelle");
    let sided = ["wing", "trailing_edge", "wingtip", "pylon", "nacelle"];
    let (of_sides, twin) = whole(&half, &sided);
    let (of_both, _) = whole(&half, &sided[..1]);
    let mut as_sides = Vec::new();
    for (is_sided, by_mirror, junction, set, tight) in [
        (true, true, Junction::Glued, "small", false),
        (true, false, Junction::Glued, "small", true),
        (true, true, Junction::Slide, "planform", true),
        (false, false, Junction::Slide, "planform", true),
        (true, true, Junction::Slide, "small", true),
    ] {
        // A given motion that is its own mirror image.
        let lower = RigidMotion::Given {
            turn: DVec3::new(0.0, 1.0, 0.0),
            about: DVec3::new(0.4, 0.0, -0.56),
            shift: DVec3::new(0.0, 0.0, -0.02),
        };
        let slides_on_body = junction == Junction::Slide && set == "small";
        let sides = Sides { name: "nacelle", wings: &[("wing", 0..5)], by_mirror };
        let role = |family: &str| match family {
            "pylon" => Some(Role::Attached { coefficient: 0.5, start: TipStart::Rigid, junction }),
            "nacelle" if slides_on_body => Some(Role::Rigid { motion: lower, junction }),
            "nacelle" => Some(rigid(RigidMotion::Root)),
            _ => None,
        };
        let builder = sides.builder(if is_sided { of_sides.clone() } else { of_both.clone() }, role);
        let stopping = Stopping { tolerance: if tight { 1e-10 } else { 1e-4 }, ..Stopping::default() };
        let outcome = builder.stopping(stopping).build(cpu()).unwrap().update(&sides.design(set)).unwrap();
        let what = format!("{is_sided} {by_mirror} {set}");
        outcome.check().unwrap_or_else(|refused| panic!("{what}: {refused}"));
        assert!(outcome.folded.is_empty() && outcome.warnings.is_empty(), "{what}: {:?}", outcome.warnings);
        let least = if slides_on_body { 0.002 } else { 0.0029 };
        assert!(outcome.stages.last().unwrap().beta_min >= least, "{:?}", outcome.stages.last());
        assert!(!slides_on_body || outcome.families["nacelle_left"].max_slide > Some(0.03));
        let apart = apart(&outcome, &twin);
        assert!(apart < if tight { 1e-9 } else { 1e-5 }, "{what}: {apart:e}");
        // Each nacelle turns as far as its twin, also in one family with it.
        let turn = |family: &str| outcome.families[family].turn_degrees.unwrap();
        let other = if is_sided { turn("nacelle_left") } else { turn("nacelle") };
        assert!((turn("nacelle") - other).abs() < 1e-9 && other > 0.5, "{} {other}", turn("nacelle"));
        match (is_sided, set) {
            (true, "planform") => as_sides = outcome.vertices().to_vec(),
            (false, _) => {
                let off = |vertex: usize| outcome.vertices()[vertex].distance(as_sides[vertex]);
                for family in ["trailing_edge", "wingtip", "pylon", "nacelle"] {
                    let off = vertices_of(&of_both, family).into_iter().map(off).fold(0.0, f64::max);
                    assert!(off < 1e-9, "{family}: {off:e}");
                }
            }
            _ => {}
        }
    }
}

/// Four wings that share nothing: a wing and a horizontal tail on each side.
#[test]
fn wings_and_tails_on_both_sides_move_alike() {
    let half = mesh("tailplane");
    let (whole, twin) = whole(&half, &["wing", "trailing_edge", "wingtip", "tail", "tail_te", "tail_tip"]);
    let role = |family: &str| match family {
        "tail" => Some(Role::Wing),
        "tail_te" => Some(Role::TrailingEdge),
        "tail_tip" => role("wingtip"),
        _ => None,
    };
    for by_mirror in [true, false] {
        let sides = Sides { name: "tailplane", wings: &[("wing", 0..5), ("tail", 5..7)], by_mirror };
        let mut mover = sides.builder(whole.clone(), role).build(cpu()).unwrap();
        for set in ["big", "twist"] {
            let outcome = mover.update(&sides.design(set)).unwrap();
            outcome.check().unwrap_or_else(|refused| panic!("{by_mirror} {set}: {refused}"));
            assert!(outcome.folded.is_empty() && outcome.warnings.is_empty(), "{set}: {:?}", outcome.warnings);
            assert!(outcome.stages.last().unwrap().beta_min >= 0.0100, "{set}: {:?}", outcome.stages.last());
            let apart = apart(&outcome, &twin);
            assert!(apart < 1e-5, "{by_mirror} {set}: {apart:e}");
        }
    }
}
