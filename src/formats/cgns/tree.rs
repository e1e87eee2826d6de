//! The tree of a CGNS file: nodes with a name, a label, data and children.

use std::borrow::Cow;
use std::fmt::Display;
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use hdf5_pure::{FormatError, Group, Source};

use super::adf::{self, Adf};
use super::hdf5;
use super::headers::Header;
use crate::formats::allowance::Allowance;
use crate::formats::error::{Location, ReadError};
use crate::formats::number::{Integers, Number};
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

impl Source for Shared {
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
pub(super) struct Tree<'a> {
    /// Path of the file, for messages.
    pub file: &'a Path,
    pub shared: &'a Shared,
    /// Bytes to which all packed arrays together may unpack.
    pub allowance: Allowance<'a>,
    /// The file if it is in ADF and not in HDF5.
    adf: Option<Adf>,
}

impl<'a> Tree<'a> {
    pub fn new(file: &'a Path, shared: &'a Shared, adf: Option<Adf>) -> Self {
        Self { file, shared, allowance: Allowance::new(file, shared.bytes.len()), adf }
    }
}

/// A node in its kind of file.
enum Handle<'a> {
    Hdf5(Group),
    /// A node of ADF, with its place.
    Adf(&'a Adf, usize),
}

/// A node of the tree.
pub(super) struct Node<'a> {
    pub tree: &'a Tree<'a>,
    /// The names on the way to the node, each after a slash.
    path: String,
    handle: Handle<'a>,
}

impl<'a> Node<'a> {
    /// The root of a file, which is in ADF or `hdf5`.
    pub fn root(tree: &'a Tree<'a>, hdf5: impl FnOnce() -> Result<Group, ReadError>) -> Result<Self, ReadError> {
        let handle = match &tree.adf {
            Some(adf) => Handle::Adf(adf, adf.root),
            None => Handle::Hdf5(hdf5()?),
        };
        Ok(Self { tree, path: String::new(), handle })
    }

    pub fn name(&self) -> &str {
        self.path.rsplit('/').next().unwrap_or_default()
    }

    /// The names on the way to the node, such as `/Base/Zone`.
    pub fn path(&self) -> &str {
        if self.path.is_empty() { "/" } else { &self.path }
    }

    pub fn place(&self) -> Location {
        Location::Node(self.tree.file.into(), self.path().into())
    }

    /// The error of a node that idmesh does not read.
    pub fn unsupported(&self, found: impl Display, hint: &'static str) -> ReadError {
        ReadError::Unsupported { path: self.tree.file.into(), found: format!("{}: {found}", self.path()), hint }
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

    /// The child with this name, if there is one.
    pub fn find(&self, name: &str) -> Option<Self> {
        let handle = match &self.handle {
            Handle::Hdf5(group) => Handle::Hdf5(group.group(name).ok()?),
            &Handle::Adf(adf, at) => {
                let children = adf.children(self, at).ok()?;
                Handle::Adf(adf, children.into_iter().find(|(found, _)| found == name)?.1)
            }
        };
        Some(self.below(name, handle))
    }

    fn below(&self, name: &str, handle: Handle<'a>) -> Self {
        Self { tree: self.tree, path: format!("{}/{name}", self.path), handle }
    }

    /// The child with this name.
    ///
    /// # Errors
    /// [`ReadError::Malformed`]: there is none.
    pub fn child(&self, name: &str) -> Result<Self, ReadError> {
        self.find(name).ok_or_else(|| self.malformed(format!("a node {name} in it"), "none"))
    }

    /// The children with this label, in the order of their names: HDF5 keeps no other order.
    pub fn children(&self, label: &str) -> Result<Vec<Self>, ReadError> {
        let labelled = self.labelled()?.into_iter().filter(|(found, _)| found == label);
        Ok(labelled.map(|(_, node)| node).collect())
    }

    /// All children with their labels, in the order of their names.
    pub fn labelled(&self) -> Result<Vec<(String, Self)>, ReadError> {
        let mut children: Vec<Self> = match &self.handle {
            Handle::Hdf5(group) => {
                let names = group.groups().map_err(|error| self.malformed("nodes of CGNS", error))?;
                names.iter().map(|name| self.child(name)).collect::<Result<_, _>>()?
            }
            &Handle::Adf(adf, at) => {
                let children = adf.children(self, at)?;
                children.into_iter().map(|(name, child)| self.below(&name, Handle::Adf(adf, child))).collect()
            }
        };
        children.sort_by(|a, b| a.path.cmp(&b.path));
        let mut labelled = Vec::with_capacity(children.len());
        for node in children {
            let (label, is_link) = match &node.handle {
                Handle::Hdf5(group) => hdf5::label(group).map_err(|error| node.malformed("a node of CGNS", error))?,
                Handle::Adf(_, at) => adf::label(&self.tree.shared.bytes, *at),
            };
            if is_link {
                return Err(node.unsupported("a link to another node", "save the mesh as one file without links"));
            }
            labelled.push((label, node));
        }
        Ok(labelled)
    }

    /// The node's data.
    pub fn data(&self) -> Result<Data<'a>, ReadError> {
        match &self.handle {
            Handle::Hdf5(group) => hdf5::data(self, group),
            Handle::Adf(adf, at) => adf.data(self, *at),
        }
    }

    /// The header that says where the data are. `None` if its format is not known.
    pub fn header(&self) -> Option<Header> {
        let Handle::Hdf5(_) = self.handle else { return None };
        let names: Vec<&str> = self.path.split('/').skip(1).collect();
        hdf5::header(&self.tree.shared.unread(), &names)
    }

    /// The data as whole numbers.
    pub fn integers(&self) -> Result<Integers<'a>, ReadError> {
        let Data { bytes, number, endian, store } = self.data()?;
        self.note(&store);
        // In a broken file many nodes may have the same bytes.
        self.tree.allowance.take(&format!("the node {}", self.path()), bytes.len())?;
        Integers::stored(bytes, number, endian).ok_or_else(|| self.malformed("whole numbers", "others"))
    }

    /// The data as text.
    pub fn text(&self) -> Result<String, ReadError> {
        let Data { bytes, number, store, .. } = self.data()?;
        self.note(&store);
        if number.bytes() != 1 {
            return Err(self.malformed("text", "numbers"));
        }
        Ok(String::from_utf8_lossy(&bytes).trim_end_matches(['\0', ' ']).to_string())
    }

    /// Notes that data are read that are no coordinates.
    fn note(&self, store: &Store) {
        let Store::Pieces(pieces) = store else { return };
        for piece in pieces {
            // Two notes, so that these bytes are not taken for coordinates that are read whole.
            let middle = piece.start + piece.len() / 2;
            self.tree.shared.note(piece.start..middle);
            self.tree.shared.note(middle..piece.end);
        }
    }
}
