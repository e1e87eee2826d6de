//! The reports of a batch as JSON Lines, in a file that several jobs may share.
//!
//! | what happens | how |
//! |---|---|
//! | a job appends a line | under a lock on the file, whole or not at all |
//! | a job begins and leaves lines of earlier runs out | the file is replaced, under the same lock |
//! | a line was torn by a full disk or a killed job | the next line takes its place |
//!
//! A lock holds for one file, and a replaced file is another one. So a job opens the file for every
//! line, and looks after it has the lock whether the file still has its name.

use std::collections::HashMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::SessionError;
use super::files::{cannot_write, write_text};
use crate::formats::Claim;
use crate::report::Checksums;

/// A file with one report a line.
#[derive(Debug)]
pub struct ReportFile {
    path: PathBuf,
}

/// The sign of a job that appends to a file of reports. Dropping it ends the work.
#[derive(Debug, Default)]
pub struct Appending {
    claim: Option<Claim>,
}

impl Appending {
    /// Whether another job appends to the file too.
    pub fn is_shared(&self) -> bool {
        self.claim.as_ref().is_some_and(|claim| claim.is_shared)
    }
}

/// What a later run needs of a line.
#[derive(Clone, Debug, Deserialize)]
#[non_exhaustive]
pub struct Line {
    /// The design.
    pub design: String,
    /// The exit code of the design. `None` in lines of old versions.
    #[serde(default)]
    pub exit: Option<u8>,
    /// Whether the mesh is valid.
    #[serde(default)]
    pub valid: bool,
    /// Checksums of the files of the design.
    #[serde(default)]
    pub checksums: Option<Checksums>,
}

impl ReportFile {
    /// A file of reports, which may be missing.
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_path_buf() }
    }

    /// Begins to append to the file.
    ///
    /// # Errors
    /// The folder of the file takes no files.
    pub fn begin(&self) -> Result<Appending, SessionError> {
        if self.is_special() {
            return Ok(Appending::default());
        }
        let claim = Claim::new(&self.path).map_err(|error| cannot_write(&self.path, error))?;
        Ok(Appending { claim: Some(claim) })
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The lines of the file, in their order. An incomplete last line of a job that was stopped is
    /// left out. There are no lines if there is no file.
    ///
    /// # Errors
    /// - [`SessionError::CannotRead`]: the file cannot be read
    /// - [`SessionError::NoReport`]: a line is no report of a design
    pub fn lines(&self) -> Result<Vec<Line>, SessionError> {
        if self.is_special() {
            return Ok(Vec::new());
        }
        match fs::read(&self.path) {
            Ok(bytes) => {
                let lines = self.parse(&bytes, true)?;
                Ok(lines.into_iter().map(|(line, _)| line).collect())
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
            Err(source) => Err(SessionError::CannotRead { path: self.path.clone(), source }),
        }
    }

    /// Replaces the file by those of its lines that stay. Lines that are no reports do not stay.
    ///
    /// - `stays`: whether a line stays
    ///
    /// # Errors
    /// The file cannot be read or written.
    pub fn keep(&self, stays: impl Fn(&Line) -> bool) -> Result<(), SessionError> {
        if self.is_special() {
            return Ok(());
        }
        let mut file = self.locked().map_err(|error| cannot_write(&self.path, error))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(|source| SessionError::CannotRead { path: self.path.clone(), source })?;
        let lines = self.parse(&bytes, false)?;
        let kept: String = lines.iter().filter(|(line, _)| stays(line)).map(|(_, text)| format!("{text}\n")).collect();
        if kept.as_bytes() == bytes { Ok(()) } else { write_text(&self.path, &kept) }
    }

    /// Appends a line.
    ///
    /// - `line`: with its line end
    ///
    /// # Errors
    /// The line cannot be written. The file is then as it was.
    pub fn append(&self, line: &str) -> Result<(), SessionError> {
        let append = || {
            if self.is_special() {
                return OpenOptions::new().write(true).open(&self.path)?.write_all(line.as_bytes());
            }
            let mut file = self.locked()?;
            let end = whole_lines(&mut file)?;
            file.set_len(end)?;
            file.seek(SeekFrom::Start(end))?;
            file.write_all(line.as_bytes()).inspect_err(|_| drop(file.set_len(end)))
        };
        append().map_err(|error| cannot_write(&self.path, error))
    }

    /// Whether the path is a pipe or a device.
    fn is_special(&self) -> bool {
        fs::metadata(&self.path).is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir())
    }

    /// Opens the file and waits until no other job holds its lock. The lock ends with the file's
    /// handle. Where the file system has no locks, the file is opened without one.
    fn locked(&self) -> io::Result<File> {
        loop {
            let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&self.path)?;
            match file.lock() {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Ok(()) | Err(_) => {}
            }
            // Another job may have replaced the file between the opening and the lock.
            if fs::metadata(&self.path).is_ok_and(|named| same_file(&named, &file)) {
                return Ok(file);
            }
        }
    }

    /// The reports in the lines of a file, each with its text. A later line of a design takes the
    /// place of an earlier one.
    ///
    /// - `strict`: whether a line that is no report is an error; otherwise the line is left out
    fn parse<'b>(&self, bytes: &'b [u8], strict: bool) -> Result<Vec<(Line, &'b str)>, SessionError> {
        let lines: Vec<&[u8]> = bytes.split(|&byte| byte == b'\n').collect();
        let mut reports: Vec<(Line, &str)> = Vec::new();
        let mut places = HashMap::new();
        for (index, line) in lines.iter().enumerate() {
            // After the last line end there may be nothing, or an incomplete line, which begins
            // like a report too.
            let is_last = index + 1 == lines.len();
            match (serde_json::from_slice::<Line>(line), std::str::from_utf8(line)) {
                (Ok(report), Ok(text)) => match places.get(&report.design) {
                    Some(&place) => reports[place] = (report, text),
                    None => {
                        places.insert(report.design.clone(), reports.len());
                        reports.push((report, text));
                    }
                },
                _ if is_last && (line.is_empty() || line.starts_with(b"{")) => {}
                _ if strict => return Err(SessionError::NoReport { path: self.path.clone(), line: index + 1 }),
                _ => {}
            }
        }
        Ok(reports)
    }
}

/// The length of a file up to its last line end.
fn whole_lines(file: &mut File) -> io::Result<u64> {
    const BLOCK: u64 = 1 << 16;
    let mut end = file.seek(SeekFrom::End(0))?;
    while end > 0 {
        let start = end.saturating_sub(BLOCK);
        let mut block = vec![0; (end - start) as usize];
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(&mut block)?;
        if let Some(at) = block.iter().rposition(|&byte| byte == b'\n') {
            return Ok(start + at as u64 + 1);
        }
        end = start;
    }
    Ok(0)
}

#[cfg(unix)]
fn same_file(named: &fs::Metadata, file: &File) -> bool {
    use std::os::unix::fs::MetadataExt;
    file.metadata().is_ok_and(|open| (open.dev(), open.ino()) == (named.dev(), named.ino()))
}

/// An open file cannot be replaced on other systems.
#[cfg(not(unix))]
fn same_file(_: &fs::Metadata, _: &File) -> bool {
    true
}
