//! Compression of the blocks of an array in VTK's files.

use std::io::{self, Read, Write};

use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use lzma_rust2::{XzOptions, XzReader, XzWriter};

/// The method of compression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compression {
    Zlib,
    /// Blocks of LZ4 without a frame.
    Lz4,
    /// Each block is a stream of xz.
    Lzma,
}

/// Most memory for the dictionary of a block, in KiB: the need of xz at its highest level.
const DICTIONARY: u32 = 66 << 10;

impl Compression {
    /// The method with this name of a VTK class.
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "vtkZLibDataCompressor" => Compression::Zlib,
            "vtkLZ4DataCompressor" => Compression::Lz4,
            "vtkLZMADataCompressor" => Compression::Lzma,
            _ => return None,
        })
    }

    fn name(self) -> &'static str {
        match self {
            Compression::Zlib => "zlib",
            Compression::Lz4 => "LZ4",
            Compression::Lzma => "LZMA",
        }
    }

    /// Largest factor between plain and compressed bytes.
    fn expansion(self) -> usize {
        match self {
            Compression::Zlib => 1032,
            Compression::Lz4 => 255,
            Compression::Lzma => 8192,
        }
    }

    /// Appends the `plain` bytes of a block to `data`.
    ///
    /// # Errors
    /// A message in words.
    pub fn unpack(self, packed: &[u8], plain: usize, data: &mut Vec<u8>) -> Result<(), String> {
        let wrong = |found: &dyn std::fmt::Display| Err(format!("a block of {found} bytes that should hold {plain}"));
        if plain / self.expansion() > packed.len() {
            return wrong(&packed.len());
        }
        let before = data.len();
        // One byte more than expected shows that the block is too long.
        let most = plain as u64 + 1;
        let broken = |error: &dyn std::fmt::Display| format!("broken {} data ({error})", self.name());
        match self {
            Compression::Zlib => {
                ZlibDecoder::new(packed).take(most).read_to_end(data).map_err(|error| broken(&error))?;
            }
            Compression::Lzma => {
                let reader = XzReader::new_mem_limit(packed, false, DICTIONARY);
                reader.take(most).read_to_end(data).map_err(|error| broken(&error))?;
            }
            Compression::Lz4 => {
                data.resize(before + plain, 0);
                let length = lz4_flex::block::decompress_into(packed, &mut data[before..]);
                data.truncate(before + length.map_err(|error| broken(&error))?);
            }
        }
        match data.len() - before {
            length if length == plain => Ok(()),
            length => wrong(&length),
        }
    }

    /// Appends a compressed block to `packed`.
    pub fn pack(self, plain: &[u8], packed: &mut Vec<u8>) -> io::Result<()> {
        match self {
            Compression::Zlib => {
                let mut encoder = ZlibEncoder::new(packed, flate2::Compression::default());
                encoder.write_all(plain)?;
                encoder.finish()?;
            }
            Compression::Lzma => {
                let mut options = XzOptions::with_preset(5);
                // A dictionary no larger than the block.
                options.lzma_options.dict_size = (plain.len() as u32).max(1 << 12);
                let mut encoder = XzWriter::new(packed, options)?;
                encoder.write_all(plain)?;
                encoder.finish()?;
            }
            Compression::Lz4 => packed.extend_from_slice(&lz4_flex::block::compress(plain)),
        }
        Ok(())
    }
}
