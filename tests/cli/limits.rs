//! Limits on the measures of flow solvers, in a case and for `idmesh quality`.

use serde_json::Value;

use crate::fixture::*;

/// The figures of `idmesh quality`.
fn figures(fixture: &Fixture, mesh: &str) -> Value {
    let output = fixture.idmesh(&["quality", mesh, "--json", "-"]);
    assert_good(&output);
    serde_json::from_str(&stdout(&output)).unwrap()
}

fn report(fixture: &Fixture) -> Value {
    serde_json::from_str(&fixture.read("report.json")).unwrap()
}

/// The case with a table of limits.
fn limited(fixture: &Fixture, limits: &str) {
    fixture.case("[solver]", &format!("[quality]\nlimits = {limits}\n\n[solver]"));
}

const RUN: [&str; 6] = ["run", "case.toml", "--backend", "cpu", "--json", "report.json"];

/// The report has the figures of both meshes, which `quality` has of the files.
#[test]
fn a_report_has_the_figures_of_both_meshes() {
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&RUN));
    let quality = &report(&fixture)["solver_quality"];
    assert_eq!(quality["limits"], serde_json::json!({}));
    for (mesh, file) in [("original", "box.msh"), ("moved", "moved.msh")] {
        let of_file = &figures(&fixture, file)["solver_quality"];
        for solver in ["openfoam", "su2"] {
            let (own, of_file) = (quality[mesh][solver].as_object().unwrap(), of_file[solver].as_object().unwrap());
            assert!(own.len() == 8 && own.keys().eq(of_file.keys()), "{own:?}, {of_file:?}");
            for (name, figure) in own {
                // A run turns the tets, so its sums have another order.
                let (a, b) = (figure.as_f64().unwrap(), of_file[name].as_f64().unwrap());
                assert!((a - b).abs() <= 1e-12 * a.abs(), "{mesh}, {name}: {a}, {b}");
            }
        }
    }
    assert_ne!(quality["moved"], quality["original"]);
}

/// A moved mesh that keeps its limits is good, and the table of a run shows them and no others.
#[test]
fn limits_that_are_kept_change_nothing() {
    let fixture = Fixture::new();
    assert_good(&fixture.run());
    let moved = fixture.read("moved.msh");
    limited(&fixture, "{ skewness = 100, dual_orthogonality = 1 }");
    let output = fixture.idmesh(&RUN[..4]);
    assert_good(&output);
    assert_eq!(fixture.read("moved.msh"), moved);
    let table = stdout(&output);
    let rows: Vec<&str> = table.lines().skip_while(|line| !line.starts_with("measure")).collect();
    assert_eq!(rows.len(), 3, "{table}");
    assert!(rows[1].starts_with("OpenFOAM: skewness max") && rows[1].ends_with(" 100"), "{table}");
    assert!(rows[2].starts_with("SU2: orthogonality min") && rows[2].ends_with(" 1"), "{table}");
}

/// A limit between the original and the moved mesh, and one that the original breaks too.
#[test]
fn a_mesh_beyond_a_limit_does_not_get_its_name() {
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&RUN));
    let of_good = report(&fixture);
    let skewness = |mesh: &str| of_good["solver_quality"][mesh]["openfoam"]["skewness_max"].as_f64().unwrap();
    let (original, moved) = (skewness("original"), skewness("moved"));
    assert!(original < moved, "{original}, {moved}");
    limited(&fixture, &format!("{{ skewness = {} }}", 0.5 * (original + moved)));
    let output = fixture.idmesh(&RUN);
    assert_eq!(output.status.code(), Some(5), "{}", stderr(&output));
    assert!(!fixture.path("moved.msh").exists() && fixture.path("moved.invalid.msh").exists());
    let found = report(&fixture);
    assert_eq!((&found["valid"], &found["exit"]), (&false.into(), &5.into()));
    assert_eq!(found["solver_quality"]["moved"]["openfoam"]["skewness_max"], moved);
    let error = &found["error"];
    assert_eq!(error["kind"], "beyond-limit");
    assert!(error["count"].as_u64().unwrap() >= 1 && error["place"]["at"][0].is_f64(), "{error}");
    let message = error["message"].as_str().unwrap();
    for words in ["the largest skewness is", "beyond the limit", "the worst at tet ", "near `"] {
        assert!(message.contains(words), "{message}");
    }
    assert!(!message.contains("original"), "{message}");

    limited(&fixture, &format!("{{ skewness = {} }}", 0.5 * original));
    let output = fixture.idmesh(&RUN);
    assert_eq!(output.status.code(), Some(5), "{}", stderr(&output));
    assert!(stderr(&output).contains("that of the original mesh is"), "{}", stderr(&output));
}

/// `checkMesh` has no limit on dual volumes, and passes the box.
#[test]
fn the_limits_of_openfoam_have_a_name() {
    let fixture = Fixture::new();
    limited(&fixture, "\"openfoam\"");
    assert_good(&fixture.idmesh(&RUN));
    let limits = &report(&fixture)["solver_quality"]["limits"];
    let expected = [("aspect_ratio", 1000.0), ("face_pyramids", 0.0), ("non_orthogonality", 90.0), ("skewness", 4.0)];
    let found: Vec<_> =
        limits.as_object().unwrap().iter().map(|(name, limit)| (name.as_str(), limit.as_f64().unwrap())).collect();
    assert_eq!(found, expected);
}

#[test]
fn limits_that_mean_nothing_are_refused_at_their_line() {
    let fixture = Fixture::new();
    for (limits, words) in [
        ("\"openfoam2\"", "expected `openfoam`"),
        ("70", "expected"),
        ("{ skewnes = 4 }", "did you mean `skewness`"),
        ("{ skewness = nan }", "`skewness` is NaN"),
        ("{ skewness = inf }", "`skewness` is inf"),
        ("{ skewness = -4 }", "`skewness` is -4"),
        ("{ non_orthogonality = 200 }", "expected degrees, from 0 to 180"),
        ("{ aspect_ratio = 0.5 }", "expected a number from 1 on"),
        ("{ face_pyramids = \"none\" }", "expected a number"),
    ] {
        limited(&fixture, limits);
        fixture.refuses(3, &["case.toml:19:", words]);
    }
}

/// The box is beyond a limit of 1 degree, and within those of `checkMesh`.
#[test]
fn quality_tells_of_a_mesh_beyond_limits() {
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&["quality", "box.msh", "--limits", "openfoam"]));
    let beyond = ["quality", "box.msh", "--limits", "non_orthogonality=1"];
    fixture.refuses_command(&beyond, 5, &["box.msh", "non-orthogonality", "beyond the limit 1", "the worst at tet"]);
    let both = ["quality", "box.msh", "--limits", "openfoam,non_orthogonality=1,skewness=0.001"];
    fixture.refuses_command(&both, 5, &["non-orthogonality", "skewness"]);
    for limits in ["fluent", "skewness=many", "skewness=nan", "skewnes=4", ""] {
        let output = fixture.idmesh(&["quality", "box.msh", "--limits", limits]);
        assert_eq!(output.status.code(), Some(2), "{limits}: {}", stderr(&output));
    }
}

/// A mesh in which three tets share a face has no such figures, and is measured all the same.
#[test]
fn cells_that_do_not_fit_together_are_told() {
    let fixture = Fixture::new();
    let mesh = "MeshVersionFormatted 2\nDimension 3\nVertices\n6\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 2 0\n2 2 3 0\n\
                Triangles\n1\n2 3 4 1\nTetrahedra\n3\n1 2 3 4 0\n1 2 3 5 0\n1 2 3 6 0\nEnd\n";
    fixture.write("odd.mesh", mesh);
    let found = figures(&fixture, "odd.mesh");
    assert!(found["solver_quality"].is_null(), "{found}");
    assert!(found["not_measured"].as_str().unwrap().contains("face"), "{found}");
    fixture.refuses_command(&["quality", "odd.mesh", "--limits", "openfoam"], 3, &["odd.mesh"]);
}
