//! Results of an earlier run: a run that fails, in whatever way, leaves none that would pass for
//! its own.

use std::fs;
use std::process::Output;

use crate::fixture::*;

/// The files of a valid result, and of one that is not valid.
const RESULTS: [&str; 5] = ["moved.msh", "moved.invalid.msh", "moved.inverted.vtu", "beta.svg", "report.json"];

/// The case with a histogram.
fn case() -> String {
    CASE.replacen("mesh = \"moved.msh\"", "mesh = \"moved.msh\"\nhistogram = \"beta.svg\"", 1)
}

fn left<'n>(fixture: &Fixture, names: &[&'n str]) -> Vec<&'n str> {
    names.iter().copied().filter(|name| fixture.path(name).exists()).collect()
}

/// Runs a command on a machine without a GPU.
fn on_cpu(fixture: &Fixture, arguments: &[&str]) -> Output {
    without_gpu(&mut command(fixture.folder.path(), arguments)).output().unwrap()
}

/// A case of which a key, a role or a file is wrong, a machine that has not the memory for a
/// thread, and one that has no GPU.
#[test]
fn a_run_that_fails_leaves_no_earlier_result() {
    let fixture = Fixture::new();
    let run = ["run", "case.toml", "--backend", "cpu", "--json", "report.json"];
    let broken = |from: &str, to: &str| {
        assert!(case().contains(from), "{from}");
        case().replacen(from, to, 1)
    };
    for (exit, case_now, more) in [
        (3, case(), &["--max-memory", "1M"][..]),
        (3, broken("new =", "nwe ="), &[]),
        (3, broken("role = \"wing\"", "role = \"wimg\""), &[]),
        (3, broken("[solver]\ntolerance = 1e-4", "[solver]\ntolerance = 0"), &[]),
        (3, broken("histogram = ", "histgram = 3\nhistogram = "), &[]),
        (3, broken("box.msh", "gone.msh"), &[]),
        (6, case(), &["--backend", "gpu"]),
    ] {
        fixture.write("case.toml", &case());
        assert_good(&fixture.idmesh(&run));
        assert_eq!(left(&fixture, &RESULTS), ["moved.msh", "beta.svg", "report.json"]);
        // An invalid result of a run before.
        fixture.write("moved.invalid.msh", "an older result");
        fixture.write("moved.inverted.vtu", "an older result");
        fixture.write("case.toml", &case_now);
        let run: Vec<&str> = match more {
            ["--backend", backend] => run.iter().map(|&word| if word == "cpu" { backend } else { word }).collect(),
            more => run.iter().chain(more).copied().collect(),
        };
        let output = on_cpu(&fixture, &run);
        assert_eq!(output.status.code(), Some(exit), "{case_now}{}", stderr(&output));
        assert_eq!(left(&fixture, &RESULTS), [] as [&str; 0], "{case_now}{more:?}");
        assert_eq!(left(&fixture, &["case.toml", "box.msh", "new.csv"]).len(), 3, "{case_now}");
    }
}

/// A file that a case with a mistake may read, and a file that no run would write, stay.
#[test]
fn a_case_with_a_mistake_takes_no_other_file_away() {
    let fixture = Fixture::new();
    for (name, text) in [
        // The misspelt key may have named the input.
        ("moved.msh", case().replacen("new = \"new.csv\"", "nwe = \"moved.msh\"", 1)),
        ("moved.msh", case().replacen("new = \"new.csv\"", "nwe = \"m*.msh\"", 1)),
        ("moved.msh", case().replacen("mesh = \"box.msh\"", "mesh = \"moved.msh\"", 1)),
        ("thesis.doc", case().replacen("\"moved.msh\"", "\"thesis.doc\"", 1)),
        ("notes.txt", case().replacen("beta.svg", "notes.txt", 1)),
    ] {
        fixture.write(name, "not to be lost");
        fixture.write("case.toml", &text);
        assert_eq!(fixture.run().status.code(), Some(3), "{text}");
        assert_eq!(fixture.read(name), "not to be lost", "{text}");
        fs::remove_file(fixture.path(name)).unwrap();
    }
}

const BATCH: [&str; 9] = ["batch", "case.toml", "--designs", "designs", "--out", "moved", "--json", "all.jsonl", "-q"];

/// As for a run. With `--resume` all results stay.
#[test]
fn a_batch_that_fails_leaves_no_earlier_result() {
    let fixture = Fixture::new();
    let results = ["moved/0.msh", "moved/1.msh"];
    let broken = |from: &str, to: &str| {
        assert!(CASE.contains(from), "{from}");
        CASE.replacen(from, to, 1)
    };
    let all = "designs/0.csv\ndesigns/1.csv\n";
    for (exit, case, designs, more) in [
        (3, CASE.to_owned(), all, &["--backend", "cpu", "--max-memory", "1M"][..]),
        (3, broken("new =", "nwe ="), all, &["--backend", "cpu"]),
        (3, broken("role = \"wing\"", "role = \"wimg\""), all, &["--backend", "cpu"]),
        (3, broken("box.msh", "gone.msh"), all, &["--backend", "cpu"]),
        (6, CASE.to_owned(), all, &["--backend", "gpu"]),
        (3, CASE.to_owned(), "", &["--backend", "cpu"]),
        (3, CASE.to_owned(), "designs/0.csv\ndesigns/1.csv\nother/1.csv\n", &["--backend", "cpu"]),
    ] {
        for resumes in [false, true] {
            let _ = fs::remove_dir_all(fixture.path("moved"));
            fs::create_dir_all(fixture.path("designs")).unwrap();
            (0..2).for_each(|at| _ = fs::copy(fixture.path("new.csv"), fixture.path(&format!("designs/{at}.csv"))));
            fixture.write("case.toml", CASE);
            fixture.write("list.txt", all);
            let batch: Vec<&str> =
                BATCH.iter().map(|&word| if word == "designs" { "list.txt" } else { word }).collect();
            assert_good(&on_cpu(&fixture, &[&batch[..], &["--backend", "cpu"]].concat()));
            assert_eq!(left(&fixture, &results), results);
            fixture.write("case.toml", &case);
            fixture.write("list.txt", designs);
            let resume: &[&str] = if resumes { &["--resume"] } else { &[] };
            let output = on_cpu(&fixture, &[&batch[..], more, resume].concat());
            // All designs are done, so no GPU is needed.
            let exit = if resumes && exit == 6 { 0 } else { exit };
            assert_eq!(output.status.code(), Some(exit), "{case}{designs}{more:?}: {}", stderr(&output));
            let expected: &[&str] = if resumes { &results } else { &[] };
            assert_eq!(left(&fixture, &results), expected, "{case}{designs}{more:?}");
            assert_eq!(fixture.read("all.jsonl").lines().count(), expected.len(), "{case}{designs}{more:?}");
            assert_eq!(left(&fixture, &["case.toml", "box.msh", "designs/0.csv", "designs/1.csv"]).len(), 4);
        }
    }
}

/// The lines of a file name results, but no file elsewhere. A file of other lines stays.
#[test]
fn designs_that_are_not_known_are_those_of_the_lines() {
    let fixture = Fixture::new();
    let batch = [&BATCH[..], &["--backend", "cpu"]].concat();
    fs::create_dir(fixture.path("moved")).unwrap();
    for name in ["moved/a.msh", "moved/b.msh", "away.msh"] {
        fixture.write(name, "an older result");
    }
    fixture.write("all.jsonl", "{\"design\":\"a\"}\n{\"design\":\"../away\"}\n");
    assert_eq!(fixture.idmesh(&batch).status.code(), Some(3));
    assert_eq!(left(&fixture, &["moved/a.msh", "moved/b.msh", "away.msh"]), ["moved/b.msh", "away.msh"]);
    fixture.write("all.jsonl", "my notes\n");
    assert_eq!(fixture.idmesh(&batch).status.code(), Some(3));
    assert_eq!(fixture.read("all.jsonl"), "my notes\n");
}

/// Where the memory does not hold the case, or the case is no TOML, nothing says which files are
/// its results. Then they stay, and the message says so.
///
/// Fails if `OF_BYTE` of the case is 0 or half as much: the memory is then exhausted later, without
/// a word on the results.
#[test]
fn results_that_are_not_named_stay_and_this_is_told() {
    let fixture = Fixture::new();
    let words = "no results of an earlier run were removed, because the file does not name them";
    let long = format!("{}{}", case(), "# nothing here\n".repeat((2 << 20) / 15));
    for (text, limit, cause) in [
        (long, "130M", "cannot read the case file: this takes about 0.1"),
        (case().replacen("mesh =", "mesh", 1), "1G", "case.toml:1:"),
    ] {
        fixture.write("case.toml", &case());
        assert_good(&fixture.run());
        fixture.write("case.toml", &text);
        let mut run = command(fixture.folder.path(), &["run", "case.toml", "--backend", "cpu", "--max-memory", limit]);
        let output = run.env("RAYON_NUM_THREADS", "1").output().unwrap();
        assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
        assert!(stderr(&output).contains(words) && stderr(&output).contains(cause), "{}", stderr(&output));
        assert_eq!(left(&fixture, &["moved.msh", "beta.svg"]).len(), 2);
    }
    // Nothing is said of a case that is not there.
    let gone = fixture.idmesh(&["run", "gone.toml"]);
    assert!(!stderr(&gone).contains("earlier run"), "{}", stderr(&gone));
}

/// A misspelt key may hide the name of a result. What has a likely name goes, and in any case the
/// message says that results may be left.
#[test]
fn what_a_misspelt_key_hides_is_told() {
    let fixture = Fixture::new();
    let words = "results of an earlier run may be left, because a mistake may hide their names";
    let without = CASE.split("[output]").next().unwrap();
    for (good, bad, is_left) in [
        (without.to_owned(), without.replacen("mesh =", "mesg =", 1), false),
        (CASE.to_owned(), CASE.replacen("[output]\nmesh = ", "[output]\nmeshes = ", 1), false),
        (CASE.replacen("moved.msh", "own.msh", 1), CASE.replacen("[output]", "[outputs]", 1), true),
    ] {
        fixture.write("case.toml", &good);
        assert_good(&fixture.run());
        fixture.write("case.toml", &bad);
        for command in [&["run", "case.toml"][..], &["batch", "case.toml", "--designs", "designs"]] {
            let output = fixture.idmesh(command);
            assert_eq!(output.status.code(), Some(3), "{bad}");
            assert!(stderr(&output).contains(words), "{bad}: {}", stderr(&output));
        }
        assert!(!fixture.path("moved.msh").exists(), "{bad}");
        assert_eq!(fixture.path("own.msh").exists(), is_left, "{bad}");
    }
    // A mistake elsewhere hides no name.
    fixture.write("case.toml", &CASE.replacen("new =", "nwe =", 1));
    let output = fixture.run();
    assert_eq!(output.status.code(), Some(3));
    assert!(!stderr(&output).contains("earlier run"), "{}", stderr(&output));
}

/// A folder that only has the name of a result is none.
#[test]
fn an_empty_folder_is_no_result() {
    let fixture = Fixture::new();
    fs::create_dir(fixture.path("moved.invalid.msh")).unwrap();
    fixture.run();
    assert!(fixture.path("moved.invalid.msh").is_dir());
}
