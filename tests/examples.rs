//! Runs the example programs on the example case, and checks their results.

#[path = "../examples/design_loop.rs"]
#[allow(dead_code, reason = "main is not called")]
mod design_loop;
#[path = "../examples/move_one.rs"]
#[allow(dead_code, reason = "main is not called")]
mod move_one;
#[path = "../examples/own_thread.rs"]
#[allow(dead_code, reason = "main is not called")]
mod own_thread;

use std::{fs, path::Path};

use tempfile::TempDir;

/// The example case in a folder of its own, and the path of its case file.
fn case() -> (TempDir, String) {
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/wing-body");
    let folder = tempfile::tempdir().unwrap();
    for name in ["case.toml", "wing-body.msh.gz", "old.csv", "new.csv"] {
        fs::copy(here.join(name), folder.path().join(name)).unwrap();
    }
    let path = folder.path().join("case.toml").to_string_lossy().into_owned();
    (folder, path)
}

/// A valid result goes to the outputs of the case under their own names.
#[test]
fn one_is_moved() {
    let (folder, path) = case();
    move_one::run(&path).unwrap();
    let names = ["moved.msh.gz", "moved.vtu"].map(|name| folder.path().join(name));
    assert!(names.iter().all(|path| path.is_file()));
    let moved = idmesh::formats::read(&names[0]).unwrap().mesh;
    let original = idmesh::formats::read(&folder.path().join("wing-body.msh.gz")).unwrap().mesh;
    assert_eq!(moved.tets, original.tets);
    assert_ne!(moved.vertices, original.vertices);
}

/// The displacement of the wing is linear in the displacement of its profiles. The wing has the
/// largest displacement of the mesh.
#[test]
fn a_loop_moves_in_proportion() {
    let (_folder, path) = case();
    let lifts = design_loop::run(&path).unwrap();
    let (_, first) = lifts[0];
    assert!(first > 0.009);
    for (bend, lift) in lifts {
        assert!((lift / first * 0.01 / bend - 1.0).abs() < 0.01, "{bend}: {lift}, {first} at 0.01");
    }
}

/// The example's result is valid, so its worst beta is positive. The beta of the regular tet,
/// 0.11785, is the largest of all.
#[test]
fn a_thread_moves_the_example() {
    let (_folder, path) = case();
    let worst = own_thread::run(&path).unwrap();
    assert!(worst > 0.0 && worst < 0.11785, "{worst}");
}
