//! What the benchmarks share: the example, the machine, medians and tables.
#![allow(dead_code, reason = "each benchmark uses a part of it")]

pub mod cost;
pub mod network;

use std::{error::Error, fs, path::PathBuf, process::ExitCode, thread};

use glam::DVec3;
use idmesh::{
    backend::BackendInfo,
    case::{Case, LoadedCase},
};

/// What goes wrong in a benchmark.
pub type Failure = Box<dyn Error>;

/// The example `wing-body`.
///
/// # Errors
/// A file is missing or broken.
pub fn example() -> Result<LoadedCase, Failure> {
    Ok(Case::load(root().join("examples/wing-body/case.toml"))?)
}

/// The folder of the repository: where Cargo says it is. For benchmarks carried to another machine
/// the folder of their executables, if it has the meshes, else the current one.
pub fn root() -> PathBuf {
    let of_program = || Some(std::env::current_exe().ok()?.parent()?.to_owned());
    let carried = || of_program().filter(|folder| folder.join("examples").is_dir());
    let of_cargo = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from);
    of_cargo.or_else(carried).unwrap_or_default()
}

/// A brick of `n` cubes of side 1 in each direction, each six tets around its main diagonal: its
/// vertices, its tets, and whether a vertex is on its boundary.
pub fn brick(n: usize) -> (Vec<DVec3>, Vec<[u32; 4]>, Vec<bool>) {
    let side = n + 1;
    let index = |at: [usize; 3]| ((at[2] * side + at[1]) * side + at[0]) as u32;
    let place = |vertex: usize| [vertex % side, vertex / side % side, vertex / (side * side)];
    let places: Vec<[usize; 3]> = (0..side * side * side).map(place).collect();
    let on_boundary = places.iter().map(|at| at.iter().any(|&step| step == 0 || step == n)).collect();
    let points = places.iter().map(|at| DVec3::from_array(at.map(|step| step as f64))).collect();
    let mut tets = Vec::with_capacity(6 * n * n * n);
    for corner in places.iter().filter(|at| at.iter().all(|&step| step < n)) {
        // A tet runs along the axes in one of their six orders; odd orders are turned over.
        for (order, odd) in [
            ([0, 1, 2], false),
            ([1, 2, 0], false),
            ([2, 0, 1], false),
            ([0, 2, 1], true),
            ([2, 1, 0], true),
            ([1, 0, 2], true),
        ] {
            let mut at = *corner;
            let mut tet = [index(at); 4];
            for (step, axis) in order.into_iter().enumerate() {
                at[axis] += 1;
                tet[step + 1] = index(at);
            }
            if odd {
                tet.swap(2, 3);
            }
            tets.push(tet);
        }
    }
    (points, tets, on_boundary)
}

/// The whole numbers among the arguments, `defaults` if there are none. Cargo's own `--bench` is
/// passed over.
///
/// # Errors
/// An argument that is neither.
pub fn numbers(defaults: &[usize]) -> Result<Vec<usize>, Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    if arguments.is_empty() {
        return Ok(defaults.to_vec());
    }
    let number = |text: &String| text.parse().ok().filter(|&number: &usize| number > 0);
    arguments
        .iter()
        .map(|text| number(text).ok_or_else(|| format!("`{text}` is no whole number from 1 on").into()))
        .collect()
}

/// What the figures were measured on and with.
pub fn print_machine(backends: &[BackendInfo]) {
    let profile = if cfg!(debug_assertions) { "debug: these times mean nothing" } else { "release" };
    println!("idmesh {}, {profile}, {}-{}", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH, std::env::consts::OS);
    for BackendInfo { kind, adapter, driver, arithmetic } in backends {
        println!("{kind}: {adapter} {driver}, cycles in {}", arithmetic.name());
    }
    println!();
}

/// The middle one of some times; the upper of the two middle ones if their number is even.
pub fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Prints rows as columns: the first to the left, the others to the right.
pub fn print_table(rows: &[Vec<String>]) {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    for row in rows {
        let cells = row.iter().zip(&widths).enumerate().map(|(column, (cell, &width))| match column {
            0 => format!("{cell:<width$}"),
            _ => format!("{cell:>width$}"),
        });
        println!("{}", cells.collect::<Vec<_>>().join("  ").trim_end());
    }
}

/// A row of texts.
pub fn row(cells: &[&str]) -> Vec<String> {
    cells.iter().map(|&cell| cell.to_owned()).collect()
}

/// Ends a benchmark.
pub fn end(result: Result<(), Failure>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}

/// How long this thread has had a core, s; nothing where the system does not tell.
pub fn on_core() -> Option<f64> {
    // The system reckons the time up when another thread may have the core, otherwise ten
    // milliseconds late.
    thread::yield_now();
    let text = fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<u64>().ok()? as f64 * 1e-9)
}
