//! The writer of mesh files.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::atomic::FileSet;
use super::error::WriteError;
use super::gzip::Gzip;

/// A buffered writer. Numbers are written one by one, and a virtual call for each would take most
/// of the time.
pub(super) type Out<'a> = BufWriter<&'a mut dyn Write>;

/// Runs `write` with a buffer in front of `out`.
pub(super) fn in_blocks(out: &mut dyn Write, write: impl FnOnce(&mut Out) -> io::Result<()>) -> io::Result<()> {
    let mut blocks = Out::with_capacity(1 << 16, out);
    write(&mut blocks)?;
    blocks.flush()
}

/// Adds a file to a set, gzipped if its name ends in `.gz`.
pub(super) fn add_file<'a>(
    files: &mut FileSet<'a>,
    path: &Path,
    write: impl FnOnce(&mut Out) -> io::Result<()> + 'a,
) -> Result<(), WriteError> {
    let gzipped = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"));
    let added = files.add(path, move |out| {
        if !gzipped {
            return in_blocks(out, write);
        }
        let mut gzip = Gzip::new(out);
        in_blocks(&mut gzip, write)?;
        gzip.finish()
    });
    added.map_err(|source| WriteError::Io { path: path.into(), source })
}
