//! The lists of a `polyMesh` folder: points, faces, cells of faces, and patches.

use std::borrow::Cow;
use std::ops::Range;

use bytemuck::{Pod, Zeroable, cast_slice};
use glam::DVec3;

use super::file::{File, unquoted};
use crate::formats::document::Slots;
use crate::formats::error::ReadError;
use crate::formats::mesh_builder::check_finite_at;
use crate::formats::number::Number;
use crate::formats::scanner::{Encoding, Endian, parse_double, parse_signed, shown};

/// Largest number of faces that can be numbered. Most faces are sides of two cells.
const MOST_FACES: usize = u32::MAX as usize / 2;

/// An index in the encoding of most binary files: four bytes, little-endian, without alignment.
/// Files with this encoding are used in place, because a copy of all indices takes a good part of
/// the reading time.
#[derive(Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct Label([u8; 4]);

impl Label {
    /// Stands for -1 in [`File::cells_below`].
    pub const NONE: Self = Self([u8::MAX; 4]);

    #[inline]
    pub fn value(self) -> u32 {
        u32::from_le_bytes(self.0)
    }
}

impl From<u32> for Label {
    fn from(value: u32) -> Self {
        Self(value.to_le_bytes())
    }
}

/// Faces with their vertices.
pub(super) struct Faces<'a> {
    /// Start of each face in `vertices`, and the end `[n_faces + 1]`.
    starts: Cow<'a, [Label]>,
    vertices: Cow<'a, [Label]>,
}

impl Faces<'_> {
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    #[inline]
    pub fn corners(&self, face: usize) -> &[Label] {
        let [start, end] = [face, face + 1].map(|place| self.starts[place].value() as usize);
        &self.vertices[start..end]
    }

    /// All faces, if all are triangles.
    pub fn triangles(&self) -> Option<&[[Label; 3]]> {
        let (triangles, _) = self.vertices.as_chunks();
        each_pair(&self.starts, |start, end| end - start == 3).then_some(triangles)
    }
}

/// A patch of the boundary.
pub(super) struct Patch {
    pub name: String,
    /// Type of the patch, such as `wall`.
    pub kind: String,
    /// Name of the patch with which it is periodic.
    pub neighbour: Option<String>,
    pub faces: Range<usize>,
}

impl<'a> File<'a> {
    /// Reads a list of points, with their places in the file.
    pub fn points(mut self) -> Result<(Vec<DVec3>, Slots), ReadError> {
        let width = self.scanner.width;
        let count = self.begin("the number of points", 7, 3 * width.bytes() as u64)?;
        let mut positions: Vec<DVec3> = Vec::with_capacity(count.unwrap_or_default());
        let mut slots = Vec::with_capacity(count.unwrap_or_default());
        while self.goes_on(count, positions.len()) {
            let vertex = positions.len() as u64;
            if self.scanner.encoding == Encoding::Text {
                self.expect(b'(')?;
                self.skip();
                slots.push(self.scanner.at());
                let mut position = [0.0; 3];
                for value in &mut position {
                    *value = self.number("a coordinate", parse_double)?;
                }
                let place = || self.scanner.place(self.scanner.last);
                check_finite_at(position, vertex, place)?;
                positions.push(position.into());
                self.expect(b')')?;
            } else {
                slots.push(self.scanner.at());
                positions.push(self.scanner.coordinates(vertex)?.into());
            }
        }
        self.expect(b')')?;
        Ok((positions, Slots { encoding: self.scanner.encoding, width, slots }))
    }

    /// The error of a wrong index. `wrong` gives the expected and the found contents, from the
    /// index's place in the list and the index.
    fn wrong_label(&self, (place, label): (usize, i64), wrong: impl Fn(usize, i64) -> (String, String)) -> ReadError {
        let (expected, found) = wrong(place, label);
        self.scanner.malformed(expected, found)
    }

    /// Reads a list of indices within `range`; -1 becomes [`Label::NONE`]. For an index outside the
    /// range `wrong` gives the expected and the found contents, from the index's place in the list
    /// and the index.
    fn labels(
        &mut self,
        range: Range<i64>,
        wrong: impl Fn(usize, i64) -> (String, String),
    ) -> Result<Cow<'a, [Label]>, ReadError> {
        let Encoding::Binary(endian) = self.scanner.encoding else {
            let mut labels = Vec::new();
            self.add_labels(&mut labels, range, wrong)?;
            return Ok(labels.into());
        };
        let bytes = self.label.bytes();
        let count = self.begin("the number of indices", 2, bytes as u64)?;
        let list = self.scanner.take(count.unwrap_or_default() * bytes, "an index")?;
        let (labels, checked) = if self.label == Number::I64 {
            let longs = list.as_chunks().0.iter().map(|&label| endian.long(label));
            (longs.clone().map(|label| Label::from(label as u32)).collect(), all_within(range, longs))
        } else {
            let ints = list.as_chunks().0.iter().map(|&label| endian.int(label));
            let labels = match endian {
                Endian::Little => Cow::Borrowed(cast_slice(list)),
                Endian::Big => ints.clone().map(|label| Label::from(label as u32)).collect(),
            };
            (labels, all_within(range, ints))
        };
        checked.map_err(|(place, label)| {
            self.scanner.last += place * bytes;
            self.wrong_label((place, label), wrong)
        })?;
        self.expect(b')')?;
        Ok(labels)
    }

    /// Reads a list from text as [`File::labels`] does, and appends it to `labels`.
    fn add_labels(
        &mut self,
        labels: &mut Vec<Label>,
        range: Range<i64>,
        wrong: impl Fn(usize, i64) -> (String, String),
    ) -> Result<(), ReadError> {
        let count = self.begin("the number of indices", 2, 2)?;
        labels.reserve(count.unwrap_or_default());
        let mut place = 0;
        while self.goes_on(count, place) {
            let label = self.number("an index", parse_signed)?;
            if !range.contains(&label) {
                return Err(self.wrong_label((place, label), wrong));
            }
            labels.push(Label::from(label as u32));
            place += 1;
        }
        self.expect(b')')
    }

    /// Reads the cell of each face. Cells must be below `limit`. With `or_none`, -1 is accepted as
    /// [`Label::NONE`].
    pub fn cells_below(mut self, limit: usize, or_none: bool) -> Result<Cow<'a, [Label]>, ReadError> {
        self.labels(-i64::from(or_none)..limit as i64, |face, cell| {
            (format!("cells numbered from 0, below {limit}"), format!("cell {cell} for face {face}"))
        })
    }

    /// Reads the faces. Each face is a list of its own; in a binary file there are two lists, of
    /// all starts and of all vertices.
    pub fn faces(mut self, n_vertices: usize) -> Result<Faces<'a>, ReadError> {
        let wrong = |_, label: i64| (format!("a vertex below {n_vertices}"), label.to_string());
        let range = 0..n_vertices as i64;
        let faces = if self.scanner.encoding == Encoding::Text {
            let count = self.begin("the number of faces", 4, 4)?;
            let mut vertices = Vec::new();
            let mut starts = Vec::with_capacity(count.unwrap_or_default() + 1);
            starts.push(Label::from(0));
            while self.goes_on(count, starts.len() - 1) {
                self.add_labels(&mut vertices, range.clone(), wrong)?;
                starts.push(Label::from(vertices.len() as u32));
            }
            self.expect(b')')?;
            Faces { starts: starts.into(), vertices: vertices.into() }
        } else {
            let most = self.scanner.remaining().min(u32::MAX as usize) as i64;
            let expected = || format!("starts of faces from 0 to {most}");
            let starts = self.labels(0..most, |_, label| (expected(), label.to_string()))?;
            let vertices = self.labels(range, wrong)?;
            let rising = each_pair(&starts, |start, end| start <= end);
            let ends = [starts.first(), starts.last()].map(|start| start.map(|start| start.value()));
            if !rising || ends != [Some(0), Some(vertices.len() as u32)] {
                let expected = format!("starts of faces from 0 to {}", vertices.len());
                return Err(self.scanner.malformed(expected, "others"));
            }
            Faces { starts, vertices }
        };
        for (what, count, limit) in
            [("faces", faces.starts.len(), MOST_FACES), ("corners of faces", faces.vertices.len(), u32::MAX as usize)]
        {
            if count > limit {
                return Err(ReadError::TooMany { path: self.scanner.path().into(), what, count, limit });
            }
        }
        Ok(faces)
    }

    /// Reads the patches, which are text in binary files too. Together they must hold every face
    /// from `n_internal` on, once.
    pub fn patches(mut self, n_internal: usize, n_faces: usize) -> Result<Vec<Patch>, ReadError> {
        self.scanner.encoding = Encoding::Text;
        let count = self.begin("the number of patches", 20, 20)?;
        let mut patches: Vec<Patch> = Vec::with_capacity(count.unwrap_or_default());
        let mut end = n_internal;
        while self.goes_on(count, patches.len()) {
            let name = String::from_utf8_lossy(unquoted(self.word("the name of a patch")?)).into_owned();
            self.expect(b'{')?;
            let (mut length, mut start, mut kind, mut neighbour) = (None, None, String::new(), None);
            while self.peek() != Some(b'}') {
                let key = self.word("an entry of a patch")?;
                let Some(value) = self.value()? else { continue };
                let number = || std::str::from_utf8(&value).ok().and_then(|value| value.parse::<usize>().ok());
                let malformed = || self.scanner.malformed("a whole number", shown(&value));
                match key {
                    b"nFaces" => length = Some(number().ok_or_else(malformed)?),
                    b"startFace" => start = Some(number().ok_or_else(malformed)?),
                    b"neighbourPatch" => neighbour = Some(String::from_utf8_lossy(&value).into_owned()),
                    b"type" => kind = String::from_utf8_lossy(&value).into_owned(),
                    _ => {}
                }
            }
            self.expect(b'}')?;
            let expected = format!("patch {name} with startFace {end} and at most {n_faces} faces in all");
            let (Some(start), Some(length)) = (start, length) else {
                return Err(self.scanner.malformed(expected, "no startFace or nFaces"));
            };
            if start != end && length > 0 || start.checked_add(length).is_none_or(|end| end > n_faces) {
                return Err(self.scanner.malformed(expected, format!("startFace {start}, nFaces {length}")));
            }
            if length > 0 {
                end = start + length;
            }
            patches.push(Patch { name, kind, neighbour, faces: start..start + length });
        }
        self.expect(b')')?;
        if end != n_faces {
            let expected = format!("patches that hold the faces {n_internal} to {n_faces}");
            return Err(self.scanner.malformed(expected, format!("an end at face {end}")));
        }
        Ok(patches)
    }
}

/// Whether a condition holds for each pair of neighbouring indices. There is no early end, so many
/// pairs are tested at a time.
fn each_pair(labels: &[Label], is_so: impl Fn(u32, u32) -> bool) -> bool {
    labels.windows(2).fold(true, |all, pair| all & is_so(pair[0].value(), pair[1].value()))
}

/// Checks that all indices are within `range`.
///
/// # Errors
/// The first index outside, after its place in the list.
fn all_within<T: Copy + Ord + Into<i64>>(
    range: Range<i64>,
    list: impl Iterator<Item = T> + Clone,
) -> Result<(), (usize, i64)> {
    let Some(first) = list.clone().next() else { return Ok(()) };
    let is_within = |label: T| range.contains(&label.into());
    // If the least and the greatest index are inside, all are. Both are found with vector
    // instructions.
    let (least, most) = list.clone().fold((first, first), |(least, most), label| (least.min(label), most.max(label)));
    if is_within(least) && is_within(most) {
        return Ok(());
    }
    list.enumerate().find(|&(_, label)| !is_within(label)).map_or(Ok(()), |(place, label)| Err((place, label.into())))
}
