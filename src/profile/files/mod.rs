//! Profile files in the formats of other programs, recognised by extension: CSV, airfoil
//! coordinates, Tecplot zones, JSON, and polylines of VTK.
//!
//! CSV and JSON number their profiles. Profiles of the other formats are numbered from 0, in the
//! order of the files and of the curves in them. This module opens no file: the caller passes
//! contents, and paths for messages.

mod airfoil;
mod airfoil_rows;
mod around;
mod chain;
mod json;
mod sides;
mod tecplot;

use std::borrow::Cow;
use std::collections::HashSet;
use std::path::Path;

use glam::DVec3;

pub use airfoil::{Placement, SpanAxis};

use super::{Profile, ProfileError, csv};
use crate::formats::read_polylines;
use crate::text::{decode, parse_number, shorten};

/// The extensions of profile files in a folder.
pub const EXTENSIONS: &[&str] = &["csv", "dat", "tec", "plt", "txt", "json", "vtp", "vtk"];

/// A profile file.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// Path of the file. Its extension selects the format, and messages name it.
    pub path: &'a Path,
    /// Contents of the file.
    pub bytes: &'a [u8],
    /// Placements in space, for a file of airfoil coordinates. Each makes a profile.
    pub placements: &'a [Placement],
}

/// Whether a file is read as [`csv`], as its extension says.
pub(crate) fn is_csv(path: &Path) -> bool {
    !matches!(&*extension(path), "json" | "vtp" | "vtk" | "dat" | "tec" | "plt" | "txt")
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

impl Source<'_> {
    /// The contents as UTF-8, which JSON requires.
    fn utf8(&self) -> Result<&str, ProfileError> {
        std::str::from_utf8(self.bytes).map_err(|error| {
            let before = &self.bytes[..error.valid_up_to()];
            let line = before.iter().filter(|&&byte| byte == b'\n').count();
            fail(self.path, line, "bytes that are no text".into(), "a text file in UTF-8")
        })
    }
}

/// Reads the profiles of one or several files, which may differ in format, in their order.
///
/// | extension | contents |
/// |---|---|
/// | `.csv`, and any other extension | [`csv`] |
/// | `.dat`, `.tec`, `.plt`, `.txt` | Tecplot zones if the file has any; otherwise, or in zones without z, the coordinates of one airfoil in Selig's or Lednicer's order, placed in space by each [`Placement`] |
/// | `.json` | `[{"profile": 0, "points": [[x, y, z], ...]}, ...]` |
/// | `.vtp`, `.vtk` | polylines, each connected one is a profile |
///
/// # Errors
/// - [`ProfileError::Line`] with path and line
/// - [`ProfileError::File`]: a file cannot be read in its format
/// - [`ProfileError::NoPlacement`]: an airfoil has no placement
/// - [`ProfileError::Doubled`]: two profiles have one number
/// - [`ProfileError::NoProfiles`]
pub fn parse(sources: &[Source]) -> Result<Vec<Profile>, ProfileError> {
    let texts: Vec<Cow<str>> = sources.iter().map(|source| decode(source.bytes)).collect();
    let kinds: Vec<Kind> = sources.iter().zip(&texts).map(|(source, text)| Kind::of(source, text)).collect();
    let all = || sources.iter().zip(&texts).zip(&kinds).map(|((source, text), &kind)| (source, &**text, kind));
    if let Some((source, ..)) = all().find(|(source, _, kind)| !source.placements.is_empty() && *kind != Kind::Airfoil)
    {
        let what = "a placement is given, but the file says itself where its profiles are".to_string();
        return Err(fail(source.path, 0, what, "none, or a file with the coordinates of one airfoil"));
    }
    if kinds.iter().all(|&kind| kind == Kind::Csv) {
        return csv::parse(&all().map(|(source, text, _)| (source.path, text)).collect::<Vec<_>>());
    }
    let mut profiles: Vec<Profile> = Vec::new();
    for (source, text, kind) in all() {
        let curves = match kind {
            Kind::Csv => {
                profiles.extend(csv::parse(&[(source.path, text)])?);
                continue;
            }
            Kind::Json => {
                profiles.extend(json::parse(source.path, source.utf8()?)?);
                continue;
            }
            Kind::Polylines => polylines(source)?,
            Kind::Tecplot => tecplot::parse(source.path, text)?.into_iter().map(|curve| curve.points).collect(),
            Kind::Airfoil => {
                let airfoil = match tecplot::is_tecplot(text) {
                    true => airfoil::of_curves(source.path, &tecplot::parse(source.path, text)?)?,
                    false => airfoil::parse(source.path, text)?,
                };
                if source.placements.is_empty() {
                    return Err(ProfileError::NoPlacement { path: source.path.to_path_buf() });
                }
                let place = |by: &Placement| airfoil.iter().map(|&point| by.place(point)).collect();
                source.placements.iter().map(place).collect()
            }
        };
        let first = profiles.len() as i64;
        profiles.extend((first..).zip(curves).map(|(number, points)| Profile { number, points }));
    }
    let mut seen = HashSet::new();
    if let Some(doubled) = profiles.iter().find(|profile| !seen.insert(profile.number)) {
        return Err(ProfileError::Doubled { profile: doubled.number });
    }
    if profiles.is_empty() { Err(ProfileError::NoProfiles) } else { Ok(profiles) }
}

/// The format of a file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Csv,
    Json,
    Polylines,
    Tecplot,
    Airfoil,
}

impl Kind {
    fn of(source: &Source, text: &str) -> Self {
        match &*extension(source.path) {
            _ if is_csv(source.path) => Kind::Csv,
            "json" => Kind::Json,
            "vtp" | "vtk" => Kind::Polylines,
            _ if tecplot::is_tecplot(text) && !tecplot::is_plane(text) => Kind::Tecplot,
            _ => Kind::Airfoil,
        }
    }
}

/// The connected polylines of a VTK file.
fn polylines(source: &Source) -> Result<Vec<Vec<DVec3>>, ProfileError> {
    let what = |error: &dyn std::fmt::Display| ProfileError::File { what: error.to_string() };
    let lines = read_polylines(source.path, source.bytes).map_err(|error| what(&error))?;
    let segments: Vec<[usize; 2]> =
        lines.lines.iter().flat_map(|line| line.windows(2).map(|pair| [pair[0] as usize, pair[1] as usize])).collect();
    let chains = chain::chains(lines.points.len(), &segments).map_err(|point| {
        let at = lines.points[point];
        ProfileError::File { what: format!("{}: more than two lines meet at {at}", source.path.display()) }
    })?;
    Ok(chains.into_iter().map(|chain| chain.into_iter().map(|point| lines.points[point]).collect()).collect())
}

/// The error of a line; `line` counts from 0.
fn fail(path: &Path, line: usize, what: String, expected: &'static str) -> ProfileError {
    ProfileError::Line { path: path.to_path_buf(), line: line + 1, what, expected }
}

/// A finite number.
///
/// # Errors
/// [`ProfileError::Line`]
fn number(path: &Path, line: usize, word: &str) -> Result<f64, ProfileError> {
    match parse_number(word) {
        Some(value) if value.is_finite() => Ok(value),
        _ => Err(fail(path, line, format!("found '{}'", shorten(word)), "a finite number")),
    }
}
