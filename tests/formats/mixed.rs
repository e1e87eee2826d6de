//! Meshes with cells of every shape, as other programs write them, and what becomes of them in
//! every format.

use super::*;

/// A file of `data/mixed`, the names of its two families, and how exact its coordinates are.
struct Golden {
    name: &'static str,
    families: &'static [&'static str],
    exact: f64,
}

const fn golden(name: &'static str, families: &'static [&'static str]) -> Golden {
    Golden { name, families, exact: 1e-15 }
}

const GMSH: &[&str] = &["wing skin", "far field"];
const SU2: &[&str] = &["wing_skin", "far_field"];

/// meshio writes no references but 1.
const ONE: &[&str] = &["surface 1"];
const NUMBERS: &[&str] = &["surface 1", "surface 2"];

const FILES: &[Golden] = &[
    golden("gmsh.v41.ascii.msh", GMSH),
    golden("gmsh.v41.binary.msh", GMSH),
    golden("gmsh.v22.ascii.msh", GMSH),
    golden("gmsh.v22.binary.msh", GMSH),
    golden("gmsh.su2", SU2),
    golden("meshio.ascii.vtu", NUMBERS),
    golden("meshio.plain.vtu", NUMBERS),
    golden("meshio.zlib.vtu", NUMBERS),
    Golden { name: "meshio.single.vtu", families: NUMBERS, exact: 1e-7 },
    Golden { name: "vtk.ascii.vtu", families: NUMBERS, exact: 1e-10 },
    golden("vtk.inline.vtu", NUMBERS),
    golden("vtk.inline.zlib.vtu", NUMBERS),
    golden("vtk.raw.vtu", NUMBERS),
    golden("vtk.raw.big.vtu", NUMBERS),
    golden("vtk.raw.zlib.vtu", NUMBERS),
    golden("vtk.lz4.vtu", NUMBERS),
    golden("vtk.inline.lz4.vtu", NUMBERS),
    golden("vtk.lzma.vtu", NUMBERS),
    golden("vtk.base64.vtu", NUMBERS),
    golden("vtk.base64.zlib.vtu", NUMBERS),
    Golden { name: "vtk.pieces.ascii.vtu", families: NUMBERS, exact: 1e-7 },
    Golden { name: "vtk.pieces.raw.vtu", families: NUMBERS, exact: 1e-7 },
    Golden { name: "vtk.pieces.zlib.vtu", families: NUMBERS, exact: 1e-7 },
    golden("gmsh.ascii.vtk", NUMBERS),
    golden("gmsh.binary.vtk", NUMBERS),
    golden("meshio.ascii.vtk", NUMBERS),
    golden("meshio.binary.vtk", NUMBERS),
    golden("meshio.ugrid", ONE),
    golden("meshio.b8.ugrid", ONE),
    golden("meshio.lb8.ugrid", ONE),
    Golden { name: "meshio.b4.ugrid", families: ONE, exact: 1e-7 },
    Golden { name: "meshio.lb4.ugrid", families: ONE, exact: 1e-7 },
    golden("meshio.b8l.ugrid", ONE),
    golden("meshio.lb8l.ugrid", ONE),
    golden("records.lr8.ugrid", ONE),
    #[cfg(feature = "cgns")]
    golden("gmsh.cgns", GMSH),
    golden("meshio.mesh", NUMBERS),
    golden("meshio.meshb", NUMBERS),
    Golden { name: "vtk.ascii.vtk", families: NUMBERS, exact: 1e-10 },
    golden("vtk.binary.vtk", NUMBERS),
    golden("vtk.42.binary.vtk", NUMBERS),
];

/// Extensions of the files that meshes are converted to, and whether family names survive in them.
const TARGETS: &[(&str, bool)] = &[
    ("msh", true),
    ("su2", false),
    ("vtu", true),
    ("vtk", true),
    ("mesh", true),
    ("meshb", false),
    ("ugrid", false),
    ("b8.ugrid", false),
    ("lb8.ugrid", false),
    ("b4.ugrid", false),
    ("lb4.ugrid", false),
    ("b8l.ugrid", false),
    ("lb8l.ugrid", false),
    ("r8.ugrid", false),
    ("lr8.ugrid", false),
    ("lr4.ugrid", false),
    #[cfg(feature = "cgns")]
    ("cgns", true),
];

fn mixed(name: &str) -> PathBuf {
    data("mixed").join(name)
}

/// Everything about the mesh that its cells and faces say, whatever their order.
pub fn fingerprint(file: &MeshFile) -> Vec<Vec<Vec<String>>> {
    let MeshFile { mesh, others, .. } = file;
    vec![
        shape(mesh, &mesh.tets),
        shape(mesh, &mesh.triangles),
        shape(mesh, &others.pyramids),
        shape(mesh, &others.prisms),
        shape(mesh, &others.hexahedra),
        shape(mesh, &others.quadrilaterals),
    ]
}

fn volume(file: &MeshFile) -> f64 {
    let at = |vertex: u32| file.mesh.vertices[vertex as usize];
    file.mesh.tets.iter().chain(&file.others.tets()).map(|tet| quality::volume(tet.map(at))).sum()
}

/// The numbers of `make_mixed.py`: one cell of each shape, volume 1 + 0.5 + 0.2 + 0.1, one face on
/// the wing.
#[test]
fn every_shape_is_read_from_every_file() {
    for Golden { name, families, exact } in FILES {
        let file = read_mixed(&mixed(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        let MeshFile { mesh, others, .. } = &file;
        let counts = (mesh.vertices.len(), mesh.tets.len(), mesh.triangles.len(), others.quadrilaterals.len());
        assert_eq!(counts, (12, 1, 8, 6), "{name}");
        assert_eq!((others.pyramids.len(), others.prisms.len(), others.hexahedra.len()), (1, 1, 1), "{name}");
        assert!((volume(&file) - 1.8).abs() < 20.0 * exact, "{name}: {}", volume(&file));
        let tets = others.tets();
        let at = |vertex: u32| mesh.vertices[vertex as usize];
        let volumes: Vec<f64> = tets.iter().map(|tet| quality::volume(tet.map(at))).collect();
        assert!(volumes.iter().all(|&volume| volume > 0.01), "{name}: {volumes:?}");
        assert_eq!(mesh.families, *families, "{name}");
        if families.len() == 2 {
            assert_eq!(others.quadrilateral_family.iter().filter(|family| family.index() == 0).count(), 1, "{name}");
            let wing = others.quadrilateral_family.iter().position(|family| family.index() == 0).unwrap();
            assert!(others.quadrilaterals[wing].iter().all(|&vertex| at(vertex).x == 0.0), "{name}");
        }
        let error = read(&mixed(name)).unwrap_err();
        assert!(matches!(error, ReadError::Elements { .. }), "{name}: {error}");
        let error = error.to_string();
        assert!(error.contains("1 pyramids, 1 prisms, 1 hexahedra, 6 quadrilaterals"), "{name}: {error}");
    }
}

#[test]
fn unmoved_mixed_meshes_are_written_back_to_the_byte() {
    for Golden { name, .. } in FILES {
        let file = read_mixed(&mixed(name)).unwrap();
        let before = fs::read(mixed(name)).unwrap();
        assert!(written(&file, name, &file.mesh.vertices) == before, "{name}");
        assert!(unzipped(&written(&file, &format!("{name}.gz"), &file.mesh.vertices)) == before, "{name}");
        assert!(read_bytes(name, &zipped(&before)).is_ok(), "{name}");
    }
}

/// Moved coordinates come back to the last bit that the file can hold, and the rest of the mesh as
/// it was.
#[test]
fn moved_mixed_meshes_are_read_back() {
    for Golden { name, exact, .. } in FILES {
        let file = read_mixed(&mixed(name)).unwrap();
        let mut vertices = file.mesh.vertices.clone();
        for (index, vertex) in vertices.iter_mut().enumerate().skip(2) {
            *vertex += DVec3::new(0.1, -0.2, 1.0 / 3.0) * (index as f64).sqrt();
            if *exact > 1e-10 {
                *vertex = vertex.as_vec3().as_dvec3();
            }
        }
        let again =
            read_bytes(name, &written(&file, name, &vertices)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(again.mesh.vertices, vertices, "{name}");
        assert_eq!((again.mesh.tets, again.mesh.triangles), (file.mesh.tets, file.mesh.triangles), "{name}");
        assert!(again.others == file.others && again.mesh.families == file.mesh.families, "{name}");
    }
}

/// From every file into every format, and read again: the same mesh, to the bit where the target
/// holds doubles.
#[test]
fn conversion_keeps_mesh_and_families() {
    for Golden { name, families, exact } in FILES {
        let file = read_mixed(&mixed(name)).unwrap();
        let of_source = TARGETS.iter().filter(|(extension, _)| name.ends_with(&format!(".{extension}")));
        let of_source = of_source.map(|(extension, _)| extension.len()).max().unwrap_or(0);
        for &(extension, names) in TARGETS {
            let folder = tempfile::tempdir().unwrap();
            let target = folder.path().join(format!("converted.{extension}"));
            file.write(&target, &file.mesh.vertices, &Fields::default()).unwrap();
            let again = read_mixed(&target).unwrap_or_else(|error| panic!("{name} to {extension}: {error}"));
            let single = extension.contains("4.");
            if !single {
                assert_eq!(again.mesh.vertices, file.mesh.vertices, "{name} to {extension}");
                assert_eq!(fingerprint(&again), fingerprint(&file), "{name} to {extension}");
            }
            assert!((volume(&again) - 1.8).abs() < 20.0 * exact.max(if single { 1e-7 } else { 0.0 }));
            assert_eq!(again.mesh.families.len(), families.len(), "{name} to {extension}");
            assert_eq!(again.others.quadrilateral_family, file.others.quadrilateral_family, "{name} to {extension}");
            let losses = file.losses(&target).unwrap();
            let renamed = losses.iter().any(|loss| loss.contains("is called"))
                || losses.iter().any(|loss| loss.contains("names of families")) && !families[0].starts_with("surface");
            assert_eq!(again.mesh.families == *families, !renamed, "{name} to {extension}: {losses:?}");
            assert!(!renamed || !names, "{name} to {extension}: {losses:?}");
            if name.ends_with(&format!(".{extension}")) && extension.len() == of_source {
                assert!(losses.is_empty(), "{name} to {extension}: {losses:?}");
            }
        }
    }
}

/// The offsets that a VTU file says of its appended arrays, without their digits: they change with
/// a compressed array.
fn without_offsets(bytes: &[u8]) -> Vec<u8> {
    let marker = b"offset=\"";
    let mut kept = Vec::new();
    let mut rest = bytes;
    while let Some(at) = rest.windows(marker.len()).position(|window| window == marker) {
        let (before, after) = rest.split_at(at + marker.len());
        kept.extend_from_slice(before);
        rest = &after[after.iter().position(|&byte| byte == b'"').unwrap()..];
    }
    kept.extend_from_slice(rest);
    kept
}

/// One coordinate moves: from the first byte that differs, the bytes of one number at most may
/// differ, or those of a block of the array where it is compressed.
#[test]
fn one_moved_coordinate_changes_no_other_byte() {
    // In several pieces the coordinate stands in several places.
    for Golden { name, .. } in FILES.iter().filter(|golden| !golden.name.contains("pieces")) {
        let file = read_mixed(&mixed(name)).unwrap();
        let mut vertices = file.mesh.vertices.clone();
        vertices[6].y += 0.5;
        let (before, after) = (fs::read(mixed(name)).unwrap(), written(&file, name, &vertices));
        assert_eq!(read_bytes(name, &after).unwrap().mesh.vertices, vertices, "{name}");
        let compressed = ["zlib", "lz4", "lzma"].iter().any(|kind| name.contains(kind)) || *name == "meshio.single.vtu";
        let (before, after) =
            if compressed { (without_offsets(&before), without_offsets(&after)) } else { (before, after) };
        let same_start = before.iter().zip(&after).take_while(|(a, b)| a == b).count();
        let rest = (&before[same_start..], &after[same_start..]);
        let same_end = rest.0.iter().rev().zip(rest.1.iter().rev()).take_while(|(a, b)| a == b).count();
        let changed = rest.1.len() - same_end;
        // 96 bytes of data in a block of VTK's files, all of them in meshio's; sizes stand before
        // the blocks.
        let most = match name {
            _ if name.starts_with("meshio") && compressed => 12 * 24 / 3 * 4,
            _ if compressed => 300,
            _ if name.ends_with("base64.vtu") || name.contains("inline") || *name == "meshio.plain.vtu" => 12,
            _ => 24,
        };
        assert!((1..=most).contains(&changed), "{name}: {changed} bytes changed");
    }
}

/// What is wrong with the cells of a VTK file is said where they begin, not at the file's end.
#[test]
fn broken_cells_of_vtk_are_said_where_cells_begin() {
    let text = "# vtk DataFile Version 2.0\ntwo triangles\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 double\n0 0 0\n1 0 0\n\
                0 1 0\nCELLS 2 8\n3 0 1 2\n3 0 2 3\nCELL_TYPES 2\n5\n5\nCELL_DATA 2\nSCALARS family int 1\n\
                LOOKUP_TABLE default\n1\n1\n";
    let error = read_bytes("cells.vtk", text.as_bytes()).unwrap_err().to_string();
    assert!(error.ends_with("cells.vtk:10: expected a vertex of cell 1 below 3, found 3"), "{error}");
}
