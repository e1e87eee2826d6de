//! Products through the stages that follow the wing: trailing edge, rigid, attached and carenage.
//! Forward and reverse are transposes, and forward is the limit of updates, also at no motion.

mod common;

use std::collections::BTreeMap;

use common::aircraft::{Anyway, SMALL, cpu, vertices_of};
use common::brick::noise_vector;
use common::carved::{carve, on};
use glam::{DQuat, DVec3};
use idmesh::families::{Junction, RigidMotion, Role, TipStart};
use idmesh::mesh::TetMesh;
use idmesh::mover::{Derivative, Design, Mover, NotDifferentiable, Outcome, ProductError};
use idmesh::relaxation::{Method, Stopping};

const PARTS: [&str; 8] = ["wing", "trailing_edge", "wingtip", "wall", "pylon", "nacelle", "fairing", "farfield"];

/// Whether a point lies in a closed box, in cells.
fn within(at: DVec3, low: [f64; 3], high: [f64; 3]) -> bool {
    at.cmpge(DVec3::from(low)).all() && at.cmple(DVec3::from(high)).all()
}

/// A wing of 4 x 6 x 2 cells on a wall, with a blunt trailing edge and a tip. Below it hang a pylon
/// that stands on the wall too, and a nacelle. A fairing crosses the lower side of the trailing
/// edge.
///
/// - `place`: from the place in cells of a quarter to where the vertex shall be
fn parts(place: impl Fn(DVec3) -> DVec3) -> TetMesh {
    let wing = |at: DVec3| within(at, [4.0, 0.0, 7.0], [8.0, 6.0, 9.0]);
    let pylon = |at: DVec3| within(at, [5.0, 0.0, 5.0], [7.0, 2.0, 7.0]);
    let nacelle = |at: DVec3| within(at, [4.0, 1.0, 3.0], [8.0, 3.0, 5.0]);
    let fairing = |at: DVec3| within(at, [6.0, 3.0, 6.0], [10.0, 5.0, 8.0]);
    let is_body = |at: DVec3| wing(at) || pylon(at) || nacelle(at) || fairing(at);
    let family = |triangle: [DVec3; 3]| {
        let all = |is: &dyn Fn(DVec3) -> bool| triangle.iter().all(|&at| is(at));
        match triangle {
            _ if on(triangle, 1, 0.0) => "wall",
            _ if all(&|at| at.x == 0.0 || at.x == 14.0 || at.y == 9.0 || at.z == 0.0 || at.z == 12.0) => "farfield",
            _ if on(triangle, 0, 8.0) && all(&wing) => "trailing_edge",
            _ if on(triangle, 1, 6.0) => "wingtip",
            _ if all(&wing) => "wing",
            _ if all(&nacelle) => "nacelle",
            _ if all(&fairing) => "fairing",
            _ => "pylon",
        }
    };
    carve([14, 9, 12], &PARTS, is_body, family, |at| place(at * 0.25))
}

/// Bent everywhere but on the wall, which is flat: no curve lies on a line, no root in a plane.
fn on_flat_wall(at: DVec3) -> DVec3 {
    let bend =
        DVec3::new(0.04 * (2.0 * at.z).sin(), 0.02 * at.y * (3.0 * at.x).cos(), 0.05 * (1.5 * at.x + at.y).sin());
    DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7) * (at + bend)
}

/// The same, with a wall that bulges.
fn on_bulge(at: DVec3) -> DVec3 {
    let share = (1.0 - at.y / 2.25).max(0.0);
    on_flat_wall(at - DVec3::Y * 0.06 * share * ((at.x - 1.75).powi(2) + (at.z - 1.6).powi(2)))
}

fn role(name: &str) -> Role {
    match name {
        "wing" => Role::Prescribed,
        "trailing_edge" => Role::TrailingEdge,
        "wingtip" => Role::Wingtip { coefficient: 0.5, start: TipStart::Affine },
        "wall" => Role::Carenage,
        "pylon" => Role::Attached { coefficient: 0.5, start: TipStart::Rigid, junction: Junction::Glued },
        "fairing" => Role::Attached { coefficient: 0.7, start: TipStart::Affine, junction: Junction::Glued },
        "nacelle" => Role::Rigid { motion: RigidMotion::Root, junction: Junction::Glued },
        _ => Role::Fixed,
    }
}

/// Whether a rigid family depends on its root.
fn follows(motion: RigidMotion) -> bool {
    matches!(motion, RigidMotion::Root | RigidMotion::Translation)
}

struct Case {
    mover: Mover,
    span: DVec3,
    nacelle_stays: bool,
}

impl Case {
    fn new(mesh: TetMesh, role: impl Fn(&str) -> Role, tolerance: f64, span: DVec3) -> Self {
        let stopping = Stopping { tolerance, ..Stopping::default() };
        let names = mesh.families.clone();
        let stays = |name: &String| matches!(role(name), Role::Rigid { motion, .. } if !follows(motion));
        let nacelle_stays = names.iter().any(stays);
        let builder = Mover::builder(mesh).method(Method::Chebyshev).quality(None).max_steps(1).stopping(stopping);
        let builder = names.iter().fold(builder, |builder, name| builder.role(name, role(name)));
        Self { mover: builder.build(cpu()).unwrap(), span, nacelle_stays }
    }

    fn parts(place: fn(DVec3) -> DVec3, role: impl Fn(&str) -> Role, tolerance: f64) -> Self {
        let span = place(DVec3::Y) - place(DVec3::ZERO);
        Self::new(parts(place), role, tolerance, span.normalize())
    }

    fn small(tolerance: f64) -> Self {
        let role = |name: &str| if name == "wing" { Role::Prescribed } else { common::aircraft::role(name).unwrap() };
        Self::new(SMALL.mesh(), role, tolerance, DVec3::Y)
    }

    fn by(&self, displacement: impl Fn(usize, DVec3) -> DVec3) -> Design {
        let vertices = self.mover.family_vertices("wing").unwrap().iter();
        let displaced =
            vertices.map(|&vertex| displacement(vertex as usize, self.mover.mesh().vertices[vertex as usize]));
        Design::of_prescribed("wing", displaced.collect())
    }

    /// The wing turns about its middle by these angles in degrees, and bends.
    fn turned(&self, degrees: f64) -> Design {
        let vertices = self.mover.family_vertices("wing").unwrap();
        let sum: DVec3 = vertices.iter().map(|&vertex| self.mover.mesh().vertices[vertex as usize]).sum();
        let middle = sum / vertices.len() as f64;
        let turn = DQuat::from_axis_angle(self.span, degrees.to_radians());
        let up = self.span.any_orthonormal_vector();
        let bend = up * degrees.to_radians() * 0.2;
        self.by(|_, at| turn * (at - middle) - (at - middle) + bend * (at - middle).dot(self.span).powi(2))
    }

    fn smooth(&self) -> Design {
        self.by(|_, at| DVec3::new(0.3 + 0.1 * at.z, 0.2 * at.x, (2.0 * at.y).sin() * (3.0 * at.x).cos()))
    }

    fn random(&self) -> Design {
        self.by(|vertex, _| noise_vector(vertex))
    }

    fn update(&mut self, design: &Design) -> Outcome {
        let outcome = self.mover.update(design).unwrap();
        assert!(outcome.converged, "{:?}", outcome.unconverged);
        assert_eq!(outcome.differentiable(), Ok(()));
        outcome
    }

    /// For each family and for the whole mesh: the norm of the forward product, and how far it is
    /// from a central difference, as a share of this norm.
    fn off_differences(&mut self, design: &Design, direction: &Design, step: f64) -> BTreeMap<String, (f64, f64)> {
        let outcome = self.update(design);
        let exact = self.mover.forward(&outcome, direction, Derivative::Exact).unwrap();
        let [plus, minus] = [step, -step].map(|step| self.update(&sum(design, direction, step)));
        let both = plus.displacement().iter().zip(minus.displacement());
        let difference: Vec<DVec3> = both.map(|(plus, minus)| (*plus - *minus) / (2.0 * step)).collect();
        let mesh = self.mover.mesh();
        let all = (0..exact.len()).collect();
        let families = mesh.families.iter().map(|name| (name.clone(), vertices_of(mesh, name)));
        let compared = families.chain([("all".to_owned(), all)]).map(|(name, vertices): (String, Vec<usize>)| {
            let of = |value: &dyn Fn(usize) -> DVec3| norm(&vertices.iter().map(|&v| value(v)).collect::<Vec<_>>());
            let size = of(&|vertex| exact[vertex]);
            (name, (size, of(&|vertex| difference[vertex] - exact[vertex]) / size))
        });
        compared.collect()
    }

    /// Checks differences in every family, all of which move but `farfield` and those that stay.
    fn check_differences(&mut self, what: &str, design: &Design, direction: &Design, step: f64, allowed: f64) {
        for (family, (size, off)) in self.off_differences(design, direction, step) {
            if family == "farfield" || family == "nacelle" && self.nacelle_stays {
                assert_eq!(size, 0.0, "{what}, {family}");
            } else {
                assert!(off <= allowed, "{what}, {family}: {off:e} of {size}");
            }
        }
    }

    /// Checks the transpose with random vectors, the seed on one family after the other, and on all
    /// vertices.
    fn check_transpose(&mut self, what: &str, design: &Design) {
        let outcome = self.update(design);
        let direction = self.random();
        let change = self.mover.forward(&outcome, &direction, Derivative::Exact).unwrap();
        let mesh = self.mover.mesh().clone();
        for family in mesh.families.iter().map(Some).chain([None]) {
            let vertices = family.map_or_else(|| (0..change.len()).collect(), |family| vertices_of(&mesh, family));
            let mut seed = vec![DVec3::ZERO; change.len()];
            vertices.iter().for_each(|&vertex| seed[vertex] = noise_vector(vertex + 1_000_000));
            let gradient = self.mover.reverse(&outcome, &seed, Derivative::Exact).unwrap().prescribed;
            let (one, other) = (dot(&seed, &change), dot(&gradient["wing"], &direction.prescribed["wing"]));
            let moved: Vec<DVec3> = vertices.iter().map(|&vertex| change[vertex]).collect();
            let size = norm(&seed) * norm(&moved);
            assert!(
                (one - other).abs() <= 1e-12 * size,
                "{what}, {family:?}: {one} {other}, {:e}",
                (one - other).abs() / size
            );
        }
    }
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn norm(a: &[DVec3]) -> f64 {
    dot(a, a).sqrt()
}

fn sum(design: &Design, direction: &Design, step: f64) -> Design {
    let mut sum = design.clone();
    for (family, displacement) in &mut sum.prescribed {
        let along = &direction.prescribed[family];
        displacement.iter_mut().zip(along).for_each(|(displacement, along)| *displacement += *along * step);
    }
    sum
}

/// All stages on a flat wall, at rest and turned.
#[test]
fn products_on_a_flat_wall_are_exact() {
    for degrees in [0.0, 12.0] {
        let mut case = Case::parts(on_flat_wall, role, 1e-13);
        let design = case.turned(degrees);
        let (smooth, random) = (case.smooth(), case.random());
        case.check_transpose(&format!("{degrees} degrees"), &design);
        case.check_differences(&format!("{degrees} degrees, smooth"), &design, &smooth, 1e-5, 2e-9);
        case.check_differences(&format!("{degrees} degrees, random"), &design, &random, 1e-6, 1e-8);
    }
}

/// The carenage is curved, made up or of an aircraft.
///
/// Fails if the smooth normal does not change along a facet.
#[test]
fn products_on_a_curved_carenage_are_exact() {
    for (what, mut case) in [("bulge", Case::parts(on_bulge, role, 1e-13)), ("aircraft", Case::small(1e-13))] {
        let design = case.turned(8.0);
        let (smooth, random) = (case.smooth(), case.random());
        case.check_transpose(what, &design);
        case.check_differences(&format!("{what}, smooth"), &design, &smooth, 1e-6, 5e-9);
        case.check_differences(&format!("{what}, random"), &design, &random, 1e-7, 2e-8);
    }
}

/// At rest every vertex of a curved carenage lies on a kink. The derivative lies between the
/// one-sided ones, so a difference to both sides is as far off as the facets are from the smooth
/// surface. Forward and reverse are transposes all the same.
#[test]
fn at_rest_on_a_curved_carenage_a_derivative_is_between_the_sides() {
    for (what, mut case) in [("bulge", Case::parts(on_bulge, role, 1e-13)), ("aircraft", Case::small(1e-13))] {
        let (design, smooth) = (case.turned(0.0), case.smooth());
        case.check_transpose(what, &design);
        case.check_differences(what, &design, &smooth, 1e-6, 0.03);
    }
}

/// The other motions of rigid families and starts of attached ones, on a symmetry plane.
///
/// Fails if the mirror images of roots are left out.
#[test]
fn products_of_all_motions_are_exact() {
    let along = on_flat_wall(DVec3::Z) - on_flat_wall(DVec3::ZERO);
    let given = RigidMotion::Given { turn: DVec3::ZERO, about: DVec3::ZERO, shift: along.normalize() * 0.02 };
    for (motion, start, degrees) in [
        (RigidMotion::Translation, TipStart::Original, 7.0),
        (RigidMotion::Translation, TipStart::Affine, 0.0),
        (RigidMotion::None, TipStart::Affine, 7.0),
        (given, TipStart::Rigid, 0.0),
        (RigidMotion::Root, TipStart::Affine, 7.0),
        (RigidMotion::Root, TipStart::Rigid, 0.0),
    ] {
        let role = |name: &str| match name {
            "wall" => Role::PLANE,
            "nacelle" => Role::Rigid { motion, junction: Junction::Glued },
            "pylon" => Role::Attached { coefficient: 0.3, start, junction: Junction::Glued },
            "wingtip" => Role::Wingtip { coefficient: 0.0, start },
            _ => role(name),
        };
        let mut case = Case::parts(on_flat_wall, role, 1e-13);
        let (design, random) = (case.turned(degrees), case.random());
        let what = format!("{motion:?}, {start:?}, {degrees} degrees");
        case.check_transpose(&what, &design);
        case.check_differences(&what, &design, &random, 1e-6, 1e-8);
    }
}

/// Products of an earlier outcome have their bits after later updates, and change none.
#[test]
fn products_change_no_update() {
    let case = || Case::parts(on_bulge, role, 1e-6);
    let (mut with, mut without) = (case(), case());
    let (first, second) = (with.turned(10.0), with.turned(-6.0));
    let (outcome, direction) = (with.update(&first), with.random());
    let seed: Vec<DVec3> = (0..outcome.vertices().len()).map(noise_vector).collect();
    let products = |case: &mut Case| {
        let forward = case.mover.forward(&outcome, &direction, Derivative::Exact).unwrap();
        (forward, case.mover.reverse(&outcome, &seed, Derivative::Exact).unwrap())
    };
    let at_once = products(&mut with);
    without.update(&first);
    for design in [&second, &first] {
        assert_eq!(with.update(design).vertices(), without.update(design).vertices());
        assert_eq!(products(&mut with), at_once);
    }
}

/// Arguments of any size have the same digits.
///
/// Fails if the equations of a carenage are solved in the unit of their load: squares of 1e-200
/// vanish.
#[test]
fn products_have_no_unit() {
    let mut case = Case::parts(on_bulge, role, 1e-10);
    let (design, direction) = (case.turned(8.0), case.random());
    let outcome = case.update(&design);
    let seed: Vec<DVec3> = (0..outcome.vertices().len()).map(noise_vector).collect();
    let mut products = |scale: f64| {
        let direction = sum(&case.by(|_, _| DVec3::ZERO), &direction, scale);
        let seed: Vec<DVec3> = seed.iter().map(|seed| *seed * scale).collect();
        let change = case.mover.forward(&outcome, &direction, Derivative::Exact).unwrap();
        [change, case.mover.reverse(&outcome, &seed, Derivative::Exact).unwrap().prescribed["wing"].clone()]
    };
    let expected = products(1.0);
    for scale in [1e-200, 1e-30, 1e30] {
        for (found, expected) in products(scale).iter().zip(&expected) {
            let off: Vec<DVec3> = found.iter().zip(expected).map(|(a, b)| *a / scale - *b).collect();
            assert!(norm(&off) <= 1e-9 * norm(expected), "{scale:e}: {:e}", norm(&off) / norm(expected));
        }
    }
}

/// The wing's root goes beyond the end of the wall and takes vertices of the wall along, which are
/// held back at the end.
#[test]
fn a_vertex_at_the_end_of_its_carenage_has_no_derivative() {
    let mut case = Case::parts(on_flat_wall, role, 1e-8);
    let along = on_flat_wall(DVec3::X) - on_flat_wall(DVec3::ZERO);
    let design = case.by(|_, _| along * 2.0);
    let outcome = case.update(&design);
    let seed = vec![DVec3::X; outcome.vertices().len()];
    let forward = case.mover.forward(&outcome, &case.random(), Derivative::Exact).map(|_| ());
    let reverse = case.mover.reverse(&outcome, &seed, Derivative::Exact).map(|_| ());
    for product in [forward, reverse] {
        match product {
            Err(ProductError::NotDifferentiable(NotDifferentiable::Carenage { vertex, position })) => {
                assert_eq!(case.mover.mesh().vertices[vertex as usize], position);
                assert!(case.mover.family_vertices("wall").unwrap().contains(&vertex));
            }
            other => panic!("{other:?}"),
        }
    }
}
