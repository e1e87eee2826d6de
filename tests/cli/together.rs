//! Files of one result appear together or not at all, and every file is told.

use std::fs;

use crate::fixture::*;

/// The files that a run tells.
fn told(errors: &str) -> Vec<String> {
    let mut told: Vec<_> = errors.lines().filter_map(|line| line.strip_prefix("wrote ")).map(str::to_owned).collect();
    told.sort();
    told
}

/// The text names every file that a run wrote, good or bad.
#[test]
fn every_file_written_is_told() {
    let fixture = Fixture::new();
    let mesh = "mesh = [\"moved.msh\", \"moved.su2\"]\nhistogram = \"beta.svg\"";
    fixture.case("mesh = \"moved.msh\"", mesh);
    let before = fixture.files();
    let run = || fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "report.json"]);
    let new = || fixture.files().into_iter().filter(|name| !before.contains(name)).collect::<Vec<_>>();
    let output = run();
    assert_good(&output);
    assert_eq!(told(&stderr(&output)), ["beta.svg", "moved.msh", "moved.su2", "report.json"]);
    assert_eq!(told(&stderr(&output)), new());
    fixture.write("new.csv", &profiles(&[(0, 0.3, 3.0), (1, 1.2, 3.0)]));
    let output = run();
    assert_eq!(output.status.code(), Some(5));
    assert_eq!(told(&stderr(&output)), new());
    assert_eq!(new().len(), 5);
}

/// A mesh of which one file, the histogram, the report or the table cannot be written has no file
/// under a good name, and the message names the user's file.
///
/// Fails if the files that have their names are not taken back.
#[test]
#[cfg(target_os = "linux")]
fn a_result_that_cannot_be_written_whole_is_not_written() {
    let fixture = Fixture::new();
    std::os::unix::fs::symlink("/dev/full", fixture.path("full.vtu")).unwrap();
    std::os::unix::fs::symlink("/dev/full", fixture.path("full.svg")).unwrap();
    for (outputs, name) in [
        ("mesh = [\"moved.msh\", \"full.vtu\", \"moved.su2\"]", "full.vtu"),
        ("mesh = \"moved.msh\"\nhistogram = \"full.svg\"", "full.svg"),
    ] {
        fixture.case("mesh = \"moved.msh\"", outputs);
        fixture.write("moved.msh", "an older result");
        let before = fixture.files();
        let output = fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "report.json"]);
        let errors = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{errors}");
        assert!(errors.contains(&format!("error: cannot write {name}: No space left on device")), "{errors}");
        assert!(!errors.contains(".idmesh-") && !errors.contains("wrote "), "{errors}");
        let expected: Vec<_> = before.into_iter().filter(|name| name != "moved.msh").collect();
        assert_eq!(fixture.files(), expected);
    }
    // The report, and standard output.
    fixture.write("case.toml", CASE);
    for redirection in ["--json full.vtu", "--json - > /dev/full", "> /dev/full"] {
        let before = fixture.files();
        let line = format!("\"$IDMESH\" run case.toml --backend cpu {redirection}");
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", &line]).current_dir(&fixture.folder).env("IDMESH", env!("CARGO_BIN_EXE_idmesh"));
        let output = shell.output().unwrap();
        let errors = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{redirection}: {errors}");
        assert!(errors.contains("No space left on device") && !errors.contains("wrote "), "{errors}");
        assert_eq!(fixture.files(), before, "{redirection}");
    }
}

/// The line of a design that cannot be written takes the design's mesh with it.
#[test]
#[cfg(target_os = "linux")]
fn a_design_without_its_line_has_no_mesh() {
    let fixture = Fixture::new();
    fs::create_dir(fixture.path("designs")).unwrap();
    fs::copy(fixture.path("new.csv"), fixture.path("designs/a.csv")).unwrap();
    std::os::unix::fs::symlink("/dev/full", fixture.path("full.jsonl")).unwrap();
    let batch = ["batch", "case.toml", "--backend", "cpu", "--designs", "designs", "--out", "moved", "--json"];
    let output = fixture.idmesh(&[&batch, &["full.jsonl"][..]].concat());
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("cannot write full.jsonl: No space left on device"), "{}", stderr(&output));
    assert!(!fixture.path("moved").exists());
}

/// A folder that takes no files, and a mesh that is a folder.
#[test]
fn a_mesh_that_is_a_folder_appears_with_the_others() {
    let fixture = Fixture::new();
    fixture.case("mesh = \"moved.msh\"", "mesh = [\"polyMesh\", \"moved.msh\"]");
    assert_good(&fixture.run());
    let mut files: Vec<_> =
        fs::read_dir(fixture.path("polyMesh")).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    files.sort();
    assert_eq!(files, ["boundary", "faces", "neighbour", "owner", "points"]);
}
