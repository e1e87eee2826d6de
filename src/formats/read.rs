//! Reads a mesh file of any format, plain or gzipped.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::document::SourceFile;
use super::error::ReadError;
use super::format::{Format, Parsed};
use super::gzip::unzipped;
use super::handedness;
use super::input::read_file;
use super::openfoam;
use super::table::{format_of, known};
use crate::memory::check_memory;
use crate::mesh::{HybridMesh, OtherCells, TetMesh};

/// A mesh together with its source file.
#[derive(Clone, Debug)]
pub struct MeshFile {
    /// The mesh as read: tets and triangles. [`MeshFile::write`] takes moved vertices separately.
    pub mesh: TetMesh,
    /// Cells and boundary faces of other shapes. Empty if [`read()`] read the file.
    pub others: OtherCells,
    /// The shapes of cells, such as `tets`, that are all left-handed in the file: the volumes of
    /// all cells of the shape are negative. In `mesh` and `others` such cells are turned over. A
    /// file that is written back in its own format keeps them as they are, and a new file has them
    /// turned over.
    pub left_handed: Vec<&'static str>,
    pub(super) document: Option<Arc<SourceFile>>,
}

impl MeshFile {
    /// A mesh without a source file.
    pub fn from_mesh(mesh: TetMesh) -> Self {
        Self { mesh, others: OtherCells::default(), left_handed: Vec::new(), document: None }
    }

    /// A mesh with other cells than tets, without a source file.
    pub fn from_cells(mesh: TetMesh, others: OtherCells) -> Self {
        Self { others, ..Self::from_mesh(mesh) }
    }

    /// All cells and faces of the mesh.
    pub fn cells(&self) -> HybridMesh<'_> {
        HybridMesh { mesh: &self.mesh, others: &self.others }
    }

    /// What a user must know before the mesh is moved, in words: parts that were passed over,
    /// choices that were made, or that the file is a part of a divided mesh.
    pub fn warnings(&self) -> &[String] {
        self.document.as_ref().map_or(&[], |document| &document.warnings)
    }

    /// Pairs of families that the file declares periodic.
    pub fn partners(&self) -> &[[String; 2]] {
        self.document.as_ref().map_or(&[], |document| &document.partners)
    }

    /// Families with a symmetry condition in the file: patches of OpenFOAM of the types
    /// `symmetryPlane` and `symmetry`, and CGNS families with `BCSymmetryPlane`. The family may be
    /// curved.
    pub fn symmetries(&self) -> &[String] {
        self.document.as_ref().map_or(&[], |document| &document.symmetries)
    }
}

/// Reads a mesh of tets from a file, plain or gzipped. The extension selects the format.
///
/// The first bytes of a file show whether it is gzipped, so its name does not matter.
///
/// # Errors
///
/// - [`ReadError::Elements`]: the mesh has cells or faces other than tets and triangles.
/// - other [`ReadError`]s: the extension is unknown, the file cannot be read, or its contents are
///   broken. The message gives the place.
pub fn read(path: &Path) -> Result<MeshFile, ReadError> {
    let file = read_mixed(path)?;
    if file.others.is_empty() {
        return Ok(file);
    }
    let found = file.others.counts().map(|(name, count)| format!("{count} {name}")).collect::<Vec<_>>();
    Err(ReadError::Elements { path: path.into(), found: found.join(", ") })
}

/// Reads a mesh that may also have pyramids, prisms, hexahedra and boundary quadrilaterals.
/// Otherwise as [`read()`].
///
/// # Errors
///
/// [`ReadError`], as for [`read()`].
pub fn read_mixed(path: &Path) -> Result<MeshFile, ReadError> {
    let path = &mesh_path(path);
    let (format, _) = input_format(path)?;
    let path = &if format.is_folder() { openfoam::points_path(path) } else { path.to_path_buf() };
    let io = |source| ReadError::Io { path: path.into(), source };
    check(path, fs::metadata(path).map_err(io)?.len())?;
    read_bytes(path, read_file(path).map_err(io)?)
}

/// The path of the mesh that [`read_mixed`] reads at `path`: the folder `polyMesh` of an OpenFOAM
/// case or of its folder `constant`, and otherwise `path` itself.
pub fn mesh_path(path: &Path) -> PathBuf {
    // `.` and `..` have no name that could select a format.
    let named = || path.canonicalize().ok().filter(|_| path.file_name().is_none() && path.is_dir());
    openfoam::mesh_folder(path).or_else(named).unwrap_or_else(|| path.to_path_buf())
}

/// [`read_mixed`] from a file's bytes, plain or gzipped.
///
/// - `path`: selects the format, is named in messages, and is the place beside which other files of
///   the mesh are searched
///
/// # Errors
///
/// [`ReadError`], as for [`read()`].
pub fn read_bytes(path: &Path, bytes: Vec<u8>) -> Result<MeshFile, ReadError> {
    let (format, extension) = input_format(path)?;
    let bytes = unzipped(path, bytes.into())?.into_owned();
    if bytes.is_empty() {
        return Err(ReadError::Empty { path: path.into() });
    }
    // A mesh takes about as much memory as its plain file, which is kept.
    check(path, bytes.len() as u64)?;
    let Parsed { mut mesh, mut others, document } = (format.read)(path, extension, bytes)?;
    let left_handed = handedness::turn_over(&mut mesh, &mut others);
    Ok(MeshFile { mesh, others, left_handed, document: Some(Arc::new(document)) })
}

/// Checks that so many bytes of memory are available for a file.
fn check(path: &Path, bytes: u64) -> Result<(), ReadError> {
    check_memory(bytes).map_err(|error| ReadError::Memory { path: path.into(), error })
}

fn input_format(path: &Path) -> Result<(&'static Format, &'static str), ReadError> {
    let name = path.to_string_lossy().to_ascii_lowercase();
    if cfg!(not(feature = "cgns")) && name.trim_end_matches(".gz").ends_with(".cgns") {
        let hint = "install an idmesh with it: cargo install --path . --features cgns";
        return Err(ReadError::Unsupported { path: path.into(), found: "CGNS".into(), hint });
    }
    if name.ends_with(".pvtu") {
        let (found, hint) =
            ("a list of files (.pvtu)".into(), "merge them (in ParaView: Merge Blocks) and save as .vtu");
        return Err(ReadError::Unsupported { path: path.into(), found, hint });
    }
    format_of(path).ok_or_else(|| ReadError::UnknownFormat { path: path.into(), known: known() })
}
