//! Mesh files: every flavour read alike, written back unchanged, broken ones refused.

#[path = "formats/aflr3.rs"]
mod aflr3;
#[path = "formats/bombs.rs"]
mod bombs;
#[path = "formats/broken.rs"]
mod broken;
#[path = "formats/byte_order_mark.rs"]
mod byte_order_mark;
#[cfg(feature = "cgns")]
#[path = "formats/cgns.rs"]
mod cgns;
#[path = "formats/damage.rs"]
#[allow(dead_code, reason = "the rest is for tests/damage.rs")]
mod damage;
#[path = "formats/exponents.rs"]
mod exponents;
#[path = "formats/gmsh_names.rs"]
mod gmsh_names;
#[path = "formats/grid_cells.rs"]
mod grid_cells;
#[path = "formats/handedness.rs"]
mod handedness;
#[path = "formats/medit.rs"]
mod medit;
#[path = "formats/mixed.rs"]
mod mixed;
#[path = "formats/names.rs"]
mod names;
#[path = "formats/openfoam.rs"]
mod openfoam;
#[path = "formats/openfoam_cases.rs"]
mod openfoam_cases;
#[path = "formats/openfoam_golden.rs"]
mod openfoam_golden;
#[path = "formats/own_points.rs"]
mod own_points;
#[path = "formats/save_all.rs"]
mod save_all;
#[cfg(feature = "cgns")]
#[path = "formats/slab.rs"]
mod slab;
#[path = "formats/su2.rs"]
mod su2;
#[path = "formats/vtu.rs"]
mod vtu;
#[path = "formats/vtu_broken.rs"]
mod vtu_broken;
#[cfg(feature = "cgns")]
#[path = "formats/zones.rs"]
mod zones;

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use glam::DVec3;
use idmesh::formats::{
    self, Cells, Fields, MeshFile, ReadError, WriteError, read, read_mixed, write_atomically, write_vtu,
};
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
    formats::read_bytes(Path::new(name), bytes.to_vec())
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

/// Cells as sorted corner coordinates, to compare meshes that differ only in the order of cells and
/// vertices.
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

/// A box 2 x 1 x 1: volume 2, and areas 1 (x = 0), 2 + 2 + 2 + 1, 2 (z = 1) of the groups in
/// `make_gmsh.py`.
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

#[test]
fn one_moved_coordinate_changes_nothing_else() {
    for name in BOXES {
        let file = boxed(name);
        let mut vertices = file.mesh.vertices.clone();
        vertices[20].y += 0.1;
        let (before, after) = (bytes(name), written(&file, "moved.msh", &vertices));
        let reread = read_bytes("moved.msh", &after).unwrap().mesh;
        assert_eq!(reread.vertices, vertices, "{name}");
        assert_eq!((reread.tets, reread.triangles), (file.mesh.tets, file.mesh.triangles), "{name}");
        // From the first byte that differs, a number's bytes at most may differ.
        let same_start = before.iter().zip(&after).take_while(|(a, b)| a == b).count();
        let rest = (&before[same_start..], &after[same_start..]);
        let same_end = rest.0.iter().rev().zip(rest.1.iter().rev()).take_while(|(a, b)| a == b).count();
        let changed = rest.1.len() - same_end;
        assert!(changed <= if name.contains("binary") { 8 } else { 24 }, "{name}: {changed} bytes changed");
    }
}

/// Text that is written by several tasks, of a mesh with 22 000 vertices: line by line, only the
/// three coordinates of every third vertex differ, and they read back as they are.
#[test]
fn long_text_is_written_in_order() {
    let mesh = boxed("pitch-wing.msh.gz");
    let plain = unzipped(&bytes("pitch-wing.msh.gz"));
    assert_eq!(written(&mesh, "same.msh", &mesh.mesh.vertices), plain);
    let vertices: Vec<DVec3> =
        mesh.mesh.vertices.iter().enumerate().map(|(i, &at)| if i % 3 == 0 { at / 3.0 } else { at }).collect();
    let moved = written(&mesh, "moved.msh", &vertices);
    assert_eq!(read_bytes("moved.msh", &moved).unwrap().mesh, TetMesh { vertices, ..mesh.mesh.clone() });
    let [before, after] = [&plain, &moved].map(|text| std::str::from_utf8(text).unwrap().split('\n'));
    assert_eq!(before.clone().count(), after.clone().count());
    let first = before.clone().position(|line| line == "$Nodes").unwrap() + 2;
    for (line, (before, after)) in before.zip(after).enumerate() {
        let moves = line >= first && line < first + mesh.mesh.vertices.len() && (line - first) % 3 == 0;
        if moves {
            assert_eq!(before.split(' ').next(), after.split(' ').next(), "line {line}");
        } else {
            assert_eq!(before, after, "line {line}");
        }
    }
}

/// Coordinates with many zeros take an exponent, and read back to the bit.
#[test]
fn ascii_coordinates_survive_to_the_bit() {
    let file = boxed("box.v41.ascii.msh");
    let mut vertices = file.mesh.vertices.clone();
    let values = [1e-300, -5e-324, f64::MAX, 0.1 + 0.2, -0.0, 1e16, 123456.789, 1e-5, std::f64::consts::PI];
    for (vertex, value) in vertices.iter_mut().zip(values) {
        *vertex = DVec3::new(value, -value, value / 3.0);
    }
    let after = written(&file, "moved.msh", &vertices);
    assert!(after.len() < bytes("box.v41.ascii.msh").len() + 3 * 24 * values.len());
    for (a, b) in read_bytes("moved.msh", &after).unwrap().mesh.vertices.iter().zip(&vertices) {
        assert_eq!(a.to_array().map(f64::to_bits), b.to_array().map(f64::to_bits));
    }
}

/// Windows line ends, blank lines and comments around the sections are read, and kept.
#[test]
fn loose_text_is_read_and_kept() {
    for name in ["box.v41.ascii.msh", "box.v22.ascii.msh"] {
        let plain = String::from_utf8(bytes(name)).unwrap();
        let loose = plain.replace("$Nodes\n", "$Comments\n$ made by hand\n$EndComments\n\nfree text\n$Nodes\n\n\n");
        let loose = loose.replace(' ', "\t ").replace("an\t edge", "an edge").replace("wing\t skin", "wing skin");
        let loose = loose.replace("far\t field", "far field").replace('\n', "\r\n");
        let file = read_bytes("loose.msh", loose.as_bytes()).unwrap();
        assert!(file.mesh == boxed(name).mesh, "{name}");
        assert!(written(&file, "loose.msh", &file.mesh.vertices) == loose.as_bytes(), "{name}");
    }
}

/// Gzip is recognised by its first bytes, whatever the name says.
#[test]
fn gzip_goes_by_the_contents() {
    let plain = bytes("box.v22.ascii.msh");
    let mesh = boxed("box.v22.ascii.msh").mesh;
    for name in ["a.msh", "a.msh.gz", "A.MSH.GZ"] {
        assert!(read_bytes(name, &zipped(&plain)).unwrap().mesh == mesh, "{name}");
        assert!(read_bytes(name, &plain).unwrap().mesh == mesh, "{name}");
    }
}

/// A big-endian machine's file: every number of the little-endian one turned round.
#[test]
fn big_endian_is_read_and_written() {
    let little = bytes("box.v22.binary.msh");
    let mut big = little.clone();
    let after = |marker: &str| {
        little.windows(marker.len()).position(|window| window == marker.as_bytes()).unwrap() + marker.len()
    };
    let int = |at: usize| i32::from_le_bytes(little[at..at + 4].try_into().unwrap()) as usize;
    let line = |at: usize| {
        let length = little[at..].iter().position(|&byte| byte == b'\n').unwrap();
        (std::str::from_utf8(&little[at..at + length]).unwrap().parse::<usize>().unwrap(), at + length + 1)
    };
    big[after("2.2 1 8\n")..][..4].reverse();
    let (n_nodes, mut at) = line(after("$Nodes\n"));
    for _ in 0..n_nodes {
        for (from, size) in [(0, 4), (4, 8), (12, 8), (20, 8)] {
            big[at + from..at + from + size].reverse();
        }
        at += 28;
    }
    let (n_elements, mut at) = line(after("$Elements\n"));
    let mut n_read = 0;
    while n_read < n_elements {
        let (kind, count, n_tags) = (int(at), int(at + 4), int(at + 8));
        let n_corners = match kind {
            1 => 2,
            2 => 3,
            _ => 4,
        };
        let n_ints = 3 + count * (1 + n_tags + n_corners);
        big[at..at + 4 * n_ints].chunks_exact_mut(4).for_each(<[u8]>::reverse);
        at += 4 * n_ints;
        n_read += count;
    }
    let file = read_bytes("big.msh", &big).unwrap();
    assert!(file.mesh == boxed("box.v22.binary.msh").mesh);
    assert!(written(&file, "big.msh", &file.mesh.vertices) == big);
    let mut vertices = file.mesh.vertices.clone();
    vertices[3].x = 1.0 / 3.0;
    assert_eq!(read_bytes("big.msh", &written(&file, "big.msh", &vertices)).unwrap().mesh.vertices, vertices);
}

#[test]
fn outputs_are_checked_before_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = boxed("box.v41.binary.msh");
    for name in ["a.msh", "a.msh.gz", "a.vtu", "A.VTU"] {
        file.check_output(&folder.path().join(name)).unwrap();
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "the check left a file");
    let error = |file: &MeshFile, name: &str| file.check_output(&folder.path().join(name)).unwrap_err();
    assert!(matches!(error(&file, "a.stl"), WriteError::UnknownFormat { .. }));
    assert!(matches!(error(&file, "missing/a.msh"), WriteError::Io { .. }));
    fs::create_dir(folder.path().join("folder.msh")).unwrap();
    assert!(matches!(error(&file, "folder.msh"), WriteError::Io { .. }));
    let generated = MeshFile::from_mesh(file.mesh.clone());
    generated.check_output(&folder.path().join("a.vtu")).unwrap();
}

#[test]
fn wrong_lengths_and_bad_vertices_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = boxed("box.v41.binary.msh");
    let mut vertices = file.mesh.vertices.clone();
    for name in ["a.msh", "a.vtu"] {
        let path = folder.path().join(name);
        let error = file.write(&path, &vertices[1..], &Fields::default()).unwrap_err();
        assert!(matches!(error, WriteError::Length { what: "vertices", .. }));
        vertices[7].z = f64::NAN;
        let error = file.write(&path, &vertices, &Fields::default()).unwrap_err();
        assert!(matches!(error, WriteError::NotFinite { vertex: 7, .. }));
        vertices[7].z = 0.0;
        assert!(!path.exists());
    }
    let mut broken = file.mesh.clone();
    broken.triangles[5][1] = broken.vertices.len() as u32;
    let broken = MeshFile::from_mesh(broken);
    let error = broken.write(&folder.path().join("a.vtu"), &vertices, &Fields::default()).unwrap_err();
    assert!(matches!(error, WriteError::VertexOutOfRange { entity: "triangle", index: 5, .. }));
    let fields = Fields { beta: Some(&[1.0]), ..Fields::default() };
    let error = file.write(&folder.path().join("a.vtu"), &vertices, &fields).unwrap_err();
    assert!(matches!(error, WriteError::Length { what: "beta", found: 1, .. }));
}

#[test]
fn atomic_write_leaves_the_old_file_when_it_fails() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("result.json");
    let fail = |out: &mut dyn Write| {
        out.write_all(&[b'x'; 1 << 17])?;
        Err(std::io::Error::other("no"))
    };
    assert_eq!(write_atomically(&path, fail).unwrap_err().to_string(), "no");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "a failed write left a file");
    write_atomically(&path, |out| out.write_all(b"old")).unwrap();
    write_atomically(&path, fail).unwrap_err();
    assert_eq!(fs::read(&path).unwrap(), b"old");
    write_atomically(&path, |out| out.write_all(b"new")).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// Results are for others to read as well: the permissions of any new file, not those of a
/// temporary one.
#[cfg(unix)]
#[test]
fn written_files_have_usual_permissions_and_links_stay() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let [usual, atomic, link] = ["usual", "atomic", "link"].map(|name| folder.path().join(name));
    fs::write(&usual, "").unwrap();
    write_atomically(&atomic, |_| Ok(())).unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&atomic), mode(&usual));
    symlink(&usual, &link).unwrap();
    write_atomically(&link, |out| out.write_all(b"through the link")).unwrap();
    assert_eq!(fs::read(&usual).unwrap(), b"through the link");
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    write_atomically(Path::new("/dev/null"), |out| out.write_all(b"nothing")).unwrap();
}
