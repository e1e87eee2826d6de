//! Meshes with cells of every shape, as other programs write them, and what becomes of them in every format.

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
    golden("vtk.base64.vtu", NUMBERS),
    golden("vtk.base64.zlib.vtu", NUMBERS),
    golden("gmsh.ascii.vtk", NUMBERS),
    golden("gmsh.binary.vtk", NUMBERS),
    golden("meshio.ascii.vtk", NUMBERS),
    golden("meshio.binary.vtk", NUMBERS),
    Golden { name: "vtk.ascii.vtk", families: NUMBERS, exact: 1e-10 },
    golden("vtk.binary.vtk", NUMBERS),
    golden("vtk.42.binary.vtk", NUMBERS),
];

/// Extensions of the files that meshes are converted to, and whether family names survive in them.
const TARGETS: &[(&str, bool)] = &[("msh", true), ("su2", false), ("vtu", true), ("vtk", true)];

fn mixed(name: &str) -> PathBuf {
    data("mixed").join(name)
}

/// Everything about the mesh that its cells and faces say, whatever their order.
fn fingerprint(file: &MeshFile) -> Vec<Vec<Vec<String>>> {
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

/// The numbers of `make_mixed.py`: one cell of each shape, volume 1 + 0.5 + 0.2 + 0.1, one face on the wing.
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

/// Moved coordinates come back to the last bit that the file can hold, and the rest of the mesh as it was.
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

/// From every file into every format, and read again: the same mesh, to the bit.
#[test]
fn conversion_keeps_mesh_and_families() {
    for Golden { name, families, exact } in FILES {
        let file = read_mixed(&mixed(name)).unwrap();
        for &(extension, names) in TARGETS {
            let target = format!("converted.{extension}");
            let same_format = name.ends_with(&format!(".{extension}"));
            let bytes = written(&file, &target, &file.mesh.vertices);
            let again = read_bytes(&target, &bytes).unwrap_or_else(|error| panic!("{name} to {target}: {error}"));
            if !target.contains("b4") {
                assert_eq!(again.mesh.vertices, file.mesh.vertices, "{name} to {target}");
            }
            assert!((volume(&again) - 1.8).abs() < 20.0 * exact.max(if target.contains("b4") { 1e-7 } else { 0.0 }));
            if !target.contains("b4") {
                assert_eq!(fingerprint(&again), fingerprint(&file), "{name} to {target}");
            }
            assert_eq!(again.mesh.families.len(), families.len(), "{name} to {target}");
            assert_eq!(again.others.quadrilateral_family, file.others.quadrilateral_family, "{name} to {target}");
            let losses = file.losses(Path::new(&target)).unwrap();
            let renamed = losses.iter().any(|loss| loss.contains("is called"));
            assert_eq!(again.mesh.families == *families, !renamed, "{name} to {target}: {losses:?}");
            assert!(!renamed || !names, "{name} to {target}: {losses:?}");
            assert!(!same_format || losses.is_empty(), "{name} to {target}: {losses:?}");
        }
    }
}
