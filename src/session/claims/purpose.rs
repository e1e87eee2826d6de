//! What a folder of claims is for: one case with its files, and one place of the results.
//!
//! Without this record a design that is done for one case would pass for done for another.

use std::path::Path;
use std::thread;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::file;
use crate::formats::{read_file, real_path};
use crate::report::{Checksums, Sums};
use crate::session::checksums::same_files;
use crate::session::files::cannot_write;
use crate::session::{ClaimError, Outputs, SessionError};

/// Name of the record in the folder.
pub(super) const NAME: &str = "claims.json";

/// How often a record is read that is not whole, and the pause between.
const ATTEMPTS: usize = 20;
const PAUSE: Duration = Duration::from_millis(20);

#[derive(Debug, Serialize, Deserialize)]
struct Purpose {
    /// Version of idmesh that made the folder.
    idmesh: String,
    case: Sums,
    mesh: Sums,
    inputs: Sums,
    /// The outputs of the case, to whose names designs add theirs.
    outputs: Vec<String>,
}

/// Says what a folder of claims is for, or checks that it is for this.
///
/// - `case`: checksums of the case's files
/// - `pattern`: the outputs of the case
///
/// # Errors
/// The folder takes no files, is for something else, or its record is damaged.
pub(super) fn check(folder: &Path, case: &Checksums, pattern: &Outputs) -> Result<(), SessionError> {
    let path = folder.join(NAME);
    let outputs = pattern.paths().map(|path| real_path(path).display().to_string()).collect();
    let Checksums { case, mesh, inputs, .. } = case.clone();
    let ours = Purpose { idmesh: env!("CARGO_PKG_VERSION").to_owned(), case, mesh, inputs, outputs };
    let mut text = serde_json::to_string_pretty(&ours)?;
    text.push('\n');
    if file::make(&path, text.as_bytes()).map_err(|error| cannot_write(&path, error))?.is_some() {
        return Ok(());
    }
    let theirs = read(&path).ok_or_else(|| ClaimError::NoPurpose { path: path.clone() })?;
    let other = |what: &str, theirs: String, ours: String| {
        let (theirs, ours) = (format!("{what} {theirs}"), format!("{what} {ours}"));
        Err(ClaimError::OtherBatch { folder: folder.to_path_buf(), theirs, ours }.into())
    };
    let parts = [
        ("the case", &theirs.case, &ours.case),
        ("the mesh", &theirs.mesh, &ours.mesh),
        ("the inputs", &theirs.inputs, &ours.inputs),
    ];
    for (what, theirs, ours) in parts {
        if !same_files(theirs, ours) {
            return other(what, named(theirs), named(ours));
        }
    }
    if theirs.outputs != ours.outputs {
        return other("the outputs", theirs.outputs.join(", "), ours.outputs.join(", "));
    }
    Ok(())
}

/// Reads a record; `None` if it is none. Where a file system has no links, another process may have
/// made the file and not filled it yet.
fn read(path: &Path) -> Option<Purpose> {
    for attempt in 0..ATTEMPTS {
        match serde_json::from_slice(&read_file(path).ok()?) {
            Ok(purpose) => return Some(purpose),
            Err(_) if attempt + 1 < ATTEMPTS => thread::sleep(PAUSE),
            Err(_) => {}
        }
    }
    None
}

/// Files with the beginnings of their checksums.
fn named(sums: &Sums) -> String {
    let of_file = |(path, sum): (&String, &Option<String>)| {
        let sum = sum.as_deref().map_or("unreadable", |sum| sum.get(..12).unwrap_or(sum));
        format!("{path} ({sum})")
    };
    sums.iter().map(of_file).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    /// A record that another process has made and not filled yet is waited for.
    ///
    /// Fails if `ATTEMPTS` is 1.
    #[test]
    fn a_record_that_is_not_filled_yet_is_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        fs::write(&path, "").unwrap();
        thread::scope(|scope| {
            scope.spawn(|| {
                thread::sleep(2 * PAUSE);
                fs::write(&path, r#"{"idmesh": "1", "case": {}, "mesh": {}, "inputs": {}, "outputs": []}"#).unwrap();
            });
            assert!(read(&path).is_some());
        });
    }
}
