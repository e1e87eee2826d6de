//! The coordinates of a CGNS file: in each zone one array per axis.

use std::io::{self, Write};
use std::ops::Range;

use glam::DVec3;

use super::headers::{Header, append};
use crate::formats::document::{Coordinates, check_single, narrow};
use crate::formats::out::Out;
use crate::formats::scanner::{Endian, Width};

/// An array of coordinates in the file.
#[derive(Debug)]
pub(super) struct Column {
    pub width: Width,
    pub endian: Endian,
    pub place: Place,
}

/// Where an array of coordinates is.
#[derive(Debug)]
pub(super) enum Place {
    /// Ranges of the file, which hold the array one after another.
    Pieces(Vec<Range<usize>>),
    /// Within an object header.
    Header { range: Range<usize>, header: Header },
    /// In packed chunks. The bytes are those of the array unpacked. Other coordinates go to the end
    /// of the file, and the header then says so.
    Packed { header: Header, bytes: Vec<u8> },
}

impl Column {
    /// Whether the array can only be written back unpacked.
    pub fn is_packed(&self) -> bool {
        matches!(self.place, Place::Packed { .. })
    }

    /// The ranges of the file in which the coordinates are written back.
    pub fn ranges(&self) -> &[Range<usize>] {
        match &self.place {
            Place::Pieces(pieces) => pieces,
            Place::Header { range, .. } => std::slice::from_ref(range),
            Place::Packed { .. } => &[],
        }
    }

    pub fn is_in_header(&self) -> bool {
        matches!(self.place, Place::Header { .. })
    }

    /// The bytes of other coordinates.
    fn encode(&self, values: impl Iterator<Item = f64>) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        for value in values {
            match self.width {
                Width::Double => bytes.extend(self.endian.double(value)),
                Width::Single => bytes.extend(self.endian.single(narrow(value)?)),
            }
        }
        Ok(bytes)
    }

    /// Writes coordinates into the bytes of a file.
    fn write(&self, file: &mut Vec<u8>, values: impl Iterator<Item = f64>) -> io::Result<()> {
        let column = self.encode(values)?;
        match &self.place {
            Place::Pieces(pieces) => {
                let mut rest = &column[..];
                for piece in pieces {
                    let (own, after) = rest.split_at(piece.len());
                    file[piece.clone()].copy_from_slice(own);
                    rest = after;
                }
            }
            Place::Header { range, header } => {
                file[range.clone()].copy_from_slice(&column);
                header.sum_of(file, range);
            }
            Place::Packed { bytes, .. } if *bytes == column => {}
            Place::Packed { header, .. } => {
                let place = append(file, &column);
                let said = place.and_then(|place| header.set_place(file, place, column.len()));
                said.ok_or_else(|| io::Error::other("the object header has no room for unpacked coordinates"))?;
            }
        }
        Ok(())
    }
}

/// The coordinates of a zone.
#[derive(Debug)]
pub(super) struct Columns {
    /// The arrays of x, y and z.
    pub axes: [Column; 3],
}

impl Coordinates for Columns {
    fn write(&self, bytes: &[u8], out: &mut Out, vertices: &[DVec3]) -> io::Result<()> {
        let mut bytes = bytes.to_vec();
        if self.axes.iter().any(|column| column.width == Width::Single) {
            check_single(vertices)?;
        }
        for (axis, column) in self.axes.iter().enumerate() {
            column.write(&mut bytes, vertices.iter().map(|vertex| vertex[axis]))?;
        }
        out.write_all(&bytes)
    }
}
