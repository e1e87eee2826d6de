//! Mesh files: every flavour read alike, written back unchanged, broken ones refused.

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use glam::DVec3;
use idmesh::formats::{Cells, Fields, MeshFile, ReadError, WriteError, read, write_atomically, write_vtu};
use idmesh::mesh::{FamilyId, TetMesh};
use idmesh::quality;

/// The box of `data/make_gmsh.py` in every flavour.
const BOXES: [&str; 14] = [
    "box.v41.ascii.msh",
    "box.v41.binary.msh",
    "box.v41.parametric.ascii.msh",
    "box.v41.parametric.binary.msh",
    "box.v22.ascii.msh",
    "box.v22.binary.msh",
    "box.v22.parametric.ascii.msh",
    "box.v22.parametric.binary.msh",
    "box.v41.sparse.ascii.msh",
    "box.v41.sparse.binary.msh",
    "box.v22.sparse.binary.msh",
    "box.v41.partitioned.ascii.msh",
    "box.v41.partitioned.binary.msh",
    "box.v41.partitioned.all.ascii.msh",
];

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn bytes(name: &str) -> Vec<u8> {
    fs::read(data(name)).unwrap()
}

fn boxed(name: &str) -> MeshFile {
    read(&data(name)).unwrap()
}

/// Reads these bytes as a file of that name.
fn read_bytes(name: &str, bytes: &[u8]) -> Result<MeshFile, ReadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    read(&path)
}

/// Writes the mesh with those vertices as a file of that name and returns its bytes.
fn written(mesh: &MeshFile, name: &str, vertices: &[DVec3]) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    mesh.write(&path, vertices, &Fields::default()).unwrap();
    fs::read(path).unwrap()
}

fn unzipped(bytes: &[u8]) -> Vec<u8> {
    let mut plain = Vec::new();
    flate2::read::GzDecoder::new(bytes).read_to_end(&mut plain).unwrap();
    plain
}

fn zipped(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn count(mesh: &TetMesh, family: &str) -> usize {
    let id = mesh.family(family).unwrap();
    mesh.triangle_family.iter().filter(|&&of| of == id).count()
}

/// Cells as sorted corner coordinates, to compare meshes that differ only in the order of cells and vertices.
fn shape<const N: usize>(mesh: &TetMesh, cells: &[[u32; N]]) -> Vec<Vec<String>> {
    let corner = |vertex: u32| mesh.vertices[vertex as usize].to_array().map(|x| format!("{:.12}", x + 0.0)).concat();
    let corners = |cell: &[u32; N]| {
        let mut corners = cell.map(corner).to_vec();
        corners.sort();
        corners
    };
    let mut cells: Vec<_> = cells.iter().map(corners).collect();
    cells.sort();
    cells
}

/// A box 2 x 1 x 1: volume 2, and areas 1 (x = 0), 2 + 2 + 2 + 1, 2 (z = 1) of the groups in `make_gmsh.py`.
#[test]
fn box_has_its_volume_and_areas_in_every_flavour() {
    for name in BOXES {
        let mesh = boxed(name).mesh;
        assert_eq!(mesh.families, ["far field", "wing skin", "surface 7"], "{name}");
        let at = |vertex: u32| mesh.vertices[vertex as usize];
        let volume: f64 = mesh.tets.iter().map(|tet| quality::volume(tet.map(at))).sum();
        assert!((volume - 2.0).abs() < 1e-12, "{name}: volume {volume}");
        for (family, expected) in [("wing skin", 1.0), ("far field", 7.0), ("surface 7", 2.0)] {
            let id = mesh.family(family).unwrap();
            let triangles = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|(_, of)| **of == id);
            let area: f64 = triangles
                .map(|(triangle, _)| {
                    let [a, b, c] = triangle.map(at);
                    (b - a).cross(c - a).length() / 2.0
                })
                .sum();
            assert!((area - expected).abs() < 1e-12, "{name}: area of {family} is {area}");
        }
    }
}

#[test]
fn flavours_give_the_same_mesh() {
    let first = boxed(BOXES[0]).mesh;
    for name in &BOXES[1..11] {
        let mesh = boxed(name).mesh;
        assert!(mesh.tets == first.tets && mesh.triangles == first.triangles, "{name}: cells");
        assert!(mesh.families == first.families && mesh.triangle_family == first.triangle_family, "{name}: families");
        assert_eq!(mesh.vertices.len(), first.vertices.len());
        for (a, b) in mesh.vertices.iter().zip(&first.vertices) {
            // Gmsh writes 16 digits to ascii files, so up to half a unit of the 16th is lost.
            assert!(a.abs_diff_eq(*b, 5e-16), "{name}: {a} and {b}");
        }
    }
    // Partitions come block after block: the same mesh, in another order.
    for name in &BOXES[11..] {
        let mesh = boxed(name).mesh;
        assert_eq!(shape(&mesh, &mesh.tets), shape(&first, &first.tets), "{name}: tets");
        assert_eq!(shape(&mesh, &mesh.triangles), shape(&first, &first.triangles), "{name}: triangles");
    }
}

#[test]
fn small_mesh_has_the_counts_of_its_origin() {
    let mesh = boxed("small.msh.gz").mesh;
    assert_eq!((mesh.vertices.len(), mesh.tets.len()), (1211, 5141));
    let families =
        [("wing", 691), ("trailing_edge", 90), ("wingtip", 39), ("carenage", 199), ("symmetry", 213), ("farfield", 82)];
    assert_eq!(mesh.families, families.map(|(name, _)| name));
    for (family, n_triangles) in families {
        assert_eq!(count(&mesh, family), n_triangles, "{family}");
    }
}

#[test]
fn unmoved_mesh_is_written_back_to_the_byte() {
    for name in BOXES {
        let file = boxed(name);
        assert!(written(&file, "same.msh", &file.mesh.vertices) == bytes(name), "{name} differs");
        let zipped = written(&file, "same.msh.gz", &file.mesh.vertices);
        assert!(unzipped(&zipped) == bytes(name), "{name} differs when gzipped");
    }
    let small = boxed("small.msh.gz");
    assert!(written(&small, "small.msh", &small.mesh.vertices) == unzipped(&bytes("small.msh.gz")));
}
