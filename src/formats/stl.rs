//! STL files, ASCII and binary: triangles with points of their own. Points that are equal to the
//! last bit are one, because STL has no other sign that two triangles touch.
//!
//! Source: M. Burns, *Automated Fabrication*, section 6.5.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;

use super::error::{Location, ReadError};
use super::mesh_builder::{MOST_VERTICES, check_finite_at};
use super::scanner::{byte_order_mark, parse_double, shown};
use super::surface::Surface;
use crate::memory::check_memory;

/// Bytes before the triangles of a binary file: a title and the number of triangles.
const HEAD: usize = 84;
/// Bytes of a triangle: a normal, three points and two bytes without a meaning.
const TRIANGLE: usize = 50;

/// Reads an STL file from its (decompressed) bytes. `path` is for messages.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Surface, ReadError> {
    let declared = bytes.get(80..HEAD).and_then(|count| count.first_chunk::<4>());
    let declared = declared.map_or(0, |&count| u32::from_le_bytes(count) as usize);
    // Binary files may begin with `solid` too, so the length decides.
    let is_binary = bytes.len() >= HEAD && bytes.len() - HEAD == declared.saturating_mul(TRIANGLE);
    let text = &bytes[byte_order_mark(bytes)..];
    let mut points = Points { path, ..Points::default() };
    if is_binary {
        read_binary(bytes, &mut points)?;
    } else if text.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) {
        read_text(text, &mut points)?;
    } else {
        let expected = format!("'solid', or {declared} triangles of {TRIANGLE} bytes after {HEAD} bytes");
        let found = format!("{} bytes", bytes.len());
        return Err(ReadError::Malformed { place: Location::File(path.into()), expected, found });
    }
    let Points { positions, corners, .. } = points;
    let triangles = corners.as_chunks::<3>().0.to_vec();
    Ok(Surface { points: positions, triangles, is_single: true, ..Surface::default() })
}

/// The points read so far.
struct Points<'a> {
    path: &'a Path,
    known: HashMap<[u64; 3], u32>,
    positions: Vec<DVec3>,
    /// Point of each corner of each triangle.
    corners: Vec<u32>,
}

impl Default for Points<'_> {
    fn default() -> Self {
        Self { path: Path::new(""), known: HashMap::new(), positions: Vec::new(), corners: Vec::new() }
    }
}

impl Points<'_> {
    fn add(&mut self, position: [f64; 3], place: impl FnOnce() -> Location) -> Result<(), ReadError> {
        check_finite_at(position, self.corners.len() as u64, place)?;
        // The sum of -0 and 0 is 0.
        let bits = position.map(|value| (value + 0.0).to_bits());
        let next = self.positions.len();
        if next >= MOST_VERTICES {
            let (path, what, limit) = (self.path.into(), "vertices", MOST_VERTICES);
            return Err(ReadError::TooMany { path, what, count: next, limit });
        }
        let point = *self.known.entry(bits).or_insert(next as u32);
        if point as usize == next {
            self.positions.push(position.into());
        }
        self.corners.push(point);
        Ok(())
    }
}

fn read_binary(bytes: &[u8], points: &mut Points) -> Result<(), ReadError> {
    // The points of a triangle take about as many bytes as in the file, and so does their search.
    check_memory(3 * bytes.len() as u64).map_err(|error| ReadError::Memory { path: points.path.into(), error })?;
    let path = points.path;
    for (triangle, record) in bytes[HEAD..].as_chunks::<TRIANGLE>().0.iter().enumerate() {
        for corner in record[12..48].as_chunks::<12>().0 {
            let (numbers, _) = corner.as_chunks::<4>();
            let position = [0, 1, 2].map(|axis| f64::from(f32::from_le_bytes(numbers[axis])));
            points.add(position, || Location::Byte(path.into(), HEAD + TRIANGLE * triangle))?;
        }
    }
    Ok(())
}

/// Reads the text line by line. Names of solids may be any text.
fn read_text(bytes: &[u8], points: &mut Points) -> Result<(), ReadError> {
    let path = points.path;
    let mut in_solid = false;
    // Corners of the open triangle.
    let mut open: Option<usize> = None;
    let mut last = 1;
    for (number, line) in (1..).zip(bytes.split(|&byte| byte == b'\n')) {
        let place = || Location::Line(path.into(), number);
        let malformed = |expected: &str| ReadError::Malformed {
            place: place(),
            expected: expected.into(),
            found: shown(line.trim_ascii()),
        };
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let Some(keyword) = words.next() else { continue };
        last = number;
        match (&keyword.to_ascii_lowercase()[..], in_solid, open) {
            (b"solid", false, _) => in_solid = true,
            (b"endsolid", true, None) => in_solid = false,
            (b"facet", true, None) => open = Some(0),
            (b"vertex", true, Some(n_corners @ 0..3)) => {
                let mut number = || words.next().and_then(parse_double);
                let (Some(x), Some(y), Some(z), None) = (number(), number(), number(), words.next()) else {
                    return Err(malformed("three coordinates"));
                };
                points.add([x, y, z], place)?;
                open = Some(n_corners + 1);
            }
            (b"endfacet", true, Some(3)) => open = None,
            (b"outer" | b"endloop", true, Some(_)) => {}
            (_, false, _) => return Err(malformed("'solid'")),
            (_, true, None) => return Err(malformed("'facet' or 'endsolid'")),
            (_, true, Some(n_corners)) => {
                return Err(malformed(if n_corners < 3 { "a vertex of the facet" } else { "'endfacet'" }));
            }
        }
    }
    if in_solid {
        return Err(ReadError::Truncated { place: Location::Line(path.into(), last), expected: "'endsolid'".into() });
    }
    Ok(())
}
