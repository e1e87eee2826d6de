//! Relaxation against closed forms, a direct solution and invariants.

#[path = "common/meshes.rs"]
mod meshes;

use glam::DVec3;
use idmesh::{
    backend::{
        Constraint,
        cpu::{CpuBackend, Precision},
    },
    mesh::edges::{TetEdges, VertexGraph},
    relaxation::{Convergence, Method, Network, Relaxer, Spectrum, Stopping},
};
use nalgebra::{DMatrix, DVector};

const TIGHT: Stopping = Stopping { tolerance: 1e-12, max_sweeps: 1_000_000 };

fn relax(
    network: &Network,
    start: &[DVec3],
    method: Method,
    precision: Precision,
    stopping: Stopping,
) -> (Vec<DVec3>, Convergence) {
    let mut displacement = start.to_vec();
    let mut relaxer = Relaxer::new(network.clone(), &CpuBackend::new(precision), method).unwrap();
    let convergence = relaxer.relax(&mut displacement, None, &stopping).unwrap();
    (displacement, convergence)
}

fn chain(stiffness: &[f64], anchor: &[f64], held: &[usize]) -> Network {
    let n = stiffness.len() + 1;
    let edges: Vec<[u32; 2]> = (0..stiffness.len() as u32).map(|i| [i, i + 1]).collect();
    let constraint = (0..n).map(|i| if held.contains(&i) { Constraint::Held } else { Constraint::Free }).collect();
    Network::new(&VertexGraph::new(n, &edges), stiffness, &vec![1.0; n - 1], constraint, anchor.to_vec())
}

/// Springs in series share a pull: the displacement along a chain grows with the compliance 1/k.
#[test]
fn a_chain_between_held_ends_stretches_by_its_compliance() {
    let stiffness = [1.0, 0.25, 2.0, 0.5];
    let network = chain(&stiffness, &[0.0; 5], &[0, 4]);
    let mut start = vec![DVec3::ZERO; 5];
    start[4] = DVec3::new(1.0, -2.0, 0.5);
    let total: f64 = stiffness.iter().map(|k| 1.0 / k).sum();
    for method in [Method::Jacobi, Method::Chebyshev] {
        for precision in [Precision::F64, Precision::F32] {
            let (moved, convergence) = relax(&network, &start, method, precision, TIGHT);
            assert!(convergence.converged, "{method:?} {precision:?} {convergence:?}");
            let mut along = 0.0;
            for (i, moved) in moved.iter().enumerate() {
                assert!((*moved - start[4] * (along / total)).length() < 1e-11, "{method:?} {precision:?} {i}");
                along += stiffness.get(i).map_or(0.0, |k| 1.0 / k);
            }
        }
    }
}

/// One free vertex between 0 and 1 with springs 3 and 1 and an anchor of 4: u = 1 * 1 / (3 + 1 + 4).
#[test]
fn an_anchor_pulls_back_by_its_share() {
    let network = chain(&[3.0, 1.0], &[0.0, 4.0, 0.0], &[0, 2]);
    let start = [DVec3::ZERO, DVec3::ZERO, DVec3::X];
    let (moved, _) = relax(&network, &start, Method::Chebyshev, Precision::F64, TIGHT);
    assert!((moved[1] - DVec3::X / 8.0).length() < 1e-13);
    assert_eq!((moved[0], moved[2]), (start[0], start[2]), "held vertices keep their bits");
}

fn brick_network(n: usize, constraint: impl Fn(DVec3) -> Constraint) -> (Vec<DVec3>, Network) {
    let mesh = meshes::brick(n);
    let edges = TetEdges::new(mesh.vertices.len(), &mesh.tets).edges;
    let length: Vec<f64> =
        edges.iter().map(|[a, b]| mesh.vertices[*a as usize].distance(mesh.vertices[*b as usize])).collect();
    // Uneven springs: nothing here should rest on a uniform mesh.
    let stiffness: Vec<f64> = length.iter().enumerate().map(|(edge, l)| (1.0 + (edge % 7) as f64) / l).collect();
    let graph = VertexGraph::new(mesh.vertices.len(), &edges);
    let constraint = mesh.vertices.iter().map(|&at| constraint(at)).collect();
    let network = Network::new(&graph, &stiffness, &length, constraint, vec![0.0; mesh.vertices.len()]);
    (mesh.vertices, network)
}

fn on_boundary(at: DVec3) -> bool {
    at.min_element() == 0.0 || at.max_element() == 1.0
}

fn hold_boundary(at: DVec3) -> Constraint {
    if on_boundary(at) { Constraint::Held } else { Constraint::Free }
}

/// Fails if `MARGIN` of `spectrum` is 0.7.
#[test]
fn a_translated_boundary_translates_everything() {
    let (positions, network) = brick_network(5, hold_boundary);
    let shift = DVec3::new(0.3, -4.0, 1e-3);
    let start: Vec<DVec3> = positions.iter().map(|&at| if on_boundary(at) { shift } else { DVec3::ZERO }).collect();
    for method in [Method::Jacobi, Method::Chebyshev] {
        let (moved, _) = relax(&network, &start, method, Precision::F64, TIGHT);
        assert!(moved.iter().all(|u| (*u - shift).length() < 1e-12 * 4.0));
    }
}

/// The relaxation against a dense direct solution, and its own estimate of the error against the real one.
#[test]
fn relaxation_agrees_with_a_direct_solution_and_knows_its_error() {
    let (positions, network) = brick_network(6, hold_boundary);
    let start: Vec<DVec3> = positions
        .iter()
        .map(|&at| if on_boundary(at) { DVec3::new(at.x * at.y, at.z.sin(), at.x - at.y * at.z) } else { DVec3::ZERO })
        .collect();
    let n = network.len();
    let mut matrix = DMatrix::zeros(n, n);
    for row in 0..n {
        if network.constraint[row] == Constraint::Held {
            matrix[(row, row)] = 1.0;
            continue;
        }
        for (entry, &neighbour) in network.graph.range(row).zip(network.graph.row(row)) {
            matrix[(row, row)] += network.stiffness[entry];
            matrix[(row, neighbour as usize)] -= network.stiffness[entry];
        }
    }
    let lu = matrix.lu();
    let exact: Vec<DVector<f64>> =
        (0..3).map(|axis| lu.solve(&DVector::from_fn(n, |row, _| start[row][axis])).unwrap()).collect();
    for method in [Method::Jacobi, Method::Chebyshev] {
        for precision in [Precision::F64, Precision::F32] {
            for tolerance in [1e-2, 1e-4, 1e-6, 1e-12] {
                let (moved, convergence) = relax(&network, &start, method, precision, Stopping { tolerance, ..TIGHT });
                assert!(convergence.converged && convergence.error <= tolerance, "{convergence:?}");
                let error = (0..n)
                    .map(|row| {
                        let exact = DVec3::new(exact[0][row], exact[1][row], exact[2][row]);
                        (moved[row] - exact).length() * network.inverse_length[row]
                    })
                    .fold(0.0, f64::max);
                // The estimate extrapolates a geometric series: allow it a factor of three, and the direct solution 1e-13.
                assert!(error <= 3.0 * tolerance + 1e-12, "{method:?} {precision:?} {tolerance:e}: {error:e}");
            }
        }
    }
}

/// Where the relaxation stops, the closed form is no farther than the relaxation says: a chain of equal springs stretches
/// evenly. Long chains relax slowly, so an estimate taken from the last change alone falls short.
/// Fails if the estimate is a tenth of itself.
#[test]
fn what_is_left_is_no_more_than_is_said() {
    for length in [20, 60, 150] {
        let network = chain(&vec![1.0; length], &vec![0.0; length + 1], &[0, length]);
        let pull = DVec3::new(1.0, -2.0, 0.5);
        let mut start = vec![DVec3::ZERO; length + 1];
        start[length] = pull;
        for method in [Method::Jacobi, Method::Chebyshev, Method::Multigrid] {
            for tolerance in [3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-6] {
                let stopping = Stopping { tolerance, ..TIGHT };
                let (moved, convergence) = relax(&network, &start, method, Precision::F64, stopping);
                assert!(convergence.converged, "{length} {method:?} {convergence:?}");
                // Every edge has length 1, so displacements are fractions of the shortest edge.
                let even = |i: usize| pull * (i as f64 / length as f64);
                let left = (0..=length).map(|i| moved[i].distance(even(i))).fold(0.0, f64::max);
                assert!(left <= convergence.error, "{length} {method:?}: {left:e} is left, {convergence:?}");
            }
        }
    }
}

/// Fails if `MARGIN` of `spectrum` is 2.
#[test]
fn the_spectrum_encloses_the_eigenvalues() {
    let (_, network) = brick_network(5, hold_boundary);
    let free: Vec<usize> = (0..network.len()).filter(|&row| network.constraint[row] == Constraint::Free).collect();
    let total = |row: usize| network.stiffness[network.graph.range(row)].iter().sum::<f64>();
    let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| {
        let (a, b) = (free[i], free[j]);
        let coupling = network.graph.range(a).find(|&entry| network.graph.entries[entry] as usize == b);
        let coupling = coupling.map_or(0.0, |entry| network.stiffness[entry]);
        (i == j) as u8 as f64 - coupling / (total(a) * total(b)).sqrt()
    });
    let eigenvalues = nalgebra::SymmetricEigen::new(matrix).eigenvalues;
    let spectrum = Spectrum::new(&network).unwrap();
    assert!(
        spectrum.low <= eigenvalues.min() && spectrum.low > 0.5 * eigenvalues.min(),
        "{spectrum:?} {}",
        eigenvalues.min()
    );
    assert!(spectrum.high >= eigenvalues.max() && spectrum.high <= 2.0, "{spectrum:?} {}", eigenvalues.max());
}

/// Vertices of the plane x = 0 slide in it, those of its edge along the line, also in f32 and at any orientation.
#[test]
fn planes_and_lines_are_kept_exactly() {
    let (positions, network) = brick_network(5, |at| match (at.x == 0.0, at.y == 0.0) {
        _ if at.x == 1.0 => Constraint::Held,
        (true, true) => Constraint::OnLine(DVec3::Z),
        (true, false) => Constraint::InPlane(DVec3::X),
        _ => Constraint::Free,
    });
    let start: Vec<DVec3> =
        positions.iter().map(|at| if at.x == 1.0 { DVec3::new(0.1, 0.2, at.y * 0.3) } else { DVec3::ZERO }).collect();
    for precision in [Precision::F64, Precision::F32] {
        let (moved, convergence) = relax(&network, &start, Method::Chebyshev, precision, Stopping::default());
        assert!(convergence.converged);
        for (at, u) in positions.iter().zip(&moved) {
            if at.x == 0.0 {
                assert_eq!(u.x, 0.0);
                assert!(u.z != 0.0, "the plane's vertices do slide");
                if at.y == 0.0 {
                    assert_eq!(u.y, 0.0);
                }
            }
        }
    }
}

#[test]
fn a_part_that_nothing_holds_stays() {
    let edges = [[0, 1], [2, 3]];
    let constraint = vec![Constraint::Held, Constraint::Free, Constraint::Free, Constraint::Free];
    let network = Network::new(&VertexGraph::new(4, &edges), &[1.0, 1.0], &[1.0, 1.0], constraint, vec![0.0; 4]);
    let (moved, convergence) =
        relax(&network, &[DVec3::X, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO], Method::Jacobi, Precision::F64, TIGHT);
    assert!(convergence.converged);
    assert!((moved[1] - DVec3::X).length() < 1e-12);
    assert_eq!(moved[2..], [DVec3::ZERO; 2]);
}

#[test]
fn running_out_of_sweeps_is_a_result() {
    let (positions, network) = brick_network(6, hold_boundary);
    let start: Vec<DVec3> = positions.iter().map(|&at| if on_boundary(at) { at } else { DVec3::ZERO }).collect();
    let (_, convergence) =
        relax(&network, &start, Method::Jacobi, Precision::F64, Stopping { tolerance: 1e-9, max_sweeps: 5 });
    assert!(!convergence.converged && convergence.sweeps == 5, "{convergence:?}");
}

#[test]
fn at_rest_nothing_is_swept() {
    let (positions, network) = brick_network(3, hold_boundary);
    let (moved, convergence) =
        relax(&network, &vec![DVec3::ZERO; positions.len()], Method::Chebyshev, Precision::F64, TIGHT);
    assert_eq!((convergence.sweeps, convergence.converged), (0, true));
    assert!(moved.iter().all(|u| *u == DVec3::ZERO));
}
