//! Reads the text file with the designs of a batch.

use std::path::{Path, PathBuf};

use super::paths::folder_of;

/// Returns the files in a list. A line holds one path, relative to the list's folder, or to the
/// working folder if the list is a pipe. A comment begins with `#`.
///
/// - `path`: the list's path
pub fn parse(text: &str, path: &Path) -> Vec<PathBuf> {
    let folder = folder_of(path);
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default().trim());
    lines.filter(|line| !line.is_empty()).map(|line| folder.join(line)).collect()
}
