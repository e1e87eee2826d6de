//! Paths in a case file. A path is relative to the case file's folder, and its file name may be a
//! pattern.

use std::path::{Path, PathBuf};

use super::CaseError;
use super::document::Value;

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
    // `fits[n]`: the pattern so far fits the first `n` characters of the name. One pass for each
    // character of the pattern takes a time of (length of pattern) (length of name). Trying every
    // run for every `*` would take a time that grows as a power with the number of stars.
    let mut fits = vec![false; name.len() + 1];
    fits[0] = true;
    for &wanted in &pattern {
        let mut before = fits[0];
        fits[0] &= wanted == '*';
        for (end, &letter) in (1..).zip(&name) {
            let here = fits[end];
            fits[end] =
                if wanted == '*' { here || fits[end - 1] } else { before && (wanted == '?' || wanted == letter) };
            before = here;
        }
    }
    fits[name.len()]
}

/// Names among which those that fit a pattern are found without a look at every name, if the
/// pattern begins or ends with letters.
pub(super) struct Names<'n> {
    names: Vec<&'n str>,
    /// Indices of the names in alphabetical order.
    forward: Vec<usize>,
    /// The names with their letters in the opposite order, sorted, with the indices of the names.
    backward: Vec<(String, usize)>,
}

impl<'n> Names<'n> {
    pub fn new(names: impl Iterator<Item = &'n str>) -> Self {
        let names: Vec<&str> = names.collect();
        let mut forward: Vec<usize> = (0..names.len()).collect();
        forward.sort_by_key(|&index| names[index]);
        let mut backward: Vec<(String, usize)> =
            names.iter().enumerate().map(|(index, name)| (name.chars().rev().collect(), index)).collect();
        backward.sort();
        Self { names, forward, backward }
    }

    /// Indices of the names that fit a pattern, or are equal to a text without `*` and `?`,
    /// ascending.
    pub fn fitting(&self, pattern: &str) -> Vec<usize> {
        let is_wild = |letter: char| matches!(letter, '*' | '?');
        let prefix = pattern.split(is_wild).next().unwrap_or_default();
        let suffix: String = pattern.rsplit(is_wild).next().unwrap_or_default().chars().rev().collect();
        // The names with a common beginning stand together.
        let mut fitting: Vec<usize> = if !prefix.is_empty() || suffix.is_empty() {
            let start = self.forward.partition_point(|&index| self.names[index] < prefix);
            let with_prefix = self.forward[start..].iter().copied();
            with_prefix.take_while(|&index| self.names[index].starts_with(prefix)).collect()
        } else {
            let start = self.backward.partition_point(|(name, _)| *name < suffix);
            let with_suffix = self.backward[start..].iter().take_while(|(name, _)| name.starts_with(&suffix));
            with_suffix.map(|&(_, index)| index).collect()
        };
        fitting.retain(|&index| matches(pattern, self.names[index]));
        fitting.sort_unstable();
        fitting
    }
}

#[cfg(test)]
mod tests {
    use super::{Names, matches};

    /// The names that a look at every name finds.
    #[test]
    fn the_names_that_fit_are_found() {
        let names = ["wing", "wing_1", "wing_2", "tip", "left_wing", "", "w", "*", "été", "wing_1x"];
        let all = Names::new(names.into_iter());
        for pattern in ["wing", "wing*", "*wing", "*", "?", "w*g", "*_1*", "??", "", "x", "é*", "*é", "wing_?"] {
            let expected: Vec<usize> = (0..names.len()).filter(|&index| matches(pattern, names[index])).collect();
            assert_eq!(all.fitting(pattern), expected, "{pattern}");
        }
    }

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
