//! Reads a surface mesh of any format, plain or gzipped.

use std::fs;
use std::path::Path;

use super::error::ReadError;
use super::gzip::unzipped;
use super::surface::Surface;
use super::{gmsh, stl, vtk};
use crate::memory::check_memory;

type Reader = fn(&Path, &[u8]) -> Result<Surface, ReadError>;

/// The extensions of surface meshes and their readers.
const READERS: &[(&str, Reader)] = &[
    ("vtp", vtk::read_poly_data),
    ("vtu", vtk::read_grid),
    ("stl", stl::read),
    ("msh", gmsh::read_surface),
    ("vtk", other_format),
    ("ply", other_format),
    ("obj", other_format),
];

/// Whether the extension of a path, which `.gz` may follow, is one of a surface mesh.
pub fn is_surface(path: &Path) -> bool {
    reader(path).is_some()
}

fn reader(path: &Path) -> Option<Reader> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let extension = name.strip_suffix(".gz").unwrap_or(&name).rsplit_once('.')?.1.to_owned();
    READERS.iter().find(|(known, _)| *known == extension).map(|&(_, reader)| reader)
}

/// Reads a surface mesh from a file: VTP, VTU, STL or Gmsh, each plain or gzipped.
///
/// # Errors
///
/// [`ReadError`]: the file cannot be read, its contents are broken, or no reader knows its format.
pub fn read_surface(path: &Path) -> Result<Surface, ReadError> {
    let io = |source| ReadError::Io { path: path.into(), source };
    let memory = |error| ReadError::Memory { path: path.into(), error };
    check_memory(fs::metadata(path).map_err(io)?.len()).map_err(memory)?;
    surface_of(path, &fs::read(path).map_err(io)?)
}

/// [`read_surface`] from a file's bytes, plain or gzipped.
///
/// - `path`: selects the format, and is named in messages
///
/// # Errors
///
/// [`ReadError`], as for [`read_surface`].
pub fn surface_of(path: &Path, bytes: &[u8]) -> Result<Surface, ReadError> {
    let reader = reader(path).unwrap_or(other_format);
    let bytes = unzipped(path, bytes.into())?;
    if bytes.is_empty() {
        return Err(ReadError::Empty { path: path.into() });
    }
    check_memory(bytes.len() as u64).map_err(|error| ReadError::Memory { path: path.into(), error })?;
    reader(path, &bytes)
}

fn other_format(path: &Path, _: &[u8]) -> Result<Surface, ReadError> {
    let (found, hint) = ("a surface in this format".into(), "save it as .vtp, .vtu, .stl or .msh");
    Err(ReadError::Unsupported { path: path.into(), found, hint })
}
