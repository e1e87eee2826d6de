//! Everything a mesh costs, from 5 000 cells up, on the CPU and on a GPU: how it grows, and where a
//! GPU gets faster.
//!
//! `cargo bench --bench sizes -- [--refine N] [MESH ...]`: meshes with a family `wing`, in the
//! order of their sizes; the last is refined N times. Without any those of the tests and the
//! example, the last refined once. A mesh's surfaces pitch by 10 degrees, but for families
//! `symmetry`, `..._plane` and `farfield`. The GPU may be a software adapter; it is named. Where
//! there is none its rows are left out. `RAYON_NUM_THREADS` limits the CPU's threads. With
//! `IDMESH_GPU_TIMES=1` there are the seconds of the GPU's kernels. The last columns tell how well
//! the order of the vertices suits a GPU; see `RowBlocks`.

mod common;

use std::{path::PathBuf, process::ExitCode, sync::Arc, time::Instant};

use common::{
    Failure,
    cost::{COLUMNS, Cost, heap},
    print_machine, print_table, row,
};
use idmesh::{
    backend::{self, Backend, BackendError, Selection},
    formats::{self, MeshFile},
    mesh::{self, HybridMesh, OtherCells, TetMesh},
};

/// Counts the bytes in use.
#[global_allocator]
static HEAP: heap::Counting = heap::Counting;

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let mut backends: Vec<Arc<dyn Backend>> = vec![backend::select(Selection::Cpu)?.into()];
    match backend::select(Selection::Gpu) {
        Ok(gpu) => backends.push(gpu.into()),
        Err(BackendError::NoAdapter(why)) => eprintln!("no rows for a GPU: {why}"),
        Err(error) => return Err(error.into()),
    }
    print_machine(&backends.iter().map(|backend| backend.info()).collect::<Vec<_>>());
    let (files, refinements) = arguments()?;
    let mut rows = vec![row(&["mesh", "read s"])];
    rows[0].extend(row(&COLUMNS));
    let mut costs = Vec::new();
    for (at, file) in files.iter().enumerate() {
        let start = Instant::now();
        let MeshFile { mut mesh, mut others, .. } = formats::read_mixed(file)?;
        let mut read = format!("{:.3}", start.elapsed().as_secs_f64());
        let mut name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        for refinement in 0..=if at + 1 == files.len() { refinements } else { 0 } {
            if refinement > 0 {
                (mesh, others) = mesh::refine_hybrid(HybridMesh { mesh: &mesh, others: &others })?;
                read = written_and_read(&mesh, &others)?;
                name.push_str(" refined");
            }
            for backend in &backends {
                let cost = Cost::of(&mesh, &others, backend, true)?;
                rows.push([vec![name.clone(), read.clone()], cost.cells()].concat());
                costs.push(cost);
            }
        }
    }
    print_table(&rows);
    println!();
    if let ([first, ..], Some(last)) = (&costs[..], costs.iter().rfind(|cost| cost.kind == costs[0].kind)) {
        let growth =
            |of: fn(&Cost) -> f64| (of(last) / of(first)).ln() / (last.n_cells as f64 / first.n_cells as f64).ln();
        println!(
            "on {} from {} to {} cells, as a power of their number: set-up {:.2}, update {:.2}, memory {:.2}",
            first.kind,
            first.n_cells,
            last.n_cells,
            growth(|cost| cost.set_up),
            growth(|cost| cost.update),
            growth(|cost| cost.megabytes)
        );
    }
    if backends.len() > 1 {
        let faster = costs.chunks(2).find(|pair| pair[1].update < pair[0].update);
        match faster {
            Some(pair) => println!("an update on the GPU is faster from {} cells on", pair[0].n_cells),
            None => println!("an update on the GPU is faster at none of these sizes"),
        }
    }
    Ok(())
}

/// The meshes and how often the last is refined.
fn arguments() -> Result<(Vec<PathBuf>, usize), Failure> {
    let (mut files, mut refinements) = (Vec::new(), None);
    let mut words = std::env::args().skip(1).filter(|word| word != "--bench");
    while let Some(word) = words.next() {
        match word.as_str() {
            "--refine" => {
                let number = words.next().ok_or("--refine needs a number")?;
                refinements = Some(number.parse().map_err(|_| format!("`{number}` is no number of refinements"))?);
            }
            file => files.push(PathBuf::from(file)),
        }
    }
    if files.is_empty() {
        let own = ["tests/data/small.msh.gz", "examples/wing-body/wing-body.msh.gz", "tests/data/pitch-wing.msh.gz"];
        return Ok((own.map(|file| common::root().join(file)).to_vec(), refinements.unwrap_or(1)));
    }
    Ok((files, refinements.unwrap_or(0)))
}

/// Seconds to read a mesh from a file of Gmsh's, which is written first.
fn written_and_read(mesh: &TetMesh, others: &OtherCells) -> Result<String, Failure> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("mesh.msh");
    let file = MeshFile::from_cells(mesh.clone(), others.clone());
    file.write(&path, &file.mesh.vertices, &formats::Fields::default())?;
    drop(file);
    let start = Instant::now();
    formats::read_mixed(&path)?;
    Ok(format!("{:.3}", start.elapsed().as_secs_f64()))
}
