//! Checksums of the files that a case and a design consist of, and the check whether the result of
//! an earlier run still belongs to them.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use super::Outputs;
use crate::case::LoadedCase;
use crate::formats::sha256_of;
use crate::report::{Checksums, Sums};

/// Checksums of files. A file that cannot be read has none.
pub(super) fn sums<'p>(paths: impl IntoIterator<Item = &'p Path>) -> Sums {
    paths.into_iter().map(|path| (path.display().to_string(), sha256_of(path).ok())).collect()
}

/// Checksums of a case's files, without those of a design.
pub fn sums_of_case(case: &LoadedCase) -> Checksums {
    let mesh = mesh_files(case);
    let others = case.inputs.iter().filter(|path| **path != case.case.path && **path != case.case.mesh);
    Checksums {
        case: sums([case.case.path.as_path()]),
        mesh: sums(mesh.iter().map(PathBuf::as_path)),
        inputs: sums(others.map(PathBuf::as_path)),
        ..Checksums::default()
    }
}

/// The files of a mesh: the file and the file with its families' names, or the files of its folder.
fn mesh_files(case: &LoadedCase) -> Vec<PathBuf> {
    let mesh = &case.case.mesh;
    if !mesh.is_dir() {
        return std::iter::once(mesh.clone()).chain(case.file.file_beside(mesh)).collect();
    }
    let entries = fs::read_dir(mesh).into_iter().flatten().flatten();
    let mut files: Vec<_> = entries.map(|entry| entry.path()).filter(|path| path.is_file()).collect();
    files.sort();
    files
}

/// Whether two sets of checksums belong to the same inputs. Files are known by their own names, so
/// that the folder from which a run was started does not matter. A file that could not be read
/// agrees with one that cannot be read.
pub(super) fn same_inputs(one: &Checksums, other: &Checksums) -> bool {
    parts(one).iter().zip(parts(other)).all(|(one, other)| same_files(one, other))
}

/// Whether two sets of files have the same names and checksums, wherever the files lie.
pub(super) fn same_files(one: &Sums, other: &Sums) -> bool {
    by_name(one) == by_name(other)
}

/// Whether every input has a checksum.
pub(super) fn has_all_inputs(checksums: &Checksums) -> bool {
    parts(checksums).iter().all(|sums| sums.values().all(Option::is_some))
}

fn parts(sums: &Checksums) -> [&Sums; 4] {
    [&sums.case, &sums.mesh, &sums.inputs, &sums.design]
}

fn by_name(sums: &Sums) -> Vec<(String, Option<&str>)> {
    let mut names: Vec<_> = sums.iter().map(|(path, sum)| (file_name(path), sum.as_deref())).collect();
    names.sort();
    names
}

/// Whether the files of an earlier result are there with their checksums, and are all that this
/// result has.
///
/// - `earlier`: files that were written, with their sums
/// - `is_valid`: whether the earlier result is valid
pub(super) fn same_outputs(earlier: &Sums, outputs: &Outputs, is_valid: bool) -> bool {
    let expected = outputs.names_of(is_valid);
    let names: BTreeSet<String> = earlier.keys().map(|path| file_name(path)).collect();
    // The result may have been written into another folder, and moved with its report.
    let folders: BTreeSet<&Path> = expected.iter().filter_map(|path| path.parent()).collect();
    let is_there = |(path, sum): (&String, &Option<String>)| {
        let name = file_name(path);
        sum.is_some() && folders.iter().any(|folder| sha256_of(&folder.join(&name)).ok() == *sum)
    };
    expected.iter().all(|path| names.contains(&file_name(&path.to_string_lossy()))) && earlier.iter().all(is_there)
}

fn file_name(path: &str) -> String {
    Path::new(path).file_name().unwrap_or_default().to_string_lossy().into_owned()
}
