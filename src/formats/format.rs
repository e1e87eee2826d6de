//! What a mesh file format is: what selects it, and how it is read and written.

use std::io;
use std::path::Path;

use super::document::{Companion, NamedFiles, SourceFile};
use super::error::{ReadError, WriteError};
use super::new_file::NewFile;
use super::out::Out;
use crate::mesh::{OtherCells, TetMesh};

/// One mesh file format: a row of [`FORMATS`](super::FORMATS). Every format may also be gzipped
/// (`.msh.gz`).
pub struct Format {
    /// Name in messages.
    pub name: &'static str,
    /// Extensions that select the format, in lower case, without the dot.
    pub extensions: &'static [&'static str],
    /// Description in one line.
    pub description: &'static str,
    pub(super) read: Reader,
    pub(super) create: Create,
    /// Losses of a new file, in words.
    pub(super) limits: fn(&NewFile) -> Vec<String>,
    /// Makes the small file that belongs to a new file.
    pub(super) companion: Option<fn(&NewFile) -> Companion>,
}

/// Reads the (decompressed) bytes of a file, given its path and the extension that selected the
/// format.
pub(super) type Reader = fn(&Path, &'static str, Vec<u8>) -> Result<Parsed, ReadError>;

/// The writer of a new mesh.
pub(super) enum Create {
    File(Creator),
    /// Gives names and contents of the files of a folder. The file that makes the folder a mesh is
    /// last.
    Folder(fn(&NewFile) -> io::Result<NamedFiles>),
}

pub(super) type Creator = fn(&mut Out, &NewFile) -> io::Result<()>;

/// The result of a reader.
pub(super) struct Parsed {
    pub mesh: TetMesh,
    pub others: OtherCells,
    pub document: SourceFile,
}

impl Format {
    /// The writer of a new file, if a mesh of this format is one file.
    pub(super) fn creator(&self, path: &Path) -> Result<Creator, WriteError> {
        match self.create {
            Create::File(create) => Ok(create),
            Create::Folder(_) => Err(needs_folder(path)),
        }
    }

    /// Whether a mesh of this format is a folder. The folder's name selects the format, and one
    /// file's bytes are not enough to read it.
    pub fn is_folder(&self) -> bool {
        matches!(self.create, Create::Folder(_))
    }
}

/// The error of a new mesh in a folder's format with a wrong name.
pub(super) fn needs_folder(path: &Path) -> WriteError {
    let message = "a new OpenFOAM mesh is a folder with the name polyMesh";
    WriteError::Io { path: path.into(), source: io::Error::new(io::ErrorKind::InvalidInput, message) }
}
