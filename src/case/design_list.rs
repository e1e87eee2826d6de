//! The text file that names the designs of a batch.

use std::path::{Path, PathBuf};

/// The files that a list names, one a line, relative to the list at `path`; from `#` on a line is a
/// comment.
pub fn parse(text: &str, path: &Path) -> Vec<PathBuf> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default().trim());
    lines.filter(|line| !line.is_empty()).map(|line| folder.join(line)).collect()
}
