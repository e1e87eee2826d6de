//! The tutorial with OpenFOAM. Where there is no `simpleFoam` the test is left out, and says so.

use std::path::Path;
use std::process::Command;

use crate::fixture::{stderr, stdout, without_gpu};

/// The script's words: `checkMesh` passes both meshes, and the flow that goes on begins with a
/// smaller residual than the fresh one.
///
/// Fails if the restart takes the fields of time 0.
#[test]
fn a_flow_goes_on_over_the_moved_mesh() {
    if Command::new("simpleFoam").arg("-help").output().is_err() {
        return eprintln!("SKIPPED, no simpleFoam (apt-get install openfoam): a_flow_goes_on_over_the_moved_mesh");
    }
    let folder = tempfile::tempdir().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/openfoam/restart.sh");
    let mut command = Command::new("sh");
    command.arg(script).arg(folder.path().join("flow"));
    command.env("IDMESH", env!("CARGO_BIN_EXE_idmesh")).env("BACKEND", "cpu").env("ITERATIONS", "15");
    let output = without_gpu(&mut command).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}{}", stdout(&output), stderr(&output));
    let words = stdout(&output);
    assert_eq!(words.matches("Mesh OK.").count(), 2, "{words}");
    let last = words.lines().last().unwrap();
    let figures: Vec<f64> = last.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [afresh, again] = figures[..] else { panic!("{words}") };
    assert!(0.0 < again && again < 0.5 * afresh, "{words}");
    // The report has the words of `checkMesh`.
    let report = std::fs::read(folder.path().join("flow/report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    for (mesh, log) in [("original", "old"), ("moved", "new")] {
        let log = std::fs::read_to_string(folder.path().join(format!("flow/{log}/log.checkMesh"))).unwrap();
        let (_, rest) = log.split_once("non-orthogonality Max: ").unwrap();
        let theirs: f64 = rest.split_whitespace().next().unwrap().parse().unwrap();
        let own = report["solver_quality"][mesh]["openfoam"]["non_orthogonality_max"].as_f64().unwrap();
        assert!((own - theirs).abs() < 1e-9 * theirs, "{mesh}: {own}, {theirs}");
    }
}
