//! The measures of OpenFOAM against `checkMesh` itself, Debian's package `openfoam`.
//!
//! Where there is no `checkMesh` the tests are left out, and say so.

use std::path::Path;
use std::process::Command;

use super::*;
use idmesh::formats::{Fields, MeshFile};

/// The folder of OpenFOAM's settings in Debian.
const SETTINGS: &str = "/usr/share/openfoam";

/// Whether there is a `checkMesh`.
fn has_check_mesh() -> bool {
    let found = Command::new("checkMesh").arg("-help").env("WM_PROJECT_DIR", SETTINGS).output().is_ok();
    if !found {
        let thread = std::thread::current();
        eprintln!("SKIPPED, no checkMesh (apt-get install openfoam): {}", thread.name().unwrap_or("a test"));
    }
    found
}

/// What `checkMesh` prints of a mesh, with 15 digits.
fn check_mesh(mesh: &TetMesh, others: &OtherCells) -> String {
    let case = tempfile::tempdir().unwrap();
    let (system, constant) = (case.path().join("system"), case.path().join("constant"));
    [&system, &constant].into_iter().for_each(|folder| std::fs::create_dir(folder).unwrap());
    let head = "FoamFile { version 2.0; format ascii; class dictionary; object x; }\n";
    let control = "application simpleFoam; startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1;\n\
                   writeControl timeStep; writeInterval 1; writeFormat ascii; writePrecision 15;\n";
    for (name, text) in [
        ("controlDict", control),
        ("fvSchemes", "ddtSchemes {} gradSchemes {} divSchemes {} laplacianSchemes {}\n"),
        ("fvSolution", ""),
    ] {
        std::fs::write(system.join(name), format!("{head}{text}")).unwrap();
    }
    let file = MeshFile::from_cells(mesh.clone(), others.clone());
    file.write(&constant.join("polyMesh"), &mesh.vertices, &Fields::default()).unwrap();
    let done = Command::new("checkMesh").current_dir(&case).env("WM_PROJECT_DIR", SETTINGS).output().unwrap();
    String::from_utf8(done.stdout).unwrap()
}

/// The number after a text in the words of `checkMesh`.
fn after(words: &str, texts: &[&str]) -> Option<f64> {
    let rest = texts.iter().find_map(|text| words.split_once(text)).map(|(_, rest)| rest.trim_start())?;
    let end = rest.find(|letter: char| !"0123456789.e+-".contains(letter)).unwrap_or(rest.len());
    rest[..end].trim_end_matches('.').parse().ok()
}

/// Compares the measures of a mesh with what `checkMesh` prints.
fn compare(mesh: &TetMesh, others: &OtherCells, name: &str) -> SolverMeasures {
    let words = check_mesh(mesh, others);
    let limits = Limits::openfoam();
    let measures = measured_with(mesh, others, &limits);
    let openfoam = measures.openfoam;
    for (value, texts) in [
        (openfoam.non_orthogonality.value(), &["non-orthogonality Max:"][..]),
        (openfoam.non_orthogonality_mean, &["average:"]),
        (openfoam.skewness.value(), &["Max skewness ="]),
        (openfoam.aspect_ratio.value(), &["Max aspect ratio =", "Max aspect ratio:"]),
        (openfoam.volume[0], &["Min volume =", "Minimum negative volume:"]),
    ] {
        let theirs = after(&words, texts).unwrap_or_else(|| panic!("{name}: no {texts:?} in {words}"));
        // Without a volume `checkMesh` takes 1e-150 for it.
        let is_same = (value - theirs).abs() <= 1e-9 * theirs.abs().max(1e-3) || value.is_infinite() && theirs > 1e50;
        assert!(is_same, "{name}, {texts:?}: {value}, {theirs}");
    }
    let severe = after(&words, &["severely non-orthogonal (> 70 degrees) faces:"]).unwrap_or(0.0);
    // `checkMesh` counts faces beyond a right angle apart.
    let errors = after(&words, &["Number of non-orthogonality errors:"]).unwrap_or(0.0);
    assert_eq!(openfoam.severely_non_orthogonal as f64, severe + errors, "{name}: {words}");
    assert_eq!(openfoam.non_orthogonality.beyond as f64, errors, "{name}: {words}");
    let pyramids = after(&words, &["Error in face pyramids:"]).unwrap_or(0.0);
    assert_eq!(openfoam.pyramids.beyond as f64, pyramids, "{name}: {words}");
    // A negative volume is a fault of its own, beside those with limits.
    let is_good = limits.exceeded(&measures).is_empty() && openfoam.volume[0] > 0.0;
    assert_eq!(is_good, words.contains("Mesh OK."), "{name}: {words}");
    measures
}

/// Cells of all kinds, tets with noise, warped hexahedra, inverted tets, thin cells.
#[test]
fn measures_are_those_of_check_mesh() {
    if !has_check_mesh() {
        return;
    }
    let (mut mesh, others) = mixed();
    compare(&mesh, &others, "mixed");
    mesh.vertices.iter_mut().enumerate().for_each(|(n, at)| *at += 0.1 * common::brick::noise_vector(n));
    compare(&mesh, &others, "mixed and warped");
    let none = OtherCells::none();
    let mut mesh = meshes::brick(6);
    mesh.vertices.iter_mut().enumerate().for_each(|(n, at)| *at += 0.03 * common::brick::noise_vector(n));
    assert!(compare(&mesh, &none, "tets").openfoam.skewness.value() > 0.5);
    mesh.vertices.iter_mut().enumerate().for_each(|(n, at)| *at += 0.06 * common::brick::noise_vector(n));
    assert!(compare(&mesh, &none, "inverted tets").openfoam.pyramids.beyond > 0);
    let twist = |at: DVec3| {
        let (sin, cos) = (0.25 * at.z).sin_cos();
        DVec3::new(cos * at.x - sin * at.y, sin * at.x + cos * at.y, 0.5 * at.z)
    };
    let (mesh, others) = grid([4, 5, 6], twist);
    assert!(compare(&mesh, &others, "twisted hexahedra").openfoam.non_orthogonality.value() > 30.0);
    let (mesh, others) = grid([3, 3, 3], |at| at * DVec3::new(1.0, 1.0, 5e-4));
    assert!(compare(&mesh, &others, "thin hexahedra").openfoam.aspect_ratio.value() > 1000.0);
    let (mesh, others) = grid([2, 2, 3], |at| DVec3::new(at.x + 5.0 * at.z, at.y, at.z));
    let sheared = compare(&mesh, &others, "sheared hexahedra").openfoam;
    assert!(sheared.severely_non_orthogonal > 0 && sheared.skewness.value() > 4.0);
}

/// The example, whose mesh OpenFOAM takes.
#[test]
fn the_example_is_measured_as_check_mesh_does() {
    if !has_check_mesh() {
        return;
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/wing-body/wing-body.msh.gz");
    let file = idmesh::formats::read_mixed(&path).unwrap();
    compare(&file.mesh, &file.others, "the example");
}
