//! Cells of one shape in another order of vertices than idmesh's: turned over when they are read,
//! by the shape, and as they were in the file that is written back.

use std::path::Path;

use glam::DVec3;
use idmesh::formats::{Fields, MeshFile, read_mixed};
use idmesh::quality;

use crate::mixed::fingerprint;
use crate::{data, written};

/// Formats that hold cells with their vertices. OpenFOAM holds faces, and no order.
const EXTENSIONS: &[&str] = &[
    "msh",
    "su2",
    "vtu",
    "vtk",
    "ugrid",
    "lb8.ugrid",
    "r8.ugrid",
    "mesh",
    "meshb",
    #[cfg(feature = "cgns")]
    "cgns",
];

const SHAPES: [&str; 4] = ["tets", "pyramids", "prisms", "hexahedra"];

/// A mesh of all shapes without a file, with cells of these shapes in the other order.
fn turned(shapes: &[&str]) -> MeshFile {
    let file = read_mixed(&data("mixed/gmsh.v41.ascii.msh")).unwrap();
    let mut turned = MeshFile::from_mesh(file.mesh);
    turned.others = file.others;
    if shapes.contains(&"tets") {
        turned.mesh.turn_over();
    }
    turned.others.turn_over(shapes);
    turned
}

fn betas(file: &MeshFile) -> Vec<f64> {
    let tets: Vec<[u32; 4]> = file.mesh.tets.iter().copied().chain(file.others.tets()).collect();
    quality::betas(&file.mesh.vertices, &tets)
}

/// All sets of shapes, in every format: what is read is the usual mesh, the file that is written
/// back is the same, moved too, and a new file has the usual order.
#[test]
fn shapes_in_another_order_are_turned_over() {
    let usual = turned(&[]);
    assert!(betas(&usual).iter().all(|&beta| beta > 0.0));
    let folder = tempfile::tempdir().unwrap();
    for &extension in EXTENSIONS {
        for set in 0..16 {
            let shapes: Vec<&str> = (0..4).filter(|bit| set >> bit & 1 == 1).map(|bit| SHAPES[bit]).collect();
            let what = format!("{shapes:?} in .{extension}");
            let path = folder.path().join(format!("{set}.{extension}"));
            let other = turned(&shapes);
            other.write(&path, &other.mesh.vertices, &Fields::default()).unwrap();
            let file = read_mixed(&path).unwrap();
            // VTK's wedges have either order, and SU2 has VTK's cells.
            let either = ["su2", "vtu", "vtk"].contains(&extension);
            let told: Vec<&str> = shapes.iter().copied().filter(|&shape| !either || shape != "prisms").collect();
            assert_eq!(file.left_handed, told, "{what}");
            assert_eq!(fingerprint(&file), fingerprint(&usual), "{what}");
            assert!(betas(&file).iter().all(|&beta| beta > 0.0), "{what}");

            let name = path.file_name().unwrap().to_str().unwrap();
            assert_eq!(written(&file, name, &file.mesh.vertices), std::fs::read(&path).unwrap(), "{what}");
            let moved: Vec<DVec3> = file.mesh.vertices.iter().map(|&at| at * 2.0 + DVec3::X).collect();
            file.write(&path, &moved, &Fields::default()).unwrap();
            let again = read_mixed(&path).unwrap();
            assert_eq!((&again.mesh.vertices, &again.left_handed), (&moved, &file.left_handed), "{what}");
            assert_eq!((&again.others, &again.mesh.tets), (&file.others, &file.mesh.tets), "{what}");

            let new = folder.path().join(if extension == "vtu" { "new.msh" } else { "new.vtu" });
            file.write(&new, &file.mesh.vertices, &Fields::default()).unwrap();
            let new = read_mixed(&new).unwrap();
            assert!(new.left_handed.is_empty() && betas(&new).iter().all(|&beta| beta > 0.0), "{what}");
        }
    }
}

/// A mirrored mesh of all shapes, also in OpenFOAM's files.
#[test]
fn mirrored_meshes_of_all_shapes_are_turned_over() {
    let folder = tempfile::tempdir().unwrap();
    let usual = turned(&[]);
    for &extension in EXTENSIONS.iter().chain(&["polyMesh"]) {
        let path =
            folder.path().join(if extension == "polyMesh" { extension.into() } else { format!("a.{extension}") });
        usual.write(&path, &usual.mesh.vertices, &Fields::default()).unwrap();
        let right = read_mixed(&path).unwrap();
        let mirror: Vec<DVec3> = right.mesh.vertices.iter().map(|&at| at * DVec3::new(1.0, -1.0, 1.0)).collect();
        right.write(&path, &mirror, &Fields::default()).unwrap();
        let left = read_mixed(&path).unwrap();
        let either = ["su2", "vtu", "vtk"].contains(&extension);
        let told: Vec<&str> = SHAPES.into_iter().filter(|&shape| !either || shape != "prisms").collect();
        assert_eq!(left.left_handed, told, ".{extension}");
        let [mut found, mut expected] = [betas(&left), betas(&right)];
        found.sort_by(f64::total_cmp);
        expected.sort_by(f64::total_cmp);
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-14), ".{extension}: {found:?}");
    }
}

/// A pyramid whose apex is below its base is inverted, and so are the tet on it, if the apex is so
/// deep, and a cell in another order than others of its shape.
#[test]
fn inverted_cells_are_not_turned_over() {
    let [low, deep] = [0.9, 0.6].map(|z| {
        let mut file = turned(&[]);
        file.mesh.vertices[8].z = z;
        file
    });
    let mut two = turned(&[]);
    let mut other = two.others.hexahedra[0];
    let first = two.mesh.vertices.len() as u32;
    two.mesh.vertices.extend(other.map(|vertex| two.mesh.vertices[vertex as usize] + DVec3::Y * 9.0));
    other = [0, 3, 2, 1, 4, 7, 6, 5].map(|vertex| first + vertex);
    two.others.hexahedra.push(other);
    for (file, n_inverted) in [(low, 2), (deep, 3), (two, 6)] {
        for extension in EXTENSIONS {
            let name = format!("a.{extension}");
            let folder = tempfile::tempdir().unwrap();
            let path: &Path = &folder.path().join(&name);
            file.write(path, &file.mesh.vertices, &Fields::default()).unwrap();
            let read = read_mixed(path).unwrap();
            assert!(read.left_handed.is_empty(), "{name}: {:?}", read.left_handed);
            assert_eq!(betas(&read).iter().filter(|&&beta| beta < 0.0).count(), n_inverted, "{name}");
        }
    }
}
