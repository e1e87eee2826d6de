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
    /// What messages call it.
    pub name: &'static str,
    /// Extensions that select it, lower case, without the dot.
    pub extensions: &'static [&'static str],
    /// What it holds, one line.
    pub description: &'static str,
    pub(super) read: Reader,
    pub(super) create: Create,
    /// What a new file will not hold or hold otherwise, in words.
    pub(super) limits: fn(&NewFile) -> Vec<String>,
    /// A small file that belongs to a new one.
    pub(super) companion: Option<fn(&NewFile) -> Companion>,
}

/// Reads the (decompressed) bytes of the file at that path, which that extension selected.
pub(super) type Reader = fn(&Path, &'static str, Vec<u8>) -> Result<Parsed, ReadError>;

/// How a new mesh is written.
pub(super) enum Create {
    File(Creator),
    /// Names and contents of the files of a folder, the one that makes it a mesh last.
    Folder(fn(&NewFile) -> io::Result<NamedFiles>),
}

pub(super) type Creator = fn(&mut Out, &NewFile) -> io::Result<()>;

/// What a reader makes of a file.
pub(super) struct Parsed {
    pub mesh: TetMesh,
    pub others: OtherCells,
    pub document: SourceFile,
}

impl Format {
    /// How a new file is written, if it is one file.
    pub(super) fn creator(&self, path: &Path) -> Result<Creator, WriteError> {
        match self.create {
            Create::File(create) => Ok(create),
            Create::Folder(_) => Err(needs_folder(path)),
        }
    }

    /// Whether a mesh of this format is a folder, which its whole name selects, and cannot be read
    /// from one file's bytes.
    pub fn is_folder(&self) -> bool {
        matches!(self.create, Create::Folder(_))
    }
}

/// The error that a new mesh of a folder's format has another name.
pub(super) fn needs_folder(path: &Path) -> WriteError {
    let message = "a new OpenFOAM mesh is a folder with the name polyMesh";
    WriteError::Io { path: path.into(), source: io::Error::new(io::ErrorKind::InvalidInput, message) }
}
