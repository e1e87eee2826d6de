//! The points of a VTU file, and their writing.

use std::collections::HashMap;
use std::io::{self, Write};
use std::ops::Range;

use glam::DVec3;

use super::payload::Payload;
use crate::formats::document::{Coordinates, Slots, check_single, narrow};
use crate::formats::out::Out;
use crate::formats::scanner::{Encoding, Width};

/// The points of a piece in the file.
pub(super) enum Stored {
    /// Text, with the offset of each point.
    Text(Vec<usize>),
    Array(Array),
}

/// An array of points, which is replaced as a whole.
#[derive(Debug)]
pub(super) struct Array {
    /// Offset of the array in the file.
    pub start: usize,
    pub payload: Payload<'static>,
    pub width: Width,
}

/// An offset of an appended array in the file.
#[derive(Clone, Debug)]
pub(super) struct Offset {
    /// Offset from the beginning of the appended arrays.
    pub value: usize,
    /// Offset from the beginning of the file.
    pub start: usize,
    /// Range of the number in the file.
    pub attribute: Range<usize>,
}

/// Merges the points of pieces. Points of different pieces with equal coordinates are one vertex;
/// 0 and -0 are equal.
#[derive(Default)]
pub(super) struct Pieces {
    pub positions: Vec<DVec3>,
    /// Vertex of each point of the file.
    vertex_of: Vec<u32>,
    /// Vertices of earlier pieces, by the bits of their coordinates.
    earlier: HashMap<[u64; 3], u32>,
    unlike: Vec<Unlike>,
    stored: Vec<Stored>,
}

impl Pieces {
    /// Adds the points of a piece and returns their vertices.
    pub fn add(&mut self, points: Vec<DVec3>, stored: Stored) -> &[u32] {
        let first = self.vertex_of.len();
        self.stored.push(stored);
        for point in &points {
            let known = self.earlier.get(&bits(point)).copied();
            self.vertex_of.push(known.unwrap_or_else(|| {
                self.positions.push(*point);
                (self.positions.len() - 1) as u32
            }));
        }
        for (index, (point, &vertex)) in (first..).zip(points.iter().zip(&self.vertex_of[first..])) {
            self.earlier.entry(bits(point)).or_insert(vertex);
            let of_vertex = self.positions[vertex as usize];
            if of_vertex.to_array().map(f64::to_bits) != point.to_array().map(f64::to_bits) {
                self.unlike.push(Unlike { index, point: *point, of_vertex });
            }
        }
        &self.vertex_of[first..]
    }

    /// The vertices and their writer. `None` if some pieces are text and others are not, or if
    /// pieces overlap in the file.
    pub fn finish(self, offsets: Vec<Offset>) -> Option<(Vec<DVec3>, Box<dyn Coordinates>)> {
        let Self { positions, vertex_of, unlike, stored, .. } = self;
        let coordinates = together(stored, offsets)?;
        Some((positions, Box::new(Copies { vertex_of, unlike, coordinates })))
    }
}

/// The writer of all points of a file.
pub(super) fn together(stored: Vec<Stored>, mut offsets: Vec<Offset>) -> Option<Box<dyn Coordinates>> {
    let (mut slots, mut arrays) = (Vec::new(), Vec::<Array>::new());
    for piece in stored {
        match piece {
            Stored::Text(places) => slots.extend(places),
            Stored::Array(array) => arrays.push(array),
        }
    }
    if arrays.is_empty() {
        return Some(Box::new(Slots { encoding: Encoding::Text, width: Width::Double, slots }));
    }
    let apart = arrays.is_sorted_by(|a, b| a.start + a.payload.length <= b.start);
    offsets.retain(|offset| offset.start > arrays[0].start);
    (slots.is_empty() && apart).then(|| Box::new(Points { arrays, offsets }) as Box<dyn Coordinates>)
}

/// The bits of a point's coordinates; 0 and -0 have the same.
pub(super) fn bits(point: &DVec3) -> [u64; 3] {
    // The sum of -0 and 0 is 0.
    point.to_array().map(|value| (value + 0.0).to_bits())
}

/// A point that differs from its vertex in the sign of a zero.
#[derive(Debug)]
struct Unlike {
    /// Index of the point in the file.
    index: usize,
    point: DVec3,
    /// Position of its vertex in the file.
    of_vertex: DVec3,
}

/// Points that occur several times in the file.
#[derive(Debug)]
pub(super) struct Copies {
    /// Vertex of each point of the file.
    vertex_of: Vec<u32>,
    unlike: Vec<Unlike>,
    coordinates: Box<dyn Coordinates>,
}

impl Copies {
    /// Copies of `vertices` `[n_vertices]`, of which `points` `[n_points]` differ at most in the
    /// sign of a zero.
    ///
    /// - `vertex_of` `[n_points]`: vertex of each point
    /// - `coordinates`: the writer of the points
    pub fn new(points: &[DVec3], vertices: &[DVec3], vertex_of: Vec<u32>, coordinates: Box<dyn Coordinates>) -> Self {
        let differ = |a: DVec3, b: DVec3| a.to_array().map(f64::to_bits) != b.to_array().map(f64::to_bits);
        let pairs = points.iter().zip(&vertex_of).map(|(&point, &vertex)| (point, vertices[vertex as usize]));
        let unlike = pairs.enumerate().filter(|&(_, (point, of_vertex))| differ(point, of_vertex));
        let unlike = unlike.map(|(index, (point, of_vertex))| Unlike { index, point, of_vertex }).collect();
        Self { vertex_of, unlike, coordinates }
    }
}

impl Coordinates for Copies {
    fn write(&self, bytes: &[u8], out: &mut Out, vertices: &[DVec3]) -> io::Result<()> {
        let mut points: Vec<DVec3> = self.vertex_of.iter().map(|&vertex| vertices[vertex as usize]).collect();
        for Unlike { index, point, of_vertex } in &self.unlike {
            // A coordinate that does not move keeps its bits.
            for axis in 0..3 {
                if points[*index][axis].to_bits() == of_vertex[axis].to_bits() {
                    points[*index][axis] = point[axis];
                }
            }
        }
        self.coordinates.write(bytes, out, &points)
    }

    fn is_single(&self) -> bool {
        self.coordinates.is_single()
    }
}

/// Arrays of points, in the order of the file.
#[derive(Debug)]
struct Points {
    arrays: Vec<Array>,
    /// Offsets of the appended arrays after the first array of points. They change if the length of
    /// an array changes.
    offsets: Vec<Offset>,
}

impl Coordinates for Points {
    fn write(&self, bytes: &[u8], out: &mut Out, vertices: &[DVec3]) -> io::Result<()> {
        if self.is_single() {
            check_single(vertices)?;
        }
        let mut edits: Vec<(Range<usize>, Vec<u8>)> = Vec::new();
        let mut rest = vertices;
        for Array { start, payload, width } in &self.arrays {
            let endian = payload.coding.endian;
            let (own, after) = rest.split_at(payload.data.len() / (3 * width.bytes()));
            rest = after;
            let mut data = Vec::with_capacity(payload.data.len());
            for value in own.iter().flat_map(|point| point.to_array()) {
                match width {
                    Width::Single => data.extend_from_slice(&endian.single(narrow(value)?)),
                    Width::Double => data.extend_from_slice(&endian.double(value)),
                }
            }
            if data != *payload.data {
                edits.push((*start..*start + payload.length, payload.encode(&data)?));
            }
        }
        let longer = |start: usize| -> isize {
            let before = edits.iter().filter(|(range, _)| range.start < start);
            before.map(|(range, new)| new.len() as isize - range.len() as isize).sum()
        };
        let moved =
            self.offsets.iter().map(|offset| (offset, offset.value.saturating_add_signed(longer(offset.start))));
        let moved = moved.filter(|(offset, new)| *new != offset.value);
        let moved: Vec<_> =
            moved.map(|(offset, new)| (offset.attribute.clone(), new.to_string().into_bytes())).collect();
        edits.extend(moved);
        edits.sort_by_key(|(range, _)| range.start);
        let mut copied = 0;
        for (range, new) in &edits {
            out.write_all(&bytes[copied..range.start])?;
            out.write_all(new)?;
            copied = range.end;
        }
        out.write_all(&bytes[copied..])
    }

    fn is_single(&self) -> bool {
        self.arrays.iter().any(|array| array.width == Width::Single)
    }
}
