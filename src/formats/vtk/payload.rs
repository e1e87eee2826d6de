//! The bytes of an array in a VTK XML file: a header of sizes, then the numbers, which may be
//! compressed or in base64.

use std::borrow::Cow;
use std::io;

use super::base64;
use super::compression::Compression;
use crate::formats::error::ReadError;
use crate::formats::scanner::Endian;

/// The encoding of all arrays of a file that are not text.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coding {
    pub endian: Endian,
    /// Size of a number in the header, in bytes: 4 or 8.
    pub header: usize,
    /// Compression of the numbers, block by block.
    pub compression: Option<Compression>,
}

/// A decoded array.
#[derive(Debug)]
pub(super) struct Payload<'a> {
    pub coding: Coding,
    pub base64: bool,
    /// The numbers.
    pub data: Cow<'a, [u8]>,
    /// Number of bytes of the array in the file.
    pub length: usize,
    /// For a compressed array: bytes of data in a block, and in the last block if it is not full
    /// (otherwise 0); the compressed blocks, and the size of each block.
    block: usize,
    last: usize,
    packed: Cow<'a, [u8]>,
    sizes: Vec<usize>,
}

/// Why an array is not decoded.
pub(super) enum Undecoded {
    /// It is broken: a message in words.
    Broken(String),
    /// It is refused before its data are decoded.
    Refused(ReadError),
}

impl From<String> for Undecoded {
    fn from(found: String) -> Self {
        Self::Broken(found)
    }
}

impl From<&str> for Undecoded {
    fn from(found: &str) -> Self {
        Self::Broken(found.to_owned())
    }
}

impl From<ReadError> for Undecoded {
    fn from(error: ReadError) -> Self {
        Self::Refused(error)
    }
}

impl Coding {
    /// Decodes the array at the beginning of `bytes`.
    ///
    /// - `allow`: gets the number of bytes of data before they are decoded, and may refuse them
    ///
    /// # Errors
    /// [`Undecoded`]
    pub fn decode<'a>(
        self,
        bytes: &'a [u8],
        base64: bool,
        allow: impl FnOnce(usize) -> Result<(), ReadError>,
    ) -> Result<Payload<'a>, Undecoded> {
        let take = |from: usize, count: usize| -> Result<(Cow<'a, [u8]>, usize), String> {
            let rest = bytes.get(from..).unwrap_or_default();
            let taken = if base64 {
                base64::decode(rest, count).map(|(data, end)| (Cow::Owned(data), from + end))
            } else {
                rest.get(..count).map(|data| (Cow::Borrowed(data), from + count))
            };
            taken.ok_or_else(|| {
                format!("an end, or no {}, before its {count} bytes", if base64 { "base64" } else { "data" })
            })
        };
        let count = |sizes: &[u8], index: usize| self.count(sizes, index);
        let sum = |a: usize, b: usize| a.checked_add(b).ok_or("sizes that no memory holds");
        let (sizes, _) = take(0, self.header)?;
        let first = count(&sizes, 0)?;
        let Some(compression) = self.compression else {
            let all = sum(self.header, first)?;
            allow(first)?;
            let (data, length) = take(0, all)?;
            let data = match data {
                Cow::Borrowed(data) => Cow::Borrowed(&data[self.header..]),
                Cow::Owned(mut data) => {
                    data.drain(..self.header);
                    Cow::Owned(data)
                }
            };
            let (packed, sizes) = (Cow::Borrowed(&[][..]), Vec::new());
            return Ok(Payload { coding: self, base64, data, length, block: 0, last: 0, packed, sizes });
        };
        if first > bytes.len() {
            return Err(format!("{first} blocks").into());
        }
        let (sizes, start) = take(0, (3 + first) * self.header)?;
        let (block, last) = (count(&sizes, 1)?, count(&sizes, 2)?);
        let sizes = (0..first).map(|index| count(&sizes, 3 + index)).collect::<Result<Vec<_>, _>>()?;
        let total = sizes.iter().try_fold(0, |total, &size| sum(total, size))?;
        let plain_of = |index: usize| if index + 1 == first && last != 0 { last } else { block };
        let in_full = first.saturating_sub(1).checked_mul(block).ok_or("blocks that no memory holds")?;
        let n_plain = if first > 0 { sum(in_full, plain_of(first - 1))? } else { 0 };
        allow(n_plain)?;
        let (packed, length) = take(start, total)?;
        let mut data = Vec::new();
        let held = data.try_reserve_exact(n_plain);
        held.map_err(|_| format!("{n_plain} bytes, which the memory does not hold"))?;
        let mut at = 0;
        for (index, &size) in sizes.iter().enumerate() {
            let plain = plain_of(index);
            compression.unpack(&packed[at..at + size], plain, &mut data)?;
            at += size;
        }
        Ok(Payload { coding: self, base64, data: Cow::Owned(data), length, block, last, packed, sizes })
    }

    /// A number of the header, from its index.
    fn count(self, sizes: &[u8], index: usize) -> Result<usize, String> {
        let at = index * self.header;
        let mut wide = [0; 8];
        for (place, &byte) in sizes[at..at + self.header].iter().enumerate() {
            let place = if self.endian == Endian::Big { self.header - 1 - place } else { place };
            wide[place] = byte;
        }
        usize::try_from(u64::from_le_bytes(wide)).map_err(|_| "a size that no memory holds".to_string())
    }

    /// Number of bytes of the array at the beginning of `bytes`, without white space in base64.
    /// `None` if they end within its header. The numbers are not decoded.
    pub fn length(self, bytes: &[u8], base64: bool) -> Option<usize> {
        let take = |count: usize| match base64 {
            true => base64::decode(bytes, count).map(|(data, _)| Cow::Owned(data)),
            false => bytes.get(..count).map(Cow::Borrowed),
        };
        let stored = |length: usize| if base64 { length.div_ceil(3).checked_mul(4) } else { Some(length) };
        let first = self.count(&take(self.header)?, 0).ok()?;
        if self.compression.is_none() {
            return stored(self.header.checked_add(first)?);
        }
        let header = first.checked_add(3)?.checked_mul(self.header).filter(|&header| header <= bytes.len())?;
        let sizes = take(header)?;
        let sizes = (0..first).map(|block| self.count(&sizes, 3 + block));
        let total = sizes.into_iter().try_fold(0usize, |total, size| total.checked_add(size.ok()?))?;
        stored(header)?.checked_add(stored(total)?)
    }
}

impl Payload<'_> {
    /// The same array with numbers of its own.
    pub fn into_owned(self) -> Payload<'static> {
        let Payload { coding, base64, data, length, block, last, packed, sizes } = self;
        let [data, packed] = [data, packed].map(|bytes| Cow::Owned(bytes.into_owned()));
        Payload { coding, base64, data, length, block, last, packed, sizes }
    }

    /// The bytes of the array with other data of the same length. Blocks that did not change keep
    /// their bytes.
    pub fn encode(&self, data: &[u8]) -> io::Result<Vec<u8>> {
        let mut header = Vec::new();
        let mut body = Vec::new();
        let mut size = |value: usize| match self.coding.endian {
            Endian::Little => header.extend_from_slice(&(value as u64).to_le_bytes()[..self.coding.header]),
            Endian::Big => header.extend_from_slice(&(value as u64).to_be_bytes()[8 - self.coding.header..]),
        };
        let Some(compression) = self.coding.compression else {
            size(data.len());
            header.extend_from_slice(data);
            return Ok(self.written(&header, &[]));
        };
        size(self.sizes.len());
        size(self.block);
        size(self.last);
        let (mut at, mut old) = (0, 0);
        for (index, &old_size) in self.sizes.iter().enumerate() {
            let end = if index + 1 == self.sizes.len() { data.len() } else { at + self.block };
            let before = body.len();
            if data[at..end] == self.data[at..end] {
                body.extend_from_slice(&self.packed[old..old + old_size]);
            } else {
                compression.pack(&data[at..end], &mut body)?;
            }
            size(body.len() - before);
            (at, old) = (end, old + old_size);
        }
        Ok(self.written(&header, &body))
    }

    /// Header and body in the encoding of the file. In base64 each is a chunk of its own.
    fn written(&self, header: &[u8], body: &[u8]) -> Vec<u8> {
        if !self.base64 {
            return [header, body].concat();
        }
        let mut text = Vec::new();
        base64::encode(header, &mut text);
        base64::encode(body, &mut text);
        text
    }
}
