//! `idmesh batch --resume` leaves out what is done and has not changed, by checksums.

use std::process::Command;

use serde_json::Value;

use crate::fixture::*;

const BATCH: [&str; 10] =
    ["batch", "case.toml", "--backend", "cpu", "--designs", "designs", "--out", "moved", "--json", "all.jsonl"];

/// A case with old profiles and two designs.
fn designs() -> Fixture {
    Fixture::with_raised_designs(&[("a", 0.06), ("b", 0.03)])
}

fn lines(fixture: &Fixture) -> Vec<Value> {
    fixture.read("all.jsonl").lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Resumes the batch, and returns the number of designs that were left out.
#[track_caller]
fn left_out(fixture: &Fixture) -> usize {
    let output = fixture.idmesh(&[&BATCH[..], &["--resume"]].concat());
    assert_good(&output);
    let errors = stderr(&output);
    let number = errors.lines().find_map(|line| line.strip_suffix(" of 2 designs are done already"));
    number.map_or(0, |number| number.parse().unwrap())
}

/// The checksums of a line are those that `sha256sum` computes.
#[test]
#[cfg(target_os = "linux")]
fn checksums_are_those_of_the_files() {
    let fixture = designs();
    assert_good(&fixture.idmesh(&BATCH));
    let line = &lines(&fixture)[0];
    let mut n_files = 0;
    for part in ["case", "mesh", "inputs", "design", "outputs"] {
        for (path, sum) in line["checksums"][part].as_object().unwrap() {
            let output = Command::new("sha256sum").arg(fixture.path(path)).output().unwrap();
            assert_eq!(stdout(&output).split_whitespace().next(), sum.as_str(), "{part}: {path}");
            n_files += 1;
        }
    }
    let names = |part: &str| line["checksums"][part].as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    assert_eq!(names("inputs"), ["new.csv", "old.csv"]);
    assert_eq!((names("design"), names("outputs")), (vec!["designs/a.csv".to_owned()], vec!["moved/a.msh".to_owned()]));
    assert_eq!(n_files, 6);
}

/// What changed since is done again: the design, the case, an input, the mesh, an output.
#[test]
fn what_changed_is_done_again() {
    let fixture = designs();
    assert_good(&fixture.idmesh(&BATCH));
    assert_eq!(left_out(&fixture), 2);
    let good = fixture.read("moved/a.msh");

    fixture.write("designs/a.csv", &profiles(&[(0, 0.3, 0.02), (1, 1.2, 0.05)]));
    assert_eq!(left_out(&fixture), 1);
    assert!(fixture.read("moved/a.msh") != good);
    assert_eq!(left_out(&fixture), 2);

    fixture.write("moved/b.msh", "");
    assert_eq!(left_out(&fixture), 1);
    assert_eq!(left_out(&fixture), 2);

    for name in ["case.toml", "old.csv", "box.msh"] {
        let changed = match name {
            "case.toml" => fixture.read(name) + "\n# more\n",
            "old.csv" => fixture.read(name).replace("1,", "1, "),
            _ => fixture.read(name) + "\n",
        };
        fixture.write(name, &changed);
        assert_eq!(left_out(&fixture), 0, "{name}");
        assert_eq!(left_out(&fixture), 2, "{name}");
    }
    // Another output of the case.
    let case = fixture.read("case.toml").replace("mesh = \"moved.msh\"", "mesh = [\"moved.msh\", \"moved.vtu\"]");
    fixture.write("case.toml", &case);
    assert_eq!(left_out(&fixture), 0);
    assert!(fixture.path("moved/a.vtu").is_file());
    // A line of a version without checksums.
    let text: String = lines(&fixture)
        .into_iter()
        .map(|mut line| {
            line.as_object_mut().unwrap().remove("checksums");
            format!("{line}\n")
        })
        .collect();
    fixture.write("all.jsonl", &text);
    assert_eq!(left_out(&fixture), 0);
    assert_eq!(lines(&fixture).len(), 2);
}
