//! Files that appear whole or not at all.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

/// Writes a file through a temporary one in the same folder. The temporary file takes the path's
/// name when it is complete.
///
/// If `write` fails, or the process dies, the old file at `path` is untouched. The file gets the
/// permissions of any new file. A symbolic link still points to the replaced file. A path that is
/// no regular file (`/dev/stdout`, a pipe) is written directly.
///
/// # Errors
///
/// The error of `write`, or an error of making, filling or renaming the temporary file.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    if fs::metadata(path).is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir()) {
        let mut out = BufWriter::new(fs::OpenOptions::new().write(true).open(path)?);
        write(&mut out)?;
        return out.flush();
    }
    let (target, folder) = target(path)?;
    let mut out = BufWriter::with_capacity(1 << 16, temporary(&folder)?);
    write(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.persist(target).map_err(|error| error.error)?;
    Ok(())
}

/// Checks that [`write_atomically`] to `path` can work: makes and removes an empty temporary file
/// beside it.
pub(crate) fn check(path: &Path) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        Ok(metadata) if !metadata.is_file() => return Ok(()),
        _ => {}
    }
    without_name(temporary(&target(path)?.1))
}

/// Writes the files of a folder, which is made if it is missing. All files are complete before the
/// first takes its place. The last file, without which the folder is no mesh, takes its place last.
pub(super) fn write_folder(path: &Path, files: &[(String, Vec<u8>)]) -> io::Result<()> {
    let (target, parent) = target(path)?;
    let stage = Builder::new().prefix(".idmesh-").tempdir_in(&parent)?;
    for (name, bytes) in files {
        fs::write(stage.path().join(name), bytes)?;
    }
    if !target.is_dir() {
        fs::create_dir(&target)?;
    }
    for (name, _) in files {
        fs::rename(stage.path().join(name), target.join(name))?;
    }
    Ok(())
}

/// Checks that [`write_folder`] to `path` can work.
pub(super) fn check_folder(path: &Path) -> io::Result<()> {
    if path.exists() && !path.is_dir() {
        return Err(io::ErrorKind::NotADirectory.into());
    }
    without_name(Builder::new().prefix(".idmesh-").tempdir_in(target(path)?.1))
}

/// The error of making a temporary file, without the temporary name, which would confuse the user.
fn without_name<T>(made: io::Result<T>) -> io::Result<()> {
    made.map(drop).map_err(|error| error.kind().into())
}

/// The file to replace and its folder. Symbolic links are followed.
fn target(path: &Path) -> io::Result<(PathBuf, PathBuf)> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let folder = match target.parent() {
        Some(folder) if folder.as_os_str().is_empty() => PathBuf::from("."),
        Some(folder) => folder.to_path_buf(),
        None => return Err(io::ErrorKind::IsADirectory.into()),
    };
    if !folder.is_dir() {
        let message = format!("there is no folder {}", folder.display());
        return Err(io::Error::new(io::ErrorKind::NotFound, message));
    }
    Ok((target, folder))
}

fn temporary(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".idmesh-");
    // Temporary files are private by default (0600). This file becomes a result that others may
    // read. The umask still applies.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}
