//! A TOML document with the place of every key and value.
//!
//! The case file is read from this document and not deserialised by `serde`, because keys keep
//! their places here. An error about a key has the key's line and column, and names the table as
//! the user wrote it.

use std::borrow::Cow;
use std::cell::Cell;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{CaseError, Position};
use crate::text::nearest::{did_you_mean, quoted_list};

/// The text of a case file and its name.
#[derive(Clone, Copy)]
pub(super) struct CaseDocument<'d> {
    pub path: &'d Path,
    pub text: &'d str,
    /// The byte offset whose position was asked for last, and the position. Tables are read in the
    /// order of the file, so each search goes on where the last one ended.
    pub last: &'d Cell<(usize, Position)>,
}

impl<'d> CaseDocument<'d> {
    /// Parses the text.
    pub fn parse(self) -> Result<Spanned<DeTable<'d>>, CaseError> {
        DeTable::parse(self.text).map_err(|error| {
            let message = error.message().trim().replace('\n', ", ");
            let offset = error.span().map_or(0, |span| span.start);
            let advice = toml_advice(self.text, offset).unwrap_or_default();
            self.error(offset, message + &advice)
        })
    }

    /// An error at a byte offset.
    pub fn error(self, offset: usize, message: impl Into<String>) -> CaseError {
        let position = self.position(offset);
        CaseError::Invalid { path: self.path.to_path_buf(), position, message: message.into() }
    }

    /// Line and column of a byte offset in the text.
    pub fn position(self, offset: usize) -> Position {
        let offset = offset.min(self.text.len());
        let (start, mut position) = match self.last.get() {
            (last, position) if last <= offset => (last, position),
            _ => (0, Position { line: 1, column: 1 }),
        };
        for &byte in &self.text.as_bytes()[start..offset] {
            match byte {
                b'\n' => position = Position { line: position.line + 1, column: 1 },
                // A letter of several bytes counts once.
                0x80..0xc0 => {}
                _ => position.column += 1,
            }
        }
        self.last.set((offset, position));
        position
    }
}

/// What may be wrong with the value at a byte offset where TOML cannot be read.
fn toml_advice(text: &str, offset: usize) -> Option<String> {
    let (before, after) = text.split_at_checked(offset)?;
    let start = before.rfind(['\n', '=', '[', ',', '{']).map_or(0, |at| at + 1);
    let head = text[..start].rsplit('\n').next()?.trim();
    let is_in_list = head.is_empty() && before[..start].trim_end().ends_with(['[', ',']);
    if !is_in_list && head.chars().all(|letter| letter == '[') {
        // A key, or the head of a table.
        return None;
    }
    let end = offset + after.find(['\n', ',', ']', '}', '#']).unwrap_or(after.len());
    let value = text[start..end].trim();
    if value.contains('=') {
        return None;
    }
    let first = value.chars().next()?;
    if matches!(first, '\u{201c}'..='\u{201f}' | '\u{2018}'..='\u{201b}' | '\u{ab}' | '\u{bb}') {
        let inner = value.trim_matches(|letter: char| !letter.is_ascii());
        return Some(format!("; a text needs straight quotes: \"{inner}\""));
    }
    if first == '"' {
        let is_escape = value[1..].contains('\\');
        return is_escape
            .then(|| "; in double quotes a backslash begins an escape: use / or single quotes for a path".to_owned());
    }
    let is_text = first != '\'' && value.contains(|letter: char| letter.is_alphabetic());
    is_text.then(|| format!("; a text needs quotes: \"{}\"", value.trim_end_matches('"')))
}

/// A table of the document. All its keys are known.
pub(super) struct TomlTable<'d> {
    document: CaseDocument<'d>,
    /// The table's name as in a header, without brackets. Empty for the top of the file.
    name: String,
    /// Byte offset of the table's key.
    offset: usize,
    table: &'d DeTable<'d>,
}

impl<'d> TomlTable<'d> {
    /// The top of the file.
    pub fn top(document: CaseDocument<'d>, table: &'d DeTable<'d>, known: &[&str]) -> Result<Self, CaseError> {
        Self { document, name: String::new(), offset: 0, table }.with_known_keys(known)
    }

    fn with_known_keys(self, known: &[&str]) -> Result<Self, CaseError> {
        // Keys are checked in the order of the file, so that the error is the first mistake.
        let mut keys: Vec<_> = self.table.keys().collect();
        keys.sort_by_key(|key| key.span().start);
        for key in keys {
            let name: &str = key.get_ref();
            if !known.contains(&name) {
                let place = if self.name.is_empty() { "at the top".into() } else { format!("in [{}]", self.name) };
                let advice = match did_you_mean(name, known) {
                    Some(advice) => advice,
                    None => format!(", expected {}", quoted_list(known)),
                };
                return Err(self.document.error(key.span().start, format!("unknown key `{name}` {place}{advice}")));
            }
        }
        Ok(self)
    }

    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<Value<'d>> {
        let (found, value) = self.table.iter().find(|(name, _)| name.get_ref() == key)?;
        let name = if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) };
        Some(Value {
            document: self.document,
            name,
            key: found.span().start,
            offset: value.span().start,
            value: value.get_ref(),
        })
    }

    /// The value of a key, or an error if the table lacks the key.
    pub fn require(&self, key: &str, expected: &str) -> Result<Value<'d>, CaseError> {
        self.get(key).ok_or_else(|| {
            let place = if self.name.is_empty() { String::new() } else { format!(" in [{}]", self.name) };
            self.error(format!("missing key `{key}`{place}, expected {expected}"))
        })
    }

    /// An error at the table's name.
    pub fn error(&self, message: impl Into<String>) -> CaseError {
        self.document.error(self.offset, message)
    }

    /// Path of the case file.
    pub fn path(&self) -> &'d Path {
        self.document.path
    }

    /// Line and column of the table's name.
    pub fn position(&self) -> Position {
        self.document.position(self.offset)
    }
}

/// A value of the document.
pub(super) struct Value<'d> {
    document: CaseDocument<'d>,
    /// The key with the names of its tables, separated by dots.
    name: String,
    /// Byte offset of the key.
    key: usize,
    /// Byte offset of the value.
    offset: usize,
    value: &'d DeValue<'d>,
}

impl<'d> Value<'d> {
    /// An error at the value.
    pub fn error(&self, message: impl Into<String>) -> CaseError {
        self.document.error(self.offset, message)
    }

    /// An error at the value's key.
    pub fn key_error(&self, message: impl Into<String>) -> CaseError {
        self.document.error(self.key, message)
    }

    fn unexpected(&self, expected: &str) -> CaseError {
        let found = match self.value {
            DeValue::String(_) => "a string",
            DeValue::Integer(_) | DeValue::Float(_) => "a number",
            DeValue::Boolean(_) => "true or false",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        };
        self.error(format!("`{}` is {found}, expected {expected}", self.name))
    }

    /// A string.
    pub fn text(&self) -> Result<&'d str, CaseError> {
        match self.value {
            DeValue::String(text) if !text.trim().is_empty() => Ok(text),
            DeValue::String(_) => Err(self.error(format!("`{}` is empty, expected a name", self.name))),
            _ => Err(self.unexpected("a string")),
        }
    }

    /// A file, or a list of at least one file. Each string has its own offset.
    pub fn texts(&self) -> Result<Vec<Value<'d>>, CaseError> {
        self.texts_or("file")
    }

    /// A string, or a list of at least one string. Each string has its own offset.
    ///
    /// - `what`: what a string names
    pub fn texts_or(&self, what: &str) -> Result<Vec<Value<'d>>, CaseError> {
        let DeValue::Array(array) = self.value else {
            self.text().map_err(|error| match self.value {
                DeValue::String(_) => error,
                _ => self.unexpected("a string or a list of strings"),
            })?;
            return Ok(vec![Value { name: self.name.clone(), ..*self }]);
        };
        let values: Vec<_> = array
            .iter()
            .map(|value| Value { name: self.name.clone(), offset: value.span().start, value: value.get_ref(), ..*self })
            .collect();
        if values.is_empty() {
            return Err(self.error(format!("`{}` is an empty list, expected at least one {what}", self.name)));
        }
        for value in &values {
            value.text()?;
        }
        Ok(values)
    }

    /// A number, whole or not; it may be NaN or infinite.
    pub fn number(&self) -> Result<f64, CaseError> {
        let text: Cow<str> = match self.value {
            DeValue::Float(float) => float.as_str().into(),
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().into(),
            _ => return Err(self.unexpected("a number")),
        };
        text.parse().map_err(|_| self.unexpected("a number"))
    }

    /// Three finite numbers.
    pub fn position(&self) -> Result<[f64; 3], CaseError> {
        let DeValue::Array(array) = self.value else { return Err(self.unexpected("three numbers")) };
        let numbers = array.iter().map(|value| {
            let value = Value { name: self.name.clone(), offset: value.span().start, value: value.get_ref(), ..*self };
            match value.number()? {
                number if number.is_finite() => Ok(number),
                number => Err(value.error(format!("`{}` holds {number}, expected finite numbers", self.name))),
            }
        });
        let numbers: Vec<f64> = numbers.collect::<Result<_, _>>()?;
        <[f64; 3]>::try_from(numbers)
            .map_err(|_| self.error(format!("`{}` is expected to hold three numbers", self.name)))
    }

    /// A whole number, at least 1.
    pub fn count(&self) -> Result<usize, CaseError> {
        match self.value {
            DeValue::Integer(integer) => match usize::from_str_radix(integer.as_str(), integer.radix()) {
                Ok(count) if count > 0 => Ok(count),
                _ => Err(self.error(format!("`{}` is {integer}, expected a whole number from 1 on", self.name))),
            },
            _ => Err(self.unexpected("a whole number from 1 on")),
        }
    }

    /// One of several names.
    pub fn one_of(&self, names: &[&str]) -> Result<&'d str, CaseError> {
        let text = self.text().map_err(|error| match self.value {
            DeValue::String(_) => error,
            _ => self.unexpected(&quoted_list(names)),
        })?;
        if names.contains(&text) {
            return Ok(text);
        }
        let advice = did_you_mean(text, names).unwrap_or_default();
        Err(self.error(format!("`{}` is \"{text}\", expected {}{advice}", self.name, quoted_list(names))))
    }

    /// Whether the value is a table.
    pub fn is_table(&self) -> bool {
        matches!(self.value, DeValue::Table(_))
    }

    /// A table that may have these keys only.
    pub fn section(&self, known: &[&str]) -> Result<TomlTable<'d>, CaseError> {
        let DeValue::Table(table) = self.value else { return Err(self.unexpected("a table")) };
        TomlTable { document: self.document, name: self.name.clone(), offset: self.key, table }.with_known_keys(known)
    }

    /// For each key of a table, one table or a list of at least one, with these keys only. In the
    /// order of the file.
    pub fn lists_of_sections(&self, known: &[&str]) -> Result<Vec<(&'d str, Vec<TomlTable<'d>>)>, CaseError> {
        let lists = self.children()?.into_iter().map(|(key, child)| {
            let DeValue::Array(array) = child.value else { return Ok((key, vec![child.section(known)?])) };
            if array.is_empty() {
                return Err(child.error(format!("`{}` is an empty list, expected at least one table", child.name)));
            }
            let entry = |value: &'d Spanned<DeValue<'d>>| {
                // The place of a list's entry is its own, and not the list's key.
                let offset = value.span().start;
                Value { name: child.name.clone(), key: offset, offset, value: value.get_ref(), ..child }.section(known)
            };
            Ok((key, array.iter().map(entry).collect::<Result<_, _>>()?))
        });
        lists.collect()
    }

    /// The tables in a table, with their names, in the order of the file. Each may have these keys
    /// only.
    pub fn sections(&self, known: &[&str]) -> Result<Vec<(&'d str, TomlTable<'d>)>, CaseError> {
        self.children()?.into_iter().map(|(key, child)| Ok((key, child.section(known)?))).collect()
    }

    /// The values in a table, with their names, in the order of the file.
    pub fn children(&self) -> Result<Vec<(&'d str, Value<'d>)>, CaseError> {
        let DeValue::Table(table) = self.value else { return Err(self.unexpected("a table")) };
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        let child = |(key, value): (&'d Spanned<Cow<'d, str>>, &'d Spanned<DeValue<'d>>)| {
            let child = Value {
                document: self.document,
                name: format!("{}.{}", self.name, key.get_ref()),
                key: key.span().start,
                offset: value.span().start,
                value: value.get_ref(),
            };
            (key.get_ref().as_ref(), child)
        };
        Ok(entries.into_iter().map(child).collect())
    }
}
