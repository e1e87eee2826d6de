//! Products by the points of new profiles: forward and reverse are transposes, forward is the limit
//! of updates.

mod common;

use common::aircraft::{Anyway, SMALL, cpu, file, role, triangles_of};
use common::block::{CELL, block, builder, mapped, sections};
use common::brick::noise_vector;
use common::carved::{carve, on};
use glam::{DQuat, DVec3};
use idmesh::families::{Junction, RigidMotion, Role, TipStart};
use idmesh::formats::{self, MeshFile};
use idmesh::mesh::FamilyId;
use idmesh::mover::{Derivative, Design, Gradient, Mover, MoverBuilder, NotDifferentiable, Outcome};
use idmesh::profile::{Plane, Profile, csv, cut};
use idmesh::relaxation::{Method, Stopping};

/// A mover with wings, and their old profiles.
struct Lofted {
    mover: Mover,
    old: Vec<(&'static str, Vec<Profile>)>,
    /// Turns x along the chord, y along the span and z up.
    turn: DQuat,
}

fn build(builder: MoverBuilder, tolerance: f64, turn: DQuat, old: Vec<(&'static str, Vec<Profile>)>) -> Lofted {
    let stopping = Stopping { tolerance, ..Stopping::default() };
    let mover = builder.quality(None).max_steps(1).stopping(stopping).build(cpu()).unwrap();
    Lofted { mover, old, turn }
}

/// A wing on a symmetry plane in a box that stands askew. The wing's root slides in the plane.
fn on_plane(stations: &[f64], tolerance: f64) -> Lofted {
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "symmetry" | "floor" | "ceiling" => Role::PLANE,
        _ => Role::Fixed,
    };
    let old = mapped(&sections(stations), |at| turn * at);
    build(builder(block(7.0, |at| turn * at), old.clone(), role), tolerance, turn, vec![("wing", old)])
}

/// A wing from one periodic plane to the other.
fn between_partners(tolerance: f64) -> Lofted {
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "symmetry" => Role::Plane { flat: None, partner: Some("side".to_owned()) },
        "side" => Role::PLANE,
        _ => Role::Fixed,
    };
    let old = sections(&[0.5, 1.5]);
    build(builder(block(8.0, |at| at), old.clone(), role), tolerance, DQuat::IDENTITY, vec![("wing", old)])
}

/// A wing from one periodic plane to the other, with a hump of a carenage on it at both ends. So
/// partners of the wing lie on the carenage.
fn beside_humps(tolerance: f64) -> Lofted {
    let wing = |at: DVec3| (4.0..=8.0).contains(&at.x) && (4.0..=6.0).contains(&at.z);
    let hump = |at: DVec3| (5.0..=7.0).contains(&at.x) && (6.0..=8.0).contains(&at.z) && (at.y <= 2.0 || at.y >= 8.0);
    let family = |triangle: [DVec3; 3]| match triangle {
        _ if on(triangle, 1, 0.0) => "symmetry",
        _ if on(triangle, 1, 10.0) => "side",
        _ if triangle.iter().all(|&at| wing(at)) => "wing",
        _ if triangle.iter().all(|&at| hump(at)) => "hump",
        _ => "farfield",
    };
    let place = |at: DVec3| DVec3::new(at.x - 6.0, at.y, at.z - 5.0 + 0.02 * at.x) * CELL;
    let is_body = |at: DVec3| wing(at) || hump(at);
    let mesh = carve([12, 10, 12], &["wing", "symmetry", "side", "hump", "farfield"], is_body, family, place);
    let own = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|(_, of)| of.index() == 0);
    let triangles: Vec<[u32; 3]> = own.map(|(&triangle, _)| triangle).collect();
    let section = |(number, y): (i64, f64)| Profile {
        number,
        points: cut::cut(&mesh.vertices, &triangles, &Plane { point: DVec3::Y * y, normal: DVec3::Y }).unwrap(),
    };
    let old: Vec<Profile> = [(0, 0.6), (1, 1.9)].map(section).to_vec();
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "symmetry" => Role::Plane { flat: None, partner: Some("side".to_owned()) },
        "side" => Role::PLANE,
        "hump" => Role::Carenage,
        _ => Role::Fixed,
    };
    build(builder(mesh, old.clone(), role), tolerance, DQuat::IDENTITY, vec![("wing", old)])
}

/// A wing through the box from side to side, whose half beyond the mirror plane in the middle moves
/// as the mirror image of the other.
fn mirrored(tolerance: f64) -> Lofted {
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "symmetry" | "side" => Role::PLANE,
        _ => Role::Fixed,
    };
    let old = sections(&[1.1, 1.8]);
    let names = block(8.0, |at| at).families;
    let builder = Mover::builder(block(8.0, |at| at)).method(Method::Chebyshev);
    let builder = names.iter().fold(builder, |builder, name| builder.role(name, role(name)));
    let mirror = Plane { point: DVec3::Y, normal: DVec3::Y };
    build(builder.wing("wing", &["wing"], old.clone(), Some(mirror)), tolerance, DQuat::IDENTITY, vec![("wing", old)])
}

/// Two wings with a common curve, each with its own profiles. The second one gives way.
fn sharing(tolerance: f64) -> Lofted {
    let mut mesh = block(7.0, |at| at);
    let [wing, outer] = [mesh.family("wing").unwrap(), FamilyId(mesh.families.len() as u16)];
    mesh.families.push("outer".to_owned());
    for (triangle, family) in mesh.triangles.iter().zip(&mut mesh.triangle_family) {
        let is_outer = triangle.iter().all(|&vertex| mesh.vertices[vertex as usize].y >= 0.5);
        if *family == wing && is_outer {
            *family = outer;
        }
    }
    let role = |name: &str| match name {
        "wing" | "outer" => Role::Wing,
        "symmetry" => Role::PLANE,
        _ => Role::Fixed,
    };
    let [inner, outer] = [sections(&[0.1, 0.4]), sections(&[1.1])];
    let builder = builder(mesh, inner.clone(), role).old_profiles("outer", outer.clone());
    // Designs have the wings in the order of their names.
    build(builder, tolerance, DQuat::IDENTITY, vec![("outer", outer), ("wing", inner)])
}

/// A wing with airfoils. Whatever touches it stays, or moves with it.
fn half_aircraft(all_move: bool, tolerance: f64) -> Lofted {
    let old = SMALL.profiles("old_2");
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "symmetry" => Role::PLANE,
        _ if all_move => role(name).unwrap(),
        _ => Role::Fixed,
    };
    build(builder(SMALL.mesh(), old.clone(), role), tolerance, DQuat::IDENTITY, vec![("wing", old)])
}

/// A wing from which a nacelle hangs on a pylon that slides on it, with layers on all walls.
fn with_pylon(tolerance: f64) -> Lofted {
    let MeshFile { mesh, others, .. } = formats::read_mixed(&file("tests/data/hybrid/nacelle.msh.gz")).unwrap();
    let path = file("tests/data/hybrid/nacelle_old.csv");
    let old = csv::parse(&[(&path, &std::fs::read_to_string(&path).unwrap())]).unwrap();
    let pylon = Role::Attached { coefficient: 0.5, start: TipStart::Rigid, junction: Junction::Slide };
    let parts = [("pylon", pylon), ("nacelle", Role::Rigid { motion: RigidMotion::Root, junction: Junction::Glued })];
    let builder = common::parts::builder(mesh, old.clone(), &parts).other_cells(others);
    build(builder.method(Method::Chebyshev), tolerance, DQuat::IDENTITY, vec![("wing", old)])
}

impl Lofted {
    /// The old profiles as a design.
    fn still(&self) -> Design {
        self.old.iter().fold(Design::default(), |design, (wing, old)| design.with_profiles(wing, old.clone()))
    }

    /// Each section shifts, turns and grows in its own way.
    fn design(&self, share: f64) -> Design {
        by(&self.still(), |k, number, at| {
            let at = self.turn.inverse() * at;
            let of = share * (1.0 + 0.3 * (2.0 * number as f64).sin() + 0.2 * k as f64);
            let turn = DQuat::from_rotation_y(0.1 * of);
            let bend = 0.01 * share * (3.0 * at.x).sin();
            self.turn * (turn * at * (1.0 + 0.02 * of) + DVec3::new(0.03 * of, 0.0, 0.05 * of + bend))
        })
    }

    /// A smooth direction. The planes of the profiles tilt.
    fn smooth(&self, design: &Design) -> Design {
        by(design, |k, number, at| {
            let at = self.turn.inverse() * at;
            let of = 1.0 + 0.5 * number as f64 - 0.2 * k as f64;
            let tilt = 0.05 * at.x + 0.2 * at.z;
            self.turn * DVec3::new(0.1 * of * at.x, tilt, 0.2 * of * (2.0 * at.x + of).cos())
        })
    }

    /// A random direction for every point, the same at the two ends of a closed profile.
    fn random(&self, design: &Design) -> Design {
        let noise = |at: DVec3| {
            let bits = (at.x.to_bits() ^ at.y.to_bits().rotate_left(17) ^ at.z.to_bits().rotate_left(34)) as usize;
            noise_vector(bits % 1_000_003)
        };
        by(design, |_, _, at| noise(at))
    }

    fn update(&mut self, design: &Design) -> Outcome {
        let outcome = self.mover.update(design).unwrap();
        assert!(outcome.converged, "{:?}", outcome.unconverged);
        assert_eq!(outcome.differentiable(), Ok(()));
        outcome
    }

    fn forward(&mut self, outcome: &Outcome, direction: &Design) -> Vec<DVec3> {
        self.mover.forward(outcome, direction, Derivative::Exact).unwrap()
    }

    /// Checks the transpose on random vectors, relative to the norms.
    fn check_transpose(&mut self, name: &str, design: &Design) {
        let (outcome, direction) = (self.update(design), self.random(design));
        let seed: Vec<DVec3> = (0..outcome.vertices().len()).map(|vertex| noise_vector(vertex + 1_000_000)).collect();
        let change = self.forward(&outcome, &direction);
        let gradient = self.mover.reverse(&outcome, &seed, Derivative::Exact).unwrap();
        let (one, other) = (dot(&seed, &change), along(&gradient, &direction));
        let norms = norm(&seed) * norm(&change);
        assert!(norm(&change) > 0.1, "{name}: {}", norm(&change));
        assert!((one - other).abs() <= 1e-12 * norms, "{name}: {one} {other} to {norms:e}");
    }

    /// Norm of the difference between a forward product and a central difference of updates, over
    /// the norm of the product.
    fn off_differences(&mut self, design: &Design, direction: &Design, step: f64) -> f64 {
        let outcome = self.update(design);
        let exact = self.forward(&outcome, direction);
        let [plus, minus] = [step, -step].map(|step| self.update(&sum(design, direction, step)));
        let both = plus.displacement().iter().zip(minus.displacement());
        let difference = both.map(|(plus, minus)| (*plus - *minus) / (2.0 * step));
        let off: Vec<DVec3> = difference.zip(&exact).map(|(difference, exact)| difference - *exact).collect();
        norm(&off) / norm(&exact)
    }
}

/// The points of a design moved by a map of the number of their wing, of their profile and of
/// themselves.
fn by(design: &Design, map: impl Fn(usize, i64, DVec3) -> DVec3) -> Design {
    let mut moved = design.clone();
    for (k, profiles) in moved.profiles.values_mut().enumerate() {
        for Profile { number, points } in profiles {
            points.iter_mut().for_each(|at| *at = map(k, *number, *at));
        }
    }
    moved
}

/// A design and `step` times a direction.
fn sum(design: &Design, direction: &Design, step: f64) -> Design {
    let mut sum = design.clone();
    for (wing, profiles) in &mut sum.profiles {
        for (profile, along) in profiles.iter_mut().zip(&direction.profiles[wing]) {
            profile.points.iter_mut().zip(&along.points).for_each(|(point, along)| *point += *along * step);
        }
    }
    sum
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn norm(a: &[DVec3]) -> f64 {
    dot(a, a).sqrt()
}

fn along(gradient: &Gradient, direction: &Design) -> f64 {
    let of_wing = |(wing, profiles): (&String, &Vec<Profile>)| -> f64 {
        profiles.iter().zip(&gradient.profiles[wing]).map(|(profile, by)| dot(by, &profile.points)).sum()
    };
    direction.profiles.iter().map(of_wing).sum()
}

/// Wings of every kind, each with its name and the share of the design.
fn wings() -> [(&'static str, Lofted, f64); 9] {
    [
        ("two sections", on_plane(&[0.55, 1.7], 1e-12), 1.0),
        ("two sections, unmoved", on_plane(&[0.55, 1.7], 1e-14), 0.0),
        ("four sections", on_plane(&[0.55, 0.9, 1.3, 1.7], 1e-12), 1.0),
        ("one section", on_plane(&[0.6], 1e-12), 1.0),
        ("partners", between_partners(1e-12), 0.3),
        ("mirrored", mirrored(1e-12), 0.3),
        ("sharing", sharing(1e-12), 0.3),
        ("half aircraft", half_aircraft(false, 1e-12), 0.1),
        ("all move", half_aircraft(true, 1e-12), 0.1),
    ]
}

#[test]
fn reverse_is_the_transpose_of_forward() {
    for (name, mut lofted, share) in wings() {
        let design = lofted.design(share);
        lofted.check_transpose(name, &design);
    }
}

/// Fails if the slide of a junction does not follow the span direction, or if a wing does not give
/// way at a shared curve.
#[test]
fn forward_is_the_limit_of_updates() {
    for (name, mut lofted, share) in wings() {
        let (design, smooth) = (lofted.design(share), lofted.smooth(&lofted.design(share)));
        let step = if name == "all move" { 1e-6 } else { 1e-5 };
        let off = lofted.off_differences(&design, &smooth, step);
        assert!(off <= 1e-8, "{name}: {off:e}");
    }
}

/// New profiles with other points than the old ones, matched by measure.
#[test]
fn a_match_by_measure_is_differentiated_as_it_ran() {
    for set in ["small_2", "big_2", "planform_2"] {
        let mut lofted = half_aircraft(set == "small_2", 1e-12);
        let design = Design::of_wing("wing", SMALL.profiles(set));
        lofted.check_transpose(set, &design);
        let smooth = lofted.smooth(&design);
        for step in [1e-5, 1e-6] {
            let off = lofted.off_differences(&design, &smooth, step);
            assert!(off <= 1e-6, "{set} by {step:e}: {off:e}");
        }
    }
}

/// Where the derivative jumps an outcome has a frozen one alone, and says which profile it is of.
///
/// Fails if an affine image by measure has an exact derivative.
#[test]
fn kinks_have_a_frozen_derivative_alone() {
    let mut two = on_plane(&[0.55, 1.7], 1e-8);
    let turn = two.turn;
    // A point more on the old curve: the match is by measure, and exact.
    let more = |design: &Design| {
        let mut design = design.clone();
        for profile in design.profiles.values_mut().flatten() {
            let middle = profile.points[0].midpoint(profile.points[1]);
            profile.points.insert(1, middle);
        }
        design
    };
    let of_two = more(&two.still());
    let affine = |at: DVec3| turn * (turn.inverse() * at * DVec3::new(1.03, 1.0, 1.1) + DVec3::Z * 0.01);
    let bent = |at: DVec3| affine(at) + turn * DVec3::Z * 5e-4 * (3.0 * (turn.inverse() * at).x).sin();
    let affine = by(&of_two, |_, _, at| affine(at));
    let bent = by(&of_two, |_, _, at| bent(at));
    for (design, kink) in [(of_two, Some(0)), (affine, Some(0)), (bent, None)] {
        let outcome = two.mover.update(&design).unwrap();
        match (outcome.differentiable(), kink) {
            (Err(NotDifferentiable::Kink { wing, profile, .. }), Some(kink)) => {
                assert_eq!((wing.as_str(), profile), ("wing", kink));
            }
            (Ok(()), None) => {}
            other => panic!("{other:?}"),
        }
        let seed = vec![DVec3::ONE; outcome.vertices().len()];
        assert_eq!(two.mover.reverse(&outcome, &seed, Derivative::Exact).is_err(), kink.is_some());
        two.mover.reverse(&outcome, &seed, Derivative::Frozen).unwrap();
    }
}

/// A loop over four sections starts where all rest, and often moves the middle of its sections
/// alone. There whole sections, or the places along them that rest, move as one.
///
/// Fails if `SMALL` of `overshoot` is 0.
#[test]
fn sections_that_rest_or_move_alike_have_their_derivative() {
    let mut four = on_plane(&[0.55, 0.9, 1.3, 1.7], 1e-12);
    let turn = four.turn;
    let still = four.still();
    let shifted = |by: [f64; 4]| self::by(&still, |_, number, at| at + turn * DVec3::Z * by[number as usize]);
    // The front and the rear of each section rest.
    let bumps = by(&still, |_, number, at| {
        let flat = turn.inverse() * at;
        let bump = (4.0 * flat.x).sin().max(0.0).powi(3);
        at + turn * DVec3::Z * 0.004 * bump * (1.0 + 0.3 * number as f64)
    });
    for (name, design, step) in [
        ("rest", shifted([0.0; 4]), 1e-5),
        ("alike", shifted([0.02; 4]), 1e-5),
        ("one rests", shifted([0.01, 0.0, 0.02, 0.03]), 1e-6),
        ("two alike", shifted([0.01, 0.02, 0.03, 0.02]), 1e-6),
        ("one moves", shifted([0.0, 0.0, 0.03, 0.0]), 1e-6),
        ("bumps", bumps, 1e-6),
    ] {
        let smooth = four.smooth(&design);
        let alone = by(&smooth, |_, number, at| if number == 1 { at } else { DVec3::ZERO });
        for direction in [smooth, alone] {
            let off = four.off_differences(&design, &direction, step);
            assert!(off <= 1e-6, "{name}: {off:e}");
        }
    }
}

/// New profiles that continue flat cuts through the facets are compared with these cuts.
///
/// Fails if values at the knots of flat sections count for the smooth ones as they are.
#[test]
fn changed_flat_cuts_are_differentiated() {
    let mesh = SMALL.mesh();
    let triangles: Vec<[u32; 3]> =
        triangles_of(&mesh, "wing").into_iter().map(|triangle| triangle.map(|vertex| vertex as u32)).collect();
    let planes: Vec<(i64, Plane)> =
        SMALL.profiles("old_2").iter().map(|old| (old.number, Plane::of_profile(old).unwrap())).collect();
    let old = cut::cut_at_planes(&mesh.vertices, &triangles, &planes).unwrap();
    let flat = planes.iter().map(|(number, plane)| Profile {
        number: *number,
        points: cut::cut(&mesh.vertices, &triangles, plane).unwrap(),
    });
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "symmetry" => Role::PLANE,
        _ => Role::Fixed,
    };
    let cuts = Design::of_wing("wing", flat.collect());
    let builder = builder(mesh, old.clone(), role);
    let mut lofted = build(builder, 1e-12, DQuat::IDENTITY, vec![("wing", old)]);
    let design = by(&cuts, |_, number, at| {
        at * 1.01 + DVec3::new(0.0, -0.01 * at.y, 0.02 * number as f64 + 0.002 * (2.0 * at.x).sin())
    });
    assert!(lofted.update(&design).profiles["wing"].compared_with_flat_cuts);
    lofted.check_transpose("flat", &design);
    let smooth = lofted.smooth(&design);
    let off = lofted.off_differences(&design, &smooth, 1e-5);
    assert!(off <= 1e-7, "{off:e}");
}

/// Products of an earlier outcome have their bits after later updates, and change none.
#[test]
fn products_have_no_memory() {
    let (mut with, mut without) = (sharing(1e-6), sharing(1e-6));
    let (first, second) = (with.design(0.3), with.design(-0.2));
    let (outcome, direction) = (with.update(&first), with.random(&first));
    let seed: Vec<DVec3> = (0..outcome.vertices().len()).map(noise_vector).collect();
    let products = |lofted: &mut Lofted| {
        let gradient = lofted.mover.reverse(&outcome, &seed, Derivative::Exact).unwrap();
        (lofted.forward(&outcome, &direction), gradient)
    };
    let at_once = products(&mut with);
    without.update(&first);
    for design in [&second, &first] {
        assert_eq!(with.update(design).vertices(), without.update(design).vertices());
        assert_eq!(products(&mut with), at_once);
    }
}

/// Partners of a wing that lie on a carenage slide to the mean of their places, and then take the
/// displacement of the first.
///
/// Fails if the gradients of the others are lost.
#[test]
fn partners_on_a_carenage_are_differentiated() {
    let mut lofted = beside_humps(1e-12);
    let mesh = lofted.mover.mesh();
    let names = ["wing", "hump", "symmetry"].map(|name| lofted.mover.family_vertices(name).unwrap());
    let all = names[0].iter().filter(|vertex| names[1..].iter().all(|of| of.binary_search(vertex).is_ok()));
    assert_eq!(all.count(), 2, "{}", mesh.vertices.len());
    // The wing rises and its chord shrinks, so that no vertex stays on a kink.
    let design = by(&lofted.still(), |_, number, at| {
        DVec3::new(0.98 * at.x, at.y, at.z + 0.03 + 0.02 * number as f64 + 0.01 * at.x)
    });
    lofted.check_transpose("humps", &design);
    let smooth = lofted.smooth(&design);
    let off = lofted.off_differences(&design, &smooth, 1e-6);
    assert!(off <= 1e-7, "{off:e}");
}

/// A pylon slides where the chord grows, and where it shrinks.
///
/// Fails if the nacelle follows the root as it is after the slide.
#[test]
fn a_junction_that_slides_is_differentiated() {
    let mut lofted = with_pylon(1e-12);
    for growth in [0.06, -0.04] {
        let design = by(&lofted.still(), |_, number, at| {
            let own = 1.0 + growth * (1.0 + 0.1 * number as f64);
            DVec3::new(at.x * own, at.y, at.z * (1.0 + growth) + 0.01 * number as f64)
        });
        let outcome = lofted.update(&design);
        assert!(outcome.families["pylon"].max_slide.unwrap() > 0.005, "{:?}", outcome.families["pylon"]);
        let name = format!("growth {growth}");
        lofted.check_transpose(&name, &design);
        let smooth = lofted.smooth(&design);
        let off = lofted.off_differences(&design, &smooth, 1e-6);
        assert!(off <= 1e-6, "{name}: {off:e}");
    }
}
