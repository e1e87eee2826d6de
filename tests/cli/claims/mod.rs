//! `idmesh batch --claim`: processes that share a folder of claims do each design once, whatever
//! ends them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use idmesh::backend::{Selection, select};
use idmesh::case::{Case, LoadedCase};
use idmesh::session::{
    Claiming, Claims, DesignFiles, Done, Held, Job, Next, Outputs, Session, list_designs, sums_of_case,
};
use serde_json::Value;

mod held;

use crate::fixture::*;

/// A case with this number of designs, all different.
fn designs(number: usize) -> Fixture {
    let fixture = Fixture::with_raised_designs(&[]);
    for (index, name) in all_names(number).iter().enumerate() {
        fixture.raised_design(name, 0.05 * index as f64 / number as f64);
    }
    fixture
}

const BATCH: [&str; 7] = ["batch", "case.toml", "--backend", "cpu", "--designs", "designs", "-q"];
const CLAIM: [&str; 6] = ["--out", "moved", "--json", "all.jsonl", "--claim", "claims"];

fn claiming(more: &[&str]) -> Vec<String> {
    [&BATCH[..], &CLAIM, more].concat().iter().map(|word| (*word).to_owned()).collect()
}

fn start(fixture: &Fixture, arguments: &[String]) -> Child {
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let mut command = command(fixture.folder.path(), &words);
    // Processes that share two cores need one thread each.
    command.env("RAYON_NUM_THREADS", "1").stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

fn claim(fixture: &Fixture, more: &[&str]) -> std::process::Output {
    start(fixture, &claiming(more)).wait_with_output().unwrap()
}

#[track_caller]
fn refused(output: &std::process::Output, exit: i32, words: &[&str]) {
    let errors = stderr(output);
    assert_eq!(output.status.code(), Some(exit), "{errors}");
    for word in words {
        assert!(errors.contains(word), "\"{word}\" is not in: {errors}");
    }
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    entries.map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap())).collect()
}

fn lines(fixture: &Fixture, file: &str) -> Vec<Value> {
    fixture.read(file).lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn names(lines: &[Value]) -> Vec<String> {
    let mut names: Vec<_> = lines.iter().map(|line| line["design"].as_str().unwrap().to_owned()).collect();
    names.sort();
    names
}

fn all_names(number: usize) -> Vec<String> {
    (0..number).map(|index| format!("{index:03}")).collect()
}

/// The contents of a design's claim.
fn record(fixture: &Fixture, design: &str, generation: u32) -> Value {
    serde_json::from_str(&fixture.read(&format!("claims/{design}.{generation}.claim"))).unwrap()
}

/// A design whose claim says that another process has it.
fn hand_to(fixture: &Fixture, design: &str, change: impl FnOnce(&mut Value)) {
    let mut record = record(fixture, design, 1);
    let object = record.as_object_mut().unwrap();
    object.retain(|key, _| !["exit", "valid", "outputs"].contains(&key.as_str()));
    object.insert("state".to_owned(), "held".into());
    change(&mut record);
    fixture.write(&format!("claims/{design}.1.claim"), &record.to_string());
}

/// The holder of a claim is a process that has ended.
fn of_ended_process(record: &mut Value) {
    let mut child = std::process::Command::new("true").spawn().unwrap();
    child.wait().unwrap();
    record["holder"]["process"] = child.id().into();
}

/// Two hundred designs, four processes, of which two are killed with SIGKILL in the midst of their
/// work and started again: each design is in the joined report exactly once, and every file is
/// what one process alone makes.
///
/// Fails if a claim of a process that has ended is not taken over, and if a design that is done is
/// not marked.
#[test]
fn two_hundred_designs_survive_two_kills() {
    const NUMBER: usize = 200;
    let fixture = designs(NUMBER);
    let alone = command(fixture.folder.path(), &[&BATCH[..], &["--out", "alone"]].concat()).output().unwrap();
    assert_good(&alone);
    // Two processes share a file of reports, the others have files of their own.
    let of = |process: usize, more: &[&str]| {
        let reports = ["all.jsonl", "all.jsonl", "2.jsonl", "3.jsonl"][process];
        let mut words = claiming(more);
        words.iter_mut().filter(|word| *word == "all.jsonl").for_each(|word| *word = reports.to_owned());
        words
    };
    let mut processes: Vec<Child> = (0..4).map(|process| start(&fixture, &of(process, &[]))).collect();
    for (process, after) in [(0, 20), (2, 60)] {
        // The process works until the folder has so many results.
        while fs::read_dir(fixture.path("moved")).map_or(0, Iterator::count) < after {
            std::thread::yield_now();
        }
        processes[process].kill().unwrap();
        processes[process].wait().unwrap();
        processes[process] = start(&fixture, &of(process, &["--resume"]));
    }
    for process in processes {
        assert_good(&process.wait_with_output().unwrap());
    }
    assert_good(&fixture.idmesh(&["report", "all.jsonl", "2.jsonl", "3.jsonl", "--join", "joined.jsonl"]));
    assert_eq!(names(&lines(&fixture, "joined.jsonl")), all_names(NUMBER));
    assert!(lines(&fixture, "joined.jsonl").iter().all(|line| line["exit"] == 0));
    let (shared, alone) = (files(&fixture.path("moved")), files(&fixture.path("alone")));
    assert_eq!(shared.keys().collect::<Vec<_>>(), alone.keys().collect::<Vec<_>>());
    assert!(shared == alone, "a file differs from the one that one process makes");
    let temporary = files(&fixture.path("claims")).into_keys().filter(|name| name.starts_with(".idmesh-"));
    assert_eq!(temporary.count(), 0);
    // Nothing is left to do.
    let before = files(&fixture.path("claims"));
    assert_good(&claim(&fixture, &["--resume"]));
    assert!(files(&fixture.path("claims")) == before);
}

/// Nobody does a design of a process that works, and exactly one process takes over what an ended
/// one has left, of many that try at once.
#[test]
fn one_of_many_takes_over_what_an_ended_process_left() {
    let fixture = designs(6);
    assert_good(&claim(&fixture, &[]));
    let whole = files(&fixture.path("moved"));
    for round in 0..3 {
        for name in all_names(6) {
            for generation in 2..9 {
                fs::remove_file(fixture.path(&format!("claims/{name}.{generation}.claim"))).ok();
            }
            hand_to(&fixture, &name, |record| {
                of_ended_process(record);
                record["expires"] = 1_000_000.into();
            });
        }
        fs::remove_file(fixture.path("all.jsonl")).ok();
        let processes: Vec<Child> = (0..4).map(|_| start(&fixture, &claiming(&["--no-wait"]))).collect();
        for process in processes {
            assert_good(&process.wait_with_output().unwrap());
        }
        for name in all_names(6) {
            assert_eq!(record(&fixture, &name, 2)["state"], "done", "round {round}");
            assert_eq!(record(&fixture, &name, 2)["ended"], 1);
            assert!(!fixture.path(&format!("claims/{name}.3.claim")).exists(), "{name} was done twice");
        }
        assert_eq!(names(&lines(&fixture, "all.jsonl")), all_names(6));
        assert!(files(&fixture.path("moved")) == whole);
    }
}

/// A claim of another computer is left to it as long as it is renewed, whatever its clock says. A
/// claim that is renewed no more is taken over, and so is a file that holds no claim.
#[test]
fn claims_of_other_computers_expire() {
    let fixture = designs(3);
    assert_good(&claim(&fixture, &[]));
    let elsewhere = |record: &mut Value| {
        record["holder"]["host"] = "elsewhere".into();
        record["holder"]["boot"] = "another".into();
        record["expires"] = 1.into();
    };
    hand_to(&fixture, "000", elsewhere);
    fixture.write("claims/001.1.claim", "{\"design\": \"00");
    fixture.write("claims/002.1.claim", "");
    for name in all_names(3) {
        fs::remove_file(fixture.path(&format!("moved/{name}.msh"))).unwrap();
        let file = fs::File::options().write(true).open(fixture.path(&format!("claims/{name}.1.claim"))).unwrap();
        // A clock that is a year ahead.
        file.set_modified(std::time::SystemTime::now() + Duration::from_secs(31_536_000)).unwrap();
    }
    let left = claim(&fixture, &["--no-wait"]);
    assert_good(&left);
    assert!(!fixture.path("moved/000.msh").exists());
    // Without -q the job names what it leaves.
    let words: Vec<String> = claiming(&["--no-wait"]).into_iter().filter(|word| word != "-q").collect();
    let told = stderr(&start(&fixture, &words).wait_with_output().unwrap());
    assert!(told.contains("left to other jobs: 000 (process") && told.contains("on elsewhere)"), "{told}");
    assert!(told.contains("001 (an unknown process)"), "{told}");
    assert_good(&claim(&fixture, &["--claim-expires", "1"]));
    for name in all_names(3) {
        assert!(fixture.path(&format!("moved/{name}.msh")).exists());
        assert_eq!(record(&fixture, &name, 2)["state"], "done");
    }
}

/// A job waits for the designs of another one, whose claims the other one renews, and tells of
/// their faults.
#[test]
fn a_job_waits_for_designs_in_other_hands() {
    let fixture = designs(2);
    fixture.write("designs/001.csv", "profile,x,y,z\n0,1,zwei,3\n");
    assert_eq!(claim(&fixture, &[]).status.code(), Some(1));
    let done = fixture.read("claims/001.1.claim");
    // This process is alive.
    hand_to(&fixture, "001", |record| {
        let stat = fs::read_to_string("/proc/self/stat").unwrap();
        record["holder"]["process"] = std::process::id().into();
        let started = stat.rsplit_once(')').unwrap().1.split_whitespace().nth(19).unwrap();
        record["holder"]["started"] = started.into();
    });
    let words: Vec<String> = claiming(&["--claim-expires", "1"]).into_iter().filter(|word| word != "-q").collect();
    let mut waiting = start(&fixture, &words);
    let mut reader = std::io::BufReader::new(waiting.stderr.take().unwrap());
    let mut told = String::new();
    while !told.contains("waiting for 001 (process") {
        assert!(std::io::BufRead::read_line(&mut reader, &mut told).unwrap() > 0, "{told}");
    }
    assert!(waiting.try_wait().unwrap().is_none());
    fixture.write("claims/001.1.claim", &done);
    std::io::Read::read_to_string(&mut reader, &mut told).unwrap();
    assert_eq!(waiting.wait().unwrap().code(), Some(1));
    assert!(told.contains("error: 1 of 2 designs failed"), "{told}");
    assert!(!fixture.path("claims/001.2.claim").exists());
}

/// A design that fails is told by every job, done once, and tried again with `--resume`.
#[test]
fn a_design_that_fails_is_done_once() {
    let fixture = designs(3);
    fixture.write("designs/001.csv", "profile,x,y,z\n0,1,zwei,3\n");
    for _ in 0..2 {
        refused(&claim(&fixture, &[]), 1, &["error: 1 of 3 designs failed"]);
        assert!(!fixture.path("claims/001.2.claim").exists());
    }
    fixture.raised_design("001", 0.03);
    refused(&claim(&fixture, &[]), 3, &["the design 001 was claimed with other contents", "hint: --resume"]);
    assert_good(&claim(&fixture, &["--resume"]));
    assert_eq!(record(&fixture, "001", 2)["state"], "done");
    assert_eq!(names(&lines(&fixture, "all.jsonl")), all_names(3));
    assert!(lines(&fixture, "all.jsonl").iter().all(|line| line["exit"] == 0));
}

/// What is done is done again if its results are gone, or, with `--resume`, if they have changed.
#[test]
fn results_that_are_gone_are_made_again() {
    let fixture = designs(3);
    assert_good(&claim(&fixture, &[]));
    let whole = files(&fixture.path("moved"));
    fs::remove_file(fixture.path("moved/000.msh")).unwrap();
    fixture.write("moved/001.msh", "half a mesh");
    assert_good(&claim(&fixture, &[]));
    assert!(fixture.path("claims/000.2.claim").exists() && !fixture.path("claims/001.2.claim").exists());
    assert_good(&claim(&fixture, &["--resume"]));
    assert!(files(&fixture.path("moved")) == whole);
    assert!(fixture.path("claims/001.2.claim").exists() && !fixture.path("claims/002.2.claim").exists());
    // A mesh without finite positions has no files that could be gone.
    let mut without = record(&fixture, "002", 1);
    without["exit"] = 4.into();
    without["valid"] = false.into();
    without["outputs"] = Value::Object(Default::default());
    fixture.write("claims/002.1.claim", &without.to_string());
    fs::remove_file(fixture.path("moved/002.msh")).unwrap();
    refused(&claim(&fixture, &[]), 1, &["error: 1 of 3 designs failed"]);
    assert!(!fixture.path("claims/002.2.claim").exists());
}

/// Designs that a batch without claims has done are marked, and not done again.
#[test]
fn a_batch_without_claims_goes_on_with_claims() {
    let fixture = designs(3);
    assert_good(&fixture.idmesh(&[&BATCH[..], &CLAIM[..4]].concat()));
    let before = fixture.read("all.jsonl");
    assert_good(&claim(&fixture, &["--resume"]));
    assert_eq!(fixture.read("all.jsonl"), before);
    for name in all_names(3) {
        assert_eq!(record(&fixture, &name, 1)["state"], "done");
    }
}

/// A folder of claims is for one case with its files and one place of the results, and a design of
/// one name has the same contents for all jobs.
#[test]
fn a_folder_of_claims_is_for_one_batch() {
    let fixture = designs(2);
    assert_good(&claim(&fixture, &[]));
    let whole = files(&fixture.path("moved"));
    let case = fixture.read("case.toml");

    let elsewhere: Vec<String> =
        claiming(&[]).into_iter().map(|word| if word == "moved" { "other".to_owned() } else { word }).collect();
    let output = start(&fixture, &elsewhere).wait_with_output().unwrap();
    refused(&output, 3, &["the claims in claims are for the outputs", "moved/moved.msh", "other/moved.msh", "hint: "]);
    assert!(!fixture.path("other").exists());

    fixture.write("case.toml", &case.replace("tolerance = 1e-4", "tolerance = 1e-3"));
    refused(&claim(&fixture, &[]), 3, &["the claims in claims are for the case case.toml ("]);
    fixture.write("case.toml", &case);
    let old = fixture.read("old.csv");
    fixture.write("old.csv", &old.replace("1,", "1, "));
    refused(&claim(&fixture, &["--resume"]), 3, &["the claims in claims are for the inputs", "old.csv ("]);
    fixture.write("old.csv", &old);

    // Another list with a design of the same name.
    fs::create_dir(fixture.path("more")).unwrap();
    fixture.write("more/001.csv", &profiles(&[(0, 0.3, 0.02), (1, 1.2, 0.01)]));
    let more: Vec<String> =
        claiming(&[]).into_iter().map(|word| if word == "designs" { "more".to_owned() } else { word }).collect();
    let output = start(&fixture, &more).wait_with_output().unwrap();
    refused(&output, 3, &["the design 001 was claimed with other contents", "claims/001.1.claim"]);
    // Other names are further designs.
    fs::rename(fixture.path("more/001.csv"), fixture.path("more/x.csv")).unwrap();
    assert_good(&start(&fixture, &more).wait_with_output().unwrap());
    fs::remove_file(fixture.path("moved/x.msh")).unwrap();
    assert!(files(&fixture.path("moved")) == whole);
    assert_eq!(names(&lines(&fixture, "all.jsonl")), ["000", "001", "x"]);

    fixture.write("claims/claims.json", "{}");
    refused(&claim(&fixture, &[]), 3, &["claims/claims.json: expected the record of a claim folder"]);
}

/// A folder that takes no claims is told before anything is moved.
#[test]
fn a_folder_that_takes_no_claims_is_refused() {
    let fixture = designs(1);
    fixture.write("claims", "a file");
    refused(&claim(&fixture, &[]), 3, &["error: cannot write claims"]);
    assert!(!fixture.path("moved").exists() && !fixture.path("all.jsonl").exists());
    fs::remove_file(fixture.path("claims")).unwrap();
}

/// A design whose name leaves no room for the rest of its claim's name is claimed as any other, and
/// two such designs with the same beginning are two.
#[test]
fn a_long_name_is_claimed() {
    let fixture = designs(1);
    let long = ["x".repeat(239), "é".repeat(120), "é".repeat(119) + "a"];
    long.iter().for_each(|name| fixture.raised_design(name, 0.01));
    assert_good(&claim(&fixture, &[]));
    let mut expected: Vec<String> = long.iter().cloned().chain(["000".to_owned()]).collect();
    expected.sort();
    assert_eq!(names(&lines(&fixture, "all.jsonl")), expected);
    assert_eq!(fs::read_dir(fixture.path("claims")).unwrap().count(), 5);
    // They are done.
    fs::remove_file(fixture.path("all.jsonl")).unwrap();
    assert_good(&claim(&fixture, &[]));
    assert!(!fixture.path("all.jsonl").exists() || fixture.read("all.jsonl").is_empty());
}

/// A pipe or a device under the name of a claim is no claim: it is never read, expires as half a
/// claim does, and stops nothing.
#[test]
fn what_blocks_is_no_claim() {
    let fixture = designs(4);
    fs::create_dir(fixture.path("claims")).unwrap();
    let make = |program: &str, arguments: &[&str]| {
        let mut command = std::process::Command::new(program);
        assert!(command.args(arguments).current_dir(fixture.path("claims")).status().unwrap().success());
    };
    make("mkfifo", &["000.1.claim"]);
    make("ln", &["-s", "/dev/zero", "001.1.claim"]);
    make("mkdir", &["002.1.claim"]);
    assert_good(&claim(&fixture, &["--claim-expires", "1"]));
    assert_eq!(names(&lines(&fixture, "all.jsonl")), all_names(4));
    assert!(fixture.path("claims/000.2.claim").is_file() && fixture.path("claims/001.2.claim").is_file());
    assert!(fixture.path("claims/002.2.claim").is_file() && fixture.path("claims/003.1.claim").is_file());
    // The record of the whole folder is demanded.
    fs::remove_file(fixture.path("claims/claims.json")).unwrap();
    make("mkfifo", &["claims.json"]);
    refused(&claim(&fixture, &[]), 3, &["claims/claims.json: expected the record of a claim folder"]);
}

/// A design with which many jobs ended is given up instead of ending all others.
#[test]
fn a_design_that_ends_its_jobs_is_given_up() {
    let fixture = designs(2);
    assert_good(&claim(&fixture, &[]));
    hand_to(&fixture, "001", |record| {
        of_ended_process(record);
        record["ended"] = 4.into();
    });
    let output = claim(&fixture, &[]);
    refused(&output, 1, &["error: 1 of 2 designs failed"]);
    let all = lines(&fixture, "all.jsonl");
    let line = all.iter().find(|line| line["design"] == "001").unwrap();
    let message = line["error"]["message"].as_str().unwrap();
    assert!(message.contains("5 jobs ended while they worked on this design"), "{message}");
    assert_eq!(line["exit"], 3);
    assert_good(&claim(&fixture, &["--resume"]));
}

/// Several designs at once in one process: the same files, whole lines, each design once.
#[test]
fn jobs_change_no_byte() {
    let fixture = designs(12);
    fixture.write("designs/005.csv", "profile,x,y,z\n0,1,zwei,3\n");
    let batch = |out: &str, more: &[&str]| {
        let json = format!("{out}.jsonl");
        let output = fixture.idmesh(&[&BATCH[..], &["--out", out, "--json", &json], more].concat());
        refused(&output, 1, &["error: 1 of 12 designs failed"]);
        (files(&fixture.path(out)), lines(&fixture, &json))
    };
    let (alone, of_one) = batch("one", &["--jobs", "1"]);
    // One worker takes the designs in their order.
    assert_eq!(of_one.iter().map(|line| line["design"].as_str().unwrap()).collect::<Vec<_>>(), all_names(12));
    let (together, of_many) = batch("many", &["--jobs", "4"]);
    assert!(alone == together);
    assert_eq!(names(&of_many), all_names(12));
    let exits = |lines: &[Value]| {
        lines.iter().map(|line| (line["design"].to_string(), line["exit"].as_u64())).collect::<BTreeMap<_, _>>()
    };
    assert_eq!(exits(&of_one), exits(&of_many));
    let (more_than_designs, _) = batch("most", &["--jobs", "64"]);
    assert!(alone == more_than_designs);
    refused(&claim(&fixture, &["--jobs", "3"]), 1, &["error: 1 of 12 designs failed"]);
    assert!(files(&fixture.path("moved")) == alone);
    refused(&fixture.idmesh(&[&BATCH[..], &["--jobs", "0"]].concat()), 2, &["0 is not in 1..=512"]);
}
