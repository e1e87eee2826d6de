//! Jumps on an adapter with f64 against the CPU in f64: no differing bit on a software adapter,
//! which rounds as the CPU does; on hardware 1e-11 of the largest displacement. And how little the
//! device is asked for.
//!
//! Needs an adapter. `IDMESH_TEST_GPU=off` skips what does, and says so.
#![cfg(feature = "gpu")]

mod common;

use std::sync::Arc;

use common::adapter::gpu;
use common::aircraft::{Anyway, WING_BODY, builder as of_aircraft, file};
use common::compare;
use glam::DVec3;
use idmesh::backend::gpu::{Bounds, GpuBackend};
use idmesh::backend::{Backend, CpuBackend, DeviceWork, Precision};
use idmesh::families::Role;
use idmesh::formats;
use idmesh::mover::{Design, Mover, MoverBuilder, Outcome};
use idmesh::profile::csv;
use idmesh::relaxation::{Method, Stopping};
use rayon::ThreadPoolBuilder;

/// The tolerance of every case, and one near the roundoff of f64.
const TOLERANCES: [f64; 2] = [1e-4, 1e-12];

/// What a GPU may be asked for in an update of the meshes whose figures are told, by cycles alone.
const MOST_SUBMISSIONS: u64 = 8;
const MOST_READS: u64 = 7;

fn check_work(work: DeviceWork, is_small: bool) {
    assert!(is_small || work.submissions <= MOST_SUBMISSIONS && work.reads <= MOST_READS, "{work:?}");
    assert!(work.dispatches > 0 && work.bytes_up > 0 && work.bytes_down > 0, "{work:?}");
}

fn compare_bits(gpu: &GpuBackend, cpu: &Outcome, found: &Outcome) {
    assert!(cpu.converged && found.converged, "{:?} {:?}", cpu.unconverged, found.unconverged);
    let largest = cpu.displacement().iter().map(|d| d.length()).fold(0.0, f64::max);
    assert!(largest > 0.0);
    let tolerance = if gpu.is_software() { 0.0 } else { 1e-11 * largest };
    compare(cpu.vertices(), found.vertices(), tolerance).unwrap_or_else(|mismatch| panic!("{mismatch:?}"));
    if gpu.is_software() {
        assert_eq!(cpu.solver, found.solver);
        assert_eq!(cpu.relaxations, found.relaxations);
    }
}

/// Moves on the CPU and on the GPU, there twice, and on threads of another number.
///
/// - `is_small`: whether the networks are smaller than a GPU takes by itself
fn check(builder: impl Fn() -> MoverBuilder + Sync, design: impl Fn(&Mover) -> Design + Sync, is_small: bool) {
    // The networks of small surfaces have no levels, and sweeps alone are in f32 on a GPU.
    let least_vertices = if is_small { Some(1000) } else { None };
    let Some(gpu) = gpu(Bounds { least_vertices, ..Bounds::default() }) else { return };
    assert_eq!(gpu.info().arithmetic, Precision::F64, "the adapter does not compute in f64");
    let gpu = Arc::new(gpu);
    for tolerance in TOLERANCES {
        let moved = |backend: Arc<dyn Backend>| {
            let stopping = Stopping { tolerance, ..Stopping::default() };
            let builder = builder()
                .method(if is_small { Method::Multigrid } else { Method::Auto })
                .quality(None)
                .stopping(stopping);
            let mut mover = builder.build(backend).unwrap();
            let design = design(&mover);
            let outcome = mover.update(&design).unwrap();
            (mover, design, outcome)
        };
        let (_, _, cpu) = moved(Arc::new(CpuBackend::new(Precision::F64)));
        assert_eq!(cpu.device_work, None);
        let pool = ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let (mut mover, design, first) = pool.install(|| moved(gpu.clone()));
        compare_bits(&gpu, &cpu, &first);
        let again = mover.update(&design).unwrap();
        compare(first.vertices(), again.vertices(), 0.0).unwrap();
        check_work(first.device_work.unwrap(), is_small);
        assert_eq!(first.device_work, again.device_work);
    }
}

/// Nose up by 10 degrees about the quarter chord, and a parabola along the span that lifts the tips
/// by 0.2 chords. 102 341 tets, of which 14 673 vertices move.
#[test]
fn a_pitching_wing_has_the_bits_of_the_cpu() {
    let mesh = formats::read(&file("tests/data/pitch-wing.msh.gz")).unwrap().mesh;
    let builder = || Mover::builder(mesh.clone()).role("wing", Role::Prescribed).role("farfield", Role::Fixed);
    let design = |mover: &Mover| {
        let (sin, cos) = 10f64.to_radians().sin_cos();
        let by = |&vertex: &u32| {
            let at = mover.mesh().vertices[vertex as usize];
            let (x, z) = (at.x - 0.25, at.z);
            DVec3::new(x * cos + z * sin - x, 0.0, -x * sin + z * cos - z + 0.2 * (at.y / 2.0).powi(2))
        };
        Design::of_prescribed("wing", mover.family_vertices("wing").unwrap().iter().map(by).collect())
    };
    check(builder, design, false);
}

/// All stages of the surfaces, whose networks stay on the CPU.
#[test]
fn the_example_has_the_bits_of_the_cpu() {
    let design = |_: &Mover| Design::of_wing("wing", WING_BODY.profiles("big_2"));
    check(|| WING_BODY.builder(WING_BODY.profiles("old_2")), design, false);
}

/// A wing-body of tets, pyramids, prisms and hexahedra, of which the GPU has the volume's networks.
#[test]
fn a_hybrid_mesh_has_the_bits_of_the_cpu() {
    let read = formats::read_mixed(&file("tests/data/hybrid/small.msh.gz")).unwrap();
    let profiles = |name: &str| {
        let path = file(&format!("tests/data/hybrid/{name}.csv"));
        csv::parse(&[(&path, &std::fs::read_to_string(&path).unwrap())]).unwrap()
    };
    let builder = || of_aircraft(read.mesh.clone(), profiles("old_2")).other_cells(read.others.clone());
    check(builder, |_| Design::of_wing("wing", profiles("small_2")), true);
}
