//! [`NamesLock`]: one process at a time gives and takes the names of files in a folder.
//!
//! Two results with the same names must not mix. So a process locks the folders of a result while
//! it removes the files of an earlier result and gives the new files their names.
//!
//! The lock is on the folder itself, and leaves no file behind. Where a system locks no folders, as
//! on Windows and NFS, it is on a file in the folder, which the process removes again.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use super::real_path::{is_at, is_special, real_path};

/// The file that is locked where a folder cannot be.
const NAME: &str = ".idmesh-names";

/// How often a lock is tried: for about a minute. A process holds a lock for some milliseconds. One
/// that is stopped meanwhile must not hang all others. Time in which this process is stopped does
/// not count.
const ATTEMPTS: usize = 4000;

/// The first pause between two attempts, and the longest one.
const PAUSES: [Duration; 2] = [Duration::from_millis(1), Duration::from_millis(16)];

/// The locks on some folders. Dropping them gives them back.
#[derive(Debug, Default)]
pub(crate) struct NamesLock {
    _folders: Vec<Locked>,
}

#[derive(Debug)]
enum Locked {
    Folder { _folder: File },
    File { path: PathBuf, _file: File },
}

impl Drop for Locked {
    fn drop(&mut self) {
        if let Self::File { path, .. } = self {
            // Removed while it is locked. A process that waits for it sees that it has no name.
            let _ = fs::remove_file(path);
        }
    }
}

impl NamesLock {
    /// Locks the folders of these files, and waits for other processes that hold a lock. Pipes,
    /// devices and files in missing folders need no lock. A folder on a file system without locks
    /// gets none.
    ///
    /// # Errors
    /// Another process holds a lock and does not end.
    pub(crate) fn of<'p>(paths: impl IntoIterator<Item = &'p Path>) -> io::Result<Self> {
        let places = paths.into_iter().filter(|path| !is_special(path)).map(real_path);
        // All processes lock several folders in one order, so that none waits for the other.
        let folders: BTreeSet<PathBuf> = places.filter_map(|place| Some(place.parent()?.to_path_buf())).collect();
        let mut locked = Vec::new();
        for folder in folders.iter().filter(|folder| folder.is_dir()) {
            locked.extend(lock(folder)?);
        }
        Ok(Self { _folders: locked })
    }
}

/// Locks a folder; `None` if its file system has no locks.
fn lock(folder: &Path) -> io::Result<Option<Locked>> {
    patiently(folder, || match try_folder(folder).or_else(|_| try_file(&folder.join(NAME))) {
        Ok(Some(locked)) => Some(Some(locked)),
        Ok(None) => None,
        Err(_) => Some(None),
    })
}

/// Tries until something comes of it, for about a minute.
///
/// - `path`: what is locked, for the message
/// - `attempt`: `None` if another process holds the lock
///
/// # Errors
/// Another process holds the lock and does not end.
pub(crate) fn patiently<T>(path: &Path, mut attempt: impl FnMut() -> Option<T>) -> io::Result<T> {
    let [mut pause, longest] = PAUSES;
    for _ in 0..ATTEMPTS {
        if let Some(found) = attempt() {
            return Ok(found);
        }
        thread::sleep(pause);
        pause = longest.min(2 * pause);
    }
    let message = format!("another process that writes into {} stands still", path.display());
    Err(io::Error::new(io::ErrorKind::TimedOut, message))
}

/// Tries to lock a folder; `None` if another process holds the lock.
fn try_folder(folder: &Path) -> io::Result<Option<Locked>> {
    let folder = File::open(folder)?;
    Ok(is_locked(&folder)?.then_some(Locked::Folder { _folder: folder }))
}

/// Tries to lock a file, which is made if it is missing; `None` if another process holds the lock.
fn try_file(path: &Path) -> io::Result<Option<Locked>> {
    let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
    match is_locked(&file) {
        // Its holder may have removed the file between the opening and the lock.
        Ok(true) if is_at(&file, path) => Ok(Some(Locked::File { path: path.to_path_buf(), _file: file })),
        Ok(_) => Ok(None),
        Err(error) => {
            let _ = fs::remove_file(path);
            Err(error)
        }
    }
}

fn is_locked(file: &File) -> io::Result<bool> {
    match file.try_lock() {
        Ok(()) => Ok(true),
        Err(TryLockError::WouldBlock) => Ok(false),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

    use super::*;

    /// Of many that hold a lock none holds it together with another.
    fn one_at_a_time<T>(take: impl Fn() -> Option<T> + Sync) {
        let inside = AtomicUsize::new(0);
        thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..50 {
                        let held = loop {
                            match take() {
                                Some(held) => break held,
                                None => thread::yield_now(),
                            }
                        };
                        assert_eq!(inside.fetch_add(1, SeqCst), 0);
                        thread::yield_now();
                        inside.fetch_sub(1, SeqCst);
                        drop(held);
                    }
                });
            }
        });
    }

    #[test]
    fn one_holds_a_folder() {
        let folder = tempfile::tempdir().unwrap();
        let paths = ["a", "none/b", "c"].map(|name| folder.path().join(name));
        one_at_a_time(|| Some(NamesLock::of(paths.iter().map(PathBuf::as_path)).unwrap()));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    /// Fails if a file whose holder has removed it counts as locked.
    #[test]
    fn one_holds_a_file() {
        let folder = tempfile::tempdir().unwrap();
        one_at_a_time(|| try_file(&folder.path().join(NAME)).unwrap());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
