//! Profile files: CSV with the columns `profile,x,y,z`, one row per point.
//!
//! The points of a profile follow one another, in order along the curve. This module opens no file:
//! the caller passes texts with their paths (for messages), or a writer.

use std::collections::HashSet;
use std::io::Write;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::{Profile, ProfileError};
use crate::text::header::{self, Header};
use crate::text::{Mark, Row, comma_advice, fields, parse_number, rows, shorten};

const HEADER: &str = "profile,x,y,z";
const EXPECTED: &str = "the header profile,x,y,z";

/// Reads the profiles of one or several files, in their order.
///
/// - `sources`: path (for messages only) and text of each file
///
/// Accepted are:
///
/// - columns in any order, and further columns
/// - column names in quotes, in capitals, and ParaView's names of coordinates (`Points:0`)
/// - commas, semicolons or white space as separators
/// - comments from `#`, `!` or `%` to the end of a line; a comment before the first row may hold
///   the header
/// - a whole number such as `3.0` as the number of a profile, and Fortran's exponents
///
/// # Errors
/// - [`ProfileError::Line`] with path and line: a missing header, a row of another length,
///   coordinates that are not finite, or a profile that continues after another one or in another
///   file
/// - [`ProfileError::NoProfiles`]: there is no row
pub fn parse(sources: &[(&Path, &str)]) -> Result<Vec<Profile>, ProfileError> {
    let mut reader = Reader::default();
    for &(path, text) in sources {
        reader.begin(path);
        reader.add(text)?;
        reader.end()?;
    }
    reader.profiles()
}

/// Reads the profiles of one or several files, whose texts come in pieces.
#[derive(Default)]
pub(crate) struct Reader {
    profiles: Vec<Profile>,
    /// The numbers of the profiles.
    seen: HashSet<i64>,
    file: Begun,
}

/// What is known of a file of which some lines were read.
#[derive(Default)]
struct Begun {
    path: PathBuf,
    /// Number of lines that were read.
    n_lines: usize,
    columns: Option<Columns>,
    has_rows: bool,
    /// The profile of the last row. A profile never continues in the next file.
    profile: Option<i64>,
}

impl Begun {
    fn fail(&self, line: usize, what: String, expected: &'static str) -> ProfileError {
        ProfileError::Line { path: self.path.clone(), line: line + 1, what, expected }
    }
}

impl Reader {
    /// Begins a file.
    ///
    /// - `path`: for messages only
    pub fn begin(&mut self, path: &Path) {
        self.file = Begun { path: path.to_path_buf(), ..Begun::default() };
    }

    /// Reads the next whole lines of the file.
    ///
    /// # Errors
    /// As [`parse`].
    pub fn add(&mut self, text: &str) -> Result<(), ProfileError> {
        let first = self.file.n_lines;
        for Row { line, text: row, comment } in rows(text, Mark::Any) {
            self.file.n_lines = first + line + 1;
            self.row(first + line, row, comment)?;
        }
        Ok(())
    }

    fn row(&mut self, line: usize, row: &str, comment: &str) -> Result<(), ProfileError> {
        let file = &mut self.file;
        if row.is_empty() {
            if !file.has_rows
                && let Ok(of_comment) = Columns::of(&fields(comment))
            {
                file.columns = Some(of_comment);
            }
            return Ok(());
        }
        let fields = fields(row);
        let is_first = !std::mem::replace(&mut file.has_rows, true);
        if is_first && (file.columns.is_none() || header::is_header(&fields)) {
            file.columns = Some(Columns::of(&fields).map_err(|what| file.fail(line, what, EXPECTED))?);
            return Ok(());
        }
        let Some(columns) = &file.columns else { return Ok(()) };
        if fields.len() != columns.n {
            let what = format!("{} fields", fields.len());
            let expected = if columns.n == 4 { "four: profile,x,y,z" } else { "as many as the header has" };
            return Err(file.fail(line, what, expected));
        }
        let number = fields[columns.profile];
        let Some(number) = parse_profile(number) else {
            return Err(file.fail(line, format!("profile number '{}'", shorten(number)), "an integer"));
        };
        let mut coordinates = [0.0; 3];
        for ((column, axis), coordinate) in columns.position.into_iter().zip(["x", "y", "z"]).zip(&mut coordinates) {
            *coordinate = match parse_number(fields[column]) {
                Some(value) if value.is_finite() => value,
                _ => {
                    return Err(file.fail(
                        line,
                        format!("{axis} = '{}'{}", shorten(fields[column]), comma_advice(fields[column])),
                        "a finite number",
                    ));
                }
            };
        }
        if file.profile != Some(number) {
            if !self.seen.insert(number) {
                let what = format!("profile {number} begins a second time");
                return Err(file.fail(line, what, "the points of a profile in consecutive rows of one file"));
            }
            self.profiles.last_mut().into_iter().for_each(|done| done.points.shrink_to_fit());
            self.profiles.push(Profile { number, points: Vec::new() });
            file.profile = Some(number);
        }
        if let Some(profile) = self.profiles.last_mut() {
            profile.points.push(DVec3::from_array(coordinates));
        }
        Ok(())
    }

    /// Ends a file.
    ///
    /// # Errors
    /// [`ProfileError::Line`]: the file has no row.
    pub fn end(&mut self) -> Result<(), ProfileError> {
        match self.file.has_rows {
            true => Ok(()),
            false => Err(self.file.fail(0, "the file is empty".into(), EXPECTED)),
        }
    }

    /// The profiles of all files.
    ///
    /// # Errors
    /// [`ProfileError::NoProfiles`]: there is no row.
    pub fn profiles(mut self) -> Result<Vec<Profile>, ProfileError> {
        self.profiles.last_mut().into_iter().for_each(|done| done.points.shrink_to_fit());
        if self.profiles.is_empty() { Err(ProfileError::NoProfiles) } else { Ok(self.profiles) }
    }
}

/// Indices of the columns of a file.
struct Columns {
    n: usize,
    profile: usize,
    position: [usize; 3],
}

impl Columns {
    /// The columns of a header. The error is a message in words.
    fn of(names: &[&str]) -> Result<Self, String> {
        let found = || format!("found '{}'", shorten(&names.join(",")));
        if !header::is_header(names) {
            return Err(found());
        }
        let header = Header::of(names);
        let names = &header.names;
        let mut profile = (0..names.len()).filter(|&column| names[column].eq_ignore_ascii_case("profile"));
        let first = profile.next().ok_or_else(|| format!("{}, which has no column profile", found()))?;
        if profile.next().is_some() {
            return Err("two columns profile".into());
        }
        let position = header::POSITION.columns(&header)?;
        header.check_units(&position)?;
        Ok(Self { n: names.len(), profile: first, position })
    }
}

/// Writes profiles with 17 significant digits, so that reading them gives the same bits.
///
/// # Errors
/// [`ProfileError::Write`]: the writer failed.
pub fn write(profiles: &[Profile], out: &mut dyn Write) -> Result<(), ProfileError> {
    let mut write_all = || -> std::io::Result<()> {
        writeln!(out, "{HEADER}")?;
        for profile in profiles {
            for p in &profile.points {
                writeln!(out, "{},{:.16e},{:.16e},{:.16e}", profile.number, p.x, p.y, p.z)?;
            }
        }
        out.flush()
    };
    write_all().map_err(|error| ProfileError::Write { what: error.to_string() })
}

fn parse_profile(field: &str) -> Option<i64> {
    field.parse().ok().or_else(|| {
        let value = parse_number(field)?;
        // Beyond 2^53 a float does not distinguish neighbouring integers.
        (value.fract() == 0.0 && value.abs() < 9.0e15).then_some(value as i64)
    })
}
