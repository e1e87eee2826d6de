//! CGNS files: only their coordinates change.

use super::*;

#[test]
fn only_coordinates_change() {
    let path = data("mixed/gmsh.cgns");
    let file = read_mixed(&path).unwrap();
    let before = fs::read(&path).unwrap();
    let mut vertices = file.mesh.vertices.clone();
    vertices[5].z = 0.7;
    let after = written(&file, "moved.cgns", &vertices);
    assert_eq!(before.len(), after.len());
    let changed = before.iter().zip(&after).filter(|(a, b)| a != b).count();
    assert!((1..=8).contains(&changed), "{changed} bytes changed");
    assert_eq!(read_bytes("moved.cgns", &after).unwrap().mesh.vertices, vertices);
    let error = boxed("box.v41.ascii.msh").check_output(Path::new("a.cgns")).unwrap_err().to_string();
    assert!(error.contains("CGNS files are only written back into the CGNS file that was read"), "{error}");
}

#[test]
fn other_files_are_refused() {
    let message = |bytes: &[u8]| read_bytes("a.cgns", bytes).unwrap_err().to_string();
    assert!(
        message(b"@(#)ADF Database Version A02011>").contains("CGNS in ADF is not read; turn it into HDF5: adf2hdf")
    );
    assert!(message(b"text").contains("a.cgns: byte 0: expected an HDF5 file"));
    let bytes = fs::read(data("mixed/gmsh.cgns")).unwrap();
    for length in (0..bytes.len() - 8).step_by(997) {
        assert!(read_bytes("a.cgns", &bytes[..length]).is_err(), "cut to {length} bytes");
    }
    // A structured zone, a vertex that is not there, polyhedra, two zones.
    let replaced = |from: &[u8], to: &[u8]| {
        let at = bytes.windows(from.len()).position(|window| window == from).unwrap();
        let mut broken = bytes.clone();
        broken[at..at + to.len()].copy_from_slice(to);
        message(&broken)
    };
    assert!(replaced(b"Unstructured", b"Structured__").contains("a structured zone is not read"));
    let tet = [5i32, 7, 10, 12].map(i32::to_le_bytes).concat();
    let wrong = [5i32, 7, 10, 13].map(i32::to_le_bytes).concat();
    let error = replaced(&tet, &wrong);
    assert!(error.contains("expected a vertex of element 15 in '5_V_1', 1 to 12, found 13"), "{error}");
}
