//! Files that appear whole or not at all, and sets of files that appear together.
//!
//! Each file is written under a temporary name in its folder. [`FileSet::place`] gives the files
//! their names when all of them are complete and on the disk. So a power cut leaves the old file or
//! the whole new one, never a part of it.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use tempfile::NamedTempFile;
use thiserror::Error;

use super::real_path::{is_special, real_path};
use super::temporary::{remove_abandoned, temporary};

/// Files that get their names together. Until then they are complete under temporary names. A set
/// that is dropped leaves nothing behind.
#[derive(Default)]
pub struct FileSet<'a> {
    files: Vec<Waiting<'a>>,
    /// Files that would hide a file of the set from a reader.
    stale: Vec<PathBuf>,
    folders: NewFolders,
    summed: bool,
}

/// A file that waits for its name.
struct Waiting<'a> {
    /// The path as the user named it.
    path: PathBuf,
    content: Content<'a>,
}

enum Content<'a> {
    /// A complete temporary file.
    Complete { file: NamedTempFile, target: PathBuf, sha256: Option<String> },
    /// The writer of a pipe or a device, which cannot be replaced.
    Direct(Box<Writer<'a>>),
}

type Writer<'a> = dyn FnOnce(&mut dyn Write) -> io::Result<()> + 'a;

/// A file of a set could not get its name. No file of the set has its name then.
#[derive(Debug, Error)]
#[error("cannot write {}: {source}", path.display())]
pub struct PlaceError {
    /// The file.
    pub path: PathBuf,
    /// The error of the system.
    pub source: io::Error,
}

impl<'a> FileSet<'a> {
    /// A set that computes the checksums of its files.
    pub fn with_checksums() -> Self {
        Self { summed: true, ..Self::default() }
    }

    /// Adds a file, and writes it under a temporary name in the folder of `path`.
    ///
    /// The file will have the permissions of any new file. A symbolic link will still point to the
    /// replaced file. A path that is no regular file (`/dev/stdout`, a pipe) is written when the
    /// set is placed.
    ///
    /// # Errors
    /// The error of `write`, or an error of making or filling the temporary file.
    pub fn add(&mut self, path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()> + 'a) -> io::Result<()> {
        let content = if is_special(path) {
            Content::Direct(Box::new(write))
        } else {
            let (target, folder) = target(path)?;
            let file = temporary(&folder)?;
            let mut summed = Summed { file: file.as_file(), sha256: self.summed.then(Sha256::new) };
            let mut out = BufWriter::with_capacity(1 << 16, &mut summed);
            write(&mut out)?;
            out.flush()?;
            drop(out);
            let sha256 = summed.sha256.map(hex);
            Content::Complete { file, target, sha256 }
        };
        self.files.push(Waiting { path: path.to_path_buf(), content });
        Ok(())
    }

    /// Removes a file when the set is placed, before the first file has its name. Of a link the
    /// link is removed. Nothing happens if there is no such file.
    pub(super) fn remove_stale(&mut self, path: PathBuf) {
        self.stale.push(path);
    }

    /// Makes a folder for files of the set, if it is missing.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub(super) fn make_folder(&mut self, path: &Path) -> io::Result<()> {
        let (target, _) = target(path)?;
        match fs::create_dir(&target) {
            Ok(()) => self.folders.0.push(target),
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists || !target.is_dir() => return Err(error),
            Err(_) => {}
        }
        Ok(())
    }

    /// The files of the set with their SHA-256 sums, in hexadecimal digits. A file has no sum if it
    /// is a pipe or a device, or if the set computes none.
    pub fn files(&self) -> impl Iterator<Item = (&Path, Option<&str>)> {
        self.files.iter().map(|file| match &file.content {
            Content::Complete { sha256, .. } => (file.path.as_path(), sha256.as_deref()),
            Content::Direct(_) => (file.path.as_path(), None),
        })
    }

    /// Gives all files their names, in the order in which they were added. Before the first file
    /// gets its name, the contents of all are on the disk, and afterwards the names are. Pipes and
    /// devices are written last.
    ///
    /// # Errors
    /// A file cannot be brought to the disk or cannot get its name, or a pipe or a device cannot be
    /// written. The files that had got their names are removed.
    pub fn place(self) -> Result<Placed, PlaceError> {
        self.place_with(&mut |_, file| file.sync_all())
    }

    /// [`FileSet::place`] with the function that brings a file or a folder to the disk, given its
    /// path.
    fn place_with(self, sync: &mut Sync) -> Result<Placed, PlaceError> {
        for Waiting { path, content } in &self.files {
            if let Content::Complete { file, .. } = content {
                to_disk(path, file.as_file(), sync).map_err(|source| PlaceError { path: path.clone(), source })?;
            }
        }
        for path in self.stale {
            match fs::remove_file(&path) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => return Err(PlaceError { path, source }),
                _ => {}
            }
        }
        let mut placed = Placed { files: Vec::new(), folders: self.folders };
        let is_complete = |file: &Waiting| matches!(file.content, Content::Complete { .. });
        let (complete, direct): (Vec<_>, Vec<_>) = self.files.into_iter().partition(is_complete);
        let mut waiting = complete.into_iter().chain(direct);
        while let Some(Waiting { path, content }) = waiting.next() {
            let done = match content {
                Content::Complete { file, target, .. } => match file.persist(&target) {
                    Ok(_) => {
                        placed.files.push(target);
                        Ok(())
                    }
                    Err(error) => Err(error.error),
                },
                Content::Direct(write) => write_directly(&path, write),
            };
            if let Err(source) = done {
                drop(waiting);
                placed.withdraw();
                return Err(PlaceError { path, source });
            }
        }
        if let Err(error) = placed.names_to_disk(sync) {
            placed.withdraw();
            return Err(error);
        }
        Ok(placed)
    }
}

/// Brings a file or a folder to the disk, given its path.
pub(crate) type Sync<'a> = dyn FnMut(&Path, &fs::File) -> io::Result<()> + 'a;

/// Brings the name of a file to the disk: the entries of its folder.
///
/// # Errors
/// The error of `sync`.
pub(crate) fn folder_to_disk(path: &Path, sync: &mut Sync) -> io::Result<()> {
    path.parent().map_or(Ok(()), |folder| entries_to_disk(folder, sync))
}

/// Brings the entries of a folder to the disk, where the system can.
fn entries_to_disk(folder: &Path, sync: &mut Sync) -> io::Result<()> {
    // A folder that takes files need not be readable. Windows opens no folders.
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    match fs::File::open(here) {
        Ok(file) => to_disk(folder, &file, sync),
        Err(_) => Ok(()),
    }
}

/// Brings a file to the disk, where the file system can.
///
/// # Errors
/// The error of `sync`, if the file system knows the request.
pub(crate) fn to_disk(path: &Path, file: &fs::File, sync: &mut Sync) -> io::Result<()> {
    match sync(path, file) {
        // Some network file systems know no such request.
        Err(error) if matches!(error.kind(), io::ErrorKind::Unsupported | io::ErrorKind::InvalidInput) => Ok(()),
        result => result,
    }
}

/// Files that have their names.
#[derive(Debug)]
pub struct Placed {
    files: Vec<PathBuf>,
    folders: NewFolders,
}

impl Placed {
    /// Brings the entries of the folders to the disk, each folder once.
    fn names_to_disk(&self, sync: &mut Sync) -> Result<(), PlaceError> {
        let made = self.folders.0.iter();
        let folders: BTreeSet<&Path> = self.files.iter().chain(made).filter_map(|path| path.parent()).collect();
        let mut folders = folders.into_iter();
        folders.try_for_each(|folder| {
            entries_to_disk(folder, sync).map_err(|source| PlaceError { path: folder.to_path_buf(), source })
        })
    }

    /// Removes the files again, because something else of the same result failed.
    pub fn withdraw(self) {
        for file in &self.files {
            let _ = fs::remove_file(file);
        }
    }
}

/// Folders that were made for files, outermost first. Dropping them removes those that are empty:
/// `remove_dir` fails on a folder that holds something.
#[derive(Debug, Default)]
struct NewFolders(Vec<PathBuf>);

impl Drop for NewFolders {
    fn drop(&mut self) {
        for folder in self.0.iter().rev() {
            let _ = fs::remove_dir(folder);
        }
    }
}

/// A file whose contents are summed as they are written.
struct Summed<'a> {
    file: &'a fs::File,
    sha256: Option<Sha256>,
}

impl Write for Summed<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n_written = self.file.write(bytes)?;
        if let Some(sha256) = &mut self.sha256 {
            sha256.update(&bytes[..n_written]);
        }
        Ok(n_written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// The SHA-256 sum of a file, in hexadecimal digits, as `sha256sum` prints it.
///
/// # Errors
/// The file cannot be read, or is no regular file.
pub fn sha256_of(path: &Path) -> io::Result<String> {
    if is_special(path) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "a pipe or a device cannot be read twice"));
    }
    let mut file = fs::File::open(path)?;
    let (mut sha256, mut block) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut block) {
            Ok(0) => return Ok(hex(sha256)),
            Ok(n_read) => sha256.update(&block[..n_read]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

fn hex(sha256: Sha256) -> String {
    sha256.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Writes a file through a temporary one in the same folder. The temporary file takes the path's
/// name when it is complete; see [`FileSet::add`].
///
/// If `write` fails, or the process dies, the old file at `path` is untouched.
///
/// # Errors
///
/// The error of `write`, or an error of making, filling or renaming the temporary file.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut files = FileSet::default();
    files.add(path, write)?;
    files.place().map(drop).map_err(|error| error.source)
}

/// Checks that [`write_atomically`] to `path` can work: makes and removes an empty temporary file
/// beside it. Removes the temporary files that killed processes left there.
pub(crate) fn check(path: &Path) -> io::Result<()> {
    if is_special(path) {
        return Ok(());
    }
    if path.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    check_takes_files(&target(path)?.1)
}

/// Checks that files can be written into the folder at `path`, which is made if it is missing.
/// Removes the temporary files that killed processes left there.
pub(super) fn check_folder(path: &Path) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => check_takes_files(path),
        Ok(_) => Err(io::ErrorKind::NotADirectory.into()),
        Err(_) => check_takes_files(&target(path)?.1),
    }
}

fn check_takes_files(folder: &Path) -> io::Result<()> {
    remove_abandoned(folder);
    temporary(folder).map(drop)
}

fn write_directly(path: &Path, write: Box<Writer>) -> io::Result<()> {
    let mut out = BufWriter::new(fs::OpenOptions::new().append(true).open(path)?);
    write(&mut out)?;
    out.flush()
}

/// The file to replace and its folder. Symbolic links are followed.
fn target(path: &Path) -> io::Result<(PathBuf, PathBuf)> {
    let target = real_path(path);
    let folder = match target.parent() {
        Some(folder) => folder.to_path_buf(),
        None => return Err(io::ErrorKind::IsADirectory.into()),
    };
    if !folder.is_dir() {
        let named = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(&folder);
        let advice = if named.exists() { "" } else { ": make it first" };
        let message = format!("there is no folder {}{advice}", named.display());
        return Err(io::Error::new(io::ErrorKind::NotFound, message));
    }
    Ok((target, folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two files in a folder that is there, and one in a new folder.
    fn set<'a>(folder: &Path) -> (FileSet<'a>, [PathBuf; 3]) {
        let paths = ["a", "new/b", "c"].map(|name| folder.join(name));
        let mut files = FileSet::default();
        files.make_folder(&folder.join("new")).unwrap();
        for path in &paths {
            files.add(path, |out| out.write_all(b"contents")).unwrap();
        }
        (files, paths)
    }

    /// All contents are on the disk before the first file has its name, and the folders after all
    /// have theirs.
    #[test]
    fn contents_are_on_the_disk_before_names() {
        let here = tempfile::tempdir().unwrap();
        let folder = here.path().canonicalize().unwrap();
        let (files, paths) = set(&folder);
        let mut synced = Vec::new();
        let placed = files.place_with(&mut |path, file| {
            let n_named = paths.iter().filter(|path| path.exists()).count();
            assert_eq!(n_named, if file.metadata()?.is_dir() { 3 } else { 0 }, "{}", path.display());
            synced.push(path.to_path_buf());
            Ok(())
        });
        placed.unwrap();
        assert_eq!(synced, [&paths[..], &[folder.clone(), folder.join("new")]].concat());
    }

    /// A disk that fails, at each file and each folder.
    #[test]
    fn no_name_is_given_where_the_disk_fails() {
        for failing in 0..5 {
            let here = tempfile::tempdir().unwrap();
            let (files, _) = set(here.path());
            let mut place = 0..;
            let result = files.place_with(&mut |_, _| match place.next() {
                Some(at) if at == failing => Err(io::Error::other("the disk is broken")),
                _ => Ok(()),
            });
            assert!(result.unwrap_err().to_string().contains("the disk is broken"));
            let left: Vec<_> = fs::read_dir(here.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
            assert!(left.is_empty(), "{failing}: {left:?}");
        }
        // A file system that knows no such request is no failure.
        let here = tempfile::tempdir().unwrap();
        let (files, paths) = set(here.path());
        files.place_with(&mut |_, _| Err(io::ErrorKind::Unsupported.into())).unwrap();
        assert!(paths.iter().all(|path| path.exists()));
    }
}
