//! `idmesh demo` moves the mesh that is in the program.

use std::fs;
use std::path::Path;

use crate::fixture::*;

/// The result is valid, the page is there, and the words at the end name files that are there.
#[test]
fn the_first_minute() {
    let fixture = Fixture::new();
    let output = fixture.idmesh(&["demo", "mine", "--backend", "cpu"]);
    assert_good(&output);
    let text = stdout(&output);
    let next = text.split("next:\n").nth(1).unwrap();
    for file in ["mine/report.html", "mine/new/wing-4.csv", "mine/case.toml"] {
        assert!(next.contains(file) && fixture.path(file).is_file(), "{file}: {text}");
    }
    assert!(fixture.read("mine/report.html").contains("<html"));
    // The mesh has moved, and is not the one that was given.
    assert_ne!(
        fs::read(fixture.path("mine/moved.msh.gz")).unwrap(),
        fs::read(fixture.path("mine/wing-body.msh.gz")).unwrap()
    );
    // What the words advise works.
    assert_good(&fixture.idmesh(&["run", "mine/case.toml", "--backend", "cpu"]));
    assert_good(&fixture.idmesh(&["check", "mine/case.toml"]));
}

#[test]
fn nothing_is_overwritten() {
    let fixture = Fixture::new();
    fs::create_dir(fixture.path("idmesh-demo")).unwrap();
    fixture.write("idmesh-demo/case.toml", "mine");
    fixture.refuses_command(&["demo", "--backend", "cpu"], 3, &["case.toml", "is there already"]);
    assert_eq!(fixture.read("idmesh-demo/case.toml"), "mine");
    assert_good(&fixture.idmesh(&["demo", "--backend", "cpu", "--force"]));
}

/// The mesh in the program is the one of the tests, whose origin a table tells.
#[test]
fn the_mesh_is_that_of_the_tests() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let bytes = |name: &str| fs::read(root.join(name)).unwrap();
    assert_eq!(bytes("src/session/init/wing-body.msh.gz"), bytes("tests/data/small.msh.gz"));
}
