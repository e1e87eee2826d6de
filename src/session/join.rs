//! Joins files of reports: each design once.
//!
//! | lines of one design | the line that stays |
//! |---|---|
//! | some good ones (exit code 0) | the last good one |
//! | some with a result that is not good | the last of these |
//! | none with a result | the last one |
//!
//! Lines that tell of different results are a conflict, which the caller tells. Files are in the
//! order of the arguments, and the lines of a file in their order.
//!
//! Of each line its text is kept, and no tree of JSON, which takes several times as much. Files are
//! read in pieces. Where the memory does not hold the texts, or a single long line, this is an
//! error.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::checksums::{same_files, same_inputs};
use super::earlier::has_result;
use super::lines::is_torn;
use super::{Line, SessionError};
use crate::formats::{read_file, read_lines};
use crate::memory::check_memory;
use crate::report::Sums;

/// The lines that stay, sorted by the names of their designs.
#[derive(Debug, Default)]
pub struct Joined {
    /// One line for each design.
    pub lines: Vec<JoinedLine>,
    /// Lines of one design that tell of different results.
    pub conflicts: Vec<Conflict>,
    /// Files whose last line was torn when a process was stopped. The torn line is left out.
    pub torn: Vec<PathBuf>,
    /// Lines of different cases or meshes: one of each, if there are several.
    pub cases: Vec<JoinedLine>,
}

/// A line of a file of reports.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JoinedLine {
    /// The design.
    pub design: String,
    /// The exit code of the design.
    pub exit: u8,
    /// The line, without its line end.
    pub text: String,
    /// The file.
    pub path: PathBuf,
    /// Number of the line in the file, from 1.
    pub number: usize,
}

/// Two lines of one design that tell of different results.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Conflict {
    /// The line that stays.
    pub stays: JoinedLine,
    /// The line that goes.
    pub goes: JoinedLine,
    /// What differs, in words.
    pub what: &'static str,
}

/// A line with what of it decides.
struct Read {
    line: JoinedLine,
    report: Line,
}

/// A line longer than this is parsed only where the memory holds its tree, in bytes.
const LONG: usize = 1 << 20;

/// A tree of JSON takes at most so many bytes for each byte of its text: an empty object in an
/// array is three bytes of text.
const TREE: u64 = 32;

/// Joins files with one report a line.
///
/// # Errors
/// - [`SessionError::CannotRead`]: a file cannot be read
/// - [`SessionError::NoReport`]: a line is no report of a design
pub fn join(paths: &[PathBuf]) -> Result<Joined, SessionError> {
    let mut joined = Joined::default();
    let mut designs: BTreeMap<String, Vec<Read>> = BTreeMap::new();
    for path in paths {
        let cannot_read = |source| SessionError::CannotRead { path: path.clone(), source };
        let of_memory = |bytes: u64| check_memory(bytes).map_err(|error| cannot_read(io::Error::other(error)));
        // All texts are kept. Of a file whose length is not known, each piece is asked for.
        of_memory(fs::metadata(path).map_or(0, |metadata| metadata.len()))?;
        let mut number = 0;
        read_lines(path, cannot_read, |piece| {
            of_memory(piece.len() as u64)?;
            for line in piece.split_inclusive(|&byte| byte == b'\n') {
                number += 1;
                let text = if number == 1 { line.strip_prefix(BOM).unwrap_or(line) } else { line };
                if text.trim_ascii().is_empty() {
                    continue;
                }
                if text.len() > LONG {
                    of_memory(TREE * text.len() as u64)?;
                }
                match read(text, path, number) {
                    Some(read) => designs.entry(read.line.design.clone()).or_default().push(read),
                    // Only a line without its end is torn.
                    None if !line.ends_with(b"\n") && is_torn(text) => joined.torn.push(path.clone()),
                    None => return Err(SessionError::NoReport { path: path.clone(), line: number }),
                }
            }
            Ok(())
        })
        .map_err(|error| if is_of_run(path) { SessionError::OneRun { path: path.clone() } } else { error })?;
    }
    let mut stay: Vec<Read> = Vec::new();
    for lines in designs.into_values() {
        let best = lines.iter().map(|line| rank(&line.report)).max();
        let at = lines.iter().rposition(|line| Some(rank(&line.report)) == best).unwrap_or(0);
        let conflicts = lines.iter().enumerate().filter(|&(other, _)| other != at).filter_map(|(other, goes)| {
            let what = difference(&lines[at], goes, other > at)?;
            Some(Conflict { stays: lines[at].line.clone(), goes: goes.line.clone(), what })
        });
        joined.conflicts.extend(conflicts);
        stay.extend(lines.into_iter().nth(at));
    }
    let mut cases: Vec<&Read> = Vec::new();
    for read in &stay {
        if !cases.iter().any(|other| same_case(&other.report, &read.report)) {
            cases.push(read);
        }
    }
    if cases.len() > 1 {
        joined.cases = cases.into_iter().map(|read| read.line.clone()).collect();
    }
    joined.lines = stay.into_iter().map(|read| read.line).collect();
    Ok(joined)
}

/// Some editors and other programs put this before a text in UTF-8.
const BOM: &[u8] = "\u{feff}".as_bytes();

/// Whether a file is the report of one run, on several lines. Such reports are small.
fn is_of_run(path: &Path) -> bool {
    let is_small = fs::metadata(path).is_ok_and(|metadata| metadata.len() <= LONG as u64);
    let value = || serde_json::from_slice::<Value>(&read_file(path).ok()?).ok();
    is_small && value().is_some_and(|value| value.get("idmesh").is_some() && value.get("stages").is_some())
}

fn read(piece: &[u8], path: &Path, number: usize) -> Option<Read> {
    let text = std::str::from_utf8(piece).ok()?.trim();
    let report: Line = serde_json::from_str(text).ok()?;
    value(text)?;
    // A line without a verdict, or with one against the other, is no report.
    let exit = report.exit.filter(|&exit| exit != 0 || report.valid)?;
    let (design, path) = (report.design.clone(), path.to_path_buf());
    Some(Read { line: JoinedLine { design, exit, text: text.to_owned(), path, number }, report })
}

fn value(text: &str) -> Option<Value> {
    serde_json::from_str(text).ok()
}

/// How much a line is worth: the greatest stays.
fn rank(line: &Line) -> u8 {
    match line.exit {
        Some(0) => 2,
        Some(exit) if has_result(exit) => 1,
        _ => 0,
    }
}

/// What differs between the results of two lines of one design; `None` if they tell of the same
/// result. A design that could not be moved at first, and has a result later, is no conflict.
///
/// - `is_later`: whether the line that goes comes after the one that stays
fn difference(stays: &Read, goes: &Read, is_later: bool) -> Option<&'static str> {
    if rank(&goes.report) == 0 && rank(&stays.report) > 0 && !is_later {
        return None;
    }
    if stays.line.exit != goes.line.exit {
        return Some("exit codes");
    }
    match (&stays.report.checksums, &goes.report.checksums) {
        (Some(one), Some(other)) if !same_inputs(one, other) => Some("inputs"),
        (Some(one), Some(other)) if !same_files(&one.outputs, &other.outputs) => Some("outputs"),
        (Some(_), Some(_)) => None,
        _ => {
            let of = |read: &Read| value(&read.line.text).map(|value| timeless(&value));
            (of(stays) != of(goes)).then_some("results")
        }
    }
}

/// A report without its times.
fn timeless(value: &Value) -> Value {
    match value {
        Value::Object(members) => {
            let kept = members.iter().filter(|(key, _)| *key != "seconds");
            Value::Object(kept.map(|(key, value)| (key.clone(), timeless(value))).collect())
        }
        Value::Array(values) => Value::Array(values.iter().map(timeless).collect()),
        value => value.clone(),
    }
}

/// Whether two lines are of the same case and mesh, as far as they tell.
fn same_case(one: &Line, other: &Line) -> bool {
    let (Some(one), Some(other)) = (&one.checksums, &other.checksums) else { return true };
    let same = |part: fn(&crate::report::Checksums) -> &Sums| same_files(part(one), part(other));
    same(|sums| &sums.case) && same(|sums| &sums.mesh) && same(|sums| &sums.inputs)
}
