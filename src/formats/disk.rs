//! Brings files and their names to the disk, so that a power cut does not take them.

use std::fs;
use std::io;
use std::path::Path;

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
pub(super) fn entries_to_disk(folder: &Path, sync: &mut Sync) -> io::Result<()> {
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
