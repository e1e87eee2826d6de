//! [`Lines`]: the target of the JSON lines of a batch.

use super::JsonTarget;
use super::console::Console;
use super::failure::Failure;
use crate::report::RunReport;
use crate::session::{ReportFile, SessionError};
use crate::text::shown_json;

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
    pub(super) fn new(target: Option<&JsonTarget>, console: &'a Console) -> Self {
        match target {
            None => Self::Nowhere,
            Some(JsonTarget::StandardOutput) => Self::StandardOutput(console),
            Some(JsonTarget::File(path)) => Self::File(ReportFile::new(path)),
        }
    }

    /// Whether the lines are written anywhere.
    pub(super) fn are_wanted(&self) -> bool {
        !matches!(self, Self::Nowhere)
    }

    /// Appends a report as a line of JSON, in one write.
    ///
    /// # Errors
    /// The line cannot be written.
    pub(super) fn append(&mut self, report: &RunReport) -> Result<(), Failure> {
        let mut text = shown_json(&serde_json::to_string(report).map_err(SessionError::Report)?);
        text.push('\n');
        match self {
            Self::Nowhere => Ok(()),
            Self::StandardOutput(console) => console.json(&text),
            Self::File(file) => Ok(file.append(report.design.as_deref().unwrap_or_default(), &text)?),
        }
    }
}
