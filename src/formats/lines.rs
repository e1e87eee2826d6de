//! Reads a text file line by line without its comments, and keeps the offsets of words.

use std::path::Path;

use super::error::{Location, ReadError};
use super::scanner::{byte_order_mark, find_byte, next_token, parse_double, parse_unsigned, shown};

/// A position in a text file's bytes.
pub(super) struct Lines<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    /// Each byte begins a comment that ends with the line.
    comments: &'static [u8],
    at: usize,
}

/// A line without its comment and without white space around it. Its words are taken one after
/// another.
#[derive(Clone)]
pub(super) struct Line<'a> {
    pub text: &'a [u8],
    /// Offset of the line in the file.
    pub start: usize,
    at: usize,
}

impl<'a> Lines<'a> {
    pub fn new(path: &'a Path, bytes: &'a [u8], comments: &'static [u8]) -> Self {
        Self { path, bytes, comments, at: byte_order_mark(bytes) }
    }

    /// The next line that is not blank.
    pub fn next_line(&mut self) -> Option<Line<'a>> {
        while self.at < self.bytes.len() {
            let rest = &self.bytes[self.at..];
            let length = find_byte(rest, b'\n').unwrap_or(rest.len());
            let start = self.at;
            self.at += (length + 1).min(rest.len());
            let text = &rest[..length];
            let text = self.comments.iter().fold(text, |text, &comment| match find_byte(text, comment) {
                Some(comment) => &text[..comment],
                None => text,
            });
            let text = text.trim_ascii_end();
            let blank = text.len() - text.trim_ascii_start().len();
            if blank < text.len() {
                return Some(Line { text: &text[blank..], start: start + blank, at: 0 });
            }
        }
        None
    }

    /// The next line that is not blank.
    ///
    /// # Errors
    /// [`ReadError::Truncated`]: there is none.
    pub fn demand(&mut self, expected: &str) -> Result<Line<'a>, ReadError> {
        self.next_line()
            .ok_or_else(|| ReadError::Truncated { place: self.place(self.bytes.len()), expected: expected.to_string() })
    }

    /// Goes to an offset at the start of a line.
    pub fn go_to(&mut self, at: usize) {
        self.at = at;
    }

    /// The position.
    pub fn at(&self) -> usize {
        self.at
    }

    pub fn path(&self) -> &'a Path {
        self.path
    }

    /// The place of an offset, for messages. It counts lines, so it is slow.
    pub fn place(&self, at: usize) -> Location {
        Location::Line(self.path.into(), 1 + self.bytes[..at].iter().filter(|&&byte| byte == b'\n').count())
    }

    /// The error of other contents than `expected` at an offset.
    pub fn malformed(&self, at: usize, expected: impl Into<String>, found: impl Into<String>) -> ReadError {
        ReadError::Malformed { place: self.place(at), expected: expected.into(), found: found.into() }
    }

    /// Converts `count`, at the offset `at`, if the file still has this many lines of so many
    /// bytes.
    ///
    /// # Errors
    /// [`ReadError::AbsurdCount`]
    pub fn checked(&self, at: usize, what: &'static str, count: u64, bytes: u64) -> Result<usize, ReadError> {
        let remaining = self.bytes.len() - self.at;
        if count.checked_mul(bytes).is_none_or(|bytes| bytes > remaining as u64 + 1) {
            return Err(ReadError::AbsurdCount { place: self.place(at), what, count, remaining });
        }
        Ok(count as usize)
    }

    /// The next word of a line as a whole number that is not negative.
    #[inline]
    pub fn unsigned(&self, line: &mut Line, what: &'static str) -> Result<u64, ReadError> {
        self.number(line, what, parse_unsigned)
    }

    /// The next word of a line as a number, which may be NaN or infinite.
    #[inline]
    pub fn double(&self, line: &mut Line, what: &'static str) -> Result<f64, ReadError> {
        self.number(line, what, parse_double)
    }

    #[inline]
    fn number<T>(
        &self,
        line: &mut Line,
        what: &'static str,
        parse: impl Fn(&[u8]) -> Option<T>,
    ) -> Result<T, ReadError> {
        let (at, word) = line.word();
        if word.is_empty() {
            return Err(self.malformed(at, what, "the end of the line"));
        }
        parse(word).ok_or_else(|| self.malformed(at, what, shown(word)))
    }

    /// Checks that a line has at most `most` further words.
    pub fn ends(&self, line: &mut Line, most: usize) -> Result<(), ReadError> {
        for _ in 0..most {
            line.word();
        }
        match line.word() {
            (_, b"") => Ok(()),
            (at, word) => Err(self.malformed(at, "the end of the line", shown(word))),
        }
    }
}

impl<'a> Line<'a> {
    /// The text before the first `separator`, and the line after it.
    pub fn split(&self, separator: u8) -> Option<(&'a [u8], Line<'a>)> {
        let (key, rest) = self.text.split_at(self.text.iter().position(|&byte| byte == separator)?);
        let value = rest[1..].trim_ascii_start();
        let start = self.start + self.text.len() - value.len();
        Some((key.trim_ascii(), Line { text: value, start, at: 0 }))
    }

    /// The rest of the line.
    pub fn rest(&self) -> &'a [u8] {
        self.text[self.at..].trim_ascii()
    }

    /// The next word with its offset in the file. The word is empty at the end of the line.
    #[inline]
    pub fn word(&mut self) -> (usize, &'a [u8]) {
        let word = next_token(self.text, self.at);
        self.at = word.end;
        (self.start + word.start, &self.text[word])
    }
}
