//! The reports of a batch as JSON Lines, in a file that several jobs may share.
//!
//! | what happens | how |
//! |---|---|
//! | a job appends a line | under a lock on the file, whole or not at all |
//! | a job begins and leaves lines of earlier runs out | the file is replaced, under the same lock |
//! | two jobs do the same design | the later line takes the place of the earlier one |
//! | a line was torn by a full disk or a killed job | the next line takes its place |
//! | the power goes | a line that was appended is on the disk, and so are the outputs it tells of |
//!
//! A lock holds for one file, and a replaced file is another one. So a job opens the file for every
//! line, and looks after it has the lock whether the file still has its name.

use std::collections::{HashMap, HashSet};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::SessionError;
use super::files::{cannot_write, write_text};
use crate::formats::{Claim, Sync, folder_to_disk, is_at, is_same, is_special, patiently, real_path, to_disk};
use crate::report::Checksums;

/// A file with one report a line.
#[derive(Debug)]
pub struct ReportFile {
    /// The path as the user named it.
    path: PathBuf,
    /// The file that the path names, so that jobs with other spellings know of each other.
    place: PathBuf,
    /// An open pipe or device: to close it may end its reader.
    special: Option<File>,
    /// The lines that this job has seen.
    seen: Option<Seen>,
}

/// The first part of a file.
#[derive(Debug)]
struct Seen {
    /// The file. It stays open, so that no later file gets its identity.
    file: File,
    /// End of the part, in bytes.
    end: u64,
    /// The designs that have lines in the part.
    designs: HashSet<String>,
}

/// The sign of a job that appends to a file of reports. Dropping it ends the work.
#[derive(Debug, Default)]
pub struct Appending {
    claim: Option<Claim>,
}

impl Appending {
    /// Whether another job appends to the file now too.
    pub fn is_shared(&self) -> bool {
        self.claim.as_ref().is_some_and(Claim::is_shared)
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
        Self { path: path.to_path_buf(), place: real_path(path), special: None, seen: None }
    }

    /// Begins to append to the file.
    ///
    /// # Errors
    /// The folder of the file takes no files.
    pub fn begin(&self) -> Result<Appending, SessionError> {
        if self.is_special() {
            return Ok(Appending::default());
        }
        let claim = Claim::new(&self.place).map_err(|error| cannot_write(&self.path, error))?;
        Ok(Appending { claim: Some(claim) })
    }

    /// [`ReportFile::begin`] for a job that shares the file with no other. Of several such jobs
    /// that begin at once one gets the file.
    ///
    /// # Errors
    /// - [`SessionError::InUse`]: another job appends to the file
    /// - the folder of the file takes no files
    pub fn begin_alone(&self) -> Result<Appending, SessionError> {
        if self.is_special() {
            return Ok(Appending::default());
        }
        match Claim::alone(&self.place).map_err(|error| cannot_write(&self.path, error))? {
            Some(claim) => Ok(Appending { claim: Some(claim) }),
            None => Err(SessionError::InUse { path: self.path.clone() }),
        }
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
        match fs::read(&self.place) {
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
        if kept.as_bytes() == bytes { Ok(()) } else { write_text(&self.place, &kept) }
    }

    /// Appends the line of a design, and brings it to the disk. If another job has appended a line
    /// of the same design meanwhile, that line goes.
    ///
    /// - `line`: with its line end
    ///
    /// # Errors
    /// The line cannot be written, or cannot be brought to the disk. The file is then as it was,
    /// unless another job has appended a line meanwhile. Or another job stands still while it
    /// writes.
    pub fn append(&mut self, design: &str, line: &str) -> Result<(), SessionError> {
        self.append_with(design, line, &mut |_, file| file.sync_data())
    }

    /// [`ReportFile::append`] with the function that brings the file, or the folder of a new file,
    /// to the disk, given its path.
    fn append_with(&mut self, design: &str, line: &str, sync: &mut Sync) -> Result<(), SessionError> {
        if self.is_special() {
            return self.append_to_special(line).map_err(|error| cannot_write(&self.path, error));
        }
        let unwritable = |error| cannot_write(&self.path, error);
        let mut file = self.locked().map_err(unwritable)?;
        let end = whole_lines(&mut file).map_err(unwritable)?;
        // What is seen of another file, which a job has put in the place of the last one, is past.
        let seen = self.seen.take().filter(|seen| seen.end <= end && is_same(&seen.file, &file));
        let (start, mut designs) = seen.map_or_else(Default::default, |seen| (seen.end, seen.designs));
        let unseen = part(&mut file, start, end).map_err(unwritable)?;
        designs.extend(self.parse(&unseen, false)?.into_iter().map(|(line, _)| line.design));
        if !designs.insert(design.to_owned()) {
            let bytes = part(&mut file, 0, end).map_err(unwritable)?;
            let lines = self.parse(&bytes, false)?;
            let others = lines.iter().filter(|(line, _)| line.design != design);
            let kept: String = others.map(|(_, text)| format!("{text}\n")).collect();
            return write_text(&self.place, &(kept + line));
        }
        let append = |file: &mut File| {
            file.set_len(end)?;
            file.seek(SeekFrom::Start(end))?;
            file.write_all(line.as_bytes())
        };
        append(&mut file).inspect_err(|_| drop(file.set_len(end))).map_err(unwritable)?;
        // Where the file system has no locks, there is none to give back. The disk may take long,
        // and a job that is stopped meanwhile must not keep the others from the file.
        let _ = file.unlock();
        let mut to_disk = || {
            to_disk(&self.place, &file, sync)?;
            // A file with its first line may be new, and then its name is not on the disk either.
            if end == 0 { folder_to_disk(&self.place, sync) } else { Ok(()) }
        };
        let end_of_line = end + line.len() as u64;
        if let Err(error) = to_disk() {
            self.take_back(&file, end, end_of_line);
            return Err(unwritable(error));
        }
        self.seen = Some(Seen { file, end: end_of_line, designs });
        Ok(())
    }

    /// Takes the last line back, unless another job has appended one since.
    fn take_back(&self, file: &File, end: u64, end_of_line: u64) {
        let Ok(locked) = self.locked() else { return };
        if is_same(&locked, file) && locked.metadata().is_ok_and(|metadata| metadata.len() == end_of_line) {
            let _ = locked.set_len(end);
        }
    }

    fn append_to_special(&mut self, line: &str) -> io::Result<()> {
        let mut file = match self.special.take() {
            Some(file) => file,
            None => OpenOptions::new().append(true).open(&self.path)?,
        };
        file.write_all(line.as_bytes())?;
        self.special = Some(file);
        Ok(())
    }

    /// Whether the path is a pipe, a device or an open file of the process.
    fn is_special(&self) -> bool {
        is_special(&self.path)
    }

    /// Opens the file and waits until no other job holds its lock. The lock ends with the file's
    /// handle. Where the file system has no locks, the file is opened without one.
    ///
    /// # Errors
    /// The file cannot be opened, or another job holds the lock and stands still.
    fn locked(&self) -> io::Result<File> {
        patiently(&self.path, || {
            let open = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&self.place);
            let file = match open {
                Ok(file) => file,
                Err(error) => return Some(Err(error)),
            };
            if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
                return None;
            }
            // Another job may have replaced the file between the opening and the lock.
            is_at(&file, &self.place).then_some(Ok(file))
        })?
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
                _ if is_last && (line.is_empty() || is_torn(line)) => {}
                _ if strict => return Err(SessionError::NoReport { path: self.path.clone(), line: index + 1 }),
                _ => {}
            }
        }
        Ok(reports)
    }
}

/// Whether a last line without its end, which is no report, may be what a stopped job or a power
/// cut left of one: its beginning, or zeros where the disk got none of its bytes.
pub(super) fn is_torn(line: &[u8]) -> bool {
    let zeros = line.iter().take_while(|&&byte| byte == 0).count();
    line[zeros..].starts_with(b"{") || (zeros > 0 && zeros == line.len())
}

/// The bytes of a file from `start` to `end`.
fn part(file: &mut File, start: u64, end: u64) -> io::Result<Vec<u8>> {
    let mut bytes = vec![0; (end - start) as usize];
    file.seek(SeekFrom::Start(start))?;
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

/// The length of a file up to its last line end.
fn whole_lines(file: &mut File) -> io::Result<u64> {
    const BLOCK: u64 = 1 << 16;
    let mut end = file.seek(SeekFrom::End(0))?;
    while end > 0 {
        let start = end.saturating_sub(BLOCK);
        let block = part(file, start, end)?;
        if let Some(at) = block.iter().rposition(|&byte| byte == b'\n') {
            return Ok(start + at as u64 + 1);
        }
        end = start;
    }
    Ok(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn append(file: &mut ReportFile, design: &str, of: &str) {
        file.append(design, &format!("{{\"design\":\"{design}\",\"of\":\"{of}\"}}\n")).unwrap();
    }

    /// Two jobs append in turns. A line of another job is replaced also if this job has seen it
    /// when it appended the line of another design.
    ///
    /// Fails if only lines behind the own last one are looked at.
    #[test]
    fn a_design_of_two_jobs_has_the_last_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("all.jsonl");
        let [mut one, mut other] = [ReportFile::new(&path), ReportFile::new(&path)];
        for (design, first) in
            [("a", true), ("b", false), ("c", true), ("b", true), ("a", false), ("d", false), ("c", false)]
        {
            append(if first { &mut one } else { &mut other }, design, if first { "one" } else { "other" });
        }
        let expected = [("b", "one"), ("a", "other"), ("d", "other"), ("c", "other")];
        let line = |(design, of)| format!("{{\"design\":\"{design}\",\"of\":\"{of}\"}}\n");
        assert_eq!(fs::read_to_string(&path).unwrap(), expected.map(line).concat());
    }

    /// A line is on the disk when it is appended, and with the first line the file's name is. A
    /// line that the disk does not take is taken back.
    #[test]
    fn a_line_is_on_the_disk() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().canonicalize().unwrap().join("all.jsonl");
        let mut file = ReportFile::new(&path);
        for (line, expected) in [("{\"design\":\"a\"}\n", 2), ("{\"design\":\"b\"}\n", 1)] {
            let mut synced = Vec::new();
            let mut sync = |path: &Path, _: &File| {
                assert!(fs::read_to_string(folder.path().join("all.jsonl"))?.ends_with(line));
                synced.push(path.to_path_buf());
                Ok(())
            };
            file.append_with(&line[11..12], line, &mut sync).unwrap();
            assert_eq!(synced, [path.as_path(), path.parent().unwrap()][..expected]);
        }
        let before = fs::read_to_string(&path).unwrap();
        let fails = file.append_with("c", "{\"design\":\"c\"}\n", &mut |_, _| Err(io::Error::other("a bad disk")));
        assert!(fails.unwrap_err().to_string().contains("a bad disk"));
        assert_eq!(fs::read_to_string(&path).unwrap(), before);
        append(&mut file, "c", "one");
        assert_eq!(fs::read_to_string(&path).unwrap(), before + "{\"design\":\"c\",\"of\":\"one\"}\n");
        // A file system that knows no such request is no failure.
        file.append_with("d", "{}\n", &mut |_, _| Err(io::ErrorKind::Unsupported.into())).unwrap();
    }

    /// While the disk takes a line, another job may append one. It stays, also if the disk fails.
    ///
    /// Fails if a line is brought to the disk under the lock, or if a line that the disk does not
    /// take is taken back together with those that follow it.
    #[test]
    fn the_disk_keeps_no_job_from_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("all.jsonl");
        let line = |design: &str| format!("{{\"design\":\"{design}\",\"of\":\"one\"}}\n");
        for (one, other, takes) in [("a", "b", true), ("c", "d", false)] {
            let mut is_first = true;
            let mut sync = |_: &Path, _: &File| {
                if std::mem::take(&mut is_first) {
                    append(&mut ReportFile::new(&path), other, "one");
                }
                if takes { Ok(()) } else { Err(io::Error::other("a bad disk")) }
            };
            let appended = ReportFile::new(&path).append_with(one, &line(one), &mut sync);
            assert_eq!(appended.is_ok(), takes);
        }
        assert_eq!(fs::read_to_string(&path).unwrap(), ["a", "b", "c", "d"].map(line).concat());
    }

    /// A line torn by a full disk, a killed job or a power cut is left out, and gives its place to
    /// the next line. Other text at the end is an error.
    #[test]
    fn a_torn_line_goes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("all.jsonl");
        let mut file = ReportFile::new(&path);
        append(&mut file, "a", "one");
        let whole = fs::read_to_string(&path).unwrap();
        for torn in ["{\"design\":\"b\",\"o", "{\"des\0\0\0", "\0\0\0\0", "\0\0{\"design\":"] {
            fs::write(&path, format!("{whole}{torn}")).unwrap();
            let mut file = ReportFile::new(&path);
            assert_eq!(file.lines().unwrap().len(), 1, "{torn:?}");
            append(&mut file, "c", "one");
            let expected = whole.clone() + "{\"design\":\"c\",\"of\":\"one\"}\n";
            assert_eq!(fs::read_to_string(&path).unwrap(), expected, "{torn:?}");
        }
        for other in ["no report", "\0\0no report"] {
            fs::write(&path, format!("{whole}{other}")).unwrap();
            assert!(ReportFile::new(&path).lines().is_err(), "{other:?}");
        }
    }
}
