//! Numbers and tables as text, in the spellings of other programs.

pub(crate) mod header;
mod number;
mod rows;

pub(crate) use number::{parse_double, parse_number};
pub(crate) use rows::{Mark, Row, decode, fields, rows};

/// At most the first 40 characters of a text, for messages.
pub(crate) fn shorten(text: &str) -> String {
    const LONGEST: usize = 40;
    if text.chars().count() <= LONGEST {
        text.to_string()
    } else {
        text.chars().take(LONGEST).chain("...".chars()).collect()
    }
}
