//! The GPU against the CPU twins: kernel against twin in f32 (bit by bit on a software adapter,
//! which rounds as the CPU does), and f32 against f64.
//!
//! Needs an adapter. `IDMESH_TEST_GPU=off` skips what does, and says so.
#![cfg(feature = "gpu")]

mod common;

use common::adapter::gpu;
use common::brick::{Brick, noise, noise_vector};
use common::{Mismatch, Network, as_vectors, compare, compare_by};
use glam::DVec3;
use idmesh::backend::gpu::{Bounds, GpuBackend};
use idmesh::backend::{
    Backend, BackendError, CpuBackend, DeviceNetwork, Measure, Precision, Selection, Sweep, adapters, select,
};
use idmesh::constraint::Constraint;
use idmesh::springs::{Length, Torsion};

const F64: CpuBackend = CpuBackend { precision: Precision::F64 };
const TWIN: CpuBackend = CpuBackend { precision: Precision::F32 };
/// Largest relative error of one f32 operation.
const ROUNDING: f64 = f32::EPSILON as f64 / 2.0;

/// Chebyshev-like: both factors, changing.
const SWEEPS: [Sweep; 8] = [
    Sweep { relaxation: 1.0, momentum: 0.0 },
    Sweep { relaxation: 0.9, momentum: 0.1 },
    Sweep { relaxation: 1.1, momentum: 0.15 },
    Sweep { relaxation: 0.7, momentum: 0.3 },
    Sweep { relaxation: 0.8, momentum: 0.2 },
    Sweep { relaxation: 1.0, momentum: 0.1 },
    Sweep { relaxation: 0.95, momentum: 0.25 },
    Sweep { relaxation: 0.85, momentum: 0.3 },
];

/// A network with everything in it: boundary-layer tets, all four constraints, anchors, rows of
/// many lengths, one without stiffness.
fn awkward(n: usize) -> Network {
    let mesh = Brick::new(n, n / 3);
    let stiffness = mesh.stiffness(&F64, Length::Inverse, Torsion::Product);
    let mut springs: Vec<_> = mesh.edges.iter().zip(&stiffness).map(|(&[a, b], &k)| (a, b, k)).collect();
    let n_vertices = mesh.points.len() as u32;
    let lonely = n_vertices;
    springs.push((lonely, 0, 0.0));
    // A hub with hundreds of neighbours; last, so that a kernel that stops short is seen.
    let hub = n_vertices + 1;
    springs.extend((0..n_vertices).step_by(3).map(|vertex| (vertex, hub, 0.01 + noise(vertex as usize).abs())));
    let mut network = Network::new(n_vertices as usize + 2, &springs);
    for vertex in 0..network.n_vertices() {
        let unit = noise_vector(vertex).normalize();
        network.constraint[vertex] = match vertex % 7 {
            0 => Constraint::Held,
            1 => Constraint::InPlane(unit),
            2 => Constraint::OnLine(unit),
            _ => Constraint::Free,
        };
        if vertex % 5 == 0 && vertex != lonely as usize {
            network.anchor[vertex] = noise(vertex).abs() * 1e3;
        }
        network.inverse_length[vertex] = 10f64.powf(2.0 * noise(vertex + 7));
    }
    network.constraint[hub as usize] = Constraint::Free;
    network
}

fn load(network: &Network) -> Vec<DVec3> {
    (0..network.n_vertices()).map(|vertex| noise_vector(vertex) * 1e-3).collect()
}

fn run(backend: &dyn Backend, network: &Network, batches: &[&[Sweep]]) -> (Vec<DVec3>, Vec<Measure>) {
    let mut device = backend.upload(&network.data()).unwrap();
    relax(&mut *device, network, batches)
}

fn relax(device: &mut dyn DeviceNetwork, network: &Network, batches: &[&[Sweep]]) -> (Vec<DVec3>, Vec<Measure>) {
    device.start(&load(network)).unwrap();
    let measures = batches.iter().map(|batch| device.sweep(batch).unwrap()).collect();
    (device.correction().unwrap(), measures)
}

/// How far two ways of rounding the same sweeps in f32 may part: per sweep one rounding per spring
/// and ten more, of numbers at most four times the correction's greatest; sweeps with these factors
/// amplify a difference at most twofold.
fn sweep_tolerance(network: &Network, correction: &[DVec3], n_sweeps: usize) -> f64 {
    let greatest = correction.iter().map(|e| e.length()).fold(1e-3, f64::max);
    2.0 * n_sweeps as f64 * (network.max_valence() as f64 + 10.0) * ROUNDING * 4.0 * greatest
}

/// Zero, that is equal bits, on software; elsewhere what contraction and a division to 2.5 ULP
/// allow.
fn unless_software(gpu: &GpuBackend, tolerance: f64) -> f64 {
    if gpu.is_software() { 0.0 } else { tolerance }
}

fn measures_as_vectors(measures: &[Measure]) -> Vec<DVec3> {
    measures.iter().map(|measure| DVec3::new(measure.change, measure.residual, 0.0)).collect()
}

// ---- the comparison itself ----

#[test]
fn comparison_rejects_one_wrong_vertex() {
    let right: Vec<_> = (0..100).map(noise_vector).collect();
    compare(&right, &right, 0.0).unwrap();
    let rejected = |vertex: usize, value: f64, tolerance: f64| {
        let mut wrong = right.clone();
        wrong[vertex].z = value;
        let Mismatch { worst_vertex, found, .. } = compare(&right, &wrong, tolerance).unwrap_err();
        assert_eq!((worst_vertex, found.to_bits()), (vertex, value.to_bits()));
    };
    // One bit; ten tolerances; poison; a zero that was never written; infinity.
    rejected(17, f64::from_bits(right[17].z.to_bits() + 1), 0.0);
    rejected(0, right[0].z + 1e-5, 1e-6);
    for tolerance in [0.0, 1e-3] {
        rejected(99, f64::NAN, tolerance);
        rejected(98, -f64::NAN, tolerance);
        rejected(50, 0.0, tolerance);
        rejected(51, f64::INFINITY, tolerance);
    }
    // The worst of several, in terms of each one's tolerance.
    let mut wrong = right.clone();
    wrong[3].x += 0.5;
    wrong[4].x += 0.1;
    let allowed = |vertex: usize| if vertex == 3 { 0.4 } else { 0.01 };
    assert_eq!(compare_by(&right, &wrong, allowed).unwrap_err().worst_vertex, 4);
    assert_eq!(compare(&right, &right[..99], 1.0).unwrap_err().worst_vertex, 99);
    assert!(compare(&[DVec3::NAN], &[DVec3::NAN], 1.0).is_err(), "NaN is no agreement");
    assert!(compare(&[DVec3::ZERO], &[-DVec3::ZERO], 0.0).is_err(), "bits are compared");
}

// ---- kernel against twin ----

#[test]
fn relax_sweep_matches_its_twin() {
    let Some(gpu) = gpu(Bounds::default()) else { return };
    let network = awkward(9);
    for n_sweeps in [1, 2, 8] {
        let sweeps = &SWEEPS[..n_sweeps];
        let (twin, _) = run(&TWIN, &network, &[sweeps]);
        assert!(twin.iter().filter(|e| **e != DVec3::ZERO).count() > twin.len() / 2, "the network moved");
        let (found, _) = run(&gpu, &network, &[sweeps]);
        compare(&twin, &found, unless_software(&gpu, sweep_tolerance(&network, &twin, n_sweeps))).unwrap();
    }
}

#[test]
fn convergence_matches_its_twin() {
    let Some(gpu) = gpu(Bounds::default()) else { return };
    let network = awkward(9);
    let batches = [&SWEEPS[..1], &SWEEPS[1..4], &[], &SWEEPS[4..]];
    let (e, twin) = run(&TWIN, &network, &batches);
    let (_, found) = run(&gpu, &network, &batches);
    assert!(twin[0].change > 0.0 && twin[0].residual > 0.0 && twin[2].change == 0.0);
    let of_vertex = sweep_tolerance(&network, &e, SWEEPS.len());
    // The residual is a norm over the vertices; the change is in edges of at least 1e-2.
    let tolerance = of_vertex * 100f64.max((network.n_vertices() as f64).sqrt());
    let (twin, found) = (measures_as_vectors(&twin), measures_as_vectors(&found));
    compare(&twin, &found, unless_software(&gpu, tolerance)).unwrap();
}

#[test]
fn divergence_is_seen_on_the_gpu() {
    let Some(gpu) = gpu(Bounds::default()) else { return };
    let network = awkward(6);
    let free = network.constraint.iter().position(|constraint| *constraint == Constraint::Free).unwrap();
    let mut load = load(&network);
    load[free].y = f64::NAN;
    let mut device = gpu.upload(&network.data()).unwrap();
    device.start(&load).unwrap();
    let measure = device.sweep(&SWEEPS[..1]).unwrap();
    assert!(!measure.change.is_finite() && !measure.residual.is_finite(), "{measure:?}");
    // The next pass starts clean.
    let (found, measures) = relax(&mut *device, &network, &[&SWEEPS]);
    assert!(found.iter().all(|e| e.is_finite()) && measures[0].change.is_finite());
    let measure = device.sweep(&[Sweep { relaxation: 1e3, momentum: 0.0 }; 400]).unwrap();
    assert!(!measure.change.is_finite() && !measure.residual.is_finite(), "{measure:?}");
}

#[test]
fn constraints_can_be_replaced_on_the_gpu() {
    let Some(gpu) = gpu(Bounds::default()) else { return };
    let mut network = awkward(6);
    let run = |backend: &dyn Backend, network: &Network| {
        let mut device = backend.upload(&network.data()).unwrap();
        device.start(&load(network)).unwrap();
        device.sweep(&SWEEPS).unwrap();
        let turned: Vec<_> = network.constraint.iter().rev().copied().collect();
        device.constrain(&turned).unwrap();
        device.sweep(&SWEEPS).unwrap();
        device.correction().unwrap()
    };
    network.anchor.fill(0.5);
    let twin = run(&TWIN, &network);
    compare(&twin, &run(&gpu, &network), unless_software(&gpu, sweep_tolerance(&network, &twin, 16))).unwrap();
}

// ---- f32 against f64 ----

/// Springs are the same on every device.
#[test]
fn stiffness_on_the_gpu_is_that_of_f64() {
    let Some(gpu) = gpu(Bounds::default()) else { return };
    let mesh = Brick::new(9, 3);
    let [expected, found] =
        [&F64 as &dyn Backend, &gpu].map(|of| as_vectors(&of.edge_stiffness(&mesh.stiffness_input()).unwrap()));
    compare(&expected, &found, 0.0).unwrap();
}

/// What f32 costs a stiffness: some thirty roundings, of which those in the volume and the areas
/// grow with 1 / sin of the angle, at most 1e3 where sin^2 is clamped.
fn stiffness_tolerance(stiffness: f64) -> f64 {
    30.0 * 1e3 * ROUNDING * stiffness
}

#[test]
fn f32_stiffness_is_near_f64() {
    let mesh = Brick::new(9, 3);
    let reference = as_vectors(&F64.edge_stiffness(&mesh.stiffness_input()).unwrap());
    let twin = as_vectors(&TWIN.edge_stiffness(&mesh.stiffness_input()).unwrap());
    compare_by(&reference, &twin, |edge| stiffness_tolerance(reference[edge].x)).unwrap();
}

#[test]
fn f32_sweeps_are_near_f64() {
    let network = awkward(9);
    let (reference, of_reference) = run(&F64, &network, &[&SWEEPS, &SWEEPS]);
    let (twin, of_twin) = run(&TWIN, &network, &[&SWEEPS, &SWEEPS]);
    let tolerance = sweep_tolerance(&network, &reference, 16);
    compare(&reference, &twin, tolerance).unwrap();
    let worst = tolerance * 100f64.max((network.n_vertices() as f64).sqrt());
    compare(&measures_as_vectors(&of_reference), &measures_as_vectors(&of_twin), worst).unwrap();
}

// ---- what must not change a result ----

/// A matrix split into chunks of rows, dispatches folded into several rows of workgroups: the same
/// bits.
#[test]
fn splitting_changes_no_bit() {
    let Some(whole) = gpu(Bounds::default()) else { return };
    let bounds = Bounds { matrix_bytes: Some(80 * 1024), workgroups: Some(3), ..Bounds::default() };
    let Some(split) = gpu(bounds) else { return };
    // About 200 kB of springs; 3 workgroups of 64 take 192 of some 2000 rows.
    let network = awkward(12);
    assert!(network.graph.entries.len() * 8 > 2 * 80 * 1024);
    let (expected, of_expected) = run(&whole, &network, &[&SWEEPS]);
    let (found, of_found) = run(&split, &network, &[&SWEEPS]);
    compare(&expected, &found, 0.0).unwrap();
    assert_eq!(of_expected, of_found);
}

#[test]
fn a_network_that_cannot_be_split_is_refused() {
    let Some(tiny) = gpu(Bounds { matrix_bytes: Some(1024), ..Bounds::default() }) else { return };
    let network = awkward(6);
    assert!(matches!(tiny.upload(&network.data()), Err(BackendError::TooLarge { available: 1024, .. })));
}

/// The software adapter would end such a loop silently.
#[test]
fn a_row_too_long_for_a_kernel_is_refused() {
    let Some(gpu) = gpu(Bounds::default()) else { return };
    let springs: Vec<_> = (1..60_002).map(|vertex| (0, vertex, 1.0)).collect();
    let Err(error) = gpu.upload(&Network::new(60_002, &springs).data()) else { panic!("taken") };
    assert!(error.to_string().contains("vertex 0 has 60001 neighbours"), "{error}");
    // One less is computed to its end.
    let star = Network::new(60_001, &springs[..60_000]);
    let (twin, measures) = run(&TWIN, &star, &[&SWEEPS[..2]]);
    let (found, of_found) = run(&gpu, &star, &[&SWEEPS[..2]]);
    let tolerance = sweep_tolerance(&star, &twin, 2);
    compare(&twin, &found, unless_software(&gpu, tolerance)).unwrap();
    let (measures, of_found) = (measures_as_vectors(&measures), measures_as_vectors(&of_found));
    compare(&measures, &of_found, unless_software(&gpu, tolerance * 245.0)).unwrap();
}

#[test]
fn networks_side_by_side_do_not_disturb_each_other() {
    let Some(gpu) = gpu(Bounds::default()) else { return };
    let (small, large) = (awkward(5), awkward(8));
    let alone = (run(&gpu, &small, &[&SWEEPS]), run(&gpu, &large, &[&SWEEPS]));
    let mut of_small = gpu.upload(&small.data()).unwrap();
    let mut of_large = gpu.upload(&large.data()).unwrap();
    // Interleaved, then each on a thread of its own.
    of_small.start(&load(&small)).unwrap();
    of_large.start(&load(&large)).unwrap();
    for half in [&SWEEPS[..4], &SWEEPS[4..]] {
        of_small.sweep(half).unwrap();
        of_large.sweep(half).unwrap();
    }
    compare(&alone.0.0, &of_small.correction().unwrap(), 0.0).unwrap();
    compare(&alone.1.0, &of_large.correction().unwrap(), 0.0).unwrap();
    std::thread::scope(|scope| {
        for (device, network, expected) in [(&mut of_small, &small, &alone.0), (&mut of_large, &large, &alone.1)] {
            scope.spawn(move || {
                for _ in 0..5 {
                    let (found, measures) = relax(&mut **device, network, &[&SWEEPS]);
                    compare(&expected.0, &found, 0.0).unwrap();
                    assert_eq!(expected.1, measures);
                }
            });
        }
    });
}

#[test]
fn the_same_run_twice_gives_the_same_bits() {
    let Some(gpu) = gpu(Bounds::default()) else { return };
    let network = awkward(8);
    let mut device = gpu.upload(&network.data()).unwrap();
    let first = relax(&mut *device, &network, &[&SWEEPS]);
    // On the same buffers, which still hold the last pass, and on new ones.
    for second in [relax(&mut *device, &network, &[&SWEEPS]), run(&gpu, &network, &[&SWEEPS])] {
        compare(&first.0, &second.0, 0.0).unwrap();
        assert_eq!(first.1, second.1);
    }
}

/// How sweeps are batched shows only in what a change is measured against. More than one
/// submission's worth too.
#[test]
fn batches_change_no_bit() {
    let Some(gpu) = gpu(Bounds::default()) else { return };
    let network = awkward(6);
    for backend in [&gpu as &dyn Backend, &TWIN] {
        let singly: Vec<_> = SWEEPS.chunks(1).collect();
        let (one_by_one, of_each) = run(backend, &network, &singly);
        let (at_once, of_all) = run(backend, &network, &[&SWEEPS]);
        compare(&one_by_one, &at_once, 0.0).unwrap();
        assert_eq!(of_each.last().unwrap().residual, of_all[0].residual);
        let many = SWEEPS.repeat(20);
        let (at_once, _) = run(backend, &network, &[&many]);
        let (in_parts, _) = run(backend, &network, &many.chunks(37).collect::<Vec<_>>());
        compare(&at_once, &in_parts, 0.0).unwrap();
    }
}

#[test]
fn an_empty_network_is_at_rest_on_the_gpu() {
    let Some(gpu) = gpu(Bounds::default()) else { return };
    let (e, measures) = run(&gpu, &Network::new(0, &[]), &[&SWEEPS]);
    assert!(e.is_empty());
    assert_eq!(measures[0], Measure { change: 0.0, residual: 0.0 });
}

// ---- selection ----

#[test]
fn selection_never_hides_a_cpu_behind_a_gpu() {
    assert_eq!(select(Selection::Cpu).unwrap().info().kind, "cpu");
    let Some(gpu) = gpu(Bounds::default()) else { return };
    assert_eq!(select(Selection::Gpu).unwrap().info(), gpu.info());
    assert_eq!(gpu.info().kind, "gpu");
    let listed = adapters();
    assert_eq!(listed[0].name, gpu.info().adapter);
    assert_eq!(listed.iter().filter(|adapter| adapter.auto).count(), usize::from(!gpu.is_software()));
    assert!(listed[0].max_array_bytes >= 128 << 20);
    // A software adapter would be slower than the twins: auto takes the CPU in its place.
    let auto = select(Selection::Auto).unwrap().info();
    assert_eq!(auto.kind, if gpu.is_software() { "cpu" } else { "gpu" });
}
