//! Reads a damaged file; what is a mesh is moved, written and read again.

use std::cell::OnceCell;
use std::fs;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use idmesh::formats::{self, Fields, MeshFile, ReadError, WriteError};
use idmesh::mesh::{FamilyId, OtherCells};
use tempfile::TempDir;

/// The formats into which meshes are converted. Those with a slash or a companion need a folder.
const TARGETS: &[&str] = &[
    "b.msh",
    "b.su2",
    "b.vtu",
    "b.vtk",
    "b.mesh",
    "b.meshb",
    "b.ugrid",
    "b.b4.ugrid",
    "b.lr8.ugrid",
    "b.lb8l.ugrid",
    "polyMesh",
    #[cfg(feature = "cgns")]
    "b.cgns",
];

thread_local! {
    /// A folder for meshes that are more than one file.
    static FOLDER: OnceCell<TempDir> = const { OnceCell::new() };
}

/// The golden files. The package of the fuzzers is a folder further down.
pub fn data() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = [root.join("tests/data"), root.join("../tests/data")];
    folders.into_iter().find(|folder| folder.exists()).unwrap()
}

fn in_folder<T>(work: impl FnOnce(&Path) -> T) -> T {
    FOLDER.with(|folder| work(folder.get_or_init(|| tempfile::tempdir().unwrap()).path()))
}

/// Reads damaged bytes. If that gives a mesh, it must be written back as it was; and moved, it must
/// be read again as it was written, in its own format and in another one. Returns whether it gave a
/// mesh.
///
/// - `name`: the name of a mesh file; `names.mapbc`; or a file of an OpenFOAM mesh after the golden
///   folder of the others, such as `foam.ascii/owner`
pub fn survives(name: &str, bytes: &[u8]) -> bool {
    match name.split_once('/') {
        Some((folder, file)) => in_folder(|at| polymesh(at, folder, file, bytes)),
        None if name.ends_with(".mapbc") => in_folder(|at| mapbc(at, bytes)),
        None => one_file(name, bytes),
    }
}

fn one_file(name: &str, bytes: &[u8]) -> bool {
    let again = |bytes: &[u8]| formats::read_bytes(Path::new(name), bytes.to_vec());
    let Ok(file) = again(bytes) else { return false };
    let back = written(&file, name, &file.mesh.vertices).unwrap();
    assert!(bytes.starts_with(&[0x1f, 0x8b]) || back == bytes, "{name}: written back differently");
    let vertices = moved(&file.mesh.vertices);
    let back = again(&written(&file, name, &vertices).unwrap());
    assert_same_in_place(name, &file, &vertices, back);
    convert(name, &file, &vertices, bytes.len());
    true
}

/// An OpenFOAM mesh in which one file is damaged.
fn polymesh(at: &Path, golden: &str, name: &str, bytes: &[u8]) -> bool {
    let golden_files = data().join("mixed").join(golden).join("constant/polyMesh");
    let source = at.join(golden);
    if !source.exists() {
        fs::create_dir(&source).unwrap();
    }
    for file in ["points", "faces", "owner", "neighbour", "boundary"] {
        let contents = fs::read(golden_files.join(file)).unwrap();
        fs::write(source.join(file), if file == name { bytes } else { &contents }).unwrap();
    }
    let Ok(file) = formats::read_mixed(&source.join("points")) else { return false };
    let vertices = moved(&file.mesh.vertices);
    let target = at.join("polyMesh");
    file.write(&target, &vertices, &Fields::default()).unwrap();
    assert_same_in_place(golden, &file, &vertices, formats::read_mixed(&target));
    convert(name, &file, &vertices, bytes.len());
    true
}

/// A mesh whose file of names is damaged.
fn mapbc(at: &Path, bytes: &[u8]) -> bool {
    let [source, target] = ["named.mesh", "moved.mesh"].map(|name| at.join(name));
    fs::copy(data().join("mixed/meshio.mesh"), &source).unwrap();
    fs::write(at.join("named.mapbc"), bytes).unwrap();
    let Ok(file) = formats::read_mixed(&source) else { return false };
    let vertices = moved(&file.mesh.vertices);
    clean(at, "moved.mapbc");
    file.write(&target, &vertices, &Fields::default()).unwrap();
    assert_same_in_place("named.mesh", &file, &vertices, formats::read_mixed(&target));
    assert!(fs::read(at.join("moved.mapbc")).unwrap() == bytes);
    convert("named.mesh", &file, &vertices, bytes.len());
    true
}

fn clean(folder: &Path, name: &str) {
    let path = folder.join(name);
    drop(if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) });
}

fn written(file: &MeshFile, name: &str, vertices: &[DVec3]) -> Result<Vec<u8>, WriteError> {
    let mut bytes = Vec::new();
    file.write_to(&mut bytes, Path::new(name), vertices, &Fields::default())?;
    Ok(bytes)
}

/// The vertices turned, sheared, shifted and each shaken on its own. Those that single precision
/// could not hold afterwards stay.
fn moved(vertices: &[DVec3]) -> Vec<DVec3> {
    let turned = DMat3::from_cols(DVec3::new(0.9, 0.4, 0.0), DVec3::new(-0.4, 0.95, 0.02), DVec3::new(0.1, 0.0, 1.1));
    let shaken = |vertex: usize| DVec3::new(0.61, 0.37, 0.83).map(|step| 1e-3 * (vertex as f64 * step).fract());
    let place = |(vertex, &at): (usize, &DVec3)| {
        let stays = at.abs().max_element() > 1e30;
        if stays { at } else { turned * at + DVec3::new(3.0, -0.1, 1e-3) + shaken(vertex) }
    };
    vertices.iter().enumerate().map(place).collect()
}

/// Whether these are the vertices that were written, in double or in single precision.
fn are_as_written(found: &[DVec3], written: &[DVec3]) -> bool {
    found == written || is_rounded(found, written)
}

fn is_rounded(found: &[DVec3], written: &[DVec3]) -> bool {
    found.iter().copied().eq(written.iter().map(|vertex| vertex.as_vec3().as_dvec3()))
}

/// The mesh in its own format has everything in the same order.
fn assert_same_in_place(name: &str, file: &MeshFile, vertices: &[DVec3], back: Result<MeshFile, ReadError>) {
    let back = back.unwrap_or_else(|error| panic!("{name}: moved, it cannot be read again: {error}"));
    assert_eq!(back.mesh.vertices.len(), vertices.len(), "{name}: vertices");
    assert!(are_as_written(&back.mesh.vertices, vertices), "{name}: other vertices than were written");
    assert_eq!(back.mesh.families, file.mesh.families, "{name}");
    assert!(tets_in_file(&back) == tets_in_file(file), "{name}: other tets");
    assert!(back.mesh.triangles == file.mesh.triangles, "{name}: other triangles");
    assert!(back.mesh.triangle_family == file.mesh.triangle_family, "{name}: triangles of other families");
    assert!(same_others(file, &back), "{name}: other cells");
    assert_eq!(back.partners(), file.partners(), "{name}");
}

/// The tets as they stand in the file. Where their volumes are as good as zero, what moves may make
/// them left-handed, and they are turned over when they are read.
fn tets_in_file(file: &MeshFile) -> Vec<[u32; 4]> {
    let mut mesh = file.mesh.clone();
    if file.left_handed.contains(&"tets") {
        mesh.turn_over();
    }
    mesh.tets
}

/// The other cells as they stand in the file, as [`tets_in_file`].
fn others_in_file(file: &MeshFile) -> OtherCells {
    let mut others = file.others.clone();
    others.turn_over(&file.left_handed);
    others
}

/// Whether all cells that are not tets are equal. Prisms may all be turned over: their volume
/// decides how a file of VTK is read.
fn same_others(file: &MeshFile, back: &MeshFile) -> bool {
    let [expected, found] = [file, back].map(others_in_file);
    let turned = OtherCells { prisms: turned_over(&expected.prisms), ..expected.clone() };
    found == expected || found == turned
}

fn turned_over(prisms: &[[u32; 6]]) -> Vec<[u32; 6]> {
    prisms.iter().map(|&[a, b, c, d, e, f]| [a, c, b, d, f, e]).collect()
}

/// Writes the mesh in another format, and reads it again.
fn convert(name: &str, file: &MeshFile, vertices: &[DVec3], round: usize) {
    let target = TARGETS[round % TARGETS.len()];
    // Written in place, a mesh needs the file of names that was beside it.
    if name.ends_with(&target[1..]) {
        return;
    }
    let is_folder = target == "polyMesh";
    in_folder(|folder| {
        let path = folder.join("to").join(target);
        let losses = file.losses(&path).unwrap();
        let on_disk = is_folder || target.contains("ugrid");
        let back = if on_disk {
            fs::create_dir_all(folder.join("to")).unwrap();
            clean(&folder.join("to"), target);
            clean(&folder.join("to"), "b.mapbc");
            file.write(&path, vertices, &Fields::default()).map(|()| formats::read_mixed(&path))
        } else {
            let bytes = written(file, target, vertices);
            bytes.map(|bytes| formats::read_bytes(Path::new(target), bytes))
        };
        let back = match back {
            Ok(back) => back,
            Err(error) => {
                // Cells that do not fit together are no mesh of OpenFOAM.
                // Nor are cells that single precision inverts.
                if target.contains("4.") && matches!(error, WriteError::Rounded { .. }) {
                    return;
                }
                let too_large = vertices.iter().any(|vertex| vertex.abs().max_element() > f32::MAX.into());
                assert!(is_folder || target.contains("4.") && too_large, "{name} to {target}: {error}");
                return;
            }
        };
        let back = back.unwrap_or_else(|error| panic!("{name} to {target}: it cannot be read again: {error}"));
        assert_same_mesh(&format!("{name} to {target}"), file, vertices, &back, &losses);
    });
}

/// The faces of each family with its name, as sorted lists.
fn families(file: &MeshFile, in_any_order: bool) -> Vec<(Vec<Vec<u32>>, String)> {
    let MeshFile { mesh, others, .. } = file;
    let mut families: Vec<_> = mesh.families.iter().map(|name| (Vec::new(), name.clone())).collect();
    let mut add = |face: &[u32], family: FamilyId| families[family.index()].0.push(cell(face, in_any_order));
    mesh.triangles.iter().zip(&mesh.triangle_family).for_each(|(face, &family)| add(face, family));
    others.quadrilaterals.iter().zip(&others.quadrilateral_family).for_each(|(face, &family)| add(face, family));
    families.iter_mut().for_each(|(faces, _)| faces.sort());
    families.sort();
    families
}

fn cell(corners: &[u32], in_any_order: bool) -> Vec<u32> {
    let mut corners = corners.to_vec();
    if in_any_order {
        corners.sort_unstable();
    }
    corners
}

fn cells<const N: usize>(cells: &[[u32; N]], in_any_order: bool) -> Vec<Vec<u32>> {
    let mut cells: Vec<_> = cells.iter().map(|corners| cell(corners, in_any_order)).collect();
    if in_any_order {
        cells.sort();
    }
    cells
}

/// The mesh in another format has the same vertices, cells, faces and families, and the same names
/// unless the losses tell otherwise.
fn assert_same_mesh(what: &str, file: &MeshFile, vertices: &[DVec3], back: &MeshFile, losses: &[String]) {
    // OpenFOAM has only faces, of which cells are made.
    let in_any_order = what.ends_with("polyMesh");
    let rounds = losses.iter().any(|loss| loss.contains("single precision"));
    assert_eq!(back.mesh.vertices.len(), vertices.len(), "{what}: vertices");
    let same = back.mesh.vertices == vertices || rounds && is_rounded(&back.mesh.vertices, vertices);
    assert!(same, "{what}: other vertices than were written");
    let [found, expected] = [&tets_in_file(back), &file.mesh.tets].map(|tets| cells(tets, in_any_order));
    assert!(found == expected, "{what}: other tets");
    let turned = |others: &OtherCells| OtherCells { prisms: turned_over(&others.prisms), ..others.clone() };
    let of = |others: &OtherCells| {
        [
            cells(&others.pyramids, in_any_order),
            cells(&others.prisms, in_any_order),
            cells(&others.hexahedra, in_any_order),
        ]
    };
    let found = of(&others_in_file(back));
    assert!(found == of(&file.others) || found == of(&turned(&file.others)), "{what}: other cells");
    let (mut found, mut expected) = (families(back, in_any_order), families(file, in_any_order));
    let told = |name: &str| {
        losses.iter().any(|loss| loss.contains("names of families") || loss.contains(&format!("'{name}'")))
    };
    for (found, expected) in found.iter_mut().zip(&mut expected) {
        if found.1 != expected.1 && told(&expected.1) {
            found.1.clone_from(&expected.1);
        }
    }
    assert_eq!(found.len(), expected.len(), "{what}: families");
    for (found, expected) in found.iter().zip(&expected) {
        assert!(found.0 == expected.0, "{what}: other faces of the family {:?}", expected.1);
        assert!(found.1 == expected.1, "{what}: the family {:?} is now {:?}: {losses:?}", expected.1, found.1);
    }
}
