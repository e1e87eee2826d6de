//! Folders for outputs, and files other than meshes.
//!
//! Outputs are checked before anything is computed. A file is written whole or not at all.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::SessionError;
use crate::formats::{self, FileSet, SurfaceFile, Sync, folder_to_disk, is_special, real_path, write_atomically};

/// How often a folder is made again that another job removes meanwhile.
const ATTEMPTS: usize = 1000;

/// A folder for outputs. Dropping it removes the folders it made, if they are empty.
#[derive(Debug, Default)]
pub struct Folder {
    /// A file in the folder, so that no other job removes the folder meanwhile.
    held: Option<NamedTempFile>,
    /// The folders that were made, outermost first.
    made: Vec<PathBuf>,
}

impl Folder {
    /// Makes the folder and its parents, if they are missing, and brings their names to the disk:
    /// results in a folder whose name a power cut takes would be lost. Other jobs may make and
    /// remove the same folders meanwhile.
    ///
    /// # Errors
    /// [`SessionError::CannotWrite`]: a folder cannot be made, or the path is a file.
    pub fn make(path: &Path) -> Result<Self, SessionError> {
        Self::make_with(path, &mut |_, file| file.sync_all())
    }

    /// [`Self::make`] with a function that brings the entries of a folder to the disk.
    fn make_with(path: &Path, sync: &mut Sync) -> Result<Self, SessionError> {
        let mut folder = Self::default();
        let mut attempts = 0..ATTEMPTS;
        loop {
            let made = folder.make_missing(path, sync).and_then(|()| match formats::temporary_file(path) {
                Ok(held) => Ok(Some(held)),
                Err(error) if error.kind() == io::ErrorKind::NotFound => Err(error),
                // The outputs may be elsewhere, and the checks of their places tell better.
                Err(_) => Ok(None),
            });
            match made {
                Ok(held) => {
                    folder.held = held;
                    return Ok(folder);
                }
                // Another job has removed the folder or a parent, which it had made and not used.
                Err(error) if error.kind() == io::ErrorKind::NotFound && attempts.next().is_some() => {}
                Err(error) => return Err(cannot_write(path, error)),
            }
        }
    }

    /// Makes the folders that are missing.
    fn make_missing(&mut self, path: &Path, sync: &mut Sync) -> io::Result<()> {
        let exists = |path: &Path| path.as_os_str().is_empty() || path.exists();
        let missing: Vec<_> = path.ancestors().take_while(|path| !exists(path)).collect();
        for ancestor in missing.into_iter().rev() {
            match fs::create_dir(ancestor) {
                Ok(()) => {
                    self.made.push(ancestor.to_path_buf());
                    folder_to_disk(ancestor, sync)?;
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => match fs::symlink_metadata(ancestor) {
                    Ok(_) if ancestor.is_dir() => {}
                    Ok(metadata) if !metadata.is_dir() => return Err(error),
                    // Another job has removed it since.
                    _ => return Err(io::ErrorKind::NotFound.into()),
                },
                Err(error) => return Err(error),
            }
        }
        if path.is_dir() || !path.exists() { Ok(()) } else { Err(io::ErrorKind::NotADirectory.into()) }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        drop(self.held.take());
        // `remove_dir` fails on a folder that holds something, so no output is lost.
        for path in self.made.iter().rev() {
            let _ = fs::remove_dir(path);
        }
    }
}

pub(super) fn cannot_write(path: &Path, source: io::Error) -> SessionError {
    SessionError::CannotWrite { path: path.to_path_buf(), source }
}

/// Checks that a file can be written. The check makes and removes a temporary file in the same
/// folder.
///
/// # Errors
/// [`SessionError::CannotWrite`]: the path is a folder, or its parent is missing or takes no files.
pub fn check_writable(path: &Path) -> Result<(), SessionError> {
    formats::check_writable(path).map_err(|error| cannot_write(path, error))
}

/// Files that are read. Their places are looked up once, for any number of outputs.
pub struct ReadFiles {
    /// The files by the places that they name.
    by_place: BTreeMap<PathBuf, PathBuf>,
    /// The places that are folders: a mesh may be one.
    folders: Vec<PathBuf>,
}

impl ReadFiles {
    /// Looks up the places of these files.
    pub fn new(inputs: &[PathBuf]) -> Self {
        let mut by_place = BTreeMap::new();
        for input in inputs {
            by_place.entry(real_path(&formats::mesh_path(input))).or_insert_with(|| input.clone());
        }
        let folders = by_place.keys().filter(|place| place.is_dir()).cloned().collect();
        Self { by_place, folders }
    }

    /// The file that would be lost if an output were written, whatever the spelling of the paths.
    pub fn lost_to(&self, output: &Path) -> Option<&PathBuf> {
        let place = real_path(output);
        // Writing an output removes the file that could be taken for it.
        let twin = formats::twin(output).map(|twin| real_path(&twin));
        let itself = self.by_place.get(&place).or_else(|| self.by_place.get(&twin?));
        let around = || self.by_place.get(self.folders.iter().find(|folder| place.starts_with(folder))?);
        let within = || self.by_place.iter().find(|(input, _)| input.starts_with(&place)).map(|(_, input)| input);
        itself.or_else(around).or_else(|| if place.is_dir() { within() } else { None })
    }
}

/// Checks that no output overwrites an input or another output, whatever the spelling of their
/// paths.
///
/// # Errors
/// [`SessionError::Overwrites`] or [`SessionError::TwoOutputs`], for the first such output.
pub fn check_distinct(inputs: &[PathBuf], outputs: &[&Path]) -> Result<(), SessionError> {
    let read = ReadFiles::new(inputs);
    let places: Vec<PathBuf> = outputs.iter().map(|output| real_path(output)).collect();
    for (index, (output, place)) in outputs.iter().zip(&places).enumerate() {
        if let Some(input) = read.lost_to(output) {
            return Err(SessionError::Overwrites { output: output.to_path_buf(), input: input.clone() });
        }
        if !is_special(output) && places[..index].iter().any(|other| same_place(other, place)) {
            return Err(SessionError::TwoOutputs { path: output.to_path_buf() });
        }
    }
    Ok(())
}

/// Whether two places are one, or one is a file in the other, which is a folder. A mesh may be a
/// folder.
fn same_place(a: &Path, b: &Path) -> bool {
    let within = |a: &Path, b: &Path| a.is_dir() && b.starts_with(a);
    a == b || within(a, b) || within(b, a)
}

/// Removes a file, if the path is one. A link stays, and the file that the link names is removed.
///
/// # Errors
/// [`SessionError::CannotWrite`]: the file cannot be removed.
pub fn remove_file(path: &Path) -> Result<(), SessionError> {
    // Pipes and devices hold no earlier result.
    if is_special(path) || !path.is_file() {
        return Ok(());
    }
    match fs::remove_file(real_path(path)) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(cannot_write(path, error)),
        _ => Ok(()),
    }
}

/// Writes a text file, whole or not at all.
///
/// # Errors
/// [`SessionError::CannotWrite`]: the file cannot be written.
pub fn write_text(path: &Path, text: &str) -> Result<(), SessionError> {
    write_atomically(path, |out| out.write_all(text.as_bytes())).map_err(|error| cannot_write(path, error))
}

/// Writes lines of text to a file, whole or not at all.
///
/// # Errors
/// [`SessionError::CannotWrite`]: the file cannot be written.
pub fn write_lines<'t>(path: &Path, lines: impl Iterator<Item = &'t str>) -> Result<(), SessionError> {
    let mut lines = lines;
    write_atomically(path, |out| lines.try_for_each(|line| writeln!(out, "{line}")))
        .map_err(|error| cannot_write(path, error))
}

/// Writes a file of surfaces, whole or not at all.
///
/// # Errors
/// [`SessionError::CannotWrite`]: the file cannot be written.
pub fn write_surface(path: &Path, surface: &SurfaceFile) -> Result<(), SessionError> {
    let mut files = FileSet::default();
    surface.add_to(&mut files, path).map_err(|error| cannot_write(path, error))?;
    files.place().map(drop).map_err(SessionError::from)
}

/// Writes text files, all of them whole or none.
///
/// # Errors
/// [`SessionError::CannotWrite`]: a file cannot be written.
pub fn write_texts<'t>(texts: impl IntoIterator<Item = (&'t Path, &'t str)>) -> Result<(), SessionError> {
    let mut files = FileSet::default();
    for (path, text) in texts {
        files.add(path, |out| out.write_all(text.as_bytes())).map_err(|error| cannot_write(path, error))?;
    }
    files.place().map(drop).map_err(SessionError::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails if the name of a folder that was made is not brought to the disk.
    #[test]
    fn names_of_new_folders_are_brought_to_the_disk() {
        let here = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a", "a/b", "a/b/c"].map(|name| here.path().join(name));
        let mut synced = Vec::new();
        let mut note = |path: &Path, _: &fs::File| {
            synced.push(path.to_path_buf());
            Ok(())
        };
        let _first = Folder::make_with(&a, &mut note).unwrap();
        let _second = Folder::make_with(&c, &mut note).unwrap();
        let _third = Folder::make_with(&c, &mut note).unwrap();
        assert_eq!(synced, [here.path(), &a, &b]);
    }

    #[test]
    fn an_unused_folder_goes_away() {
        let here = tempfile::tempdir().unwrap();
        let (outer, inner) = (here.path().join("a"), here.path().join("a/b"));
        drop(Folder::make(&inner).unwrap());
        assert!(!outer.exists());
        let folder = Folder::make(&inner).unwrap();
        fs::write(inner.join("result"), "").unwrap();
        drop(folder);
        assert!(inner.join("result").exists());
    }

    /// Jobs that make, use and drop one folder at once. Fails if a folder that another job made
    /// meanwhile is an error, or if an unused folder of another job is removed.
    #[test]
    fn jobs_share_a_new_folder() {
        let here = tempfile::tempdir().unwrap();
        let path = here.path().join("a/b");
        std::thread::scope(|scope| {
            for job in 0..4 {
                let path = &path;
                scope.spawn(move || {
                    for round in 0..200 {
                        let folder = Folder::make_with(path, &mut |_, _| Ok(())).unwrap();
                        let result = path.join(format!("{job}.{round}"));
                        fs::write(&result, "").unwrap();
                        fs::remove_file(&result).unwrap();
                        drop(folder);
                    }
                });
            }
        });
    }
}
