//! The memory that a jump takes, counted by the allocator: the set-up of a mover and an update
//! without local optimisation, of one design or of several in one solve. The file's text does not
//! count, the mesh does.

#[path = "common/heap.rs"]
mod heap;

use std::{path::Path, sync::Arc};

use glam::DQuat;
use heap::Counting;
use idmesh::{
    backend::{Backend, CpuBackend},
    families::Role,
    formats,
    mover::{Design, Mover},
};

#[global_allocator]
static HEAP: Counting = Counting;

/// Most bytes a tet at the peak of a jump.
const OF_TET: usize = 320;

/// Most bytes a tet that a design more in the same solve takes, with its outcome: a quarter of what
/// a mover is checked for.
const OF_DESIGN: usize = 132;

/// Bytes beside these: a small mesh has more surface for its tets.
const BESIDE: usize = 10_000_000;

/// The wing of a mesh of 102 341 tets pitches by 10 degrees. Before the peak was looked after, this
/// took 446 bytes a tet.
///
/// Fails if local optimisation is set up for a mesh that does not need it, together with any other
/// array of eight bytes for each entry of a network.
#[test]
fn a_jump_takes_little_memory() {
    // More threads set more parts up at once.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let (n_tets, peak) = pool.install(|| jump(1));
    let (_, together) = pool.install(|| jump(4));
    let of_design = (together - peak) / 3;
    assert!(of_design <= OF_DESIGN * n_tets, "{:.1} bytes a tet a design", of_design as f64 / n_tets as f64);
    let most = OF_TET * n_tets + BESIDE;
    assert!(peak <= most, "{:.1} bytes a tet, {peak} of {most} in all", peak as f64 / n_tets as f64);
    // The counter counts: vertices and tets alone take 20 bytes a tet, twice.
    assert!(peak > 40 * n_tets, "{peak}");
}

/// Number of tets, and bytes at the peak.
///
/// - `designs`: number of designs in one solve
fn jump(designs: usize) -> (usize, usize) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/pitch-wing.msh.gz");
    let before = heap::in_use();
    let mesh = formats::read(&file).unwrap().mesh;
    let n_tets = mesh.tets.len();
    let families = mesh.families.clone();
    heap::forget_peak();
    let mut builder = Mover::builder(mesh);
    for family in &families {
        builder = builder.role(family, if family == "wing" { Role::Prescribed } else { Role::Fixed });
    }
    let backend: Arc<dyn Backend> = Arc::new(CpuBackend::default());
    let mut mover = builder.build(backend).unwrap();
    let wing = mover.family_vertices("wing").unwrap();
    let vertices = &mover.mesh().vertices;
    let pivot = vertices[wing[0] as usize];
    let pitched = |number: usize| {
        let turn = DQuat::from_rotation_y((10.0 - number as f64).to_radians());
        let arm = |&vertex: &u32| vertices[vertex as usize] - pivot;
        let mut design = Design::default();
        design.prescribed.insert("wing".to_owned(), wing.iter().map(arm).map(|arm| turn * arm - arm).collect());
        design
    };
    let designs: Vec<Design> = (0..designs).map(pitched).collect();
    let outcomes = mover.update_many(&designs.iter().collect::<Vec<_>>());
    for outcome in outcomes.iter().map(|outcome| outcome.as_ref().unwrap()) {
        assert!(outcome.is_valid() && outcome.converged && outcome.smoothed.is_none());
    }
    (n_tets, heap::peak() - before)
}
