//! The syntax of a file of a `polyMesh` folder: its header, words, entries of dictionaries, and the
//! ends of lists.

use std::path::Path;

use crate::formats::document::comment;
use crate::formats::error::ReadError;
use crate::formats::number::Number;
use crate::formats::scanner::{Encoding, Endian, Scanner, Width, parse_unsigned, shown};

/// A position in a file after its header.
pub(super) struct File<'a> {
    pub scanner: Scanner<'a>,
    /// Type of an index in a binary file.
    pub label: Number,
}

impl<'a> File<'a> {
    /// Reads the header: `FoamFile { format ascii; arch "LSB;label=32;scalar=64"; ... }`.
    pub fn open(path: &'a Path, bytes: &'a [u8]) -> Result<Self, ReadError> {
        let mut file = Self { scanner: Scanner::of_text(path, bytes), label: Number::I32 };
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
    #[inline]
    pub fn skip(&mut self) {
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

    #[inline]
    pub fn peek(&mut self) -> Option<u8> {
        self.skip();
        self.scanner.byte(0)
    }

    /// Reads a punctuation mark.
    #[inline]
    pub fn expect(&mut self, mark: u8) -> Result<(), ReadError> {
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
    pub fn word(&mut self, what: &str) -> Result<&'a [u8], ReadError> {
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
    pub fn value(&mut self) -> Result<Option<Vec<u8>>, ReadError> {
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

    pub fn number<T>(&mut self, what: &'static str, parse: impl Fn(&[u8]) -> Option<T>) -> Result<T, ReadError> {
        let word = self.word(what)?;
        parse(word).ok_or_else(|| self.scanner.malformed(what, shown(word)))
    }

    /// Reads the count of a list and its opening parenthesis. A list in text may have no count.
    pub fn begin(&mut self, what: &'static str, text: u64, binary: u64) -> Result<Option<usize>, ReadError> {
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
    #[inline]
    pub fn goes_on(&mut self, count: Option<usize>, n_read: usize) -> bool {
        match count {
            Some(count) => n_read < count,
            None => self.peek().is_some_and(|byte| byte != b')'),
        }
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
pub(super) fn unquoted(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\"").and_then(|text| text.strip_suffix(b"\"")).unwrap_or(text)
}
