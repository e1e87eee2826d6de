//! Mesh files: reading a mesh, and writing it back with its vertices moved.
//!
//! A file that was read is written back as its own bytes with only the coordinates replaced, so that sections this
//! crate knows nothing of survive, and a mesh that did not move gives the very same file. Written in another format, the
//! mesh and its families go into a new file.
//!
//! To add a format: write its file here, add its line to [`FORMATS`].

mod aflr3;
mod assembly;
mod atomic;
#[cfg(feature = "cgns")]
mod cgns;
mod content;
mod document;
mod error;
mod gmsh;
mod gzip;
mod lines;
mod medit;
mod openfoam;
mod scanner;
mod su2;
mod vtk;

use std::fs;
use std::io::{self, Read, Write};
use std::path::Path;
use std::sync::Arc;

use flate2::read::MultiGzDecoder;
use glam::DVec3;

use crate::mesh::{OtherCells, TetMesh};

pub(crate) use atomic::check as check_writable;
pub use atomic::write_atomically;
pub use content::{Cells, Fields};
pub use error::{Place, ReadError, WriteError};
pub use vtk::{Polylines, read_polylines, write_vtu};

use content::Content;
use document::{Companion, Document, NamedFiles};
use gzip::Gzip;

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
        name: vtk::VTU,
        extensions: &["vtu"],
        description: "VTK unstructured grid for ParaView, with families, displacement and beta",
        read: vtk::read,
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
        description: "Medit, text (.mesh) or binary (.meshb); families are the references of the faces",
        read: medit::read,
        create: Create::File(medit::create),
        limits: medit::limits,
        companion: None,
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

/// One mesh file format: a row of [`FORMATS`]. Every format may also be gzipped (`.msh.gz`).
pub struct Format {
    /// What messages call it.
    pub name: &'static str,
    /// Extensions that select it, lower case, without the dot.
    pub extensions: &'static [&'static str],
    /// What it holds, one line.
    pub description: &'static str,
    read: Reader,
    create: Create,
    /// What a new file will not hold or hold otherwise, in words.
    limits: fn(&Content) -> Vec<String>,
    /// A small file that belongs to a new one.
    companion: Option<fn(&Content) -> Companion>,
}

/// Reads the (decompressed) bytes of the file at that path, which that extension selected.
type Reader = fn(&Path, &'static str, Vec<u8>) -> Result<Parsed, ReadError>;

/// How a new mesh is written.
enum Create {
    File(Creator),
    /// Names and contents of the files of a folder, the one that makes it a mesh last.
    Folder(fn(&Content) -> io::Result<NamedFiles>),
}

type Creator = fn(&mut dyn Write, &Content) -> io::Result<()>;

/// What a reader makes of a file.
struct Parsed {
    mesh: TetMesh,
    others: OtherCells,
    document: Document,
}

impl Format {
    /// How a new file is written, if it is one file.
    fn creator(&self, path: &Path) -> Result<Creator, WriteError> {
        match self.create {
            Create::File(create) => Ok(create),
            Create::Folder(_) => Err(needs_folder(path)),
        }
    }

    /// Whether a mesh of this format is a folder, which its whole name selects, and cannot be read from one file's bytes.
    pub fn is_folder(&self) -> bool {
        matches!(self.create, Create::Folder(_))
    }

    /// The format that the path's extension selects, and that extension: of several that fit, the longest.
    fn of(path: &Path) -> Option<(&'static Format, &'static str)> {
        let name = path.file_name()?.to_string_lossy().to_lowercase();
        let stem = name.strip_suffix(".gz").unwrap_or(&name);
        let all = FORMATS.iter().flat_map(|format| format.extensions.iter().map(move |&extension| (format, extension)));
        let fits = |format: &Format, extension: &str| match format.is_folder() {
            // `polyMesh.invalid` is one, too.
            true => stem.strip_prefix(extension).is_some_and(|rest| matches!(rest, "" | ".invalid")),
            false => stem.strip_suffix(extension).is_some_and(|stem| stem.ends_with('.')),
        };
        all.filter(|(format, extension)| fits(format, extension)).max_by_key(|(_, extension)| extension.len())
    }
}

/// The known extensions, for messages: `.msh (Gmsh), .vtu (VTU)`.
fn known() -> String {
    let extensions = |format: &Format| {
        let dot = if format.is_folder() { "" } else { "." };
        format.extensions.iter().map(|extension| format!("{dot}{extension}")).collect::<Vec<_>>().join(", ")
    };
    FORMATS.iter().map(|format| format!("{} ({})", extensions(format), format.name)).collect::<Vec<_>>().join(", ")
}

/// A mesh together with the file it came from.
#[derive(Clone, Debug)]
pub struct MeshFile {
    /// The mesh: tets and triangles. [`MeshFile::write`] takes the moved vertices separately: this stays as read.
    pub mesh: TetMesh,
    /// Its cells and boundary faces of other shapes; none if [`read()`] read it.
    pub others: OtherCells,
    document: Option<Arc<Document>>,
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
    let bytes = unzipped(path, bytes)?;
    if bytes.is_empty() {
        return Err(ReadError::Empty { path: path.into() });
    }
    let Parsed { mesh, others, document } = (format.read)(path, extension, bytes)?;
    Ok(MeshFile { mesh, others, document: Some(Arc::new(document)) })
}

/// The contents of a file that may be gzipped; `path` is for messages.
fn unzipped(path: &Path, bytes: Vec<u8>) -> Result<Vec<u8>, ReadError> {
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(bytes);
    }
    let mut plain = Vec::new();
    match MultiGzDecoder::new(&bytes[..]).read_to_end(&mut plain) {
        Ok(_) => Ok(plain),
        Err(source) => Err(ReadError::Zipped { path: path.into(), source }),
    }
}

fn input_format(path: &Path) -> Result<(&'static Format, &'static str), ReadError> {
    let name = path.to_string_lossy().to_ascii_lowercase();
    if cfg!(not(feature = "cgns")) && name.trim_end_matches(".gz").ends_with(".cgns") {
        let hint = "install an idmesh with it: cargo install --path . --features cgns";
        return Err(ReadError::Unsupported { path: path.into(), found: "CGNS".into(), hint });
    }
    Format::of(path).ok_or_else(|| ReadError::UnknownFormat { path: path.into(), known: known() })
}

impl MeshFile {
    /// A mesh that came from no file.
    pub fn from_mesh(mesh: TetMesh) -> Self {
        Self { mesh, others: OtherCells::default(), document: None }
    }

    /// Writes the mesh with its vertices at `vertices` `[n_vertices]` to `path`, in the format that the extension of
    /// `path` selects, gzipped if it ends in `.gz`.
    ///
    /// In the format of the file that was read it is that file with only the changed coordinates replaced; in another
    /// one, a new file, which holds the mesh, its families and perhaps `fields` ([`MeshFile::losses`] says what it does
    /// not hold). The file appears complete or not at all.
    ///
    /// # Errors
    ///
    /// - [`WriteError::UnknownFormat`]: as [`MeshFile::check_output`].
    /// - [`WriteError::Length`]: `vertices` or a field has another length than the mesh.
    /// - [`WriteError::NotFinite`]: a coordinate is NaN or infinite.
    /// - [`WriteError::VertexOutOfRange`]: the mesh is broken.
    /// - [`WriteError::Io`]: the file could not be written.
    pub fn write(&self, path: &Path, vertices: &[DVec3], fields: &Fields) -> Result<(), WriteError> {
        let (format, extension) = output_format(path)?;
        check_length("vertices", vertices.len(), self.mesh.vertices.len())?;
        if format.is_folder() && names_folder(path) {
            return self.write_folder(path, format, vertices);
        }
        if let Some(document) = self.source(format, extension) {
            check_finite(vertices)?;
            write_file(path, |out| document.write(out, vertices))?;
            return document.companion.as_ref().map_or(Ok(()), |companion| write_companion(path, companion));
        }
        let content = self.content(vertices, *fields, extension);
        let create = format.creator(path)?;
        create_file(path, create, &content)?;
        format.companion.map_or(Ok(()), |companion| write_companion(path, &companion(&content)))
    }

    /// As [`MeshFile::write`], but into `out` and never gzipped; `path` selects the format only. Files that belong to it
    /// are not written.
    ///
    /// # Errors
    ///
    /// [`WriteError`], as [`MeshFile::write`].
    pub fn write_to(
        &self,
        out: &mut dyn Write,
        path: &Path,
        vertices: &[DVec3],
        fields: &Fields,
    ) -> Result<(), WriteError> {
        let (format, extension) = output_format(path)?;
        check_length("vertices", vertices.len(), self.mesh.vertices.len())?;
        let written = match self.source(format, extension) {
            Some(document) => {
                check_finite(vertices)?;
                document.write(out, vertices)
            }
            None => {
                let content = self.content(vertices, *fields, extension);
                check_content(&content)?;
                format.creator(path)?(out, &content)
            }
        };
        written.map_err(|source| WriteError::Io { path: path.into(), source })
    }

    /// Checks that [`MeshFile::write`] to `path` can work, before anything is computed: the format is known, and the
    /// folder exists and takes files.
    ///
    /// # Errors
    ///
    /// - [`WriteError::UnknownFormat`]: no format has that extension.
    /// - [`WriteError::Io`]: `path` is a folder, or its folder is missing or takes no new files.
    pub fn check_output(&self, path: &Path) -> Result<(), WriteError> {
        let (format, extension) = output_format(path)?;
        let checked = match format.is_folder() && names_folder(path) {
            true => atomic::check_folder(path),
            false => {
                if self.source(format, extension).is_none() {
                    format.creator(path)?;
                }
                atomic::check(path)
            }
        };
        checked.map_err(|source| WriteError::Io { path: path.into(), source })
    }

    /// What a file that [`MeshFile::write`] makes at `path` will not hold or hold otherwise, in words; nothing where the
    /// file that was read is written back.
    ///
    /// # Errors
    ///
    /// [`WriteError::UnknownFormat`]: no format has that extension.
    pub fn losses(&self, path: &Path) -> Result<Vec<String>, WriteError> {
        let (format, extension) = output_format(path)?;
        if self.source(format, extension).is_some() {
            return Ok(Vec::new());
        }
        let content = self.content(&self.mesh.vertices, Fields::default(), extension);
        let beside = self.document.iter().flat_map(|document| &document.beside);
        let mut losses: Vec<String> = beside.map(|what| format!("{what}: not carried into the new file")).collect();
        losses.extend((format.limits)(&content));
        if let Some(companion) = format.companion.map(|companion| (companion(&content).path)(path))
            && companion.exists()
        {
            losses.push(format!("{} is there already, and is left as it is", companion.display()));
        }
        Ok(losses)
    }

    /// Writes a mesh that is a folder: that of the source with other points, or a new one.
    fn write_folder(&self, path: &Path, format: &Format, vertices: &[DVec3]) -> Result<(), WriteError> {
        let io = |source| WriteError::Io { path: path.into(), source };
        let files = match (self.source(format, ""), &format.create) {
            (Some(document), _) => {
                check_finite(vertices)?;
                let mut points = Vec::new();
                document.write(&mut points, vertices).map_err(io)?;
                let mut files = document.siblings.clone();
                files.push(("points".to_string(), points));
                files
            }
            (None, Create::Folder(create)) => {
                let content = self.content(vertices, Fields::default(), "");
                check_content(&content)?;
                create(&content).map_err(io)?
            }
            (None, _) => return Err(needs_folder(path)),
        };
        atomic::write_folder(path, &files).map_err(io)
    }

    /// The file that was read, if it is of this format and variant.
    fn source(&self, format: &Format, extension: &str) -> Option<&Document> {
        let document = self.document.as_deref()?;
        let same_variant = document.extension == extension || format.is_folder();
        (document.format == format.name && same_variant).then_some(document)
    }

    fn content<'a>(&'a self, vertices: &'a [DVec3], fields: Fields<'a>, extension: &'static str) -> Content<'a> {
        Content { vertices, cells: Cells::of(&self.mesh), others: &self.others, fields, extension }
    }
}

fn output_format(path: &Path) -> Result<(&'static Format, &'static str), WriteError> {
    Format::of(path).ok_or_else(|| WriteError::UnknownFormat { path: path.into(), known: known() })
}

/// Whether a path of a folder's format names the folder, not the file in it.
fn names_folder(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    name.starts_with(openfoam::NAMES[0])
}

fn needs_folder(path: &Path) -> WriteError {
    let message = "a new OpenFOAM mesh is a folder with the name polyMesh";
    WriteError::Io { path: path.into(), source: io::Error::new(io::ErrorKind::InvalidInput, message) }
}

/// Writes the file that belongs to the one at `path`, unless there is one: it may hold what its owner wrote.
fn write_companion(path: &Path, companion: &Companion) -> Result<(), WriteError> {
    let path = (companion.path)(path);
    if path.exists() {
        return Ok(());
    }
    let written = write_atomically(&path, |out| out.write_all(&companion.bytes));
    written.map_err(|source| WriteError::Io { path, source })
}

/// Writes a new file after checking what goes into it.
fn create_file(path: &Path, create: Creator, content: &Content) -> Result<(), WriteError> {
    check_content(content)?;
    write_file(path, |out| create(out, content))
}

fn check_content(content: &Content) -> Result<(), WriteError> {
    let Content { vertices, cells, others, fields, .. } = content;
    check_finite(vertices)?;
    check_length("triangle families", cells.triangle_family.len(), cells.triangles.len())?;
    check_length("quadrilateral families", others.quadrilateral_family.len(), others.quadrilaterals.len())?;
    check_vertices("tet", cells.tets, vertices.len())?;
    check_vertices("triangle", cells.triangles, vertices.len())?;
    check_vertices("pyramid", &others.pyramids, vertices.len())?;
    check_vertices("prism", &others.prisms, vertices.len())?;
    check_vertices("hexahedron", &others.hexahedra, vertices.len())?;
    check_vertices("quadrilateral", &others.quadrilaterals, vertices.len())?;
    if let Some(displacement) = fields.displacement {
        check_length("displacement", displacement.len(), vertices.len())?;
    }
    match fields.beta {
        Some(beta) => check_length("beta", beta.len(), cells.tets.len()),
        None => Ok(()),
    }
}

fn write_file(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), WriteError> {
    let gzipped = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"));
    let result = write_atomically(path, |out| {
        if !gzipped {
            return write(out);
        }
        let mut gzip = Gzip::new(out);
        write(&mut gzip)?;
        gzip.finish()
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
