//! Megabytes a second of each mesh format: reading, writing back moved, writing new.
//!
//! `cargo bench --bench formats -- [MESH [FILE...]]`: the example's mesh, or another, converted to
//! every format; then files that are only read and written back, as variants that idmesh does not
//! write new. One thread; in memory, but for OpenFOAM's folders. Where the system tells, times are
//! those the thread had a core, so that other work on the machine counts less.

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use common::{Failure, example, median, on_core, print_machine, print_table, row};
use glam::DVec3;
use idmesh::formats::{self, FORMATS, Fields, MeshFile};

/// Repetitions a figure is the median of.
const REPEATS: usize = 5;

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    // One thread: this one.
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global()?;
    print_machine(&[]);
    let mut paths = std::env::args().skip(1).filter(|argument| argument != "--bench").map(PathBuf::from);
    let source = match &paths.next() {
        Some(path) => formats::read_mixed(path)?,
        None => example()?.file,
    };
    println!("{} vertices, {} tets\n", source.mesh.vertices.len(), source.mesh.tets.len());
    // A mesh without a file of its own, so that all are written new.
    let new = MeshFile::from_mesh(source.mesh);
    let folder = tempfile::tempdir()?;
    let mut rows = vec![row(&["format", "MB", "read MB/s", "write back MB/s", "write new MB/s"])];
    for format in FORMATS {
        if format.is_folder() {
            let path = folder.path().join("polyMesh");
            new.write(&path, &new.mesh.vertices, &Fields::default())?;
            rows.push(measured("polyMesh", &path, Some(&new))?);
            continue;
        }
        for extension in format.extensions {
            let path = folder.path().join(format!("mesh.{extension}"));
            new.write(&path, &new.mesh.vertices, &Fields::default())?;
            rows.push(measured(&format!(".{extension}"), &path, Some(&new))?);
            fs::remove_file(path)?;
        }
    }
    for path in paths {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        rows.push(measured(&name, &path, None)?);
    }
    print_table(&rows);
    Ok(())
}

/// Speeds for the mesh at `path`; also of writing a new one where there is one to write.
fn measured(name: &str, path: &Path, new: Option<&MeshFile>) -> Result<Vec<String>, Failure> {
    let is_folder = path.is_dir();
    let (place, megabytes) = if is_folder {
        let sizes = fs::read_dir(path)?.map(|entry| Ok(entry?.metadata()?.len()));
        (path.join("points"), sizes.sum::<std::io::Result<u64>>()? as f64 / 1e6)
    } else {
        (path.to_path_buf(), fs::metadata(path)?.len() as f64 / 1e6)
    };
    let bytes = fs::read(&place)?;
    let file = formats::read_bytes(&place, bytes.clone())?;
    let moved: Vec<DVec3> = file.mesh.vertices.iter().map(|&vertex| vertex * 1.01 + DVec3::splat(1e-3)).collect();
    let written = |mesh: &MeshFile| -> Result<Vec<u8>, Failure> {
        let mut bytes = Vec::new();
        match is_folder {
            true => mesh.write(&path.with_file_name("polyMesh.invalid"), &moved, &Fields::default())?,
            false => mesh.write_to(&mut bytes, path, &moved, &Fields::default())?,
        }
        Ok(bytes)
    };
    Ok(vec![
        name.to_owned(),
        format!("{megabytes:.1}"),
        speed(megabytes, || bytes.clone(), |bytes| Ok(formats::read_bytes(&place, bytes)?))?,
        speed(megabytes, || (), |()| written(&file))?,
        new.map_or_else(|| Ok(String::new()), |new| speed(megabytes, || (), |()| written(new)))?,
    ])
}

/// Megabytes a second of an action on what was prepared for it.
fn speed<T, U>(
    megabytes: f64,
    prepare: impl Fn() -> T,
    action: impl Fn(T) -> Result<U, Failure>,
) -> Result<String, Failure> {
    let mut times = Vec::new();
    for _ in 0..REPEATS {
        let prepared = prepare();
        let start = (Instant::now(), on_core());
        let result = action(prepared)?;
        let on_core = on_core().zip(start.1).map(|(end, start)| end - start);
        times.push(on_core.unwrap_or_else(|| start.0.elapsed().as_secs_f64()));
        drop(result);
    }
    Ok(format!("{:.0}", megabytes / median(times)))
}
