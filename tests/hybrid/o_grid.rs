//! An O-grid of hexahedra pitches: its layers, its relaxation and its faults.

use super::*;

/// An O-grid of hexahedra alone around an elliptic wing between two planes: 40 cells around, 24
/// layers from 1e-5 to some ten chords, 4 along the span.
pub fn o_grid() -> (TetMesh, OtherCells) {
    const AROUND: u32 = 40;
    const LAYERS: u32 = 24;
    const ALONG: u32 = 4;
    let growth: f64 = 1.75;
    let mut vertices = Vec::new();
    for along in 0..=ALONG {
        for layer in 0..=LAYERS {
            let height = 1e-5 * (growth.powi(layer as i32) - 1.0) / (growth - 1.0);
            for around in 0..AROUND {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(around) / f64::from(AROUND)).sin_cos();
                // Points on the ellipse, and away from it along its normal.
                let normal = DVec3::new(cos / 0.5, 0.0, sin / 0.1).normalize();
                let at = DVec3::new(0.5 * cos, f64::from(along) / f64::from(ALONG), 0.1 * sin);
                vertices.push(at + height * normal);
            }
        }
    }
    let id = |along: u32, layer: u32, around: u32| (along * (LAYERS + 1) + layer) * AROUND + around % AROUND;
    let mut others = OtherCells::default();
    let mut add = |face: [u32; 4], family: u16| {
        others.quadrilaterals.push(face);
        others.quadrilateral_family.push(FamilyId(family));
    };
    let mut hexahedra = Vec::new();
    for around in 0..AROUND {
        for along in 0..ALONG {
            let side = |layer: u32| {
                [
                    id(along, layer, around),
                    id(along, layer, around + 1),
                    id(along + 1, layer, around + 1),
                    id(along + 1, layer, around),
                ]
            };
            for layer in 0..LAYERS {
                let ([a, b, c, d], [e, f, g, h]) = (side(layer), side(layer + 1));
                hexahedra.push([a, d, c, b, e, h, g, f]);
            }
            add(side(0), 0);
            add(side(LAYERS), 1);
        }
        for layer in 0..LAYERS {
            for (along, family) in [(0, 2), (ALONG, 3)] {
                let at = |layer: u32, around: u32| id(along, layer, around);
                add(
                    [at(layer, around), at(layer, around + 1), at(layer + 1, around + 1), at(layer + 1, around)],
                    family,
                );
            }
        }
    }
    others.hexahedra = hexahedra;
    let families = ["wing", "farfield", "symmetry", "tip_plane"].map(str::to_owned).to_vec();
    (TetMesh { vertices, families, ..TetMesh::default() }, others)
}

pub fn o_grid_builder(mesh: &TetMesh, others: &OtherCells) -> MoverBuilder {
    Mover::builder(mesh.clone())
        .other_cells(others.clone())
        .role("wing", Role::Prescribed)
        .role("farfield", Role::Fixed)
        .role("symmetry", Role::PLANE)
        .role("tip_plane", Role::PLANE)
        .method(Method::Chebyshev)
}

/// Pitched wings: the layers turn with the wing as a body, and the planes stay flat.
pub fn pitch(mover: &mut Mover, degrees: f64) -> Outcome {
    let (sin, cos) = f64::to_radians(degrees).sin_cos();
    let turn = |at: DVec3| DVec3::new(at.x * cos + at.z * sin, at.y, at.z * cos - at.x * sin);
    let vertices = mover.family_vertices("wing").unwrap();
    let by = vertices.iter().map(|&vertex| mover.mesh().vertices[vertex as usize]).map(|at| turn(at) - at).collect();
    mover.update(&Design::of_prescribed("wing", by)).unwrap()
}

#[test]
fn the_layers_of_an_o_grid_turn_with_the_wing() {
    let (mesh, others) = o_grid();
    let hybrid = HybridMesh { mesh: &mesh, others: &others };
    validate(hybrid).unwrap();
    let mut mover = o_grid_builder(&mesh, &others).build(cpu()).unwrap();
    let before = jacobians(hybrid, &mesh.vertices)["hexahedron"];
    for degrees in [20.0, 60.0] {
        let outcome = pitch(&mut mover, degrees);
        let moved = outcome.valid().unwrap().vertices();
        let (low, high) = range(&layers(hybrid, &["wing"], moved));
        assert!(low > 0.999 && high < 1.001, "{degrees}: {low} {high}");
        assert!(jacobians(hybrid, moved)["hexahedron"] > 0.5 * before, "{degrees}");
        // The first vertices over the wing are where the turned wing carries them.
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        for around in 0..40 {
            for first in [1040, 2040 + 1000] {
                let vertex: usize = first + around;
                let at = mesh.vertices[vertex];
                let expected = DVec3::new(at.x * cos + at.z * sin, at.y, at.z * cos - at.x * sin);
                assert!(moved[vertex].distance(expected) < 1e-7, "{degrees}: {vertex}");
            }
        }
        for (vertex, at) in moved.iter().enumerate() {
            let plane = mesh.vertices[vertex].y;
            assert!((plane != 0.0 && plane != 1.0) || at.y == plane, "{vertex} left its plane");
        }
    }
    assert!(outcome_of_a_mesh_without_tets_has_no_beta(&mut mover));
}

/// Far from the wing the cells of an O-grid are shorter across the planes than within them, so the
/// strong springs of the planes' vertices lead off the planes. Cycles correct these vertices too.
#[test]
fn multigrid_takes_few_cycles_on_an_o_grid() {
    let (mesh, others) = o_grid();
    let mover = |method| {
        let stopping = Stopping { tolerance: 1e-9, ..Stopping::default() };
        o_grid_builder(&mesh, &others).method(method).stopping(stopping).build(cpu()).unwrap()
    };
    let [cycles, sweeps] = [Method::Multigrid, Method::Chebyshev].map(|method| pitch(&mut mover(method), 20.0));
    assert!(cycles.solver.sweeps <= 45, "{} cycles", cycles.solver.sweeps);
    let apart = cycles.vertices().iter().zip(sweeps.vertices()).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(apart < 1e-8, "{apart}");
}

fn outcome_of_a_mesh_without_tets_has_no_beta(mover: &mut Mover) -> bool {
    let outcome = pitch(mover, 5.0);
    outcome.beta.is_empty() && outcome.stages.iter().all(|stage| stage.beta_min.is_nan()) && outcome.is_valid()
}

/// A surface that no volume fits: the result says so, with the kind, the cell, the corner and the
/// place.
#[test]
fn bad_corners_are_told() {
    let (mesh, others) = o_grid();
    let mut mover = o_grid_builder(&mesh, &others).quality(None).max_steps(1).build(cpu()).unwrap();
    let vertices = mover.family_vertices("wing").unwrap();
    // The wing is turned inside out.
    let by = vertices.iter().map(|&vertex| -1.9 * mesh.vertices[vertex as usize] * DVec3::new(1.0, 0.0, 0.0)).collect();
    let outcome = mover.update(&Design::of_prescribed("wing", by)).unwrap();
    assert!(!outcome.is_valid() && outcome.inverted > 0);
    let message = outcome.check().unwrap_err().to_string();
    assert!(message.contains(&format!("{} of 3840 cells are inverted", outcome.inverted)), "{message}");
    assert!(message.contains("the first is hexahedron ") && message.contains("whose corner at vertex "), "{message}");
    let shown = outcome.cell_measures.as_ref().unwrap().iter().filter(|cell| cell.jacobian <= 0.0).count();
    assert!(shown > 0 && shown <= outcome.inverted);
}

/// Where springs keep the shapes, local optimisation spares the layers.
#[test]
fn local_optimisation_spares_layers() {
    let (mesh, others) = o_grid();
    let mut mover = o_grid_builder(&mesh, &others).build(cpu()).unwrap();
    let outcome = pitch(&mut mover, 20.0);
    assert!(outcome.smoothed.is_none(), "{:?}", outcome.smoothed);
    let (low, high) = range(&layers(HybridMesh { mesh: &mesh, others: &others }, &["wing"], outcome.vertices()));
    assert!(low > 0.999 && high < 1.001);
}

/// Twists the wing's tip against its root.
fn twist(mover: &mut Mover, degrees: f64) -> Outcome {
    let twisted = |at: DVec3| {
        let (sin, cos) = f64::to_radians(degrees * at.y.powi(3)).sin_cos();
        DVec3::new(at.x * cos + at.z * sin, at.y, at.z * cos - at.x * sin)
    };
    let vertices = mover.family_vertices("wing").unwrap();
    let by = vertices.iter().map(|&vertex| mover.mesh().vertices[vertex as usize]).map(|at| twisted(at) - at).collect();
    mover.update(&Design::of_prescribed("wing", by)).unwrap()
}

/// Twists by which a jump inverts a few corners, and by which half of the second does so too.
const TWISTS: [f64; 2] = [57.0, 70.0];

/// A wing twisted so that a jump, or a step, inverts corners of its layers: shorter steps keep the
/// first layer, which local optimisation of the jump would make up to twice as thick.
///
/// Fails if local optimisation comes before steps, or before a shorter step.
#[test]
fn steps_come_before_local_optimisation() {
    let (mesh, others) = o_grid();
    let mut mover = o_grid_builder(&mesh, &others).build(cpu()).unwrap();
    for degrees in TWISTS {
        let outcome = twist(&mut mover, degrees);
        assert!(outcome.path.steps > 1, "{degrees}: {:?}", outcome.path);
        let moved = outcome.valid().unwrap().vertices();
        let (low, high) = range(&layers(HybridMesh { mesh: &mesh, others: &others }, &["wing"], moved));
        assert!(low > 0.9 && high < 1.1, "{degrees}: {low} {high}");
    }
}

/// Where no further step may be tried, local optimisation mends a few bad corners of the jump.
///
/// Fails if it runs only where a path has reached its end.
#[test]
fn local_optimisation_follows_a_path_that_does_not_end() {
    let (mesh, others) = o_grid();
    let mut mover = o_grid_builder(&mesh, &others).max_steps(2).build(cpu()).unwrap();
    let outcome = twist(&mut mover, TWISTS[0]);
    assert_eq!((outcome.path.steps, outcome.path.given_up), (1, 1));
    assert!(outcome.is_valid() && outcome.smoothed.is_some_and(|smoothed| smoothed.moved > 0));
}

/// Where the jump does not converge and leaves bad cells, no path of steps follows, whose steps
/// would not converge either. The hint names the other method.
#[test]
fn a_jump_that_does_not_converge_is_the_only_one() {
    let (mesh, others) = o_grid();
    for (method, other) in [(Method::Chebyshev, "multigrid"), (Method::Multigrid, "chebyshev")] {
        let stopping = Stopping { max_sweeps: 2, ..Stopping::default() };
        let builder = o_grid_builder(&mesh, &others).method(method).stopping(stopping);
        let outcome = pitch(&mut builder.build(cpu()).unwrap(), 60.0);
        assert!(outcome.inverted > 0 && !outcome.converged);
        assert_eq!((outcome.path.steps, outcome.path.given_up), (1, 0), "{:?}", outcome.path);
        let refused = outcome.check().unwrap_err();
        let expected = format!("try method = \"{other}\", or raise max_sweeps or tolerance in [solver]");
        assert!(refused.hint.as_ref().is_some_and(|hint| hint.contains(&expected)), "{refused:?}");
    }
}
