//! `idmesh check` finds what a run would refuse, and touches nothing.

use crate::fixture::*;

#[test]
fn a_good_case_is_described() {
    let fixture = Fixture::new();
    fixture.write("moved.msh", "an earlier result");
    let before = fixture.files();
    let output = fixture.idmesh(&["check", "case.toml"]);
    assert_good(&output);
    let text = stdout(&output);
    for words in
        ["family", "wing", "trailing-edge", "new profiles", "reads   box.msh", "reads   new.csv", "writes  moved.msh"]
    {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert!(stderr(&output).contains("no fault was found"), "{}", stderr(&output));
    assert_eq!(fixture.files(), before);
    assert_eq!(fixture.read("moved.msh"), "an earlier result");
}

/// Faults of the case, of a file, of an output, of the set-up and of the new profiles: each as
/// `run` tells it, and nothing of an earlier result is removed.
///
/// Fails if the outputs, the set-up or the design are not checked.
#[test]
fn what_a_run_refuses_is_refused() {
    let other = |from: &str, to: &str| {
        let fixture = Fixture::new();
        fixture.write("case.toml", &CASE.replacen(from, to, 1));
        fixture
    };
    let elsewhere = other("new = \"new.csv\"", "new = \"new.csv\"\nold = \"old.csv\"");
    elsewhere.write("old.csv", &profiles(&[(0, 0.3, 9.0), (1, 1.2, 9.0)]));
    let far = Fixture::new();
    far.write("new.csv", &profiles(&[(0, 0.3, 0.05), (1, 1.2, 1e4)]));
    for (fixture, name) in [
        (other("role = \"wing\"", "role = \"wnig\""), "role"),
        (other("box.msh", "gone.msh"), "mesh"),
        (other("moved.msh", "gone/moved.msh"), "output"),
        // Where no file can be made.
        (other("moved.msh", "/proc/moved.msh"), "output in /proc"),
        (elsewhere, "set-up"),
        (far, "design"),
    ] {
        fixture.write("moved.msh", "an earlier result");
        let before = fixture.files();
        let checked = fixture.idmesh(&["check", "case.toml"]);
        assert_eq!(checked.status.code(), Some(3), "{name}: {}", stderr(&checked));
        assert_eq!((stdout(&checked), fixture.files()), (String::new(), before), "{name}");
        let told = |errors: String| errors.lines().find(|line| line.starts_with("error: ")).unwrap().to_owned();
        let run = fixture.idmesh(&["run", "case.toml", "--backend", "cpu"]);
        let (checked, run) = (told(stderr(&checked)), told(stderr(&run)));
        assert!(run.starts_with(&checked), "{name}: {checked}, {run}");
    }
}
