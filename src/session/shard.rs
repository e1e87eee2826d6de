//! [`Shard`]: the share of one job in the designs of an array of jobs.

use std::fmt;
use std::str::FromStr;

/// A share of the designs, written `I/N`: every N-th design, from the I-th on, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    first: usize,
    of: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(first, of)| Some((first.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((first, of)) if (1..=of).contains(&first) => Ok(Self { first, of }),
            _ => Err("expected I/N with I from 1 to N, such as 3/10".to_owned()),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "{}/{}", self.first, self.of)
    }
}

impl Shard {
    /// The share of the job with this number, counted from 0; `None` unless there are more jobs.
    pub(super) fn of_job(index: u64, of: u64) -> Option<Self> {
        let (index, of) = (usize::try_from(index).ok()?, usize::try_from(of).ok()?);
        (index < of).then_some(Self { first: index + 1, of })
    }

    /// The elements of this share, in the order of `all`.
    pub fn take<T>(self, all: Vec<T>) -> Vec<T> {
        all.into_iter().skip(self.first - 1).step_by(self.of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_numbered_from_one() {
        for wrong in ["0/3", "4/3", "1", "1/0", "a/b", "-1/2", "1/2/3"] {
            assert!(Shard::from_str(wrong).is_err(), "{wrong}");
        }
        let share = |text: &str| Shard::from_str(text).unwrap().take((1..=7).collect());
        assert_eq!(share("1/3"), [1, 4, 7]);
        assert_eq!(share("3/3"), [3, 6]);
        assert_eq!(share("9/9"), [] as [i32; 0]);
    }
}
