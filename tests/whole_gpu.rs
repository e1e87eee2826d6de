//! Whole runs on the GPU in f32, as adapters without f64 compute, against the CPU in f64. Adapters
//! with f64 are in `gpu_bits`.
//!
//! Needs an adapter. `IDMESH_TEST_GPU=off` skips what does, and says so.
#![cfg(feature = "gpu")]

mod common;

use std::sync::Arc;

use common::adapter::single;
use common::aircraft::*;
use common::faults::faults;
use common::{Mismatch, compare, parts};
use glam::DVec3;
use idmesh::backend::{Backend, CpuBackend, Precision};
use idmesh::families::{Junction, RigidMotion, Role, TipStart};
use idmesh::mover::{Mover, Outcome};
use idmesh::relaxation::{Method, Stopping};

/// What a vertex may differ by, as a share of the largest displacement. Both relax until each
/// vertex is within 1e-4 of its shortest edge, and the shortest edges are a few hundredths of the
/// largest displacement.
const TOLERANCE: f64 = 1e-5;

fn on_gpu(aircraft: Aircraft) -> Option<Mover> {
    let backend = Arc::new(single()?);
    Some(aircraft.builder(aircraft.profiles("old_2")).build(backend as Arc<dyn Backend>).unwrap())
}

fn compare_runs(cpu: &Outcome, gpu: &[DVec3]) -> Result<(), Mismatch> {
    let largest = cpu.displacement().iter().map(|d| d.length()).fold(0.0, f64::max);
    compare(cpu.displacement(), gpu, TOLERANCE * largest)
}

fn check(aircraft: Aircraft, sets: &[&str]) {
    let Some(mut on_gpu) = on_gpu(aircraft) else { return };
    let mut on_cpu = aircraft.mover(2);
    assert_eq!((on_gpu.backend().info().kind, on_cpu.backend().info().kind), ("gpu", "cpu"));
    for set in sets {
        let cpu = update(&mut on_cpu, aircraft.profiles(set));
        let gpu = update(&mut on_gpu, aircraft.profiles(set));
        assert!(gpu.converged, "{set}: {:?}", gpu.unconverged);
        assert_eq!(faults(on_gpu.mesh(), gpu.vertices()), [], "{set}");
        compare_runs(&cpu, gpu.displacement()).unwrap_or_else(|mismatch| panic!("{set}: {mismatch:?}"));
        // In f32 the two are never the same: no difference at all would mean that one was compared
        // with itself.
        assert!(compare(cpu.displacement(), gpu.displacement(), 0.0).is_err(), "{set}");
    }
}

#[test]
fn gpu_moves_a_small_aircraft_as_the_cpu_does() {
    check(SMALL, &["small_2", "big_2", "planform_2"]);
}

/// The whole mesh of a pylon that slides on its nacelle.
#[test]
fn gpu_slides_a_pylon_on_its_nacelle_as_the_cpu_does() {
    let Some(backend) = single() else { return };
    let shift = DVec3::new(0.0, 0.0, -0.05);
    let motion = RigidMotion::Given { turn: DVec3::ZERO, about: DVec3::ZERO, shift };
    let pylon = Role::Attached { coefficient: 0.5, start: TipStart::Rigid, junction: Junction::Glued };
    let roles = [("pylon", pylon), ("nacelle", Role::Rigid { motion, junction: Junction::Slide })];
    let builder = || parts::builder(parts::mesh("nacelle"), parts::profiles("nacelle", "old"), &roles).quality(None);
    let mut on_gpu = builder().build(Arc::new(backend) as Arc<dyn Backend>).unwrap();
    let new = parts::profiles("nacelle", "small");
    let cpu = update(&mut builder().build(cpu()).unwrap(), new.clone());
    let gpu = update(&mut on_gpu, new);
    assert!(gpu.converged && cpu.converged, "{:?}", gpu.unconverged);
    assert!(gpu.families["nacelle"].max_slide.unwrap() > 0.1);
    compare_runs(&cpu, gpu.displacement()).unwrap_or_else(|mismatch| panic!("{mismatch:?}"));
    assert!(compare(cpu.displacement(), gpu.displacement(), 0.0).is_err());
}

#[test]
fn gpu_moves_a_large_aircraft_as_the_cpu_does() {
    check(WING_BODY, &["big_2"]);
}

/// Passes in f32 on an f64 residual reach what f64 reaches, by cycles and by sweeps.
///
/// Fails if `DAMPED` is 0.02 or `ANGLE` 10.
#[test]
fn a_fine_tolerance_is_reached_in_f32() {
    let Some(backend) = single() else { return };
    let backend: Arc<dyn Backend> = Arc::new(backend);
    for method in [Method::Multigrid, Method::Chebyshev] {
        let run = |backend: Arc<dyn Backend>| {
            let stopping = Stopping { tolerance: 1e-12, ..Stopping::default() };
            let builder = SMALL.builder(SMALL.profiles("old_2")).method(method).stopping(stopping);
            let outcome = update(&mut builder.build(backend).unwrap(), SMALL.profiles("small_2"));
            assert!(outcome.converged, "{method:?}: {:?}", outcome.unconverged);
            outcome
        };
        let cpu = run(Arc::new(CpuBackend::new(Precision::F64)));
        let gpu = run(Arc::clone(&backend));
        let largest = cpu.displacement().iter().map(|d| d.length()).fold(0.0, f64::max);
        compare(cpu.displacement(), gpu.displacement(), 1e-11 * largest).unwrap();
        // No more than the three passes that f32 takes from 1 to 1e-12, each about as long as f64's
        // way to a third of it.
        assert!(gpu.solver.sweeps <= 2 * cpu.solver.sweeps, "{method:?}: {:?} {:?}", gpu.solver, cpu.solver);
    }
}

#[test]
fn gpu_repeats_itself_to_the_bit() {
    let Some(mut mover) = on_gpu(SMALL) else { return };
    let first = update(&mut mover, SMALL.profiles("big_2"));
    update(&mut mover, SMALL.profiles("planform_2"));
    let again = update(&mut mover, SMALL.profiles("big_2"));
    compare(first.vertices(), again.vertices(), 0.0).unwrap();
    let fresh = update(&mut on_gpu(SMALL).unwrap(), SMALL.profiles("big_2"));
    compare(first.vertices(), fresh.vertices(), 0.0).unwrap();
    assert_eq!(first.solver, fresh.solver);
}

#[test]
fn gpu_leaves_the_mesh_alone_where_nothing_changes() {
    let Some(mut mover) = on_gpu(SMALL) else { return };
    let outcome = update(&mut mover, SMALL.profiles("old_2"));
    compare(&mover.mesh().vertices, outcome.vertices(), 0.0).unwrap();
}

#[test]
fn comparison_of_runs_rejects_one_wrong_vertex() {
    let cpu = update(&mut SMALL.mover(2), SMALL.profiles("big_2"));
    let largest = cpu.displacement().iter().map(|d| d.length()).fold(0.0, f64::max);
    compare_runs(&cpu, cpu.displacement()).unwrap();
    for (vertex, by) in [(17, 2.0 * TOLERANCE * largest), (1000, f64::NAN)] {
        let mut wrong = cpu.displacement().to_vec();
        wrong[vertex].z += by;
        assert_eq!(compare_runs(&cpu, &wrong).unwrap_err().worst_vertex, vertex);
    }
    // A dead kernel leaves zeros.
    assert!(compare_runs(&cpu, &vec![DVec3::ZERO; cpu.displacement().len()]).is_err());
}

/// Movers of one device, each on a thread of its own, do not hear of each other.
#[test]
fn movers_share_a_gpu_side_by_side() {
    let Some(backend) = single() else { return };
    let backend = Arc::new(backend);
    let run = &|sets: [&str; 2]| {
        let mut mover = SMALL.builder(SMALL.profiles("old_2")).build(backend.clone() as Arc<dyn Backend>).unwrap();
        sets.map(|set| update(&mut mover, SMALL.profiles(set)).vertices().to_vec())
    };
    let all = [["big_2", "planform_2"], ["planform_2", "small_2"], ["small_2", "big_2"]];
    let alone = all.map(run);
    let beside: Vec<_> = std::thread::scope(|scope| {
        let threads = all.map(|sets| scope.spawn(move || run(sets)));
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    for (alone, beside) in alone.iter().flatten().zip(beside.iter().flatten()) {
        compare(alone, beside, 0.0).unwrap();
    }
}
