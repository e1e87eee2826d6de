//! Whole runs of the command on damaged files: the mesh in several formats, the case, the profiles.
//!
//! Whatever the damage, a run ends with an exit code of the documented table, leaves its inputs as
//! they are, and leaves no files but those that its exit code promises.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use idmesh::formats::{self, Fields};

use crate::fixture::{CASE, Fixture, command, profiles};

#[path = "../formats/mutations.rs"]
mod mutations;

pub use mutations::Random;

/// The formats of the mesh and of the result.
const EXTENSIONS: [&str; 7] = ["msh", "vtu", "su2", "mesh", "b8.ugrid", "vtk", "meshb"];

/// A run that takes longer hangs, or might as well.
const PATIENCE: Duration = Duration::from_secs(120);

/// Names and contents of the files of a folder.
type Files = BTreeMap<String, Vec<u8>>;

fn files(folder: &Path) -> Files {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    entries
        .map(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            (name, fs::read(entry.path()).unwrap_or_default())
        })
        .collect()
}

/// The unharmed files in each format.
pub fn inputs() -> Vec<Files> {
    let fixture = Fixture::new();
    let mesh = formats::read(&fixture.path("box.msh")).unwrap();
    let of_format = |extension: &&str| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!("box.{extension}"));
        mesh.write(&path, &mesh.mesh.vertices, &Fields::default()).unwrap();
        let case = CASE.replace("box.msh", &format!("box.{extension}"));
        let case = case.replace("moved.msh", &format!("moved.{extension}"));
        // Without names in the file, the families have those of a file beside.
        let beside = "5\n1 0 wing\n2 0 trailing_edge\n3 0 wingtip\n4 0 symmetry\n5 0 farfield\n";
        if *extension == "meshb" {
            fs::write(folder.path().join("box.mapbc"), beside).unwrap();
        }
        fs::write(folder.path().join("case.toml"), case).unwrap();
        fs::write(folder.path().join("new.csv"), profiles(&[(0, 0.3, 0.02), (1, 1.2, 0.05)])).unwrap();
        files(folder.path())
    };
    EXTENSIONS.iter().map(of_format).collect()
}

/// Runs the command on files of which one is damaged. Returns the exit code.
///
/// # Errors
/// What is wrong with the run, and the message of the run.
pub fn run_damaged(inputs: &[Files], round: usize, random: &mut Random) -> Result<i32, String> {
    let folder = tempfile::tempdir().unwrap();
    let mut before = inputs[round % inputs.len()].clone();
    let names: Vec<_> = before.keys().cloned().collect();
    let name = &names[round / inputs.len() % names.len()];
    // Much damage is refused; a wrong digit may be a run of another mesh, profile or setting.
    let bytes = before.get_mut(name).unwrap();
    if random.below(2) == 0 {
        *bytes = mutations::damage(bytes, random);
    } else {
        mutations::change_digit(bytes, random);
    }
    for (name, bytes) in &before {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    let (code, errors) = run(folder.path());
    let wrong = |what: &str| Err(format!("{name} damaged: {what}, exit code {code:?}: {errors}"));
    let Some(code) = code else { return wrong("killed, or too slow") };
    if errors.contains("panicked") {
        return wrong("a panic");
    }
    let mut after = files(folder.path());
    for (name, bytes) in &before {
        if after.remove(name).as_ref() != Some(bytes) {
            return wrong(&format!("the input {name} was changed"));
        }
    }
    let new: Vec<&String> = after.keys().collect();
    let is_marked = |name: &&String| name.contains(".invalid") || name.contains(".inverted.");
    let files_fit = match code {
        0 => !new.is_empty() && !new.iter().any(is_marked),
        3 => new.is_empty(),
        4 => !new.iter().any(is_marked),
        5 => new.iter().all(is_marked),
        _ => return wrong("an exit code that is not for a run on the CPU"),
    };
    if !files_fit || new.iter().any(|name| name.starts_with('.')) {
        return wrong(&format!("the files {new:?}"));
    }
    if code == 3 && !errors.lines().any(|line| line.starts_with("error: ")) {
        return wrong("no line with an error");
    }
    // The inverted tets alone are no whole mesh.
    let is_mesh =
        |name: &&&String| name.starts_with("moved.") && !name.contains(".inverted.") && !name.ends_with(".mapbc");
    for name in new.iter().filter(is_mesh) {
        if let Err(error) = formats::read(&folder.path().join(name)) {
            return wrong(&format!("{name} cannot be read: {error}"));
        }
    }
    Ok(code)
}

/// The exit code of a run of the case in a folder, and its messages.
fn run(folder: &Path) -> (Option<i32>, String) {
    let messages = tempfile::NamedTempFile::new().unwrap();
    let mut command = command(folder, &["run", "case.toml", "--backend", "cpu"]);
    command.stdout(Stdio::null()).stderr(messages.reopen().unwrap());
    let mut child = command.spawn().unwrap();
    let start = Instant::now();
    let code = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status.code();
        }
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            child.wait().unwrap();
            break None;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    (code, String::from_utf8_lossy(&fs::read(messages.path()).unwrap()).into_owned())
}
