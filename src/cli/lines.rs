//! [`Lines`]: the target of the JSON lines of a batch.

use serde::Serialize;

use super::JsonTarget;
use super::console::Console;
use super::failure::Failure;
use crate::session::{EarlierReports, ReportFile, SessionError};

/// The target of the lines.
pub(super) enum Lines<'a> {
    /// The lines are not written.
    Nowhere,
    /// Standard output.
    StandardOutput(&'a Console),
    /// A file.
    File(ReportFile),
}

impl<'a> Lines<'a> {
    /// Opens the target. A file is replaced by the lines that `kept` holds.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn open(
        target: Option<&JsonTarget>,
        kept: &EarlierReports,
        console: &'a Console,
    ) -> Result<Self, Failure> {
        match target {
            None => Ok(Self::Nowhere),
            Some(JsonTarget::StandardOutput) => Ok(Self::StandardOutput(console)),
            Some(JsonTarget::File(path)) => Ok(Self::File(ReportFile::open(path, kept)?)),
        }
    }

    /// Appends a value as a line of JSON, in one write.
    ///
    /// # Errors
    /// The line cannot be written.
    pub(super) fn append(&mut self, value: &impl Serialize) -> Result<(), Failure> {
        let mut text = serde_json::to_string(value).map_err(SessionError::Report)?;
        text.push('\n');
        match self {
            Self::Nowhere => Ok(()),
            Self::StandardOutput(console) => console.json(&text),
            Self::File(file) => Ok(file.append(&text)?),
        }
    }
}
