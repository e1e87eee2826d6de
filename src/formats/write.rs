//! Writes a mesh: its source file with other coordinates, or a new file.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::aflr3;
use super::atomic::{self, FileSet};
use super::document::{Companion, SourceFile, check_single};
use super::error::WriteError;
use super::format::{Create, Format, needs_folder};
use super::input::read_file;
use super::mapbc;
use super::new_file::{Cells, Fields, NewFile, check_finite, check_length};
use super::openfoam;
use super::out::{add_file, in_blocks};
use super::read::MeshFile;
use super::table::{format_of, known};
use crate::mesh::{measures, middle_of_cell};

impl MeshFile {
    /// Writes the mesh with its vertices at `vertices` `[n_vertices]` to `path`. The extension of
    /// `path` selects the format; the file is gzipped if it ends in `.gz`.
    ///
    /// In the format of the source file only the changed coordinates are replaced in it. In another
    /// format a new file holds the mesh, its families and perhaps `fields`; [`MeshFile::losses`]
    /// lists everything it does not hold. The file appears whole or not at all.
    ///
    /// # Errors
    ///
    /// - [`WriteError::UnknownFormat`], [`WriteError::Stale`]: as for [`MeshFile::check_output`].
    /// - [`WriteError::Length`]: `vertices` or a field has another length than the mesh.
    /// - [`WriteError::NotFinite`]: a coordinate is NaN or infinite.
    /// - [`WriteError::VertexOutOfRange`]: the mesh is broken.
    /// - [`WriteError::Rounded`]: the file is in single precision, which inverts cells.
    /// - [`WriteError::Io`]: the file could not be written.
    pub fn write(&self, path: &Path, vertices: &[DVec3], fields: &Fields) -> Result<(), WriteError> {
        let mut files = FileSet::default();
        self.add_to(&mut files, path, vertices, fields)?;
        Ok(files.place().map(drop)?)
    }

    /// [`MeshFile::write`] into a set of files that get their names together.
    ///
    /// # Errors
    ///
    /// [`WriteError`], as for [`MeshFile::write`].
    pub fn add_to<'a>(
        &'a self,
        files: &mut FileSet<'a>,
        path: &Path,
        vertices: &'a [DVec3],
        fields: &Fields<'a>,
    ) -> Result<(), WriteError> {
        let (format, extension) = output_format(path)?;
        check_length("vertices", vertices.len(), self.mesh.vertices.len())?;
        self.check_rounding(path, vertices)?;
        if format.is_folder() && names_folder(path) {
            return self.add_folder(files, path, format, vertices);
        }
        if let Some(twin) = twin(path) {
            files.remove_stale(twin);
        }
        if let Some(document) = self.source(format, extension) {
            check_finite(vertices)?;
            add_companion(files, path, document.companion.as_ref())?;
            return add_file(files, path, move |out| document.write(out, vertices));
        }
        let new_file = self.new_file(vertices, *fields, extension);
        let create = format.creator(path)?;
        new_file.check()?;
        add_companion(files, path, format.companion.map(|companion| companion(&new_file)).as_ref())?;
        add_file(files, path, move |out| create(out, &new_file))
    }

    /// [`MeshFile::write`] into `out`, never gzipped. `path` only selects the format. Files that
    /// belong to the mesh file are not written.
    ///
    /// # Errors
    ///
    /// [`WriteError`], as for [`MeshFile::write`].
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
                in_blocks(out, |out| document.write(out, vertices))
            }
            None => {
                let new_file = self.new_file(vertices, *fields, extension);
                new_file.check()?;
                let create = format.creator(path)?;
                in_blocks(out, |out| create(out, &new_file))
            }
        };
        written.map_err(|source| WriteError::Io { path: path.into(), source })
    }

    /// Checks that [`MeshFile::write`] to `path` can work, before anything is computed: the format
    /// is known, and the folder exists and accepts files.
    ///
    /// # Errors
    ///
    /// - [`WriteError::UnknownFormat`]: no format has this extension.
    /// - [`WriteError::Stale`]: a `.mapbc` file beside `path` has other names for the families, or
    ///   other boundary conditions than the mesh.
    /// - [`WriteError::Io`]: `path` is a folder, or its folder is missing or accepts no new files.
    pub fn check_output(&self, path: &Path) -> Result<(), WriteError> {
        let (format, extension) = output_format(path)?;
        let checked = match format.is_folder() && names_folder(path) {
            true => atomic::check_folder(path),
            false => {
                if self.source(format, extension).is_none() {
                    format.creator(path)?;
                }
                self.check_beside(&[path])?;
                atomic::check(path)
            }
        };
        checked.map_err(|source| WriteError::Io { path: path.into(), source })
    }

    /// Checks that no file beside `paths` gives other names or conditions to the families of the
    /// meshes there: neither an existing file nor the file of another of these meshes. The paths
    /// may differ from the path of [`MeshFile::check_output`].
    ///
    /// # Errors
    ///
    /// - [`WriteError::UnknownFormat`]: no format has this extension.
    /// - [`WriteError::Stale`]: a `.mapbc` file beside a path has other names for the families, or
    ///   other boundary conditions than the mesh.
    /// - [`WriteError::Shared`]: two of these meshes need the same `.mapbc` file with different
    ///   names or conditions.
    pub fn check_beside(&self, paths: &[&Path]) -> Result<(), WriteError> {
        let mut named: Vec<(PathBuf, Companion, &Path)> = Vec::new();
        for &path in paths {
            let (format, extension) = output_format(path)?;
            if format.is_folder() {
                continue;
            }
            let new_file = self.new_file(&self.mesh.vertices, Fields::default(), extension);
            let source = self.source(format, extension);
            let created = format.companion.filter(|_| source.is_none()).map(|companion| companion(&new_file));
            let Some(companion) = source.map_or(created.as_ref(), |document| document.companion.as_ref()) else {
                continue;
            };
            check_companion(path, Some(companion))?;
            if companion.names.is_empty() {
                continue;
            }
            let beside = (companion.path)(path);
            if let Some((beside, _, first)) =
                named.iter().find(|(other, of_other, _)| *other == beside && !mapbc::agree(of_other, companion))
            {
                let [beside, first, second] = [beside, *first, path].map(Path::to_path_buf);
                return Err(WriteError::Shared { path: beside, first, second });
            }
            named.push((beside, companion.clone(), path));
        }
        Ok(())
    }

    /// Removes the names of the families that an earlier result at `path` has left, when a set is
    /// placed that has no mesh there: a file as it would be written now. One that differs, or that
    /// belongs to another mesh too, stays.
    ///
    /// # Errors
    ///
    /// [`WriteError`]: the extension belongs to no format.
    pub(crate) fn remove_names_beside(&self, files: &mut FileSet, path: &Path) -> Result<(), WriteError> {
        let (format, extension) = output_format(path)?;
        let created = || Some(format.companion?(&self.new_file(&self.mesh.vertices, Fields::default(), extension)));
        let companion = match self.source(format, extension) {
            Some(document) => document.companion.clone(),
            None => created(),
        };
        let Some(Companion { path: beside, bytes: Some(bytes), .. }) = companion else { return Ok(()) };
        let beside = beside(path);
        let is_own = || read_file(&beside).is_ok_and(|there| there == bytes);
        if !path.exists() && is_own() && !has_mesh(&beside) {
            files.remove_stale(beside);
        }
        Ok(())
    }

    /// The file beside the mesh file at `path` that the mesh was read from too: the names of its
    /// families.
    pub fn file_beside(&self, path: &Path) -> Option<PathBuf> {
        let companion = self.document.as_deref()?.companion.as_ref()?;
        Some((companion.path)(path)).filter(|path| path.exists())
    }

    /// Everything that the file made by [`MeshFile::write`] at `path` does not hold, or holds in
    /// another form, in words. If the source file is written back, this is what changes in it
    /// besides its coordinates, if anything.
    ///
    /// # Errors
    ///
    /// [`WriteError::UnknownFormat`]: no format has this extension.
    pub fn losses(&self, path: &Path) -> Result<Vec<String>, WriteError> {
        let (format, extension) = output_format(path)?;
        if let Some(document) = self.source(format, extension) {
            return Ok(document.changes.clone());
        }
        let new_file = self.new_file(&self.mesh.vertices, Fields::default(), extension);
        let beside = self.document.iter().flat_map(|document| &document.beside);
        let mut losses: Vec<String> = beside.map(|what| format!("{what}: not carried into the new file")).collect();
        losses.extend((format.limits)(&new_file));
        // A file that is there stays, with its conditions.
        let beside = format.companion.map(|companion| (companion(&new_file).path)(path));
        if beside.is_some_and(|beside| mapbc::read(&beside).is_ok_and(|there| there.has_conditions())) {
            losses.retain(|loss| loss != mapbc::NO_CONDITIONS);
        }
        Ok(losses)
    }

    /// Adds a mesh that is a folder: the source folder with other points, or a new folder. The
    /// points, without which the folder is no mesh, are last.
    fn add_folder(
        &self,
        files: &mut FileSet,
        path: &Path,
        format: &Format,
        vertices: &[DVec3],
    ) -> Result<(), WriteError> {
        let io = |source| WriteError::Io { path: path.into(), source };
        let contents = match (self.source(format, ""), &format.create) {
            (Some(document), _) => {
                check_finite(vertices)?;
                let mut points = Vec::new();
                in_blocks(&mut points, |out| document.write(out, vertices)).map_err(io)?;
                let mut contents = document.siblings.clone();
                contents.push(("points".to_string(), points));
                contents
            }
            (None, Create::Folder(create)) => {
                let new_file = self.new_file(vertices, Fields::default(), "");
                new_file.check()?;
                create(&new_file).map_err(io)?
            }
            (None, _) => return Err(needs_folder(path)),
        };
        files.make_folder(path).map_err(io)?;
        let is_written = |name: &str| contents.iter().any(|(written, _)| written == name);
        let twins: Vec<String> = contents.iter().map(|(name, _)| openfoam::twin(name)).collect();
        twins.iter().filter(|twin| !is_written(twin)).for_each(|twin| files.remove_stale(path.join(twin)));
        for (name, bytes) in contents {
            files.add(&path.join(name), move |out| out.write_all(&bytes)).map_err(io)?;
        }
        Ok(())
    }

    /// The source file, if it has this format and variant.
    fn source(&self, format: &Format, extension: &str) -> Option<&SourceFile> {
        let document = self.document.as_deref()?;
        let same_variant = document.extension == extension || format.is_folder();
        (document.format == format.name && same_variant).then_some(document)
    }

    /// Checks that a file in single precision holds a mesh without inverted cells. A mesh that has
    /// some already may be written.
    fn check_rounding(&self, path: &Path, vertices: &[DVec3]) -> Result<(), WriteError> {
        let (format, extension) = output_format(path)?;
        let is_single = match self.source(format, extension) {
            Some(document) => document.is_single(),
            None => aflr3::is_single(extension),
        };
        if !is_single {
            return Ok(());
        }
        let cells = self.cells();
        let rounded: Vec<DVec3> = vertices.iter().map(|at| at.as_vec3().as_dvec3()).collect();
        // A broken mesh has its own error, and so has one that is too small or too large.
        let is_broken = cells.cells().flatten().any(|&vertex| vertex as usize >= vertices.len());
        if is_broken || check_single(vertices).is_err() || rounded.iter().any(|at| !at.is_finite()) {
            return Ok(());
        }
        if measures(cells, vertices, None).iter().any(|cell| cell.inverted) {
            return Ok(());
        }
        let bad: Vec<bool> = measures(cells, &rounded, None).iter().map(|cell| cell.inverted).collect();
        let Some(first) = bad.iter().position(|&is_bad| is_bad) else { return Ok(()) };
        let at = middle_of_cell(cells.cell(cells.name(first)), vertices);
        let count = bad.iter().filter(|&&is_bad| is_bad).count();
        Err(WriteError::Rounded { path: path.into(), count, at })
    }

    fn new_file<'a>(&'a self, vertices: &'a [DVec3], fields: Fields<'a>, extension: &'static str) -> NewFile<'a> {
        NewFile { vertices, cells: Cells::of(&self.mesh), others: &self.others, fields, extension }
    }
}

fn output_format(path: &Path) -> Result<(&'static Format, &'static str), WriteError> {
    format_of(path).ok_or_else(|| WriteError::UnknownFormat { path: path.into(), known: known() })
}

/// The file beside an output that a reader could take for it: a zipped one beside a plain one, or
/// the other way round. `None` if the mesh at `path` is no file of a folder. Writing the mesh
/// removes the file.
pub fn twin(path: &Path) -> Option<PathBuf> {
    let (format, _) = format_of(path)?;
    let name = path.file_name()?.to_str()?;
    (format.is_folder() && !names_folder(path)).then(|| path.with_file_name(openfoam::twin(name)))
}

/// Whether a path in a folder's format names the folder, and not the file in it.
fn names_folder(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    name.starts_with(openfoam::NAMES[0])
}

/// Whether a mesh has its names in this `.mapbc` file.
fn has_mesh(names: &Path) -> bool {
    let is_of_mesh = |path: PathBuf| {
        let format = format_of(&path).filter(|(format, _)| format.companion.is_some());
        format.is_some_and(|(format, _)| mapbc::path_beside(&path, format.extensions) == names)
    };
    let folder = names.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let beside = |entry: fs::DirEntry| is_of_mesh(names.with_file_name(entry.file_name()));
    // A folder that cannot be read may hold one.
    fs::read_dir(folder).map_or(true, |entries| entries.flatten().any(beside))
}

/// Checks that an existing companion file beside `path` belongs to this mesh.
fn check_companion(path: &Path, companion: Option<&Companion>) -> Result<(), WriteError> {
    companion.map_or(Ok(()), |companion| mapbc::check(&(companion.path)(path), companion))
}

/// Adds the companion of a file. An existing companion is kept, because its owner may have added to
/// it.
fn add_companion(files: &mut FileSet, path: &Path, companion: Option<&Companion>) -> Result<(), WriteError> {
    check_companion(path, companion)?;
    let Some((companion, bytes)) = companion.and_then(|companion| Some((companion, companion.bytes.clone()?))) else {
        return Ok(());
    };
    let path = (companion.path)(path);
    // Two meshes of a set may share a companion.
    if files.files().chain(files.kept()).any(|(other, _)| other == path) {
        return Ok(());
    }
    let added = match path.exists() {
        true => files.keep(&path, &bytes),
        false => files.add(&path, move |out| out.write_all(&bytes)),
    };
    added.map_err(|source| WriteError::Io { path, source })
}
