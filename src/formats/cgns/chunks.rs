//! Reads arrays that an HDF5 file holds in chunks, packed or not.
//!
//! Source: the HDF5 File Format Specification, version 3, "Filter Pipeline Message"; M. Lehmann's
//! description of LZF, which h5py's files use.

use std::io::Read;

use flate2::read::ZlibDecoder;
use hdf5_pure::{Chunk, Dataset, Filter};

use super::data::{Spot, Store};
use crate::formats::error::ReadError;

/// Numbers of the filters.
const DEFLATE: u16 = 1;
const SHUFFLE: u16 = 2;
const FLETCHER32: u16 = 3;
const LZF: u16 = 32000;

/// Bytes of a checksum after a chunk.
const CHECKSUM: usize = 4;

/// The bytes of an array and where they are. Chunks that are not packed are pieces of the file if
/// the array has one index.
///
/// - `shape`, `chunk_shape`: numbers of values `[n_indices]`; of `number` bytes each
///
/// # Errors
/// - [`ReadError::Malformed`]: a chunk is missing or broken
/// - [`ReadError::Unsupported`]: another filter
/// - [`ReadError::Unpacked`], [`ReadError::Memory`]: the chunks are too large
pub(super) fn read(
    spot: &Spot,
    data: &Dataset,
    shape: &[u64],
    chunk_shape: &[u64],
    number: usize,
) -> Result<(Vec<u8>, Store), ReadError> {
    let malformed = |found: &dyn std::fmt::Display| spot.malformed("data in chunks", found);
    if shape.is_empty() || shape.len() != chunk_shape.len() || chunk_shape.contains(&0) || shape.contains(&0) {
        return Err(malformed(&format_args!("chunks of {chunk_shape:?} for {shape:?}")));
    }
    let sizes = || shape.iter().zip(chunk_shape);
    let product = |factors: &mut dyn Iterator<Item = u64>| factors.fold(number as u64, u64::saturating_mul);
    let n_chunks = sizes().map(|(size, chunk)| size.div_ceil(*chunk)).fold(1, u64::saturating_mul);
    let of_chunk = product(&mut chunk_shape.iter().copied());
    // A chunk is unpacked whole, however few of its values belong to the data.
    let all = usize::try_from(n_chunks.saturating_mul(of_chunk)).unwrap_or(usize::MAX);
    spot.source.allowance.take(&format!("a chunk of {}", spot.path()), all)?;
    let (of_chunk, length) = (of_chunk as usize, product(&mut shape.iter().copied()) as usize);

    let filters = data.filter_pipeline();
    if let Some(filter) = filters.iter().find(|filter| !matches!(filter.id, DEFLATE | SHUFFLE | FLETCHER32 | LZF)) {
        let name = filter.name.as_deref().unwrap_or("no name");
        let found = format!("data packed by the filter {} ({name})", filter.id);
        return Err(spot.unsupported(found, "repack it (h5repack -f NONE old.cgns new.cgns)"));
    }
    let mut chunks = data.chunks().map_err(|error| malformed(&error))?;
    chunks.sort_by(|a, b| a.offset.cmp(&b.offset));
    let is_grid = |chunk: &Chunk| {
        chunk.offset.iter().zip(sizes()).all(|(offset, (size, chunk))| offset % chunk == 0 && offset < size)
            && chunk.offset.len() == shape.len()
    };
    chunks.dedup_by(|a, b| a.offset == b.offset);
    if chunks.len() as u64 != n_chunks || !chunks.iter().all(is_grid) {
        return Err(malformed(&format_args!("{} of {n_chunks} chunks", chunks.len())));
    }
    let bytes = &spot.source.shared.bytes[..];
    let mut unpacked = vec![0; length];
    let mut pieces = Vec::new();
    for chunk in &chunks {
        let start = usize::try_from(chunk.address).ok();
        let range = start.and_then(|start| Some(start..start.checked_add(usize::try_from(chunk.storage_size).ok()?)?));
        let stored = range.clone().and_then(|range| bytes.get(range));
        let (range, stored) = range.zip(stored).ok_or_else(|| malformed(&"a chunk beyond the end of the file"))?;
        let values = unpack(stored, &filters, chunk.filter_mask, of_chunk)
            .filter(|values| values.len() == of_chunk)
            .ok_or_else(|| malformed(&format_args!("a broken chunk at {:?}", chunk.offset)))?;
        place_at(&values, &chunk.offset, shape, chunk_shape, number, &mut unpacked);
        let used = (length - chunk.offset[0] as usize * number).min(of_chunk);
        pieces.push(range.start..range.start + used.min(range.len()));
    }
    let is_plain = filters.is_empty() && shape.len() == 1;
    Ok((unpacked, if is_plain { Store::Pieces(pieces) } else { Store::Elsewhere }))
}

/// Copies the values of a chunk to their places.
///
/// - `offset`: indices of its first value `[n_indices]`
fn place_at(values: &[u8], offset: &[u64], shape: &[u64], chunk_shape: &[u64], number: usize, all: &mut [u8]) {
    let Some((&row, before)) = chunk_shape.split_last() else { return };
    let last = before.len();
    let used = (shape[last] - offset[last]).min(row) as usize * number;
    for (index, values) in values.chunks_exact(row as usize * number).enumerate() {
        // The indices of the row, from the last but one to the first.
        let (mut rest, mut at, mut stride) = (index as u64, offset[last], shape[last]);
        let mut is_inside = true;
        for axis in (0..last).rev() {
            let place = offset[axis] + rest % before[axis];
            rest /= before[axis];
            is_inside &= place < shape[axis];
            at += place * stride;
            stride *= shape[axis];
        }
        if is_inside {
            let start = at as usize * number;
            all[start..start + used].copy_from_slice(&values[..used]);
        }
    }
}

/// The values of a chunk. `None` if it is broken.
///
/// - `mask`: bit i is set if filter i was left out
/// - `length`: bytes of the values
fn unpack(stored: &[u8], filters: &[Filter], mask: u32, length: usize) -> Option<Vec<u8>> {
    let mut bytes = stored.to_vec();
    let applied = |index: usize| index >= 32 || mask >> index & 1 == 0;
    for (index, filter) in filters.iter().enumerate().rev().filter(|(index, _)| applied(*index)) {
        bytes = match filter.id {
            DEFLATE => {
                // Checksums of earlier filters are packed with the values.
                let most = length + CHECKSUM * index;
                let mut plain = Vec::new();
                ZlibDecoder::new(&bytes[..]).take(most as u64 + 1).read_to_end(&mut plain).ok()?;
                (plain.len() <= most).then_some(plain)?
            }
            LZF => unpack_lzf(&bytes, length + CHECKSUM * index)?,
            SHUFFLE => shuffled_back(&bytes, *filter.client_data.first()? as usize),
            _ => {
                let (values, sum) = bytes.split_last_chunk::<CHECKSUM>()?;
                let expected = fletcher32(values);
                // Early versions of HDF5 wrote the bytes of each half the other way round.
                let swapped = expected.rotate_left(16).swap_bytes();
                [expected, swapped].contains(&u32::from_le_bytes(*sum)).then(|| values.to_vec())?
            }
        };
    }
    Some(bytes)
}

/// The bytes of data packed by LZF. `None` if they are broken, or more than `most`.
///
/// A byte below 32 precedes one more byte than it says. Other bytes stand for a run that has been
/// before: three bits of its length less 2, and 13 bits of the distance to it less 1, with another
/// byte of the length between if the three bits are 7.
fn unpack_lzf(packed: &[u8], most: usize) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut rest = packed.iter().copied();
    while let Some(first) = rest.next() {
        if first < 32 {
            for _ in 0..=first {
                bytes.push(rest.next()?);
            }
        } else {
            let more = if first >> 5 == 7 { rest.next()? } else { 0 };
            let length = usize::from(first >> 5) + usize::from(more) + 2;
            let distance = (usize::from(first & 31) << 8 | usize::from(rest.next()?)) + 1;
            let start = bytes.len().checked_sub(distance)?;
            // The run may overlap what it makes.
            (start..start + length).for_each(|at| bytes.push(bytes[at]));
        }
        if bytes.len() > most {
            return None;
        }
    }
    Some(bytes)
}

/// The bytes of numbers of `size` bytes each, of which all first bytes come first, then all second
/// ones, and so on. What is left over at the end stays there.
fn shuffled_back(bytes: &[u8], size: usize) -> Vec<u8> {
    let mut values = bytes.to_vec();
    let Some(count) = bytes.len().checked_div(size).filter(|&count| count > 0) else { return values };
    for (index, value) in values[..count * size].chunks_exact_mut(size).enumerate() {
        for (byte, place) in value.iter_mut().zip(0..) {
            *byte = bytes[place * count + index];
        }
    }
    values
}

/// J. Fletcher's checksum of words of 16 bits, the more significant byte first.
fn fletcher32(bytes: &[u8]) -> u32 {
    let (mut first, mut second) = (0u64, 0u64);
    for word in bytes.chunks(2) {
        let word = u64::from(word[0]) << 8 | word.get(1).map_or(0, |&byte| u64::from(byte));
        first = (first + word) % 0xffff;
        second = (second + first) % 0xffff;
    }
    // HDF5 adds the carry to the sum, which thus is zero only if all words are.
    let is_zero = bytes.iter().all(|&byte| byte == 0);
    let [first, second] = [first, second].map(|sum| if sum == 0 && !is_zero { 0xffff } else { sum });
    (second << 16 | first) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The checksums of 8, 6 and 5 letters in J. Fletcher's published examples, whose words have
    /// the less significant byte first.
    #[test]
    fn checksums_are_those_of_the_published_examples() {
        for (text, sum) in [("abcdefgh", 0xebe1_9591_u32), ("abcdef", 0x5650_2d2a), ("abcde", 0xf04f_c729)] {
            let mut bytes = text.as_bytes().to_vec();
            bytes.resize(text.len().next_multiple_of(2), 0);
            bytes.chunks_exact_mut(2).for_each(|word| word.swap(0, 1));
            assert_eq!(fletcher32(&bytes), sum, "{text}");
        }
    }

    #[test]
    fn a_chunk_with_two_indices_goes_to_its_place() {
        // 3 x 5 values in chunks of 2 x 3: the last chunk has one row and two columns.
        let mut all = vec![0; 15];
        for offset in [[0, 0], [2, 3]] {
            place_at(&[1, 2, 3, 4, 5, 6], &offset, &[3, 5], &[2, 3], 1, &mut all);
        }
        assert_eq!(all, [1, 2, 3, 0, 0, 4, 5, 6, 0, 0, 0, 0, 0, 1, 2]);
    }

    /// Streams made by hand after the description.
    #[test]
    fn runs_of_lzf_are_unpacked() {
        let unpacked = |packed: &[u8]| unpack_lzf(packed, 300);
        assert_eq!(unpacked(b"\x02abc").unwrap(), b"abc");
        // Three bytes, 2 before; nine and 255 more, 1 before.
        assert_eq!(unpacked(b"\x01ab\x20\x01").unwrap(), b"ababa");
        assert_eq!(unpacked(b"\x00a\xe0\xff\x00").unwrap(), [b'a'; 265]);
        for broken in [&b"\x02ab"[..], b"\x00a\x20\x01", b"\x00a\xe0", b"\x00a\x20", b"\x00a\xe0\xff\x00\xe0\xff\x00"] {
            assert_eq!(unpacked(broken), None, "{broken:?}");
        }
    }

    #[test]
    fn shuffled_numbers_come_back() {
        assert_eq!(shuffled_back(&[1, 4, 7, 2, 5, 8, 3, 6, 9, 10], 3), [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
        assert_eq!(shuffled_back(&[1, 2], 0), [1, 2]);
    }
}
