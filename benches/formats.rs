//! Megabytes a second of each mesh format: reading, writing back moved, writing new.
//!
//! `cargo bench --bench formats -- [MESH]`: the example's mesh, or another, converted to every format in memory. One thread; no
//! disk. Where the system tells, times are those the thread had a core, so that other work on the machine counts less.

mod common;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use common::{Example, Failure, median, print_machine, print_table, row};
use glam::DVec3;
use idmesh::formats::{self, FORMATS, Fields, MeshFile};

/// Repetitions a figure is the median of.
const REPEATS: usize = 5;

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    print_machine(&[]);
    let path = std::env::args().skip(1).find(|argument| argument != "--bench").map(PathBuf::from);
    let source = match &path {
        Some(path) => formats::read_mixed(path)?,
        None => Example::read()?.file,
    };
    println!("{} vertices, {} tets\n", source.mesh.vertices.len(), source.mesh.tets.len());
    let moved: Vec<DVec3> = source.mesh.vertices.iter().map(|&vertex| vertex * 1.01 + DVec3::splat(1e-3)).collect();
    let mut rows = vec![row(&["format", "MB", "read MB/s", "write back MB/s", "write new MB/s"])];
    for extension in FORMATS.iter().filter(|format| !format.is_folder()).flat_map(|format| format.extensions) {
        let path = PathBuf::from(format!("mesh.{extension}"));
        // A file of another format has no source of this one, so that this one is written new.
        let new = MeshFile::from_mesh(source.mesh.clone());
        let bytes = written(&new, &path, &source.mesh.vertices)?;
        let file = formats::read_bytes(&path, bytes.clone())?;
        let megabytes = bytes.len() as f64 / 1e6;
        let speed = |action: &dyn Fn() -> Result<(), Failure>| -> Result<String, Failure> {
            let mut times = Vec::new();
            for _ in 0..REPEATS {
                let start = (Instant::now(), on_core());
                action()?;
                let on_core = on_core().zip(start.1).map(|(end, start)| end - start);
                times.push(on_core.unwrap_or_else(|| start.0.elapsed().as_secs_f64()));
            }
            Ok(format!("{:.0}", megabytes / median(times)))
        };
        rows.push(vec![
            format!(".{extension}"),
            format!("{megabytes:.1}"),
            speed(&|| formats::read_bytes(&path, bytes.clone()).map(drop).map_err(Failure::from))?,
            speed(&|| written(&file, &path, &moved).map(drop))?,
            speed(&|| written(&new, &path, &moved).map(drop))?,
        ]);
    }
    print_table(&rows);
    Ok(())
}

fn written(file: &MeshFile, path: &Path, vertices: &[DVec3]) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    file.write_to(&mut bytes, path, vertices, &Fields::default())?;
    Ok(bytes)
}

/// How long this thread has had a core, s; nothing where the system does not tell.
fn on_core() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<u64>().ok()? as f64 * 1e-9)
}
