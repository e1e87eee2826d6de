//! Files that appear whole or not at all, and sets of files that appear together.
//!
//! Each file is written under a temporary name in its folder. [`FileSet::place`] gives the files
//! their names when all of them are complete and on the disk. So a power cut leaves the old file or
//! the whole new one, never a part of it.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use tempfile::NamedTempFile;

use super::disk::{Sync, to_disk};
use super::placed::{NewFolders, PlaceError, Placed};
use super::real_path::{is_special, real_path};
use super::sums::{hex, sha256_of};
use super::temporary::{remove_abandoned, temporary};

/// Files that get their names together. Until then they are complete under temporary names. A set
/// that is dropped leaves nothing behind.
#[derive(Default)]
pub struct FileSet<'a> {
    files: Vec<Waiting<'a>>,
    /// Files that would hide a file of the set from a reader.
    stale: Vec<PathBuf>,
    kept: Vec<Kept>,
    folders: NewFolders,
    summed: bool,
}

/// A file that waits for its name.
struct Waiting<'a> {
    /// The path as the user named it.
    path: PathBuf,
    content: Content<'a>,
}

/// A file that is there already and stays.
struct Kept {
    /// The path as the user named it.
    path: PathBuf,
    target: PathBuf,
    sha256: Option<String>,
    /// A complete temporary file, in case the file goes.
    spare: NamedTempFile,
}

enum Content<'a> {
    /// A complete temporary file.
    Complete { file: NamedTempFile, target: PathBuf, sha256: Option<String> },
    /// The writer of a pipe or a device, which cannot be replaced.
    Direct(Box<Writer<'a>>),
}

type Writer<'a> = dyn FnOnce(&mut dyn Write) -> io::Result<()> + 'a;

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
    pub(crate) fn remove_stale(&mut self, path: PathBuf) {
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

    /// Adds a file that belongs to the set, is there already and stays as it is. If it goes before
    /// the set is placed, such as with an earlier result, it is written anew.
    ///
    /// # Errors
    /// The temporary file cannot be made or filled.
    pub(super) fn keep(&mut self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        let (target, folder) = target(path)?;
        let mut spare = temporary(&folder)?;
        spare.as_file_mut().write_all(bytes)?;
        let sha256 = if self.summed { sha256_of(path).ok() } else { None };
        self.kept.push(Kept { path: path.to_path_buf(), target, sha256, spare });
        Ok(())
    }

    /// The files that were there before and belong to the set, with their sums, as for
    /// [`FileSet::files`].
    pub fn kept(&self) -> impl Iterator<Item = (&Path, Option<&str>)> {
        self.kept.iter().map(|kept| (kept.path.as_path(), kept.sha256.as_deref()))
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
        self.place_after(|| Ok(()))
    }

    /// [`FileSet::place`] with something to be done just before the first file gets its name, such
    /// as the removal of an earlier result.
    ///
    /// - `prepare`: is called when all contents are on the disk. What it returns, such as a lock,
    ///   is kept until the files have their names; pipes and devices are written afterwards.
    ///
    /// # Errors
    /// As for [`FileSet::place`], and the error of `prepare`.
    pub(crate) fn place_after<L, E: From<PlaceError>>(
        self,
        prepare: impl FnOnce() -> Result<L, E>,
    ) -> Result<Placed, E> {
        self.place_with(prepare, &mut |_, file| file.sync_all())
    }

    /// [`FileSet::place_after`] with the function that brings a file or a folder to the disk, given
    /// its path.
    fn place_with<L, E: From<PlaceError>>(
        self,
        prepare: impl FnOnce() -> Result<L, E>,
        sync: &mut Sync,
    ) -> Result<Placed, E> {
        let complete = self.files.iter().filter_map(|waiting| match &waiting.content {
            Content::Complete { file, .. } => Some((&waiting.path, file)),
            Content::Direct(_) => None,
        });
        for (path, file) in complete.chain(self.kept.iter().map(|kept| (&kept.path, &kept.spare))) {
            to_disk(path, file.as_file(), sync).map_err(|source| PlaceError { path: path.clone(), source })?;
        }
        let mut placed = Placed { files: Vec::new(), folders: self.folders };
        let mut direct = Vec::new();
        let lock = prepare()?;
        for path in self.stale {
            match fs::remove_file(&path) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(PlaceError { path, source }.into());
                }
                _ => {}
            }
        }
        let mut complete = Vec::new();
        for Waiting { path, content } in self.files {
            match content {
                Content::Direct(write) => direct.push((path, write)),
                Content::Complete { file, target, .. } => complete.push((path, target, file)),
            }
        }
        let gone = self.kept.into_iter().filter(|kept| !kept.target.exists());
        complete.extend(gone.map(|kept| (kept.path, kept.target, kept.spare)));
        let mut result = Ok(());
        for (path, target, file) in complete {
            match file.persist(&target) {
                Ok(file) => {
                    // The lock is the sign of a temporary file.
                    let _ = file.unlock();
                    placed.files.push((target, file));
                }
                Err(error) => {
                    result = Err(PlaceError { path, source: error.error });
                    break;
                }
            }
        }
        // A pipe may wait for its reader, and others must not wait with it.
        drop(lock);
        for (path, write) in direct {
            if result.is_ok() {
                result = write_directly(&path, write).map_err(|source| PlaceError { path, source });
            }
        }
        match result.and_then(|()| placed.names_to_disk(sync)) {
            Ok(()) => Ok(placed),
            Err(error) => {
                placed.withdraw();
                Err(error.into())
            }
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
    if path.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if is_special(path) {
        return check_special(path);
    }
    let (target, folder) = target(path)?;
    check_takes_files(&folder)?;
    check_owner(&target, &folder)
}

/// Checks that a pipe or a device is there, and that an open file can be written. To open a pipe
/// waits for its reader, and to open a device may do something to it.
fn check_special(path: &Path) -> io::Result<()> {
    match fs::metadata(path)?.is_file() {
        true => fs::OpenOptions::new().append(true).open(path).map(drop),
        false => Ok(()),
    }
}

/// Checks that a file may be replaced: in a folder such as `/tmp` only its owner and the folder's
/// may do so.
#[cfg(unix)]
fn check_owner(target: &Path, folder: &Path) -> io::Result<()> {
    use std::os::unix::fs::MetadataExt;
    const STICKY: u32 = 0o1000;
    let (Ok(of_target), Ok(of_folder)) = (fs::symlink_metadata(target), fs::metadata(folder)) else { return Ok(()) };
    if of_folder.mode() & STICKY == 0 {
        return Ok(());
    }
    let own = temporary(folder)?.as_file().metadata()?.uid();
    if own == 0 || [of_target.uid(), of_folder.uid()].contains(&own) {
        return Ok(());
    }
    let message = "the file there belongs to another user, and in this folder only its owner may replace it";
    Err(io::Error::new(io::ErrorKind::PermissionDenied, message))
}

#[cfg(not(unix))]
fn check_owner(_: &Path, _: &Path) -> io::Result<()> {
    Ok(())
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
    use crate::formats::NamesLock;

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
        let ready = || Ok::<(), PlaceError>(());
        let placed = files.place_with(ready, &mut |path, file| {
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
            let result = files.place_with(|| Ok::<(), PlaceError>(()), &mut |_, _| match place.next() {
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
        let without = &mut |_: &Path, _: &fs::File| Err(io::ErrorKind::Unsupported.into());
        files.place_with(|| Ok::<(), PlaceError>(()), without).unwrap();
        assert!(paths.iter().all(|path| path.exists()));
    }

    /// Many that put results with the same names into one folder: at every moment all files are of
    /// one result, or there is none.
    ///
    /// Fails if the lock ends before the last file has its name.
    #[test]
    fn results_do_not_mix() {
        let here = tempfile::tempdir().unwrap();
        let paths = ["a", "b", "c"].map(|name| here.path().join(name));
        let lock = || NamesLock::of(paths.iter().map(PathBuf::as_path));
        let whole = || {
            let texts = paths.each_ref().map(|path| fs::read_to_string(path).ok());
            assert!(texts.iter().all(|text| *text == texts[0]), "{texts:?}");
        };
        std::thread::scope(|scope| {
            for writer in 0..4 {
                let (paths, lock, whole) = (&paths, &lock, &whole);
                scope.spawn(move || {
                    for round in 0..50 {
                        let mut files = FileSet::default();
                        for path in paths {
                            files.add(path, |out| write!(out, "{writer}.{round}")).unwrap();
                        }
                        let prepare = || {
                            let lock = lock();
                            whole();
                            paths.iter().for_each(|path| drop(fs::remove_file(path)));
                            lock.map_err(|source| PlaceError { path: paths[0].clone(), source })
                        };
                        files.place_after(prepare).unwrap();
                    }
                });
            }
        });
        whole();
        assert!(paths[0].exists());
    }

    /// A file that is kept stays as it is, and is written anew where it goes with an earlier
    /// result.
    #[test]
    fn a_kept_file_is_there_afterwards() {
        let here = tempfile::tempdir().unwrap();
        let path = here.path().join("names");
        for (goes, expected) in [(false, "the owner's"), (true, "names")] {
            fs::write(&path, "the owner's").unwrap();
            let mut files = FileSet::default();
            files.keep(&path, b"names").unwrap();
            files.add(&here.path().join("mesh"), |out| out.write_all(b"mesh")).unwrap();
            let prepare = || if goes { fs::remove_file(&path) } else { Ok(()) };
            let prepare = || prepare().map_err(|source| PlaceError { path: path.clone(), source });
            files.place_after(prepare).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), expected);
            assert_eq!(fs::read_dir(here.path()).unwrap().count(), 2);
        }
    }

    /// While a result waits for the reader of its pipe, others place theirs.
    ///
    /// Fails if the lock is kept until the pipe is written: then this test takes a minute.
    #[test]
    #[cfg(unix)]
    fn a_pipe_that_waits_stops_no_other() {
        let here = tempfile::tempdir().unwrap();
        let [mesh, pipe] = ["mesh", "pipe"].map(|name| here.path().join(name));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let lock = || {
            let locked = NamesLock::of([&*mesh]);
            locked.map_err(|source| PlaceError { path: mesh.clone(), source })
        };
        let place = || {
            let mut files = FileSet::default();
            for path in [&mesh, &pipe] {
                files.add(path, |out| out.write_all(b"contents")).unwrap();
            }
            files.place_after(lock)
        };
        std::thread::scope(|scope| {
            let waiting = scope.spawn(place);
            while !mesh.exists() {
                std::thread::yield_now();
            }
            let of_other = lock();
            assert_eq!(fs::read_to_string(&pipe).unwrap(), "contents");
            waiting.join().unwrap().unwrap();
            of_other.unwrap();
        });
    }

    /// A result is withdrawn while no other is placed, so that no file of another result is taken
    /// for its own.
    ///
    /// Fails if the withdrawal takes no lock.
    #[test]
    fn a_withdrawal_waits_for_the_lock() {
        let here = tempfile::tempdir().unwrap();
        let (files, paths) = set(here.path());
        let placed = files.place().unwrap();
        let of_other = NamesLock::of([&*paths[0]]).unwrap();
        std::thread::scope(|scope| {
            let withdrawal = scope.spawn(|| placed.withdraw());
            std::thread::sleep(std::time::Duration::from_millis(100));
            assert!(paths.iter().all(|path| path.exists()));
            drop(of_other);
            withdrawal.join().unwrap();
        });
        assert!(paths.iter().all(|path| !path.exists()));
    }

    /// A result that is withdrawn leaves the files of another result that has its names.
    #[test]
    #[cfg(unix)]
    fn files_of_others_are_not_withdrawn() {
        let here = tempfile::tempdir().unwrap();
        let (files, paths) = set(here.path());
        let placed = files.place().unwrap();
        write_atomically(&paths[1], |out| out.write_all(b"of another")).unwrap();
        placed.withdraw();
        assert!(!paths[0].exists() && !paths[2].exists());
        assert_eq!(fs::read_to_string(&paths[1]).unwrap(), "of another");
    }
}
