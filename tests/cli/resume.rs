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

/// The last line is not whole after a power cut: the disk has got zeros in place of its bytes.
#[test]
fn zeros_at_the_end_are_a_torn_line() {
    let fixture = designs();
    assert_good(&fixture.idmesh(&BATCH));
    let text = fixture.read("all.jsonl");
    for zeros in [1, 700, 70_000] {
        let first = text.split_inclusive('\n').next().unwrap();
        fixture.write("all.jsonl", &format!("{first}{}", "\0".repeat(zeros)));
        assert_eq!(left_out(&fixture), 1, "{zeros}");
        assert_eq!(lines(&fixture).len(), 2);
    }
    // `report` tells of it.
    fixture.write("all.jsonl", &format!("{text}\0\0\0"));
    let joined = fixture.idmesh(&["report", "all.jsonl", "--join", "joined.jsonl"]);
    assert_good(&joined);
    assert!(stderr(&joined).contains("all.jsonl: the last line was torn"), "{}", stderr(&joined));
    assert_eq!(fixture.read("joined.jsonl"), text);
}

/// The names of the families beside a mesh belong to its result, also if the file was there before.
#[test]
fn a_file_beside_the_mesh_that_is_gone_is_made_again() {
    let fixture = designs();
    let case = fixture.read("case.toml").replace("mesh = \"moved.msh\"", "mesh = \"moved.lb8.ugrid\"");
    fixture.write("case.toml", &case);
    assert_good(&fixture.idmesh(&BATCH));
    // This time the files beside the meshes are there.
    assert_good(&fixture.idmesh(&BATCH));
    for line in lines(&fixture) {
        let design = line["design"].as_str().unwrap();
        let outputs: Vec<_> = line["checksums"]["outputs"].as_object().unwrap().keys().cloned().collect();
        assert_eq!(outputs, [format!("moved/{design}.lb8.ugrid"), format!("moved/{design}.mapbc")]);
    }
    assert_eq!(left_out(&fixture), 2);
    std::fs::remove_file(fixture.path("moved/a.mapbc")).unwrap();
    assert_eq!(left_out(&fixture), 1);
    assert!(fixture.path("moved/a.mapbc").is_file());
    assert_eq!(left_out(&fixture), 2);
}
