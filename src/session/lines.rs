//! The reports of a batch as JSON Lines: appended one by one, and taken up again after a run that
//! was stopped.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::SessionError;
use super::files::{cannot_write, write_text};

/// A file of reports, a line each, open for appending.
#[derive(Debug)]
pub struct ReportFile {
    path: PathBuf,
    file: File,
}

impl ReportFile {
    /// Opens a file; it begins with the lines kept, and holds nothing else.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn open(path: &Path, kept: &Kept) -> Result<Self, SessionError> {
        write_text(path, &kept.text)?;
        let file = OpenOptions::new().append(true).open(path).map_err(|error| cannot_write(path, error))?;
        Ok(Self { path: path.to_path_buf(), file })
    }

    /// Appends a line with its end, all at once.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn append(&mut self, line: &str) -> Result<(), SessionError> {
        let written = self.file.write_all(line.as_bytes()).and_then(|()| self.file.flush());
        written.map_err(|error| cannot_write(&self.path, error))
    }
}

/// What an earlier run left in a file of reports.
#[derive(Debug, Default)]
pub struct Kept {
    /// Whole lines.
    text: String,
    /// Designs with a line, and whether it tells a failure.
    pub failed: BTreeMap<String, bool>,
}

impl Kept {
    /// Reads the lines of a file, if there is one: all but those of designs to be done again, and
    /// but a last one that was torn when its writer was stopped.
    ///
    /// # Errors
    /// The file cannot be read, or holds something else than reports.
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
                        let failed = value.as_ref().is_some_and(|value| value.get("error").is_some());
                        kept.failed.insert(design.to_owned(), failed);
                    }
                }
                // What follows the last line end is a torn line, or nothing; but a torn line begins
                // like one.
                _ if index + 1 == lines.len() && (line.is_empty() || line.starts_with(b"{")) => {}
                _ => {
                    return Err(SessionError::NoReport { path: path.to_path_buf(), line: index + 1 });
                }
            }
        }
        Ok(kept)
    }
}
