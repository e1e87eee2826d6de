//! Moved meshes on the GPU against the CPU in f64.

use std::{path::Path, sync::Arc, time::Instant};

use idmesh::{
    backend::{Backend, CpuBackend, Precision, gpu::Bounds},
    formats,
    mesh::{OtherCells, TetMesh},
    mover::{Design, Moved, Mover, MoverBuilder, Outcome},
    relaxation::Stopping,
};

use crate::{
    Budget,
    common::{
        self, Failure,
        cost::{pitch, pitching, volume_cycles},
    },
    gpu, print_cells, print_header,
};

/// The tolerance of every case, and one near the roundoff of f64.
const TOLERANCES: [f64; 2] = [1e-4, 1e-12];

/// Largest allowed difference, over the largest displacement: with f64 on the GPU, and without.
const ALLOWED: [f64; 2] = [1e-11, 1e-6];

/// A design for a mover.
type OfMover = dyn Fn(&Mover) -> Result<Design, Failure>;

/// A mesh and how it moves.
struct Moving {
    name: String,
    tets: usize,
    builder: Box<dyn Fn() -> MoverBuilder>,
    design: Box<OfMover>,
}

/// Prints the differences of GPU and CPU.
///
/// # Errors
/// The GPU differs by more than is allowed, or by anything from itself.
pub fn run(budget: &Budget) -> Result<(), Failure> {
    let gpu = gpu(Bounds::default())?;
    let is_double = gpu.info().arithmetic == Precision::F64;
    let allowed = ALLOWED[usize::from(!is_double)];
    let backends: [Arc<dyn Backend>; 2] = [Arc::new(CpuBackend::new(Precision::F64)), Arc::new(gpu)];
    print_header(&[
        "mesh",
        "tets",
        "tolerance",
        "cycles, CPU",
        "cycles, GPU",
        "numbers",
        "of other bits",
        "largest difference over displacement",
        "twice the same",
        "good",
    ]);
    let mut all_good = true;
    let mut last = 0.0;
    for refinements in [None, Some(0), Some(1)] {
        for tolerance in TOLERANCES {
            let Moving { name, tets, builder, design } = moving(refinements)?;
            if 1e-6 * tets as f64 > budget.millions {
                println!("\n{name}, {tets} tets: not run, larger than asked for");
                break;
            }
            // A refined mesh takes eight times as long.
            let expected = if refinements == Some(1) && tolerance == TOLERANCES[0] { 8.0 } else { 2.0 } * last;
            if let Some(why) = budget.refuses(expected) {
                println!("\n{name}, {tets} tets, tolerance {tolerance:e}: not run, {why}");
                continue;
            }
            let start = Instant::now();
            let moved = |backend: &Arc<dyn Backend>| -> Result<[Outcome; 2], Failure> {
                // Local optimisation is in f32 on a GPU.
                let builder = builder().stopping(Stopping { tolerance, ..Stopping::default() }).quality(None);
                let mut mover = builder.build(Arc::clone(backend))?;
                let design = design(&mover)?;
                Ok([mover.update(&design)?, mover.update(&design)?])
            };
            let ([of_cpu, _], [of_gpu, again]) = (moved(&backends[0])?, moved(&backends[1])?);
            let [cpu, gpu, again] = [of_cpu.valid()?, of_gpu.valid()?, again.valid()?];
            let largest = cpu.displacement().iter().map(|d| d.length()).fold(0.0, f64::max);
            let differing = |a: &Moved, b: &Moved| {
                let numbers = |moved: &Moved| moved.vertices().iter().flat_map(|v| v.to_array()).collect::<Vec<_>>();
                numbers(a).iter().zip(numbers(b)).filter(|(a, b)| a.to_bits() != b.to_bits()).count()
            };
            let distances = cpu.vertices().iter().zip(gpu.vertices()).map(|(a, b)| a.distance(*b));
            let off = distances.fold(0.0, f64::max) / largest;
            let is_same = differing(gpu, again) == 0;
            let good = is_same && off <= allowed;
            all_good &= good;
            let yes = |is: bool| if is { "yes" } else { "no" }.to_owned();
            print_cells(&[
                name,
                tets.to_string(),
                format!("{tolerance:e}"),
                volume_cycles(&of_cpu).to_string(),
                volume_cycles(&of_gpu).to_string(),
                (3 * cpu.vertices().len()).to_string(),
                differing(cpu, gpu).to_string(),
                format!("{off:.1e}"),
                yes(is_same),
                yes(good),
            ]);
            last = start.elapsed().as_secs_f64();
        }
    }
    println!("\nGood is a difference of at most {allowed:e}, and twice the same bits.");
    if all_good { Ok(()) } else { Err("GPU and CPU differ".into()) }
}

/// The example with all its stages, or the pitching wing, refined so many times.
fn moving(refinements: Option<usize>) -> Result<Moving, Failure> {
    let Some(refinements) = refinements else {
        let (case, design) = (common::example()?, common::example()?.design);
        let (name, tets) = ("wing-body, all stages".to_owned(), case.file.mesh.tets.len());
        let design = Box::new(move |_: &Mover| Ok(design.clone()));
        return Ok(Moving { name, tets, builder: Box::new(move || case.builder()), design });
    };
    let (name, mesh) = wing(refinements)?;
    let (tets, of_builder) = (mesh.tets.len(), mesh.clone());
    let builder = Box::new(move || pitching(of_builder.clone(), &OtherCells::none()));
    Ok(Moving { name, tets, builder, design: Box::new(move |mover| pitch(&mesh, mover)) })
}

/// The pitching wing, refined so many times, with its name.
///
/// # Errors
/// The mesh is missing or broken.
pub fn wing(refinements: usize) -> Result<(String, TetMesh), Failure> {
    let mut mesh = formats::read(&common::root().join(Path::new("tests/data/pitch-wing.msh.gz")))?.mesh;
    for _ in 0..refinements {
        mesh = idmesh::mesh::refine(&mesh)?;
    }
    Ok((["pitching wing".to_owned(), " refined".repeat(refinements)].concat(), mesh))
}
