//! SHA-256 sums of files and texts.

use std::fs;
use std::io::{self, Read};
use std::path::Path;

use sha2::{Digest, Sha256};

use super::real_path::is_special;

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

/// The SHA-256 sum of a text, in hexadecimal digits.
pub(crate) fn sha256_of_text(text: &str) -> String {
    hex(Sha256::new_with_prefix(text))
}

/// A sum in hexadecimal digits.
pub(super) fn hex(sha256: Sha256) -> String {
    sha256.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
