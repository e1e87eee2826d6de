//! `idmesh report --join` joins files of reports, each design once.

use std::fs;

use serde_json::{Value, json};

use crate::fixture::*;

/// A line of a design, with checksums of its design and of its output.
fn line(design: &str, exit: u8, of_design: &str, of_output: &str, seconds: f64) -> String {
    let line = json!({
        "design": design, "exit": exit, "valid": exit == 0, "seconds": { "total": seconds },
        "checksums": {
            "case": { "case.toml": "c" }, "mesh": { "box.msh": "m" }, "inputs": {},
            "design": { format!("designs/{design}.csv"): of_design },
            "outputs": { format!("moved/{design}.msh"): of_output },
        },
    });
    format!("{line}\n")
}

fn folder(files: &[(&str, String)]) -> Fixture {
    let fixture = Fixture::new();
    for (name, text) in files {
        fixture.write(name, text);
    }
    fixture
}

/// The designs of the joined file with their exit codes and seconds, and the messages.
#[track_caller]
fn joined(fixture: &Fixture, files: &[&str]) -> (Vec<(String, u64, f64)>, String) {
    fs::remove_file(fixture.path("joined.jsonl")).ok();
    let output = fixture.idmesh(&[&["report"], files, &["--join", "joined.jsonl"]].concat());
    assert_good(&output);
    let text = fixture.read("joined.jsonl");
    let values = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let of = |value: Value| {
        let design = value["design"].as_str().unwrap().to_owned();
        (design, value["exit"].as_u64().unwrap(), value["seconds"]["total"].as_f64().unwrap())
    };
    (values.map(of).collect(), stderr(&output))
}

fn row(design: &str, exit: u64, seconds: f64) -> (String, u64, f64) {
    (design.to_owned(), exit, seconds)
}

#[test]
fn each_design_is_there_once_and_the_last_good_line_stays() {
    let fixture = folder(&[
        ("one.jsonl", line("b", 0, "1", "1", 1.0) + &line("a", 3, "1", "", 2.0) + &line("d", 0, "1", "1", 3.0)),
        (
            "other.jsonl",
            line("a", 0, "1", "1", 4.0) + "\n" + &line("c", 5, "1", "1", 5.0) + &line("d", 0, "1", "1", 6.0),
        ),
    ]);
    let expected = [row("a", 0, 4.0), row("b", 0, 1.0), row("c", 5, 5.0), row("d", 0, 6.0)];
    let (rows, told) = joined(&fixture, &["one.jsonl", "other.jsonl"]);
    assert_eq!(rows, expected);
    assert_eq!(told, "4 designs, 1 of them failed\n");
    // A line that stays keeps every byte.
    assert!(fixture.read("joined.jsonl").contains(&line("b", 0, "1", "1", 1.0)));
    // One file is joined too, and standard output takes the lines.
    let output = fixture.idmesh(&["report", "other.jsonl", "--join", "-", "-q"]);
    assert_good(&output);
    assert_eq!(
        stdout(&output),
        line("a", 0, "1", "1", 4.0) + &line("c", 5, "1", "1", 5.0) + &line("d", 0, "1", "1", 6.0)
    );
    // The other order: the failure is the later line, which is told.
    let (rows, told) = joined(&fixture, &["other.jsonl", "one.jsonl"]);
    assert_eq!(rows, [row("a", 0, 4.0), row("b", 0, 1.0), row("c", 5, 5.0), row("d", 0, 3.0)]);
    assert!(told.contains("warning: a: other.jsonl:1 and one.jsonl:2 have different exit codes"), "{told}");
}

/// Fails if lines are compared by their times, or not at all.
#[test]
fn lines_of_different_results_are_told() {
    let cases = [
        (line("a", 0, "1", "2", 2.0), Some("outputs")),
        (line("a", 0, "2", "1", 2.0), Some("inputs")),
        (line("a", 0, "1", "1", 2.0), None),
        (line("a", 0, "1", "1", 2.0).replace("designs/a.csv", "../designs/a.csv").replace("moved/", "/x/moved/"), None),
        (line("a", 4, "1", "1", 2.0), Some("exit codes")),
    ];
    for (other, what) in cases {
        let fixture = folder(&[("one.jsonl", line("a", 0, "1", "1", 1.0)), ("other.jsonl", other.clone())]);
        let (rows, told) = joined(&fixture, &["one.jsonl", "other.jsonl"]);
        let stays = if other.contains("\"exit\":4") { "one.jsonl:1" } else { "other.jsonl:1" };
        assert_eq!(rows, [row("a", 0, if stays.starts_with("one") { 1.0 } else { 2.0 })]);
        match what {
            None => assert_eq!(told, "1 designs, 0 of them failed\n"),
            Some(what) => {
                assert!(told.contains(&format!("have different {what}; the line of {stays} stays")), "{told}");
            }
        }
    }
    // Lines without checksums are compared by what they tell, but for times.
    let plain = |mean: f64, seconds: f64| {
        format!(
            "{}\n",
            json!({"design": "a", "exit": 0, "valid": true, "seconds": {"total": seconds}, "stages": [{"beta_mean": mean, "seconds": seconds}]})
        )
    };
    for (mean, is_told) in [(0.1, false), (0.2, true)] {
        let fixture = folder(&[("one.jsonl", plain(0.1, 1.0)), ("other.jsonl", plain(mean, 2.0))]);
        let (_, told) = joined(&fixture, &["one.jsonl", "other.jsonl"]);
        assert_eq!(told.contains("different results"), is_told, "{told}");
    }
}

#[test]
fn reports_of_different_cases_are_told() {
    let other = line("b", 0, "1", "1", 1.0).replace("\"box.msh\":\"m\"", "\"box.msh\":\"n\"");
    let fixture = folder(&[("one.jsonl", line("a", 0, "1", "1", 1.0)), ("other.jsonl", other)]);
    let (rows, told) = joined(&fixture, &["one.jsonl", "other.jsonl"]);
    assert_eq!(rows.len(), 2);
    assert!(told.contains("warning: one.jsonl:1 and other.jsonl:1 are of different cases"), "{told}");
}

/// A line torn by a killed process is left out and told; anything else that is no report is an
/// error.
#[test]
fn torn_lines_are_told_and_other_files_are_refused() {
    let whole = line("a", 0, "1", "1", 1.0);
    let fixture =
        folder(&[("torn.jsonl", whole.clone() + "{\"design\":\"b\",\"ex"), ("no.jsonl", whole.clone() + "hello\n")]);
    let (rows, told) = joined(&fixture, &["torn.jsonl"]);
    assert_eq!(rows, [row("a", 0, 1.0)]);
    assert!(told.contains("warning: torn.jsonl: the last line was torn"), "{told}");
    // A line that ends is not torn.
    fixture.write("ended.jsonl", "{\"design\":\"b\",\"ex\n");
    let refuses = |file: &str, words: &[&str]| {
        fixture.refuses_command(&["report", file, "--join", "new.jsonl"], 3, words);
    };
    refuses("ended.jsonl", &["ended.jsonl: line 1 is no report of a design"]);
    for (number, bare) in ["", ",\"exit\":null", ",\"exit\":0,\"valid\":false"].into_iter().enumerate() {
        let name = format!("bare{number}.jsonl");
        fixture.write(&name, &format!("{}{{\"design\":\"b\"{bare}}}\n", whole));
        refuses(&name, &[&format!("{name}: line 2 is no report of a design")]);
    }
    refuses("no.jsonl", &["no.jsonl: line 2 is no report of a design"]);
    refuses("gone.jsonl", &["cannot read gone.jsonl"]);
    refuses("box.msh", &["box.msh: line 1 is no report"]);
    let overwrites = ["report", "torn.jsonl", "--join", "torn.jsonl"];
    fixture.refuses_command(&overwrites, 3, &["the output torn.jsonl would overwrite the input torn.jsonl"]);
    let without = fixture.idmesh(&["report", "torn.jsonl"]);
    assert_eq!(without.status.code(), Some(2), "{}", stderr(&without));
    assert!(stderr(&without).contains("--join") && stderr(&without).contains("--output"), "{}", stderr(&without));
}

/// A mark of the order of bytes before the first line is no fault. A file without reports is told
/// and is no success, and the report of one run has a hint of its own.
#[test]
fn odd_files_of_reports() {
    let fixture = folder(&[
        ("marked.jsonl", format!("\u{feff}{}", line("a", 0, "1", "1", 1.0))),
        ("none.jsonl", "\n".to_owned()),
    ]);
    assert_eq!(joined(&fixture, &["marked.jsonl"]).0, [row("a", 0, 1.0)]);
    let output = fixture.idmesh(&["report", "none.jsonl", "-o", "page.html"]);
    assert!(stderr(&output).contains("warning: there is no report of a design"), "{}", stderr(&output));
    assert!(!fixture.read("page.html").contains("badge good"));
    assert_good(&fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "run.json"]));
    let output = fixture.idmesh(&["report", "run.json", "-o", "new.html"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("the report of one run") && stderr(&output).contains("run CASE --report"));
}

/// Nothing is replaced, and there is nothing to resume: the hint is one that helps here.
#[test]
fn what_is_no_file_of_reports_is_told() {
    let fixture = folder(&[("notes.txt", "hello\nx\n".to_owned())]);
    let output = fixture.idmesh(&["report", "notes.txt", "--join", "joined.jsonl"]);
    assert_eq!(output.status.code(), Some(3));
    let errors = stderr(&output);
    assert!(errors.contains("notes.txt: line 1 is no report of a design"), "{errors}");
    assert!(errors.contains("hint: ") && !errors.contains("--resume"), "{errors}");
}
