//! OpenFOAM meshes: a folder `polyMesh` with points, faces, owner, neighbour and boundary, in ASCII
//! or binary.
//!
//! A family is a patch. Patches of type `cyclic` are partners. Cells are recognised by their faces;
//! polyhedra are counted and refused.
//!
//! When a mesh is written back, only `points` changes. An output folder `polyMesh` gets all files
//! of the mesh. An output file named `points` (for example in a time folder) is written alone.
//!
//! Source: the OpenFOAM user guide, "Mesh description", and the files of OpenFOAM 1912 to 2312.

mod cells;
mod create;
mod file;
mod lists;

use std::borrow::Cow;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::document::{NamedFiles, Slots, SourceFile};
use super::error::{Location, ReadError};
use super::format::{Create, Format, Parsed};
use super::gzip::unzipped;
use super::input::read_file;
use super::linked::unquoted;
use super::mesh_builder::{CellKind, MOST_VERTICES, MeshBuilder};

use create::{create, limits};
use file::File;
use lists::Label;

/// The format's name in [`super::FORMATS`].
const NAME: &str = "OpenFOAM";

/// The names that select the format, in lower case: the folder's name, and the name of its file of
/// points.
pub(super) const NAMES: &[&str] = &["polymesh", "points"];

/// The format, as a row of [`FORMATS`](crate::formats::FORMATS).
pub(super) const FORMAT: Format = Format {
    name: NAME,
    extensions: NAMES,
    description: "OpenFOAM, a folder polyMesh or its points, ascii or binary; families are the patches",
    read,
    create: Create::Folder(create),
    limits,
    companion: None,
};

/// The files of a mesh besides its points.
const FILES: [&str; 4] = ["faces", "owner", "neighbour", "boundary"];

/// The folder `polyMesh` of the case folder `path`, or of its folder `constant`. `None` if `path`
/// is no such folder, or has points itself.
pub(super) fn mesh_folder(path: &Path) -> Option<PathBuf> {
    if points_path(path).is_file() {
        return None;
    }
    let folders = [path.join("constant/polyMesh"), path.join("polyMesh")];
    folders.into_iter().find(|folder| folder.is_dir())
}

/// Whether a mesh is a part of a divided mesh, by its path: `processor0/constant/polyMesh/points`.
fn is_part(path: &Path) -> bool {
    let absolute = path.canonicalize();
    let folders = absolute.as_deref().unwrap_or(path).ancestors().skip(1).take(3);
    let mut names = folders.filter_map(|folder| folder.file_name()?.to_str());
    names.any(|name| name.strip_prefix("processor").is_some_and(|number| number.parse::<u32>().is_ok()))
}

/// Path of a mesh's points: `path` itself, or a file in the folder `path`.
pub(super) fn points_path(path: &Path) -> PathBuf {
    if !path.is_dir() {
        return path.to_path_buf();
    }
    let [plain, zipped] = ["points", "points.gz"].map(|name| path.join(name));
    if zipped.exists() && !plain.exists() { zipped } else { plain }
}

/// The name of the same file zipped, or plain if it is zipped. OpenFOAM reads the plain one.
pub(super) fn twin(name: &str) -> String {
    name.strip_suffix(".gz").map_or_else(|| format!("{name}.gz"), str::to_owned)
}

/// Reads a mesh from the (decompressed) bytes of its points at `path`. The other files are in the
/// same folder.
fn read(path: &Path, extension: &'static str, bytes: Vec<u8>) -> Result<Parsed, ReadError> {
    read_folder(path, extension, bytes).map_err(unquoted)
}

fn read_folder(path: &Path, extension: &'static str, bytes: Vec<u8>) -> Result<Parsed, ReadError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let (positions, slots) = read_points(path, &bytes)?;
    let siblings = siblings(folder).map_err(|source| ReadError::Io { path: folder.into(), source })?;
    let load = |name: &str| load(folder, &siblings, name);
    let (faces_path, faces) = load("faces")?;
    let faces = File::open(&faces_path, &faces)?.faces(positions.len())?;
    let (owner, neighbour) = rayon::join(|| load("owner"), || load("neighbour"));
    let ((owner_path, owner), (neighbour_path, neighbour)) = (owner?, neighbour?);
    // Every cell has a face, so the number of faces bounds the numbers of cells.
    let cells = |path, bytes, or_none| File::open(path, bytes)?.cells_below(faces.len(), or_none);
    let (owner, neighbour) =
        rayon::join(|| cells(&owner_path, &owner, false), || cells(&neighbour_path, &neighbour, true));
    let (owner, neighbour) = (owner?, neighbour?);
    // Old files hold the neighbour -1 for faces on the boundary.
    let neighbour = neighbour.split(|&cell| cell == Label::NONE).next().unwrap_or_default();
    let (boundary_path, boundary) = load("boundary")?;
    let patches = File::open(&boundary_path, &boundary)?.patches(neighbour.len(), faces.len())?;
    if owner.len() != faces.len() || neighbour.len() > faces.len() {
        return Err(ReadError::Malformed {
            place: Location::File(faces_path.clone()),
            expected: "an owner for every face, and no more neighbours".into(),
            found: format!("{} faces, {} owners, {} neighbours", faces.len(), owner.len(), neighbour.len()),
        });
    }
    let mut mesh_builder = MeshBuilder::default();
    cells::assemble(&faces, &owner, neighbour, &mut mesh_builder);
    for (tag, patch) in (0..).zip(&patches) {
        for face in patch.faces.clone() {
            let corners = faces.corners(face);
            let shape = match corners.len() {
                3 => CellKind::Triangle,
                4 => CellKind::Quadrilateral,
                _ => {
                    mesh_builder.refuse("polygons on the boundary", 1);
                    continue;
                }
            };
            let mut corners = corners.iter().map(|corner| corner.value());
            mesh_builder.push(shape, tag, || Ok::<_, ReadError>(corners.next().unwrap_or_default()))?;
        }
    }
    let (mesh, others) = mesh_builder.finish(path, positions, |tag| Some(patches[tag as usize].name.clone()))?;
    let mut kinds: Vec<&str> = patches.iter().map(|patch| &*patch.kind).filter(|kind| *kind != "patch").collect();
    kinds.sort_unstable();
    kinds.dedup();
    let mut beside = Vec::new();
    if !kinds.is_empty() {
        beside.push(format!("types of patches ({})", kinds.join(", ")));
    }
    let further = siblings.iter().map(|(name, _)| name.trim_end_matches(".gz")).filter(|name| !FILES.contains(name));
    beside.extend(further.map(|name| format!("the file {name}")));
    let empty = patches.iter().filter(|patch| patch.faces.is_empty());
    beside.extend(empty.map(|patch| format!("the patch '{}' without faces", patch.name)));
    // The faces of patches of type cyclicAMI do not match one by one.
    let cyclic = patches.iter().filter(|patch| patch.kind == "cyclic");
    let partners = cyclic.filter_map(|patch| Some([patch.name.clone(), patch.neighbour.clone()?])).collect();
    let symmetric = patches.iter().filter(|patch| matches!(&*patch.kind, "symmetryPlane" | "symmetry"));
    let symmetries = symmetric.map(|patch| patch.name.clone()).collect();
    let mut warnings = Vec::new();
    if is_part(path) || patches.iter().any(|patch| patch.kind.starts_with("processor")) {
        let warning = "this is one part of a divided mesh: moved alone, it does not fit the other parts; join them first \
                       (reconstructParMesh -constant)";
        warnings.push(warning.to_owned());
    }
    let document = SourceFile {
        siblings,
        warnings,
        partners,
        symmetries,
        ..SourceFile::of_file(NAME, extension, bytes, Box::new(slots), beside)
    };
    Ok(Parsed { mesh, others, document })
}

fn read_points(path: &Path, bytes: &[u8]) -> Result<(Vec<DVec3>, Slots), ReadError> {
    let (positions, slots) = File::open(path, bytes)?.points()?;
    if positions.len() >= MOST_VERTICES {
        let (count, limit) = (positions.len(), MOST_VERTICES);
        return Err(ReadError::TooMany { path: path.into(), what: "vertices", count, limit });
    }
    Ok((positions, slots))
}

/// A file of the folder, decompressed, with its path.
fn load<'a>(folder: &Path, files: &'a NamedFiles, name: &str) -> Result<(PathBuf, Cow<'a, [u8]>), ReadError> {
    let zipped = format!("{name}.gz");
    let named = |name: &str| files.iter().find(|(file, _)| file == name);
    let Some((name, bytes)) = named(name).or_else(|| named(&zipped)) else {
        let what = match folder.join(name).exists() || folder.join(&zipped).exists() {
            true => "a folder, a pipe or a device, expected a file",
            false => "there is no such file",
        };
        let source = io::Error::new(io::ErrorKind::NotFound, what);
        return Err(ReadError::Io { path: folder.join(name), source });
    };
    let path = folder.join(name);
    let bytes = unzipped(&path, Cow::Borrowed(bytes))?;
    Ok((path, bytes))
}

/// All other files of the folder, unchanged.
fn siblings(folder: &Path) -> io::Result<NamedFiles> {
    let mut siblings = Vec::new();
    for entry in fs::read_dir(if folder.as_os_str().is_empty() { Path::new(".") } else { folder })? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_file() && name != "points" && name != "points.gz" {
            siblings.push((name, read_file(&entry.path())?));
        }
    }
    siblings.sort();
    Ok(siblings)
}
