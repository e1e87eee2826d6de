//! VTU and VTK files in which every cell has points of its own.

use super::*;

/// A mesh whose cells and faces each have points of their own, with the vertex of each point.
fn torn(mesh: &TetMesh) -> (TetMesh, Vec<u32>) {
    let mut torn = TetMesh { vertices: Vec::new(), ..mesh.clone() };
    let mut vertex_of = Vec::new();
    let of_cells = torn.tets.iter_mut().flatten();
    for vertex in of_cells.chain(torn.triangles.iter_mut().flatten()) {
        torn.vertices.push(mesh.vertices[*vertex as usize]);
        vertex_of.push(std::mem::replace(vertex, vertex_of.len() as u32));
    }
    (torn, vertex_of)
}

/// Equal points are one vertex, and a moved vertex moves in all its places.
#[test]
fn equal_points_of_torn_cells_are_one() {
    let whole = boxed("box.v41.ascii.msh").mesh;
    let (torn, vertex_of) = torn(&whole);
    for name in ["torn.vtu", "torn.vtk"] {
        let bytes = written(&MeshFile::from_mesh(torn.clone()), name, &torn.vertices);
        let file = read_bytes(name, &bytes).unwrap();
        let [warning] = file.warnings() else { panic!("{:?}", file.warnings()) };
        let counts = format!("the {} points are read as {} vertices", torn.vertices.len(), whole.vertices.len());
        assert!(warning.contains(&counts), "{warning}");
        assert_eq!(file.mesh.vertices.len(), whole.vertices.len());
        assert_eq!(shape(&file.mesh, &file.mesh.tets), shape(&whole, &whole.tets));
        assert_eq!(shape(&file.mesh, &file.mesh.triangles), shape(&whole, &whole.triangles));
        assert!(idmesh::mesh::validate(&file.mesh).is_ok());
        assert!(written(&file, name, &file.mesh.vertices) == bytes, "{name}");
        // Each vertex goes elsewhere, by its place.
        let moved = |at: DVec3| at + 0.1 * DVec3::new(at.y, at.z * at.x, 1.0 + at.x);
        let vertices: Vec<DVec3> = file.mesh.vertices.iter().copied().map(moved).collect();
        let expected: Vec<DVec3> = vertex_of.iter().map(|&vertex| moved(whole.vertices[vertex as usize])).collect();
        let expected = written(&MeshFile::from_mesh(torn.clone()), name, &expected);
        assert!(written(&file, name, &vertices) == expected, "{name}");
    }
}

/// A zero with another sign is the same place, and keeps its sign where it does not move.
#[test]
fn zeros_of_either_sign_are_one() {
    let whole = boxed("box.v41.ascii.msh").mesh;
    let (mut torn, _) = torn(&whole);
    for (index, vertex) in torn.vertices.iter_mut().enumerate().filter(|(_, vertex)| vertex.x == 0.0) {
        vertex.x = if index % 2 == 0 { 0.0 } else { -0.0 };
    }
    let bytes = written(&MeshFile::from_mesh(torn.clone()), "torn.vtu", &torn.vertices);
    let file = read_bytes("torn.vtu", &bytes).unwrap();
    assert_eq!(file.mesh.vertices.len(), whole.vertices.len());
    assert!(written(&file, "torn.vtu", &file.mesh.vertices) == bytes);
}

/// Where cells share points, equal points stay apart: a slit stays open.
#[test]
fn a_slit_stays_open() {
    // Two tets face to face, with the points of the common face twice: each side has a family.
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let vertices = [&corners[..], &corners[..], &[DVec3::Z, -DVec3::Z]].concat();
    let tets = vec![[0, 1, 2, 6], [3, 5, 4, 7]];
    let faces = |[a, b, c, d]: [u32; 4]| [[a, c, b], [a, b, d], [b, c, d], [a, d, c]];
    let triangles: Vec<[u32; 3]> = tets.iter().copied().flat_map(faces).collect();
    let triangle_family = vec![FamilyId(0); triangles.len()];
    let mesh = TetMesh { vertices, tets, triangles, triangle_family, families: vec!["slit".into()] };
    for name in ["slit.vtu", "slit.vtk"] {
        let bytes = written(&MeshFile::from_mesh(mesh.clone()), name, &mesh.vertices);
        let file = read_bytes(name, &bytes).unwrap();
        assert!(file.mesh == mesh && file.warnings().is_empty(), "{name}");
        // Torn apart, the sides of the slit cannot be told from neighbours, and the mesh is
        // refused.
        let (torn, _) = torn(&mesh);
        let bytes = written(&MeshFile::from_mesh(torn.clone()), name, &torn.vertices);
        let file = read_bytes(name, &bytes).unwrap();
        assert_eq!(file.mesh.vertices.len(), 5);
        let error = idmesh::mesh::validate(&file.mesh).unwrap_err().to_string();
        assert!(error.contains("slit") || error.contains("stands in the file twice"), "{error}");
    }
}
