//! The rows of a text table: comments are separated, and fields are split.
//!
//! The crate csv 1.4 does not split them: it takes two blanks for an empty field, one separator for
//! the whole file, and comments at the begin of a line only.

use std::borrow::Cow;

/// A text in UTF-8, or in Latin-1 where the bytes are no valid UTF-8. A byte order mark is removed.
///
/// Characters beyond ASCII occur in titles and comments only, so a wrong guess changes no number.
pub(crate) fn decode(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.trim_start_matches('\u{feff}').into(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect::<String>().into(),
    }
}

/// The characters that begin a comment outside double quotes. A comment ends with its line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mark {
    /// `#`, `!` or `%`.
    Any,
    /// `#` alone, for files in which names of variables hold the other two.
    Hash,
}

impl Mark {
    fn begins(self, letter: char) -> bool {
        letter == '#' || self == Mark::Any && matches!(letter, '!' | '%')
    }
}

/// A line of a table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row<'a> {
    /// Line number, from 0.
    pub line: usize,
    /// The text before the comment, trimmed; may be empty.
    pub text: &'a str,
    /// The text of the comment, trimmed, without its marks; empty if there is no comment.
    pub comment: &'a str,
}

/// The lines of a table, blank ones included.
pub(crate) fn rows(text: &str, mark: Mark) -> impl Iterator<Item = Row<'_>> {
    text.trim_start_matches('\u{feff}').lines().enumerate().map(move |(line, whole)| {
        let mut quoted = false;
        let comment = whole.char_indices().find(|&(_, letter)| {
            quoted ^= letter == '"';
            !quoted && mark.begins(letter)
        });
        let (text, comment) = whole.split_at(comment.map_or(whole.len(), |(at, _)| at));
        Row { line, text: text.trim(), comment: comment.trim_start_matches(|letter| mark.begins(letter)).trim() }
    })
}

/// The fields of a row, without their double quotes.
///
/// The separator is the semicolon. In a row without semicolons it is the comma, and in a row
/// without either it is white space. Between semicolons or commas a field may be empty, so the
/// fields after it keep their columns. A separator at the end of the row is ignored.
pub(crate) fn fields(text: &str) -> Vec<&str> {
    // Few rows have quotes, and a search for one character is fast.
    let is_quoted = text.contains('"');
    let has = |separator: char| match is_quoted {
        true => separated(text, |letter| letter == separator).nth(1).is_some(),
        false => text.contains(separator),
    };
    let mut fields: Vec<&str> = match [';', ','].into_iter().find(|&separator| has(separator)) {
        Some(separator) if is_quoted => separated(text, |letter| letter == separator).map(str::trim).collect(),
        Some(separator) => text.split(separator).map(str::trim).collect(),
        None if is_quoted => separated(text, char::is_whitespace).filter(|field| !field.is_empty()).collect(),
        None => text.split_whitespace().collect(),
    };
    if fields.len() > 1 && fields.last().is_some_and(|field| field.is_empty()) {
        fields.pop();
    }
    for field in &mut fields {
        *field = field.strip_prefix('"').and_then(|inner| inner.strip_suffix('"')).unwrap_or(field).trim();
    }
    fields
}

/// The parts of a text between separators. A separator inside double quotes does not count.
fn separated(text: &str, is_separator: impl Fn(char) -> bool) -> impl Iterator<Item = &str> {
    let mut quoted = false;
    text.split(move |letter: char| {
        quoted ^= letter == '"';
        !quoted && is_separator(letter)
    })
}

#[cfg(test)]
mod tests {
    use super::{Mark, decode, fields, rows};

    #[test]
    fn fields_are_told_apart() {
        for (text, expected) in [
            ("1 2\t3", vec!["1", "2", "3"]),
            ("1, 2 ,3", vec!["1", "2", "3"]),
            ("1;2; 3;", vec!["1", "2", "3"]),
            ("1,,3", vec!["1", "", "3"]),
            ("0,5;0,1", vec!["0,5", "0,1"]),
            ("\"Points:0\",\"a, b\", c d", vec!["Points:0", "a, b", "c d"]),
            ("\"Point ID\" \"x\"", vec!["Point ID", "x"]),
            ("1 2, 3", vec!["1 2", "3"]),
        ] {
            assert_eq!(fields(text), expected, "{text}");
        }
    }

    #[test]
    fn comments_are_taken_off() {
        let text = "\u{feff}a # b\r\n! c\n%% d\n\"#1\" 2\n";
        let found: Vec<_> = rows(text, Mark::Any).map(|row| (row.line, row.text, row.comment)).collect();
        assert_eq!(found, [(0, "a", "b"), (1, "", "c"), (2, "", "d"), (3, "\"#1\" 2", "")]);
        let found: Vec<_> = rows("t/c %! # x", Mark::Hash).map(|row| (row.text, row.comment)).collect();
        assert_eq!(found, [("t/c %!", "x")]);
    }

    #[test]
    fn texts_of_any_encoding_are_read() {
        assert_eq!(decode("\u{feff}\u{e9}".as_bytes()), "\u{e9}");
        assert_eq!(decode(b"\xe9pais\n1 0"), "\u{e9}pais\n1 0");
    }
}
