//! Multigrid cycles on the GPU against the CPU twins: bit by bit on a software adapter, which
//! rounds as the CPU does, to a tolerance on hardware.
//!
//! Needs an adapter. `IDMESH_TEST_GPU=off` skips what does, and says so.
#![cfg(feature = "gpu")]

mod common;

use common::adapter::gpu;
use common::brick::{Brick, noise, noise_vector};
use common::{compare, compare_by};
use glam::{DVec3, Vec3Swizzles};
use idmesh::backend::gpu::{Bounds, GpuBackend};
use idmesh::backend::{Backend, BackendError, CpuBackend, Measure, Precision, Sweep};
use idmesh::constraint::Constraint;
use idmesh::mesh::edges::VertexGraph;
use idmesh::relaxation::{Method, Network, Relaxer, Stopping, multigrid::Hierarchy};
use idmesh::springs::{Length, Torsion};

const F64: CpuBackend = CpuBackend { precision: Precision::F64 };
const TWIN: CpuBackend = CpuBackend { precision: Precision::F32 };

/// The arithmetic of adapters without f64.
const SINGLE: Bounds = Bounds {
    matrix_bytes: None,
    workgroups: None,
    arithmetic: Some(Precision::F32),
    least_vertices: Some(0),
    times: false,
};

const CYCLES: [Sweep; 4] = [
    Sweep { relaxation: 1.1, momentum: 0.0 },
    Sweep { relaxation: 1.2, momentum: 0.1 },
    Sweep { relaxation: 1.15, momentum: 0.05 },
    Sweep { relaxation: 0.9, momentum: 0.2 },
];

/// A brick with anchors, and vertices that move, slide in planes of all directions, or along lines.
fn network(n: usize, constraint: impl Fn(usize, DVec3) -> Constraint) -> (Vec<DVec3>, Network) {
    let mesh = Brick::new(n, 0);
    let stiffness = mesh.stiffness(&F64, Length::Inverse, Torsion::Product);
    let length: Vec<f64> = mesh.edge_vector.iter().map(|edge| edge.length()).collect();
    let constraint = mesh.points.iter().enumerate().map(|(vertex, &at)| constraint(vertex, at)).collect();
    let anchor =
        (0..mesh.points.len()).map(|vertex| if vertex % 50 == 0 { noise(vertex).abs() } else { 0.0 }).collect();
    let graph = VertexGraph::new(mesh.points.len(), &mesh.edges);
    let network = Network::new(&graph, &stiffness, &length, constraint, anchor);
    (mesh.points, network)
}

/// None held: a hierarchy is made of vertices that all move.
fn of_all_kinds(vertex: usize, _: DVec3) -> Constraint {
    let unit = noise_vector(vertex / 40).normalize();
    match vertex / 40 % 4 {
        0 => Constraint::InPlane(unit),
        1 => Constraint::OnLine(unit),
        _ => Constraint::Free,
    }
}

fn run(backend: &dyn Backend, network: &Network, batches: &[&[Sweep]]) -> (Vec<DVec3>, Measure) {
    let hierarchy = Hierarchy::new(network);
    assert!(hierarchy.depth() >= 3);
    let mut device = backend.upload_hierarchy(&hierarchy.data(network)).unwrap();
    device.start(&load_of(network)).unwrap();
    let measures: Vec<Measure> = batches.iter().map(|batch| device.sweep(batch).unwrap()).collect();
    (device.correction().unwrap(), measures[measures.len() - 1])
}

/// Bits where operations are rounded one by one; elsewhere a share of the greatest correction.
fn allowed(gpu: &GpuBackend, twin: &[DVec3]) -> f64 {
    let greatest = twin.iter().map(|e| e.length()).fold(0.0, f64::max);
    if gpu.is_software() { 0.0 } else { 1e-4 * greatest }
}

/// Fails if `COARSEST` is 4000, and if `SHRINKS` is 0.1.
#[test]
fn cycles_match_their_twins() {
    let Some(gpu) = gpu(SINGLE) else { return };
    let (_, network) = network(12, of_all_kinds);
    for count in [1, 4] {
        let (twin, of_twin) = run(&TWIN, &network, &[&CYCLES[..count]]);
        assert!(twin.iter().all(|e| *e != DVec3::ZERO), "everything moved");
        let (found, of_gpu) = run(&gpu, &network, &[&CYCLES[..count]]);
        compare(&twin, &found, allowed(&gpu, &twin)).unwrap();
        let tolerance = if gpu.is_software() { 0.0 } else { 1e-3 * of_twin.change };
        assert!((of_twin.change - of_gpu.change).abs() <= tolerance, "{of_twin:?} {of_gpu:?}");
    }
}

/// Cycles with load and correction in f64 have the bits of the CPU.
#[test]
fn double_cycles_match_the_cpu() {
    let Some(gpu) = gpu(Bounds::default()) else { return };
    assert_eq!(gpu.info().arithmetic, Precision::F64);
    let (_, network) = network(12, of_all_kinds);
    for count in [1, 2, 4] {
        let (cpu, of_cpu) = run(&F64, &network, &[&CYCLES[..count]]);
        let (found, of_gpu) = run(&gpu, &network, &[&CYCLES[..count]]);
        let tolerance = if gpu.is_software() { 0.0 } else { 1e-6 };
        compare(&cpu, &found, tolerance * allowed_scale(&cpu)).unwrap_or_else(|error| panic!("{count}: {error:?}"));
        assert!((of_cpu.change - of_gpu.change).abs() <= tolerance * of_cpu.change, "{of_cpu:?} {of_gpu:?}");
    }
}

/// Most dispatches, copies and clears of a cycle of four levels, of which two are large.
const MOST_COMMANDS: u64 = 20;

/// The levels of this network are as many as those of a mesh of 819 000 tets, and again the first
/// two are too large for the kernel of the coarse levels. The commands of a batch are counted,
/// those at its ends too. Fails if `MOST_VERTICES` of the coarse levels is 100: 82 commands.
#[test]
fn a_cycle_takes_few_commands() {
    let bottom = DVec3::new(0.6, 0.0, 0.8);
    let (_, network) =
        network(35, |vertex, _| if vertex < 36 * 36 { Constraint::InPlane(bottom) } else { Constraint::Free });
    let hierarchy = Hierarchy::new(&network);
    let data = hierarchy.data(&network);
    let sizes: Vec<usize> = data.iter().map(|level| level.network.graph.n_rows()).collect();
    assert!(sizes.len() == 4 && sizes[1] > 2000 && (101..2000).contains(&sizes[2]), "{sizes:?}");
    let cycles = [CYCLES; 4].concat();
    let run = |backend: &dyn Backend| {
        let mut device = backend.upload_hierarchy(&data).unwrap();
        device.start(&load_of(&network)).unwrap();
        let before = backend.work();
        device.sweep(&cycles).unwrap();
        let work = before.and_then(|before| Some(backend.work()?.since(before)));
        (device.correction().unwrap(), work)
    };
    for (bounds, cpu) in [(Bounds::default(), F64), (SINGLE, TWIN)] {
        let Some(gpu) = gpu(bounds) else { return };
        let ((expected, _), (found, work)) = (run(&cpu), run(&gpu));
        let work = work.unwrap();
        let commands = work.dispatches + work.copies + work.clears;
        eprintln!("{sizes:?} {commands} commands of {} cycles", cycles.len());
        assert!(commands <= MOST_COMMANDS * cycles.len() as u64, "{work:?}");
        let tolerance = if gpu.is_software() { 0.0 } else { 1e-4 * allowed_scale(&expected) };
        compare(&expected, &found, tolerance).unwrap();
    }
}

/// Constraints are replaced on all levels, those of the kernel of the coarse levels too.
#[test]
fn replaced_constraints_match_the_cpu() {
    let (_, network) = network(12, of_all_kinds);
    let replaced = |vertex: usize| match of_all_kinds(vertex, DVec3::ZERO) {
        Constraint::InPlane(normal) => Constraint::InPlane(-normal.zxy()),
        Constraint::OnLine(direction) => Constraint::OnLine(direction.zxy()),
        other => other,
    };
    let finest: Vec<Constraint> = (0..network.len()).map(replaced).collect();
    let run = |backend: &dyn Backend, replaces: bool| {
        let hierarchy = Hierarchy::new(&network);
        let mut device = backend.upload_hierarchy(&hierarchy.data(&network)).unwrap();
        let all = hierarchy.aggregate_maps().constraints(&finest);
        if replaces {
            device.constrain(&all).unwrap();
        }
        device.start(&load_of(&network)).unwrap();
        device.sweep(&CYCLES).unwrap();
        device.correction().unwrap()
    };
    for (bounds, cpu) in [(Bounds::default(), F64), (SINGLE, TWIN)] {
        let Some(gpu) = gpu(bounds) else { return };
        let (expected, found) = (run(&cpu, true), run(&gpu, true));
        assert_ne!(expected, run(&cpu, false));
        compare(&expected, &found, allowed(&gpu, &expected)).unwrap();
    }
}

/// A NaN shows in the change, and the next pass starts clean, on all levels.
#[test]
fn divergence_of_cycles_is_seen() {
    for bounds in [SINGLE, Bounds::default()] {
        let Some(gpu) = gpu(bounds) else { return };
        let (_, network) = network(12, of_all_kinds);
        let hierarchy = Hierarchy::new(&network);
        let mut device = gpu.upload_hierarchy(&hierarchy.data(&network)).unwrap();
        let load = load_of(&network);
        let mut of = |load: &[DVec3], cycles: &[Sweep]| {
            device.start(load).unwrap();
            let change = device.sweep(cycles).unwrap().change;
            (device.correction().unwrap(), change)
        };
        let expected = of(&load, &CYCLES);
        let mut wrong = load.clone();
        wrong[network.len() - 1].y = f64::NAN;
        for (load, cycles) in [(&wrong, &CYCLES[..1]), (&load, &[Sweep { relaxation: 1e9, momentum: 0.0 }; 60][..])] {
            let (_, change) = of(load, cycles);
            assert!(!change.is_finite(), "{change}");
            let again = of(&load_of(&network), &CYCLES);
            compare(&expected.0, &again.0, 0.0).unwrap();
            assert_eq!(expected.1, again.1);
        }
    }
}

fn load_of(network: &Network) -> Vec<DVec3> {
    (0..network.len()).map(|vertex| noise_vector(vertex) * 1e-3).collect()
}

fn allowed_scale(of: &[DVec3]) -> f64 {
    of.iter().map(|e| e.length()).fold(0.0, f64::max)
}

#[test]
fn f32_cycles_are_near_f64() {
    let Some(gpu) = gpu(SINGLE) else { return };
    let (_, network) = network(12, of_all_kinds);
    let (expected, _) = run(&F64, &network, &[&CYCLES]);
    let (found, _) = run(&gpu, &network, &[&CYCLES]);
    let greatest = expected.iter().map(|e| e.length()).fold(0.0, f64::max);
    compare(&expected, &found, 1e-4 * greatest).unwrap();
}

/// In both arithmetics.
#[test]
fn neither_splitting_nor_batches_change_a_bit() {
    for bounds in [SINGLE, Bounds::default()] {
        let split = Bounds { matrix_bytes: Some(100 << 10), workgroups: Some(3), ..bounds };
        let (Some(whole), Some(split)) = (gpu(bounds), gpu(split)) else { return };
        splits_and_batches(&whole, &split);
    }
}

fn splits_and_batches(whole: &GpuBackend, split: &GpuBackend) {
    let (_, network) = network(12, of_all_kinds);
    let (expected, measure) = run(whole, &network, &[&CYCLES]);
    for (gpu, batches) in [(split, vec![&CYCLES[..]]), (whole, vec![&CYCLES[..1], &CYCLES[1..]])] {
        let (found, of_found) = run(gpu, &network, &batches);
        compare(&expected, &found, 0.0).unwrap();
        assert_eq!(measure.change, of_found.change);
    }
}

/// The tolerance asked for is reached in f32 too, also with constraints that were replaced.
///
/// Fails if `HIGHEST_STEPS` is 2.
#[test]
fn the_gpu_relaxes_by_cycles() {
    for bounds in [SINGLE, Bounds { least_vertices: Some(0), ..Bounds::default() }] {
        let Some(gpu) = gpu(bounds) else { return };
        relaxes_by_cycles(&gpu);
    }
}

fn relaxes_by_cycles(gpu: &GpuBackend) {
    let held = |at: DVec3| at.z > 0.9;
    let with = |normal: DVec3| {
        network(10, |_, at| match at.x < 0.1 {
            _ if held(at) => Constraint::Held,
            true => Constraint::InPlane(normal),
            false => Constraint::Free,
        })
    };
    let (points, first) = with(DVec3::X);
    let (_, second) = with(DVec3::new(0.6, 0.8, 0.0));
    let start: Vec<DVec3> =
        points.iter().map(|&at| if held(at) { DVec3::new(at.y, at.x * at.y, 0.1) } else { DVec3::ZERO }).collect();
    let stopping = Stopping { tolerance: 1e-9, ..Stopping::default() };
    let relax = |backend: &dyn Backend, method| {
        let mut relaxer = Relaxer::new(first.clone(), backend, method).unwrap();
        relaxer.constrain(second.constraint.clone()).unwrap();
        let mut found = start.clone();
        let convergence = relaxer.relax(&mut found, None, &stopping).unwrap();
        assert!(convergence.converged, "{method:?} {convergence:?}");
        found
    };
    let expected = relax(&F64, Method::Chebyshev);
    let found = relax(gpu, Method::Multigrid);
    let allowed = |row: usize| 10.0 * stopping.tolerance / second.inverse_length[row].max(1e-3);
    compare_by(&expected, &found, allowed).unwrap();
}

#[test]
fn a_hierarchy_that_cannot_be_split_is_refused() {
    let Some(gpu) = gpu(Bounds { matrix_bytes: Some(4 << 10), ..Bounds::default() }) else { return };
    let (_, network) = network(12, of_all_kinds);
    let refused = gpu.upload_hierarchy(&Hierarchy::new(&network).data(&network));
    assert!(matches!(refused, Err(BackendError::TooLarge { .. })), "refused");
}
