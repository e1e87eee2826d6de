//! [`Held`]: a claim in the hands of this process, and the thread that renews such claims.

use std::collections::{BTreeSet, HashMap};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, SystemTime};

use super::record::{Done, Record, State};
use crate::formats::{is_special, read_file};
use crate::memory::check_memory;
use crate::session::{ClaimError, SessionError, write_text};

/// Renewals in the time after which a claim expires.
const RENEWALS: u32 = 10;

/// Bytes of the stack of the thread that renews.
const STACK: usize = 256 << 10;

/// The numbers of the claims in the hands of this process, which may have several folders open.
static IN_HAND: Mutex<BTreeSet<u64>> = Mutex::new(BTreeSet::new());

fn in_hand() -> MutexGuard<'static, BTreeSet<u64>> {
    // A thread that panics leaves the table whole.
    IN_HAND.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether this process works on its claim with this number.
pub(super) fn is_in_hand(serial: u64) -> bool {
    in_hand().contains(&serial)
}

/// A claimed design. A claim that is dropped before the design is done is given back.
#[derive(Debug)]
#[must_use = "a claim that is dropped is given back"]
pub struct Held {
    /// The claim's file.
    path: PathBuf,
    /// Whether no other process had claimed the design before.
    is_first: bool,
    /// The name that the file would have if another process took the design over.
    next: PathBuf,
    record: Record,
    renewals: Arc<Renewals>,
    is_over: bool,
}

impl Held {
    /// - `path`, `next`: the claim's file, and the file that the next generation would have
    /// - `file`: the claim's file, open
    pub(super) fn new(
        [path, next]: [PathBuf; 2],
        is_first: bool,
        record: Record,
        file: File,
        renewals: &Arc<Renewals>,
    ) -> Self {
        in_hand().insert(record.serial);
        renewals.files().held.insert(record.serial, file);
        Self { path, is_first, next, record, renewals: renewals.clone(), is_over: false }
    }

    /// Whether no other process had claimed the design before.
    pub fn is_first(&self) -> bool {
        self.is_first
    }

    /// The claim's file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The number of holders that ended with the design in their hands.
    pub fn ended(&self) -> u32 {
        self.record.ended
    }

    /// Checks that no other process has taken the design over, which may happen to a process that
    /// stood still for long.
    ///
    /// # Errors
    /// [`ClaimError::Lost`]: another process has the design, or the claim's file is gone.
    pub fn check(&self) -> Result<(), SessionError> {
        let found = read_file(&self.path).ok().and_then(|bytes| serde_json::from_slice::<Record>(&bytes).ok());
        if found.as_ref() == Some(&self.record) && std::fs::symlink_metadata(&self.next).is_err() {
            return Ok(());
        }
        Err(ClaimError::Lost { path: self.path.clone() }.into())
    }

    /// Marks the design as done.
    ///
    /// # Errors
    /// The claim's file cannot be written.
    pub(super) fn done(mut self, done: Done) -> Result<(), SessionError> {
        self.end(State::Done(done))
    }

    /// Ends the claim without a word, because another process has the design.
    pub(super) fn lost(mut self) {
        self.is_over = true;
    }

    fn end(&mut self, state: State) -> Result<(), SessionError> {
        let record = Record { state, ..self.record.clone() };
        let text = serde_json::to_string(&record)? + "\n";
        self.is_over = true;
        // To write to a pipe in the place of the claim might never end.
        if is_special(&self.path) {
            return Err(ClaimError::Lost { path: self.path.clone() }.into());
        }
        write_text(&self.path, &text)
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.renewals.files().held.remove(&self.record.serial);
        if !self.is_over && self.check().is_ok() {
            // A claim that cannot be given back expires.
            let _ = self.end(State::Released);
        }
        in_hand().remove(&self.record.serial);
    }
}

/// The claims that a thread renews.
#[derive(Debug, Default)]
pub(super) struct Renewals {
    files: Mutex<Files>,
    ended: Condvar,
}

#[derive(Debug, Default)]
struct Files {
    /// The files of the claims, by their numbers.
    held: HashMap<u64, File>,
    has_ended: bool,
}

impl Renewals {
    fn files(&self) -> MutexGuard<'_, Files> {
        // A thread that panics leaves the table whole.
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Renews all claims again and again, until the end.
    fn run(&self, pause: Duration) {
        let mut files = self.files();
        while !files.has_ended {
            files = self.ended.wait_timeout(files, pause).unwrap_or_else(PoisonError::into_inner).0;
            for file in files.held.values() {
                // A claim that cannot be renewed expires, and `Held::check` finds out.
                let _ = file.set_modified(SystemTime::now());
            }
        }
    }
}

/// The thread that renews the claims of this process.
#[derive(Debug)]
pub(super) struct Renewer {
    pub(super) renewals: Arc<Renewals>,
    thread: Option<JoinHandle<()>>,
}

impl Renewer {
    /// Starts the thread.
    ///
    /// - `expires`: the time after which a claim expires
    ///
    /// # Errors
    /// The thread cannot be started.
    pub(super) fn start(expires: Duration) -> io::Result<Self> {
        // A thread whose stack the memory does not hold ends the process without a message.
        check_memory(2 * STACK as u64).map_err(io::Error::other)?;
        let renewals = Arc::new(Renewals::default());
        let of_thread = renewals.clone();
        let work = move || of_thread.run(expires / RENEWALS);
        let thread = Builder::new().name("claims".to_owned()).stack_size(STACK).spawn(work)?;
        Ok(Self { renewals, thread: Some(thread) })
    }
}

impl Drop for Renewer {
    fn drop(&mut self) {
        self.renewals.files().has_ended = true;
        self.renewals.ended.notify_all();
        let _ = self.thread.take().map(JoinHandle::join);
    }
}
