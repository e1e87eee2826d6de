//! `.mapbc` files: names and boundary conditions of the references of a mesh file's faces, beside
//! the mesh file.
//!
//! FUN3D's form is a count and as many lines `reference condition name`. VGRID's form has no count,
//! but up to four lines of header and lines `patch condition family #surfaces surfaces... name`. In
//! both forms `#` and `!` begin comments. The name may be missing or contain blanks.
//!
//! Source: the FUN3D manual, "Grid Formats"; NASA's TetrUSS documentation.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::str::from_utf8;

use super::document::{Companion, Conditions, Names};
use super::error::{ReadError, WriteError};
use super::input::read_file;
use super::lines::{Line, Lines};
use super::linked::{is_linked, unquoted};
use super::mesh_builder::surface;
use super::new_file::{NewFile, clean_names, renamed};
use super::scanner::shown;
use crate::text::decode;

/// The contents of a file.
#[derive(Debug, Default)]
pub(super) struct Mapbc {
    /// The names of the references that have one.
    pub names: Names,
    /// The number of the boundary condition of each reference.
    pub conditions: Conditions,
    /// The bytes of the file, if there is one.
    pub bytes: Option<Vec<u8>>,
}

/// Header lines of VGRID's form.
const HEADER: usize = 4;

/// What a new file says about conditions.
pub(super) const NO_CONDITIONS: &str = "boundary conditions: the .mapbc file beside it gives every family the number 0";

/// Path of the file with the names of a mesh: `wing.mapbc` for `wing.b8.ugrid.gz`.
///
/// - `extensions`: extensions of the mesh's format
pub(super) fn path_beside(path: &Path, extensions: &[&str]) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let lower = name.to_ascii_lowercase();
    let stem = lower.strip_suffix(".gz").unwrap_or(&lower);
    let ends = |extension: &&&str| stem.ends_with(&format!(".{extension}"));
    let longest = extensions.iter().filter(ends).map(|extension| extension.len() + 1).max().unwrap_or(0);
    // Letters whose lower case has another length do not occur within the ASCII extension.
    let stem = name.get(..stem.len().saturating_sub(longest)).unwrap_or(&name);
    path.with_file_name(format!("{stem}.mapbc"))
}

/// Reads the file at `path`. The result is empty if there is no file.
pub(super) fn read(path: &Path) -> Result<Mapbc, ReadError> {
    match read_file(path) {
        Ok(bytes) => Ok(Mapbc { bytes: Some(bytes.clone()), ..parse(path, &bytes).map_err(unquoted)? }),
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(Mapbc::default()),
        Err(source) => Err(ReadError::Io { path: path.into(), source }),
    }
}

/// Reads a file from its bytes; `path` is for messages.
fn parse(path: &Path, bytes: &[u8]) -> Result<Mapbc, ReadError> {
    let mut lines = Lines::new(path, bytes, b"#!");
    let mut mapbc = Mapbc::default();
    let header = bytes.iter().enumerate().filter(|&(_, &byte)| byte == b'\n').nth(HEADER - 1);
    let header_end = header.map_or(bytes.len(), |(at, _)| at);
    let first = loop {
        let line = lines.demand("the number of boundaries, or a reference and its boundary condition")?;
        // A line that begins with a number is never skipped, because it may name a patch.
        if number(line.clone().word().1).is_some() || line.start > header_end {
            break line;
        }
    };
    let mut alone = first.clone();
    alone.word();
    if !alone.rest().is_empty() {
        let mut next = Some(first);
        while let Some(line) = next {
            mapbc.add(&lines, line, true)?;
            next = lines.next_line();
        }
        return Ok(mapbc);
    }
    let (at, mut count) = (first.start, first);
    let count = lines.unsigned(&mut count, "the number of boundaries")?;
    let count = lines.checked(at, "the number of boundaries", count, 4)?;
    for _ in 0..count {
        let line = lines.demand("a reference, its boundary condition and its name")?;
        mapbc.add(&lines, line, false)?;
    }
    match lines.next_line() {
        None => Ok(mapbc),
        Some(line) => {
            let expected = format!("the end of the file after {count} boundaries, the number in its first line");
            Err(lines.malformed(line.start, expected, shown(line.text)))
        }
    }
}

fn number(word: &[u8]) -> Option<i32> {
    from_utf8(word).ok()?.parse().ok()
}

impl Mapbc {
    /// Adds a line. `patch`: whether the line may have VGRID's form.
    fn add(&mut self, lines: &Lines, mut line: Line, patch: bool) -> Result<(), ReadError> {
        let (start, word) = line.word();
        let reference =
            number(word).ok_or_else(|| lines.malformed(start, "the reference of a boundary", shown(word)))?;
        let (at, word) = line.word();
        let condition =
            number(word).ok_or_else(|| lines.malformed(at, "the number of a boundary condition", shown(word)))?;
        if patch {
            line = after_surfaces(line);
        }
        let name = line.rest();
        if self.conditions.insert(reference, condition).is_some() {
            let found = format!("a second line for {reference}, which is '{}' before", self.name(reference));
            return Err(lines.malformed(start, "one line for each reference", found));
        }
        if !name.is_empty() {
            self.names.insert(reference, decode(name).into_owned());
        }
        Ok(())
    }

    /// Whether there are boundary conditions other than 0.
    pub fn has_conditions(&self) -> bool {
        has_conditions(&self.conditions)
    }

    /// The name of a reference, or its number in words.
    pub fn name(&self, reference: i32) -> String {
        name(&self.names, reference)
    }
}

/// The rest of a line after VGRID's family, number of surfaces, and surfaces (at least one, even if
/// the number is 0). The whole line if these are not all there.
fn after_surfaces(line: Line) -> Line {
    let mut rest = line.clone();
    let mut next = || number(rest.word().1);
    let (Some(_), Some(n_surfaces)) = (next(), next()) else { return line };
    for _ in 0..n_surfaces.max(1) {
        if next().is_none() {
            return line;
        }
    }
    rest
}

/// The names of a new mesh. Its references are the families' numbers, counted from 1.
pub(super) fn names(new_file: &NewFile) -> Names {
    (1..).zip(clean_names(new_file.cells.families, fits)).collect()
}

/// The bytes of a new file, in FUN3D's form.
pub(super) fn without_conditions(names: &Names) -> Vec<u8> {
    let lines = names.iter().map(|(reference, name)| format!("{reference} 0 {name}\n"));
    format!("{}\n{}", names.len(), lines.collect::<String>()).into_bytes()
}

/// Losses of a new file: blanks in names.
pub(super) fn limits(new_file: &NewFile) -> Vec<String> {
    renamed(new_file.cells.families, &clean_names(new_file.cells.families, fits))
}

fn fits(letter: char) -> bool {
    !letter.is_whitespace() && !letter.is_control() && !matches!(letter, '#' | '!' | '\u{feff}')
}

/// Checks that a file at `path` has the same names as `companion`, which belongs to the mesh, and
/// the same boundary conditions, if the mesh has conditions.
///
/// # Errors
/// [`WriteError::Stale`], also if the file cannot be read.
pub(super) fn check(path: &Path, companion: &Companion) -> Result<(), WriteError> {
    if companion.bytes.is_none() && companion.names.is_empty() {
        return Ok(());
    }
    let stale = |what: String| WriteError::Stale { path: path.into(), what };
    let there = read(path).map_err(|error| stale(format!("it cannot be read: {error}")))?;
    if there.bytes.is_none() || there.bytes == companion.bytes {
        return Ok(());
    }
    let quoted = |found: String| if is_linked(path) { "otherwise".to_owned() } else { found };
    if let Some(reference) = difference(&there.names, &companion.names) {
        let [found, own] = [&there.names, &companion.names].map(|names| name(names, reference));
        let found = quoted(format!("'{found}'"));
        if !companion.names.contains_key(&reference) {
            return Err(stale(format!("it calls family {reference} {found}, and the mesh has no such family")));
        }
        return Err(stale(format!("it calls family {reference} {found}, the mesh '{own}'")));
    }
    // Without conditions of the mesh those that are there are its owner's work.
    if !has_conditions(&companion.conditions) {
        return Ok(());
    }
    match other_condition(&there.conditions, &companion.conditions) {
        None => Ok(()),
        Some(reference) => {
            let [found, own] = [&there.conditions, &companion.conditions].map(|of| condition(of, reference));
            let found = quoted(found.to_string());
            Err(stale(format!("it gives family {reference} the boundary condition {found}, the mesh {own}")))
        }
    }
}

/// The condition of a reference: 0 where the file has none.
fn condition(conditions: &Conditions, reference: i32) -> i32 {
    conditions.get(&reference).copied().unwrap_or(0)
}

/// A reference with different conditions, if there is one.
fn other_condition(a: &Conditions, b: &Conditions) -> Option<i32> {
    a.keys().chain(b.keys()).copied().find(|&reference| condition(a, reference) != condition(b, reference))
}

fn has_conditions(conditions: &Conditions) -> bool {
    conditions.values().any(|&condition| condition != 0)
}

/// Whether every reference has the same name and the same condition for both.
pub(super) fn agree(a: &Companion, b: &Companion) -> bool {
    difference(&a.names, &b.names).is_none() && other_condition(&a.conditions, &b.conditions).is_none()
}

/// A reference with different names, if there is one. Letters that not every program's file can
/// hold, such as blanks, make no difference.
fn difference(a: &Names, b: &Names) -> Option<i32> {
    let plain = |names, reference| -> String {
        name(names, reference).chars().map(|letter| if fits(letter) { letter } else { '_' }).collect()
    };
    a.keys().chain(b.keys()).copied().find(|&reference| plain(a, reference) != plain(b, reference))
}

fn name(names: &Names, reference: i32) -> String {
    names.get(&reference).cloned().unwrap_or_else(|| surface(reference))
}
