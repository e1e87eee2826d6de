//! Multigrid cycles against direct solutions and Chebyshev sweeps, and what a cycle is worth on any
//! mesh.

mod common;
#[path = "common/meshes.rs"]
mod meshes;

use common::aircraft::{Anyway, WING_BODY, cpu, update};
use common::brick::noise;
use common::compare_by;
use glam::DVec3;
use idmesh::{
    backend::{
        Backend, EdgeStiffness, Sweep,
        cpu::{CpuBackend, Precision},
    },
    constraint::Constraint,
    mesh::edges::{TetEdges, VertexGraph},
    relaxation::{Convergence, FreeRows, Method, Network, Relaxer, Stopping, multigrid::Hierarchy},
    springs::{Length, Stiffness, Torsion},
};
use nalgebra::{DMatrix, DVector};

const F64: CpuBackend = CpuBackend { precision: Precision::F64 };
const TIGHT: Stopping = Stopping { tolerance: 1e-11, max_sweeps: 100 };

/// Springs of any kind on the brick of `n` cubes a side, its vertices moved by `place`.
fn network(
    n: usize,
    (length, torsion): (Length, Torsion),
    place: impl Fn(DVec3) -> DVec3,
    constraint: impl Fn(DVec3) -> Constraint,
) -> (Vec<DVec3>, Network) {
    let mesh = meshes::brick(n);
    let points: Vec<DVec3> = mesh.vertices.iter().map(|&at| place(at)).collect();
    let TetEdges { edges, edge_tets, tet_edges } = TetEdges::new(points.len(), &mesh.tets);
    let edge_vector: Vec<DVec3> = edges.iter().map(|[a, b]| points[*b as usize] - points[*a as usize]).collect();
    let input = EdgeStiffness { edge_vector: &edge_vector, edge_tets: &edge_tets, tet_edges: &tet_edges };
    let sums = F64.edge_stiffness(&input).unwrap();
    let lengths: Vec<f64> = edge_vector.iter().map(|vector| vector.length()).collect();
    let of = Stiffness { length, torsion, wall: 0.0 };
    let stiffness: Vec<f64> = lengths.iter().zip(sums).map(|(&length, sum)| of.on_wall(length, sum)).collect();
    let constraint = mesh.vertices.iter().map(|&at| constraint(at)).collect();
    let graph = VertexGraph::new(points.len(), &edges);
    (mesh.vertices, Network::new(&graph, &stiffness, &lengths, constraint, vec![0.0; points.len()]))
}

fn on_boundary(at: DVec3) -> bool {
    at.min_element() == 0.0 || at.max_element() == 1.0
}

fn hold_boundary(at: DVec3) -> Constraint {
    if on_boundary(at) { Constraint::Held } else { Constraint::Free }
}

/// Any displacement of the held vertices.
fn start(positions: &[DVec3], network: &Network) -> Vec<DVec3> {
    let of_held = |at: &DVec3| DVec3::new(at.x * at.y, at.z.sin(), at.x - at.y * at.z);
    positions
        .iter()
        .zip(&network.constraint)
        .map(|(at, constraint)| if *constraint == Constraint::Held { of_held(at) } else { DVec3::ZERO })
        .collect()
}

fn relax(network: &Network, start: &[DVec3], method: Method, stopping: Stopping) -> (Vec<DVec3>, Convergence) {
    let mut displacement = start.to_vec();
    let mut relaxer = Relaxer::new(network.clone(), &F64, method).unwrap();
    let convergence = relaxer.relax(&mut displacement, None, &stopping).unwrap();
    (displacement, convergence)
}

fn projection(constraint: &Constraint, axis: usize) -> DVec3 {
    constraint.limit(DVec3::AXES[axis])
}

/// Equilibrium by elimination, constraints and all: `P A P u + (1 - P) u = P f`.
fn direct(network: &Network, start: &[DVec3]) -> Vec<DVec3> {
    let n = network.len();
    let mut matrix = DMatrix::<f64>::zeros(3 * n, 3 * n);
    let mut right = DVector::<f64>::zeros(3 * n);
    for row in 0..n {
        let own = &network.constraint[row];
        for axis in 0..3 {
            let allowed = projection(own, axis);
            for other in 0..3 {
                matrix[(3 * row + axis, 3 * row + other)] += if axis == other { 1.0 } else { 0.0 } - allowed[other];
            }
            if *own == Constraint::Held {
                right[3 * row + axis] = start[row][axis];
                continue;
            }
            for (entry, &neighbour) in network.graph.range(row).zip(network.graph.row(row)) {
                let k = network.stiffness[entry];
                for other in 0..3 {
                    matrix[(3 * row + axis, 3 * row + other)] += k * allowed[other];
                    matrix[(3 * row + axis, 3 * neighbour as usize + other)] -= k * allowed[other];
                }
            }
        }
    }
    let solution = matrix.lu().solve(&right).unwrap();
    (0..n).map(|row| DVec3::new(solution[3 * row], solution[3 * row + 1], solution[3 * row + 2])).collect()
}

/// Planes at an angle, a line, and everything between them.
fn slanted(at: DVec3) -> Constraint {
    match (at.x == 0.0, at.y == 0.0) {
        _ if at.x == 1.0 => Constraint::Held,
        (true, true) => Constraint::OnLine(DVec3::Z),
        (true, false) => Constraint::InPlane(DVec3::new(0.6, 0.8, 0.0)),
        (false, true) => Constraint::InPlane(DVec3::new(0.0, 0.28, 0.96)),
        _ => Constraint::Free,
    }
}

/// Fails if `FASTEST` is 0.01, `SMOOTHING` 1, `DAMPED` 0.9, or, of `aggregation`, `ALIKE` 2 or
/// `STRONG` 0.95.
#[test]
fn cycles_agree_with_a_direct_solution() {
    let warped = |at: DVec3| at * at * DVec3::new(1.0, 0.5, 2.0) + at;
    for hold in [hold_boundary as fn(DVec3) -> Constraint, slanted] {
        let (positions, network) = network(6, (Length::Inverse, Torsion::Product), warped, hold);
        let start = start(&positions, &network);
        let exact = direct(&network, &start);
        for precision in [Precision::F64, Precision::F32] {
            let mut relaxer = Relaxer::new(network.clone(), &CpuBackend::new(precision), Method::Multigrid).unwrap();
            for tolerance in [1e-2, 1e-4, 1e-6, 1e-11] {
                let mut found = start.clone();
                let convergence = relaxer.relax(&mut found, None, &Stopping { tolerance, ..TIGHT }).unwrap();
                assert!(convergence.converged && convergence.error <= tolerance, "{precision:?} {convergence:?}");
                // The estimate extrapolates a geometric series: allow it a factor of three, and the
                // solution 1e-12.
                compare_by(&exact, &found, |row| (3.0 * tolerance + 1e-12) / network.inverse_length[row].max(1e-3))
                    .unwrap_or_else(|mismatch| panic!("{precision:?} {tolerance:e}: {mismatch:?}"));
            }
        }
    }
}

/// Cycles to an error of 1e-6 edges, for springs of every kind on meshes that are even, graded a
/// thousandfold, and flattened.
///
/// Fails if, of `aggregation`, `STRONG` is 0.95 or 0, or `ANCHORED` 0.01, and if `SMOOTHING` is 1
/// or `DAMPED` 0.9.
#[test]
fn a_cycle_is_worth_as_much_on_every_mesh() {
    let even = |at: DVec3| at;
    let graded = |at: DVec3| DVec3::new(1e-3f64.powf(1.0 - at.x), at.y, at.z) + at;
    let flat = |at: DVec3| DVec3::new(at.x, at.y, 0.2 * at.z);
    let places = [("even", even as fn(DVec3) -> DVec3, 12), ("graded", graded, 14), ("flat", flat, 14)];
    for springs in
        [(Length::Inverse, Torsion::None), (Length::InverseSquare, Torsion::None), (Length::Inverse, Torsion::Product)]
    {
        for (name, place, most) in places {
            for n in [8, 16, 24] {
                let (positions, network) = network(n, springs, place, hold_boundary);
                let (_, convergence) = relax(
                    &network,
                    &start(&positions, &network),
                    Method::Multigrid,
                    Stopping { tolerance: 1e-6, ..TIGHT },
                );
                assert!(convergence.converged && convergence.sweeps <= most, "{springs:?} {name} {n}: {convergence:?}");
            }
        }
    }
}

/// Layers at a wall, a thousand times as wide as thick, that end at a symmetry plane.
///
/// Fails if, of `aggregation`, `ALIKE` is 2, `STRONG` 0.95 or 0, or `ANCHORED` 0.01.
#[test]
fn thin_layers_take_no_more_cycles() {
    let layers = |at: DVec3| DVec3::new(at.x, at.y, 1e-4f64.powf(1.0 - at.z) - 1e-4);
    let hold = |at: DVec3| match at {
        _ if at.z == 0.0 || at.max_element() == 1.0 => Constraint::Held,
        _ if at.x == 0.0 => Constraint::InPlane(DVec3::X),
        _ => Constraint::Free,
    };
    for n in [8, 16, 24] {
        for length in [Length::Inverse, Length::InverseSquare] {
            let (positions, network) = network(n, (length, Torsion::None), layers, hold);
            let stopping = Stopping { tolerance: 1e-6, ..TIGHT };
            let (_, convergence) = relax(&network, &start(&positions, &network), Method::Multigrid, stopping);
            assert!(convergence.converged && convergence.sweeps <= 22, "{length:?} {n}: {convergence:?}");
        }
    }
}

/// The equation itself tells: f32 cycles alone leave a residual of some 1e-7 of the load.
#[test]
fn cycles_of_the_reference_lose_no_digit_of_f64() {
    let (positions, whole) = network(12, (Length::Inverse, Torsion::Product), |at| at, hold_boundary);
    let network = FreeRows::new(&whole).network;
    assert!(network.len() > 1000 && network.len() < positions.len());
    let load: Vec<DVec3> =
        (0..network.len()).map(|row| DVec3::new(noise(row), noise(row + 7), noise(row + 13))).collect();
    let hierarchy = Hierarchy::new(&network);
    assert!(hierarchy.depth() >= 2);
    let mut device = F64.upload_hierarchy(&hierarchy.data(&network)).unwrap();
    device.start(&load).unwrap();
    device.sweep(&[Sweep { relaxation: 1.0, momentum: 0.0 }; 60]).unwrap();
    let pull = network.residual(&device.correction().unwrap(), None);
    let left = pull.iter().zip(&load).map(|(pull, load)| (*pull + *load).length()).fold(0.0, f64::max);
    assert!(left < 1e-13, "{left:e} of a load of 1");
}

/// Fails if `SMOOTHING` is 1 or 6, and if, of `aggregation`, `STRONG` is 0.95 or `ANCHORED` 0.01.
#[test]
fn middle_levels_are_swept_twice_as_often() {
    let (_, whole) = network(34, (Length::Inverse, Torsion::None), |at| at, hold_boundary);
    let network = FreeRows::new(&whole).network;
    let hierarchy = Hierarchy::new(&network);
    let sweeps: Vec<usize> = hierarchy.data(&network).iter().map(|level| level.sweeps.len()).collect();
    assert_eq!(sweeps[..sweeps.len() - 1], [2, 4, 2]);
}

/// Coarse networks cost less than the finest one by far.
#[test]
fn a_hierarchy_is_small() {
    let (_, network) = network(24, (Length::Inverse, Torsion::Product), |at| at, |_| Constraint::Free);
    let hierarchy = Hierarchy::new(&network);
    assert!(hierarchy.depth() >= 3);
    assert!(hierarchy.complexity(&network) < 1.4, "{}", hierarchy.complexity(&network));
}

#[test]
fn planes_and_lines_are_kept_exactly() {
    let (positions, network) = network(
        8,
        (Length::Inverse, Torsion::Product),
        |at| at,
        |at| match (at.x == 0.0, at.y == 0.0) {
            _ if at.x == 1.0 => Constraint::Held,
            (true, true) => Constraint::OnLine(DVec3::Z),
            (true, false) => Constraint::InPlane(DVec3::X),
            _ => Constraint::Free,
        },
    );
    let start = start(&positions, &network);
    let (moved, convergence) = relax(&network, &start, Method::Multigrid, Stopping::default());
    assert!(convergence.converged);
    for (row, (at, u)) in positions.iter().zip(&moved).enumerate() {
        match network.constraint[row] {
            Constraint::Held => assert_eq!(*u, start[row], "held vertices keep their bits"),
            _ if at.x == 0.0 => {
                assert_eq!(u.x, 0.0);
                assert!(u.z != 0.0, "the plane's vertices do slide");
                assert!(at.y != 0.0 || u.y == 0.0);
            }
            _ => {}
        }
    }
}

/// Nothing that may move, nothing that is tied, an anchor alone, and a vertex without springs among
/// others.
#[test]
fn odd_networks_are_relaxed() {
    let (positions, mut held) = network(4, (Length::Inverse, Torsion::None), |at| at, |_| Constraint::Held);
    let start: Vec<DVec3> = positions.clone();
    let (moved, convergence) = relax(&held, &start, Method::Multigrid, TIGHT);
    assert!(convergence.converged && convergence.sweeps == 0);
    assert_eq!(moved, start);
    held.constraint.iter_mut().for_each(|constraint| *constraint = Constraint::Held);

    let free = [Constraint::Free; 4].to_vec();
    let edges = [[0, 1], [1, 2]];
    let of = |anchor: [f64; 4]| {
        Network::new(&VertexGraph::new(4, &edges), &[1.0, 1.0], &[1.0, 1.0], free.clone(), anchor.to_vec())
    };
    let start = [DVec3::X; 4];
    let (moved, _) = relax(&of([0.0; 4]), &start, Method::Multigrid, TIGHT);
    assert_eq!(moved, start, "what floats stays");
    let (moved, convergence) = relax(&of([0.0, 2.0, 0.0, 0.0]), &start, Method::Multigrid, TIGHT);
    assert!(convergence.converged);
    assert!(moved[..3].iter().all(|u| u.length() < 1e-11), "an anchor pulls back to zero: {moved:?}");
    assert_eq!(moved[3], DVec3::X);
}

/// Vertices that no spring ties to each other but to held ones only: nothing joins, and sweeps
/// alone are exact.
#[test]
fn lonely_vertices_are_relaxed() {
    let n = 101;
    let edges: Vec<[u32; 2]> = (1..n as u32).map(|vertex| [0, vertex]).collect();
    let stiffness: Vec<f64> = (1..n).map(|vertex| 1.5 + noise(vertex)).collect();
    let mut constraint = vec![Constraint::Free; n];
    constraint[0] = Constraint::Held;
    let network = Network::new(&VertexGraph::new(n, &edges), &stiffness, &vec![1.0; n - 1], constraint, vec![0.0; n]);
    let mut start = vec![DVec3::ZERO; n];
    start[0] = DVec3::new(1.0, -2.0, 3.0);
    let (moved, convergence) = relax(&network, &start, Method::Multigrid, TIGHT);
    assert!(convergence.converged);
    assert!(moved.iter().all(|u| u.distance(start[0]) < 1e-10));
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let (positions, network) = network(20, (Length::Inverse, Torsion::Product), |at| at + 0.3 * at * at, slanted);
    let start = start(&positions, &network);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| relax(&network, &start, Method::Multigrid, Stopping::default()))
    };
    assert_eq!(with(1), with(3));
}

/// A constraint that changes does so on all levels.
#[test]
fn constraints_can_be_replaced() {
    let plane = |normal: DVec3| {
        move |at: DVec3| {
            if at.z == 1.0 {
                Constraint::Held
            } else if at.x == 0.0 {
                Constraint::InPlane(normal)
            } else {
                Constraint::Free
            }
        }
    };
    let springs = (Length::Inverse, Torsion::None);
    let (positions, first) = network(6, springs, |at| at, plane(DVec3::X));
    let (_, second) = network(6, springs, |at| at, plane(DVec3::new(0.6, -0.8, 0.0)));
    let start = start(&positions, &second);
    let mut relaxer = Relaxer::new(first, &F64, Method::Multigrid).unwrap();
    relaxer.constrain(second.constraint.clone()).unwrap();
    let mut found = start.clone();
    assert!(relaxer.relax(&mut found, None, &TIGHT).unwrap().converged);
    compare_by(&direct(&second, &start), &found, |_| 1e-10).unwrap();
}

/// A whole run on a wing-body with its symmetry plane, by cycles and by sweeps.
#[test]
fn whole_runs_agree_with_chebyshev() {
    let run = |method, tolerance| {
        let stopping = Stopping { tolerance, ..Stopping::default() };
        let builder = WING_BODY.builder(WING_BODY.profiles("old_2")).method(method).stopping(stopping);
        let outcome = update(&mut builder.build(cpu()).unwrap(), WING_BODY.profiles("big_2"));
        assert!(outcome.converged, "{method:?} {:?}", outcome.unconverged);
        outcome
    };
    let exact = run(Method::Chebyshev, 1e-8);
    let found = run(Method::Multigrid, 1e-6);
    assert_eq!((exact.solver.method.as_str(), found.solver.method.as_str()), ("chebyshev", "multigrid"));
    // Two relaxations.
    assert!(found.solver.sweeps <= 24, "{:?}", found.solver);
    let largest = exact.displacement().iter().map(|u| u.length()).fold(0.0, f64::max);
    compare_by(exact.displacement(), found.displacement(), |_| 1e-6 * largest).unwrap();
}

/// The brick with one layer of cubes, far from the held ends, squeezed to a share of its height, as
/// a layer of cells that goes on behind a trailing edge. The tight pairs of vertices hang on weak
/// springs, and the error of sweeps hardly falls.
fn squeezed(n: usize, share: f64) -> (Vec<DVec3>, Network) {
    let (low, high) = ((n / 2) as f64 / n as f64, (n / 2 + 1) as f64 / n as f64);
    let place = move |at: DVec3| {
        let z = at.z - (1.0 - share) * (at.z - low).clamp(0.0, high - low);
        DVec3::new(at.x, at.y, z)
    };
    let hold = |at: DVec3| if at.x == 0.0 { Constraint::Held } else { Constraint::Free };
    network(n, (Length::InverseSquare, Torsion::None), place, hold)
}

/// On a network whose sweeps would be hopeless `auto` takes cycles, however small it is, and a few
/// of them reach the equilibrium that elimination finds. Without the squeezed layer `auto` takes
/// sweeps.
///
/// Fails if `MOST_SWEEPS_PER_DIGIT` is 1000000 or 3.
#[test]
fn auto_takes_cycles_where_sweeps_are_hopeless() {
    let method = |network: &Network| Relaxer::new(network.clone(), &F64, Method::Auto).unwrap().method();
    assert_eq!(method(&squeezed(6, 1.0).1), Method::Chebyshev);
    let (positions, network) = squeezed(6, 1e-3);
    assert_eq!(method(&network), Method::Multigrid);
    let start = start(&positions, &network);
    let exact = direct(&network, &start);
    let stopping = Stopping { tolerance: 1e-4, max_sweeps: 60 };
    for precision in [Precision::F64, Precision::F32] {
        let mut relaxer = Relaxer::new(network.clone(), &CpuBackend::new(precision), Method::Auto).unwrap();
        let mut found = start.clone();
        let convergence = relaxer.relax(&mut found, None, &stopping).unwrap();
        assert!(convergence.converged && convergence.failed.is_none(), "{precision:?} {convergence:?}");
        compare_by(&exact, &found, |row| 3e-4 / network.inverse_length[row])
            .unwrap_or_else(|mismatch| panic!("{precision:?}: {mismatch:?}"));
    }
    // As many sweeps do not reach it, and the result names the method that failed.
    let (_, sweeps) = relax(&network, &start, Method::Chebyshev, stopping);
    assert!(!sweeps.converged && sweeps.failed == Some(Method::Chebyshev), "{sweeps:?}");
}

/// In f32 a pass on such a network ends where rounding stops its progress, and not when its sweeps
/// run out; the next pass goes on from there. Held vertices that all move by one vector take all
/// others with them.
#[test]
fn a_pass_ends_where_rounding_stops_it() {
    let by = DVec3::new(0.3, -0.2, 0.1);
    for share in [1e-3, 1e-4, 1e-5, 1e-6] {
        let (_, network) = squeezed(6, share);
        let held = |constraint: &Constraint| if *constraint == Constraint::Held { by } else { DVec3::ZERO };
        let mut found: Vec<DVec3> = network.constraint.iter().map(held).collect();
        let mut relaxer = Relaxer::new(network.clone(), &CpuBackend::new(Precision::F32), Method::Auto).unwrap();
        let convergence = relaxer.relax(&mut found, None, &Stopping { tolerance: 1e-4, max_sweeps: 20_000 }).unwrap();
        assert!(convergence.converged && convergence.sweeps < 1_000, "{share:e}: {convergence:?}");
        compare_by(&vec![by; found.len()], &found, |row| 3e-4 / network.inverse_length[row])
            .unwrap_or_else(|mismatch| panic!("{share:e}: {mismatch:?}"));
    }
}
