//! A file of a `polyMesh` folder: its header, and lists of numbers, faces and patches.

use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

use bytemuck::{Pod, Zeroable, cast_slice};
use glam::DVec3;

use crate::formats::document::{Slots, comment};
use crate::formats::error::ReadError;
use crate::formats::number::Number;
use crate::formats::scanner::{Encoding, Endian, Scanner, Width, parse_double, parse_signed, parse_unsigned, shown};

/// A position in a file after its header.
pub(super) struct File<'a> {
    scanner: Scanner<'a>,
    /// Type of an index in a binary file.
    label: Number,
}

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
    /// Reads the header: `FoamFile { format ascii; arch "LSB;label=32;scalar=64"; ... }`.
    pub fn open(path: &'a Path, bytes: &'a [u8]) -> Result<Self, ReadError> {
        let mut file = Self { scanner: Scanner::new(path, bytes), label: Number::I32 };
        let found = file.word("FoamFile")?;
        if found != b"FoamFile" {
            return Err(file.scanner.malformed("FoamFile", shown(found)));
        }
        file.expect(b'{')?;
        let (mut binary, mut endian) = (false, Endian::Little);
        while file.peek() != Some(b'}') {
            let key = file.word("an entry of the header")?;
            let Some(value) = file.value()? else { continue };
            match key {
                b"class" if value == b"decomposedBlockData" => {
                    let found = "a file with the parts of a divided mesh (class decomposedBlockData)".into();
                    let hint = "join the parts: reconstructParMesh -constant";
                    return Err(ReadError::Unsupported { path: path.into(), found, hint });
                }
                b"format" => match &value[..] {
                    b"ascii" => {}
                    b"binary" => binary = true,
                    _ => return Err(file.scanner.malformed("the format ascii or binary", shown(&value))),
                },
                b"arch" => {
                    let says = |text: &[u8]| value.windows(text.len()).any(|window| window == text);
                    endian = if says(b"MSB") { Endian::Big } else { Endian::Little };
                    file.label = if says(b"label=64") { Number::I64 } else { Number::I32 };
                    file.scanner.width = if says(b"scalar=32") { Width::Single } else { Width::Double };
                }
                _ => {}
            }
        }
        file.expect(b'}')?;
        file.scanner.encoding = if binary { Encoding::Binary(endian) } else { Encoding::Text };
        Ok(file)
    }

    /// Skips white space and comments.
    fn skip(&mut self) {
        while let Some(byte) = self.scanner.byte(0) {
            if byte.is_ascii_whitespace() {
                self.scanner.advance(1);
                continue;
            }
            match (byte, self.scanner.byte(1)) {
                (b'/', Some(b'/' | b'*')) => self.scanner.advance(comment(self.scanner.rest())),
                _ => break,
            }
        }
    }

    fn peek(&mut self) -> Option<u8> {
        self.skip();
        self.scanner.byte(0)
    }

    /// Reads a punctuation mark.
    fn expect(&mut self, mark: u8) -> Result<(), ReadError> {
        let expected = || format!("'{}'", mark as char);
        match self.peek() {
            Some(found) if found == mark => {
                self.scanner.advance(1);
                Ok(())
            }
            Some(_) => {
                let found = self.word("")?;
                Err(self.scanner.malformed(expected(), shown(found)))
            }
            None => Err(self.scanner.truncated(expected())),
        }
    }

    /// Reads a word: a text in quotes, or letters up to white space, punctuation or a comment, or a
    /// single punctuation mark.
    ///
    /// # Errors
    /// The file ends, or the word is a directive such as `#include`.
    fn word(&mut self, what: &str) -> Result<&'a [u8], ReadError> {
        self.skip();
        let ends = |byte: u8| byte.is_ascii_whitespace() || matches!(byte, b'(' | b')' | b'{' | b'}' | b';');
        let rest = self.scanner.rest();
        if rest.is_empty() {
            return Err(self.scanner.truncated(what));
        }
        match rest[0] {
            b'#' => {
                let word = self.scanner.token();
                let found = format!("the directive {}, which idmesh does not follow", shown(word));
                let expected = if what.is_empty() { "the contents of the mesh" } else { what };
                return Err(self.scanner.malformed(format!("{expected}, written out in the file"), found));
            }
            b'"' => {
                let end = quoted(rest).ok_or_else(|| self.scanner.truncated("the '\"' that ends a text"))?;
                return self.scanner.take(end, "");
            }
            _ => {}
        }
        let begins_comment = |at: usize| matches!(rest[at + 1..].first(), Some(b'/' | b'*'));
        let end = (0..rest.len()).find(|&at| ends(rest[at]) || rest[at] == b'/' && begins_comment(at));
        self.scanner.take(end.unwrap_or(rest.len()).max(1), "")
    }

    /// Reads the value of an entry, without the quotes around it. `None` for a sub-dictionary,
    /// which is skipped.
    fn value(&mut self) -> Result<Option<Vec<u8>>, ReadError> {
        if self.peek() != Some(b'{') {
            let value = self.until_semicolon()?;
            return Ok(Some(unquoted(&value).to_vec()));
        }
        let mut depth = 0;
        loop {
            match self.word("the '}' that ends a dictionary")? {
                b"{" => depth += 1,
                b"}" if depth == 1 => return Ok(None),
                b"}" => depth -= 1,
                _ => {}
            }
        }
    }

    /// Reads the text before the next `;` outside quotes, without its comments.
    fn until_semicolon(&mut self) -> Result<Vec<u8>, ReadError> {
        self.skip();
        let start = self.scanner.at();
        let (mut value, mut quoted) = (Vec::new(), false);
        loop {
            let byte = self.scanner.byte(0).ok_or_else(|| self.scanner.truncated("';'"))?;
            match byte {
                b'/' if !quoted && matches!(self.scanner.byte(1), Some(b'/' | b'*')) => {
                    self.scanner.advance(comment(self.scanner.rest()));
                    value.push(b' ');
                    continue;
                }
                b'"' => quoted = !quoted,
                b';' if !quoted => break,
                _ => {}
            }
            value.push(byte);
            self.scanner.advance(1);
        }
        self.scanner.advance(1);
        self.scanner.last = start;
        Ok(value.trim_ascii().to_vec())
    }

    fn number<T>(&mut self, what: &'static str, parse: impl Fn(&[u8]) -> Option<T>) -> Result<T, ReadError> {
        let word = self.word(what)?;
        parse(word).ok_or_else(|| self.scanner.malformed(what, shown(word)))
    }

    /// Reads the count of a list and its opening parenthesis. A list in text may have no count.
    fn begin(&mut self, what: &'static str, text: u64, binary: u64) -> Result<Option<usize>, ReadError> {
        let mut count = None;
        if self.scanner.encoding != Encoding::Text || self.peek() != Some(b'(') {
            let declared = self.number(what, parse_unsigned)?;
            count = Some(self.scanner.checked(what, declared, text, binary)?);
        }
        self.expect(b'(')?;
        Ok(count)
    }

    /// Whether a list has another entry after `n_read`.
    ///
    /// - `count`: count of the list, if it has one
    fn goes_on(&mut self, count: Option<usize>, n_read: usize) -> bool {
        match count {
            Some(count) => n_read < count,
            None => self.peek().is_some_and(|byte| byte != b')'),
        }
    }

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
                crate::formats::mesh_builder::check_finite_at(position, vertex, place)?;
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

/// Length of the text in quotes at the start of `text`, with both quotes. `None` if it does not
/// end.
fn quoted(text: &[u8]) -> Option<usize> {
    let mut at = 1;
    loop {
        match text.get(at)? {
            b'"' => return Some(at + 1),
            b'\\' => at += 2,
            _ => at += 1,
        }
    }
}

/// A text without the quotes around it.
fn unquoted(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\"").and_then(|text| text.strip_suffix(b"\"")).unwrap_or(text)
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
