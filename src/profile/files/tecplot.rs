//! Sections as Tecplot zones in ASCII: ordered points (`I=`) or line segments (`FELINESEG`). Flow
//! solvers write slices in this form. Without z among the variables the zones are one airfoil.
//!
//! Source: the Tecplot 360 data format guide, "ASCII data".

use std::iter::Peekable;
use std::path::Path;

use glam::DVec3;

use super::{chain, fail, number};
use crate::profile::ProfileError;
use crate::text::header::{Header, POSITION};
use crate::text::{Mark, parse_number, rows, shorten};

/// Whether a text is in Tecplot's format and no list of airfoil coordinates.
pub(super) fn is_tecplot(text: &str) -> bool {
    // A title of an airfoil may begin with the word too, as in `Zone 21 for thick wings`.
    let is_header = |line: &str, keyword: &str| {
        begins(line, keyword) && (line.contains(['=', '"']) || line.trim().len() == keyword.len())
    };
    text.lines().any(|line| is_header(line, "ZONE") || is_header(line, "VARIABLES"))
}

fn begins(line: &str, keyword: &str) -> bool {
    let line = line.trim_start();
    let after = line.get(keyword.len()..).and_then(|rest| rest.chars().next());
    line.get(..keyword.len()).is_some_and(|start| start.eq_ignore_ascii_case(keyword))
        && after.is_none_or(|letter| !letter.is_alphanumeric())
}

/// The header of a zone.
#[derive(Default)]
struct Zone {
    line: usize,
    n_points: Option<usize>,
    n_segments: usize,
    segments: bool,
    block: bool,
}

/// Whether the zones are in a plane: x and y are among their variables, and z is not.
pub(super) fn is_plane(text: &str) -> bool {
    let mut lines = lines(text).peekable();
    while let Some((_, row)) = lines.next() {
        if begins(row, "VARIABLES") {
            return Variables::of(&whole_header(row, &mut lines)).is_ok_and(|variables| variables.z.is_none());
        }
    }
    false
}

/// The lines of a text with their numbers, without comments.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    rows(text, Mark::Hash).map(|row| (row.line, row.text))
}

/// A header, which continues until a line of numbers or the next keyword.
fn whole_header<'a>(first: &str, lines: &mut Peekable<impl Iterator<Item = (usize, &'a str)>>) -> String {
    let mut header = first.to_string();
    while let Some((_, next)) = lines.next_if(|(_, next)| continues(next)) {
        header += " ";
        header += next;
    }
    header
}

/// A curve of a zone.
pub(super) struct Curve {
    /// The line of the zone, from 0.
    pub line: usize,
    /// Its points. Without z among the variables z is 0.
    pub points: Vec<DVec3>,
}

/// Reads the curves of all zones, in their order. A zone of segments may hold several curves.
///
/// # Errors
/// [`ProfileError::Line`], [`ProfileError::File`]
pub(super) fn parse(path: &Path, text: &str) -> Result<Vec<Curve>, ProfileError> {
    let mut variables = Variables::DEFAULT;
    let mut curves = Vec::new();
    let mut lines = lines(text).peekable();
    while let Some((line, row)) = lines.next() {
        if row.is_empty() {
            continue;
        }
        let header = whole_header(row, &mut lines);
        if begins(&header, "TITLE") || begins(&header, "FILETYPE") || begins(&header, "DATASETAUXDATA") {
            continue;
        }
        if begins(&header, "VARIABLES") {
            let bad = |what| fail(path, line, what, "x, y and z among the variables, or x and y of an airfoil");
            variables = Variables::of(&header).map_err(bad)?;
            continue;
        }
        if !begins(&header, "ZONE") {
            return Err(fail(path, line, format!("found '{}'", shorten(row)), "TITLE, VARIABLES or ZONE"));
        }
        let n_variables = variables.n;
        let zone = Zone::parse(path, line, &header)?;
        let Some(n_points) = zone.n_points else {
            return Err(fail(path, line, "a zone without I= or N=".into(), "the number of its points"));
        };
        // Every value takes at least two bytes of the text.
        let n_values = n_points.saturating_mul(n_variables).saturating_add(2 * zone.n_segments);
        if n_values > text.len() {
            return Err(fail(path, line, format!("a zone of {n_values} values"), "no more than the file can hold"));
        }
        let mut words = Vec::with_capacity(n_values);
        let mut last = line;
        while words.len() < n_values {
            let Some((line, row)) = lines.next_if(|(_, row)| !begins(row, "ZONE")) else {
                let what = format!("{} of {n_values} values of the zone in line {}", words.len(), zone.line + 1);
                return Err(fail(path, last, what, "all values of the zone"));
            };
            last = line;
            words.extend(row.split([' ', '\t', ',']).filter(|word| !word.is_empty()).map(|word| (line, word)));
        }
        if words.len() > n_values {
            return Err(fail(path, last, "more values than the zone has".into(), "I= or N= to count its points"));
        }
        let value = |place: usize| number(path, words[place].0, words[place].1);
        let mut points = Vec::with_capacity(n_points);
        for point in 0..n_points {
            let of = |axis: usize| value(if zone.block { axis * n_points + point } else { point * n_variables + axis });
            let [x, y] = variables.xy;
            points.push(DVec3::new(of(x)?, of(y)?, variables.z.map_or(Ok(0.0), of)?));
        }
        if !zone.segments {
            curves.push(Curve { line, points });
            continue;
        }
        let mut segments = Vec::with_capacity(zone.n_segments);
        for place in (n_points * n_variables..n_values).step_by(2) {
            let mut ends = [0; 2];
            for (end, &(line, word)) in ends.iter_mut().zip(&words[place..]) {
                let point = word.parse::<usize>().ok().filter(|point| (1..=n_points).contains(point));
                let what = || format!("found '{}' among {n_points} points", shorten(word));
                *end = point.ok_or_else(|| fail(path, line, what(), "the number of a point, from 1"))? - 1;
            }
            segments.push(ends);
        }
        let chains = chain::chains(n_points, &segments).map_err(|point| {
            fail(path, line, format!("more than two segments meet at point {}", point + 1), "curves that do not branch")
        })?;
        let points_of = |chain: Vec<usize>| chain.into_iter().map(|point| points[point]).collect();
        curves.extend(chains.into_iter().map(|chain| Curve { line, points: points_of(chain) }));
    }
    Ok(curves)
}

/// Whether a line continues a header: it is no row of numbers and begins with no keyword.
fn continues(line: &str) -> bool {
    let first = line.split([' ', '\t', ',']).find(|word| !word.is_empty()).unwrap_or_default();
    !first.is_empty()
        && parse_number(first).is_none()
        && !["ZONE", "VARIABLES", "TITLE"].iter().any(|keyword| begins(line, keyword))
}

/// The number of variables, and those of the coordinates.
struct Variables {
    n: usize,
    xy: [usize; 2],
    z: Option<usize>,
}

impl Variables {
    /// The variables of a file that does not name them.
    const DEFAULT: Self = Self { n: 3, xy: [0, 1], z: Some(2) };

    /// The variables that a header names, as columns of tables are named. The error is the fault of
    /// the header.
    fn of(header: &str) -> Result<Self, String> {
        let list = header.split_once('=').map_or("", |(_, list)| list);
        let is_quoted = list.contains('"');
        let names: Vec<&str> = match is_quoted {
            true => list.split('"').skip(1).step_by(2).map(str::trim).collect(),
            false => list.split([',', ' ', '\t']).filter(|name| !name.is_empty()).collect(),
        };
        let header = Header::of(&names);
        if is_quoted && header.names.len() != names.len() {
            return Err("a variable with a unit and no name".to_owned());
        }
        let columns = match POSITION.has(&header, 2) {
            true => POSITION.columns(&header)?.to_vec(),
            false => POSITION.first_columns::<2>(&header)?.to_vec(),
        };
        header.check_units(&columns)?;
        Ok(Self { n: header.names.len(), xy: [columns[0], columns[1]], z: columns.get(2).copied() })
    }
}

impl Zone {
    fn parse(path: &Path, line: usize, header: &str) -> Result<Self, ProfileError> {
        let mut zone = Zone { line, ..Zone::default() };
        // Titles may hold any text, so text inside quotes is removed.
        let plain: String = header.split('"').step_by(2).collect::<Vec<_>>().join(" ");
        let plain = plain.to_ascii_uppercase().replace(',', " ").replace('=', " = ");
        let words: Vec<&str> = plain.split_ascii_whitespace().collect();
        for place in 1..words.len().saturating_sub(1) {
            if words[place] != "=" {
                continue;
            }
            let (key, value) = (words[place - 1], words[place + 1]);
            let count = || {
                let count = value.parse::<usize>();
                count.map_err(|_| fail(path, line, format!("{key}={value}"), "a whole number"))
            };
            match key {
                "I" | "N" | "NODES" => zone.n_points = Some(count()?),
                "J" | "K" if count()? != 1 => {
                    return Err(fail(path, line, format!("{key}={value}"), "a zone that is a curve"));
                }
                "E" | "ELEMENTS" => zone.n_segments = count()?,
                "ZONETYPE" | "ET" => match value {
                    "ORDERED" => {}
                    "FELINESEG" | "LINESEG" => zone.segments = true,
                    _ => return Err(fail(path, line, format!("{key}={value}"), "ORDERED or FELINESEG")),
                },
                "DATAPACKING" | "F" => zone.block = value.ends_with("BLOCK"),
                _ => {}
            }
        }
        if !zone.segments {
            zone.n_segments = 0;
        }
        Ok(zone)
    }
}
