//! Folders for outputs, and files other than meshes.
//!
//! Outputs are checked before anything is computed. A file is written whole or not at all.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::SessionError;
use crate::formats::{self, write_atomically};

/// A folder for outputs. Dropping it removes the folders it made, if they are empty.
#[derive(Debug, Default)]
pub struct Folder {
    /// The folders that were made, outermost first.
    made: Vec<PathBuf>,
}

impl Folder {
    /// Makes the folder and its parents, if they are missing.
    ///
    /// # Errors
    /// [`SessionError::CannotWrite`]: a folder cannot be made, or the path is a file.
    pub fn make(path: &Path) -> Result<Self, SessionError> {
        let missing: Vec<_> =
            path.ancestors().take_while(|path| !path.as_os_str().is_empty() && !path.exists()).collect();
        let mut folder = Self::default();
        for ancestor in missing.into_iter().rev() {
            fs::create_dir(ancestor).map_err(|error| cannot_write(path, error))?;
            folder.made.push(ancestor.to_path_buf());
        }
        if !path.is_dir() {
            return Err(cannot_write(path, io::ErrorKind::NotADirectory.into()));
        }
        Ok(folder)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
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

/// Checks that no output overwrites an input or another output.
///
/// # Errors
/// [`SessionError::Overwrites`] or [`SessionError::TwoOutputs`], for the first such output.
pub fn check_distinct(inputs: &[PathBuf], outputs: &[&Path]) -> Result<(), SessionError> {
    let same = |a: &Path, b: &Path| {
        // A mesh may be a folder, and the other path may be a file in this folder.
        let within = |a: &Path, b: &Path| a.is_dir() && b.starts_with(a);
        let real = (fs::canonicalize(a), fs::canonicalize(b));
        a == b || matches!(real, (Ok(a), Ok(b)) if (a == b && a.is_file()) || within(&a, &b) || within(&b, &a))
    };
    for (index, output) in outputs.iter().enumerate() {
        if let Some(input) = inputs.iter().find(|input| same(input, output)) {
            let (output, input) = (output.to_path_buf(), input.clone());
            return Err(SessionError::Overwrites { output, input });
        }
        if outputs[..index].iter().any(|other| same(other, output)) {
            return Err(SessionError::TwoOutputs { path: output.to_path_buf() });
        }
    }
    Ok(())
}

/// Removes a file, if the path is one. A link stays, and the file that the link names is emptied.
///
/// # Errors
/// [`SessionError::CannotWrite`]: the file cannot be removed.
pub fn remove_file(path: &Path) -> Result<(), SessionError> {
    // Pipes and devices hold no earlier result.
    if !path.is_file() {
        return Ok(());
    }
    let removed = if path.is_symlink() { fs::write(path, "") } else { fs::remove_file(path) };
    match removed {
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

#[cfg(test)]
mod tests {
    use super::*;

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
}
