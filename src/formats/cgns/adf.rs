//! The nodes of a CGNS file in ADF, the format from before HDF5.
//!
//! All counts and places are hexadecimal letters. A place is the number of a block of 4096 bytes,
//! and an offset in the block.
//!
//! Source: the CGNS standard, "ADF User Guide", appendix "ADF File Format".

use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::HashMap;
use std::fmt::Display;
use std::path::Path;

use super::data::{Data, Shared, Spot, Store};
use crate::formats::error::{Location, ReadError};
use crate::formats::number::Number;
use crate::formats::scanner::Endian;

/// The first letters, which some versions write with the highest bit set.
const MAGIC: &[u8; 4] = b"@(#)";
const TITLE: &[u8] = b"ADF Database Version ";

/// Bytes of a block, of the file's header, of a node, of a name, and of a place.
const BLOCK: usize = 4096;
const HEADER: usize = 186;
const NODE: usize = 246;
const NAME: usize = 32;
const PLACE: usize = 12;

/// Bytes before the entries of a table or the data of a chunk: a tag and the place of the end.
const BEFORE: usize = 4 + PLACE;

/// Offsets in a node.
mod of {
    pub const NAME: usize = 4;
    pub const LABEL: usize = 36;
    pub const N_CHILDREN: usize = 68;
    pub const CHILDREN: usize = 84;
    pub const TYPE: usize = 96;
    pub const N_INDICES: usize = 128;
    pub const SIZES: usize = 130;
    pub const N_CHUNKS: usize = 226;
    pub const CHUNKS: usize = 230;
    pub const END: usize = 242;
}

/// A file in ADF.
pub(super) struct Adf {
    endian: Endian,
    /// Place of the root.
    pub root: usize,
    /// Parent of each node that was found, and its index among the children. In a broken file
    /// a node may be its own ancestor, or the child of many.
    parents: RefCell<HashMap<usize, (usize, usize)>>,
}

/// Whether a file is in ADF.
pub(super) fn is_adf(bytes: &[u8]) -> bool {
    bytes.get(..4).is_some_and(|first| first.iter().zip(MAGIC).all(|(a, b)| a & 0x7f == *b))
        && bytes[4..].starts_with(TITLE)
}

impl Adf {
    /// The file with these bytes. `path` is for messages.
    ///
    /// # Errors
    /// - [`ReadError::Unsupported`]: another version, or numbers of another machine
    /// - [`ReadError::Malformed`], [`ReadError::Truncated`]
    pub fn open(path: &Path, shared: &Shared) -> Result<Self, ReadError> {
        let bytes = &shared.bytes[..];
        let malformed = |expected: &str, found: &dyn Display| ReadError::Malformed {
            place: Location::File(path.into()),
            expected: expected.into(),
            found: found.to_string(),
        };
        let header = bytes.get(..HEADER).ok_or_else(|| ReadError::Truncated {
            place: Location::Byte(path.into(), bytes.len()),
            expected: "the header of ADF".into(),
        })?;
        let hint = "turn it into HDF5 (adf2hdf old.cgns new.cgns)";
        let unsupported = |found| ReadError::Unsupported { path: path.into(), found, hint };
        if header[4 + TITLE.len()] != b'A' {
            let version = String::from_utf8_lossy(&header[4 + TITLE.len()..32]);
            return Err(unsupported(format!("ADF of version {}", version.trim_end_matches('>'))));
        }
        let tags = [(32, b"AdF0"), (64, b"AdF1"), (96, b"AdF2"), (102, b"AdF3"), (130, b"AdF4"), (182, b"AdF5")];
        if tags.iter().any(|&(at, tag)| &header[at..at + 4] != tag) {
            return Err(malformed("a header of ADF", &"others between its parts"));
        }
        let endian = match header[100] {
            b'L' => Endian::Little,
            b'B' => Endian::Big,
            other => return Err(unsupported(format!("ADF with numbers of kind '{}'", char::from(other)))),
        };
        let of_header =
            |at| place(bytes, at).ok_or_else(|| malformed("a place in the file's header", &"other letters"));
        let (root, end) = (of_header(134)?, of_header(146)?);
        if end >= bytes.len() {
            let expected = format!("the rest of its {} bytes", end.saturating_add(1));
            return Err(ReadError::Truncated { place: Location::Byte(path.into(), bytes.len()), expected });
        }
        shared.note(0..HEADER);
        check_node(shared, root).ok_or_else(|| malformed("the root of ADF", &"none at its place"))?;
        Ok(Self { endian, root, parents: RefCell::default() })
    }

    /// Names and places of the children of a node.
    ///
    /// # Errors
    /// [`ReadError::Malformed`]
    pub fn children(&self, spot: &Spot, at: usize) -> Result<Vec<(String, usize)>, ReadError> {
        let shared = spot.source.shared;
        let bytes = &shared.bytes[..];
        let malformed = |found: &dyn Display| spot.malformed("the children of a node of ADF", found);
        let count = hexadecimal(bytes, at + of::N_CHILDREN, 8).ok_or_else(|| malformed(&"no number of them"))?;
        if count == 0 {
            return Ok(Vec::new());
        }
        let entry = NAME + PLACE;
        let table = place(bytes, at + of::CHILDREN).filter(|&table| is_at(bytes, table, b"SNTb"));
        let table = table.ok_or_else(|| malformed(&"no table of them"))?;
        let first = table + BEFORE;
        let end = count.checked_mul(entry).and_then(|length| first.checked_add(length));
        let end = end.filter(|&end| end <= bytes.len()).ok_or_else(|| malformed(&format_args!("{count} of them")))?;
        shared.note(table..end);
        let mut children = Vec::with_capacity(count);
        for index in 0..count {
            let start = first + index * entry;
            let child = place(bytes, start + NAME).filter(|&child| check_node(shared, child).is_some());
            let child = child.ok_or_else(|| malformed(&format_args!("none at the place of number {}", index + 1)))?;
            let parent = *self.parents.borrow_mut().entry(child).or_insert((at, index));
            if child == self.root || parent != (at, index) {
                return Err(malformed(&format_args!("number {} that is elsewhere in the tree too", index + 1)));
            }
            children.push((words(&bytes[child + of::NAME..][..NAME]), child));
        }
        Ok(children)
    }

    /// The data of a node.
    ///
    /// # Errors
    /// - [`ReadError::Malformed`]
    /// - [`ReadError::Unpacked`], [`ReadError::Memory`]: data of many chunks are too large
    pub fn data<'a>(&self, spot: &Spot<'a>, at: usize) -> Result<Data<'a>, ReadError> {
        let shared = spot.source.shared;
        let bytes = &shared.bytes[..];
        let malformed = |found: &dyn Display| spot.malformed("data", found);
        let kind = words(&bytes[at + of::TYPE..][..NAME]);
        let number = match &*kind {
            "C1" | "B1" => Number::I8,
            "I4" => Number::I32,
            "U4" => Number::U32,
            "I8" => Number::I64,
            "U8" => Number::U64,
            "R4" => Number::F32,
            "R8" => Number::F64,
            _ => return Err(malformed(&format_args!("data of the type '{kind}'"))),
        };
        let n_indices = hexadecimal(bytes, at + of::N_INDICES, 2).filter(|count| (1..=12).contains(count));
        let n_indices = n_indices.ok_or_else(|| malformed(&"no sizes"))?;
        let mut length = Some(number.bytes());
        for index in 0..n_indices {
            let size = hexadecimal(bytes, at + of::SIZES + 8 * index, 8);
            length = length.zip(size).and_then(|(length, size)| length.checked_mul(size));
        }
        let length = length.filter(|&length| length <= bytes.len()).ok_or_else(|| malformed(&"more than the file"))?;
        let n_chunks = hexadecimal(bytes, at + of::N_CHUNKS, 4).ok_or_else(|| malformed(&"no number of chunks"))?;
        let first = place(bytes, at + of::CHUNKS);
        let places: Vec<Option<usize>> = match (n_chunks, first) {
            (1, first) => vec![first],
            (0, _) | (_, None) => return Err(malformed(&"none that were written")),
            (_, Some(table)) => {
                let end = table.saturating_add(BEFORE + 2 * PLACE * n_chunks);
                if !is_at(bytes, table, b"DCtb") || end > bytes.len() {
                    return Err(malformed(&"no table of chunks"));
                }
                shared.note(table..end);
                (0..n_chunks).map(|index| place(bytes, table + BEFORE + 2 * PLACE * index)).collect()
            }
        };
        let (mut pieces, mut rest) = (Vec::new(), length);
        for chunk in places {
            let chunk = chunk.filter(|&chunk| is_at(bytes, chunk, b"DaTa"));
            let chunk = chunk.ok_or_else(|| malformed(&"no chunk at its place"))?;
            let (start, end) = (chunk + BEFORE, place(bytes, chunk + 4));
            let end = end.filter(|&end| start <= end && is_at(bytes, end, b"dEnD"));
            let end = end.ok_or_else(|| malformed(&"a chunk without an end"))?;
            shared.note(chunk..start);
            shared.note(end..end + 4);
            let used = rest.min(end - start);
            pieces.push(start..start + used);
            rest -= used;
        }
        if rest > 0 {
            return Err(malformed(&format_args!("{rest} bytes too few")));
        }
        pieces.retain(|piece| !piece.is_empty());
        let bytes = match &pieces[..] {
            [piece] => Cow::Borrowed(&bytes[piece.clone()]),
            _ => {
                spot.source.allowance.take(spot.path(), length)?;
                Cow::Owned(pieces.iter().flat_map(|piece| &bytes[piece.clone()]).copied().collect())
            }
        };
        Ok(Data { bytes, number, endian: self.endian, store: Store::Pieces(pieces) })
    }
}

/// The label of a node, and whether the node stands for another one.
pub(super) fn label(bytes: &[u8], at: usize) -> (String, bool) {
    let words = |offset| words(&bytes[at + offset..][..NAME]);
    (words(of::LABEL), words(of::TYPE) == "LK")
}

/// Checks that there is a node at a place.
fn check_node(shared: &Shared, at: usize) -> Option<()> {
    let bytes = &shared.bytes[..];
    let is_node = is_at(bytes, at, b"NoDe") && is_at(bytes, at.checked_add(of::END)?, b"TaiL");
    shared.note(at..at.checked_add(NODE)?);
    is_node.then_some(())
}

/// Whether a tag stands at a place.
fn is_at(bytes: &[u8], at: usize, tag: &[u8; 4]) -> bool {
    bytes.get(at..).is_some_and(|rest| rest.starts_with(tag))
}

/// The number in these letters.
fn hexadecimal(bytes: &[u8], at: usize, length: usize) -> Option<usize> {
    let letters = bytes.get(at..at.checked_add(length)?)?;
    letters.iter().try_fold(0usize, |number, &letter| {
        let digit = char::from(letter).to_digit(16)?;
        number.checked_mul(16)?.checked_add(digit as usize)
    })
}

/// The place in the file that stands in these letters.
fn place(bytes: &[u8], at: usize) -> Option<usize> {
    let (block, offset) = (hexadecimal(bytes, at, 8)?, hexadecimal(bytes, at.checked_add(8)?, 4)?);
    block.checked_mul(BLOCK)?.checked_add(offset)
}

/// The words of a text, which blanks or zeros fill.
fn words(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim_end_matches([' ', '\0']).to_owned()
}
