//! Profile files: CSV with the header `profile,x,y,z`, one row a point.
//!
//! Points of a profile stand together and in order along the curve. Nothing here opens a file: the caller hands over the
//! text with its path, for the messages, or a writer.

use std::collections::HashSet;
use std::io::Write;
use std::path::Path;

use glam::DVec3;

use super::{Profile, ProfileError};

const HEADER: &str = "profile,x,y,z";

/// Reads the profiles of one or several files, in the order they stand in.
///
/// - `sources`: path (used in messages only) and text of each file
///
/// Spaces round fields, blank lines, carriage returns and a byte order mark are accepted. An integral number such as
/// `3.0` is accepted as a profile's number, since numerical tools write that.
///
/// # Errors
/// [`ProfileError::Line`] with path and line for a missing header, a row without four numbers, coordinates that are not
/// finite, or a profile that continues after another one or in another file; [`ProfileError::NoProfiles`] when there is
/// not one row.
pub fn parse(sources: &[(&Path, &str)]) -> Result<Vec<Profile>, ProfileError> {
    let mut profiles: Vec<Profile> = Vec::new();
    let mut seen = HashSet::new();
    for &(path, text) in sources {
        let fail = |line: usize, what: String, expected: &'static str| ProfileError::Line {
            path: path.to_path_buf(),
            line: line + 1,
            what,
            expected,
        };
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        match lines.next() {
            None => return Err(fail(0, "the file is empty".into(), "the header profile,x,y,z")),
            Some((line, found)) => {
                let header: Vec<String> = found.split(',').map(|field| field.trim().to_ascii_lowercase()).collect();
                if header.join(",") != HEADER {
                    return Err(fail(line, format!("found '{}'", shorten(found)), "the header profile,x,y,z"));
                }
            }
        }
        // A profile never continues from one file into the next.
        let mut current = None;
        for (line, row) in lines {
            let fields: Vec<&str> = row.split(',').map(str::trim).collect();
            let [number, x, y, z] = fields[..] else {
                return Err(fail(line, format!("{} fields", fields.len()), "four: profile,x,y,z"));
            };
            let Some(number) = parse_number(number) else {
                return Err(fail(line, format!("profile number '{}'", shorten(number)), "an integer"));
            };
            let mut coordinates = [0.0; 3];
            for ((field, axis), coordinate) in [x, y, z].into_iter().zip(["x", "y", "z"]).zip(&mut coordinates) {
                *coordinate = match field.parse::<f64>() {
                    Ok(value) if value.is_finite() => value,
                    _ => return Err(fail(line, format!("{axis} = '{}'", shorten(field)), "a finite number")),
                };
            }
            if current != Some(number) {
                if !seen.insert(number) {
                    let what = format!("profile {number} begins a second time");
                    return Err(fail(line, what, "the points of a profile in consecutive rows of one file"));
                }
                profiles.push(Profile { number, points: Vec::new() });
                current = Some(number);
            }
            if let Some(profile) = profiles.last_mut() {
                profile.points.push(DVec3::from_array(coordinates));
            }
        }
    }
    if profiles.is_empty() { Err(ProfileError::NoProfiles) } else { Ok(profiles) }
}

/// Writes profiles with 17 significant digits, so that reading them gives the same bits.
///
/// # Errors
/// [`ProfileError::Write`] when the writer fails.
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

fn parse_number(field: &str) -> Option<i64> {
    field.parse().ok().or_else(|| {
        let value: f64 = field.parse().ok()?;
        // Beyond 2^53 a float no longer tells neighbouring integers apart.
        (value.fract() == 0.0 && value.abs() < 9.0e15).then_some(value as i64)
    })
}

/// The beginning of a text, for messages.
pub(super) fn shorten(text: &str) -> String {
    const LONGEST: usize = 40;
    if text.chars().count() <= LONGEST {
        text.to_string()
    } else {
        text.chars().take(LONGEST).chain("...".chars()).collect()
    }
}
