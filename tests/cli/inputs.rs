//! Inputs that are no regular files: links to devices and pipes are refused before they are opened,
//! and open files of the process are read.

use std::fs;
use std::io::Write;
use std::os::unix::fs::symlink;
use std::process::{Command, Stdio};

use crate::fixture::*;

const RUN: [&str; 4] = ["run", "case.toml", "--backend", "cpu"];
const WHY: &str = "a pipe or a device, expected a file";

/// Puts a link to a device, and then a pipe that nobody writes to, in the place of a file. Each is
/// refused. A device that was read would fill the memory, and a pipe would never open.
#[track_caller]
fn refuses_in_place_of(fixture: &Fixture, name: &str, arguments: &[&str]) {
    let path = fixture.path(name);
    let kept = fs::read(&path).ok();
    for device in ["/dev/zero", "pipe"] {
        let _ = fs::remove_file(&path);
        match device {
            "pipe" => assert!(Command::new("mkfifo").arg(&path).status().unwrap().success()),
            device => symlink(device, &path).unwrap(),
        }
        fixture.refuses_command(&[arguments, &["--max-memory", "300M"]].concat(), 3, &[name, WHY]);
    }
    fs::remove_file(&path).unwrap();
    kept.into_iter().for_each(|bytes| fs::write(&path, bytes).unwrap());
}

#[test]
fn a_link_to_a_device_is_no_input() {
    let fixture = Fixture::new();
    for name in ["case.toml", "box.msh", "new.csv"] {
        refuses_in_place_of(&fixture, name, &RUN);
    }
    let cgns = cfg!(feature = "cgns").then_some("packed.cgns");
    for name in ["packed.su2.gz", "plain.vtu", "plain.mesh"].into_iter().chain(cgns) {
        refuses_in_place_of(&fixture, name, &["quality", name]);
    }
    refuses_in_place_of(&fixture, "list.txt", &["batch", "case.toml", "--backend", "cpu", "--designs", "list.txt"]);
    assert_good(&fixture.idmesh(&["convert", "box.msh", "box.b8.ugrid"]));
    refuses_in_place_of(&fixture, "box.mapbc", &["quality", "box.b8.ugrid"]);
    assert_good(&fixture.idmesh(&["convert", "box.msh", "polyMesh"]));
    for name in ["points", "faces", "owner", "neighbour", "boundary"] {
        refuses_in_place_of(&fixture, &format!("polyMesh/{name}"), &["quality", "polyMesh"]);
    }
    assert_good(&fixture.idmesh(&["quality", "polyMesh"]));
}

/// The displacements of a prescribed family.
#[test]
fn a_table_of_displacements_is_a_file() {
    let fixture = Fixture::new();
    let case = CASE.replace("[profiles.wing]\nnew = \"new.csv\"\n", "");
    fixture
        .write("case.toml", &case.replace("role = \"wing\"\n", "role = \"prescribed\"\ndisplacement = \"wing.csv\"\n"));
    refuses_in_place_of(&fixture, "wing.csv", &RUN);
}

/// A user may give the case and the profiles through pipes, which a shell names `/dev/fd/63`.
#[test]
fn an_open_file_is_read_to_its_end() {
    let fixture = Fixture::new();
    assert_good(&fixture.run());
    let expected = fixture.read("moved.msh");
    let with_input = |arguments: &[&str], text: &str| {
        let mut command = command(fixture.folder.path(), arguments);
        let mut job = command.stdin(Stdio::piped()).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
        job.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
        job.wait_with_output().unwrap()
    };
    // Paths in the case are relative to its folder, which is that of the open file.
    let here = |text: &str| {
        let at = |name: &str| format!("\"{}\"", fixture.path(name).display());
        text.replace("\"box.msh\"", &at("box.msh"))
            .replace("\"new.csv\"", &at("new.csv"))
            .replace("\"moved.msh\"", &at("moved.msh"))
    };
    assert_good(&with_input(&["run", "/dev/stdin", "--backend", "cpu"], &here(CASE)));
    assert_eq!(fixture.read("moved.msh"), expected);
    fixture.case("\"new.csv\"", "\"/dev/stdin\"");
    let output = with_input(&RUN, &fixture.read("new.csv"));
    assert_good(&output);
    assert_eq!(fixture.read("moved.msh"), expected);
}

/// A stream without an end is read until the memory that the user allows is taken.
#[test]
fn a_stream_ends_where_the_memory_does() {
    let fixture = Fixture::new();
    let mut command = command(fixture.folder.path(), &["run", "/dev/stdin", "--max-memory", "300M"]);
    let output = command.stdin(fs::File::open("/dev/zero").unwrap()).output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("GB of memory, but"), "{}", stderr(&output));
}

/// What a user may take for a case, for a list of designs or for a number of threads.
#[test]
fn what_is_no_case_and_no_list_is_told_once() {
    let fixture = Fixture::new();
    let words = ["box.msh is a mesh, expected a case file"];
    fixture.refuses_command(&["run", "box.msh"], 3, &words);
    fixture.refuses_command(&["batch", "box.msh", "--designs", "new.csv"], 3, &words);
    let batch = ["batch", "case.toml", "--backend", "cpu", "--designs"];
    fixture.refuses_command(&[&batch[..], &["new.csv"]].concat(), 3, &["new.csv: no line is the path of a file"]);
    // A list may have any extension.
    fixture.write("list.csv", "new.csv\n");
    assert_good(&fixture.idmesh(&[&batch[..], &["list.csv"]].concat()));
    for (threads, exit) in [("two", 3), ("", 0), ("0", 0), ("1", 0), ("-1", 3)] {
        let mut command = command(fixture.folder.path(), &["quality", "box.msh"]);
        let output = command.env("RAYON_NUM_THREADS", threads).output().unwrap();
        assert_eq!(output.status.code(), Some(exit), "{threads}");
        assert_eq!(stderr(&output).contains("error: RAYON_NUM_THREADS is"), exit == 3, "{}", stderr(&output));
    }
}

/// Help that is lost is not printed.
#[test]
#[cfg(target_os = "linux")]
fn help_on_a_full_disk_is_a_failure() {
    let fixture = Fixture::new();
    for arguments in [&["--help"][..], &["--version"], &["run", "--help"]] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = command(fixture.folder.path(), arguments).stdout(full).output().unwrap();
        assert_eq!(output.status.code(), Some(3), "{arguments:?}");
        assert!(stderr(&output).contains("error: cannot write to standard output"), "{}", stderr(&output));
    }
}

/// The folder in which the command runs may be the mesh.
#[test]
fn the_folder_itself_may_be_the_mesh() {
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&["convert", "box.msh", "polyMesh"]));
    let outside = fixture.idmesh(&["quality", "polyMesh"]);
    let inside = command(&fixture.path("polyMesh"), &["quality", "."]).output().unwrap();
    assert_good(&inside);
    assert_eq!(stdout(&inside), stdout(&outside));
    fixture.refuses_command(&["quality", "case.toml"], 3, &["polyMesh, points (OpenFOAM)"]);
}
