//! The writer of mesh files.

use std::io::{self, BufWriter, Write};

/// A buffered writer. Numbers are written one by one, and a virtual call for each would take most
/// of the time.
pub(super) type Out<'a> = BufWriter<&'a mut dyn Write>;

/// Runs `write` with a buffer in front of `out`.
pub(super) fn in_blocks(out: &mut dyn Write, write: impl FnOnce(&mut Out) -> io::Result<()>) -> io::Result<()> {
    let mut blocks = Out::with_capacity(1 << 16, out);
    write(&mut blocks)?;
    blocks.flush()
}
