//! Where the lines of a batch go.

use serde::Serialize;

use super::JsonTarget;
use super::console::Console;
use super::failure::Failure;
use crate::session::{Kept, ReportFile, SessionError};

/// Where the lines go.
pub(super) enum Lines<'a> {
    /// Nobody asked for them.
    Nowhere,
    /// Standard output.
    StandardOutput(&'a Console),
    /// A file.
    File(ReportFile),
}

impl<'a> Lines<'a> {
    /// Opens the target; a file begins with the lines kept, and holds nothing else.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn open(target: Option<&JsonTarget>, kept: &Kept, console: &'a Console) -> Result<Self, Failure> {
        match target {
            None => Ok(Self::Nowhere),
            Some(JsonTarget::StandardOutput) => Ok(Self::StandardOutput(console)),
            Some(JsonTarget::File(path)) => Ok(Self::File(ReportFile::open(path, kept)?)),
        }
    }

    /// Appends a value as a line, all at once.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn append(&mut self, value: &impl Serialize) -> Result<(), Failure> {
        let mut text = serde_json::to_string(value).map_err(SessionError::Report)?;
        text.push('\n');
        match self {
            Self::Nowhere => Ok(()),
            Self::StandardOutput(console) => console.data(&text),
            Self::File(file) => Ok(file.append(&text)?),
        }
    }
}
