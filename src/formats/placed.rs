//! [`Placed`]: the files of a set that have their names, which can be taken back.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::disk::{Sync, entries_to_disk};
use super::names_lock::NamesLock;
use super::real_path::is_at;

/// A file of a set could not get its name. No file of the set has its name then.
#[derive(Debug, Error)]
#[error("cannot write {}: {source}", path.display())]
pub struct PlaceError {
    /// The file.
    pub path: PathBuf,
    /// The error of the system.
    pub source: io::Error,
}

/// Files that have their names.
#[derive(Debug)]
pub struct Placed {
    /// The files, open: so no later file gets the identity of one of them.
    pub(super) files: Vec<(PathBuf, fs::File)>,
    pub(super) folders: NewFolders,
}

impl Placed {
    /// Brings the entries of the folders to the disk, each folder once.
    pub(super) fn names_to_disk(&self, sync: &mut Sync) -> Result<(), PlaceError> {
        let made = self.folders.0.iter();
        let folders: BTreeSet<&Path> =
            self.files.iter().map(|(path, _)| path).chain(made).filter_map(|path| path.parent()).collect();
        let mut folders = folders.into_iter();
        folders.try_for_each(|folder| {
            entries_to_disk(folder, sync).map_err(|source| PlaceError { path: folder.to_path_buf(), source })
        })
    }

    /// Removes the files again, because something else of the same result failed. A file that
    /// another process has put in the place of one of them stays.
    pub fn withdraw(self) {
        let _lock = NamesLock::of(self.files.iter().map(|(path, _)| path.as_path()));
        for (path, file) in &self.files {
            if is_at(file, path) {
                let _ = fs::remove_file(path);
            }
        }
    }
}

/// Folders that were made for files, outermost first. Dropping them removes those that are empty:
/// `remove_dir` fails on a folder that holds something.
#[derive(Debug, Default)]
pub(super) struct NewFolders(pub(super) Vec<PathBuf>);

impl Drop for NewFolders {
    fn drop(&mut self) {
        for folder in self.0.iter().rev() {
            let _ = fs::remove_dir(folder);
        }
    }
}
