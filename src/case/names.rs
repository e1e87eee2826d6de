//! [`Names`]: finds the names of families that fit a pattern.
//!
//! A case may have a pattern for each of very many families. So names are found by the letters of a
//! pattern, where it has any, without a look at every name. Patterns that still take too long to
//! compare are refused.

use std::cell::{Cell, OnceCell};

use thiserror::Error;

use super::paths::{is_pattern, matches};

/// Bytes by which a piece of a name is found.
const PIECE: usize = 16;

/// So often all names are looked at before their pieces are sorted, which takes as long.
const LOOKS: usize = 32;

/// The most that all patterns of a case may take: the sum of the products of the lengths of pattern
/// and name, in bytes, over all that are compared. This takes some seconds.
const MOST: u64 = 4_000_000_000;

/// Names among which those that fit a pattern are found.
pub(super) struct Names<'n> {
    names: Vec<&'n str>,
    /// The names with their letters in the opposite order.
    reversed: Vec<String>,
    /// Indices of the names in alphabetical order.
    forward: Vec<usize>,
    /// Indices of the names in the alphabetical order of `reversed`.
    backward: Vec<usize>,
    /// The pieces of all names, sorted: the index of the name, and the byte at which the piece
    /// begins.
    pieces: OnceCell<Vec<(usize, usize)>>,
    /// How often all names were looked at.
    looks: Cell<usize>,
    /// What the patterns have taken.
    taken: Cell<u64>,
}

/// The patterns of a case take too long to compare with the names.
#[derive(Debug, Error)]
#[error(
    "the patterns of the case up to \"{pattern}\" take too long to compare with {names} families, expected fewer patterns, \
     or such that have letters which few families have"
)]
pub(super) struct TooMany {
    pattern: String,
    names: usize,
}

impl<'n> Names<'n> {
    pub fn new(names: impl Iterator<Item = &'n str>) -> Self {
        let names: Vec<&str> = names.collect();
        let mut forward: Vec<usize> = (0..names.len()).collect();
        forward.sort_by_key(|&index| names[index]);
        let reversed: Vec<String> = names.iter().map(|name| name.chars().rev().collect()).collect();
        let mut backward: Vec<usize> = (0..names.len()).collect();
        backward.sort_by_key(|&index| &reversed[index]);
        let (pieces, looks, taken) = (OnceCell::new(), Cell::new(0), Cell::new(0));
        Self { names, reversed, forward, backward, pieces, looks, taken }
    }

    /// Indices of the names that fit a pattern, or are equal to a text without `*` and `?`,
    /// ascending.
    ///
    /// # Errors
    /// The patterns so far take too long.
    pub fn fitting(&self, pattern: &str) -> Result<Vec<usize>, TooMany> {
        if !is_pattern(pattern) {
            let found = self.forward.binary_search_by_key(&pattern, |&index| self.names[index]);
            return Ok(found.map(|at| self.forward[at]).into_iter().collect());
        }
        let mut fitting = self.candidates(pattern);
        let lengths: u64 = fitting.iter().map(|&index| self.names[index].len() as u64 + 1).sum();
        let taken = self.taken.get().saturating_add(lengths.saturating_mul(pattern.len() as u64));
        self.taken.set(taken);
        if taken > MOST {
            return Err(TooMany { pattern: pattern.to_owned(), names: self.names.len() });
        }
        fitting.sort_unstable();
        fitting.dedup();
        fitting.retain(|&index| matches(pattern, self.names[index]));
        Ok(fitting)
    }

    /// Names of which those that fit are some: by the letters before the first star or question
    /// mark, by those after the last, or by the rarest run of letters between. A name may be there
    /// several times.
    fn candidates(&self, pattern: &str) -> Vec<usize> {
        let is_wild = |letter: char| matches!(letter, '*' | '?');
        let runs: Vec<&str> = pattern.split(is_wild).collect();
        let [prefix, .., suffix] = runs[..] else { return Vec::new() };
        let suffix: String = suffix.chars().rev().collect();
        // The names with a common beginning stand together.
        let forward = range(&self.forward, prefix, |index| self.names[index]);
        let backward = range(&self.backward, &suffix, |index| &self.reversed[index]);
        let fewest = if forward.len() <= backward.len() { forward } else { backward };
        if fewest.len() == self.names.len() && runs.iter().any(|run| !run.is_empty()) {
            let looks = self.looks.get();
            self.looks.set(looks + 1);
            if looks >= LOOKS {
                return self.with_rarest(&runs);
            }
        }
        fewest.to_vec()
    }

    /// The names that have the rarest of some runs of letters, and some more if the run is long.
    fn with_rarest(&self, runs: &[&str]) -> Vec<usize> {
        let piece = |&(index, at): &(usize, usize)| {
            let rest = &self.names[index].as_bytes()[at..];
            &rest[..rest.len().min(PIECE)]
        };
        let pieces = self.pieces.get_or_init(|| {
            let places = |index: usize| (0..self.names[index].len()).map(move |at| (index, at));
            let mut pieces: Vec<(usize, usize)> = (0..self.names.len()).flat_map(places).collect();
            pieces.sort_by(|one, other| piece(one).cmp(piece(other)));
            pieces
        });
        let of_run = |run: &&str| {
            let run = &run.as_bytes()[..run.len().min(PIECE)];
            let start = pieces.partition_point(|place| piece(place) < run);
            let length = pieces[start..].partition_point(|place| piece(place).starts_with(run));
            &pieces[start..start + length]
        };
        let rarest = runs.iter().filter(|run| !run.is_empty()).map(of_run).min_by_key(|found| found.len());
        rarest.unwrap_or_default().iter().map(|&(index, _)| index).collect()
    }
}

/// The sorted indices of the names that begin with a text.
fn range<'i, 'n>(indices: &'i [usize], text: &str, name: impl Fn(usize) -> &'n str) -> &'i [usize] {
    let start = indices.partition_point(|&index| name(index) < text);
    let length = indices[start..].partition_point(|&index| name(index).starts_with(text));
    &indices[start..start + length]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names that a look at every name finds, also when pieces of names are sorted.
    ///
    /// Fails if a piece longer than `PIECE` or a letter of several bytes is lost.
    #[test]
    fn the_names_that_fit_are_found() {
        let long = "a_very_long_name_of_a_family_1";
        let names =
            ["wing", "wing_1", "wing_2", "tip", "left_wing", "", "w", "*", "\u{e9}t\u{e9}", "wing_1x", "aaaa", long];
        let patterns = [
            "wing",
            "wing*",
            "*wing",
            "*",
            "?",
            "w*g",
            "*_1*",
            "??",
            "",
            "x",
            "\u{e9}*",
            "*\u{e9}",
            "wing_?",
            "*ing*",
            "*t*",
            "*long_name_of_a_family*",
            "*long_name_of_a_familx*",
            "*aa*",
            "?aa?",
            "**",
            "*\u{e9}t*",
            "*i*1*",
        ];
        let all = Names::new(names.into_iter());
        for round in 0..LOOKS {
            for pattern in patterns {
                let fits = |index: &usize| match is_pattern(pattern) {
                    true => matches(pattern, names[*index]),
                    false => pattern == names[*index],
                };
                let expected: Vec<usize> = (0..names.len()).filter(fits).collect();
                assert_eq!(all.fitting(pattern).unwrap(), expected, "{pattern}, round {round}");
            }
        }
        assert!(all.pieces.get().is_some());
    }

    /// A pattern for each of very many names. Each is compared with few names, else this is
    /// refused: 40 000 names of 10 letters and as many patterns of 12 would take 2e11.
    #[test]
    fn a_pattern_for_each_of_many_names() {
        let names: Vec<String> = (0..40_000).map(|number| format!("part{number:06}")).collect();
        let all = Names::new(names.iter().map(String::as_str));
        for index in 0..names.len() {
            let pattern = format!("*part*{index:06}*");
            assert_eq!(all.fitting(&pattern).unwrap(), [index]);
        }
        assert!(all.taken.get() < MOST / 10, "{}", all.taken.get());
    }

    /// Patterns without letters that few names have. Some tens of them are taken. Hundreds would
    /// take minutes.
    ///
    /// Fails if `MOST` is ten times as much or a tenth.
    #[test]
    fn patterns_that_take_too_long_are_refused() {
        let names: Vec<String> = (0..20_000).map(|number| format!("part{number:06}")).collect();
        let all = Names::new(names.iter().map(String::as_str));
        let pattern = format!("*p*a*r*t*0{}", "*".repeat(500));
        assert_eq!(all.fitting(&pattern).unwrap().len(), names.len());
        assert!((0..20).all(|_| all.fitting(&pattern).is_ok()));
        let refused = (0..80).find_map(|_| all.fitting(&pattern).err());
        assert!(refused.unwrap().to_string().contains("with 20000 families"));
    }
}
