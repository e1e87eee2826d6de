//! Text: numbers and tables as other programs write them, and the known name nearest to a mistyped
//! one.

pub(crate) mod figures;
pub(crate) mod header;
pub(crate) mod nearest;
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
