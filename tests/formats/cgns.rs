//! CGNS files: only their coordinates change, and new ones hold the mesh.

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
}

/// Names that no node can have are kept in full beside.
#[test]
fn new_files_keep_every_name() {
    let mut mesh = boxed("box.v41.ascii.msh").mesh;
    let long = "a name of more than thirty-two letters, and more";
    mesh.families = ["Zone", "wing/skin", long].map(str::to_owned).to_vec();
    let file = MeshFile::from_mesh(mesh.clone());
    let again = read_bytes("a.cgns", &written(&file, "a.cgns", &mesh.vertices)).unwrap();
    assert_eq!((&again.mesh.vertices, &again.mesh.tets), (&mesh.vertices, &mesh.tets));
    assert_eq!(again.mesh.families, mesh.families);
    for family in 0..3 {
        let of = |mesh: &TetMesh| {
            let all = mesh.triangles.iter().zip(&mesh.triangle_family);
            all.filter(|(_, of)| of.index() == family).map(|(&triangle, _)| triangle).collect::<Vec<_>>()
        };
        assert_eq!(of(&again.mesh), of(&mesh), "family {family}");
    }
}

#[test]
fn other_files_are_refused() {
    let message = |bytes: &[u8]| read_bytes("a.cgns", bytes).unwrap_err().to_string();
    assert!(
        message(b"@(#)ADF Database Version A02011>").contains("CGNS in ADF is not read; turn it into HDF5: adf2hdf")
    );
    assert!(message(b"text").contains("a.cgns: expected an HDF5 file"));
    let bytes = fs::read(data("mixed/gmsh.cgns")).unwrap();
    for length in (1..bytes.len()).step_by(997).chain([bytes.len() - 1]) {
        let error = message(&bytes[..length]);
        let cut = format!("byte {length}: the file ends where the rest of its 40158 bytes should stand");
        assert!(error.ends_with(&cut) || length < 100, "{error}");
    }
    // A structured zone, a vertex that is not there.
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
    assert!(error.contains("a.cgns: /gmsh.cgns/mixed_Part0/5_V_1/ElementConnectivity: expected a vertex of element 15, 1 to 12, found 13"), "{error}");
}

/// A section that says of its elements what its connectivity does not hold.
#[test]
fn sections_hold_what_they_say() {
    let mesh = boxed("box.v41.ascii.msh").mesh;
    let (file, n) = (MeshFile::from_mesh(mesh.clone()), mesh.tets.len() as i32);
    let bytes = written(&file, "a.cgns", &mesh.vertices);
    let said = [1, n].map(i32::to_le_bytes).concat();
    let at = bytes.windows(8).position(|window| window == said).unwrap();
    for (first, last, words) in [
        (1, n - 1, format!("tets/ElementConnectivity: expected the elements 1 to {}, found more", n - 1)),
        (1, n + 1, format!("tets/ElementConnectivity: expected the elements 1 to {}, found fewer", n + 1)),
        (0, n, format!("/Base/Zone/tets/ElementRange: expected a range that ascends from 1 or more, found 0 to {n}")),
        (5, 4, "found 5 to 4".to_owned()),
        (i32::MAX, i32::MIN, "that ascends".to_owned()),
    ] {
        let mut broken = bytes.clone();
        broken[at..at + 8].copy_from_slice(&[first, last].map(i32::to_le_bytes).concat());
        let error = read_bytes("a.cgns", &broken).unwrap_err().to_string();
        assert!(error.contains(&words), "{error}");
    }
}

fn node(name: &str, label: &str) -> hdf5_pure::GroupBuilder {
    let mut node = hdf5_pure::FileBuilder::new().create_group(name);
    node.set_attr("label", hdf5_pure::AttrValue::AsciiString(label.into()));
    node
}

#[test]
fn several_zones_are_refused() {
    let mut file = hdf5_pure::FileBuilder::new();
    let mut base = node("Base", "CGNSBase_t");
    for zone in ["wing", "tail"] {
        base.add_group(node(zone, "Zone_t").finish());
    }
    file.add_group(base.finish());
    let error = read_bytes("a.cgns", &file.finish().unwrap()).unwrap_err().to_string();
    assert!(
        error.ends_with("a.cgns: CGNS with 2 zones is not read; merge them into one in which they share vertices"),
        "{error}"
    );
}

/// Nodes and types of boundary conditions that a new file does not get are told, nodes with the name that the file has.
#[test]
fn what_a_new_file_loses_is_told() {
    let losses = |bytes: &[u8]| read_bytes("a.cgns", bytes).unwrap().losses(Path::new("a.vtu")).unwrap();
    let bytes = fs::read(data("mixed/gmsh.cgns")).unwrap();
    assert_eq!(losses(&bytes), ["the node 'About': not carried into the new file"]);
    let mesh = boxed("box.v41.ascii.msh").mesh;
    let mut bytes = written(&MeshFile::from_mesh(mesh.clone()), "a.cgns", &mesh.vertices);
    assert!(losses(&bytes).is_empty());
    let (from, to) = (b"FamilySpecified", b"BCWallViscous\0\0");
    let at = bytes.windows(from.len()).position(|window| window == from).unwrap();
    bytes[at..at + to.len()].copy_from_slice(to);
    assert_eq!(losses(&bytes), ["types of boundary conditions (BCWallViscous): not carried into the new file"]);
}
