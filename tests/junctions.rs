//! Junctions that slide: a pylon keeps its shape where the wing's chord changes, and goes with a
//! nacelle that is moved against the wing, or slides on it.

mod common;

use common::aircraft::{Anyway, cpu, triangles_of, vertices_of};
use common::parts::{builder, builder_of_wing, halved, mesh, profiles, rigid};
use glam::{DQuat, DVec3};
use idmesh::families::{Junction, RigidMotion, Role, SetupError, TipStart};
use idmesh::geometry::{closest_on_triangle, fitted_motion::FittedMotion};
use idmesh::mesh::TetMesh;
use idmesh::mover::{Design, FaultKind, MoveError, Mover, MoverBuilder, NotDifferentiable, Outcome, StageError};
use idmesh::profile::Profile;

fn attached(junction: Junction) -> Role {
    Role::Attached { coefficient: 0.5, start: TipStart::Rigid, junction }
}

/// The nacelle's mesh with a pylon of this junction.
fn mover(junction: Junction, motion: RigidMotion) -> Mover {
    let parts = [("pylon", attached(junction)), ("nacelle", rigid(motion))];
    builder(mesh("nacelle"), profiles("nacelle", "old"), &parts).build(cpu()).unwrap()
}

/// The nacelle's mesh with a pylon that slides on the nacelle.
fn on_nacelle(motion: RigidMotion) -> Mover {
    let parts = [("pylon", attached(Junction::Glued)), ("nacelle", sliding_body(motion))];
    builder(mesh("nacelle"), profiles("nacelle", "old"), &parts).build(cpu()).unwrap()
}

fn sliding_body(motion: RigidMotion) -> Role {
    Role::Rigid { motion, junction: Junction::Slide }
}

/// Turned about a point of the nacelle's axis, and shifted.
fn given(degrees: f64, shift: DVec3) -> RigidMotion {
    RigidMotion::Given { turn: DVec3::new(0.0, degrees, 0.0), about: ABOUT, shift }
}

const ABOUT: DVec3 = DVec3::new(0.4, 1.6, -0.56);

/// Half the thickness of a NACA profile of chord 1, as the generator of the mesh has it.
fn naca(x: f64, thickness: f64, edge: f64) -> f64 {
    let sum = 0.2969 * x.sqrt() - 0.1260 * x - 0.3516 * x.powi(2) + 0.2843 * x.powi(3) - 0.1036 * x.powi(4);
    5.0 * thickness * sum + 0.5 * edge * x
}

/// The radius of the nacelle's outside, as the generator of the mesh has it.
fn radius(x: f64) -> f64 {
    let x = ((x + 0.05) / 0.95).clamp(0.0, 1.0);
    0.205 - 0.03 * x.powf(1.5) + 0.95 * 0.5 * naca(x, 0.16, 0.016)
}

/// The distance of a point from the sides of the pylon, along the span; the pylon is ruled between
/// two sections, as the generator of the mesh has it, and goes on beyond them. `None` in front of
/// the sides or behind them.
fn off_sides(at: DVec3) -> Option<f64> {
    let up = (at.z + 0.42) / 0.35;
    let (front, chord) = (0.15 + 0.69 * up, 0.5 + 0.36 * up);
    let x = (at.x - front) / chord;
    let half = |chord: f64| chord * naca(x, 0.085 * 0.75 / chord, 0.012);
    (0.05..0.95).contains(&x).then(|| ((at.y - 1.6).abs() - ((1.0 - up) * half(0.5) + up * half(0.86))).abs())
}

fn update(mover: &mut Mover, new: Vec<Profile>) -> Outcome {
    mover.update(&Design::of_wing("wing", new)).unwrap()
}

/// The new profiles of `nacelle` after a map of the old ones.
fn mapped(map: impl Fn(DVec3) -> DVec3) -> Vec<Profile> {
    let mut new = profiles("nacelle", "old");
    new.iter_mut().for_each(|profile| profile.points.iter_mut().for_each(|at| *at = map(*at)));
    new
}

/// Largest distance of a family's moved vertices from its original surface, in the rigid place that
/// fits best: found by turns from nearest points and from the motion that fits them.
fn off_shape(mesh: &TetMesh, moved: &[DVec3], family: &str) -> f64 {
    let triangles = triangles_of(mesh, family);
    let vertices = vertices_of(mesh, family);
    let nearest = |at: DVec3| {
        let on = triangles.iter().map(|t| closest_on_triangle(at, t.map(|vertex| mesh.vertices[vertex])).0);
        on.min_by(|a, b| a.distance_squared(at).total_cmp(&b.distance_squared(at))).unwrap()
    };
    let mut back = FittedMotion::rigid(&pairs_of(vertices.iter().map(|&v| (moved[v], mesh.vertices[v]))));
    for _ in 0..12 {
        let there = |&v: &usize| moved[v] + back.displacement(moved[v]);
        back = FittedMotion::rigid(&pairs_of(vertices.iter().map(|v| (moved[*v], nearest(there(v))))));
    }
    let off = vertices.iter().map(|&v| moved[v] + back.displacement(moved[v])).map(|at| nearest(at).distance(at));
    off.fold(0.0, f64::max)
}

fn pairs_of(pairs: impl Iterator<Item = (DVec3, DVec3)>) -> Vec<(DVec3, DVec3, f64)> {
    pairs.map(|(from, to)| (from, to, 1.0)).collect()
}

/// Distance of a point from some triangles.
fn distance(at: DVec3, triangles: &[[usize; 3]], vertices: &[DVec3]) -> f64 {
    let to = |triangle: &[usize; 3]| closest_on_triangle(at, triangle.map(|v| vertices[v])).0.distance(at);
    triangles.iter().map(to).fold(f64::INFINITY, f64::min)
}

/// The pylon keeps its shape, and the wing its own: off the junction no bit changes, and beside it
/// the vertices stay on the surface of the glued wing, to the sag of its facets.
#[test]
fn a_pylon_keeps_its_shape() {
    let mut glued = mover(Junction::Glued, RigidMotion::Root);
    let mut sliding = mover(Junction::Slide, RigidMotion::Root);
    for (set, off) in [("small", 0.0006), ("big", 0.0055), ("planform", 0.0060), ("twist", 0.0006)] {
        let outcome = update(&mut sliding, profiles("nacelle", set));
        outcome.check().unwrap_or_else(|refused| panic!("{set}: {refused}"));
        assert!(outcome.folded.is_empty() && outcome.warnings.is_empty(), "{set}: {:?}", outcome.warnings);
        assert!(outcome.stages.last().unwrap().beta_min >= 0.0029, "{set}: {:?}", outcome.stages.last());
        let pylon = outcome.families["pylon"];
        assert!(pylon.max_slide.unwrap() <= 2.0 * pylon.residual.unwrap(), "{set}: {pylon:?}");
        let (mesh, moved) = (sliding.mesh(), outcome.vertices());
        let shape = off_shape(mesh, moved, "pylon");
        assert!(shape <= off, "{set}: {shape:e}");
        let surface = pylon.max_distance_to_carried_surface.unwrap();
        assert!(surface > 0.0 && surface <= shape, "{set}: {surface:e} {shape:e}");
        if set != "planform" {
            continue;
        }
        assert!(pylon.max_slide.unwrap() > 0.01, "{pylon:?}");
        let as_glued = update(&mut glued, profiles("nacelle", set));
        let before = as_glued.families["pylon"];
        assert_eq!((before.max_slide, before.residual), (None, pylon.residual));
        assert!(before.max_distance_to_carried_surface.unwrap() > 2.5 * off, "{before:?}");
        assert!(off_shape(mesh, as_glued.vertices(), "pylon") > 2.5 * off);
        let wing = triangles_of(mesh, "wing");
        let on_pylon = vertices_of(mesh, "pylon");
        let (mut slid, mut still) = (0, 0);
        for vertex in vertices_of(mesh, "wing") {
            let at = moved[vertex];
            if at == as_glued.vertices()[vertex] {
                still += 1;
            } else if on_pylon.binary_search(&vertex).is_err() {
                let off = distance(at, &wing, as_glued.vertices());
                // Some stand in the hole under the glued pylon now.
                let hole = on_pylon.iter().any(|&rim| as_glued.vertices()[rim].distance(at) < 0.04);
                assert!(off < 4e-4 || hole, "{vertex}: {off:e}");
                slid += 1;
            }
        }
        assert!(slid > 50 && still > slid, "{slid} {still}");
    }
    let still = update(&mut sliding, profiles("nacelle", "old"));
    assert_eq!(still.vertices(), sliding.mesh().vertices);
    assert_eq!(still.families["pylon"].max_slide, Some(0.0));
}

/// Under the pylon the wing goes on as it does on another mesh of the same wing, which has no pylon
/// there. The design is an affine map, which the wing follows to rounding, so that the map back
/// takes every vertex that has slid to the undeformed wing.
///
/// Fails if vertices on the wing's leading edge slide: 1.8e-3.
#[test]
fn vertices_slide_on_the_wing_that_is_not_meshed() {
    let stretched = DVec3::new(1.12, 1.0, 1.0);
    let mut mover = mover(Junction::Slide, RigidMotion::Root);
    let outcome = update(&mut mover, mapped(|at| at * stretched));
    outcome.check().unwrap();
    let (mesh, other) = (mover.mesh(), mesh("fairings"));
    let here = |at: DVec3| (at - DVec3::new(1.1, 1.6, -0.15)).abs().max_element() < 0.9;
    let mut without = triangles_of(&other, "wing");
    without.retain(|triangle| triangle.iter().any(|&vertex| here(other.vertices[vertex])));
    let on_pylon = vertices_of(mesh, "pylon");
    let (mut slid, mut largest) = (0, 0.0f64);
    for vertex in vertices_of(mesh, "wing") {
        let back = outcome.vertices()[vertex] / stretched;
        // The stage wing slides the wing's root too.
        if back.distance(mesh.vertices[vertex]) < 1e-9 || !here(back) {
            continue;
        }
        slid += 1;
        largest = largest.max(back.distance(mesh.vertices[vertex]));
        // Facets of 0.038 sag, on both meshes.
        let off = distance(back, &without, &other.vertices);
        let before = distance(mesh.vertices[vertex], &without, &other.vertices);
        assert!(off < before + 8e-4, "{}: {off:e} {before:e}", mesh.vertices[vertex]);
        if on_pylon.binary_search(&vertex).is_ok() {
            assert!(off < 6e-4, "{}: {off:e}", mesh.vertices[vertex]);
        }
    }
    assert!(slid > 100 && largest > 0.02, "{slid} {largest}");
}

/// Three motions of the nacelle. A glued pylon with the usual coefficient closes its corner in the
/// last two.
///
/// Fails if the pylon has conservative springs.
#[test]
fn a_nacelle_is_moved_against_its_wing() {
    let about = DVec3::new(0.4, 1.6, -0.56);
    for (degrees, shift) in
        [(3.0, DVec3::new(0.0, 0.0, -0.05)), (-3.0, DVec3::new(0.05, 0.0, 0.03)), (0.0, DVec3::new(0.0, 0.1, 0.0))]
    {
        let motion = RigidMotion::Given { turn: DVec3::new(0.0, degrees, 0.0), about, shift };
        let mut mover = mover(Junction::Slide, motion);
        let outcome = update(&mut mover, profiles("nacelle", "small"));
        outcome.check().unwrap_or_else(|refused| panic!("{shift}: {refused}"));
        assert!(outcome.folded.is_empty(), "{shift}: {:?}", outcome.folded);
        let turn = DQuat::from_rotation_y(degrees.to_radians());
        for vertex in vertices_of(mover.mesh(), "nacelle") {
            let there = about + turn * (mover.mesh().vertices[vertex] - about) + shift;
            assert!(outcome.vertices()[vertex].distance(there) < 1e-13);
        }
    }
}

/// The wing hardly moves, so the pylon's place is its own to 0.002. It slides on the nacelle by up
/// to 0.15, a third of its length there, and stays on the surface that its generator has for it to
/// 0.006; the glued one leaves it by more than 0.01. The nacelle's vertices stay on the nacelle to
/// a third of its facets' sag, and those beyond the strip are rigid.
///
/// Fails if the strip, or the pylon, follows in one step, and if the duct counts as the outside.
#[test]
fn a_pylon_slides_on_its_nacelle() {
    for (degrees, shift) in [
        (3.0, DVec3::new(0.0, 0.0, -0.05)),
        (0.0, DVec3::new(-0.1, 0.0, 0.0)),
        (-3.0, DVec3::new(0.05, 0.0, 0.03)),
        (0.0, DVec3::new(0.0, 0.1, 0.0)),
    ] {
        let mut mover = on_nacelle(given(degrees, shift));
        let outcome = update(&mut mover, profiles("nacelle", "small"));
        outcome.check().unwrap_or_else(|refused| panic!("{shift}: {refused}"));
        assert!(outcome.folded.is_empty() && outcome.warnings.is_empty(), "{shift}: {:?}", outcome.warnings);
        let slide = outcome.families["nacelle"].max_slide.unwrap();
        assert!(slide > 0.08 && slide < 0.16 && outcome.families["pylon"].max_slide.is_none(), "{shift}: {slide}");
        let refused = NotDifferentiable::Junction { family: "nacelle".to_owned() };
        assert_eq!(outcome.differentiable(), Err(refused));
        let (mesh, moved) = (mover.mesh(), outcome.vertices());
        let turn = DQuat::from_rotation_y(degrees.to_radians());
        let on_pylon = vertices_of(mesh, "pylon");
        let (mut slid, mut still) = (0, 0);
        for vertex in vertices_of(mesh, "nacelle") {
            let back = turn.inverse() * (moved[vertex] - ABOUT - shift) + ABOUT;
            if back.distance(mesh.vertices[vertex]) < 1e-13 {
                still += 1;
                continue;
            }
            let off = (back.y - 1.6).hypot(back.z + 0.56) - radius(back.x);
            assert!(off.abs() < 2.5e-4, "{shift}: {back} {off:e}");
            slid += 1;
        }
        assert!(slid > 300 && still > 3 * slid, "{shift}: {slid} {still}");
        let off = |moved: &[DVec3]| on_pylon.iter().filter_map(|&v| off_sides(moved[v])).fold(0.0, f64::max);
        assert!(off(moved) < 6e-3, "{shift}: {:e}", off(moved));
        // The surface is continued to where the nacelle is.
        let reported = outcome.families["pylon"].max_distance_to_carried_surface.unwrap();
        assert!(reported > 1e-3 && reported < 8e-3, "{shift}: {reported:e}");
        let glued = update(&mut self::mover(Junction::Glued, given(degrees, shift)), profiles("nacelle", "small"));
        assert!(off(glued.vertices()) > 1e-2, "{shift}: {:e}", off(glued.vertices()));
    }
}

/// A nacelle that goes sideways by half its radius: the narrow triangle behind the pylon turns
/// over, and edges beside it are stretched. The mesh has no inverted tet.
///
/// Fails if creases of a body are warnings, or if stretched edges are not told of.
#[test]
fn a_body_that_is_creased_is_told_of() {
    let parts =
        [("pylon", attached(Junction::Slide)), ("nacelle", sliding_body(given(0.0, DVec3::new(0.012, -0.08, 0.042))))];
    let mut mover = builder(mesh("nacelle"), profiles("nacelle", "old"), &parts).build(cpu()).unwrap();
    let outcome = update(&mut mover, profiles("nacelle", "big"));
    assert_eq!(outcome.inverted, 0);
    let refused = outcome.check().unwrap_err();
    let [fault] = &refused.faults[..] else { panic!("{refused}") };
    assert!(fault.kind == FaultKind::Creased && fault.count >= 3, "{fault:?}");
    assert!(refused.message.contains("the rigid family `nacelle` is creased"), "{refused}");
    assert!(refused.hint.as_ref().unwrap().contains("smaller motion of the body"), "{refused:?}");
    let crease = &outcome.creased["nacelle"];
    assert!(crease.degrees > 90.0 && outcome.folded["nacelle"] > 0, "{crease:?}");
    let [shortest, longest] = outcome.families["nacelle"].edge_ratios.unwrap();
    assert!(shortest < 0.5 && longest > 2.0, "{shortest} {longest}");
}

/// Families of one body, and of one wing, are one surface: a seam through the junction changes
/// nothing.
///
/// Fails if vertices on several families stay, or if the two families must write their motion with
/// the same numbers.
#[test]
fn a_junction_slides_over_seams() {
    let surfaces = |builder: MoverBuilder, set: &str| -> Vec<DVec3> {
        let mut mover = builder.quality(None).build(cpu()).unwrap();
        let outcome = update(&mut mover, profiles("nacelle", set));
        let of_case = mover.mesh().families.iter();
        let families = of_case.filter(|name| ["pylon", "nacelle", "wing"].iter().any(|part| name.starts_with(part)));
        let mut vertices: Vec<usize> = families.flat_map(|name| vertices_of(mover.mesh(), name)).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices.into_iter().map(|vertex| outcome.vertices()[vertex]).collect()
    };
    let check = |split: MoverBuilder, whole: MoverBuilder, set: &str| {
        let (split, whole) = (surfaces(split, set), surfaces(whole, set));
        let off = split.iter().zip(whole).map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
        assert!(off < 1e-9, "{set}: {off:e}");
    };
    let old = || profiles("nacelle", "old");
    let body = || sliding_body(given(3.0, DVec3::new(0.0, 0.0, -0.05)));
    // The same motion, about another point of its axis.
    let elsewhere = RigidMotion::Given {
        turn: DVec3::new(0.0, 3.0, 0.0),
        about: ABOUT + DVec3::Y * 0.7,
        shift: DVec3::new(0.0, 0.0, -0.05),
    };
    let parts = [("pylon", attached(Junction::Glued)), ("nacelle", body()), ("nacelle_rear", sliding_body(elsewhere))];
    let split = builder(halved(mesh("nacelle"), "nacelle", DVec3::X * 0.45), old(), &parts);
    check(split, builder(mesh("nacelle"), old(), &parts[..2]), "small");

    let body = rigid(RigidMotion::Root);
    let parts = [("pylon", attached(Junction::Slide)), ("nacelle", body), ("wing_rear", Role::Wing)];
    let wing = halved(mesh("nacelle"), "wing", DVec3::Y * 1.6);
    let split = builder_of_wing(wing, (old(), &["wing", "wing_rear"]), &parts);
    check(split, builder(mesh("nacelle"), old(), &parts[..2]), "planform");
}

/// A body that goes with the root of its assembly slides nothing, to the bit; nor does one that is
/// given the motion of the wing.
#[test]
fn a_body_that_goes_with_its_pylon_slides_nothing() {
    let mut sliding = on_nacelle(RigidMotion::Root);
    let still = update(&mut sliding, profiles("nacelle", "old"));
    assert_eq!(still.vertices(), sliding.mesh().vertices);
    assert_eq!(still.families["nacelle"].max_slide, Some(0.0));
    let planform = update(&mut sliding, profiles("nacelle", "planform"));
    let glued = update(&mut mover(Junction::Glued, RigidMotion::Root), profiles("nacelle", "planform"));
    assert_eq!(planform.vertices(), glued.vertices());
    let (degrees, shift) = (1.0_f64, DVec3::new(0.02, 0.0, 0.03));
    let turn = DQuat::from_rotation_y(degrees.to_radians());
    let map = |at: DVec3| turn * (at - ABOUT) + ABOUT + shift;
    let mut mover = on_nacelle(given(degrees, shift));
    let outcome = update(&mut mover, mapped(map));
    for family in ["pylon", "nacelle"] {
        for vertex in vertices_of(mover.mesh(), family) {
            let off = outcome.vertices()[vertex].distance(map(mover.mesh().vertices[vertex]));
            assert!(off < 1e-10, "{family}: {off:e}");
        }
    }
    assert!(outcome.families["nacelle"].max_slide.unwrap() < 1e-10);
}

/// A nacelle that goes so far forward that the pylon's rear end reaches behind it.
#[test]
fn a_part_that_leaves_its_nacelle_is_told_of() {
    let mut mover = on_nacelle(given(0.0, DVec3::new(-0.25, 0.0, 0.0)));
    match mover.update(&Design::of_wing("wing", profiles("nacelle", "old"))) {
        Err(MoveError::Stage(error @ StageError::Junction { .. })) => {
            let text = error.to_string();
            assert!(text.contains("`pylon`") && text.contains("`nacelle`"), "{text}");
        }
        Err(other) => panic!("{other}"),
        Ok(outcome) => panic!("{:?}", outcome.check().map(drop)),
    }
}

/// Profiles that turn and shift as one body take pylon and nacelle with them as one body.
#[test]
fn a_rigid_motion_slides_nothing() {
    let mut mover = mover(Junction::Slide, RigidMotion::Root);
    let (shift, turn) = (DVec3::new(0.02, 0.0, 0.03), DQuat::from_rotation_y(0.02));
    let outcome = update(&mut mover, mapped(|at| turn * at + shift));
    for family in ["pylon", "nacelle"] {
        for vertex in vertices_of(mover.mesh(), family) {
            let off = outcome.vertices()[vertex].distance(turn * mover.mesh().vertices[vertex] + shift);
            assert!(off < 1e-10, "{family}: {off:e}");
        }
    }
    assert!(outcome.families["pylon"].max_slide.unwrap() < 1e-10);
}

/// A mesh in millimetres moves alike.
#[test]
fn the_unit_does_not_matter() {
    let new = profiles("nacelle", "planform");
    let metres = update(&mut mover(Junction::Slide, RigidMotion::Root), new.clone());
    let mut mesh = mesh("nacelle");
    mesh.vertices.iter_mut().for_each(|at| *at *= 1000.0);
    let larger = |mut profiles: Vec<Profile>| {
        profiles.iter_mut().for_each(|profile| profile.points.iter_mut().for_each(|at| *at *= 1000.0));
        profiles
    };
    let parts = [("pylon", attached(Junction::Slide)), ("nacelle", rigid(RigidMotion::Root))];
    let mut mover = builder(mesh, larger(profiles("nacelle", "old")), &parts).build(cpu()).unwrap();
    let millimetres = update(&mut mover, larger(new));
    for (one, other) in metres.vertices().iter().zip(millimetres.vertices()) {
        assert!(one.distance(*other / 1000.0) < 1e-8, "{one} {other}");
    }
}

fn refused(mesh: TetMesh, old: Vec<Profile>, parts: &[(&str, Role)]) -> String {
    match builder(mesh, old, parts).build(cpu()).err() {
        Some(MoveError::Setup(error @ SetupError::Junction { .. })) => error.to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn junctions_that_cannot_slide_are_refused() {
    let slide = attached(Junction::Slide);
    let parts = [("fairing_1", slide.clone()), ("fairing_2", attached(Junction::Glued))];
    let over_the_edge = refused(mesh("fairings"), profiles("fairings", "old"), &parts);
    assert!(over_the_edge.contains("`fairing_1`") && over_the_edge.contains("`trailing_edge`"), "{over_the_edge}");
    let affine = Role::Attached { coefficient: 0.5, start: TipStart::Affine, junction: Junction::Slide };
    let parts = [("pylon", affine), ("nacelle", rigid(RigidMotion::Root))];
    let affine = refused(mesh("nacelle"), profiles("nacelle", "old"), &parts);
    assert!(affine.contains("`pylon`") && affine.contains("start"), "{affine}");
    let parts = [("pylon", slide.clone()), ("nacelle", attached(Junction::Glued))];
    let mixed = refused(mesh("nacelle"), profiles("nacelle", "old"), &parts);
    assert!(mixed.contains("`pylon`") && mixed.contains("`nacelle`, whose junction is glued"), "{mixed}");
    let parts = [("pylon", slide), ("nacelle", Role::Fixed)];
    let fixed = refused(mesh("nacelle"), profiles("nacelle", "old"), &parts);
    let body = sliding_body(RigidMotion::None);
    let alone = refused(
        mesh("nacelle"),
        profiles("nacelle", "old"),
        &[("pylon", rigid(RigidMotion::Root)), ("nacelle", body.clone())],
    );
    assert!(alone.contains("`nacelle`") && alone.contains("no attached family"), "{alone}");
    let affine = Role::Attached { coefficient: 0.5, start: TipStart::Affine, junction: Junction::Glued };
    let affine = refused(mesh("nacelle"), profiles("nacelle", "old"), &[("pylon", affine), ("nacelle", body)]);
    assert!(affine.contains("`nacelle`") && affine.contains("start of `pylon`"), "{affine}");
    assert!(fixed.contains("`nacelle`, whose role is fixed"), "{fixed}");
}

/// A wing whose chord shrinks so far that the pylon reaches beyond it.
#[test]
fn a_part_that_misses_its_wing_is_told_of() {
    let mut new = profiles("nacelle", "old");
    for profile in &mut new {
        let xs = profile.points.iter().map(|at| at.x);
        let (low, high) = xs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        profile.points.iter_mut().for_each(|at| at.x = low + 0.45 * (at.x - low));
        assert!(high > low);
    }
    let mut mover = mover(Junction::Slide, RigidMotion::Root);
    match mover.update(&Design::of_wing("wing", new)) {
        Err(MoveError::Stage(error @ StageError::Junction { .. })) => {
            let text = error.to_string();
            assert!(text.contains("`pylon`") && text.contains("`wing`"), "{text}");
        }
        Err(other) => panic!("{other}"),
        Ok(outcome) => panic!("{:?}", outcome.check().map(drop)),
    }
}
