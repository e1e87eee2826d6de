//! Numbers and tables as text, the way other programs write them.

pub(crate) mod header;
mod number;
mod rows;

pub(crate) use number::{parse_double, parse_number};
pub(crate) use rows::{Mark, Row, decode, fields, rows};

/// The beginning of a text, for messages.
pub(crate) fn shorten(text: &str) -> String {
    const LONGEST: usize = 40;
    if text.chars().count() <= LONGEST {
        text.to_string()
    } else {
        text.chars().take(LONGEST).chain("...".chars()).collect()
    }
}
