//! What a mesh costs on a backend: set-up, update, memory, sweeps, and what is asked of a GPU.

#[path = "../../tests/common/heap.rs"]
pub mod heap;
#[path = "../../tests/common/row_blocks.rs"]
mod row_blocks;

use std::{fs, path::Path, sync::Arc, time::Instant};

use glam::DQuat;
use idmesh::{
    backend::{Backend, CpuBackend, DeviceWork},
    constraint::Constraint,
    families::Role,
    mesh::{CornerCells, HybridMesh, Order, OtherCells, TetMesh},
    mover::{Design, Mover, MoverBuilder, Outcome},
    relaxation::FreeRows,
};

use self::row_blocks::RowBlocks;
use super::{
    Failure, median,
    network::{Edges, Speed, copy_bandwidth, sweep_speed},
};

/// Updates a figure is the median of, after a first one that is not counted; above [`LARGE`] cells
/// one.
const UPDATES: usize = 5;

/// See [`UPDATES`].
const LARGE: usize = 2_000_000;

/// Passes of a cycle over the finest level, in the model.
const PASSES: f64 = 5.0;

/// The names of [`Cost::cells`].
pub const COLUMNS: [&str; 24] = [
    "cells",
    "vertices",
    "on",
    "set-up s",
    "update s",
    "host s",
    "kernels s",
    "model s",
    "cycles",
    "MB",
    "heap B/cell",
    "ms/sweep",
    "GB/s",
    "of copying",
    "bytes/row",
    "MB up",
    "MB down",
    "submissions",
    "reads",
    "dispatches",
    "copies, clears",
    "columns a row",
    "most in 256 rows",
    "padding of 32",
];

/// What a mesh costs on a backend.
pub struct Cost {
    pub n_cells: usize,
    n_vertices: usize,
    pub kind: &'static str,
    pub set_up: f64,
    pub update: f64,
    /// Seconds of an update in which the host does not wait for the device.
    host: f64,
    /// Seconds of the device's kernels in an update, where it tells.
    kernels: Option<f64>,
    cycles: usize,
    /// Most memory of the process during set-up and updates; NaN where the system does not tell.
    pub megabytes: f64,
    /// Most bytes for each cell on the heap during set-up and first update, the mesh included and
    /// its file not. What a driver takes does not count.
    heap: f64,
    sweeps: Option<Sweeps>,
    /// What the last update asked of the device; nothing of the CPU.
    work: Option<DeviceWork>,
}

/// Sweeps over the finest level.
struct Sweeps {
    speed: Speed,
    /// Bytes a second of copying on the same device.
    copying: f64,
    n_rows: usize,
    /// Bytes of a row in a pass, by the model.
    bytes: f64,
    blocks: RowBlocks,
}

impl Cost {
    /// Measures set-up, updates and, if they are wanted, sweeps.
    ///
    /// # Errors
    /// The mesh has no family `wing`, it does not come out well, or the backend failed.
    pub fn of(
        mesh: &TetMesh,
        others: &OtherCells,
        backend: &Arc<dyn Backend>,
        with_sweeps: bool,
    ) -> Result<Self, Failure> {
        let n_cells = mesh.tets.len() + others.n_cells();
        let before = heap::in_use();
        let mut given = mesh.clone();
        // A mesh that is shared and turned would be there twice.
        given.turn_tets();
        let builder = pitching(given, others);
        forget_peak_memory();
        heap::forget_peak();
        let start = Instant::now();
        let mut mover = builder.build(Arc::clone(backend))?;
        let set_up = start.elapsed().as_secs_f64();
        let design = pitch(mesh, &mover)?;
        let updates = if n_cells > LARGE { 1 } else { UPDATES };
        let (mut times, mut host, mut kernels) = (Vec::new(), Vec::new(), Vec::new());
        let (mut cycles, mut work, mut of_heap) = (0, None, 0);
        for _ in 0..=updates {
            let start = Instant::now();
            let outcome = mover.update(&design)?;
            times.push(start.elapsed().as_secs_f64());
            if of_heap == 0 {
                of_heap = heap::peak() - before;
            }
            let waiting: f64 = outcome.stage_seconds.iter().map(|stage| stage.waiting).sum();
            host.push(times[times.len() - 1] - waiting);
            kernels.push(outcome.stage_seconds.iter().map(|stage| stage.kernels).sum::<Option<f64>>());
            (cycles, work) = (volume_cycles(&outcome), outcome.device_work);
            if outcome.inverted > 0 || !outcome.converged {
                return Err("the mesh did not come out well, so its times mean nothing".into());
            }
        }
        let megabytes = peak_memory();
        drop(mover);
        let warm = |times: &mut Vec<f64>| median(times.split_off(1));
        Ok(Self {
            n_cells,
            n_vertices: mesh.vertices.len(),
            kind: backend.info().kind,
            set_up,
            update: warm(&mut times),
            host: warm(&mut host),
            kernels: kernels.into_iter().skip(1).collect::<Option<Vec<_>>>().map(median),
            cycles,
            megabytes,
            heap: of_heap as f64 / n_cells as f64,
            sweeps: if with_sweeps { Some(Sweeps::of(mesh, others, backend.as_ref())?) } else { None },
            work,
        })
    }

    /// The figures in the order of [`COLUMNS`].
    pub fn cells(&self) -> Vec<String> {
        let of_work = |of: fn(DeviceWork) -> String| self.work.map_or_else(none, of);
        let of_sweeps = |of: &dyn Fn(&Sweeps) -> String| self.sweeps.as_ref().map_or_else(none, of);
        let of_gpu = |of: &dyn Fn(&Sweeps) -> String| if self.work.is_some() { of_sweeps(of) } else { none() };
        vec![
            self.n_cells.to_string(),
            self.n_vertices.to_string(),
            self.kind.to_owned(),
            format!("{:.3}", self.set_up),
            format!("{:.4}", self.update),
            format!("{:.4}", self.host),
            self.kernels.map_or_else(none, |kernels| format!("{kernels:.4}")),
            of_gpu(&|sweeps| format!("{:.4}", sweeps.model(self.cycles))),
            self.cycles.to_string(),
            format!("{:.0}", self.megabytes),
            format!("{:.0}", self.heap),
            of_sweeps(&|sweeps| format!("{:.3}", 1e3 * sweeps.speed.seconds)),
            of_sweeps(&|sweeps| format!("{:.1}", 1e-9 * sweeps.speed.bandwidth)),
            of_sweeps(&|sweeps| format!("{:.0} %", 100.0 * sweeps.speed.bandwidth / sweeps.copying)),
            of_gpu(&|sweeps| format!("{:.0}", sweeps.bytes)),
            of_work(|work| format!("{:.2}", 1e-6 * work.bytes_up as f64)),
            of_work(|work| format!("{:.2}", 1e-6 * work.bytes_down as f64)),
            of_work(|work| work.submissions.to_string()),
            of_work(|work| work.reads.to_string()),
            of_work(|work| work.dispatches.to_string()),
            of_work(|work| (work.copies + work.clears).to_string()),
            of_sweeps(&|sweeps| format!("{:.2}", sweeps.blocks.columns_a_row)),
            of_sweeps(&|sweeps| sweeps.blocks.most_columns.to_string()),
            of_sweeps(&|sweeps| format!("{:.1} %", 100.0 * sweeps.blocks.padding)),
        ]
    }
}

impl Sweeps {
    fn of(mesh: &TetMesh, others: &OtherCells, backend: &dyn Backend) -> Result<Self, Failure> {
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
        let (n_rows, n_springs) = (moving.network.len(), moving.network.stiffness.len());
        let copying = match backend.copying()? {
            Some(of_device) => of_device,
            None => copy_bandwidth()?,
        };
        Ok(Self {
            speed: sweep_speed(&moving, backend)?,
            blocks: RowBlocks::new(&moving.network.graph),
            copying,
            n_rows,
            // Column and stiffness of each spring; the row's start; load, constraint, correction,
            // and the one before, which is read and written, in four numbers each.
            bytes: (8 * n_springs) as f64 / n_rows as f64 + (4 + 5 * 16) as f64,
        })
    }

    /// Seconds in which cycles over the finest level move their bytes as fast as copying does.
    fn model(&self, cycles: usize) -> f64 {
        cycles as f64 * PASSES * self.n_rows as f64 * self.bytes / self.copying
    }
}

fn none() -> String {
    "-".to_owned()
}

/// The cycles over the volume, for rotations and displacements.
pub fn volume_cycles(outcome: &Outcome) -> usize {
    let of_volume = outcome.relaxations.iter().filter(|one| one.stage == "volume");
    of_volume.map(|one| one.relaxation.sweeps).sum()
}

/// A mover of a mesh whose surfaces pitch, but for families `symmetry`, `..._plane` and `farfield`.
pub fn pitching(mesh: TetMesh, others: &OtherCells) -> MoverBuilder {
    let families = mesh.families.clone();
    let builder = Mover::builder(mesh).other_cells(others.clone());
    families.iter().fold(builder, |builder, family| builder.role(family, role(family)))
}

fn role(family: &str) -> Role {
    match family {
        "farfield" => Role::Fixed,
        "symmetry" => Role::PLANE,
        plane if plane.ends_with("_plane") => Role::PLANE,
        _ => Role::Prescribed,
    }
}

/// A pitch by 10 degrees.
///
/// # Errors
/// The mesh has no family `wing`.
pub fn pitch(mesh: &TetMesh, mover: &Mover) -> Result<Design, Failure> {
    let wing = mover.family_vertices("wing").ok_or("the mesh has no family `wing`")?;
    let pivot = mesh.vertices[wing[0] as usize];
    let turn = DQuat::from_rotation_y(10f64.to_radians());
    let mut design = Design::default();
    for name in mesh.families.iter().filter(|family| role(family) == Role::Prescribed) {
        let moves =
            |&vertex: &u32| turn * (mesh.vertices[vertex as usize] - pivot) - (mesh.vertices[vertex as usize] - pivot);
        let vertices = mover.family_vertices(name).into_iter().flatten();
        design.prescribed.insert(name.clone(), vertices.map(moves).collect());
    }
    Ok(design)
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
