//! Reads the profiles of one or several files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::load_error::LoadError;
use crate::formats::{read_lines, read_named};
use crate::profile::{Profile, ProfileError, csv, files, files::Placement};
use crate::text::decode;

/// Reads the profiles of a file (CSV, Tecplot, or slices of a surface), in the mesh's unit. Airfoil
/// files have no place in space and need a case file with a placement.
///
/// # Errors
/// The file cannot be read, or its profiles are wrong. The message names the file and the line.
pub fn read_profiles(path: impl AsRef<Path>) -> Result<Vec<Profile>, LoadError> {
    profiles_of(&[path.as_ref().to_path_buf()], &BTreeMap::new())
}

/// Reads the profiles of several files, in the mesh's unit.
///
/// - `placements`: the placements of the airfoil in each file without units
///
/// # Errors
/// A file cannot be read, or its profiles are wrong.
pub(crate) fn profiles_of(
    paths: &[PathBuf],
    placements: &BTreeMap<PathBuf, Vec<Placement>>,
) -> Result<Vec<Profile>, LoadError> {
    if paths.iter().all(|path| files::is_csv(path) && !placements.contains_key(path)) {
        return profiles_of_tables(paths);
    }
    let mut contents = Vec::new();
    for path in paths {
        let bytes = read_named(path).map_err(|source| LoadError::UnreadableProfiles { path: path.clone(), source })?;
        contents.push(bytes);
    }
    let source =
        |(path, bytes)| files::Source { path, bytes, placements: placements.get(path).map_or(&[], Vec::as_slice) };
    let sources: Vec<_> =
        paths.iter().map(PathBuf::as_path).zip(contents.iter().map(Vec::as_slice)).map(source).collect();
    files::parse(&sources).map_err(|error| in_files(paths, error))
}

/// [`profiles_of`] for tables. A table may be several times as large as its profiles, so it is read
/// in pieces.
fn profiles_of_tables(paths: &[PathBuf]) -> Result<Vec<Profile>, LoadError> {
    let mut reader = csv::Reader::default();
    for path in paths {
        reader.begin(path);
        let unreadable = |source| LoadError::UnreadableProfiles { path: path.clone(), source };
        read_lines(path, unreadable, |piece| reader.add(&decode(piece)).map_err(|error| in_files(paths, error)))?;
        reader.end().map_err(|error| in_files(paths, error))?;
    }
    reader.profiles().map_err(|error| in_files(paths, error))
}

/// Adds the names of the files to an error that names no file.
fn in_files(paths: &[PathBuf], error: ProfileError) -> LoadError {
    match error {
        error @ (ProfileError::Line { .. } | ProfileError::File { .. } | ProfileError::NoPlacement { .. }) => {
            LoadError::ProfileFile(error)
        }
        error => LoadError::ProfileFiles { paths: paths.to_vec(), error },
    }
}

/// The error of profiles of several files, with the file of the profile at fault.
pub(super) fn at_fault(
    paths: &[PathBuf],
    placements: &BTreeMap<PathBuf, Vec<Placement>>,
    wing: String,
    error: ProfileError,
) -> LoadError {
    let first = |number| {
        let has = |n: usize| {
            profiles_of(&paths[..n], placements).is_ok_and(|read| read.iter().any(|profile| profile.number == number))
        };
        // Files are numbered in their order, so the first files that hold the number end with its
        // file.
        let (mut without, mut with) = (0, paths.len());
        while with - without > 1 {
            let middle = usize::midpoint(without, with);
            if has(middle) { with = middle } else { without = middle }
        }
        vec![paths[with - 1].clone()]
    };
    let paths = error.profile().map_or_else(|| paths.to_vec(), first);
    LoadError::Profiles { paths, wing, error }
}
