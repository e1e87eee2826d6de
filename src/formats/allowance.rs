//! [`Allowance`]: how many bytes the packed parts of a file may unpack to.
//!
//! A file of a few kilobytes may unpack to gigabytes. So the sizes that a file declares are
//! compared with its own size, and with the available memory, before anything is unpacked.

use std::cell::Cell;
use std::path::Path;

use super::error::ReadError;
use crate::memory::{check_memory, most_unpacked};

/// The bytes to which all parts of one file together may unpack.
pub(super) struct Allowance<'a> {
    path: &'a Path,
    packed: u64,
    most: u64,
    taken: Cell<u64>,
}

impl<'a> Allowance<'a> {
    /// The allowance of a file of `packed` bytes. `path` is for messages.
    pub fn new(path: &'a Path, packed: usize) -> Self {
        let packed = packed as u64;
        Self { path, packed, most: most_unpacked(packed), taken: Cell::new(0) }
    }

    /// Allows a part of so many bytes. Parts that share bytes in the file count several times.
    ///
    /// # Errors
    /// [`ReadError::Unpacked`], [`ReadError::Memory`]
    pub fn take(&self, what: &str, bytes: usize) -> Result<(), ReadError> {
        let bytes = bytes as u64;
        let all = self.taken.get().saturating_add(bytes);
        if all > self.most {
            let what = if all == bytes { what.to_owned() } else { format!("{what}, with the parts before it,") };
            let (packed, most) = (self.packed, self.most);
            return Err(ReadError::Unpacked { path: self.path.into(), what, bytes: all, is_all: true, packed, most });
        }
        self.taken.set(all);
        // Small parts are not worth the question.
        if bytes > 1 << 20 {
            check_memory(bytes).map_err(|error| ReadError::Memory { path: self.path.into(), error })?;
        }
        Ok(())
    }
}
