//! CGNS files as h5py and the CGNS library wrote them (`data/make_cgns.py`): a slab of 2 x 1 x 1/3,
//! its face z = 0 the wing.

use super::*;
use crate::damage::with_checksums;

fn slab(kind: &str) -> (Vec<u8>, MeshFile) {
    let name = format!("slab.{kind}.cgns");
    let file = read(&data(&name)).unwrap_or_else(|error| panic!("{error}"));
    (bytes(&name), file)
}

fn area(mesh: &TetMesh, family: &str) -> f64 {
    let id = mesh.family(family).unwrap_or_else(|| panic!("no {family} in {:?}", mesh.families));
    let corner = |vertex: u32| mesh.vertices[vertex as usize];
    let of_family = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|(_, of)| **of == id);
    let areas = of_family.map(|(face, _)| {
        let [a, b, c] = face.map(corner);
        0.5 * (b - a).cross(c - a).length()
    });
    areas.sum()
}

/// The slab's volume, its number of vertices, and the areas of its families.
fn assert_is_slab(kind: &str, mesh: &TetMesh, areas: &[(&str, f64)]) {
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    let volume: f64 = mesh.tets.iter().map(|tet| quality::volume(tet.map(at))).sum();
    assert!((volume.abs() - 2.0 / 3.0).abs() < 1e-12, "{kind}: volume {volume}");
    assert_eq!((mesh.vertices.len(), mesh.tets.len(), mesh.triangles.len()), (12, 12, 20), "{kind}");
    assert_eq!(mesh.families.len(), areas.len(), "{kind}: {:?}", mesh.families);
    for (family, expected) in areas {
        let found = area(mesh, family);
        assert!((found - expected).abs() < 1e-12, "{kind}: {family} has the area {found}");
    }
    idmesh::mesh::validate(mesh).unwrap_or_else(|error| panic!("{kind}: {error:?}"));
}

const AREAS: [(&str, f64); 2] = [("wing", 2.0), ("far", 4.0)];

fn moved(vertices: &[DVec3]) -> Vec<DVec3> {
    let place = |(index, at): (usize, &DVec3)| *at + DVec3::new(1e-3, 0.1, -0.02) * (index + 1) as f64;
    vertices.iter().enumerate().map(place).collect()
}

/// Written back where it is, the file is the same; moved, it is the same mesh elsewhere.
fn assert_is_written_back(kind: &str, before: &[u8], file: &MeshFile) -> Vec<u8> {
    assert!(written(file, "same.cgns", &file.mesh.vertices) == before, "{kind}: written back differently");
    let vertices = moved(&file.mesh.vertices);
    let after = written(file, "moved.cgns", &vertices);
    let again = read_bytes("moved.cgns", &after).unwrap_or_else(|error| panic!("{kind}: {error}"));
    assert_eq!(again.mesh.vertices, vertices, "{kind}");
    let expected = TetMesh { vertices, ..file.mesh.clone() };
    assert!(again.mesh.tets == expected.tets && again.mesh.triangles == expected.triangles, "{kind}");
    assert_eq!(again.mesh.triangle_family, expected.triangle_family, "{kind}");
    assert_eq!(again.mesh.families, expected.families, "{kind}");
    after
}

/// Offsets of the bytes that differ.
fn differences(a: &[u8], b: &[u8]) -> Vec<usize> {
    assert_eq!(a.len(), b.len());
    (0..a.len()).filter(|&at| a[at] != b[at]).collect()
}

/// Three coordinates of twelve vertices of eight bytes.
const COORDINATES: usize = 3 * 12 * 8;

#[test]
fn files_of_the_library_are_read_and_written() {
    for kind in ["plain", "library"] {
        let (before, file) = slab(kind);
        assert_is_slab(kind, &file.mesh, &AREAS);
        assert!(file.remarks().is_empty(), "{:?}", file.remarks());
        let after = assert_is_written_back(kind, &before, &file);
        let changed = differences(&before, &after);
        assert!(changed.len() <= COORDINATES && changed.len() >= COORDINATES / 2, "{kind}: {} bytes", changed.len());
    }
}

/// Conditions on vertices and on edges beside those on faces are passed over, and that is told.
#[test]
fn conditions_beside_those_on_faces_are_passed_over_with_a_remark() {
    let (before, file) = slab("beside");
    assert_is_slab("beside", &file.mesh, &AREAS);
    assert_eq!(
        file.remarks(),
        [
            "/Base/Slab/ZoneBC/edges: a boundary condition on edges is passed over",
            "/Base/Slab/ZoneBC/nodes: a boundary condition on vertices, beside those on faces, is passed over",
        ]
    );
    assert_is_written_back("beside", &before, &file);
}

/// Where there are only conditions on vertices, they have the faces between their vertices.
#[test]
fn conditions_on_vertices_have_the_faces_between_them() {
    let (before, file) = slab("vertices");
    let third = 1.0 / 3.0;
    assert_is_slab("vertices", &file.mesh, &[("inflow", third), ("outflow", third), ("skin", 6.0 - 2.0 * third)]);
    let what =
        "16 faces have no boundary condition that holds all their vertices: their family is 'skin', as their section";
    assert_eq!(file.remarks(), [what]);
    assert_is_written_back("vertices", &before, &file);
}

/// All vertices of the wing are also vertices of its neighbour.
#[test]
fn faces_between_the_vertices_of_two_conditions_are_refused() {
    let error = read(&data("slab.ambiguous.cgns")).unwrap_err().to_string();
    assert!(error.contains("slab.ambiguous.cgns: /Base/Slab/ZoneBC/wing: expected faces all of whose vertices no other condition holds, found the face at ["), "{error}");
    assert!(error.contains("whose vertices 'far' holds too"), "{error}");
}

/// The numbers of a condition without a place are vertices, and there are no more of those.
#[test]
fn vertices_of_conditions_exist() {
    let bytes = bytes("slab.vertices.cgns");
    let outflow = [9i32, 10, 11, 12].map(i32::to_le_bytes).concat();
    let at = bytes.windows(outflow.len()).position(|window| window == outflow).unwrap();
    for wrong in [0, 13, i32::MIN] {
        let mut broken = bytes.clone();
        broken[at..at + 4].copy_from_slice(&wrong.to_le_bytes());
        let error = read_bytes("a.cgns", &broken).unwrap_err().to_string();
        let expected = format!(
            "/Base/Slab/ZoneBC/outflow: expected vertices of a condition, 1 to 12 (is it on faces, without a GridLocation?), found {wrong}"
        );
        assert!(error.ends_with(&expected), "{error}");
    }
}

/// Chunks that are not packed are written in their places.
#[test]
fn coordinates_in_chunks_are_written_in_their_places() {
    let (before, file) = slab("chunked");
    assert_is_slab("chunked", &file.mesh, &AREAS);
    let after = assert_is_written_back("chunked", &before, &file);
    let changed = differences(&before, &after);
    assert!(changed.len() <= COORDINATES && changed.len() >= COORDINATES / 2, "{} bytes", changed.len());
    assert!(file.losses(Path::new("a.cgns")).unwrap().is_empty());
}

/// Packed coordinates are written unpacked, behind everything else, and the file says so in a few
/// bytes of its headers.
#[test]
fn packed_coordinates_are_written_unpacked() {
    for kind in ["gzip", "latest"] {
        let (before, file) = slab(kind);
        assert_is_slab(kind, &file.mesh, &AREAS);
        let after = assert_is_written_back(kind, &before, &file);
        let length = before.len().next_multiple_of(8) + COORDINATES;
        assert_eq!(after.len(), length, "{kind}");
        let changed = differences(&before, &after[..before.len()]);
        // An address and a size for each axis, a filter less, and the end of the file. In new files
        // the messages of three headers move, and have checksums.
        assert!(changed.len() < if kind == "gzip" { 100 } else { 500 }, "{kind}: {} bytes", changed.len());
        let again = read_bytes("a.cgns", &after).unwrap();
        assert!(again.losses(Path::new("b.cgns")).unwrap().is_empty(), "{kind}");
        let told = ["coordinates: packed in the file that was read, and not where they move"];
        assert_eq!(file.losses(Path::new("a.cgns")).unwrap(), told, "{kind}");
        // Only what moves is unpacked.
        let mut vertices = file.mesh.vertices.clone();
        vertices[3].y = 0.7;
        assert_eq!(written(&file, "b.cgns", &vertices).len(), length - COORDINATES / 3 * 2, "{kind}");
    }
}

/// Coordinates in the headers of their arrays, which have checksums.
#[test]
fn coordinates_in_headers_are_written_there() {
    let (before, file) = slab("compact");
    assert_is_slab("compact", &file.mesh, &AREAS);
    let after = assert_is_written_back("compact", &before, &file);
    assert!(with_checksums(&after) == after, "the checksums are right");
    let changed = differences(&before, &after);
    let most = COORDINATES + 3 * 4;
    assert!(changed.len() <= most && changed.len() >= COORDINATES / 2, "{} bytes", changed.len());
}

/// A chunk that is damaged, or unpacks to more than it holds, is no chunk.
#[test]
fn broken_chunks_are_refused() {
    let bytes = bytes("slab.gzip.cgns");
    // zlib's first bytes at level 4, as h5py packs.
    let chunks: Vec<usize> = (0..bytes.len() - 1).filter(|&at| bytes[at..at + 2] == [0x78, 0x5e]).collect();
    assert!(chunks.len() > 9, "{}", chunks.len());
    for chunk in chunks {
        let mut broken = bytes.clone();
        broken[chunk + 5] ^= 0x10;
        let error = read_bytes("a.cgns", &broken).unwrap_err().to_string();
        assert!(error.contains("expected data in chunks, found a broken chunk at ["), "{error}");
    }
}
