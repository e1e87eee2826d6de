//! The reports of a batch as JSON Lines: appended one by one, and taken up again after a run that
//! was stopped.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

use serde::Serialize;

use super::JsonTarget;
use super::console::Console;
use super::failure::Failure;
use super::outputs;

/// Where the lines go.
pub(super) enum Lines<'a> {
    /// Nobody asked for them.
    Nowhere,
    /// Standard output.
    StandardOutput(&'a Console),
    /// A file, open for appending.
    File(&'a Path, File),
}

impl<'a> Lines<'a> {
    /// Opens the target; a file begins with the lines kept, and holds nothing else.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn open(target: Option<&'a JsonTarget>, kept: &Kept, console: &'a Console) -> Result<Self, Failure> {
        match target {
            None => Ok(Self::Nowhere),
            Some(JsonTarget::StandardOutput) => Ok(Self::StandardOutput(console)),
            Some(JsonTarget::File(path)) => {
                outputs::write_text(path, &kept.text)?;
                let file = OpenOptions::new().append(true).open(path).map_err(|error| cannot_write(path, &error))?;
                Ok(Self::File(path, file))
            }
        }
    }

    /// Appends a value as a line, all at once.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn append(&mut self, value: &impl Serialize) -> Result<(), Failure> {
        let mut text = serde_json::to_string(value)
            .map_err(|error| Failure::bad_input(format!("cannot write the report: {error}")))?;
        text.push('\n');
        match self {
            Self::Nowhere => Ok(()),
            Self::StandardOutput(console) => console.data(&text),
            Self::File(path, file) => {
                file.write_all(text.as_bytes()).and_then(|()| file.flush()).map_err(|error| cannot_write(path, &error))
            }
        }
    }
}

fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    Failure::bad_input(format!("cannot write {}: {error}", path.display()))
}

/// What an earlier run left in a file of reports.
#[derive(Debug, Default)]
pub(super) struct Kept {
    /// Whole lines.
    text: String,
    /// Designs with a line, and whether it tells a failure.
    pub(super) failed: BTreeMap<String, bool>,
}

impl Kept {
    /// Reads the lines of a file, if there is one: all but those of designs to be done again, and
    /// but a last one that was torn when its writer was stopped.
    ///
    /// # Errors
    /// The file cannot be read, or holds something else than reports.
    pub(super) fn read(path: &Path, again: impl Fn(&str) -> bool) -> Result<Self, Failure> {
        let bytes = match fs::read(path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(error) => return Err(Failure::bad_input(format!("cannot read {}: {error}", path.display()))),
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
                    let message = format!("{}: line {} is no report of a design", path.display(), index + 1);
                    return Err(Failure::bad_input(message).with_hint("without --resume the file is replaced"));
                }
            }
        }
        Ok(kept)
    }
}
