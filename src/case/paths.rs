//! Paths in a case file. A path is relative to the case file's folder, and its file name may be a
//! pattern. See [`super::names`] for patterns of families.

use std::path::{Path, PathBuf};

use super::CaseError;
use super::document::Value;
use crate::formats::is_special;

/// The folder to which the paths in a file are relative: the file's own. A pipe or a device has no
/// folder with other files, so there it is the working folder.
pub(crate) fn folder_of(path: &Path) -> &Path {
    let folder = if is_special(path) { None } else { path.parent() };
    folder.unwrap_or(Path::new(""))
}

/// Whether a path ends in an extension, in any case of letters.
pub(crate) fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|own| own.eq_ignore_ascii_case(extension))
}

/// The file that a value names.
pub(super) fn file(value: &Value, folder: &Path) -> Result<PathBuf, CaseError> {
    Ok(folder.join(value.text()?))
}

/// The files that a value names. The value is a path, a pattern, or a list of both. The files of a
/// pattern are sorted by name.
pub(super) fn files(value: &Value, folder: &Path) -> Result<Vec<PathBuf>, CaseError> {
    let mut files = Vec::new();
    for entry in value.texts()? {
        let text = entry.text()?;
        if is_pattern(text) { expand(&entry, text, folder, &mut files)? } else { files.push(folder.join(text)) }
    }
    Ok(files)
}

fn expand(value: &Value, text: &str, folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), CaseError> {
    let whole = folder.join(text);
    let (Some(parent), Some(pattern)) = (whole.parent(), whole.file_name().and_then(|name| name.to_str())) else {
        return Err(value.error(format!("pattern \"{text}\" has no file name")));
    };
    if Path::new(text).parent().is_some_and(|parent| parent.to_string_lossy().contains(['*', '?'])) {
        return Err(value.error(format!("pattern \"{text}\": `*` and `?` are understood in the file name only")));
    }
    let here = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
    let entries = std::fs::read_dir(here)
        .map_err(|error| value.error(format!("pattern \"{text}\": cannot list {}: {error}", here.display())))?;
    let mut names: Vec<_> = entries
        .filter_map(Result::ok)
        .filter(|entry| !entry.path().is_dir())
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| matches(pattern, name))
        .collect();
    if names.is_empty() {
        return Err(value.error(format!("pattern \"{text}\" matches no file in {}", here.display())));
    }
    names.sort();
    files.extend(names.into_iter().map(|name| parent.join(name)));
    Ok(())
}

/// Whether a text is a pattern, with `*` or `?`.
pub(super) fn is_pattern(text: &str) -> bool {
    text.contains(['*', '?'])
}

/// Whether a name fits a pattern. `*` stands for any run of characters, `?` for any one character.
/// As in a shell, neither stands for a leading dot.
///
/// The crate globset 0.4 does not tell: its `?` is one byte, so that it does not fit `é`, and
/// brackets and braces, which names of families may have, mean something else to it.
pub(super) fn matches(pattern: &str, name: &str) -> bool {
    if name.starts_with('.') && !pattern.starts_with('.') {
        return false;
    }
    let pattern: Vec<char> = pattern.chars().collect();
    let name: Vec<char> = name.chars().collect();
    // The places after the last star, in the pattern and in the name. Where the rest does not fit,
    // this star takes one letter more; the ones before it need not. So the time is at most
    // (length of pattern) (length of name). Trying every run for every star would take a time that
    // grows as a power with the number of stars.
    let mut last_star: Option<(usize, usize)> = None;
    let (mut at, mut end) = (0, 0);
    while end < name.len() {
        match pattern.get(at) {
            Some('*') => {
                at += 1;
                last_star = Some((at, end));
            }
            Some(&wanted) if wanted == '?' || wanted == name[end] => (at, end) = (at + 1, end + 1),
            _ => match last_star {
                Some((after, from)) => {
                    last_star = Some((after, from + 1));
                    (at, end) = (after, from + 1);
                }
                None => return false,
            },
        }
    }
    pattern[at..].iter().all(|&wanted| wanted == '*')
}
#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn patterns_match_whole_names() {
        assert!(matches("*.dat", "section_1.dat"));
        assert!(matches("s?.dat", "s1.dat"));
        assert!(matches("*_*", "a_b_c"));
        assert!(!matches("s?.dat", "s10.dat"));
        assert!(!matches("*.dat", "section.data"));
        assert!(!matches("*.dat", ".hidden.dat"));
        assert!(matches("", "") && matches("**", "") && matches("*", "a") && matches(".*", ".hidden"));
        assert!(matches("w?ng", "wéng") && matches("tip[1]", "tip[1]") && matches("{a,b}*", "{a,b}c"));
        assert!(
            matches("*a*ab", "aaab")
                && matches("*?b*", "ab")
                && matches("a**b?", "ab*")
                && matches("*\u{e9}?", "x\u{e9}y")
        );
        assert!(!matches("*a*ab", "aaba") && !matches("a*?", "a") && !matches("*ab*ab", "ab"));
        assert!(!matches("?", "") && !matches("", "a") && !matches("a", "ab") && !matches("*a", "ab"));
    }

    /// Trying every run for every star would take longer than any test may.
    #[test]
    fn many_stars_do_not_hang() {
        let name = "a".repeat(200);
        assert!(matches(&"*a".repeat(40), &name));
        assert!(!matches(&("*a".repeat(40) + "*b"), &name));
    }
}
