//! Text of files, arguments and devices as it may be shown.
//!
//! A name may hold characters that a terminal obeys, that turn the order of letters around, or that
//! begin a second line of a message. They are shown as escapes, such as `\n`, `\x1b` or `\u{202e}`.
//! A backslash is shown as itself, so an escaped text stays as it is when it is escaped again.

use std::fmt::{self, Display, Write};

/// Most characters of a cell of a table.
const WIDEST: usize = 40;

/// Stands for the characters that are left out.
const LEFT_OUT: &str = "...";

/// Whether a character is not shown as itself: control characters (C0, C1 and delete), characters
/// of format, separators of lines and paragraphs, and those that XML excludes.
fn is_obeyed(letter: char) -> bool {
    let separates = matches!(letter, '\u{2028}' | '\u{2029}');
    letter.is_control() || is_format(letter) || separates || matches!(letter, '\u{fffe}' | '\u{ffff}')
}

/// Whether a character is one of format (general category Cf of Unicode 16). Some set the direction
/// of text, others have no width, so that two names look alike, and tags hide whole texts. The
/// whole block of tags counts, and the place between the two blocks of general punctuation that
/// Unicode reserves for such characters.
fn is_format(letter: char) -> bool {
    matches!(
        letter,
        '\u{ad}'
            | '\u{600}'..='\u{605}'
            | '\u{61c}'
            | '\u{6dd}'
            | '\u{70f}'
            | '\u{890}'..='\u{891}'
            | '\u{8e2}'
            | '\u{180e}'
            | '\u{200b}'..='\u{200f}'
            | '\u{202a}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}'
            | '\u{feff}'
            | '\u{fff9}'..='\u{fffb}'
            | '\u{110bd}'
            | '\u{110cd}'
            | '\u{13430}'..='\u{1343f}'
            | '\u{1bca0}'..='\u{1bca3}'
            | '\u{1d173}'..='\u{1d17a}'
            | '\u{e0000}'..='\u{e007f}'
    )
}

/// A text that is shown in one line.
pub(crate) struct Shown<T> {
    text: T,
    kept: &'static [char],
}

/// A text in one line, with escapes for all characters that are not shown as themselves.
pub(crate) fn shown<T: Display>(text: T) -> Shown<T> {
    Shown { text, kept: &[] }
}

/// Lines of a table or a manual: as [`shown`], but ends of lines and tabs stay.
pub(crate) fn shown_lines<T: Display>(text: T) -> Shown<T> {
    Shown { text, kept: &['\n', '\t'] }
}

impl<T: Display> Display for Shown<T> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let escape = |out: &mut dyn Write, letter: char| match letter {
            '\n' => out.write_str("\\n"),
            '\r' => out.write_str("\\r"),
            '\t' => out.write_str("\\t"),
            _ if letter <= '\u{ff}' => write!(out, "\\x{:02x}", u32::from(letter)),
            _ => write!(out, "\\u{{{:x}}}", u32::from(letter)),
        };
        write!(Escaping { out: f, kept: self.kept, escape }, "{}", self.text)
    }
}

/// JSON with escapes of JSON for all characters that are not shown as themselves, ends of lines
/// excepted. Its values stay the same, because such characters stand only in strings.
pub(crate) fn shown_json(json: &str) -> String {
    // JSON writes a character beyond U+FFFF as two halves.
    let escape = |out: &mut dyn Write, letter: char| {
        letter.encode_utf16(&mut [0; 2]).iter().try_for_each(|half| write!(out, "\\u{half:04x}"))
    };
    let mut text = String::with_capacity(json.len());
    // Writing to a string cannot fail.
    let _ = Escaping { out: &mut text, kept: &['\n'], escape }.write_str(json);
    text
}

/// Passes text on, with the characters that are neither shown as themselves nor kept escaped.
struct Escaping<'a, E> {
    out: &'a mut dyn Write,
    kept: &'static [char],
    escape: E,
}

impl<E: Fn(&mut dyn Write, char) -> fmt::Result> Write for Escaping<'_, E> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut written = 0;
        for (at, letter) in text.char_indices() {
            if is_obeyed(letter) && !self.kept.contains(&letter) {
                self.out.write_str(&text[written..at])?;
                (self.escape)(self.out, letter)?;
                written = at + letter.len_utf8();
            }
        }
        self.out.write_str(&text[written..])
    }
}

/// At most the first 40 characters of a text, for messages, in one line.
pub(crate) fn shorten(text: &str) -> String {
    match text.char_indices().nth(WIDEST) {
        None => shown(text).to_string(),
        Some((end, _)) => format!("{}{LEFT_OUT}", shown(&text[..end])),
    }
}

/// A cell of a table: one line of at most 40 characters. Of a longer text the beginning and the end
/// are shown, because long names often differ at the end alone.
pub(crate) fn cell(text: &str) -> String {
    let letters: Vec<char> = shown(text).to_string().chars().collect();
    if letters.len() <= WIDEST {
        return letters.into_iter().collect();
    }
    let end = (WIDEST - LEFT_OUT.len()) / 2;
    let begin = WIDEST - LEFT_OUT.len() - end;
    let (first, last) = (&letters[..begin], &letters[letters.len() - end..]);
    first.iter().copied().chain(LEFT_OUT.chars()).chain(last.iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_escaped() {
        for (text, expected) in [
            ("wing", "wing"),
            ("a\\b \u{e9}\u{4e2d}\u{fffd}", "a\\b \u{e9}\u{4e2d}\u{fffd}"),
            ("\x1b[31m\x07", "\\x1b[31m\\x07"),
            ("a\nerror: b\r\tc\0", "a\\nerror: b\\r\\tc\\x00"),
            ("\x7f\u{80}\u{9b}31m\u{9f}\u{a0}", "\\x7f\\x80\\x9b31m\\x9f\u{a0}"),
            ("\u{202a}\u{202e}\u{2066}\u{2069}", "\\u{202a}\\u{202e}\\u{2066}\\u{2069}"),
            ("\u{2028}\u{2029}\u{200e}\u{61c}", "\\u{2028}\\u{2029}\\u{200e}\\u{61c}"),
            ("\u{2027}\u{202f}\u{205f}\u{2070}\u{1f600}", "\u{2027}\u{202f}\u{205f}\u{2070}\u{1f600}"),
            ("a\u{200b}\u{2060}\u{2065}\u{206a}\u{feff}", "a\\u{200b}\\u{2060}\\u{2065}\\u{206a}\\u{feff}"),
            ("\u{ad}\u{600}\u{110bd}\u{1d173}\u{e0041}", "\\xad\\u{600}\\u{110bd}\\u{1d173}\\u{e0041}"),
        ] {
            assert_eq!(shown(text).to_string(), expected);
            assert_eq!(shown(shown(text)).to_string(), expected);
        }
        assert_eq!(shown_lines("a\tb\n\x1bc\r\n").to_string(), "a\tb\n\\x1bc\\r\n");
    }

    /// A JSON reader gets the same value, and a terminal gets no character that it obeys.
    #[test]
    fn json_keeps_its_value() {
        let value = serde_json::json!({ "a\u{9b}": ["\u{202e}\x7f\n\x1b\"\\", 1.5], "\u{e0041}\u{200b}": "\u{1f600}" });
        for json in [serde_json::to_string(&value), serde_json::to_string_pretty(&value)].map(Result::unwrap) {
            let safe = shown_json(&json);
            assert!(safe.chars().all(|letter| letter == '\n' || !is_obeyed(letter)), "{safe}");
            assert_eq!(serde_json::from_str::<serde_json::Value>(&safe).unwrap(), value);
        }
        assert_eq!(shown_json("{\n  \"a\": \"b\\n\"\n}\n"), "{\n  \"a\": \"b\\n\"\n}\n");
    }

    #[test]
    fn long_texts_are_cut() {
        let fits = "n".repeat(40);
        assert_eq!((shorten(&fits), cell(&fits)), (fits.clone(), fits.clone()));
        assert_eq!(shorten(&format!("{fits}n")), format!("{fits}..."));
        let names = ["upper", "lower"].map(|side| cell(&format!("{}_{side}", "part_".repeat(20))));
        assert_eq!(names[0], "part_part_part_part...t_part_part__upper");
        assert!(names[0] != names[1] && names[1].ends_with("_lower"));
        assert!(names.iter().all(|name| name.chars().count() == 40));
        // Escapes are wider than what they stand for.
        assert_eq!(cell(&"\x1b".repeat(39)).chars().count(), 40);
    }
}
