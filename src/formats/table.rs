//! The table of formats: names and extensions, and functions for reading and writing.

use std::io;
use std::path::Path;

#[cfg(feature = "cgns")]
use super::cgns;
use super::document::{Companion, NamedFiles, SourceFile};
use super::error::{ReadError, WriteError};
use super::new_file::NewFile;
use super::out::Out;
use super::{aflr3, gmsh, medit, openfoam, su2, vtk};
use crate::mesh::{OtherCells, TetMesh};

/// The mesh file formats, in the order in which messages list them.
pub const FORMATS: &[Format] = &[
    Format {
        name: gmsh::NAME,
        extensions: &["msh"],
        description: "Gmsh 4.1 or 2.2, ascii or binary; families are the surface's physical groups",
        read: gmsh::read,
        create: Create::File(gmsh::create),
        limits: gmsh::limits,
        companion: None,
    },
    Format {
        name: su2::NAME,
        extensions: &["su2"],
        description: "SU2 native; families are the markers",
        read: su2::read,
        create: Create::File(su2::create),
        limits: su2::limits,
        companion: None,
    },
    Format {
        name: vtk::vtu::NAME,
        extensions: &["vtu"],
        description: "VTK unstructured grid for ParaView, with families, displacement and beta",
        read: vtk::vtu::read,
        create: Create::File(vtk::create),
        limits: |_| Vec::new(),
        companion: None,
    },
    Format {
        name: vtk::legacy::NAME,
        extensions: &["vtk"],
        description: "legacy VTK unstructured grid, ascii or binary; families as in VTU",
        read: vtk::legacy::read,
        create: Create::File(vtk::legacy::create),
        limits: vtk::legacy::limits,
        companion: None,
    },
    Format {
        name: aflr3::NAME,
        extensions: aflr3::EXTENSIONS,
        description: "AFLR3, ascii or binary by extension (.b8.ugrid, ...); families are named in a .mapbc file beside",
        read: aflr3::read,
        create: Create::File(aflr3::create),
        limits: aflr3::limits,
        companion: Some(aflr3::companion),
    },
    Format {
        name: medit::NAME,
        extensions: medit::EXTENSIONS,
        description: "Medit, text (.mesh) or binary (.meshb); families are references, named in a .mapbc file beside",
        read: medit::read,
        create: Create::File(medit::create),
        limits: medit::limits,
        companion: Some(medit::companion),
    },
    Format {
        name: openfoam::NAME,
        extensions: openfoam::NAMES,
        description: "OpenFOAM, a folder polyMesh or its points, ascii or binary; families are the patches",
        read: openfoam::read,
        create: Create::Folder(openfoam::create),
        limits: openfoam::limits,
        companion: None,
    },
    #[cfg(feature = "cgns")]
    Format {
        name: cgns::NAME,
        extensions: &["cgns"],
        description: "CGNS in HDF5, one unstructured zone; families are the boundary conditions",
        read: cgns::read,
        create: Create::File(cgns::create),
        limits: cgns::limits,
        companion: None,
    },
];

/// A mesh file format: a row of [`FORMATS`]. Files of every format may also be gzipped (`.msh.gz`).
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

    /// The format that a path's extension selects, and the extension. If several extensions fit,
    /// the longest counts.
    pub(super) fn of(path: &Path) -> Option<(&'static Format, &'static str)> {
        let name = path.file_name()?.to_string_lossy().to_lowercase();
        let stem = name.strip_suffix(".gz").unwrap_or(&name);
        let all = FORMATS.iter().flat_map(|format| format.extensions.iter().map(move |&extension| (format, extension)));
        let fits = |format: &Format, extension: &str| match format.is_folder() {
            // `polyMesh.invalid` is a folder of the format too.
            true => stem.strip_prefix(extension).is_some_and(|rest| matches!(rest, "" | ".invalid")),
            false => stem.strip_suffix(extension).is_some_and(|stem| stem.ends_with('.')),
        };
        all.filter(|(format, extension)| fits(format, extension)).max_by_key(|(_, extension)| extension.len())
    }
}

/// The known extensions, for messages: `.msh (Gmsh), .vtu (VTU)`.
pub(super) fn known() -> String {
    let extensions = |format: &Format| {
        let dot = if format.is_folder() { "" } else { "." };
        format.extensions.iter().map(|extension| format!("{dot}{extension}")).collect::<Vec<_>>().join(", ")
    };
    FORMATS.iter().map(|format| format!("{} ({})", extensions(format), format.name)).collect::<Vec<_>>().join(", ")
}

/// The error of a new mesh in a folder's format with a wrong name.
pub(super) fn needs_folder(path: &Path) -> WriteError {
    let message = "a new OpenFOAM mesh is a folder with the name polyMesh";
    WriteError::Io { path: path.into(), source: io::Error::new(io::ErrorKind::InvalidInput, message) }
}
