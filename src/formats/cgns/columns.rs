//! The coordinates of a CGNS file: one array per axis.

use std::io::{self, Write};

use glam::DVec3;

use crate::formats::document::{Coordinates, check_single, narrow};
use crate::formats::out::Out;
use crate::formats::scanner::{Endian, Width};

/// Coordinates with one array per axis in the file.
#[derive(Debug)]
pub(super) struct Columns {
    /// Offsets of the arrays of x, y and z.
    pub starts: [usize; 3],
    pub kind: (Width, Endian),
}

impl Columns {
    pub const KINDS: [(Width, Endian); 4] = [
        (Width::Double, Endian::Little),
        (Width::Double, Endian::Big),
        (Width::Single, Endian::Little),
        (Width::Single, Endian::Big),
    ];

    /// Whether these bytes hold these numbers in this encoding.
    pub fn holds((width, endian): (Width, Endian), bytes: &[u8], values: &[f64]) -> bool {
        bytes.len() == values.len() * width.bytes()
            && bytes.chunks_exact(width.bytes()).zip(values).all(|(bytes, &value)| match width {
                Width::Double => bytes == endian.double(value),
                Width::Single => bytes == endian.single(value as f32),
            })
    }
}

impl Coordinates for Columns {
    fn write(&self, bytes: &[u8], out: &mut Out, vertices: &[DVec3]) -> io::Result<()> {
        let mut bytes = bytes.to_vec();
        let (width, endian) = self.kind;
        if width == Width::Single {
            check_single(vertices)?;
        }
        for (axis, start) in self.starts.into_iter().enumerate() {
            let column = &mut bytes[start..start + vertices.len() * width.bytes()];
            for (place, vertex) in column.chunks_exact_mut(width.bytes()).zip(vertices) {
                match width {
                    Width::Double => place.copy_from_slice(&endian.double(vertex[axis])),
                    Width::Single => place.copy_from_slice(&endian.single(narrow(vertex[axis])?)),
                }
            }
        }
        out.write_all(&bytes)
    }
}
