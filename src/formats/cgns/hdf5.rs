//! The nodes of a CGNS file in HDF5: groups with attributes and a dataset.
//!
//! Source: the CGNS standard, "SIDS file mapping, HDF5".

use std::borrow::Cow;
use std::fmt::Display;

use hdf5_pure::{AttrValue, ChunkIndex, Datatype, DatatypeByteOrder, Error, File, FloatingPointLayout, Group, Layout};

use super::chunks;
use super::data::{Data, Shared, Spot, Store};
use super::headers::Header;
use crate::formats::error::ReadError;
use crate::formats::number::Number;
use crate::formats::scanner::Endian;

/// The dataset with a node's data. Its name begins with a space.
const DATA: &str = " data";

/// The label of a node, and whether the node stands for another one.
pub(super) fn label(group: &Group) -> Result<(String, bool), Error> {
    let attributes = group.attrs()?;
    let text = |key: &str| match attributes.get(key) {
        Some(AttrValue::String(text) | AttrValue::AsciiString(text)) => text,
        Some(AttrValue::AsciiStringSized { value, .. } | AttrValue::StringSized { value, .. }) => value.as_str(),
        _ => "",
    };
    let [label, kind] = ["label", "type"].map(|key| text(key).trim_end_matches('\0'));
    Ok((label.to_owned(), kind == "LK"))
}

/// The data of a node.
///
/// # Errors
/// - [`ReadError::Malformed`]: data reach beyond the file, or are not numbers
/// - [`ReadError::Unsupported`]: packed in an unknown way
/// - [`ReadError::Unpacked`], [`ReadError::Memory`]: packed data are too large
pub(super) fn data<'a>(spot: &Spot<'a>, group: &Group) -> Result<Data<'a>, ReadError> {
    let shared = spot.source.shared;
    let malformed = |error: &dyn Display| spot.malformed("data", error);
    let data = group.dataset(DATA).map_err(|error| malformed(&error))?;
    let datatype = data.datatype().map_err(|error| malformed(&error))?;
    let (number, endian) = number_of(&datatype).ok_or_else(|| malformed(&"numbers of an unknown type"))?;
    let shape = data.shape().map_err(|error| malformed(&error))?;
    let sizes = shape.iter().copied().chain([number.bytes() as u64]);
    let length = sizes.fold(1u64, |product, size| product.saturating_mul(size));
    let layout = data.layout().map_err(|error| malformed(&error))?;
    let plain = |start: u64| {
        let range = usize::try_from(start).ok().zip(usize::try_from(length).ok());
        let range = range.and_then(|(start, length)| Some(start..start.checked_add(length)?));
        let found = range.and_then(|range| Some((shared.bytes.get(range.clone())?, range)));
        let what = format!("data within the {} bytes of the file", shared.bytes.len());
        found.ok_or_else(|| spot.malformed(what, format_args!("{length} bytes from {start} on")))
    };
    match layout {
        Layout::Contiguous { address: Some(address), size } => {
            if size != length {
                return Err(malformed(&format_args!("{size} bytes for {length}")));
            }
            let (bytes, range) = plain(address)?;
            let store = Store::Pieces(vec![range]);
            Ok(Data { bytes: Cow::Borrowed(bytes), number, endian, store })
        }
        Layout::Compact { .. } => {
            let bytes = data.read_raw().map_err(|error| malformed(&error))?;
            if bytes.len() as u64 != length {
                return Err(malformed(&format_args!("{} bytes for {length}", bytes.len())));
            }
            Ok(Data { bytes: Cow::Owned(bytes), number, endian, store: Store::Elsewhere })
        }
        Layout::Chunked { index: ChunkIndex::BTreeV2, .. } => {
            let found = "data in chunks that may grow in several directions (a B-tree of version 2)";
            Err(spot.unsupported(found, "repack it (h5repack -l CONTI old.cgns new.cgns)"))
        }
        Layout::Chunked { chunk_shape, .. } => {
            let (bytes, store) = chunks::read(spot, &data, &shape, &chunk_shape, number.bytes())?;
            Ok(Data { bytes: Cow::Owned(bytes), number, endian, store })
        }
        _ => Err(malformed(&"none that were written")),
    }
}

/// The header of the data of a node. `None` if its format is not known.
///
/// - `shared`: a file of which nothing has been read
/// - `names`: the way to the node
pub(super) fn header(shared: &Shared, names: &[&str]) -> Option<Header> {
    let file = File::from_source(shared.clone()).ok()?;
    // Free space that the file keeps would have to be extended too.
    if file.file_space_info().is_some() {
        return None;
    }
    let mut group = file.root();
    for name in names {
        group = group.group(name).ok()?;
    }
    shared.take_reads();
    group.dataset(DATA).ok()?;
    // The header is read last, perhaps in parts.
    shared.take_reads().iter().rev().find_map(|read| Header::parse(&shared.bytes, read.start))
}

/// Number type and byte order of an HDF5 type, if CGNS uses it.
fn number_of(datatype: &Datatype) -> Option<(Number, Endian)> {
    let (number, byte_order) = match datatype {
        Datatype::FixedPoint { size, byte_order, layout } => {
            let is_full = layout.bit_offset == 0 && Some(layout.bit_precision.into()) == size.checked_mul(8);
            let number = match (size, layout.signed) {
                (1, true) => Number::I8,
                (1, false) => Number::U8,
                (2, true) => Number::I16,
                (2, false) => Number::U16,
                (4, true) => Number::I32,
                (4, false) => Number::U32,
                (8, true) => Number::I64,
                (8, false) => Number::U64,
                _ => return None,
            };
            (is_full.then_some(number)?, byte_order)
        }
        Datatype::FloatingPoint { size: 4, byte_order, layout: FloatingPointLayout::IEEE754_BINARY32 } => {
            (Number::F32, byte_order)
        }
        Datatype::FloatingPoint { size: 8, byte_order, layout: FloatingPointLayout::IEEE754_BINARY64 } => {
            (Number::F64, byte_order)
        }
        _ => return None,
    };
    match byte_order {
        DatatypeByteOrder::LittleEndian => Some((number, Endian::Little)),
        DatatypeByteOrder::BigEndian => Some((number, Endian::Big)),
        DatatypeByteOrder::Vax => None,
    }
}
