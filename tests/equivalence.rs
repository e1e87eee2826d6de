//! The same aircraft written in another order or relaxed in another way moves the same.

mod common;

use common::aircraft::*;
use common::brick::noise;
use common::{compare, compare_by};
use glam::DVec3;
use idmesh::mesh::{FamilyId, TetMesh};
use idmesh::mover::Outcome;
use idmesh::quality;
use idmesh::relaxation::{Method, Stopping};

fn largest(displacement: &[DVec3]) -> f64 {
    displacement.iter().map(|d| d.length()).fold(0.0, f64::max)
}

/// `0..n` in an order without order.
fn shuffled(n: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| noise(a).total_cmp(&noise(b)));
    order
}

fn pick<T: Copy>(items: &[T], order: &[usize]) -> Vec<T> {
    order.iter().map(|&index| items[index]).collect()
}

/// The same mesh with its vertices, tets, triangles and families in another order, tets begun at
/// another corner and triangles turned over; and the old number of each vertex.
fn rewritten(mesh: &TetMesh) -> (TetMesh, Vec<usize>) {
    let order = shuffled(mesh.vertices.len());
    let mut new_number = vec![0; order.len()];
    order.iter().enumerate().for_each(|(new, &old)| new_number[old] = new as u32);
    let renumbered = |vertex: u32| new_number[vertex as usize];
    let tets = pick(&mesh.tets, &shuffled(mesh.tets.len()));
    let triangles = shuffled(mesh.triangles.len());
    let n_families = mesh.families.len() as u16;
    let rewritten = TetMesh {
        vertices: pick(&mesh.vertices, &order),
        // (b c a d) is an even permutation of (a b c d): the volume keeps its sign.
        tets: tets.into_iter().map(|[a, b, c, d]| [b, c, a, d].map(renumbered)).collect(),
        triangles: pick(&mesh.triangles, &triangles).into_iter().map(|[a, b, c]| [c, b, a].map(renumbered)).collect(),
        triangle_family: pick(&mesh.triangle_family, &triangles)
            .into_iter()
            .map(|family| FamilyId(n_families - 1 - family.0))
            .collect(),
        families: mesh.families.iter().rev().cloned().collect(),
    };
    (rewritten, order)
}

#[test]
fn numbering_does_not_matter() {
    for (aircraft, set) in [(SMALL, "big_2"), (SMALL, "planform_2"), (WING_BODY, "planform_2"), (ROUND, "big_2")] {
        let exact = |mesh: TetMesh| {
            // The order decides after which sweep to stop; further on this makes no difference.
            let stopping = Stopping { tolerance: 1e-9, ..Stopping::default() };
            builder(mesh, aircraft.profiles("old_2")).stopping(stopping).build(cpu()).unwrap()
        };
        let mut straight = exact(aircraft.mesh());
        let (mesh, order) = rewritten(straight.mesh());
        let mut rewritten = exact(mesh);
        let found = update(&mut rewritten, aircraft.profiles(set));
        // What comes out is in the order of what went in.
        let betas = quality::betas(found.vertices(), &rewritten.mesh().tets);
        assert!(betas.iter().zip(&found.beta).all(|(of_mesh, found)| (of_mesh - found).abs() < 1e-9), "{set}");
        let expected = pick(update(&mut straight, aircraft.profiles(set)).displacement(), &order);
        if let Err(mismatch) = compare(&expected, found.displacement(), 1e-6 * largest(&expected)) {
            panic!("{set}: {mismatch:?}, largest {}", largest(&expected));
        }
        // The order is another one: vertex by vertex the two have nothing in common.
        let unsorted =
            straight.mesh().vertices.iter().zip(&order).filter(|&(at, &old)| *at == straight.mesh().vertices[old]);
        assert!(unsorted.count() < 10);
    }
}

fn relaxed(aircraft: Aircraft, method: Method, stopping: Stopping, set: &str) -> Outcome {
    let builder = aircraft.builder(aircraft.profiles("old_2")).method(method).stopping(stopping);
    update(&mut builder.build(cpu()).unwrap(), aircraft.profiles(set))
}

fn exact(aircraft: Aircraft, set: &str) -> Outcome {
    let outcome = relaxed(aircraft, Method::Chebyshev, Stopping { tolerance: 1e-10, max_sweeps: 1_000_000 }, set);
    assert!(outcome.converged, "{:?}", outcome.unconverged);
    outcome
}

/// Shortest edge at each vertex.
fn shortest_edges(mesh: &TetMesh) -> Vec<f64> {
    let mut shortest = vec![f64::INFINITY; mesh.vertices.len()];
    for tet in &mesh.tets {
        for (i, &a) in tet.iter().enumerate() {
            for &b in &tet[i + 1..] {
                let length = mesh.vertices[a as usize].distance(mesh.vertices[b as usize]);
                for vertex in [a, b] {
                    shortest[vertex as usize] = shortest[vertex as usize].min(length);
                }
            }
        }
    }
    shortest
}

/// The tolerance bounds each vertex's distance from its converged place as a fraction of its
/// shortest edge. The carenage stage, and with it what is around, ends within ten times that.
fn check_accuracy(aircraft: Aircraft, set: &str, runs: &[(Method, f64)]) {
    let mesh = aircraft.mesh();
    let edges = shortest_edges(&mesh);
    let mut allowed: Vec<f64> = edges.iter().map(|edge| 10.0 * edge).collect();
    for vertex in ["wing", "trailing_edge", "wingtip"].iter().flat_map(|family| vertices_of(&mesh, family)) {
        allowed[vertex] = edges[vertex];
    }
    let exact = exact(aircraft, set);
    for &(method, tolerance) in runs {
        let found = relaxed(aircraft, method, Stopping { tolerance, ..Stopping::default() }, set);
        assert!(found.converged, "{set} {method:?} {tolerance:e}: {:?}", found.unconverged);
        compare_by(exact.displacement(), found.displacement(), |vertex| tolerance * allowed[vertex])
            .unwrap_or_else(|mismatch| panic!("{set} {method:?} {tolerance:e}: {mismatch:?}"));
    }
}

#[test]
fn each_method_comes_as_near_as_the_tolerance_says() {
    let each = [Method::Jacobi, Method::Chebyshev, Method::Multigrid];
    let runs: Vec<_> =
        each.iter().flat_map(|&method| [1e-2, 1e-3, 1e-4, 1e-5, 1e-6].map(|tolerance| (method, tolerance))).collect();
    for set in ["small_2", "big_2", "planform_2"] {
        check_accuracy(SMALL, set, &runs);
    }
    for set in ["big_2", "planform_2"] {
        check_accuracy(
            WING_BODY,
            set,
            &[(Method::Jacobi, 1e-4), (Method::Chebyshev, 1e-4), (Method::Chebyshev, 1e-3), (Method::Multigrid, 1e-4)],
        );
    }
}

/// Out of sweeps is a result: it says which stages, and coordinates stay numbers.
#[test]
fn too_few_sweeps_are_reported() {
    let outcome = relaxed(SMALL, Method::Jacobi, Stopping { tolerance: 1e-4, max_sweeps: 3 }, "planform_2");
    assert!(!outcome.converged);
    for stage in ["wing", "volume"] {
        assert!(outcome.unconverged.iter().any(|&(name, _)| name == stage), "{stage}: {:?}", outcome.unconverged);
    }
    assert!(outcome.unconverged.iter().all(|(_, error)| *error > 1e-4), "{:?}", outcome.unconverged);
    assert!(outcome.vertices().iter().all(|at| at.is_finite()));
}

/// The carenage stage once went by how far its vertices moved in the last round, also when that
/// round ran out of sweeps.
#[test]
fn a_carenage_out_of_sweeps_is_reported() {
    let stopping = Stopping { tolerance: 1e-4, max_sweeps: 3 };
    let outcome = relaxed(WING_BODY, Method::Jacobi, stopping, "big_2");
    let exact = exact(WING_BODY, "big_2");
    let mesh = WING_BODY.mesh();
    let edges = shortest_edges(&mesh);
    let off = |vertex: usize| outcome.displacement()[vertex].distance(exact.displacement()[vertex]) / edges[vertex];
    if vertices_of(&mesh, "carenage").into_iter().any(|vertex| off(vertex) > 0.5) {
        let named = outcome.unconverged.iter().any(|&(stage, _)| stage == "carenage");
        assert!(named, "the carenage is not named: {:?}", outcome.unconverged);
    }
}
