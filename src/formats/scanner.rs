//! Reads numbers from a text or binary file, and keeps their offsets.

use std::io::BufRead;
use std::ops::Range;
use std::path::Path;

use super::error::{Location, ReadError};
pub(super) use crate::text::parse_double;

/// The encoding of numbers in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    Binary(Endian),
}

/// Byte order of a binary file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Endian {
    Little,
    Big,
}

/// Size of a binary file's coordinates: four or eight bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Width {
    Single,
    Double,
}

impl Width {
    pub fn bytes(self) -> usize {
        match self {
            Width::Single => 4,
            Width::Double => 8,
        }
    }
}

impl Endian {
    /// The integer with these bytes.
    #[inline]
    pub fn int(self, bytes: [u8; 4]) -> i32 {
        match self {
            Endian::Little => i32::from_le_bytes(bytes),
            Endian::Big => i32::from_be_bytes(bytes),
        }
    }

    /// The integer of 64 bits with these bytes.
    #[inline]
    pub fn long(self, bytes: [u8; 8]) -> i64 {
        match self {
            Endian::Little => i64::from_le_bytes(bytes),
            Endian::Big => i64::from_be_bytes(bytes),
        }
    }

    /// The bytes of a number.
    pub fn double(self, value: f64) -> [u8; 8] {
        match self {
            Endian::Little => value.to_le_bytes(),
            Endian::Big => value.to_be_bytes(),
        }
    }

    /// The bytes of a number in single precision.
    pub fn single(self, value: f32) -> [u8; 4] {
        match self {
            Endian::Little => value.to_le_bytes(),
            Endian::Big => value.to_be_bytes(),
        }
    }
}

/// Length of the byte order mark that some editors put before a text in UTF-8.
pub(super) fn byte_order_mark(text: &[u8]) -> usize {
    if text.starts_with("\u{feff}".as_bytes()) { "\u{feff}".len() } else { 0 }
}

/// Index of the first occurrence of a byte. The standard library's search tests many bytes at a
/// time.
#[inline]
pub(super) fn find_byte(bytes: &[u8], byte: u8) -> Option<usize> {
    let mut rest = bytes;
    let passed = rest.skip_until(byte).ok()?;
    passed.checked_sub(1).filter(|&last| bytes[last] == byte)
}

/// Range of the next token after white space. Empty at the end of the file.
pub(super) fn next_token(bytes: &[u8], at: usize) -> Range<usize> {
    let mut start = at;
    while start < bytes.len() && bytes[start] <= b' ' {
        start += 1;
    }
    let mut end = start;
    while end < bytes.len() && bytes[end] > b' ' {
        end += 1;
    }
    start..end
}

pub(super) fn parse_unsigned(digits: &[u8]) -> Option<u64> {
    if digits.is_empty() {
        return None;
    }
    digits.iter().try_fold(0u64, |value, digit| {
        let digit = digit.wrapping_sub(b'0');
        if digit > 9 { None } else { value.checked_mul(10)?.checked_add(digit.into()) }
    })
}

/// A whole number, which may be negative.
pub(super) fn parse_signed(token: &[u8]) -> Option<i64> {
    let digits = token.strip_prefix(b"-");
    let size = i64::try_from(parse_unsigned(digits.unwrap_or(token))?).ok()?;
    Some(if digits.is_some() { -size } else { size })
}

/// Bytes for messages: quoted, printable and not too long.
pub(super) fn shown(bytes: &[u8]) -> String {
    let dots = if bytes.len() > 40 { "..." } else { "" };
    let printable = bytes[..bytes.len().min(40)].escape_ascii().to_string();
    format!("'{}{dots}'", printable.replace("\\\"", "\""))
}

/// A position in a file's bytes. The arguments `what` name the expected contents in messages.
pub(super) struct Scanner<'a> {
    bytes: &'a [u8],
    path: &'a Path,
    at: usize,
    /// Offset of the last number read.
    pub last: usize,
    pub encoding: Encoding,
    /// Size of the coordinates in a binary file.
    pub width: Width,
}

impl<'a> Scanner<'a> {
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Self {
        Self { bytes, path, at: 0, last: 0, encoding: Encoding::Text, width: Width::Double }
    }

    /// A scanner of a file that begins with text.
    pub fn of_text(path: &'a Path, bytes: &'a [u8]) -> Self {
        Self { at: byte_order_mark(bytes), ..Self::new(path, bytes) }
    }

    pub fn path(&self) -> &'a Path {
        self.path
    }

    /// Offset of the next number: in a text file after the white space.
    #[inline]
    pub fn next_number(&mut self) -> usize {
        if self.encoding == Encoding::Text {
            while self.bytes.get(self.at).is_some_and(|&byte| byte <= b' ') {
                self.at += 1;
            }
        }
        self.at
    }

    pub fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The place of an offset, for messages. It counts lines, so it is slow.
    pub fn place(&self, at: usize) -> Location {
        match self.encoding {
            Encoding::Text => {
                let lines = self.bytes[..at].iter().filter(|&&byte| byte == b'\n').count();
                Location::Line(self.path.into(), lines + 1)
            }
            Encoding::Binary(_) => Location::Byte(self.path.into(), at),
        }
    }

    /// The error of other contents than `expected` at the last number read.
    pub fn malformed(&self, expected: impl Into<String>, found: impl Into<String>) -> ReadError {
        ReadError::Malformed { place: self.place(self.last), expected: expected.into(), found: found.into() }
    }

    pub fn truncated(&self, expected: impl Into<String>) -> ReadError {
        ReadError::Truncated { place: self.place(self.bytes.len()), expected: expected.into() }
    }

    /// The rest of the line without its end. The position moves to the next line.
    pub fn line(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let length = find_byte(rest, b'\n').unwrap_or(rest.len());
        self.last = self.at;
        self.at += (length + 1).min(rest.len());
        rest[..length].trim_ascii()
    }

    /// The next line that is not blank, also in a binary file. Empty at the end of the file.
    pub fn filled_line(&mut self) -> &'a [u8] {
        while self.remaining() > 0 {
            let line = self.line();
            if !line.is_empty() {
                return line;
            }
        }
        b""
    }

    /// The next line that is not blank. The position does not move.
    pub fn peek_line(&self) -> &'a [u8] {
        let mut ahead = Scanner { bytes: self.bytes, path: self.path, ..*self };
        ahead.filled_line()
    }

    /// The rest of the line, with white space at its start.
    pub fn rest_of_line(&mut self) -> &'a [u8] {
        let start = self.at;
        self.line();
        self.bytes[start..self.at].trim_ascii_end()
    }

    /// The next byte that is no white space. The position does not move.
    pub fn peek_byte(&self) -> Option<u8> {
        self.bytes[self.at..].iter().copied().find(|&byte| byte > b' ')
    }

    /// Goes to an offset.
    pub fn go_to(&mut self, at: usize) -> Result<(), ReadError> {
        if at > self.bytes.len() {
            return Err(self.truncated(format!("byte {at}")));
        }
        self.at = at;
        Ok(())
    }

    /// The rest of the file.
    pub fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// The byte `ahead` places after the position.
    pub fn byte(&self, ahead: usize) -> Option<u8> {
        self.bytes.get(self.at + ahead).copied()
    }

    /// Moves the position by `length` bytes, at most to the end.
    pub fn advance(&mut self, length: usize) {
        self.at = (self.at + length).min(self.bytes.len());
    }

    /// The position.
    pub fn at(&self) -> usize {
        self.at
    }

    /// The next `length` bytes of a binary file.
    pub fn take(&mut self, length: usize, what: &'static str) -> Result<&'a [u8], ReadError> {
        match self.bytes[self.at..].get(..length) {
            Some(bytes) => {
                self.last = self.at;
                self.at += length;
                Ok(bytes)
            }
            None => Err(self.truncated(what)),
        }
    }

    /// The next token of text, also in a binary file. Empty at the end of the file.
    pub fn token(&mut self) -> &'a [u8] {
        let token = next_token(self.bytes, self.at);
        self.last = token.start;
        self.at = token.end;
        &self.bytes[token]
    }

    /// The next `N` bytes of a binary file.
    #[inline]
    pub fn block<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], ReadError> {
        match self.bytes[self.at..].first_chunk() {
            Some(block) => {
                self.last = self.at;
                self.at += N;
                Ok(*block)
            }
            None => Err(self.truncated(what)),
        }
    }

    fn number<T>(&mut self, what: &'static str, parse: impl Fn(&[u8]) -> Option<T>) -> Result<T, ReadError> {
        let token = self.token();
        if token.is_empty() {
            return Err(self.truncated(what));
        }
        parse(token).ok_or_else(|| self.malformed(what, shown(token)))
    }

    /// Reads a C `int`.
    #[inline]
    pub fn int(&mut self, what: &'static str) -> Result<i32, ReadError> {
        match self.encoding {
            Encoding::Text => self.number(what, |token| i32::try_from(parse_signed(token)?).ok()),
            Encoding::Binary(Endian::Little) => self.block(what).map(i32::from_le_bytes),
            Encoding::Binary(Endian::Big) => self.block(what).map(i32::from_be_bytes),
        }
    }

    /// Reads a whole number of eight bytes.
    #[inline]
    pub fn long(&mut self, what: &'static str) -> Result<i64, ReadError> {
        match self.encoding {
            Encoding::Text => self.number(what, parse_signed),
            Encoding::Binary(Endian::Little) => self.block(what).map(i64::from_le_bytes),
            Encoding::Binary(Endian::Big) => self.block(what).map(i64::from_be_bytes),
        }
    }

    /// Reads a C `int` that is not negative.
    #[inline]
    pub fn unsigned_int(&mut self, what: &'static str) -> Result<u64, ReadError> {
        let value = self.int(what)?;
        u64::try_from(value).map_err(|_| self.malformed(what, value.to_string()))
    }

    /// Reads a C `size_t` of eight bytes.
    #[inline]
    pub fn size(&mut self, what: &'static str) -> Result<u64, ReadError> {
        match self.encoding {
            Encoding::Text => self.number(what, parse_unsigned),
            Encoding::Binary(Endian::Little) => self.block(what).map(u64::from_le_bytes),
            Encoding::Binary(Endian::Big) => self.block(what).map(u64::from_be_bytes),
        }
    }

    /// Reads a C `double`, which may be NaN or infinite.
    #[inline]
    pub fn double(&mut self, what: &'static str) -> Result<f64, ReadError> {
        match self.encoding {
            Encoding::Text => self.number(what, parse_double),
            Encoding::Binary(Endian::Little) => self.block(what).map(f64::from_le_bytes),
            Encoding::Binary(Endian::Big) => self.block(what).map(f64::from_be_bytes),
        }
    }

    /// Reads a C `float`, which may be NaN or infinite.
    #[inline]
    pub fn single(&mut self, what: &'static str) -> Result<f64, ReadError> {
        match self.encoding {
            Encoding::Text => self.number(what, parse_double),
            Encoding::Binary(Endian::Little) => self.block(what).map(f32::from_le_bytes).map(f64::from),
            Encoding::Binary(Endian::Big) => self.block(what).map(f32::from_be_bytes).map(f64::from),
        }
    }

    /// Reads three finite coordinates of the vertex with this tag.
    #[inline]
    pub fn coordinates(&mut self, vertex: u64) -> Result<[f64; 3], ReadError> {
        let mut position = [0.0; 3];
        for value in &mut position {
            *value = match self.width {
                Width::Single => self.single("a coordinate")?,
                Width::Double => self.double("a coordinate")?,
            };
            if !value.is_finite() {
                return Err(ReadError::NotFinite { place: self.place(self.last), vertex, value: *value });
            }
        }
        Ok(position)
    }

    /// Converts a count that was just read, if the file still has this many entities of at least
    /// `text` or `binary` bytes. So the size of the file bounds the memory that is allocated.
    ///
    /// # Errors
    /// [`ReadError::AbsurdCount`]
    pub fn checked(&self, what: &'static str, count: u64, text: u64, binary: u64) -> Result<usize, ReadError> {
        let bytes = if self.encoding == Encoding::Text { text } else { binary };
        if count.checked_mul(bytes).is_none_or(|bytes| bytes > self.remaining() as u64) {
            let (place, remaining) = (self.place(self.last), self.remaining());
            return Err(ReadError::AbsurdCount { place, what, count, remaining });
        }
        Ok(count as usize)
    }

    /// Reads a `size_t` count of entities with at least `text` or `binary` bytes each.
    pub fn count(&mut self, what: &'static str, text: u64, binary: u64) -> Result<usize, ReadError> {
        let count = self.size(what)?;
        self.checked(what, count, text, binary)
    }

    /// Checks that `found` equals the declared count.
    pub fn same(&self, what: &str, declared: usize, found: usize) -> Result<(), ReadError> {
        if declared == found {
            return Ok(());
        }
        Err(self.malformed(format!("{declared} {what}, as the section declares"), format!("{found}")))
    }

    /// Moves past the next occurrence of `marker` at the start of a line.
    pub fn skip_past(&mut self, marker: &[u8]) -> Result<(), ReadError> {
        let mut at = self.at;
        while let Some(dollar) = self.bytes[at..].iter().position(|&byte| byte == b'$') {
            at += dollar;
            let rest = &self.bytes[at..];
            let begins = at == 0 || self.bytes[at - 1] == b'\n';
            let ends = rest.get(marker.len()).is_none_or(|&byte| byte <= b' ');
            if begins && ends && rest.starts_with(marker) {
                self.at = at + marker.len();
                return Ok(());
            }
            at += 1;
        }
        Err(self.truncated(String::from_utf8_lossy(marker)))
    }
}
