//! Gzip: files are packed on all threads, and unpacked.
//!
//! A gzip file may consist of several members, which unpack to one file (RFC 1952, section 2.2).
//! Here every member holds the same number of plain bytes, independent of the number of threads, so
//! the file is always the same.

use std::borrow::Cow;
use std::io::{self, Read, Write};
use std::path::Path;

use flate2::{Compression, read::MultiGzDecoder, write::GzEncoder};
use rayon::prelude::*;

use super::error::ReadError;
use crate::memory::{check_memory, most_unpacked};

/// Plain bytes of a member.
const MEMBER: usize = 1 << 19;

/// Compression level. Binary meshes hardly shrink further with higher levels: a mesh of 98 000 tets
/// is 1 % larger than with the usual level 6, in less than a third of the time.
const LEVEL: Compression = Compression::new(2);

/// A writer that compresses.
pub(super) struct Gzip<'a> {
    out: &'a mut dyn Write,
    /// Plain bytes that are not compressed yet, less than a batch.
    plain: Vec<u8>,
    /// Number of members that are compressed at a time.
    batch: usize,
}

impl<'a> Gzip<'a> {
    /// Compresses into `out`.
    pub(super) fn new(out: &'a mut dyn Write) -> Self {
        let batch = 2 * rayon::current_num_threads();
        Self { out, plain: Vec::with_capacity(MEMBER), batch }
    }

    /// Compresses the remaining bytes.
    pub(super) fn finish(mut self) -> io::Result<()> {
        self.pack()
    }

    /// Compresses the plain bytes in whole members. Only the last member of the file may be
    /// shorter.
    fn pack(&mut self) -> io::Result<()> {
        let member = |plain: &[u8]| {
            let mut encoder = GzEncoder::new(Vec::new(), LEVEL);
            encoder.write_all(plain)?;
            encoder.finish()
        };
        let members: Vec<_> = self.plain.par_chunks(MEMBER).map(member).collect();
        members.into_iter().try_for_each(|member| self.out.write_all(&member?))?;
        self.plain.clear();
        Ok(())
    }
}

impl Write for Gzip<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let space = self.batch * MEMBER - self.plain.len();
        let taken = &bytes[..space.min(bytes.len())];
        self.plain.extend_from_slice(taken);
        if self.plain.len() == self.batch * MEMBER {
            self.pack()?;
        }
        Ok(taken.len())
    }

    /// A member is compressed when it is full or the last one, so a flush does nothing.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Plain bytes that are unpacked before the rest is counted: this multiple of the packed bytes.
const UNCOUNTED: u64 = 16;

fn uncounted(packed: u64) -> u64 {
    UNCOUNTED.saturating_mul(packed)
}

/// The contents of a file that may be gzipped. `path` is for messages.
///
/// # Errors
/// - [`ReadError::Zipped`]: the stream is broken
/// - [`ReadError::Unpacked`]: it is longer than [`most_unpacked`] allows; little memory was taken
/// - [`ReadError::Memory`]
pub(super) fn unzipped<'a>(path: &Path, bytes: Cow<'a, [u8]>) -> Result<Cow<'a, [u8]>, ReadError> {
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(bytes);
    }
    let broken = |source| ReadError::Zipped { path: path.into(), source };
    let packed = bytes.len() as u64;
    let most = most_unpacked(packed);
    let uncounted = uncounted(packed).min(most);
    let mut plain = Vec::new();
    let mut decoder = MultiGzDecoder::new(&bytes[..]);
    decoder.by_ref().take(uncounted).read_to_end(&mut plain).map_err(broken)?;
    // The rest is unusually long. It is unpacked twice, the first time only to count its bytes.
    let rest = io::copy(&mut decoder.take(most - uncounted + 1), &mut io::sink()).map_err(broken)?;
    if rest > most - uncounted {
        let (path, what) = (path.into(), "the gzipped file".to_owned());
        return Err(ReadError::Unpacked { path, what, bytes: most, is_all: false, packed, most });
    }
    if rest > 0 {
        check_memory(rest).map_err(|error| ReadError::Memory { path: path.into(), error })?;
        plain.reserve_exact(rest as usize);
        let mut decoder = MultiGzDecoder::new(&bytes[..]);
        io::copy(&mut decoder.by_ref().take(plain.len() as u64), &mut io::sink()).map_err(broken)?;
        decoder.read_to_end(&mut plain).map_err(broken)?;
    }
    Ok(plain.into())
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use flate2::read::MultiGzDecoder;

    use super::*;

    /// A mesh in text with many equal digits shrinks to a twelfth, and is unpacked once. A file
    /// that is made to fill the memory shrinks to a thousandth. Of the latter no more than a
    /// twentieth of its plain bytes is unpacked before it is refused.
    ///
    /// Fails if `UNCOUNTED` is 8 or 64.
    #[test]
    fn usual_files_are_unpacked_once_and_bombs_are_not_unpacked() {
        let zero = "0".repeat(12);
        let mesh = (0..100_000).map(|at| format!("{at} {zero} {zero}\n")).collect::<String>().into_bytes();
        let bomb = vec![b' '; 4 << 20];
        for (plain, is_usual) in [(mesh, true), (bomb, false)] {
            let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
            encoder.write_all(&plain).unwrap();
            let (packed, plain) = (encoder.finish().unwrap().len() as u64, plain.len() as u64);
            assert_eq!(plain > 8 * packed && plain < 16 * packed, is_usual, "{plain} of {packed}");
            assert!(if is_usual { uncounted(packed) >= plain } else { 20 * uncounted(packed) < plain });
        }
    }

    /// Also where the last member is full, or where there is one alone.
    #[test]
    fn what_is_packed_unpacks_and_does_not_depend_on_threads() {
        for length in [1, MEMBER - 1, 2 * MEMBER, 9 * MEMBER + 5] {
            let plain: Vec<u8> = (0..length).map(|at| (at % 251 + at / 7 % 13) as u8).collect();
            let packed = [1, 3].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let mut packed = Vec::new();
                    let mut gzip = Gzip::new(&mut packed);
                    // Neither a part nor a multiple of a member.
                    plain.chunks(700_001).for_each(|some| gzip.write_all(some).unwrap());
                    gzip.finish().unwrap();
                    packed
                })
            });
            assert_eq!(packed[0], packed[1]);
            let mut unpacked = Vec::new();
            MultiGzDecoder::new(&packed[0][..]).read_to_end(&mut unpacked).unwrap();
            assert!(unpacked == plain, "{length} bytes");
        }
    }
}
