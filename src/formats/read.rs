//! Reading a mesh file of any format, plain or gzipped.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use super::document::SourceFile;
use super::error::ReadError;
use super::format::{Format, Parsed};
use super::gzip::unzipped;
use super::openfoam;
use super::table::{format_of, known};
use crate::mesh::{OtherCells, TetMesh};

/// A mesh together with the file it came from.
#[derive(Clone, Debug)]
pub struct MeshFile {
    /// The mesh: tets and triangles. [`MeshFile::write`] takes the moved vertices separately: this stays as read.
    pub mesh: TetMesh,
    /// Its cells and boundary faces of other shapes; none if [`read()`] read it.
    pub others: OtherCells,
    pub(super) document: Option<Arc<SourceFile>>,
}

impl MeshFile {
    /// A mesh that came from no file.
    pub fn from_mesh(mesh: TetMesh) -> Self {
        Self { mesh, others: OtherCells::default(), document: None }
    }

    /// Families that the file calls periodic, each with its neighbour.
    pub fn partners(&self) -> &[[String; 2]] {
        self.document.as_ref().map_or(&[], |document| &document.partners)
    }
}

/// Reads a mesh of tets from a file, plain or gzipped, of the format that its extension selects.
///
/// Gzip is recognised by the file's first bytes, whatever the file is called.
///
/// # Errors
///
/// - [`ReadError::Elements`]: the mesh has cells or faces other than tets and triangles.
/// - other [`ReadError`]s: the extension is unknown, the file cannot be read, or its contents are broken; the message
///   says where.
pub fn read(path: &Path) -> Result<MeshFile, ReadError> {
    let file = read_mixed(path)?;
    if file.others.is_empty() {
        return Ok(file);
    }
    let found = file.others.counts().map(|(name, count)| format!("{count} {name}")).collect::<Vec<_>>();
    Err(ReadError::Elements { path: path.into(), found: found.join(", ") })
}

/// Reads a mesh that may also have pyramids, prisms, hexahedra and boundary quadrilaterals; otherwise as [`read()`].
///
/// # Errors
///
/// [`ReadError`], as [`read()`].
pub fn read_mixed(path: &Path) -> Result<MeshFile, ReadError> {
    let (format, _) = input_format(path)?;
    let path = &if format.is_folder() { openfoam::points_path(path) } else { path.to_path_buf() };
    let bytes = fs::read(path).map_err(|source| ReadError::Io { path: path.into(), source })?;
    read_bytes(path, bytes)
}

/// As [`read_mixed`], from the file's bytes, plain or gzipped; `path` selects the format, is named in messages, and says
/// where a file that belongs to it is looked for.
///
/// # Errors
///
/// [`ReadError`], as [`read()`].
pub fn read_bytes(path: &Path, bytes: Vec<u8>) -> Result<MeshFile, ReadError> {
    let (format, extension) = input_format(path)?;
    let bytes = unzipped(path, bytes.into())?.into_owned();
    if bytes.is_empty() {
        return Err(ReadError::Empty { path: path.into() });
    }
    let Parsed { mesh, others, document } = (format.read)(path, extension, bytes)?;
    Ok(MeshFile { mesh, others, document: Some(Arc::new(document)) })
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
