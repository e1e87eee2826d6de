//! What is read of a CGNS file: its bytes, the places of nodes, and their data.

use std::borrow::Cow;
use std::fmt::Display;
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use hdf5_pure::FormatError;

use crate::formats::allowance::Allowance;
use crate::formats::error::{Location, ReadError};
use crate::formats::number::Number;
use crate::formats::scanner::Endian;

/// The bytes of a file, shared by HDF5 and idmesh, and which of them have been read.
#[derive(Clone)]
pub(super) struct Shared {
    pub bytes: Arc<Vec<u8>>,
    reads: Arc<Mutex<Vec<Range<usize>>>>,
}

impl Shared {
    pub fn new(bytes: Vec<u8>) -> Self {
        Self { bytes: Arc::new(bytes), reads: Arc::default() }
    }

    /// The same bytes, of which none has been read.
    pub fn unread(&self) -> Self {
        Self { bytes: Arc::clone(&self.bytes), reads: Arc::default() }
    }

    /// Notes that these bytes are read.
    pub fn note(&self, range: Range<usize>) {
        self.reads.lock().unwrap_or_else(PoisonError::into_inner).push(range);
    }

    /// The ranges that have been read since this was asked last, in their order.
    pub fn take_reads(&self) -> Vec<Range<usize>> {
        std::mem::take(&mut self.reads.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Whether bytes of a range have been read together with bytes outside it, or only some of
    /// them.
    pub fn is_used_otherwise(&self, range: &Range<usize>) -> bool {
        let reads = self.reads.lock().unwrap_or_else(PoisonError::into_inner);
        reads.iter().any(|read| read != range && read.start < range.end && range.start < read.end)
    }
}

impl hdf5_pure::Source for Shared {
    fn len(&self) -> u64 {
        self.bytes.len() as u64
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> Result<(), FormatError> {
        let end = FormatError::UnexpectedEof {
            expected: usize::try_from(offset).unwrap_or(usize::MAX).saturating_add(buffer.len()),
            available: self.bytes.len(),
        };
        let start =
            usize::try_from(offset).ok().filter(|&start| start <= self.bytes.len()).ok_or_else(|| end.clone())?;
        let found = self.bytes[start..].get(..buffer.len()).ok_or(end)?;
        self.note(start..start + buffer.len());
        buffer.copy_from_slice(found);
        Ok(())
    }
}

/// Where the bytes of an array are in a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Store {
    /// Ranges of the file, which hold the array one after another.
    Pieces(Vec<Range<usize>>),
    /// Packed, or in an object header.
    Elsewhere,
}

/// The data of a node.
pub(super) struct Data<'a> {
    pub bytes: Cow<'a, [u8]>,
    pub number: Number,
    pub endian: Endian,
    pub store: Store,
}

/// A file that is read.
pub(super) struct Source<'a> {
    /// Path of the file, for messages.
    pub path: &'a Path,
    pub shared: &'a Shared,
    /// Bytes to which all packed arrays together may unpack.
    pub allowance: Allowance<'a>,
}

impl<'a> Source<'a> {
    pub fn new(path: &'a Path, shared: &'a Shared) -> Self {
        Self { path, shared, allowance: Allowance::new(path, shared.bytes.len()) }
    }
}

/// The place of a node in the tree of a file.
pub(super) struct Spot<'a> {
    pub source: &'a Source<'a>,
    /// The names on the way to the node, each after a slash.
    path: String,
}

impl<'a> Spot<'a> {
    pub fn root(source: &'a Source<'a>) -> Self {
        Self { source, path: String::new() }
    }

    /// The place of a child.
    pub fn below(&self, name: &str) -> Self {
        Self { source: self.source, path: format!("{}/{name}", self.path) }
    }

    pub fn name(&self) -> &str {
        self.path.rsplit('/').next().unwrap_or_default()
    }

    /// The names on the way to the node, such as `/Base/Zone`.
    pub fn path(&self) -> &str {
        if self.path.is_empty() { "/" } else { &self.path }
    }

    pub fn place(&self) -> Location {
        Location::Node(self.source.path.into(), self.path().into())
    }

    /// The error of a node that idmesh does not read.
    pub fn unsupported(&self, found: impl Display, hint: &'static str) -> ReadError {
        ReadError::Unsupported { path: self.source.path.into(), found: format!("{}: {found}", self.path()), hint }
    }

    /// The error with the node's name, if the error is about something that is not read.
    pub fn named(&self, error: ReadError) -> ReadError {
        match error {
            ReadError::Unsupported { found, hint, .. } => self.unsupported(found, hint),
            error => error,
        }
    }

    /// The error of a node that is not as `expected`.
    pub fn malformed(&self, expected: impl Into<String>, found: impl Display) -> ReadError {
        ReadError::Malformed { place: self.place(), expected: expected.into(), found: found.to_string() }
    }
}
