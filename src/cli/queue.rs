//! [`Queue`]: where the workers of a batch get their designs from.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::thread;
use std::time::Duration;

use super::console::Console;
use super::failure::Failure;
use crate::session::{Claims, Held, Next};

/// Shortest and longest pause between two looks at the claims of other jobs.
const SHORTEST: Duration = Duration::from_millis(20);
const LONGEST: Duration = Duration::from_secs(1);

/// The designs that are left, by their places among the designs of the job.
pub(super) enum Queue<'d> {
    /// The designs of this process alone.
    Own { left: Vec<usize>, next: AtomicUsize },
    /// Designs that several jobs share.
    Shared {
        claims: Box<Claims<'d>>,
        /// Whether to wait for the designs of other jobs, in case one of these ends.
        waits: bool,
    },
}

impl Queue<'_> {
    /// The next design, with its claim if jobs share the designs; `None` if none is left.
    ///
    /// - `is_over`: whether the batch has failed meanwhile
    /// - `may_wait`: whether to wait for designs of other jobs, if all jobs wait
    ///
    /// # Errors
    /// The claims cannot be read or written.
    pub(super) fn next(
        &self,
        is_over: &dyn Fn() -> bool,
        may_wait: bool,
        console: &Console,
    ) -> Result<Option<(usize, Option<Held>)>, Failure> {
        let (claims, waits) = match self {
            Self::Own { left, next } => {
                let place = next.fetch_add(1, Relaxed);
                return Ok(left.get(place).filter(|_| !is_over()).map(|&index| (index, None)));
            }
            Self::Shared { claims, waits } => (claims, *waits && may_wait),
        };
        let mut pause = SHORTEST;
        let mut has_told = false;
        while !is_over() {
            match claims.next()? {
                Next::Design(index, held) => return Ok(Some((index, Some(*held)))),
                Next::Wait if waits => {
                    if !std::mem::replace(&mut has_told, true) {
                        tell(claims, "waiting for", console);
                        console.step("waiting for other jobs");
                    }
                    thread::sleep(pause);
                    pause = LONGEST.min(pause * 2);
                }
                Next::Wait | Next::Finished => break,
            }
        }
        Ok(None)
    }

    /// Tells of the designs that other jobs have in their hands at the end.
    pub(super) fn tell_rest(&self, console: &Console) {
        if let Self::Shared { claims, waits: false } = self {
            tell(claims, "left to other jobs:", console);
        }
    }
}

/// Names the designs in other hands.
fn tell(claims: &Claims, what: &str, console: &Console) {
    let others = claims.in_other_hands();
    if others.is_empty() {
        return;
    }
    let mut words: Vec<String> = others.iter().take(3).map(|(design, holder)| format!("{design} ({holder})")).collect();
    if others.len() > words.len() {
        words.push(format!("{} more", others.len() - words.len()));
    }
    console.note(format_args!("{what} {}", words.join(", ")));
}
