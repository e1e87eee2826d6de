//! `idmesh run` on good input: a moved mesh, or a result that is said not to be good.

use std::fs;
use std::time::{Duration, Instant};

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

/// A wing that is told to move by (0.01, 0, 0.02) does, to the last digit. A row belongs to the
/// vertex that it is 4e-4 edges from, and to none that it is 4e-3 edges from.
///
/// Fails if `MATCH` of `job` is 0.3 or 1e-9.
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
    for &vertex in &wing {
        let found: Vec<f64> = nodes[vertex].split_whitespace().skip(1).map(|text| text.parse().unwrap()).collect();
        let [x, y, z] = mesh.vertices[vertex];
        assert_eq!(found, [x + 0.01, y, z + 0.02]);
    }

    let beside = |by: f64| {
        let [x, y, z] = mesh.vertices[wing[0]];
        rows.replacen(&format!("{x},{y},{z},"), &format!("{},{y},{z},", x + by), 1)
    };
    fixture.write("wing.csv", &beside(1e-4));
    assert_good(&fixture.run());
    assert_eq!(fixture.read("moved.msh"), moved);
    fs::remove_file(fixture.path("moved.msh")).unwrap();
    fixture.write("wing.csv", &beside(1e-3));
    fixture.refuses(3, &["wing.csv", "of the family"]);

    let half: String = rows.lines().skip(1).map(|line| format!("{line}\n")).collect();
    fixture.write("wing.csv", &half);
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

/// The symmetry plane is fixed, and the wing wants to rise by 0.01 at its root, then by 0.3, which
/// is more than its edges there.
#[test]
fn vertices_that_are_held_back_are_told() {
    let fixture = Fixture::new();
    let case = CASE.replace("role = \"plane\"", "role = \"fixed\"");
    fixture.write("case.toml", &case.replace("new = \"new.csv\"", "new = \"new.csv\"\nold = \"old.csv\""));
    // No vertex of the root stands beside the first profile's plane.
    fixture.write("old.csv", &profiles(&[(0, 0.45, 0.0), (1, 1.4, 0.0)]));
    fixture.write("new.csv", &profiles(&[(0, 0.45, 0.01), (1, 1.4, 0.01)]));
    let run = || fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "report.json"]);
    let output = run();
    assert_good(&output);
    let expected =
        "warning: `symmetry` holds 9 vertices of `wing` back from where the design has them, by up to 1.000e-2";
    assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    let report: serde_json::Value = serde_json::from_str(&fixture.read("report.json")).unwrap();
    let held = &report["families"]["symmetry"]["held_back"];
    assert_eq!(held["vertices"], 9);
    assert!((held["max_distance"].as_f64().unwrap() - 0.01).abs() < 1e-9);
    fs::remove_file(fixture.path("moved.msh")).unwrap();
    fixture.write("new.csv", &profiles(&[(0, 0.45, 0.3), (1, 1.4, 0.3)]));
    let output = run();
    assert_eq!(output.status.code(), Some(5), "{}", stderr(&output));
    let expected = "`symmetry` holds vertices of `wing` back by more than their shortest edge, at (1";
    assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    assert!(stderr(&output).contains("by 0.3 where that is 0.25"), "{}", stderr(&output));
    // Inverted cells would otherwise ask for steps and for local optimisation, in vain.
    fixture.write("new.csv", &profiles(&[(0, 0.45, 0.55), (1, 1.4, 0.55)]));
    let output = run();
    let report: serde_json::Value = serde_json::from_str(&fixture.read("report.json")).unwrap();
    assert!(report["checks"]["inverted_tets"].as_u64().unwrap() > 0, "{}", stderr(&output));
    assert_eq!((&report["path"]["steps"], &report["smoothing"]), (&1.into(), &serde_json::Value::Null));
    // Each fault has a line of its own.
    let errors = stderr(&output);
    let mut lines = errors.lines().skip_while(|line| !line.starts_with("error: "));
    assert!(lines.next().unwrap().starts_with("error: the moved mesh may not be used, for "), "{errors}");
    assert!(lines.next().unwrap().ends_with(" tets are inverted"), "{errors}");
    let rest: Vec<&str> = lines.collect();
    assert!(rest[0].starts_with("  `symmetry` holds vertices of `wing` back"), "{errors}");
    assert!(rest.last().unwrap().starts_with("hint: give what holds them"), "{errors}");
    assert!(rest[..rest.len() - 1].iter().all(|line| line.starts_with("  ")), "{errors}");
    assert!(fixture.path("moved.invalid.msh").is_file() && !fixture.path("moved.msh").exists());
}

#[test]
fn inverted_meshes_get_another_name() {
    let fixture = Fixture::new();
    // Up through the top of the box.
    fixture.write("new.csv", &profiles(&[(0, 0.3, 3.0), (1, 1.2, 3.0)]));
    fixture.write("moved.msh", "an older result");
    let output = fixture.run();
    assert_eq!(output.status.code(), Some(5), "{}", stderr(&output));
    assert!(stderr(&output).contains("the mesh is in moved.invalid.msh"), "{}", stderr(&output));
    assert!(fixture.path("moved.invalid.msh").is_file());
    // What an earlier run left does not stand there as the result of this one.
    assert!(!fixture.path("moved.msh").exists());
}

/// An invalid OpenFOAM folder goes with the next run, with all files that came from the mesh, such
/// as its zones. What is not idmesh's stays.
///
/// Fails if files that are not of every mesh are left, or if a link or a folder goes.
#[test]
fn an_invalid_folder_goes_with_its_zones() {
    let fixture = Fixture::new();
    ["mesh", "moved"].iter().for_each(|name| fs::create_dir(fixture.path(name)).unwrap());
    assert_good(&fixture.idmesh(&["convert", "box.msh", "mesh/polyMesh"]));
    for zones in ["cellZones", "faceZones", "pointZones.gz"] {
        fixture.write(&format!("mesh/polyMesh/{zones}"), "zones");
    }
    let case = CASE.replace("box.msh", "mesh/polyMesh").replace("moved.msh", "moved/polyMesh");
    fixture.write("case.toml", &case);
    let run = |height: f64, exit: i32| {
        fixture.write("new.csv", &profiles(&[(0, 0.3, height), (1, 1.2, height)]));
        let output = fixture.run();
        assert_eq!(output.status.code(), Some(exit), "{}", stderr(&output));
    };
    let invalid = fixture.path("moved/polyMesh.invalid");
    run(3.0, 5);
    assert!(invalid.join("cellZones").is_file() && !fixture.path("moved/polyMesh").exists());
    run(0.1, 0);
    assert!(!invalid.exists() && fixture.path("moved/polyMesh/pointZones.gz").is_file());
    run(3.0, 5);
    fs::create_dir(invalid.join("sets")).unwrap();
    run(0.1, 0);
    let left: Vec<_> = fs::read_dir(&invalid).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["sets"]);
}

/// The names beside a mesh that is not there any more would name another mesh's families.
///
/// Fails if they are left, or if a file that its owner has changed goes.
#[test]
fn names_of_an_earlier_result_go_with_it() {
    let fixture = Fixture::new();
    fixture.case("moved.msh", "moved.lb8.ugrid");
    let run = |height: f64, exit: i32| {
        fixture.write("new.csv", &profiles(&[(0, 0.3, height), (1, 1.2, height)]));
        let output = fixture.run();
        assert_eq!(output.status.code(), Some(exit), "{}", stderr(&output));
    };
    run(0.1, 0);
    let names = fixture.read("moved.mapbc");
    run(3.0, 5);
    assert!(!fixture.path("moved.mapbc").exists());
    assert_eq!(fixture.read("moved.invalid.mapbc"), names);
    run(0.1, 0);
    let changed = fixture.read("moved.mapbc").replacen("1 0 ", "1 4000 ", 1);
    fixture.write("moved.mapbc", &changed);
    run(3.0, 5);
    assert_eq!(fixture.read("moved.mapbc"), changed);
    // Another mesh has the same names beside it.
    fixture.write("moved.mapbc", &names);
    fs::write(fixture.path("moved.meshb"), "a mesh").unwrap();
    run(3.0, 5);
    assert_eq!(fixture.read("moved.mapbc"), names);
}

/// A good result, then a bad one, then a good one, then a case that cannot be read: nothing under
/// the names of a result is of another run, and the report says what the exit code says.
#[test]
fn no_result_of_another_run_is_left() {
    let fixture = Fixture::new();
    let good = profiles(&[(0, 0.3, 0.1), (1, 1.2, 0.1)]);
    fixture.case("mesh = \"moved.msh\"", "mesh = \"moved.msh\"\nhistogram = \"beta.svg\"");
    let run = || fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "report.json"]);
    let there = || {
        let names = ["moved.msh", "moved.invalid.msh", "moved.inverted.vtu", "beta.svg", "report.json"];
        names.into_iter().filter(|name| fixture.path(name).exists()).collect::<Vec<_>>()
    };
    let report = || serde_json::from_str::<serde_json::Value>(&fixture.read("report.json")).unwrap();
    for _ in 0..2 {
        fixture.write("new.csv", &good);
        assert_eq!(run().status.code(), Some(0));
        assert_eq!(there(), ["moved.msh", "beta.svg", "report.json"]);
        assert_eq!((&report()["valid"], &report()["exit"]), (&true.into(), &0.into()));
        assert!(report()["error"].is_null() && report()["converged"] == true);

        fixture.write("new.csv", &profiles(&[(0, 0.3, 3.0), (1, 1.2, 3.0)]));
        let bad = run();
        assert_eq!(bad.status.code(), Some(5));
        assert_eq!(there(), ["moved.invalid.msh", "moved.inverted.vtu", "beta.svg", "report.json"]);
        assert_eq!((&report()["valid"], &report()["exit"]), (&false.into(), &5.into()));
        let error = &report()["error"];
        for (key, start) in [("message", "error: "), ("hint", "hint: ")] {
            let line = format!("{start}{}\n", error[key].as_str().unwrap());
            assert!(stderr(&bad).contains(&line), "{line}");
        }
        assert_eq!((&error["kind"], &error["count"]), (&"inverted".into(), &report()["checks"]["inverted_tets"]));
    }
    fixture.write("new.csv", "profile,x,y,z\n0,no,number,0\n");
    assert_eq!(run().status.code(), Some(3));
    assert_eq!(there(), [] as [&str; 0]);
}

/// The invalid mesh of an earlier run may be the mesh of this one.
#[test]
fn an_invalid_mesh_that_is_read_is_kept() {
    let fixture = Fixture::new();
    fixture.write("moved.invalid.msh", &fixture.read("box.msh"));
    fixture.case("mesh = \"box.msh\"", "mesh = \"moved.invalid.msh\"");
    fixture.refuses(3, &["moved.invalid.msh would overwrite the input moved.invalid.msh"]);
    assert_eq!(fixture.read("moved.invalid.msh"), fixture.read("box.msh"));
}

/// A file that the case reads is not taken for an earlier result.
#[test]
fn an_input_is_no_earlier_result() {
    let fixture = Fixture::new();
    fixture.write("new.csv", "profile,x,y,z\n0,no,number,0\n");
    fixture.case("mesh = \"moved.msh\"", "mesh = \"moved.msh\"\nhistogram = \"new.csv\"");
    fixture.write("moved.msh", "an older result");
    assert_eq!(fixture.run().status.code(), Some(3));
    assert!(fixture.path("new.csv").exists());
}

/// The wing box with its wing prescribed by displacements.
fn prescribed(fixture: &Fixture, displacement: impl Fn([f64; 3]) -> [f64; 3]) {
    let mesh = WingBox::new();
    let row = |vertex: usize| {
        let at = mesh.vertices[vertex];
        let [x, y, z] = at;
        let [dx, dy, dz] = displacement(at);
        format!("{x},{y},{z},{dx},{dy},{dz}\n")
    };
    fixture.write("wing.csv", &mesh.family_vertices(0).into_iter().map(row).collect::<String>());
    let case = CASE.replace("[profiles.wing]\nnew = \"new.csv\"\n", "");
    let case = case.replace("role = \"wing\"\n", "role = \"prescribed\"\ndisplacement = \"wing.csv\"\n");
    fixture.write("case.toml", &case);
}

/// Runs a case that cannot be made valid; returns what it said and the inverted tets that the
/// report counts.
#[track_caller]
fn is_impossible(fixture: &Fixture) -> (String, serde_json::Value) {
    let start = Instant::now();
    let output = fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "report.json"]);
    // Well under a second where nothing else runs.
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
    let errors = stderr(&output);
    assert_eq!(output.status.code(), Some(5), "{errors}");
    let report: serde_json::Value = serde_json::from_str(&fixture.read("report.json")).unwrap();
    let inverted = &report["stages"][3]["inverted"];
    let error = errors.lines().find(|line| line.starts_with("error: ")).unwrap();
    for words in [
        &format!("error: {inverted} of "),
        "the worst tet at (",
        &format!("final {inverted};"),
        "the mesh is in moved.invalid.msh, moved.inverted.vtu",
    ] {
        assert!(error.contains(words), "\"{words}\" is not in: {error}");
    }
    assert!(errors.lines().any(|line| line.starts_with("hint: ")), "{errors}");
    assert!(!fixture.path("moved.msh").exists());
    assert!(fixture.path("moved.invalid.msh").is_file());
    (errors, report)
}

/// Tells the number of cells and points that a VTU file declares.
fn vtu_size(fixture: &Fixture, name: &str) -> (usize, usize) {
    let bytes = fs::read(fixture.path(name)).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    let number = |key: &str| text.split(key).nth(1).unwrap().split('"').nth(1).unwrap().parse().unwrap();
    (number("NumberOfCells="), number("NumberOfPoints="))
}

#[test]
fn a_wing_moved_through_the_far_side_is_told() {
    let fixture = Fixture::new();
    prescribed(&fixture, |_| [0.0, 0.0, 3.0]);
    let (errors, _) = is_impossible(&fixture);
    assert!(FAMILIES.iter().any(|family| errors.contains(&format!("near `{family}`"))), "{errors}");
    let (cells, points) = vtu_size(&fixture, "moved.inverted.vtu");
    let mesh = WingBox::new();
    assert!(cells > 0 && cells <= mesh.tets.len() && points > 0 && points <= mesh.vertices.len());
}

/// One vertex of the wing's upper side goes across the edge opposite it: one triangle lies the
/// wrong way up, and is said to.
#[test]
fn a_folded_surface_is_told_by_family() {
    let fixture = Fixture::new();
    prescribed(&fixture, |at| if at == [1.25, 0.75, 0.25] { [0.3, 0.1875, 0.0] } else { [0.0; 3] });
    let (errors, report) = is_impossible(&fixture);
    let folded = &report["families"]["wing"]["folded_triangles"];
    assert!(folded.as_u64().is_some_and(|count| count > 0), "{report}");
    let warning = format!("warning: surface triangles turned over against those around them: wing {folded}");
    assert!(errors.lines().any(|line| line == warning), "{errors}");
    assert!(errors.contains("hint: the moved surface itself is folded"), "{errors}");
    assert!(errors.contains("near `wing`"), "{errors}");
    let inverted = report["stages"][3]["inverted"].as_u64().unwrap() as usize;
    let (cells, points) = vtu_size(&fixture, "moved.inverted.vtu");
    let mesh = WingBox::new();
    assert!(cells >= inverted && cells < mesh.tets.len() && points < mesh.vertices.len(), "{cells} {points}");
}

/// One vertex of the wing's upper side goes out through the lower one. Every tet stays positive,
/// yet those above the wing and those below overlap: this once ended with exit code 0.
#[test]
fn a_wing_pushed_through_itself_is_told() {
    let fixture = Fixture::new();
    prescribed(&fixture, |at| if at == [1.25, 0.75, 0.25] { [0.02, 0.03, -0.75] } else { [0.0; 3] });
    let output = fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "-"]);
    let report: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(report["stages"][3]["inverted"], 0);
    let self_intersecting = &report["families"]["wing"]["pierced_triangles"];
    let errors = stderr(&output);
    assert_eq!(output.status.code(), Some(5), "{errors}");
    for words in [
        &format!("passes through itself (wing {self_intersecting})"),
        "first `wing` at (1",
        "moved.invalid.msh, moved.inverted.vtu",
        "hint: ",
    ] {
        assert!(errors.contains(words), "\"{words}\" is not in: {errors}");
    }
    assert_eq!(
        fixture.files(),
        ["box.msh", "case.toml", "moved.invalid.msh", "moved.inverted.vtu", "new.csv", "wing.csv"]
    );
    let (cells, _) = vtu_size(&fixture, "moved.inverted.vtu");
    assert!(cells > 0 && cells < WingBox::new().tets.len(), "{cells}");
    // Less far, it stays within the wing.
    prescribed(&fixture, |at| if at == [1.25, 0.75, 0.25] { [0.02, 0.03, -0.3] } else { [0.0; 3] });
    assert_good(&fixture.run());
}
