//! `idmesh run` on good input: a moved mesh, or a result that is said not to be good.

use std::fs;

use crate::fixture::*;
use crate::wing_box::*;

#[test]
fn a_good_case_is_moved() {
    let fixture = Fixture::new();
    let output = fixture.run();
    assert_good(&output);
    let table = stdout(&output);
    let first: Vec<_> = table.lines().map(|line| line.split_whitespace().next().unwrap()).collect();
    assert_eq!(first, ["stage", "Original", "Deformed", "Corrected", "Final"]);
    assert_eq!(fixture.files(), ["box.msh", "case.toml", "moved.msh", "new.csv"]);
    let moved = fixture.read("moved.msh");
    assert_eq!(moved.lines().count(), fixture.read("box.msh").lines().count());
    assert_ne!(moved, fixture.read("box.msh"));
}

#[test]
fn standard_output_holds_only_the_json() {
    let fixture = Fixture::new();
    let output = fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "-"]);
    assert_good(&output);
    let report: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let keys: Vec<_> = report.as_object().unwrap().keys().map(String::as_str).collect();
    assert_eq!(keys, ["backend", "case", "families", "idmesh", "mesh", "profiles", "seconds", "solver", "stages"]);
    assert_eq!(report["backend"]["kind"], "cpu");
    assert_eq!(report["stages"].as_array().unwrap().len(), 4);
    assert_eq!(report["stages"][3]["inverted"], 0);
}

#[test]
fn outputs_go_into_a_new_folder() {
    let fixture = Fixture::new();
    fixture.case("mesh = \"moved.msh\"", "mesh = [\"moved.msh\", \"moved.vtu\"]\nhistogram = \"beta.svg\"");
    assert_good(&fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--out", "a/b", "--json", "report.json"]));
    for name in ["a/b/moved.msh", "a/b/moved.vtu", "a/b/beta.svg", "report.json"] {
        assert!(fixture.path(name).is_file(), "{name} is missing");
    }
    assert!(!fixture.path("moved.msh").exists());
}

#[test]
fn quiet_says_nothing() {
    let fixture = Fixture::new();
    let output = fixture.idmesh(&["-q", "run", "case.toml", "--backend", "cpu"]);
    assert_good(&output);
    assert_eq!(stderr(&output), "");
    let output = fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "-v"]);
    assert!(stderr(&output).contains("volume"), "{}", stderr(&output));
}

/// A wing that is told to move by (0.01, 0, 0.02) does, to the last digit.
#[test]
fn prescribed_displacements_are_followed() {
    let fixture = Fixture::new();
    let mesh = WingBox::new();
    let wing = mesh.family_vertices(0);
    let rows: String = wing
        .iter()
        .map(|&vertex| mesh.vertices[vertex])
        .map(|[x, y, z]| format!("{x},{y},{z},0.01,0,0.02\n"))
        .collect();
    fixture.write("wing.csv", &rows);
    let case = CASE.replace("[profiles.wing]\nnew = \"new.csv\"\n", "");
    let case = case.replace("role = \"wing\"\n", "role = \"prescribed\"\ndisplacement = \"wing.csv\"\n");
    fixture.write("case.toml", &case);
    assert_good(&fixture.run());
    let moved = fixture.read("moved.msh");
    let nodes: Vec<&str> = moved.lines().skip_while(|line| *line != "$Nodes").skip(2).collect();
    for vertex in wing {
        let found: Vec<f64> = nodes[vertex].split_whitespace().skip(1).map(|text| text.parse().unwrap()).collect();
        let [x, y, z] = mesh.vertices[vertex];
        assert_eq!(found, [x + 0.01, y, z + 0.02]);
    }

    let half: String = rows.lines().skip(1).map(|line| format!("{line}\n")).collect();
    fixture.write("wing.csv", &half);
    fs::remove_file(fixture.path("moved.msh")).unwrap();
    fixture.refuses(3, &["wing.csv: 1 of the family's", "vertices have no row"]);
}

#[test]
fn too_few_sweeps_are_not_convergence() {
    let fixture = Fixture::new();
    fixture.case("tolerance = 1e-4", "method = \"jacobi\"\ntolerance = 1e-9\nmax_sweeps = 2");
    let output = fixture.run();
    assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
    assert!(stderr(&output).contains("error: not converged"), "{}", stderr(&output));
}

#[test]
fn inverted_meshes_get_another_name() {
    let fixture = Fixture::new();
    // Up through the top of the box.
    fixture.write("new.csv", &profiles(&[(0, 0.3, 3.0), (1, 1.2, 3.0)]));
    fixture.write("moved.msh", "an older result");
    let output = fixture.run();
    assert_eq!(output.status.code(), Some(5), "{}", stderr(&output));
    assert!(stderr(&output).contains("inverted; the mesh is in moved.invalid.msh"), "{}", stderr(&output));
    assert!(fixture.path("moved.invalid.msh").is_file());
    assert_eq!(fixture.read("moved.msh"), "an older result");
}
