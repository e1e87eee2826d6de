//! Text: numbers and tables as other programs write them, the known name nearest to a mistyped one,
//! and texts of others as they may be shown, or typed in a shell.

pub(crate) mod figures;
pub(crate) mod header;
pub(crate) mod nearest;
mod number;
mod rows;
mod shell;
mod shown;

pub(crate) use number::{comma_advice, parse_double, parse_number};
pub(crate) use rows::{Mark, Row, decode, fields, rows};
pub(crate) use shell::shell_word;
pub(crate) use shown::{cell, shorten, shown, shown_json, shown_lines};
