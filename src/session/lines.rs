//! The reports of a batch as JSON Lines.
//!
//! [`ReportFile`] appends one line for each design. [`EarlierReports`] reads the lines that an
//! earlier run left, so that a stopped batch can go on.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::SessionError;
use super::files::{cannot_write, write_text};

/// A file with one report a line, open for appending.
#[derive(Debug)]
pub struct ReportFile {
    path: PathBuf,
    file: File,
}

impl ReportFile {
    /// Replaces the contents of a file by the lines kept, and opens the file for appending.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn open(path: &Path, kept: &EarlierReports) -> Result<Self, SessionError> {
        write_text(path, &kept.text)?;
        let file = OpenOptions::new().append(true).open(path).map_err(|error| cannot_write(path, error))?;
        Ok(Self { path: path.to_path_buf(), file })
    }

    /// Appends a line in one write.
    ///
    /// - `line`: with its line end
    ///
    /// # Errors
    /// The line cannot be written.
    pub fn append(&mut self, line: &str) -> Result<(), SessionError> {
        let written = self.file.write_all(line.as_bytes()).and_then(|()| self.file.flush());
        written.map_err(|error| cannot_write(&self.path, error))
    }
}

/// The lines that an earlier run left in a file of reports.
#[derive(Debug, Default)]
pub struct EarlierReports {
    /// Whole lines.
    text: String,
    /// Designs with a line, and whether the line holds a failure.
    pub failed: BTreeMap<String, bool>,
}

impl EarlierReports {
    /// Reads the lines of a file, if the file exists. Lines of designs to be done again are left
    /// out, and so is an incomplete last line of a run that was stopped.
    ///
    /// - `again`: whether the design with this name is to be done again
    ///
    /// # Errors
    /// - [`SessionError::CannotRead`]: the file cannot be read
    /// - [`SessionError::NoReport`]: a line is no report of a design
    pub fn read(path: &Path, again: impl Fn(&str) -> bool) -> Result<Self, SessionError> {
        let bytes = match fs::read(path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(source) => return Err(SessionError::CannotRead { path: path.to_path_buf(), source }),
        };
        let lines: Vec<&[u8]> = bytes.split(|&byte| byte == b'\n').collect();
        let mut kept = Self::default();
        for (index, line) in lines.iter().enumerate() {
            let value: Option<serde_json::Value> = serde_json::from_slice(line).ok();
            let design = value.as_ref().and_then(|value| value.get("design")?.as_str());
            match (design, std::str::from_utf8(line)) {
                (Some(design), Ok(text)) => {
                    if !again(design) {
                        kept.text += text;
                        kept.text.push('\n');
                        let failed = value
                            .as_ref()
                            .is_some_and(|value| value.get("error").is_some_and(|error| !error.is_null()));
                        kept.failed.insert(design.to_owned(), failed);
                    }
                }
                // After the last line end there may be nothing, or an incomplete line. An
                // incomplete line begins like a report too.
                _ if index + 1 == lines.len() && (line.is_empty() || line.starts_with(b"{")) => {}
                _ => {
                    return Err(SessionError::NoReport { path: path.to_path_buf(), line: index + 1 });
                }
            }
        }
        Ok(kept)
    }
}
