//! The coordinates of a CGNS file: in each zone one array per axis.

use std::borrow::Cow;
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
pub(super) struct ZoneColumns {
    /// The arrays of x, y and z.
    pub axes: [Column; 3],
    /// Vertex of each point of the zone. `None`: they are the same.
    pub vertex_of: Option<Vec<u32>>,
    pub unlike: Vec<Unlike>,
}

/// A point whose coordinates in the file are not quite those of its vertex.
#[derive(Debug)]
pub(super) struct Unlike {
    /// Index of the point in the zone.
    index: usize,
    point: DVec3,
    /// Position of its vertex in the file.
    of_vertex: DVec3,
}

impl ZoneColumns {
    /// Says which vertices the points of the zone are.
    ///
    /// - `points`: positions of the points
    /// - `vertex_of`: vertex of each point
    /// - `positions`: positions of the vertices
    pub fn set_vertices(&mut self, points: &[DVec3], vertex_of: Vec<u32>, positions: &[DVec3]) {
        let bits = |at: DVec3| at.to_array().map(f64::to_bits);
        let all = points.iter().zip(&vertex_of).map(|(&point, &vertex)| (point, positions[vertex as usize]));
        let unlike = all.enumerate().filter(|(_, (point, of_vertex))| bits(*point) != bits(*of_vertex));
        self.unlike = unlike.map(|(index, (point, of_vertex))| Unlike { index, point, of_vertex }).collect();
        self.vertex_of = Some(vertex_of);
    }

    /// The points of the zone with the vertices elsewhere.
    fn points<'a>(&self, vertices: &'a [DVec3]) -> Cow<'a, [DVec3]> {
        let Some(vertex_of) = &self.vertex_of else { return Cow::Borrowed(vertices) };
        let mut points: Vec<DVec3> = vertex_of.iter().map(|&vertex| vertices[vertex as usize]).collect();
        for Unlike { index, point, of_vertex } in &self.unlike {
            // A coordinate that does not move keeps its bits.
            for axis in 0..3 {
                if points[*index][axis].to_bits() == of_vertex[axis].to_bits() {
                    points[*index][axis] = point[axis];
                }
            }
        }
        Cow::Owned(points)
    }
}

/// The coordinates of all zones.
#[derive(Debug)]
pub(super) struct Columns {
    pub zones: Vec<ZoneColumns>,
}

impl Columns {
    /// The arrays of all zones.
    pub fn all(&self) -> impl Iterator<Item = &Column> {
        self.zones.iter().flat_map(|zone| &zone.axes)
    }
}

impl Coordinates for Columns {
    fn write(&self, bytes: &[u8], out: &mut Out, vertices: &[DVec3]) -> io::Result<()> {
        let mut bytes = bytes.to_vec();
        if self.is_single() {
            check_single(vertices)?;
        }
        for zone in &self.zones {
            let points = zone.points(vertices);
            for (axis, column) in zone.axes.iter().enumerate() {
                column.write(&mut bytes, points.iter().map(|point| point[axis]))?;
            }
        }
        out.write_all(&bytes)
    }

    fn is_single(&self) -> bool {
        self.all().any(|column| column.width == Width::Single)
    }
}
