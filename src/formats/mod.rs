//! Mesh files: reading a mesh, and writing it back with its vertices moved.
//!
//! A file that was read is written back as its own bytes with only the coordinates replaced, so that sections this
//! crate knows nothing of survive, and a mesh that did not move gives the very same file. Formats that are only
//! written (VTU) are generated.
//!
//! To add a format: write its file here, add its line to [`FORMATS`].

mod atomic;
mod document;
mod error;
mod gmsh;
mod scanner;
mod vtu;

use std::fs;
use std::io::{self, Read, Write};
use std::path::Path;
use std::sync::Arc;

use flate2::Compression;
use flate2::read::MultiGzDecoder;
use flate2::write::GzEncoder;
use glam::DVec3;

use crate::mesh::TetMesh;

pub use atomic::write_atomically;
pub use error::{Place, ReadError, WriteError};
pub use vtu::{Cells, write_vtu};

use document::Document;

/// The mesh file formats, in the order in which messages list them.
pub const FORMATS: &[Format] = &[
    Format {
        name: "Gmsh",
        extensions: &["msh"],
        description: "Gmsh 4.1 or 2.2, ascii or binary; families are the surface's physical groups",
        read: Some(gmsh::read),
        output: Output::Patched,
    },
    Format {
        name: "VTU",
        extensions: &["vtu"],
        description: "VTK unstructured grid for ParaView, with families, displacement and beta",
        read: None,
        output: Output::Generated(vtu::generate),
    },
];

/// One mesh file format: a row of [`FORMATS`]. Every format may also be gzipped (`.msh.gz`).
pub struct Format {
    /// What messages call it.
    pub name: &'static str,
    /// Extensions that select it, lower case, without the dot.
    pub extensions: &'static [&'static str],
    /// What it holds, one line.
    pub description: &'static str,
    read: Option<Reader>,
    output: Output,
}

/// Reads the (decompressed) bytes of the file at that path; the path is for messages only.
type Reader = fn(&Path, Vec<u8>) -> Result<(TetMesh, Document), ReadError>;
type Generator = fn(&mut dyn Write, &[DVec3], &Cells, &Fields) -> io::Result<()>;

enum Output {
    /// The source file with its coordinates replaced; the source must be of the same format.
    Patched,
    /// Made from the mesh alone.
    Generated(Generator),
}

impl Format {
    /// Whether [`read()`] understands this format.
    pub fn is_readable(&self) -> bool {
        self.read.is_some()
    }

    /// Whether [`MeshFile::write`] needs a source of this same format, whose other contents it keeps.
    pub fn needs_source(&self) -> bool {
        matches!(self.output, Output::Patched)
    }

    /// The format that the path's extension selects, and whether it is gzipped.
    fn of(path: &Path) -> Option<(&'static Format, bool)> {
        let name = path.file_name()?.to_string_lossy().to_lowercase();
        let (stem, gzipped) = name.strip_suffix(".gz").map_or((&*name, false), |stem| (stem, true));
        let extension = stem.rsplit_once('.')?.1;
        let format = FORMATS.iter().find(|format| format.extensions.contains(&extension))?;
        Some((format, gzipped))
    }
}

/// The known extensions, for messages: `.msh (Gmsh), .vtu (VTU)`.
fn known(wanted: impl Fn(&Format) -> bool) -> String {
    let names = FORMATS
        .iter()
        .filter(|format| wanted(format))
        .flat_map(|format| format.extensions.iter().map(|extension| format!(".{extension} ({})", format.name)));
    names.collect::<Vec<_>>().join(", ")
}

/// Results written beside the mesh by the formats that can hold them (VTU; Gmsh files keep only the mesh).
#[derive(Clone, Copy, Debug, Default)]
pub struct Fields<'a> {
    /// New minus old position `[n_vertices]`, in the unit of the mesh.
    pub displacement: Option<&'a [DVec3]>,
    /// Quality `V / l_max^3` of each tet `[n_tets]`.
    pub beta: Option<&'a [f64]>,
}

/// A mesh together with the file it came from.
#[derive(Clone, Debug)]
pub struct MeshFile {
    /// The mesh. [`MeshFile::write`] takes the moved vertices separately: this stays as read.
    pub mesh: TetMesh,
    document: Option<Arc<Document>>,
}

/// Reads a mesh file, plain or gzipped, of the format that its extension selects.
///
/// Gzip is recognised by the file's first bytes, whatever the file is called.
///
/// # Errors
///
/// [`ReadError`]: the extension is unknown or of a format that is only written, the file cannot be read, or its
/// contents are broken; the message says where.
pub fn read(path: &Path) -> Result<MeshFile, ReadError> {
    let unknown = || ReadError::UnknownFormat { path: path.into(), known: known(Format::is_readable) };
    let (format, _) = Format::of(path).ok_or_else(unknown)?;
    let reader = format.read.ok_or_else(|| ReadError::OnlyWritten {
        path: path.into(),
        format: format.name,
        known: known(Format::is_readable),
    })?;
    let io = |source| ReadError::Io { path: path.into(), source };
    let mut bytes = fs::read(path).map_err(io)?;
    if bytes.starts_with(&[0x1f, 0x8b]) {
        let mut plain = Vec::new();
        MultiGzDecoder::new(&bytes[..]).read_to_end(&mut plain).map_err(io)?;
        bytes = plain;
    }
    if bytes.is_empty() {
        return Err(ReadError::Empty { path: path.into() });
    }
    let (mesh, document) = reader(path, bytes)?;
    Ok(MeshFile { mesh, document: Some(Arc::new(document)) })
}

impl MeshFile {
    /// A mesh that came from no file. Formats that are written back into their source ([`Format::needs_source`])
    /// cannot be written from it.
    pub fn from_mesh(mesh: TetMesh) -> Self {
        Self { mesh, document: None }
    }

    /// Writes the mesh with its vertices at `vertices` `[n_vertices]` to `path`, in the format that the extension of
    /// `path` selects, gzipped if it ends in `.gz`.
    ///
    /// A Gmsh file is the source file with only the changed coordinates replaced. The file appears complete or not at
    /// all.
    ///
    /// # Errors
    ///
    /// - [`WriteError::UnknownFormat`], [`WriteError::NeedsSource`]: as [`MeshFile::check_output`].
    /// - [`WriteError::Length`]: `vertices` or a field has another length than the mesh.
    /// - [`WriteError::NotFinite`]: a coordinate is NaN or infinite.
    /// - [`WriteError::VertexOutOfRange`]: the mesh is broken.
    /// - [`WriteError::Io`]: the file could not be written.
    pub fn write(&self, path: &Path, vertices: &[DVec3], fields: &Fields) -> Result<(), WriteError> {
        let format = self.output_format(path)?;
        check_length("vertices", vertices.len(), self.mesh.vertices.len())?;
        match (&format.output, &self.document) {
            (Output::Patched, Some(document)) => {
                check_finite(vertices)?;
                write_file(path, |out| document.write(out, vertices))
            }
            (Output::Generated(generate), _) => {
                write_generated(path, *generate, vertices, &Cells::of(&self.mesh), fields)
            }
            (Output::Patched, None) => unreachable!("output_format demands the source"),
        }
    }

    /// Checks that [`MeshFile::write`] to `path` can work, before anything is computed: the format is known and can
    /// be written from this source, and the folder exists and takes files.
    ///
    /// # Errors
    ///
    /// - [`WriteError::UnknownFormat`]: no format has that extension.
    /// - [`WriteError::NeedsSource`]: the format is written back into its source, and the source is of another one.
    /// - [`WriteError::Io`]: `path` is a folder, or its folder is missing or takes no new files.
    pub fn check_output(&self, path: &Path) -> Result<(), WriteError> {
        self.output_format(path)?;
        atomic::check(path).map_err(|source| WriteError::Io { path: path.into(), source })
    }

    fn output_format(&self, path: &Path) -> Result<&'static Format, WriteError> {
        let source = self.document.as_ref().map(|document| document.format);
        let unknown = || WriteError::UnknownFormat { path: path.into(), known: known(|_| true) };
        let (format, _) = Format::of(path).ok_or_else(unknown)?;
        if format.needs_source() && source != Some(format.name) {
            return Err(WriteError::NeedsSource { path: path.into(), format: format.name, source_format: source });
        }
        Ok(format)
    }
}

/// Writes a file of a generated format after checking what goes into it.
fn write_generated(
    path: &Path,
    generate: Generator,
    vertices: &[DVec3],
    cells: &Cells,
    fields: &Fields,
) -> Result<(), WriteError> {
    check_finite(vertices)?;
    check_length("triangle families", cells.triangle_family.len(), cells.triangles.len())?;
    check_vertices("tet", cells.tets, vertices.len())?;
    check_vertices("triangle", cells.triangles, vertices.len())?;
    if let Some(displacement) = fields.displacement {
        check_length("displacement", displacement.len(), vertices.len())?;
    }
    if let Some(beta) = fields.beta {
        check_length("beta", beta.len(), cells.tets.len())?;
    }
    write_file(path, |out| generate(out, vertices, cells, fields))
}

fn write_file(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), WriteError> {
    let gzipped = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"));
    let result = write_atomically(path, |out| {
        if !gzipped {
            return write(out);
        }
        let mut encoder = GzEncoder::new(out, Compression::default());
        write(&mut encoder)?;
        encoder.finish().map(|_| ())
    });
    result.map_err(|source| WriteError::Io { path: path.into(), source })
}

fn check_length(what: &'static str, found: usize, expected: usize) -> Result<(), WriteError> {
    if found == expected { Ok(()) } else { Err(WriteError::Length { what, found, expected }) }
}

fn check_vertices<const N: usize>(
    entity: &'static str,
    cells: &[[u32; N]],
    n_vertices: usize,
) -> Result<(), WriteError> {
    let broken = |cell: &[u32; N]| cell.iter().copied().find(|&vertex| vertex as usize >= n_vertices);
    match cells.iter().enumerate().find_map(|(index, cell)| Some((index, broken(cell)?))) {
        Some((index, vertex)) => Err(WriteError::VertexOutOfRange { entity, index, vertex, n_vertices }),
        None => Ok(()),
    }
}

fn check_finite(vertices: &[DVec3]) -> Result<(), WriteError> {
    match vertices.iter().position(|vertex| !vertex.is_finite()) {
        Some(vertex) => Err(WriteError::NotFinite { vertex, position: vertices[vertex] }),
        None => Ok(()),
    }
}
