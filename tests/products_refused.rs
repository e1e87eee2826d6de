//! Products that are refused, with the reason, and the frozen derivative.

mod common;

use common::aircraft::{Anyway, SMALL, cpu, file, update};
use common::brick::noise_vector;
use glam::{DQuat, DVec3};
use idmesh::families::Role;
use idmesh::formats;
use idmesh::mover::{Derivative, Design, Mover, NotDifferentiable, Outcome, ProductError};
use idmesh::profile::Profile;
use idmesh::relaxation::Stopping;
use idmesh::smoothing::QualityTarget;

fn wing(quality: Option<QualityTarget>, max_steps: usize) -> Mover {
    let mesh = formats::read(&file("tests/data/pitch-wing.msh.gz")).unwrap().mesh;
    let builder = Mover::builder(mesh).role("wing", Role::Prescribed).role("farfield", Role::Fixed);
    builder.quality(quality).max_steps(max_steps).build(cpu()).unwrap()
}

fn by(mover: &Mover, displacement: impl Fn(DVec3) -> DVec3) -> Design {
    let vertices = mover.family_vertices("wing").unwrap().iter();
    Design::of_prescribed("wing", vertices.map(|&v| displacement(mover.mesh().vertices[v as usize])).collect())
}

/// Nose up about the quarter chord, the tips raised.
fn pitched(mover: &Mover, degrees: f64) -> Design {
    let turn = DQuat::from_rotation_y(degrees.to_radians());
    let nose = DVec3::X * 0.25;
    by(mover, |at| turn * (at - nose) - (at - nose) + DVec3::Z * 0.05 * at.y * at.y)
}

fn seed(mover: &Mover) -> Vec<DVec3> {
    (0..mover.mesh().vertices.len()).map(noise_vector).collect()
}

fn direction(mover: &Mover) -> Design {
    by(mover, |at| DVec3::new(at.z, 0.1, at.x * at.y))
}

/// What both products say, which is the same.
fn refusal(mover: &mut Mover, outcome: &Outcome, derivative: Derivative) -> ProductError {
    let reverse = mover.reverse(outcome, &seed(mover), derivative).unwrap_err();
    let forward = mover.forward(outcome, &Design::default(), derivative).unwrap_err();
    assert_eq!(forward.to_string(), reverse.to_string());
    reverse
}

/// The frozen derivative of an outcome of steps is the derivative of its jump. A path of steps uses
/// the networks up; products before and after the path, and the next update, are those of a mover
/// that never took one.
#[test]
fn steps_have_the_derivative_of_the_jump_when_frozen() {
    let mut mover = wing(None, 16);
    let small = pitched(&mover, 10.0);
    let before = mover.update(&small).unwrap();
    let product = mover.reverse(&before, &seed(&mover), Derivative::Exact).unwrap();
    let design = pitched(&mover, 180.0);
    let outcome = mover.update(&design).unwrap();
    let steps = outcome.path.steps;
    assert!(steps > 1, "{:?}", outcome.path);
    let why = NotDifferentiable::Steps { steps };
    assert_eq!(outcome.differentiable(), Err(why.clone()));
    match refusal(&mut mover, &outcome, Derivative::Exact) {
        ProductError::NotDifferentiable(found) => assert_eq!(found, why),
        other => panic!("{other}"),
    }
    let frozen = mover.reverse(&outcome, &seed(&mover), Derivative::Frozen).unwrap();
    let mut jump = wing(None, 1);
    let of_jump = jump.update(&design).unwrap();
    assert_eq!(of_jump.differentiable(), Ok(()));
    assert_eq!(jump.reverse(&of_jump, &seed(&jump), Derivative::Exact).unwrap(), frozen);
    let direction = direction(&mover);
    let forward = mover.forward(&outcome, &direction, Derivative::Frozen).unwrap();
    assert_eq!(jump.forward(&of_jump, &direction, Derivative::Frozen).unwrap(), forward);
    assert_eq!(mover.reverse(&before, &seed(&mover), Derivative::Exact).unwrap(), product);
    assert_eq!(mover.update(&small).unwrap().vertices(), before.vertices());
}

/// Local optimisation that moved no vertex leaves the derivative as it was.
#[test]
fn optimised_vertices_have_no_derivative() {
    let mut mover = wing(Some(QualityTarget::Improve), 1);
    let outcome = mover.update(&pitched(&mover, 60.0)).unwrap();
    let vertices = outcome.smoothed.unwrap().moved;
    assert!(vertices > 0);
    match refusal(&mut mover, &outcome, Derivative::Exact) {
        ProductError::NotDifferentiable(found) => assert_eq!(found, NotDifferentiable::Optimised { vertices }),
        other => panic!("{other}"),
    }
    let frozen = mover.reverse(&outcome, &seed(&mover), Derivative::Frozen).unwrap();
    let mut springs = wing(None, 1);
    let of_springs = springs.update(&pitched(&springs, 60.0)).unwrap();
    assert_eq!(springs.reverse(&of_springs, &seed(&springs), Derivative::Exact).unwrap(), frozen);
    let mut mover = wing(Some(QualityTarget::Original), 1);
    let outcome = mover.update(&pitched(&mover, 10.0)).unwrap();
    assert!(outcome.smoothed.is_none_or(|smoothed| smoothed.moved == 0));
    assert_eq!(outcome.differentiable(), Ok(()));
}

/// Changes of points that are not those of the design's profiles are refused.
#[test]
fn directions_of_profiles_are_checked() {
    let mut mover = SMALL.mover(2);
    let new = SMALL.profiles("small_2");
    let outcome = update(&mut mover, new.clone());
    assert_eq!(outcome.differentiable(), Ok(()));
    let n_points: usize = new.iter().map(|profile| profile.points.len()).sum();
    let (bytes, n_vertices) = (outcome.bytes_for_products(), mover.mesh().vertices.len());
    assert!(bytes <= 64 * n_vertices + 24 * n_points, "{bytes}");
    let mut tried = |wing: &str, changes: &[Profile]| {
        let direction = Design::of_wing(wing, changes.to_vec());
        mover.forward(&outcome, &direction, Derivative::Exact).unwrap_err().to_string()
    };
    let [first, second] = [&new[0], &new[1]];
    let other = Profile { number: 7, ..first.clone() };
    let short = Profile { points: first.points[1..].to_vec(), ..first.clone() };
    let mut broken = second.clone();
    broken.points[5].x = f64::NAN;
    for (wing, changes, expected) in [
        ("wings", vec![first.clone()], "`wings`, which is none of the wings".to_owned()),
        ("wing", vec![other], "profile 7 of `wing`, expected each of the design's numbers".to_owned()),
        ("wing", vec![first.clone(), first.clone()], format!("profile {} of `wing`, expected each", first.number)),
        ("wing", vec![short], format!("has {} points in the outcome's design", first.points.len())),
        ("wing", vec![broken], format!("profile {} of `wing`: vector 5 is", second.number)),
    ] {
        let found = tried(wing, &changes);
        assert!(found.contains(&expected), "{found}");
    }
}

#[test]
fn arguments_that_do_not_fit_are_refused() {
    let mut mover = wing(None, 1);
    let outcome = mover.update(&pitched(&mover, 5.0)).unwrap();
    let n_vertices = mover.mesh().vertices.len();
    assert!(outcome.bytes_for_products() <= 64 * n_vertices, "{}", outcome.bytes_for_products());
    let exact = Derivative::Exact;
    let mut tried = |direction: &Design| mover.forward(&outcome, direction, exact).unwrap_err().to_string();
    let short = Design::of_prescribed("wing", vec![DVec3::ZERO; 4206]);
    assert!(tried(&short).contains("`wing` has 4207 vertices, but the direction has 4206"), "{}", tried(&short));
    let unknown = Design::of_prescribed("wings", Vec::new());
    assert!(tried(&unknown).contains("`wings`, which is none"), "{}", tried(&unknown));
    let fixed = Design::of_prescribed("farfield", Vec::new());
    assert!(tried(&fixed).contains("`farfield`, which is none"), "{}", tried(&fixed));
    let profiles = Design::of_wing("wing", Vec::new());
    assert!(tried(&profiles).contains("profiles"), "{}", tried(&profiles));
    let mut broken = vec![DVec3::ZERO; 4207];
    broken[17].y = f64::NAN;
    let broken = Design::of_prescribed("wing", broken);
    assert!(tried(&broken).contains("family `wing`: vector 17 is"), "{}", tried(&broken));
    let mut reversed = |seed: &[DVec3]| mover.reverse(&outcome, seed, exact).unwrap_err().to_string();
    let short = reversed(&vec![DVec3::ZERO; n_vertices - 1]);
    assert!(short.contains(&format!("has {n_vertices} vertices, but the seed has {}", n_vertices - 1)), "{short}");
    let mut seed = vec![DVec3::ZERO; n_vertices];
    seed[3].x = f64::INFINITY;
    assert!(reversed(&seed).contains("the seed: vector 3 is"), "{}", reversed(&seed));
    let mut other = wing(None, 1);
    assert!(matches!(refusal(&mut other, &outcome, exact), ProductError::OtherMover));
}

/// A relaxation that runs out of sweeps gives no product, of an update as of a product.
#[test]
fn what_does_not_converge_has_no_product() {
    let limited = |max_sweeps| {
        let mesh = formats::read(&file("tests/data/pitch-wing.msh.gz")).unwrap().mesh;
        let builder = Mover::builder(mesh).role("wing", Role::Prescribed).role("farfield", Role::Fixed);
        builder
            .stopping(Stopping { max_sweeps, ..Stopping::default() })
            .quality(None)
            .max_steps(1)
            .build(cpu())
            .unwrap()
    };
    let mut mover = limited(3);
    let outcome = mover.update(&pitched(&mover, 5.0)).unwrap();
    assert!(!outcome.converged);
    assert_eq!(outcome.differentiable(), Err(NotDifferentiable::Unconverged));
    // An update to 1e-4 takes some seven cycles in each network, a product to 1e-8 some eleven.
    let mut mover = limited(9);
    let outcome = mover.update(&pitched(&mover, 5.0)).unwrap();
    assert!(outcome.converged, "{:?}", outcome.unconverged);
    match mover.reverse(&outcome, &seed(&mover), Derivative::Exact).map(|_| ()) {
        Err(ProductError::NotConverged { sweeps, error }) => assert!(sweeps <= 18 && error > 1e-8, "{sweeps} {error}"),
        other => panic!("{other:?}"),
    }
}

/// A wing pressed onto a line: about the line every rotation fits.
#[test]
fn a_surface_pressed_to_a_line_has_no_derivative() {
    let mut mover = wing(None, 1);
    let outcome = mover.update(&by(&mover, |at| DVec3::X * at.x - at)).unwrap();
    match refusal(&mut mover, &outcome, Derivative::Exact) {
        ProductError::NotDifferentiable(NotDifferentiable::Rotation { vertex, position }) => {
            assert_eq!(mover.mesh().vertices[vertex as usize], position);
            assert!(mover.family_vertices("wing").unwrap().contains(&vertex));
        }
        other => panic!("{other}"),
    }
}
