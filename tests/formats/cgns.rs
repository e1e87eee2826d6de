//! CGNS files: only their coordinates change, and new ones hold the mesh.

use super::*;
use crate::damage::with_checksums;

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
    assert!(message(b"text").contains("a.cgns: expected an HDF5 or ADF file"));
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
    assert!(
        replaced(b"Unstructured", b"Structured__")
            .contains("a.cgns: /gmsh.cgns/mixed_Part0: a zone of type 'Structured__' is not read")
    );
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
        (1, n + 1, format!("numbers of its elements that no other section has, found {} to ", n + 1)),
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

pub(super) fn node(name: &str, label: &str) -> hdf5_pure::GroupBuilder {
    let mut node = hdf5_pure::FileBuilder::new().create_group(name);
    node.set_attr("label", hdf5_pure::AttrValue::AsciiString(label.into()));
    node
}

/// A node with whole numbers.
pub(super) fn numbers(name: &str, label: &str, values: &[i32]) -> hdf5_pure::GroupBuilder {
    let mut node = node(name, label);
    node.create_dataset(" data").with_i32_data(values).with_shape(&[values.len() as u64]);
    node
}

pub(super) fn text(name: &str, label: &str, text: &str) -> hdf5_pure::GroupBuilder {
    let mut node = node(name, label);
    let letters: Vec<i8> = text.bytes().map(|byte| byte as i8).collect();
    node.create_dataset(" data").with_i8_data(&letters).with_shape(&[letters.len() as u64]);
    node
}

/// CGNS's numbers of elements, each with its vertices, in a mixed section: cells and faces among
/// each other.
fn mixed_elements(file: &MeshFile) -> Vec<(i32, Vec<u32>, Option<FamilyId>)> {
    let MeshFile { mesh, others, .. } = file;
    let cells = (mesh.tets.iter().map(|cell| (10, cell.to_vec(), None)))
        .chain(others.pyramids.iter().map(|cell| (12, cell.to_vec(), None)))
        .chain(others.prisms.iter().map(|cell| (14, cell.to_vec(), None)))
        .chain(others.hexahedra.iter().map(|cell| (17, cell.to_vec(), None)));
    let triangles = mesh.triangles.iter().zip(&mesh.triangle_family);
    let quadrilaterals = others.quadrilaterals.iter().zip(&others.quadrilateral_family);
    let mut faces = (triangles.map(|(face, &family)| (5, face.to_vec(), Some(family))))
        .chain(quadrilaterals.map(|(face, &family)| (7, face.to_vec(), Some(family))))
        .collect::<Vec<_>>()
        .into_iter();
    // A line is passed over.
    let mut elements = vec![(3, vec![0, 1], None)];
    for cell in cells {
        elements.extend(faces.by_ref().take(2));
        elements.push(cell);
    }
    elements.extend(faces);
    elements
}

/// The file of a mesh with one mixed section; `change` is made to its types and vertices, and to
/// its offsets.
fn mixed_section(file: &MeshFile, offsets: bool, change: impl Fn(&mut Vec<i32>, &mut Vec<i32>)) -> Vec<u8> {
    let elements = mixed_elements(file);
    let (mut connectivity, mut starts) = (Vec::new(), vec![0]);
    for (kind, vertices, _) in &elements {
        connectivity.push(*kind);
        connectivity.extend(vertices.iter().map(|&vertex| vertex as i32 + 1));
        starts.push(connectivity.len() as i32);
    }
    change(&mut connectivity, &mut starts);
    let mut section = numbers("all", "Elements_t", &[20, 0]);
    section.add_group(numbers("ElementRange", "IndexRange_t", &[1, elements.len() as i32]).finish());
    section.add_group(numbers("ElementConnectivity", "DataArray_t", &connectivity).finish());
    if offsets {
        section.add_group(numbers("ElementStartOffset", "DataArray_t", &starts).finish());
    }
    let mut conditions = node("ZoneBC", "ZoneBC_t");
    for (index, name) in file.mesh.families.iter().enumerate() {
        let is_of = |family: Option<FamilyId>| family.is_some_and(|family| family.index() == index);
        let faces: Vec<i32> = (1..).zip(&elements).filter(|(_, of)| is_of(of.2)).map(|(number, _)| number).collect();
        let mut condition = text(name, "BC_t", "FamilySpecified");
        condition.add_group(text("GridLocation", "GridLocation_t", "FaceCenter").finish());
        condition.add_group(numbers("PointList", "IndexArray_t", &faces).finish());
        conditions.add_group(condition.finish());
    }
    let mut coordinates = node("GridCoordinates", "GridCoordinates_t");
    for (axis, name) in ["CoordinateX", "CoordinateY", "CoordinateZ"].into_iter().enumerate() {
        let values: Vec<f64> = file.mesh.vertices.iter().map(|vertex| vertex[axis]).collect();
        let mut of_axis = node(name, "DataArray_t");
        of_axis.create_dataset(" data").with_f64_data(&values).with_shape(&[values.len() as u64]);
        coordinates.add_group(of_axis.finish());
    }
    let mut zone = numbers("Zone", "Zone_t", &[file.mesh.vertices.len() as i32, 4, 0]);
    zone.add_group(text("ZoneType", "ZoneType_t", "Unstructured").finish());
    for child in [coordinates, section, conditions] {
        zone.add_group(child.finish());
    }
    let mut base = numbers("Base", "CGNSBase_t", &[3, 3]);
    base.add_group(zone.finish());
    let mut hdf5 = hdf5_pure::FileBuilder::new();
    hdf5.add_group(base.finish());
    hdf5.finish().unwrap()
}

/// One cell of every shape and their faces in a section of type MIXED, as before CGNS 3.4 and
/// since.
#[test]
fn mixed_sections_hold_elements_of_every_type() {
    let reference = read_mixed(&data("mixed/gmsh.v41.ascii.msh")).unwrap();
    for offsets in [false, true] {
        let bytes = mixed_section(&reference, offsets, |_, _| ());
        let file = read_bytes("a.cgns", &bytes).unwrap();
        assert_eq!(mixed::fingerprint(&file), mixed::fingerprint(&reference));
        let families = |file: &MeshFile| {
            let faces = file.mesh.triangle_family.iter().chain(&file.others.quadrilateral_family);
            faces.map(|family| file.mesh.families[family.index()].clone()).collect::<Vec<_>>()
        };
        assert_eq!(families(&file), families(&reference));
        assert_eq!(file.mesh.vertices, reference.mesh.vertices);
        assert!(written(&file, "same.cgns", &file.mesh.vertices) == bytes);
    }
    type Change = fn(&mut Vec<i32>, &mut Vec<i32>);
    let broken: [(Change, &str); 8] = [
        (|connectivity, _| connectivity[3] = 99, "all/ElementConnectivity: expected the type of element 2, found 99"),
        (|connectivity, _| connectivity[3] = 20, "expected the type of element 2, found 20"),
        (
            |connectivity, _| connectivity[3] = 11,
            "a.cgns: /Base/Zone/all: a mesh with 1 elements of higher order is not read",
        ),
        (|connectivity, _| connectivity[4] = 13, "expected a vertex of element 2, 1 to 12, found 13"),
        (|connectivity, _| connectivity.truncate(connectivity.len() - 1), "expected a vertex of element "),
        (|connectivity, _| connectivity.extend([3, 1, 2]), "found more"),
        (
            |_, starts| starts[2] += 1,
            "all/ElementStartOffset: expected 7, where the types of the elements have element 3, found 8",
        ),
        (|_, starts| starts.truncate(starts.len() - 1), "where the types of the elements have element 20, found none"),
    ];
    for (change, expected) in broken {
        let error = read_bytes("a.cgns", &mixed_section(&reference, true, change)).unwrap_err().to_string();
        assert!(error.contains(expected), "expected: {expected}\nfound:    {error}");
    }
}

/// Nodes and types of boundary conditions that a new file does not get are told, nodes with the
/// name that the file has.
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

/// A broken file gives y the place of x, or x a place that reaches into other data. Written with
/// other coordinates, it would be another mesh.
#[test]
fn coordinates_that_share_bytes_are_refused() {
    let mesh = boxed("box.v41.ascii.msh").mesh;
    let bytes = written(&MeshFile::from_mesh(mesh.clone()), "a.cgns", &mesh.vertices);
    let [x, y] = [0, 1].map(|axis| {
        let column: Vec<u8> = mesh.vertices.iter().flat_map(|vertex| vertex[axis].to_le_bytes()).collect();
        bytes.windows(column.len()).position(|window| window == column).unwrap() as u64
    });
    assert!(with_checksums(&bytes) == bytes, "the checksums are right");
    let place = |address: u64| {
        let address = address.to_le_bytes();
        let places: Vec<_> = (0..bytes.len() - 8).filter(|&at| bytes[at..at + 8] == address).collect();
        assert_eq!(places.len(), 1, "{places:?}");
        places[0]
    };
    for other in [x, x + 8] {
        let mut broken = bytes.clone();
        broken[place(y)..][..8].copy_from_slice(&other.to_le_bytes());
        let error = read_bytes("a.cgns", &with_checksums(&broken)).unwrap_err().to_string();
        assert!(error.contains("coordinates with places of their own"), "{error}");
    }
}
