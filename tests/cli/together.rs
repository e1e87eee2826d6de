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
    // The text of commands that write other files.
    let mesh = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/small.su2.gz");
    fs::copy(mesh, fixture.path("small.su2.gz")).unwrap();
    for line in [
        "init small.su2.gz -o new",
        "demo new",
        "cut small.su2.gz --family wing --planes 2 --out new.csv",
        "quality box.msh --histogram new.svg",
        "compare box.msh box.msh --report new.html",
    ] {
        let before = fixture.files();
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let arguments: Vec<&str> = line.split(' ').collect();
        let output = command(fixture.folder.path(), &arguments).stdout(full).output().unwrap();
        let errors = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{line}: {errors}");
        assert!(errors.contains("cannot write to standard output") && !errors.contains("wrote "), "{line}: {errors}");
        assert_eq!(fixture.files(), before, "{line}");
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

/// Names that are spelled otherwise are the same names: the report never replaces a mesh.
#[test]
#[cfg(unix)]
fn a_report_with_the_name_of_a_mesh_is_refused() {
    let fixture = Fixture::new();
    std::os::unix::fs::symlink(".", fixture.path("link")).unwrap();
    let absolute = fixture.path("moved.msh");
    for name in ["moved.msh", "./moved.msh", "link/moved.msh", absolute.to_str().unwrap()] {
        fixture.refuses_command(
            &["run", "case.toml", "--backend", "cpu", "--json", name],
            3,
            &["is the name of two outputs"],
        );
    }
    // An invalid result would have these names.
    for name in ["moved.invalid.msh", "./moved.inverted.vtu"] {
        fixture.refuses_command(
            &["run", "case.toml", "--backend", "cpu", "--json", name],
            3,
            &["is the name of two outputs"],
        );
    }
    let out = ["run", "case.toml", "--backend", "cpu", "--out", "new", "--json", "new/../new/moved.msh"];
    fixture.refuses_command(&out, 3, &["is the name of two outputs"]);
}

/// What is written to an open file of the process goes behind what stands there.
#[test]
#[cfg(target_os = "linux")]
fn an_open_file_is_appended_to() {
    let fixture = Fixture::new();
    fs::create_dir(fixture.path("designs")).unwrap();
    for name in ["a", "b"] {
        fs::copy(fixture.path("new.csv"), fixture.path(&format!("designs/{name}.csv"))).unwrap();
    }
    for target in ["/dev/stdout >> out.jsonl", "/dev/fd/3 3>> out.jsonl", "pipe"] {
        fixture.write("out.jsonl", "earlier\n");
        let batch = format!(
            "timeout 60 \"$IDMESH\" batch case.toml --backend cpu --designs designs --out moved -q --json {target}"
        );
        let line = match target {
            "pipe" => format!("mkfifo pipe; (timeout 60 cat pipe >> out.jsonl) & {batch}; code=$?; wait; exit $code"),
            _ => batch,
        };
        let mut shell = std::process::Command::new("bash");
        shell.args(["-c", &line]).current_dir(&fixture.folder).env("IDMESH", env!("CARGO_BIN_EXE_idmesh"));
        let output = shell.output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{target}: {}", stderr(&output));
        let text = fixture.read("out.jsonl");
        let designs: Vec<_> = text.lines().map(serde_json::from_str::<serde_json::Value>).collect();
        assert!(text.starts_with("earlier\n") && designs.len() == 3, "{target}: {} lines", designs.len());
        assert!(designs[1..].iter().all(|line| line.as_ref().unwrap()["valid"] == true), "{target}");
    }
}

/// A limit on the size of files is an error of writing, not the end of the process.
#[test]
#[cfg(target_os = "linux")]
fn a_file_beyond_the_limit_is_told() {
    let fixture = Fixture::new();
    let before = fixture.files();
    let mut shell = std::process::Command::new("bash");
    shell.args(["-c", "ulimit -f 4; exec \"$IDMESH\" run case.toml --backend cpu"]).current_dir(&fixture.folder);
    let output = shell.env("IDMESH", env!("CARGO_BIN_EXE_idmesh")).output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("error: cannot write moved.msh: File too large"), "{}", stderr(&output));
    assert_eq!(fixture.files(), before);
}

/// A link to a missing file stays a link, and a failed run leaves no empty file behind the link.
#[test]
#[cfg(unix)]
fn a_link_as_output_stays_a_link() {
    let fixture = Fixture::new();
    std::os::unix::fs::symlink("target.msh", fixture.path("moved.msh")).unwrap();
    let is_link = || fs::symlink_metadata(fixture.path("moved.msh")).unwrap().is_symlink();
    assert_good(&fixture.run());
    assert!(is_link() && fixture.path("target.msh").is_file());
    fixture.write("new.csv", &profiles(&[(0, 0.3, 3.0), (1, 1.2, 3.0)]));
    assert_eq!(fixture.run().status.code(), Some(5));
    assert!(is_link() && !fixture.path("target.msh").exists());
}

/// A case that cannot be run any more leaves neither mesh nor report of an earlier run, as far as
/// the files and the command name them.
#[test]
fn a_case_that_cannot_be_run_leaves_no_earlier_result() {
    let fixture = Fixture::new();
    let run = || fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "report.json"]);
    let breaks = [
        ("mesh = \"moved.msh\"", "mesh = [\"moved.msh\", \"moved.xyz\"]", true),
        ("mesh = \"moved.msh\"", "mesh = [\"moved.msh\", \"moved.msh\"]", true),
        ("mesh = \"moved.msh\"", "mesh = [\"moved.msh\", \"none/moved.vtu\"]", true),
        ("mesh = \"box.msh\"", "mesh = \"gone.msh\"", true),
        ("mesh = \"box.msh\"", "mash = \"box.msh\"", true),
        ("mesh = \"box.msh\"", "mesh = ", false),
    ];
    for (from, to, names_mesh) in breaks {
        fixture.write("case.toml", CASE);
        assert_good(&run());
        fixture.case(from, to);
        assert_eq!(run().status.code(), Some(3), "{to}");
        assert!(!fixture.path("report.json").exists(), "{to}");
        assert_eq!(fixture.path("moved.msh").exists(), !names_mesh, "{to}");
    }
    // No file of the user's own.
    fixture.write("notes.json", "{\"mine\": 1}");
    assert_eq!(fixture.idmesh(&["run", "case.toml", "--json", "notes.json"]).status.code(), Some(3));
    assert_eq!(fixture.read("notes.json"), "{\"mine\": 1}");
}

/// What is written to a standard output that is closed would be lost: as on a full disk there is no
/// result, and the end says so.
#[test]
#[cfg(target_os = "linux")]
fn a_closed_standard_output_is_a_failure() {
    let fixture = Fixture::with_designs(1);
    for (arguments, is_failure) in [
        ("run case.toml --backend cpu", true),
        ("run case.toml --backend cpu --json -", true),
        ("batch case.toml --backend cpu --designs designs --json -", true),
        ("quality box.msh", true),
        ("quality box.msh --json -", true),
        ("cut box.msh --family wing --at y=0.3 --out -", true),
        ("--version", true),
        ("batch case.toml --backend cpu --designs designs --out moved", false),
        ("convert box.msh box.su2", false),
    ] {
        let before = fixture.files();
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", &format!("\"$IDMESH\" {arguments} >&-")]).current_dir(&fixture.folder);
        let output = shell.env("IDMESH", env!("CARGO_BIN_EXE_idmesh")).output().unwrap();
        let errors = stderr(&output);
        assert_eq!(output.status.code(), Some(if is_failure { 3 } else { 0 }), "{arguments}: {errors}");
        if is_failure {
            assert!(errors.contains("error: cannot write to standard output: it is closed"), "{arguments}: {errors}");
            assert_eq!(fixture.files(), before, "{arguments}");
        }
    }
    // A standard output that goes nowhere on purpose is open.
    let mut command = command(fixture.folder.path(), &["run", "case.toml", "--backend", "cpu"]);
    assert!(command.stdout(std::process::Stdio::null()).status().unwrap().success());
}
