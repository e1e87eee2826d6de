//! Starts the threads of the process.
//!
//! A thread whose stack the memory does not hold ends the process without a message, in several
//! places of several libraries. So the memory is checked here. All threads that compute are
//! made at the start; threads on which further designs are moved are checked one by one.

use std::thread::{self, Scope, ScopedJoinHandle};

use super::failure::Failure;
use crate::memory::check_memory;

/// Bytes of each stack, also of the one on which a command runs. The stack of the main thread
/// grows, and the process is ended where a limit keeps it from growing.
const STACK: usize = 2 << 20;

/// Bytes of a thread: its stack, with what belongs to it.
pub(super) const OF_THREAD: usize = STACK + (256 << 10);

/// The most threads that are started, or four for each processor where that is more. Beyond it the
/// threads hinder each other so much that a run seems to hang.
const MOST: usize = 512;

/// Runs a command on a thread with a stack of its own, beside the threads that compute.
///
/// # Errors
/// The threads cannot be made.
pub(super) fn run<T: Send + 'static>(command: impl FnOnce() -> T + Send + 'static) -> Result<T, Failure> {
    let n_processors = thread::available_parallelism().map_or(1, usize::from);
    let asked = std::env::var_os("RAYON_NUM_THREADS").unwrap_or_default();
    let n_threads = match asked.to_str().and_then(|text| text.parse().ok()) {
        Some(count) if count > 0 => count,
        Some(_) => n_processors,
        None if asked.is_empty() => n_processors,
        None => {
            let asked = asked.display();
            let expected = "expected a number of threads, or 0 for one on each processor";
            return Err(Failure::bad_input(format!("RAYON_NUM_THREADS is \"{asked}\", {expected}")));
        }
    };
    let no_threads = |why: &dyn std::fmt::Display| {
        let mut failure = Failure::bad_input(format!("{n_threads} threads cannot be started: {why}"));
        failure.hint = Some("take fewer threads (RAYON_NUM_THREADS), or raise the limit of the memory".to_owned());
        failure
    };
    let most = MOST.max(4 * n_processors);
    if n_threads > most {
        return Err(no_threads(&format_args!("at most {most} are useful on {n_processors} processors")));
    }
    // Beside those that compute are the command's own thread and the one of the progress display.
    check_memory((n_threads + 2).saturating_mul(OF_THREAD) as u64).map_err(|error| no_threads(&error))?;
    rayon::ThreadPoolBuilder::new().stack_size(STACK).build_global().map_err(|error| no_threads(&error))?;
    let command = thread::Builder::new().name("idmesh".to_owned()).stack_size(STACK).spawn(command);
    match command.map_err(|error| no_threads(&error))?.join() {
        Ok(result) => Ok(result),
        // The panic has printed its message.
        Err(panic) => std::panic::resume_unwind(panic),
    }
}

/// Starts a further thread on which designs are moved.
///
/// # Errors
/// The thread cannot be made.
pub(super) fn beside<'scope, T: Send + 'scope>(
    scope: &'scope Scope<'scope, '_>,
    work: impl FnOnce() -> T + Send + 'scope,
) -> Result<ScopedJoinHandle<'scope, T>, Failure> {
    let no_thread = |why: &dyn std::fmt::Display| {
        let mut failure = Failure::bad_input(format!("no thread can be started for a further design: {why}"));
        failure.hint = Some("take fewer designs at once (--jobs), or raise the limit of the memory".to_owned());
        failure
    };
    check_memory(2 * STACK as u64).map_err(|error| no_thread(&error))?;
    let thread = thread::Builder::new().name("design".to_owned()).stack_size(STACK);
    thread.spawn_scoped(scope, work).map_err(|error| no_thread(&error))
}
