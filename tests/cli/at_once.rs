//! Runs and batches that work at once with the same names: a job that is refused removes nothing,
//! and the files of a result are all of one design.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};

use idmesh::formats::{FileSet, sha256_of};
use idmesh::session::{Outputs, ReadFiles, SessionError};
use serde_json::Value;

use crate::fixture::*;

const BATCH: [&str; 10] =
    ["batch", "case.toml", "--backend", "cpu", "--designs", "designs", "--out", "moved", "--json", "all.jsonl"];

/// Runs commands at once, and returns their ends.
fn at_once(fixture: &Fixture, commands: &[&[&str]]) -> Vec<Output> {
    let start = |arguments: &&[&str]| {
        let mut command = command(fixture.folder.path(), arguments);
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let jobs: Vec<_> = commands.iter().map(start).collect();
    jobs.into_iter().map(|job| job.wait_with_output().unwrap()).collect()
}

/// The files of a folder with their contents.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.map(|path| (path.clone(), fs::read(path).unwrap())).collect()
}

const IN_USE: &str = "another job writes its reports into all.jsonl now";

/// The results of a running job stay, whether or not its file of reports is there yet, and also if
/// the case of the refused job cannot be read.
#[test]
fn a_refused_batch_removes_nothing() {
    let fixture = Fixture::with_designs(2);
    assert_good(&fixture.idmesh(&BATCH));
    let results = contents(&fixture.path("moved"));
    assert_eq!(results.len(), 2);
    let lines = fixture.read("all.jsonl");
    // The sign of a job on another computer.
    let sign = fixture.path(".idmesh-elsewhere-1-abc-writes-all.jsonl");
    fs::write(&sign, "").unwrap();
    for case in [CASE.to_owned(), CASE.replacen("new =", "nwe =", 1), CASE.replacen("box.msh", "gone.msh", 1)] {
        for reports in [Some(&*lines), Some(""), None] {
            fixture.write("case.toml", &case);
            match reports {
                Some(text) => fixture.write("all.jsonl", text),
                None => fs::remove_file(fixture.path("all.jsonl")).unwrap(),
            }
            let before = fixture.files();
            let refused = command(fixture.folder.path(), &BATCH).output().unwrap();
            assert_eq!(refused.status.code(), Some(3), "{}", stderr(&refused));
            assert!(stderr(&refused).contains(IN_USE), "{}", stderr(&refused));
            assert_eq!(contents(&fixture.path("moved")), results, "{case}{reports:?}");
            assert_eq!(fixture.files(), before);
            assert_eq!(fs::read_to_string(fixture.path("all.jsonl")).ok().as_deref(), reports);
            fixture.write("all.jsonl", &lines);
        }
    }
    // A command that cannot even begin removes nothing of a running job either.
    let mut run = command(fixture.folder.path(), &BATCH);
    let output = run.env("RAYON_NUM_THREADS", "many").output().unwrap();
    assert_eq!(output.status.code(), Some(3));
    assert_eq!(contents(&fixture.path("moved")), results);
    fs::remove_file(sign).unwrap();
    let output = run.output().unwrap();
    assert_eq!(output.status.code(), Some(3));
    assert!(contents(&fixture.path("moved")).is_empty());
}

/// Of batches that begin at once, and share nothing, one moves all designs, and the others are
/// refused or come after it.
#[test]
fn one_of_several_batches_at_once_runs() {
    let fixture = Fixture::with_designs(3);
    for round in 0..4 {
        let _ = fs::remove_file(fixture.path("all.jsonl"));
        let _ = fs::remove_dir_all(fixture.path("moved"));
        let ends = at_once(&fixture, &[&BATCH[..]; 3]);
        assert!(ends.iter().any(|end| end.status.success()), "round {round}");
        for end in ends.iter().filter(|end| !end.status.success()) {
            assert!(stderr(end).contains(IN_USE), "{}", stderr(end));
        }
        let text = fixture.read("all.jsonl");
        let outputs = text.lines().flat_map(|line| sums(&serde_json::from_str(line).unwrap()));
        let outputs: Vec<_> = outputs.collect();
        assert_eq!(outputs.len(), 3, "round {round}");
        outputs.iter().for_each(|(path, sum)| assert_eq!(sha256_of(&fixture.path(path)).unwrap(), *sum));
        assert_eq!(contents(&fixture.path("moved")).len(), 3);
    }
}

/// The outputs of a report with their checksums.
fn sums(report: &Value) -> Vec<(String, String)> {
    let outputs = report["checksums"]["outputs"].as_object().unwrap().iter();
    outputs.map(|(path, sum)| (path.clone(), sum.as_str().unwrap().to_owned())).collect()
}

/// Two runs of different designs at once leave the whole result of one.
#[test]
fn runs_at_once_leave_one_result() {
    let fixture = Fixture::new();
    let outputs = "mesh = [\"moved.msh\", \"moved.vtu\", \"moved.su2\"]\nhistogram = \"beta.svg\"";
    let case = CASE.replacen("mesh = \"moved.msh\"", outputs, 1);
    fixture.write("case.toml", &case);
    fixture.write("other.toml", &case.replacen("new.csv", "other.csv", 1));
    fixture.write("other.csv", &profiles(&[(0, 0.3, 0.01), (1, 1.2, 0.03)]));
    let run = |case| ["run", case, "--backend", "cpu", "--out", "moved", "--json", "moved/report.json"];
    for round in 0..12 {
        let ends = at_once(&fixture, &[&run("case.toml"), &run("other.toml")]);
        ends.iter().for_each(assert_good);
        let report = serde_json::from_str(&fixture.read("moved/report.json")).unwrap();
        let outputs = sums(&report);
        assert_eq!(outputs.len(), 4);
        for (path, sum) in outputs {
            assert_eq!(sha256_of(&fixture.path(&path)).ok(), Some(sum), "round {round}: {path}");
        }
        assert_eq!(contents(&fixture.path("moved")).len(), 5);
    }
}

/// Many that put, and remove, results with the same names: whenever one of them looks, all files
/// are of one result, or none is there.
///
/// Fails if a result is removed or gets its names without the lock.
#[test]
fn results_with_the_same_names_do_not_mix() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let outputs = Outputs {
        meshes: vec![path("moved.msh"), path("moved.su2")],
        histogram: Some(path("moved.svg")),
        ..Outputs::default()
    };
    let report = path("report.json");
    let look = || {
        let text = |path: &Path| fs::read_to_string(path).ok();
        let texts: Vec<_> = outputs.paths().chain([&*report]).map(text).collect();
        assert!(texts.iter().all(|text| *text == texts[0]), "{texts:?}");
        Ok::<(), SessionError>(())
    };
    std::thread::scope(|scope| {
        for writer in 0..4 {
            let (outputs, report, look) = (&outputs, &*report, &look);
            scope.spawn(move || {
                for round in 0..40 {
                    let mut files = FileSet::default();
                    for path in outputs.paths().chain([report]) {
                        files.add(path, |out| write!(out, "{writer}.{round}")).unwrap();
                    }
                    outputs.place(files, &[], Some(report), look).unwrap();
                    match round % 4 {
                        1 => outputs.remove_earlier(&[], Some(report)).unwrap(),
                        3 => outputs.remove_all_but(&ReadFiles::new(&[]), Some(report)),
                        _ => {}
                    }
                }
            });
        }
    });
    look().unwrap();
    // What is checked before anything is removed leaves everything as it is.
    fs::write(path("moved.msh"), "earlier").unwrap();
    let mut files = FileSet::default();
    files.add(&path("moved.su2"), |out| out.write_all(b"new")).unwrap();
    let refuses = || Err(SessionError::InUse { path: report.clone() });
    assert!(outputs.place(files, &[], Some(&report), refuses).is_err());
    assert_eq!(fs::read_to_string(path("moved.msh")).unwrap(), "earlier");
}
