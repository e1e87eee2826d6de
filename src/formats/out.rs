//! What mesh files are written into.

use std::io::{self, BufWriter, Write};

/// Takes numbers one by one: with a virtual call for each, it would be that which takes the time.
pub(super) type Out<'a> = BufWriter<&'a mut dyn Write>;

/// Gathers what is written into blocks for `out`.
pub(super) fn in_blocks(out: &mut dyn Write, write: impl FnOnce(&mut Out) -> io::Result<()>) -> io::Result<()> {
    let mut blocks = Out::with_capacity(1 << 16, out);
    write(&mut blocks)?;
    blocks.flush()
}
