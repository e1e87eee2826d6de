//! The designs of a batch: the files of a folder or of a list, and the share of them that a job of an array takes.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::failure::Failure;
use crate::case::design_list;
use crate::text::decode;

/// A design's file, and the name its results get.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct DesignFile {
    /// The file's name without its extension.
    pub(super) name: String,
    pub(super) path: PathBuf,
}

/// `I/N`: every N-th design, from the I-th on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shard {
    first: usize,
    of: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(first, of)| Some((first.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((first, of)) if (1..=of).contains(&first) => Ok(Self { first, of }),
            _ => Err("expected I/N with I from 1 to N, such as 3/10".to_owned()),
        }
    }
}

impl Shard {
    /// The designs of this share, in order.
    pub(super) fn take<T>(self, all: Vec<T>) -> Vec<T> {
        all.into_iter().skip(self.first - 1).step_by(self.of).collect()
    }
}

/// The files with one of some extensions in a folder, sorted by name; or those that a text file names, one a line, relative
/// to it, with comments from `#` on.
///
/// # Errors
/// It cannot be read, names none, or two with the same name before their extensions.
pub(super) fn find(path: &Path, extensions: &[&str]) -> Result<Vec<DesignFile>, Failure> {
    let cannot_read = |error| Failure::bad_input(format!("cannot read the designs {}: {error}", path.display()));
    let paths = if path.is_dir() {
        let entries = fs::read_dir(path).and_then(|entries| entries.collect::<Result<Vec<_>, _>>());
        let mut paths: Vec<_> = entries.map_err(cannot_read)?.into_iter().map(|entry| entry.path()).collect();
        paths.retain(|path| is_design(path, extensions));
        paths.sort();
        paths
    } else {
        design_list::parse(&decode(&fs::read(path).map_err(cannot_read)?), path)
    };
    if paths.is_empty() {
        return Err(Failure::bad_input(format!("{}: no designs, expected at least one", path.display())));
    }
    let mut seen: BTreeMap<String, PathBuf> = BTreeMap::new();
    let mut designs = Vec::new();
    for path in paths {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if let Some(other) = seen.insert(name.clone(), path.clone()) {
            return Err(Failure::bad_input(format!(
                "the results of {} and {} would both be named {name}, expected different names",
                other.display(),
                path.display()
            )));
        }
        designs.push(DesignFile { name, path });
    }
    Ok(designs)
}

fn is_design(path: &Path, extensions: &[&str]) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    !hidden && path.is_file() && extensions.iter().any(|other| extension.eq_ignore_ascii_case(other))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_numbered_from_one() {
        for wrong in ["0/3", "4/3", "1", "1/0", "a/b", "-1/2", "1/2/3"] {
            assert!(Shard::from_str(wrong).is_err(), "{wrong}");
        }
        let share = |text: &str| Shard::from_str(text).unwrap().take((1..=7).collect());
        assert_eq!(share("1/3"), [1, 4, 7]);
        assert_eq!(share("3/3"), [3, 6]);
        assert_eq!(share("9/9"), [] as [i32; 0]);
    }
}
