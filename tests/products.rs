//! Products with the derivative of an update: forward and reverse are transposes, forward is the
//! limit of updates, and neither has short cuts, a unit or a memory.

mod common;

use std::collections::BTreeMap;
use std::sync::Arc;

#[cfg(feature = "gpu")]
use common::adapter::single;
use common::aircraft::{Anyway, cpu, file};
use common::block::{block, builder};
use common::brick::noise_vector;
use glam::{DQuat, DVec3};
use idmesh::backend::Backend;
use idmesh::families::Role;
use idmesh::formats;
use idmesh::mover::{Derivative, Design, Mover, MoverBuilder, Outcome, Start};
use idmesh::relaxation::{Method, Stopping};
use idmesh::springs::SPRINGS;

/// A mesh whose families `moved` are prescribed.
struct Case {
    builder: MoverBuilder,
    moved: Vec<&'static str>,
    /// Unit vector along the span.
    span: DVec3,
}

fn askew() -> DQuat {
    DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7)
}

/// A wing on a symmetry plane in a box, with a floor and a ceiling in which vertices slide. The box
/// stands askew, so that no plane is a coordinate plane.
fn on_planes() -> Case {
    let turn = askew();
    let role = |name: &str| match name {
        "wing" => Role::Prescribed,
        "symmetry" | "floor" | "ceiling" => Role::PLANE,
        _ => Role::Fixed,
    };
    let mesh = block(5.0, |at| turn * at);
    Case { builder: builder(mesh, Vec::new(), role).quality(None), moved: vec!["wing"], span: turn * DVec3::Y }
}

/// A wing from one periodic plane to the other, and the floor, which moves as well.
fn between_partners() -> Case {
    let role = |name: &str| match name {
        "wing" | "floor" => Role::Prescribed,
        "symmetry" => Role::Plane { flat: None, partner: Some("side".to_owned()) },
        "side" => Role::PLANE,
        _ => Role::Fixed,
    };
    let mesh = block(8.0, |at| at);
    Case { builder: builder(mesh, Vec::new(), role).quality(None), moved: vec!["wing", "floor"], span: DVec3::Y }
}

/// A wing-body of tets, pyramids, prisms and hexahedra, with layers.
fn hybrid() -> Case {
    let formats::MeshFile { mesh, others, .. } = formats::read_mixed(&file("tests/data/hybrid/small.msh.gz")).unwrap();
    let moved = vec!["wing", "trailing_edge", "wingtip"];
    let mut builder = Mover::builder(mesh.clone()).other_cells(others).quality(None);
    for name in &mesh.families {
        let role = match name.as_str() {
            "symmetry" => Role::PLANE,
            name if moved.contains(&name) => Role::Prescribed,
            _ => Role::Fixed,
        };
        builder = builder.role(name, role);
    }
    Case { builder, moved, span: DVec3::Y }
}

/// A wing in a cube: 102 341 tets, with multigrid.
fn pitching() -> Case {
    let mesh = formats::read(&file("tests/data/pitch-wing.msh.gz")).unwrap().mesh;
    let builder = Mover::builder(mesh).role("wing", Role::Prescribed).role("farfield", Role::Fixed).quality(None);
    Case { builder, moved: vec!["wing"], span: DVec3::Y }
}

impl Case {
    fn mover(self, tolerance: f64) -> Prescribed {
        self.on(tolerance, cpu())
    }

    fn on(self, tolerance: f64, backend: Arc<dyn Backend>) -> Prescribed {
        let stopping = Stopping { tolerance, ..Stopping::default() };
        let mover = self.builder.max_steps(1).stopping(stopping).build(backend).unwrap();
        Prescribed { mover, moved: self.moved, span: self.span }
    }
}

/// A mover with prescribed families.
struct Prescribed {
    mover: Mover,
    moved: Vec<&'static str>,
    span: DVec3,
}

impl Prescribed {
    /// A design, or a direction, from a displacement for each vertex of the prescribed families.
    fn by(&self, displacement: impl Fn(usize, DVec3) -> DVec3) -> Design {
        let of = |family: &&str| {
            let vertices = self.mover.family_vertices(family).unwrap().iter();
            let displaced = vertices.map(|&v| displacement(v as usize, self.mover.mesh().vertices[v as usize]));
            (family.to_string(), displaced.collect())
        };
        Design { prescribed: self.moved.iter().map(of).collect(), ..Design::default() }
    }

    /// The wing pitches about its middle by this angle, in degrees, and bends up along the span.
    fn pitched(&self, degrees: f64) -> Design {
        let vertices = self.mover.family_vertices("wing").unwrap();
        let sum: DVec3 = vertices.iter().map(|&vertex| self.mover.mesh().vertices[vertex as usize]).sum();
        let middle = sum / vertices.len() as f64;
        let turn = DQuat::from_axis_angle(self.span, degrees.to_radians());
        let bend = self.span.any_orthonormal_vector() * if degrees == 0.0 { 0.0 } else { 0.05 };
        self.by(|_, at| turn * (at - middle) - (at - middle) + bend * at.dot(self.span).powi(2))
    }

    fn smooth(&self) -> Design {
        self.by(|_, at| DVec3::new(0.1 * at.z, 0.0, (2.0 * at.y).sin() * (3.0 * at.x).cos()))
    }

    fn random(&self) -> Design {
        self.by(|vertex, _| noise_vector(vertex))
    }

    fn update(&mut self, design: &Design) -> Outcome {
        let outcome = self.mover.update(design).unwrap();
        assert!(outcome.converged, "{:?}", outcome.unconverged);
        outcome
    }

    fn forward(&mut self, outcome: &Outcome, direction: &Design) -> Vec<DVec3> {
        self.mover.forward(outcome, direction, Derivative::Exact).unwrap()
    }

    fn reverse(&mut self, outcome: &Outcome, seed: &[DVec3]) -> BTreeMap<String, Vec<DVec3>> {
        self.mover.reverse(outcome, seed, Derivative::Exact).unwrap().prescribed
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

    /// Checks the transpose on random vectors. Returns the two numbers that must agree.
    fn check_transpose(&mut self, name: &str, design: &Design) {
        let outcome = self.update(design);
        let direction = self.random();
        let seed = seed(&outcome);
        let change = self.forward(&outcome, &direction);
        let gradient = self.reverse(&outcome, &seed);
        let (one, other) = (dot(&seed, &change), along(&gradient, &direction));
        let off = (one - other).abs();
        assert!(norm(&change) > 1.0, "{name}: {}", norm(&change));
        assert!(
            off <= 1e-14 * norm(&seed) * norm(&change),
            "{name}: {one} {other} to {:e}",
            norm(&seed) * norm(&change)
        );
        assert!(off <= 1e-11 * one.abs(), "{name}: {one} {other}");
    }
}

fn seed(outcome: &Outcome) -> Vec<DVec3> {
    (0..outcome.vertices().len()).map(|vertex| noise_vector(vertex + 1_000_000)).collect()
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn norm(a: &[DVec3]) -> f64 {
    dot(a, a).sqrt()
}

fn along(gradient: &BTreeMap<String, Vec<DVec3>>, direction: &Design) -> f64 {
    gradient.iter().map(|(family, of_family)| dot(of_family, &direction.prescribed[family])).sum()
}

/// A design and `step` times a direction.
fn sum(design: &Design, direction: &Design, step: f64) -> Design {
    let mut sum = design.clone();
    for (family, displacement) in &mut sum.prescribed {
        let along = &direction.prescribed[family];
        displacement.iter_mut().zip(along).for_each(|(displacement, along)| *displacement += *along * step);
    }
    sum
}

/// Where edges differ widely in length, solutions need more digits to agree as well.
#[test]
fn forward_and_reverse_are_transposes() {
    for (name, case, degrees, tolerance) in [
        ("on planes", on_planes(), 20.0, 1e-12),
        ("on planes, unmoved", on_planes(), 0.0, 1e-12),
        ("between partners", between_partners(), 10.0, 1e-12),
        ("hybrid", hybrid(), 5.0, 1e-14),
        ("hybrid, unmoved", hybrid(), 0.0, 1e-14),
    ] {
        let mut prescribed = case.mover(tolerance);
        let design = prescribed.pitched(degrees);
        prescribed.check_transpose(name, &design);
    }
}

/// With multigrid, at small and large rotations and at none.
#[test]
fn products_of_a_pitching_wing_are_exact() {
    // A step of 1e-7 from rest has five digits if it is relaxed to 1e-12 edges.
    for (degrees, tolerance) in [(0.0, 1e-14), (10.0, 1e-12), (60.0, 1e-12)] {
        let mut wing = pitching().mover(tolerance);
        let design = wing.pitched(degrees);
        wing.check_transpose(&format!("{degrees} degrees"), &design);
        let (smooth, random) = (wing.smooth(), wing.random());
        let off = wing.off_differences(&design, &smooth, 1e-5);
        assert!(off <= 1e-9, "{degrees} degrees: {off:e}");
        let off = wing.off_differences(&design, &random, 1e-7);
        assert!(off <= 5e-9, "{degrees} degrees, random: {off:e}");
    }
}

#[test]
fn forward_is_the_limit_of_updates() {
    // A step of 1e-7 from rest has five digits if it is relaxed to 1e-12 edges.
    for (name, case, degrees, tolerance) in [
        ("on planes", on_planes(), 20.0, 1e-12),
        ("on planes, unmoved", on_planes(), 0.0, 1e-14),
        ("between partners", between_partners(), 10.0, 1e-12),
        ("hybrid", hybrid(), 5.0, 1e-12),
    ] {
        let mut prescribed = case.mover(tolerance);
        let (design, smooth, random) = (prescribed.pitched(degrees), prescribed.smooth(), prescribed.random());
        let off = prescribed.off_differences(&design, &smooth, 1e-5);
        assert!(off <= 1e-9, "{name}: {off:e}");
        let off = prescribed.off_differences(&design, &random, 1e-7);
        assert!(off <= 5e-9, "{name}, random: {off:e}");
    }
}

/// Near the undeformed mesh rotations are smaller than 2e-8 radians, and count all the same.
#[test]
fn small_motions_are_not_lost() {
    for case in [on_planes(), hybrid()] {
        let mut prescribed = case.mover(1e-14);
        let (design, smooth) = (prescribed.pitched(0.0), prescribed.smooth());
        for (step, allowed) in [(1e-7, 1e-6), (1e-9, 1e-4)] {
            let off = prescribed.off_differences(&design, &smooth, step);
            assert!(off <= allowed, "{step:e}: {off:e}");
        }
    }
}

/// A wing that the design leaves at rest turns with the plane beside it as it would after the
/// smallest motion.
#[test]
fn a_family_at_rest_has_the_derivative_of_one_that_moves() {
    let mut prescribed = between_partners().mover(1e-12);
    let mut design = prescribed.pitched(0.0);
    design.prescribed.get_mut("floor").unwrap().iter_mut().for_each(|by| *by = DVec3::new(0.02, 0.0, 0.05));
    let (smooth, random) = (prescribed.smooth(), prescribed.random());
    prescribed.check_transpose("a wing at rest", &design);
    let off = prescribed.off_differences(&design, &smooth, 1e-5);
    assert!(off <= 1e-9, "{off:e}");
    let off = prescribed.off_differences(&design, &random, 1e-7);
    assert!(off <= 5e-9, "random: {off:e}");
}

#[test]
fn products_hold_at_the_default_tolerance() {
    let mut wing = pitching().mover(Stopping::default().tolerance);
    let (design, smooth) = (wing.pitched(10.0), wing.smooth());
    let off = wing.off_differences(&design, &smooth, 1e-3);
    assert!(off <= 1e-4, "{off:e}");
    // The products themselves are solved to 1e-8.
    let (outcome, random) = (wing.update(&design), wing.random());
    let seed = seed(&outcome);
    let (one, other) = (dot(&seed, &wing.forward(&outcome, &random)), along(&wing.reverse(&outcome, &seed), &random));
    assert!((one - other).abs() <= 1e-6 * one.abs(), "{one} {other}");
}

/// Every family turns as one body: springs that turn their rest edges carry all vertices along. So
/// the change of a vertex by a further turn is the velocity of the body there.
#[test]
fn a_turning_body_carries_its_velocity() {
    for case in [on_planes as fn() -> Case, hybrid] {
        let mesh = case().builder.build(cpu()).unwrap().mesh().clone();
        let mut builder = case().builder;
        let names =
            ["wing", "symmetry", "side", "floor", "ceiling", "farfield", "carenage", "trailing_edge", "wingtip"];
        let moved: Vec<&str> = names.into_iter().filter(|name| mesh.family(name).is_some()).collect();
        assert_eq!(moved.len(), mesh.families.len());
        for name in &moved {
            builder = builder.role(name, Role::Prescribed);
        }
        let mut prescribed = Case { builder, moved, span: DVec3::Y }.mover(1e-12);
        let turn = DQuat::from_scaled_axis(DVec3::new(0.5, -0.9, 0.6));
        let spin = DVec3::new(-0.3, 0.2, 0.7);
        let design = prescribed.by(|_, at| turn * at - at);
        let outcome = prescribed.update(&design);
        let direction = prescribed.by(|_, at| spin.cross(turn * at) + DVec3::X);
        let change = prescribed.forward(&outcome, &direction);
        for (change, at) in change.iter().zip(&mesh.vertices) {
            let expected = spin.cross(turn * *at) + DVec3::X;
            assert!(change.distance(expected) < 1e-9 * expected.length().max(1.0), "{at}: {change} {expected}");
        }
    }
}

/// Springs without rotations are linear, so a product with a design is the update of the design.
#[test]
fn without_rotations_a_product_is_an_update() {
    let springs = SPRINGS.iter().find(|springs| springs.rotation.is_none()).unwrap();
    let case = on_planes();
    let mut prescribed = Case { builder: case.builder.springs(springs), ..case }.mover(1e-12);
    let (design, direction) = (prescribed.pitched(20.0), prescribed.smooth());
    let outcome = prescribed.update(&design);
    let change = prescribed.forward(&outcome, &direction);
    let expected = prescribed.update(&direction).displacement().to_vec();
    let off: Vec<DVec3> = change.iter().zip(&expected).map(|(change, expected)| *change - *expected).collect();
    assert!(norm(&off) < 1e-11 * norm(&expected), "{:e}", norm(&off) / norm(&expected));
    prescribed.check_transpose("without rotations", &design);
}

/// Products change no later update, and those of an earlier outcome are the same to the bit after
/// other updates and after a start from the last design.
#[test]
fn products_have_no_memory() {
    let mover = || {
        let mut case = on_planes();
        case.builder = case.builder.method(Method::Multigrid);
        case.mover(1e-4)
    };
    let (mut with, mut without) = (mover(), mover());
    let (first, second) = (with.pitched(20.0), with.pitched(-10.0));
    let (direction, outcome) = (with.random(), with.update(&first));
    let seed = seed(&outcome);
    let products = |with: &mut Prescribed| (with.forward(&outcome, &direction), with.reverse(&outcome, &seed));
    let at_once = products(&mut with);
    without.update(&first);
    for design in [&second, &first] {
        assert_eq!(with.update(design).vertices(), without.update(design).vertices());
        assert_eq!(products(&mut with), at_once);
    }
    for start in [Start::LastDesign, Start::Undeformed] {
        with.mover.start_from(start);
        without.mover.start_from(start);
        for design in [&first, &second] {
            assert_eq!(with.update(design).vertices(), without.update(design).vertices());
            assert_eq!(products(&mut with), at_once);
        }
    }
}

/// Arguments of any size, and a mesh in millimetres, give the same digits.
#[test]
fn a_product_has_no_unit() {
    let mut metres = on_planes().mover(1e-8);
    let (design, direction) = (metres.pitched(20.0), metres.random());
    let outcome = metres.update(&design);
    let seed = seed(&outcome);
    let (change, gradient) = (metres.forward(&outcome, &direction), metres.reverse(&outcome, &seed));
    let close = |found: &[DVec3], factor: f64, expected: &[DVec3], what: &str| {
        let off: Vec<DVec3> = found.iter().zip(expected).map(|(found, expected)| *found / factor - *expected).collect();
        assert!(norm(&off) <= 1e-10 * norm(expected), "{what}: {:e}", norm(&off) / norm(expected));
    };
    for scale in [1e-30, 1e-9, 1e9, 1e30] {
        let what = format!("{scale:e}");
        let scaled = sum(&metres.by(|_, _| DVec3::ZERO), &direction, scale);
        close(&metres.forward(&outcome, &scaled), scale, &change, &what);
        let seed: Vec<DVec3> = seed.iter().map(|seed| *seed * scale).collect();
        close(&metres.reverse(&outcome, &seed)["wing"], scale, &gradient["wing"], &what);
    }
    let mesh = metres.mover.mesh().clone();
    let mut larger = mesh.clone();
    larger.vertices.iter_mut().for_each(|at| *at *= 1000.0);
    let role = |name: &str| match name {
        "wing" => Role::Prescribed,
        "symmetry" | "floor" | "ceiling" => Role::PLANE,
        _ => Role::Fixed,
    };
    let builder = builder(larger, Vec::new(), role).quality(None);
    let mut millimetres = Case { builder, moved: vec!["wing"], span: metres.span }.mover(1e-8);
    let in_millimetres = sum(&millimetres.by(|_, _| DVec3::ZERO), &design, 1000.0);
    let outcome = millimetres.update(&in_millimetres);
    close(&millimetres.forward(&outcome, &direction), 1.0, &change, "millimetres");
    close(&millimetres.reverse(&outcome, &seed)["wing"], 1.0, &gradient["wing"], "millimetres");
}

/// A GPU that computes in f32 has the products of the CPU.
#[cfg(feature = "gpu")]
#[test]
fn a_gpu_has_the_same_products() {
    let Some(backend) = single() else { return };
    let backend: Arc<dyn Backend> = Arc::new(backend);
    for (name, method, case) in
        [("on planes", Method::Chebyshev, on_planes as fn() -> Case), ("hybrid", Method::Multigrid, hybrid)]
    {
        let run = |backend: Arc<dyn Backend>| {
            let case = case();
            let mut prescribed = Case { builder: case.builder.method(method), ..case }.on(1e-8, backend);
            let design = prescribed.pitched(10.0);
            let (outcome, direction) = (prescribed.update(&design), prescribed.random());
            (prescribed.forward(&outcome, &direction), prescribed.reverse(&outcome, &seed(&outcome)))
        };
        let (cpu, gpu) = (run(cpu()), run(Arc::clone(&backend)));
        let off = |cpu: &[DVec3], gpu: &[DVec3]| {
            let difference: Vec<DVec3> = cpu.iter().zip(gpu).map(|(cpu, gpu)| *cpu - *gpu).collect();
            norm(&difference) / norm(cpu)
        };
        let forward = off(&cpu.0, &gpu.0);
        assert!(forward <= 1e-6 && forward > 0.0, "{name}: {forward:e}");
        for (family, of_family) in &cpu.1 {
            let reverse = off(of_family, &gpu.1[family]);
            assert!(reverse <= 1e-6 && reverse > 0.0, "{name}, {family}: {reverse:e}");
        }
    }
}
