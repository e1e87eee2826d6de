//! Jobs that work beside each other or were killed: none fails for another, no line is lost, and no
//! file is left over.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::fixture::*;

fn start(fixture: &Fixture, arguments: &[&str]) -> Child {
    let mut command = command(fixture.folder.path(), arguments);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits for all jobs, and returns the errors of those that failed.
fn failures(jobs: Vec<Child>) -> Vec<String> {
    let ends = jobs.into_iter().map(|job| job.wait_with_output().unwrap());
    ends.filter(|end| !end.status.success()).map(|end| stderr(&end)).collect()
}

fn names(fixture: &Fixture, file: &str) -> Vec<String> {
    let text = fixture.read(file);
    let mut names: Vec<_> = text
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap()["design"].as_str().unwrap().to_owned())
        .collect();
    names.sort();
    names
}

fn temporary_files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.filter(|name| name.starts_with(".idmesh-")).collect()
}

const BATCH: [&str; 9] = ["batch", "case.toml", "--backend", "cpu", "--designs", "designs", "--out", "new/moved", "-q"];

/// Starts a batch with each of these further arguments, all at once, and waits for their success.
#[track_caller]
fn batches_at_once(fixture: &Fixture, further: &[&[&str]]) {
    let jobs = further.iter().map(|further| start(fixture, &[&BATCH[..], &["--json", "all.jsonl"], further].concat()));
    assert_eq!(failures(jobs.collect()), [] as [&str; 0]);
}

/// The names of the designs of [`designs`].
fn numbered(number: usize) -> Vec<String> {
    (0..number).map(|index| index.to_string()).collect()
}

/// Jobs of an array that start together make one new folder, and append to one file.
#[test]
fn jobs_of_an_array_share_a_folder_and_a_file_of_reports() {
    let fixture = Fixture::with_designs(8);
    let all = numbered(8);
    for round in 0..8 {
        fs::remove_dir_all(fixture.path("new")).ok();
        let shards = [&["--shard", "1/4"][..], &["--shard", "2/4"], &["--shard", "3/4"], &["--shard", "4/4"]];
        batches_at_once(&fixture, &shards);
        assert_eq!(names(&fixture, "all.jsonl"), all, "round {round}");
        assert_eq!(temporary_files(&fixture.path("new/moved")), [] as [&str; 0]);
        assert_eq!(temporary_files(fixture.folder.path()), [] as [&str; 0]);
    }
    // One after another, too.
    for shard in ["1/2", "2/2"] {
        assert_good(&fixture.idmesh(&[&BATCH[..], &["--json", "all.jsonl", "--shard", shard]].concat()));
    }
    assert_eq!(names(&fixture, "all.jsonl"), all);
    // Lines of another design's contents do not stay.
    fixture.write("designs/0.csv", &profiles(&[(0, 0.3, 0.02), (1, 1.2, 0.04)]));
    assert_good(&fixture.idmesh(&[&BATCH[..], &["--json", "all.jsonl", "--shard", "2/2"]].concat()));
    assert_eq!(names(&fixture, "all.jsonl"), all[1..]);
}

/// A job that would replace the lines of a running job is refused; one that resumes is not.
#[test]
fn lines_of_a_running_job_are_not_replaced() {
    let fixture = Fixture::with_designs(2);
    fs::create_dir(fixture.path("more")).unwrap();
    fs::copy(fixture.path("new.csv"), fixture.path("more/c.csv")).unwrap();
    // A job that waits for its designs holds the file as long as the test needs.
    let sign = fixture.path(".idmesh-elsewhere-1-abc-writes-all.jsonl");
    fs::write(&sign, "").unwrap();
    fixture.write("all.jsonl", "{\"design\": \"of another job\"}\n");
    let batch = ["batch", "case.toml", "--backend", "cpu", "--designs", "more", "--json", "all.jsonl"];
    let refused = fixture.idmesh(&batch);
    assert_eq!(refused.status.code(), Some(3));
    let words = "error: another job writes its reports into all.jsonl now, and this one would replace them";
    assert!(stderr(&refused).contains(words), "{}", stderr(&refused));
    assert!(stderr(&refused).contains("hint: "));
    assert_eq!(names(&fixture, "all.jsonl"), ["of another job"]);
    let resumed = command(fixture.folder.path(), &[&batch[..], &["--resume"]].concat()).output().unwrap();
    assert_good(&resumed);
    assert_eq!(names(&fixture, "all.jsonl"), ["c", "of another job"]);
    // The other job has ended.
    fs::remove_file(sign).unwrap();
    assert_good(&fixture.idmesh(&batch));
    assert_eq!(names(&fixture, "all.jsonl"), ["c"]);
}

/// Jobs that do the same designs at once leave one line for each design.
#[test]
fn a_design_that_two_jobs_do_has_one_line() {
    let fixture = Fixture::with_designs(8);
    for _ in 0..4 {
        fs::remove_file(fixture.path("all.jsonl")).ok();
        batches_at_once(&fixture, &[&["--resume"][..]; 3]);
        assert_eq!(names(&fixture, "all.jsonl"), numbered(8));
    }
}

/// A link to a file of reports is that file.
#[test]
fn a_link_to_a_file_of_reports_is_that_file() {
    let fixture = Fixture::with_designs(1);
    std::os::unix::fs::symlink("all.jsonl", fixture.path("link.jsonl")).unwrap();
    fs::write(fixture.path(".idmesh-elsewhere-1-abc-writes-all.jsonl"), "").unwrap();
    let refused = fixture.idmesh(&[&BATCH[..], &["--json", "link.jsonl"]].concat());
    assert_eq!(refused.status.code(), Some(3));
    assert!(stderr(&refused).contains("another job writes its reports into link.jsonl now"), "{}", stderr(&refused));
}

/// A batch that cannot begin leaves no results of its designs, and the lines of others.
#[test]
fn a_batch_that_cannot_begin_leaves_no_earlier_result() {
    let fixture = Fixture::with_designs(2);
    let batch = |more: &[&str]| fixture.idmesh(&[&BATCH[..], &["--json", "all.jsonl"], more].concat());
    for more in [&[][..], &["--shard", "1/2"], &["--resume"]] {
        fixture.write("case.toml", CASE);
        assert_good(&batch(&[]));
        fixture.case("mesh = \"box.msh\"", "mesh = \"gone.msh\"");
        assert_eq!(batch(more).status.code(), Some(3));
        let left = |name: &str| fixture.path(&format!("new/moved/{name}.msh")).exists();
        let (expected, lines) = match more {
            [] => ((false, false), vec![]),
            ["--resume"] => ((true, true), vec!["0", "1"]),
            _ => ((false, true), vec!["1"]),
        };
        assert_eq!((left("0"), left("1")), expected, "{more:?}");
        assert_eq!(names(&fixture, "all.jsonl"), lines, "{more:?}");
    }
}

/// Designs whose results would have one name are refused, valid or not.
#[test]
fn designs_whose_results_share_a_name_are_refused() {
    let fixture = Fixture::with_designs(1);
    let copy = |name: &str| fs::copy(fixture.path("new.csv"), fixture.path(&format!("designs/{name}.csv"))).unwrap();
    copy("0.invalid");
    let refuses = |words: &[&str]| {
        fixture.refuses_command(&[&BATCH[..], &["--json", "all.jsonl"]].concat(), 3, words);
    };
    refuses(&["designs/0.csv", "designs/0.invalid.csv", "would both be named", "0.invalid.msh"]);
    fs::remove_file(fixture.path("designs/0.invalid.csv")).unwrap();
    copy("0.b8");
    fixture.case("mesh = \"moved.msh\"", "mesh = [\"moved.b8.ugrid\", \"moved.ugrid\"]");
    refuses(&["designs/0.csv", "designs/0.b8.csv", "0.b8.ugrid"]);
}

/// A pipe that nobody writes to, a device, a folder and a link to nothing are designs that fail.
#[test]
fn a_design_that_blocks_or_is_no_file_stops_no_other() {
    let fixture = Fixture::with_designs(2);
    assert!(Command::new("mkfifo").arg(fixture.path("designs/pipe.csv")).status().unwrap().success());
    fs::create_dir(fixture.path("designs/folder.csv")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", fixture.path("designs/zero.csv")).unwrap();
    std::os::unix::fs::symlink("gone", fixture.path("designs/link.csv")).unwrap();
    let output = fixture.idmesh(&[&BATCH[..], &["--json", "all.jsonl"]].concat());
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("error: 4 of 6 designs failed"), "{}", stderr(&output));
    let text = fixture.read("all.jsonl");
    let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let message = |name: &str| {
        let line = lines.iter().find(|line| line["design"] == name).unwrap();
        (line["exit"].as_u64().unwrap(), line["error"]["message"].as_str().unwrap_or_default())
    };
    assert_eq!((message("0"), message("1")), ((0, ""), (0, "")));
    for (name, words) in [
        ("pipe", "pipe.csv is a pipe or a device, expected a file"),
        ("zero", "zero.csv is a pipe or a device, expected a file"),
        ("folder.csv", "folder.csv is a folder"),
        ("link", "link.csv"),
    ] {
        let (exit, message) = message(name);
        assert_eq!(exit, 3, "{name}");
        assert!(message.contains(words), "\"{words}\" is not in: {message}");
    }
}

/// Killed at a hundred moments by each of three signals, runs and batches leave no temporary file
/// after the next one, and no file that is not whole.
#[test]
fn killed_jobs_leave_nothing_behind() {
    let fixture = Fixture::with_designs(6);
    let outputs = "mesh = [\"moved.msh\", \"moved.vtu\", \"moved.su2.gz\"]\nhistogram = \"beta.svg\"";
    fixture.case("mesh = \"moved.msh\"", outputs);
    let batch = [&BATCH[..], &["--json", "all.jsonl", "--resume"]].concat();
    let run = ["run", "case.toml", "--backend", "cpu", "--out", "alone", "--json", "report.json", "-q"];
    // The outputs of an undisturbed job.
    let listed = |folder: &str| {
        let entries = fs::read_dir(fixture.path(folder)).unwrap().map(|entry| entry.unwrap());
        let mut files: Vec<_> =
            entries.map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap())).collect();
        files.sort();
        files
    };
    assert_good(&fixture.idmesh(&run));
    assert_good(&fixture.idmesh(&batch));
    let whole = [listed("alone"), listed("new/moved")];
    let mut n_left_over = 0;
    for moment in 0..100 {
        let signal = ["-TERM", "-INT", "-KILL"][moment % 3];
        for (arguments, folder) in [(&run[..], "alone"), (&batch, "new/moved")] {
            fs::remove_file(fixture.path("new/moved/3.msh")).ok();
            let mut job = start(&fixture, arguments);
            std::thread::sleep(Duration::from_micros(1000 * (moment as u64 * 37 % 100)));
            Command::new("kill").args([signal, &job.id().to_string()]).status().unwrap();
            job.wait().unwrap();
            n_left_over += temporary_files(&fixture.path(folder)).len();
            // Every file that has its name is whole.
            let whole = if folder == "alone" { &whole[0] } else { &whole[1] };
            for file in listed(folder).iter().filter(|file| !file.0.starts_with(".idmesh-")) {
                assert!(whole.contains(file), "{} is not whole after {signal}", file.0);
            }
        }
    }
    assert_good(&fixture.idmesh(&run));
    assert_good(&fixture.idmesh(&batch));
    assert!(listed("alone") == whole[0] && listed("new/moved") == whole[1]);
    assert_eq!(temporary_files(fixture.folder.path()), [] as [&str; 0]);
    assert_eq!(names(&fixture, "all.jsonl"), ["0", "1", "2", "3", "4", "5"]);
    println!("{n_left_over} temporary files were left over by 200 killed jobs, and removed");
}
