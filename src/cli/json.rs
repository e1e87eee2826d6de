//! Writes a command's JSON to a file or to standard output.

use serde::Serialize;

use super::JsonTarget;
use super::console::Console;
use super::failure::Failure;
use crate::session::{SessionError, check_writable, write_text};
use crate::text::shown_json;

/// Checks that JSON can be written to its target.
///
/// # Errors
/// The file cannot be written, or standard output is closed.
pub(super) fn check_json(target: Option<&JsonTarget>, console: &Console) -> Result<(), Failure> {
    match target {
        Some(JsonTarget::File(path)) => Ok(check_writable(path)?),
        Some(JsonTarget::StandardOutput) => console.check_stdout(),
        None => Ok(()),
    }
}

/// Writes a value as JSON to a file or standard output.
///
/// # Errors
/// The JSON cannot be written.
pub(super) fn write_json(target: &JsonTarget, value: &impl Serialize, console: &Console) -> Result<(), Failure> {
    match target {
        JsonTarget::StandardOutput => print_json(value, console),
        JsonTarget::File(path) => Ok(write_text(path, &text(value)?)?),
    }
}

/// Prints a value as JSON to standard output.
///
/// # Errors
/// Standard output cannot be written.
pub(super) fn print_json(value: &impl Serialize, console: &Console) -> Result<(), Failure> {
    console.json(&text(value)?)
}

/// The text of a file of JSON.
///
/// # Errors
/// The value is no JSON.
pub(super) fn text(value: &impl Serialize) -> Result<String, Failure> {
    // A file may be shown on a terminal too.
    let mut text = shown_json(&serde_json::to_string_pretty(value).map_err(SessionError::Report)?);
    text.push('\n');
    Ok(text)
}
