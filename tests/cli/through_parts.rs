//! Sections through a pylon, in `cut` and in cases without old profiles: whole, and told of.

use std::fs;
use std::path::{Path, PathBuf};

use super::fixture::{assert_good, command, stderr};
use crate::schema::assert_report;

fn data(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/aircraft").join(path)
}

const ROLES: &str = "
[family.wing]
role = \"wing\"
[family.trailing_edge]
role = \"trailing-edge\"
[family.wingtip]
role = \"wingtip\"
[family.carenage]
role = \"carenage\"
[family.symmetry]
role = \"plane\"
[family.farfield]
role = \"fixed\"
[family.nacelle]
role = \"rigid\"
";

#[test]
fn a_section_through_a_pylon_is_whole_and_told_of() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = data("nacelle.msh.gz");
    let cut = |at: &str, more: &[&str]| {
        let arguments = [&["cut", mesh.to_str().unwrap(), "--family", "wing", "--at", at, "--out", "cut.csv"], more];
        command(folder.path(), &arguments.concat()).output().unwrap()
    };
    let output = cut("y=0.8,y=1.6,y=3.62", &["--json", "cut.json"]);
    assert_good(&output);
    let told: Vec<String> =
        stderr(&output).lines().filter(|line| line.contains("warning")).map(str::to_owned).collect();
    assert_eq!(told.len(), 1, "{told:?}");
    for words in ["section 1 passes through `pylon`", "45 % of the section's length", "--family"] {
        assert!(told[0].contains(words), "{words}: {told:?}");
    }
    let json: serde_json::Value = serde_json::from_slice(&fs::read(folder.path().join("cut.json")).unwrap()).unwrap();
    let bridged = |section: usize| &json["sections"][section]["bridged"];
    assert!(bridged(0).is_null() && bridged(2).is_null());
    assert_eq!(bridged(1)[0]["family"], "pylon");
    assert!((bridged(1)[0]["length"].as_f64().unwrap() - 0.683).abs() < 1e-3, "{json}");

    // Cut again for a case with new profiles alone: unchanged ones move nothing.
    let run = |role: &str| {
        let case = format!(
            "mesh = '{}'\n{ROLES}[family.pylon]\nrole = \"{role}\"\n[profiles.wing]\nnew = \"cut.csv\"\n[output]\nmesh = \
             \"moved.msh\"\n",
            mesh.display()
        );
        fs::write(folder.path().join("case.toml"), case).unwrap();
        let arguments = ["run", "case.toml", "--backend", "cpu", "--json", "report.json"];
        command(folder.path(), &arguments).output().unwrap()
    };
    let output = run("attached");
    assert_good(&output);
    assert!(stderr(&output).contains("1 through `pylon`, a gap of 0.68"), "{}", stderr(&output));
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("report.json")).unwrap()).unwrap();
    assert_report(&report);
    assert!(report["warnings"].to_string().contains("`pylon`"), "{report}");
    let [before, after] =
        [mesh.clone(), folder.path().join("moved.msh")].map(|path| idmesh::formats::read(&path).unwrap().mesh.vertices);
    assert_eq!(before, after);

    // Another wing is no part.
    let output = run("wing");
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
}

/// Round the leading edge nothing is guessed, and a root in the fuselage has no section.
#[test]
fn a_gap_that_cannot_be_guessed_names_its_family() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = data("fairings.msh.gz");
    let arguments = ["cut", mesh.to_str().unwrap(), "--family", "wing", "--at", "y=0.43", "--out", "cut.csv"];
    let output = command(folder.path(), &arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("`carenage`"), "{}", stderr(&output));
    assert!(!folder.path().join("cut.csv").exists());
}
