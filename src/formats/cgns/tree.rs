//! The tree of a CGNS file: nodes with a name, a label, data and children.
//!
//! Source: the CGNS standard, "SIDS file mapping, HDF5".

use std::borrow::Cow;
use std::fmt::Display;
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use hdf5_pure::{AttrValue, Dataset, Datatype, DatatypeByteOrder, File, FormatError, Group, Layout, Source};

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

    /// Notes that these bytes are read.
    fn note(&self, range: Range<usize>) {
        self.reads.lock().unwrap_or_else(PoisonError::into_inner).push(range);
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

/// A node of the tree.
pub(super) struct Node<'a> {
    file: &'a Path,
    shared: &'a Shared,
    /// The names on the way to the node, each after a slash.
    path: String,
    group: Group,
}

impl<'a> Node<'a> {
    /// The root of a file.
    ///
    /// - `file`: path, for messages
    pub fn root(file: &'a Path, shared: &'a Shared, hdf5: &File) -> Self {
        Self { file, shared, path: String::new(), group: hdf5.root() }
    }

    pub fn name(&self) -> &str {
        self.path.rsplit('/').next().unwrap_or_default()
    }

    /// The names on the way to the node, such as `/Base/Zone`.
    pub fn path(&self) -> &str {
        if self.path.is_empty() { "/" } else { &self.path }
    }

    pub fn place(&self) -> Location {
        Location::Node(self.file.into(), self.path().into())
    }

    /// The error of a node that idmesh does not read.
    pub fn unsupported(&self, found: impl Display, hint: &'static str) -> ReadError {
        ReadError::Unsupported { path: self.file.into(), found: format!("{}: {found}", self.path()), hint }
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
        let group = self.group.group(name).ok()?;
        Some(Self { file: self.file, shared: self.shared, path: format!("{}/{name}", self.path), group })
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
        let mut names = self.group.groups().map_err(|error| self.malformed("nodes of CGNS", error))?;
        names.sort();
        let mut children = Vec::new();
        for name in names {
            let node = self.child(&name)?;
            let attributes = node.group.attrs().map_err(|error| node.malformed("a node of CGNS", error))?;
            let label = match attributes.get("label") {
                Some(AttrValue::String(text) | AttrValue::AsciiString(text)) => text.trim_end_matches('\0'),
                Some(AttrValue::AsciiStringSized { value, .. } | AttrValue::StringSized { value, .. }) => {
                    value.trim_end_matches('\0')
                }
                _ => "",
            };
            children.push((label.to_owned(), node));
        }
        Ok(children)
    }

    /// The only child with this label.
    ///
    /// - `hint`: advice for a file with several such children
    pub fn only(&self, label: &str, what: &'static str, hint: &'static str) -> Result<Self, ReadError> {
        let mut nodes = self.children(label)?;
        let path = self.file.into();
        match (nodes.pop(), nodes.len()) {
            (Some(node), 0) => Ok(node),
            (None, _) => Err(ReadError::Missing { path, what, hint: "is it a complete CGNS file?" }),
            (_, more) => Err(self.unsupported(format_args!("CGNS with {} {what}s", more + 1), hint)),
        }
    }

    /// The node's data. Data with more numbers than the file has bytes are refused.
    pub fn data(&self) -> Result<Dataset, ReadError> {
        // The name begins with a space.
        let data = self.group.dataset(" data").map_err(|error| self.malformed("data", error))?;
        let shape = data.shape().map_err(|error| self.malformed("data", error))?;
        let n_values = shape.iter().try_fold(1u64, |product, &size| product.checked_mul(size)).unwrap_or(u64::MAX);
        let length = self.shared.bytes.len();
        if n_values > length as u64 {
            let expected = format!("data within the {length} bytes of the file");
            return Err(self.malformed(expected, format_args!("{n_values} values")));
        }
        // A chunk is unpacked whole, however few of its values belong to the data.
        if let Ok(Layout::Chunked { chunk_shape, .. }) = data.layout() {
            let in_chunk = chunk_shape.iter().try_fold(8u64, |product, &size| product.checked_mul(size));
            Allowance::new(self.file, length)
                .take(&format!("a chunk of {}", self.path), in_chunk.map_or(usize::MAX, |bytes| bytes as usize))?;
        }
        Ok(data)
    }

    /// Offset and bytes of the data in the file, if they are in one piece.
    pub fn stored(&self, data: &Dataset) -> Result<Option<(usize, &'a [u8])>, ReadError> {
        let Layout::Contiguous { address: Some(address), size } =
            data.layout().map_err(|error| self.malformed("data", error))?
        else {
            return Ok(None);
        };
        let range = |start: usize| Some(start..start.checked_add(usize::try_from(size).ok()?)?);
        let found =
            usize::try_from(address).ok().and_then(|start| Some((start, self.shared.bytes.get(range(start)?)?)));
        found.map(Some).ok_or_else(|| self.malformed("data", "an end of the file before theirs"))
    }

    /// The data as whole numbers.
    pub fn integers(&self) -> Result<Integers<'a>, ReadError> {
        let data = self.data()?;
        let datatype = data.datatype().map_err(|error| self.malformed("whole numbers", error))?;
        if let Some((number, endian)) = number_of(&datatype)
            && let Some((start, bytes)) = self.stored(&data)?
            && let Some(integers) = Integers::stored(Cow::Borrowed(bytes), number, endian)
            && data.shape().is_ok_and(|shape| shape.iter().product::<u64>() == integers.len() as u64)
        {
            // Two notes, so that these bytes are not taken for coordinates that are read whole.
            self.shared.note(start..start + bytes.len() / 2);
            self.shared.note(start + bytes.len() / 2..start + bytes.len());
            return Ok(integers);
        }
        let values = data.read_i64().map_err(|error| self.malformed("whole numbers", error))?;
        Ok(values.into())
    }

    /// The data as text.
    pub fn text(&self) -> Result<String, ReadError> {
        let bytes = self.data()?.read_i8().map_err(|error| self.malformed("text", error))?;
        let bytes: Vec<u8> = bytes.into_iter().map(|byte| byte as u8).collect();
        Ok(String::from_utf8_lossy(&bytes).trim_end_matches(['\0', ' ']).to_string())
    }
}

/// Number type and byte order of an HDF5 type, if CGNS uses it for whole numbers: signed, 32 or 64
/// bits.
fn number_of(datatype: &Datatype) -> Option<(Number, Endian)> {
    let Datatype::FixedPoint { size, byte_order, layout } = datatype else { return None };
    let full = layout.signed && layout.bit_offset == 0 && u32::from(layout.bit_precision) == 8 * size;
    let number = match size {
        4 if full => Number::I32,
        8 if full => Number::I64,
        _ => return None,
    };
    match byte_order {
        DatatypeByteOrder::LittleEndian => Some((number, Endian::Little)),
        DatatypeByteOrder::BigEndian => Some((number, Endian::Big)),
        DatatypeByteOrder::Vax => None,
    }
}
