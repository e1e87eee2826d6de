//! [`Silence`] finds claims whose holders renew them no more.
//!
//! The clocks of several hosts differ, and so may the clock of the file system. So no time of a
//! file is compared with a clock: a claim expires after it was *seen* unchanged for long enough, by
//! the clock of the process that looks. Time in which the process did not look does not count,
//! because what stopped the process, such as a file server, may have stopped the holder too.

use std::collections::HashMap;
use std::time::{Duration, Instant, SystemTime};

/// A part of the time after which a claim expires. Between two looks no more than this counts.
const PART: u32 = 4;

/// What a renewal changes: the generation of a claim, the time of its file, and the contents.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Sign {
    pub(super) generation: u32,
    pub(super) modified: Option<SystemTime>,
    pub(super) contents: Vec<u8>,
}

/// The claims that are watched, by the place of their design.
#[derive(Debug, Default)]
pub(super) struct Silence {
    watched: HashMap<usize, Watched>,
}

#[derive(Debug)]
struct Watched {
    sign: Sign,
    last_look: Instant,
    silent: Duration,
}

impl Silence {
    /// Looks at a claim, and returns whether the claim has expired.
    ///
    /// - `expires`: the claim expires after this time without a change
    /// - `now`: the moment of the look
    pub(super) fn is_expired(&mut self, design: usize, sign: Sign, expires: Duration, now: Instant) -> bool {
        match self.watched.get_mut(&design).filter(|watched| watched.sign == sign) {
            Some(watched) => {
                watched.silent += now.duration_since(watched.last_look).min(expires / PART);
                watched.last_look = now;
                watched.silent >= expires
            }
            None => {
                self.watched.insert(design, Watched { sign, last_look: now, silent: Duration::ZERO });
                false
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sign(seconds: u64) -> Sign {
        Sign {
            generation: 1,
            modified: Some(SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)),
            contents: Vec::new(),
        }
    }

    const EXPIRES: Duration = Duration::from_secs(100);

    /// Whether each look finds the claim expired. A look is the second at which it takes place and
    /// the time of the file.
    fn looks(looks: &[(u64, u64)]) -> Vec<bool> {
        let start = Instant::now();
        let mut silence = Silence::default();
        let look = |&(at, modified): &(u64, u64)| {
            silence.is_expired(0, sign(modified), EXPIRES, start + Duration::from_secs(at))
        };
        looks.iter().map(look).collect()
    }

    /// The file's time may be of any clock. Fails if times of files are compared with the clock.
    #[test]
    fn a_claim_expires_when_it_was_seen_unchanged_for_long_enough() {
        for modified in [0, 1_000_000_000, 10_000_000_000] {
            let at: Vec<_> = (0..=5).map(|look| (20 * look, modified)).collect();
            assert_eq!(looks(&at), [false, false, false, false, false, true], "{modified}");
        }
        // A clock that goes back renews too.
        let at: Vec<_> = (0..=50).map(|look| (20 * look, 1000 - 10 * (look / 4))).collect();
        assert!(looks(&at).iter().all(|expired| !expired));
    }

    /// Fails if a gap between two looks counts whole.
    #[test]
    fn time_without_looks_does_not_count() {
        assert_eq!(
            looks(&[(0, 1), (10_000, 1), (20_000, 1), (30_000, 1), (40_000, 1)]),
            [false, false, false, false, true]
        );
        assert_eq!(looks(&[(0, 1), (10_000, 1), (10_010, 2), (10_020, 2)]), [false; 4]);
    }

    #[test]
    fn claims_are_watched_one_by_one() {
        let start = Instant::now();
        let mut silence = Silence::default();
        let mut at = |design, second| silence.is_expired(design, sign(7), EXPIRES, start + Duration::from_secs(second));
        for second in [0, 25, 50, 75] {
            assert!(!at(0, second));
        }
        assert!(!at(1, 100) && at(0, 100));
    }
}
