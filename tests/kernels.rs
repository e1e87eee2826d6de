//! The kernels' twins against closed forms.

mod common;

use common::brick::{Brick, noise_vector};
use common::{Network, assert_close, compare};
use glam::DVec3;
use idmesh::backend::{Backend, Constraint, CpuBackend, DeviceNetwork, Precision, Sweep};
use idmesh::springs::{Length, Torsion};

const F64: CpuBackend = CpuBackend { precision: Precision::F64 };
const F32: CpuBackend = CpuBackend { precision: Precision::F32 };
const JACOBI: Sweep = Sweep { relaxation: 1.0, momentum: 0.0 };

// ---- edge stiffness ----

fn tet(points: [[f64; 3]; 4]) -> Brick {
    Brick::from_tets(points.map(DVec3::from).to_vec(), vec![[0, 1, 2, 3]], vec![false; 4])
}

/// The dihedral angle facing an edge, from the acos between the two faces at the opposite edge.
fn facing_angle(points: &[DVec3], edge: [u32; 2]) -> f64 {
    let others: Vec<usize> = (0..4).filter(|&vertex| !edge.contains(&(vertex as u32))).collect();
    let (k, l) = (points[others[0]], points[others[1]]);
    let axis = l - k;
    let normal = |vertex: u32| (points[vertex as usize] - k).cross(axis).normalize();
    normal(edge[0]).dot(normal(edge[1])).acos()
}

/// Regular tet: every dihedral angle has cos = 1/3, so 1 / sin^2 = 9/8; any size, any length law.
#[test]
fn stiffness_of_regular_tet() {
    for size in [1e-7, 0.3, 1e8] {
        let s = size / 2f64.sqrt();
        let mesh = tet([[0.0, 0.0, 0.0], [s, s, 0.0], [s, 0.0, s], [0.0, s, s]]);
        for (backend, epsilon) in [(F64, f64::EPSILON), (F32, f64::from(f32::EPSILON))] {
            let cases = [
                (Length::None, Torsion::None, 1.0),
                (Length::None, Torsion::Product, 1.125),
                (Length::Inverse, Torsion::None, 1.0 / size),
                (Length::Inverse, Torsion::Product, 1.125 / size),
                (Length::InverseSquare, Torsion::Product, 1.125 / size.powi(2)),
                (Length::Inverse, Torsion::Sum, 1.0 / size + 1.125),
                (Length::InverseSquare, Torsion::Sum, 1.0 / size.powi(2) + 1.125),
            ];
            for (length, torsion, expected) in cases {
                let stiffness = mesh.stiffness(&backend, length, torsion);
                assert_eq!(stiffness.len(), 6);
                // Some forty operations on well-conditioned numbers.
                stiffness.iter().for_each(|&k| assert_close(k, expected, 32.0 * epsilon * expected));
            }
        }
    }
}

/// Corner tet and tets without any symmetry: each edge against the acos of its facing angle.
#[test]
fn stiffness_against_angles() {
    let corner = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let random =
        |n: usize| [0, 1, 2, 3].map(|vertex| (noise_vector(4 * n + vertex) * 0.4 + DVec3::from(corner[vertex])).into());
    for points in std::iter::once(corner).chain((0..50).map(random)) {
        let mesh = tet(points);
        let stiffness = mesh.stiffness(&F64, Length::InverseSquare, Torsion::Product);
        for (edge, k) in stiffness.into_iter().enumerate() {
            let sin_squared = facing_angle(&mesh.points, mesh.edges[edge]).sin().powi(2);
            let expected = 1.0 / (mesh.edge_vector[edge].length_squared() * sin_squared);
            // acos loses 1 / sin of its argument's digits, and the product of that many again.
            assert_close(k, expected, 1e3 * f64::EPSILON * expected / sin_squared);
        }
    }
}

/// Two tets on one triangle: the edges of the triangle add both tets' angles.
#[test]
fn stiffness_adds_over_tets() {
    let up = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.1, 0.2, 1.0]].map(DVec3::from);
    let points = [up.to_vec(), vec![DVec3::new(0.3, 0.2, -0.7)]].concat();
    let two = Brick::from_tets(points.clone(), vec![[0, 1, 2, 3], [0, 2, 1, 4]], vec![false; 5]);
    let stiffness = two.stiffness(&F64, Length::Inverse, Torsion::Product);
    let edge = two.edges.iter().position(|edge| edge.contains(&0) && edge.contains(&1)).unwrap();
    let lower = [points[0], points[1], points[2], points[4]];
    let s = |points: &[DVec3]| facing_angle(points, [0, 1]).sin().powi(-2);
    assert_close(stiffness[edge], s(&up) + s(&lower), 1e-13 * stiffness[edge]);
}

/// A tet without volume, without a face's area, or without any length: sin^2 counts as 1e-6.
///
/// Fails if `LARGEST` of `edge_stiffness` is 1 or 1e30.
#[test]
fn stiffness_of_flat_tets_is_bounded() {
    let flat = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.7, 0.6, 0.0]];
    let line = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [5.0, 0.0, 0.0]];
    for points in [flat, line] {
        let mesh = tet(points);
        for backend in [F64, F32] {
            let stiffness = mesh.stiffness(&backend, Length::Inverse, Torsion::Product);
            for (k, v) in stiffness.iter().zip(&mesh.edge_vector) {
                assert_close(*k, 1e6 / v.length(), 1e6 / v.length() * 8.0 * f64::from(f32::EPSILON));
            }
        }
    }
}

#[test]
fn no_edges_give_no_stiffness() {
    let nothing = Brick::from_tets(Vec::new(), Vec::new(), Vec::new());
    assert!(F64.edge_stiffness(&nothing.stiffness_input()).unwrap().is_empty());
}

// ---- sweeps ----

/// Starts a pass and returns the network.
fn started(backend: CpuBackend, network: &Network, load: &[DVec3]) -> Box<dyn DeviceNetwork> {
    let mut device = backend.upload(&network.data()).unwrap();
    device.start(load).unwrap();
    device
}

/// Displacement of the boundary as a load on the vertices next to it: the residual of "boundary moved, all else not".
fn boundary_load(network: &Network, moved: impl Fn(usize) -> DVec3) -> Vec<DVec3> {
    let load = |row: usize| {
        let (mut sum, mut total) = (DVec3::ZERO, network.anchor[row]);
        for (&column, &k) in network.graph.row(row).iter().zip(&network.stiffness[network.graph.range(row)]) {
            total += k;
            if network.constraint[column as usize] == Constraint::Held {
                sum += k * moved(column as usize);
            }
        }
        if total > 0.0 { sum / total } else { DVec3::ZERO }
    };
    (0..network.n_vertices()).map(load).collect()
}

/// Chain 0 - 1 - 2 with stiffness 1 and 3, ends held, right end moved by 1: the middle goes to 3/4.
#[test]
fn chain_of_three_by_hand() {
    let mut chain = Network::new(3, &[(0, 1, 1.0), (1, 2, 3.0)]);
    chain.constraint = vec![Constraint::Held, Constraint::Free, Constraint::Held];
    let load = boundary_load(&chain, |vertex| if vertex == 2 { DVec3::X } else { DVec3::ZERO });
    assert_eq!(load[1], DVec3::X * 0.75);
    for backend in [F64, F32] {
        let mut device = started(backend, &chain, &load);
        // One Jacobi sweep solves a single unknown.
        let measure = device.sweep(&[JACOBI]).unwrap();
        assert_eq!(device.correction().unwrap(), [DVec3::ZERO, DVec3::X * 0.75, DVec3::ZERO]);
        assert_eq!((measure.change, measure.residual), (0.75, 0.0));
        // Half a step: e = 3/8. Then r = 3/4 - 3/8, e += r / 2 + (3/8 - 0) / 4, that is 3/8 + 3/16 + 3/32.
        device.start(&load).unwrap();
        let measure = device.sweep(&[Sweep { relaxation: 0.5, momentum: 0.25 }]).unwrap();
        assert_eq!((measure.change, measure.residual), (0.375, 0.375));
        let measure = device.sweep(&[Sweep { relaxation: 0.5, momentum: 0.25 }]).unwrap();
        assert_eq!(device.correction().unwrap()[1], DVec3::X * 0.65625);
        assert_eq!((measure.change, measure.residual), (0.28125, 0.09375));
        // No sweep, no change.
        assert_eq!(device.sweep(&[]).unwrap().change, 0.0);
    }
}

/// Change is measured in a vertex's shortest edge, whatever its unit, and every scale of load is a load.
#[test]
fn measure_has_the_units_it_says() {
    let mut pair = Network::new(2, &[(0, 1, 1e-30)]);
    pair.constraint[0] = Constraint::Held;
    pair.inverse_length = vec![1e12, 1e9];
    for backend in [F64, F32] {
        let load = [DVec3::ZERO, DVec3::new(3e-30, 0.0, 4e-30)];
        let mut device = started(backend, &pair, &load);
        let measure = device.sweep(&[Sweep { relaxation: 0.5, momentum: 0.0 }]).unwrap();
        assert_close(measure.change, 2.5e-21, 1e-27);
        assert_close(measure.residual, 2.5e-30, 1e-36);
        assert_close(device.correction().unwrap()[1].z, 2e-30, 1e-36);
    }
}

/// A translation of the boundary translates every vertex.
#[test]
fn translation_of_the_boundary() {
    let mesh = Brick::new(5, 0);
    let stiffness = mesh.stiffness(&F64, Length::Inverse, Torsion::Product);
    let network = mesh.network(&stiffness);
    let shift = DVec3::new(1.0, -2.0, 0.5);
    let mut device = started(F64, &network, &boundary_load(&network, |_| shift));
    let measure = device.sweep(&[JACOBI; 600]).unwrap();
    assert!(measure.residual < 1e-13, "{measure:?}");
    let expected: Vec<_> = mesh.on_boundary.iter().map(|&held| if held { DVec3::ZERO } else { shift }).collect();
    // Jacobi on this brick shrinks an error by 0.9 a sweep; a residual of 1e-13 leaves ten times that.
    compare(&expected, &device.correction().unwrap(), 1e-11).unwrap();
}

/// Vertices in a plane and on a line stay there, and meet equilibrium within it.
#[test]
fn constrained_rows_stay_where_they_may() {
    let normal = DVec3::new(1.0, 2.0, -2.0) / 3.0;
    let direction = DVec3::new(2.0, -3.0, 6.0) / 7.0;
    let mut network = Network::new(4, &[(0, 1, 1.0), (0, 2, 2.0), (0, 3, 0.5), (1, 2, 1.0)]);
    network.constraint =
        vec![Constraint::Free, Constraint::InPlane(normal), Constraint::OnLine(direction), Constraint::Held];
    let load: Vec<_> = (0..4).map(noise_vector).collect();
    let mut device = started(F64, &network, &load);
    let measure = device.sweep(&[Sweep { relaxation: 0.8, momentum: 0.1 }; 400]).unwrap();
    let e = device.correction().unwrap();
    assert!(measure.residual < 1e-14, "{measure:?}");
    // Each of the 400 sweeps may round e once.
    assert_close(e[1].dot(normal), 0.0, 400.0 * f64::EPSILON * e[1].length());
    assert_close(e[2].cross(direction).length(), 0.0, 400.0 * f64::EPSILON * e[2].length());
    assert_eq!(e[3], DVec3::ZERO);
    // The plane's normal and the line's normals carry the rest of the residual.
    let r1 = ((e[0] - e[1]) + (e[2] - e[1])) / 2.0 + load[1];
    let r2 = (2.0 * (e[0] - e[2]) + (e[1] - e[2])) / 3.0 + load[2];
    assert_close(r1.cross(normal).length(), 0.0, 1e-14);
    assert_close(r2.dot(direction), 0.0, 1e-14);
    assert!(r1.length() > 0.1 && r2.length() > 0.1, "the constraints did something");
}

/// Two free vertices, spring 1, anchors 1 and 3, load 1 on the first: 2 e1 - e2 = 2 and e1 = 4 e2.
#[test]
fn anchors_pull_towards_zero() {
    let mut network = Network::new(2, &[(0, 1, 1.0)]);
    network.anchor = vec![1.0, 3.0];
    let mut device = started(F64, &network, &[DVec3::Y, DVec3::ZERO]);
    device.sweep(&[JACOBI; 60]).unwrap();
    let e = device.correction().unwrap();
    assert_close(e[0].y, 8.0 / 7.0, 1e-14);
    assert_close(e[1].y, 2.0 / 7.0, 1e-14);
}

/// A vertex without stiffness stays, whatever its load, and is not measured.
#[test]
fn rows_without_stiffness_stay() {
    let network = Network::new(3, &[(0, 1, 0.0)]);
    let mut device = started(F32, &network, &[DVec3::ONE; 3]);
    let measure = device.sweep(&[JACOBI; 3]).unwrap();
    assert_eq!(device.correction().unwrap(), [DVec3::ZERO; 3]);
    assert_eq!((measure.change, measure.residual), (0.0, 0.0));
}

/// Constraints can be replaced: the vertex let go moves, the vertex now held keeps what it has.
#[test]
fn constraints_can_be_replaced() {
    let mut network = Network::new(2, &[(0, 1, 1.0)]);
    network.constraint = vec![Constraint::Held, Constraint::Free];
    let mut device = started(F64, &network, &[DVec3::X; 2]);
    device.sweep(&[JACOBI]).unwrap();
    assert_eq!(device.correction().unwrap(), [DVec3::ZERO, DVec3::X]);
    device.constrain(&[Constraint::Free, Constraint::Held]).unwrap();
    device.sweep(&[JACOBI]).unwrap();
    assert_eq!(device.correction().unwrap(), [DVec3::X * 2.0, DVec3::X]);
}

/// WGSL's max and Rust's drop a NaN; the measure must not.
#[test]
fn divergence_is_seen() {
    let mesh = Brick::new(4, 0);
    let network = mesh.network(&vec![1.0; mesh.edges.len()]);
    let free = mesh.on_boundary.iter().position(|&held| !held).unwrap();
    for backend in [F64, F32] {
        let mut load = vec![DVec3::ONE; network.n_vertices()];
        load[free].y = f64::NAN;
        let measure = started(backend, &network, &load).sweep(&[JACOBI]).unwrap();
        assert!(measure.change.is_nan() && measure.residual.is_nan(), "{measure:?}");
        // A step far too long doubles the error each time until it leaves the range.
        let load = vec![DVec3::ONE; network.n_vertices()];
        let measure =
            started(backend, &network, &load).sweep(&[Sweep { relaxation: 1e3, momentum: 0.0 }; 400]).unwrap();
        assert!(!measure.change.is_finite() && !measure.residual.is_finite(), "{measure:?}");
    }
}

#[test]
fn an_empty_network_is_at_rest() {
    let mut device = F64.upload(&Network::new(0, &[]).data()).unwrap();
    device.start(&[]).unwrap();
    assert_eq!(device.sweep(&[JACOBI]).unwrap().residual, 0.0);
    assert!(device.correction().unwrap().is_empty());
}

/// A network large enough for several tasks gives the same bits on one thread and on three.
#[test]
fn results_do_not_depend_on_threads() {
    let mesh = Brick::new(15, 2);
    let run = |n_threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| {
            let network = mesh.network(&mesh.stiffness(&F64, Length::Inverse, Torsion::Product));
            let load: Vec<_> = (0..network.n_vertices()).map(noise_vector).collect();
            let mut device = started(F64, &network, &load);
            let measure = device.sweep(&[Sweep { relaxation: 0.9, momentum: 0.3 }; 20]).unwrap();
            (device.correction().unwrap(), measure)
        })
    };
    let ((one, measure_one), (three, measure_three)) = (run(1), run(3));
    compare(&one, &three, 0.0).unwrap();
    assert_eq!(measure_one, measure_three);
}
