//! [`shell_word`]: a path as a user types it in a shell.

use std::fmt::Display;

use super::shown;

/// A path as one word of a command line, in quotes where a shell would take it apart. A path that
/// begins with `-` begins with `./-`, so that no command takes it for an option. Characters that a
/// terminal obeys stand as escapes, as [`shown`] writes them.
pub fn shell_word(path: impl Display) -> String {
    let mut word = shown(path).to_string();
    if word.starts_with('-') {
        word.insert_str(0, "./");
    }
    let is_plain = |letter: char| letter.is_alphanumeric() || "/._-+,:@%".contains(letter);
    if word.chars().all(is_plain) && !word.is_empty() { word } else { format!("'{}'", word.replace('\'', r"'\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A shell makes the path of the word again.
    #[test]
    #[cfg(unix)]
    fn a_shell_takes_it_for_one_word() {
        for path in ["case.toml", "my case & co/case.toml", "it's/$HOME/`ls`/\"a\"", "~/a", "Flügel*?", "a;b|c>d", ""]
        {
            let line = format!("printf %s {}", shell_word(path));
            let output = std::process::Command::new("sh").args(["-c", &line]).output().unwrap();
            assert_eq!(String::from_utf8_lossy(&output.stdout), path, "{line}");
        }
        for (path, expected) in [("a/b_1.toml", "a/b_1.toml"), ("-x/case.toml", "./-x/case.toml"), ("-a b", "'./-a b'")]
        {
            assert_eq!(shell_word(path), expected);
        }
    }
}
