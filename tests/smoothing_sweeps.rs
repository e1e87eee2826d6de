//! Sweeps of local quality optimisation: derivatives, and what each sweep lowers.

#[path = "common/meshes.rs"]
mod meshes;
#[path = "common/patches.rs"]
mod patches;
#[path = "common/shaken.rs"]
mod shaken;

use glam::{DMat3, DVec3};
use idmesh::{
    backend::{self, Backend, Ball, Constraint, CpuBackend},
    kernels::raise_worst_beta::{self, Corner},
    kernels::smooth_vertices::{MeanRatioObjective, Tets, derivatives, energy},
    kernels::star::Star,
    mesh::TetMesh,
    quality,
    smoothing::{QualityTarget, inverse_targets},
};
use meshes::brick;
use patches::{Whole, vertex_tets};
use shaken::{F32, F64, hold_boundary, middle, shaken, slide_on_boundary, worst};

// ---- the objective ----

/// Packed by hand, not by the backend: base `S = A W^-1` with its columns, `W^-1` with its rows one after another.
fn pack(mesh: &TetMesh, inverse: &[DMat3], positions: &[DVec3]) -> (Vec<[f64; 9]>, Vec<[f64; 9]>) {
    let base = mesh.tets.iter().zip(inverse).map(|(tet, inverse)| {
        let [a, b, c, d] = tet.map(|vertex| positions[vertex as usize]);
        (DMat3::from_cols(b - a, c - a, d - a) * *inverse).to_cols_array()
    });
    (base.collect(), inverse.iter().map(|inverse| inverse.transpose().to_cols_array()).collect())
}

/// `E` of the docs, from the edges and determinants of whole matrices, times `27^power`.
fn energy_by_hand(
    mesh: &TetMesh,
    inverse: &[DMat3],
    positions: &[DVec3],
    row: &[u32],
    [power, size]: [u32; 2],
    delta: f64,
) -> f64 {
    let of_tet = |&entry: &u32| {
        let tet = entry as usize / 4;
        let [a, b, c, d] = mesh.tets[tet].map(|vertex| positions[vertex as usize]);
        let s = DMat3::from_cols(b - a, c - a, d - a) * inverse[tet];
        let f: f64 = s.to_cols_array().iter().map(|entry| entry * entry).sum();
        let sigma = s.determinant();
        let h = 0.5 * (sigma + (sigma * sigma + 4.0 * delta * delta).sqrt());
        (f.powi(3) / (h * h) * (0.5 * (h + 1.0 / h)).powi(size as i32)).powi(power as i32)
    };
    row.iter().map(of_tet).sum()
}

#[test]
fn derivatives_against_finite_differences() {
    let mesh = brick(2);
    let constraint = hold_boundary(&mesh);
    let vertex = middle(&mesh);
    let rows = vertex_tets(&mesh.tets, mesh.vertices.len());
    for (target, [power, size], delta, shift) in [
        (QualityTarget::Original, [1, 0], 0.0, DVec3::new(0.1, -0.05, 0.12)),
        (QualityTarget::Original, [2, 1], 0.0, DVec3::new(0.1, -0.05, 0.12)),
        (QualityTarget::Improve, [3, 2], 0.0, DVec3::new(0.02, 0.15, -0.1)),
        // Tangled: the vertex is outside its star.
        (QualityTarget::Original, [1, 1], 0.3, DVec3::new(0.4, 0.6, -0.3)),
        (QualityTarget::Original, [1, 3], 0.3, DVec3::new(0.3, 0.6, -0.3)),
        (QualityTarget::Improve, [2, 0], 0.3, DVec3::new(0.7, 0.1, 0.2)),
    ] {
        let inverse = inverse_targets(target, &mesh.tets, &mesh.vertices);
        let (base, inverse_target) = pack(&mesh, &inverse, &mesh.vertices);
        let free = vec![[0.0; 4]; mesh.vertices.len()];
        let star = Star {
            row_start: &rows.row_start,
            vertex_tets: &rows.entries,
            tets: &mesh.tets,
            base: &base,
            constraint: &free,
            reach: &[],
        };
        let tets = Tets { star, inverse_target: &inverse_target };
        let objective = MeanRatioObjective { power, size, delta_squared: delta * delta, tolerance: 0.0 };
        // The others have moved too since the base was taken.
        let moved = shaken(&mesh, &constraint, 0.05);
        let mut correction: Vec<[f64; 4]> = Vec::new();
        correction.extend(moved.iter().zip(&mesh.vertices).map(|(a, b)| (*a - *b).extend(0.0).to_array()));
        let e = |at: DVec3| {
            let mut positions = moved.clone();
            positions[vertex] = mesh.vertices[vertex] + at;
            let by_hand = energy_by_hand(&mesh, &inverse, &positions, rows.row(vertex), [power, size], delta);
            let found = energy(vertex, &tets, &objective, &correction, at.to_array(), 1.0).unwrap();
            assert!((found / by_hand - 1.0).abs() < 1e-9, "{found} {by_hand}");
            by_hand
        };
        let local = derivatives(vertex, &tets, &objective, &correction, shift.to_array(), 1.0);
        assert!((local.energy / e(shift) - 1.0).abs() < 1e-9);
        // Central differences: error h^2 times a higher derivative, and rounding over h or h^2.
        let (step, [xx, yy, zz], [xy, xz, yz]) = (1e-4, local.diagonal, local.off_diagonal);
        let hessian = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let size = xx.abs() + yy.abs() + zz.abs();
        for (i, &u) in DVec3::AXES.iter().enumerate() {
            let u = u * step;
            let slope = (e(shift + u) - e(shift - u)) / (2.0 * step);
            let gradient = DVec3::from(local.gradient);
            assert!((local.gradient[i] - slope).abs() < 1e-4 * gradient.length(), "{target:?} {i} {slope} {gradient}");
            for (j, &v) in DVec3::AXES.iter().enumerate() {
                let v = v * step;
                let curvature =
                    (e(shift + u + v) - e(shift + u - v) - e(shift - u + v) + e(shift - u - v)) / (4.0 * step * step);
                assert!((hessian[i][j] - curvature).abs() < 1e-4 * size, "{target:?} {i} {j} {curvature} {hessian:?}");
            }
        }
    }
}

/// At its target a tet has `q = 1` and `w = 1`, and `E` is flat there.
#[test]
fn the_target_is_the_optimum() {
    let mesh = brick(3);
    let rows = vertex_tets(&mesh.tets, mesh.vertices.len());
    let inverse = inverse_targets(QualityTarget::Original, &mesh.tets, &mesh.vertices);
    let (base, inverse_target) = pack(&mesh, &inverse, &mesh.vertices);
    let zero = vec![[0.0; 4]; mesh.vertices.len()];
    let star = Star {
        row_start: &rows.row_start,
        vertex_tets: &rows.entries,
        tets: &mesh.tets,
        base: &base,
        constraint: &zero,
        reach: &[],
    };
    let tets = Tets { star, inverse_target: &inverse_target };
    for vertex in 0..mesh.vertices.len() {
        let size = vertex as u32 % 4;
        let objective = MeanRatioObjective { power: 1, size, delta_squared: 0.0, tolerance: 0.0 };
        let local = derivatives(vertex, &tets, &objective, &zero, [0.0; 3], 1.0 / 27.0);
        let n_tets = rows.row(vertex).len() as f64;
        assert!((local.energy - n_tets).abs() < 1e-11 * n_tets);
        assert!(DVec3::from(local.gradient).length() * local.size < 1e-11 * n_tets, "{local:?}");
    }
}

/// Edges of all lengths equal, six times the volume kept.
#[test]
fn the_regular_target_is_regular() {
    let mesh = brick(2);
    let inverse = inverse_targets(QualityTarget::Improve, &mesh.tets, &mesh.vertices);
    for (tet, inverse) in mesh.tets.iter().zip(&inverse) {
        let w = inverse.inverse();
        let corners = [DVec3::ZERO, w.x_axis, w.y_axis, w.z_axis];
        let volume = quality::volume(tet.map(|vertex| mesh.vertices[vertex as usize]));
        assert!((quality::volume(corners) / volume - 1.0).abs() < 1e-12);
        assert!((quality::beta(corners) - 0.5f64.sqrt() / 6.0).abs() < 1e-12);
    }
}

// ---- the climb on beta ----

/// A tet's edges from its first vertex, one after another.
fn edges_of(points: &[DVec3; 4]) -> [f64; 9] {
    let [a, b, c, d] = *points;
    DMat3::from_cols(b - a, c - a, d - a).to_cols_array()
}

/// Central differences of the sum over betas, from each vertex of a tet without symmetry.
#[test]
fn the_climb_against_finite_differences() {
    let points = [[0.1, 0.0, 0.2], [1.0, 0.1, 0.0], [0.3, 0.8, 0.1], [0.2, 0.4, 1.3]].map(DVec3::from);
    let (base, constraint, correction) = ([edges_of(&points)], [[0.0; 4]; 4], [[0.0; 4]; 4]);
    let star = Star {
        row_start: &[0, 1, 2, 3, 4],
        vertex_tets: &[0, 1, 2, 3],
        tets: &[[0, 1, 2, 3]],
        base: &base,
        constraint: &constraint,
        reach: &[],
    };
    let goal = 0.3;
    let objective = raise_worst_beta::WorstBetaObjective { six_goal: 6.0 * goal, gain: 0.0 };
    let sum = |vertex: usize, by: DVec3| {
        let mut points = points;
        points[vertex] += by;
        (1.0 - quality::beta(points) / goal).powi(4)
    };
    for vertex in 0..4 {
        let corner = Corner::new(&star, &correction, vertex as u32);
        let local = raise_worst_beta::derivatives(&[corner], &objective, [0.0; 3]);
        assert!((local.energy - sum(vertex, DVec3::ZERO)).abs() < 1e-14);
        let shortest = points.iter().map(|other| other.distance_squared(points[vertex])).filter(|&l| l > 0.0);
        assert!((local.shortest - shortest.fold(f64::INFINITY, f64::min)).abs() < 1e-14);
        let h = 1e-6;
        for (axis, unit) in DVec3::AXES.into_iter().enumerate() {
            let slope = (sum(vertex, unit * h) - sum(vertex, unit * -h)) / (2.0 * h);
            assert!((local.uphill[axis] * -4.0 / (6.0 * goal) - slope).abs() < 1e-8, "{vertex} {axis} {slope}");
        }
    }
}

/// The tip over the middle of an equilateral triangle of side 1, at height `h`: it rises by a quarter of its edge
/// `sqrt(h^2 + 1/3)`, or to the end of its reach, or stays where its tet is good enough.
#[test]
fn a_flat_tet_rises() {
    let (x, y) = (0.5, 0.75f64.sqrt());
    let quarter = |h: f64| 0.25 * (h * h + 1.0 / 3.0).sqrt();
    let reach = |up: f64, radius: f64| Some(Ball { centre: DVec3::new(0.5, y / 3.0, 0.1 + up), radius });
    for (h, goal, reach, expected) in [
        (0.1, 0.1, None, quarter(0.1)),
        (0.3, 0.1, None, quarter(0.3)),
        (0.6, 0.05, None, 0.0),
        (0.1, 0.1, reach(0.0, 0.02), 0.02),
        (0.1, 0.1, reach(0.03, 0.05), 0.08),
    ] {
        let tip = DVec3::new(0.5, y / 3.0, h);
        let mesh = [DVec3::ZERO, DVec3::X, DVec3::new(x, y, 0.0), tip];
        let constraint = [Constraint::Held, Constraint::Held, Constraint::Held, Constraint::Free];
        for (backend, tolerance) in [(F64, 1e-15), (F32, 1e-7)] {
            let mut whole = Whole::new(&[[0, 1, 2, 3]], 4, &[3]);
            whole.reach[0] = reach;
            let (positions, constraint) = (whole.ordered(&mesh), whole.ordered(&constraint));
            let objective = backend::SmoothingObjective::Beta { goal, gain: 1e-5 };
            let patch = whole.patch(&positions, &constraint);
            let moved = backend.smoother().sweep(&patch, &objective, 1).unwrap();
            assert!(moved[0].distance(DVec3::Z * expected) <= tolerance, "{h} {moved:?} {expected}");
            assert_eq!(moved[1..], [DVec3::ZERO; 3]);
        }
    }
}

// ---- sweeps on a device ----

/// How far a device moves the free vertices of a mesh in some sweeps.
fn sweep(
    backend: &dyn Backend,
    mesh: &TetMesh,
    positions: &[DVec3],
    constraint: &[Constraint],
    objective: impl for<'a> Fn(&'a [DMat3]) -> backend::SmoothingObjective<'a>,
    target: QualityTarget,
    count: usize,
) -> Vec<DVec3> {
    let moves = |vertex: &u32| constraint[*vertex as usize] != Constraint::Held;
    let moving: Vec<u32> = (0..mesh.vertices.len() as u32).filter(moves).collect();
    let whole = Whole::new(&mesh.tets, mesh.vertices.len(), &moving);
    let (positions, constraint) = (whole.ordered(positions), whole.ordered(constraint));
    let inverse = inverse_targets(target, &whole.tets, &whole.ordered(&mesh.vertices));
    let patch = whole.patch(&positions, &constraint);
    let found = backend.smoother().sweep(&patch, &objective(&inverse), count).unwrap();
    let mut correction = vec![DVec3::ZERO; mesh.vertices.len()];
    whole.vertices.iter().zip(found).for_each(|(&vertex, found)| correction[vertex as usize] = found);
    correction
}

fn shape(power: u32, size: u32) -> impl for<'a> Fn(&'a [DMat3]) -> backend::SmoothingObjective<'a> {
    move |inverse_target| backend::SmoothingObjective::Shape { inverse_target, power, size, delta_squared: 0.0 }
}

fn climb(goal: f64) -> impl for<'a> Fn(&'a [DMat3]) -> backend::SmoothingObjective<'a> {
    move |_| backend::SmoothingObjective::Beta { goal, gain: 1e-5 }
}

fn sums(positions: &[DVec3], correction: &[DVec3]) -> Vec<DVec3> {
    positions.iter().zip(correction).map(|(x, c)| *x + *c).collect()
}

/// Each of twelve sweeps lowers the sum but for rounding, and all of them to less than this share of it.
fn assert_lowered(
    start: &[DVec3],
    total: impl Fn(&[DVec3]) -> f64,
    swept: impl Fn(&[DVec3]) -> Vec<DVec3>,
    rounding: f64,
    share: f64,
    what: &str,
) {
    let first = total(start);
    let (mut at, mut last) = (start.to_vec(), first);
    for _ in 0..12 {
        at = swept(&at);
        let now = total(&at);
        assert!(now <= last * (1.0 + rounding), "{what}: {last} to {now}");
        last = now;
    }
    assert!(last < share * first, "{what}: {first} to {last}");
}

/// Fails if `SHIFTS` is 0.
#[test]
fn energy_falls_with_every_sweep_and_tets_stay_valid() {
    let mesh = brick(4);
    let constraint = hold_boundary(&mesh);
    let start = shaken(&mesh, &constraint, 0.06);
    assert_eq!(worst(&mesh, &start).0, 0);
    let entries: Vec<u32> = (0..mesh.tets.len() as u32).map(|tet| 4 * tet).collect();
    for (backend, rounding) in [(F64, 1e-13), (F32, 1e-5)] {
        for target in [QualityTarget::Original, QualityTarget::Improve] {
            for powers in [[1, 0], [1, 1], [2, 0], [2, 1], [4, 2], [7, 0]] {
                let inverse = inverse_targets(target, &mesh.tets, &mesh.vertices);
                let total = |positions: &[DVec3]| energy_by_hand(&mesh, &inverse, positions, &entries, powers, 0.0);
                let swept = |at: &[DVec3]| {
                    let objective = shape(powers[0], powers[1]);
                    let at = sums(at, &sweep(&backend, &mesh, at, &constraint, objective, target, 1));
                    assert_eq!(worst(&mesh, &at).0, 0);
                    at
                };
                assert_lowered(&start, total, swept, rounding, 0.9, &format!("{target:?} {powers:?}"));
            }
        }
    }
}

/// The sum a climb lowers, from betas alone.
#[test]
fn a_climb_lowers_the_shortfall_with_every_sweep() {
    let mesh = brick(4);
    let constraint = slide_on_boundary(&mesh);
    let start = shaken(&mesh, &constraint, 0.08);
    let goal = 0.03;
    let total = |at: &[DVec3]| -> f64 {
        quality::betas(at, &mesh.tets).iter().map(|beta| (1.0 - beta / goal).max(0.0).powi(4)).sum()
    };
    for (backend, rounding) in [(F64, 1e-13), (F32, 1e-4)] {
        let swept =
            |at: &[DVec3]| sums(at, &sweep(&backend, &mesh, at, &constraint, climb(goal), QualityTarget::Improve, 1));
        assert_lowered(&start, total, swept, rounding, 0.5, "climb");
    }
}

/// Where the boundary has been drawn to one side, no cell can be as it was; with the part for size those inside come nearer
/// to their volumes.
#[test]
fn sizes_are_kept_as_well_as_shapes() {
    let mesh = brick(4);
    let constraint = hold_boundary(&mesh);
    let positions: Vec<DVec3> = mesh.vertices.iter().map(|at| at.with_x(0.5 * at.x * (1.0 + at.x))).collect();
    let spread = |size: u32| {
        let correction = sweep(&F64, &mesh, &positions, &constraint, shape(1, size), QualityTarget::Original, 100);
        let at = sums(&positions, &correction);
        let ratio = |tet: &[u32; 4]| {
            let volume = |of: &[DVec3]| quality::volume(tet.map(|vertex| of[vertex as usize]));
            (volume(&at) / volume(&mesh.vertices)).ln().powi(2)
        };
        mesh.tets.iter().map(ratio).sum::<f64>()
    };
    for sizes in [0, 1, 2, 4].windows(2) {
        assert!(spread(sizes[1]) < 0.96 * spread(sizes[0]), "{sizes:?}");
    }
}

/// f32 against f64, in meshes of any unit: a few sweeps part by rounding only.
#[test]
fn f32_follows_f64() {
    for unit in [1e-6, 1.0, 1e6] {
        let mut mesh = brick(4);
        let constraint = hold_boundary(&mesh);
        let positions: Vec<DVec3> = shaken(&mesh, &constraint, 0.05).iter().map(|at| *at * unit).collect();
        mesh.vertices.iter_mut().for_each(|at| *at *= unit);
        let sweep = |backend: CpuBackend| {
            sweep(&backend, &mesh, &positions, &constraint, shape(2, 1), QualityTarget::Improve, 3)
        };
        for (a, b) in sweep(F64).iter().zip(&sweep(F32)) {
            // A vertex is placed where E is flat to f32's rounding: to its square root of the cell's side 1/4.
            assert!(a.distance(*b) < 0.25 * 1e-3 * unit, "{a} {b}");
        }
    }
}
