//! Everything a mesh costs, from 5 000 cells up, on the CPU and on a GPU: how it grows, and where a
//! GPU gets faster.
//!
//! `cargo bench --bench sizes -- [--refine N] [MESH ...]`: meshes with a family `wing`, in the
//! order of their sizes; the last is refined N times. Without any those of the tests and the
//! example, the last refined once. A mesh's surfaces pitch by 10 degrees, but for families
//! `symmetry`, `..._plane` and `farfield`. The GPU may be a software adapter; it is named. Where
//! there is none its rows are left out. `RAYON_NUM_THREADS` limits the CPU's threads. The last
//! columns tell how well the order of the vertices suits a GPU; see `RowBlocks`.

mod common;
#[path = "../tests/common/heap.rs"]
mod heap;
#[path = "../tests/common/row_blocks.rs"]
mod row_blocks;

use std::{
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
    time::Instant,
};

use common::{
    Failure, median,
    network::{Edges, copy_bandwidth, sweep_speed},
    print_machine, print_table, row,
};
use glam::DQuat;
use idmesh::{
    backend::{self, Backend, BackendError, CpuBackend, DeviceWork, Selection},
    constraint::Constraint,
    families::Role,
    formats::{self, MeshFile},
    mesh::{self, CornerCells, HybridMesh, Order, OtherCells, TetMesh},
    mover::{Design, Mover},
    relaxation::FreeRows,
};
use row_blocks::RowBlocks;

/// Counts the bytes in use.
#[global_allocator]
static HEAP: heap::Counting = heap::Counting;

/// Updates a figure is the median of, after a first one that is not counted; above [`LARGE`] cells
/// one.
const UPDATES: usize = 5;

/// See [`UPDATES`].
const LARGE: usize = 2_000_000;

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
    let mut rows = vec![row(&[
        "mesh",
        "cells",
        "vertices",
        "on",
        "read s",
        "set-up s",
        "update s",
        "cycles",
        "MB",
        "heap B/cell",
        "ms/sweep",
        "GB/s",
        "of copying",
        "MB up",
        "MB down",
        "submissions",
        "reads",
        "commands",
        "columns a row",
        "most in 256 rows",
        "padding of 32",
    ])];
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
                let cost = Cost::of(&mesh, &others, backend)?;
                rows.push(cost.row(&name, &read));
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

/// What a mesh costs on a backend.
struct Cost {
    n_cells: usize,
    n_vertices: usize,
    kind: &'static str,
    set_up: f64,
    update: f64,
    cycles: usize,
    /// Most memory of the process during set-up and updates; NaN where the system does not tell.
    megabytes: f64,
    /// Most bytes for each cell on the heap during set-up and first update, the mesh included and
    /// its file not. What a driver takes does not count.
    heap: f64,
    sweep: f64,
    bandwidth: f64,
    copying: f64,
    /// What the last update asked of the device; nothing of the CPU.
    work: Option<DeviceWork>,
    blocks: RowBlocks,
}

impl Cost {
    fn of(mesh: &TetMesh, others: &OtherCells, backend: &Arc<dyn Backend>) -> Result<Self, Failure> {
        let role = |family: &String| match family.as_str() {
            "farfield" => Role::Fixed,
            "symmetry" => Role::PLANE,
            plane if plane.ends_with("_plane") => Role::PLANE,
            _ => Role::Prescribed,
        };
        let before = heap::in_use();
        let mut given = mesh.clone();
        // A mesh that is shared and turned would be there twice.
        given.turn_tets();
        let mut builder = Mover::builder(given).other_cells(others.clone());
        for family in &mesh.families {
            builder = builder.role(family, role(family));
        }
        let n_cells = mesh.tets.len() + others.n_cells();
        forget_peak_memory();
        heap::forget_peak();
        let start = Instant::now();
        let mut mover = builder.build(Arc::clone(backend))?;
        let set_up = start.elapsed().as_secs_f64();
        let wing = mover.family_vertices("wing").ok_or("the mesh has no family `wing`")?;
        let pivot = mesh.vertices[wing[0] as usize];
        let turn = DQuat::from_rotation_y(10f64.to_radians());
        let mut design = Design::default();
        for name in mesh.families.iter().filter(|family| role(family) == Role::Prescribed) {
            let moves = |&vertex: &u32| {
                turn * (mesh.vertices[vertex as usize] - pivot) - (mesh.vertices[vertex as usize] - pivot)
            };
            let vertices = mover.family_vertices(name).into_iter().flatten();
            design.prescribed.insert(name.clone(), vertices.map(moves).collect());
        }
        let mut times = Vec::new();
        let mut of_heap = 0;
        let updates = if n_cells > LARGE { 1 } else { UPDATES };
        let (mut cycles, mut work) = (0, None);
        for _ in 0..=updates {
            let start = Instant::now();
            let outcome = mover.update(&design)?;
            times.push(start.elapsed().as_secs_f64());
            (cycles, work) = (outcome.solver.sweeps, outcome.device_work);
            if of_heap == 0 {
                of_heap = heap::peak() - before;
            }
            if outcome.inverted > 0 || !outcome.converged {
                return Err("the mesh did not come out well, so its times mean nothing".into());
            }
        }
        let update = median(times.split_off(1));
        let megabytes = peak_memory();
        drop(mover);

        let hybrid = HybridMesh { mesh, others };
        let mut is_held = vec![false; mesh.vertices.len()];
        let on_surface = mesh.triangles.iter().flatten().chain(others.quadrilaterals.iter().flatten());
        on_surface.for_each(|&vertex| is_held[vertex as usize] = true);
        let order = Order::new(hybrid, &is_held);
        let (mesh, others) = (order.of(mesh), order.of_others(others));
        let (simplices, cells) = CornerCells::new(HybridMesh { mesh: &mesh, others: &others });
        let may = |is_held: bool| if is_held { Constraint::Held } else { Constraint::Free };
        let constraint = order.to_vertices(&is_held).into_iter().map(may).collect();
        let edges = Edges::of_cells(&mesh.vertices, &simplices.tets, |edges| cells.real_edges(edges));
        let moving = FreeRows::new(&edges.network(&CpuBackend::default(), constraint)?);
        let sweep = sweep_speed(&moving, backend.as_ref())?;
        let blocks = RowBlocks::new(&moving.network.graph);
        let (n_vertices, kind) = (mesh.vertices.len(), backend.info().kind);
        let copying = copy_bandwidth()?;
        Ok(Self {
            n_cells,
            n_vertices,
            kind,
            set_up,
            update,
            cycles,
            megabytes,
            heap: of_heap as f64 / n_cells as f64,
            sweep: sweep.seconds,
            bandwidth: sweep.bandwidth,
            copying,
            work,
            blocks,
        })
    }

    fn row(&self, name: &str, read: &str) -> Vec<String> {
        let of_work = |of: fn(DeviceWork) -> String| self.work.map_or_else(|| "-".to_owned(), of);
        vec![
            name.to_owned(),
            self.n_cells.to_string(),
            self.n_vertices.to_string(),
            self.kind.to_owned(),
            read.to_owned(),
            format!("{:.3}", self.set_up),
            format!("{:.4}", self.update),
            self.cycles.to_string(),
            format!("{:.0}", self.megabytes),
            format!("{:.0}", self.heap),
            format!("{:.3}", 1e3 * self.sweep),
            format!("{:.1}", 1e-9 * self.bandwidth),
            format!("{:.0} %", 100.0 * self.bandwidth / self.copying),
            of_work(|work| format!("{:.2}", 1e-6 * work.bytes_up as f64)),
            of_work(|work| format!("{:.2}", 1e-6 * work.bytes_down as f64)),
            of_work(|work| work.submissions.to_string()),
            of_work(|work| work.reads.to_string()),
            of_work(|work| (work.dispatches + work.copies + work.clears).to_string()),
            format!("{:.2}", self.blocks.columns_a_row),
            self.blocks.most_columns.to_string(),
            format!("{:.1} %", 100.0 * self.blocks.padding),
        ]
    }
}

/// Lets the process's peak start again from here; Linux alone can.
fn forget_peak_memory() {
    // Where it cannot be written the peak is that of the whole process, which the largest mesh
    // makes.
    let _ = fs::write(Path::new("/proc/self/clear_refs"), "5");
}

/// Megabytes the process has had at most.
fn peak_memory() -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok());
    kilobytes.map_or(f64::NAN, |kilobytes| kilobytes * 1.024e-3)
}
