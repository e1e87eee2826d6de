//! The rows of a file with airfoil coordinates: titles, counts, labels and points are told apart.

use std::path::Path;

use super::{fail, number};
use crate::profile::ProfileError;
use crate::text::{Mark, Row, fields, parse_number, rows, shorten};

/// A row of two numbers above this is no point of an airfoil of chord 1. It holds the numbers of
/// points of both sides, or is a title.
const COUNTS: f64 = 1.5;

/// The rows of a file. The places of rows count points.
#[derive(Default)]
pub(super) struct Table {
    /// Line of each point, from 0.
    pub lines: Vec<usize>,
    /// The two or three numbers of each point; the third is 0 if there are two.
    pub rows: Vec<[f64; 3]>,
    /// Indices of the points after a blank line.
    pub after_blank: Vec<usize>,
    /// Rows before or between the points that begin a side.
    pub starts: Vec<Start>,
    /// A row of two large numbers before the points.
    pub heading: Option<Heading>,
}

/// A row that begins a side: its number of points, or a label such as `lower surface`.
pub(super) struct Start {
    /// The index of the next point.
    pub at: usize,
    pub line: usize,
    /// The number of points that the row declares.
    pub count: Option<f64>,
    /// Whether the row can be a title.
    pub is_title: bool,
}

/// A row of two large numbers before the points.
pub(super) struct Heading {
    pub line: usize,
    pub numbers: [f64; 2],
    /// Whether the row can be a title, such as `0012 64`.
    pub is_title: bool,
}

impl Table {
    /// Makes the heading the first point.
    pub fn heading_is_point(&mut self) {
        let Some(Heading { line, numbers: [x, y], .. }) = self.heading.take() else { return };
        self.lines.insert(0, line);
        self.rows.insert(0, [x, y, 0.0]);
        self.after_blank.iter_mut().for_each(|at| *at += 1);
        self.starts.iter_mut().for_each(|start| start.at += usize::from(start.at > 0));
    }

    /// Reads the rows of a file.
    ///
    /// # Errors
    /// [`ProfileError::Line`]: a row is neither a title nor a point, or begins another element.
    pub fn read(path: &Path, text: &str) -> Result<Self, ProfileError> {
        let mut table = Table::default();
        let (mut n_columns, mut is_first, mut blank, mut has_limits) = (0, true, false, false);
        let (mut separated, mut remark) = (None, None);
        let mut may_be_title = false;
        for Row { line, text: row, comment } in rows(text, Mark::Any) {
            let words = fields(row);
            if words.is_empty() {
                blank |= comment.is_empty();
                continue;
            }
            let numbers: Option<Vec<f64>> = words.iter().map(|word| parse_number(word)).collect();
            let is_first = std::mem::take(&mut is_first);
            // Three whole numbers may be a point of three coordinates. Then the next row has three
            // numbers too.
            if std::mem::take(&mut may_be_title) && numbers.as_ref().is_none_or(|numbers| numbers.len() != n_columns) {
                table = Table::default();
            }
            let is_before = table.rows.is_empty();
            let at = table.rows.len();
            match numbers.as_deref() {
                None if is_before && (is_first || !is_broken_point(&words)) => continue,
                None if !is_before && is_label(&words) => {
                    table.starts.push(Start { at, line, count: None, is_title: false });
                    continue;
                }
                // Remarks may follow the points, but no points may follow the remarks.
                None if !is_before && !is_garbled_point(&words, blank || remark.is_some()) => {
                    remark.get_or_insert((line, row));
                    continue;
                }
                Some(numbers) if remark.is_some() && !(2..=3).contains(&numbers.len()) => continue,
                Some(&[count]) => {
                    let is_title = is_first && (is_designation(&words) || !comment.is_empty());
                    table.starts.push(Start { at, line, count: Some(count), is_title });
                    continue;
                }
                // The limits of the domain of ISES and MSES: x and y at inlet and outlet, bottom
                // and top.
                Some([_, _, _, _]) if is_before && !has_limits => {
                    has_limits = true;
                    continue;
                }
                Some(&[x, y]) if is_before && x.min(y) > COUNTS && table.heading.is_none() => {
                    let is_title = is_first && (is_designation(&words) || !comment.is_empty());
                    table.heading = Some(Heading { line, numbers: [x, y], is_title });
                    continue;
                }
                // Titles such as `63 2 215` or `1 2 3 4 5`.
                Some([_, _, _, _, _, ..]) if is_first => continue,
                Some(&[_, _, _]) if is_first && words.iter().all(|word| is_whole(word)) && is_designation(&words) => {
                    continue;
                }
                Some(&[x, y, ..]) if x == SEPARATOR && y == SEPARATOR => {
                    separated.get_or_insert(line);
                    continue;
                }
                _ => {}
            }
            if let Some(line) = separated {
                let what = format!("{SEPARATOR} {SEPARATOR}, after which another element begins");
                return Err(fail(path, line, what, "an airfoil of one element: give each element a file of its own"));
            }
            if let Some((line, row)) = remark {
                let what = format!("'{}' after the points", shorten(row));
                let expected = "one airfoil of one element, without a title between its points: give each element a file \
                                of its own";
                return Err(fail(path, line, what, expected));
            }
            let n = words.len();
            if !(2..=3).contains(&n) || !is_before && n != n_columns {
                let expected = match n_columns {
                    3 => "three numbers as before: x, y and the place along the span",
                    _ => "two numbers: x y",
                };
                return Err(fail(path, line, format!("{n} words"), expected));
            }
            let mut values = [0.0; 3];
            for (value, word) in values.iter_mut().zip(&words) {
                *value = number(path, line, word)?;
            }
            if std::mem::take(&mut blank) && !is_before {
                table.after_blank.push(at);
            }
            n_columns = n;
            may_be_title = is_first && n == 3 && words.iter().all(|word| is_whole(word));
            table.lines.push(line);
            table.rows.push(values);
        }
        Ok(table)
    }
}

/// Both numbers of the row between two elements of MSES.
const SEPARATOR: f64 = 999.0;

/// Whether a row before the points may be a point with a mistake, and so no title: two or three
/// words of which the first is a number with a decimal point.
fn is_broken_point(words: &[&str]) -> bool {
    (2..=3).contains(&words.len()) && words[0].contains('.') && parse_number(words[0]).is_some()
}

/// Whether a row after the points is a point with a mistake, such as `l.0 0.002` or `0,5 0,1`, and
/// so no remark.
///
/// - `apart`: whether the row is apart from the points: after a blank line or a remark
fn is_garbled_point(words: &[&str], apart: bool) -> bool {
    let is_decimal = |word: &&str| word.contains('.') && parse_number(word).is_some();
    let is_word =
        |word: &str| word.chars().take(2).filter(|letter| letter.is_alphabetic()).count() == 2 || word.ends_with('=');
    let has_coordinate = (2..=3).contains(&words.len()) && words.iter().any(is_decimal) && !is_word(words[0]);
    has_coordinate || !apart && parse_number(words[0]).is_some()
}

fn is_whole(word: &str) -> bool {
    word.bytes().all(|byte| byte.is_ascii_digit())
}

/// Whether whole numbers may designate an airfoil, such as `0012 64` or `23012`: no count begins
/// with 0 or has many digits.
fn is_designation(words: &[&str]) -> bool {
    let designates = |word: &&str| word.len() > 1 && word.starts_with('0') || word.len() >= 4;
    words.iter().all(|word| is_whole(word)) && words.iter().any(designates)
}

/// Whether a row between points is the label of a side or holds names of coordinates, such as
/// `x/c y/c`.
fn is_label(words: &[&str]) -> bool {
    let lower = words.join(" ").to_ascii_lowercase();
    let names_side = |word: &str| {
        let letters = word.trim_matches(|letter: char| !letter.is_ascii_alphabetic());
        ["upper", "lower", "top", "bottom", "suction", "pressure", "extrados", "intrados"].contains(&letters)
    };
    let names_column = |word: &str| matches!(word, "x" | "y" | "z" | "x/c" | "y/c" | "z/c");
    lower.split_whitespace().any(names_side) || lower.split_whitespace().all(names_column)
}
