//! [`Console`] prints data to standard output, and progress, notes, warnings and errors to standard
//! error.
//!
//! All other code prints through a console or not at all. So a console is the place where names and
//! contents of files are made safe: a terminal gets no character from them that it would obey, and
//! a message is one line.

use std::fmt::{self, Display};
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use super::estimate::Estimate;
use super::failure::{Exit, Failure};
use super::threads::OF_THREAD;
use crate::memory::check_memory;
use crate::session::Loss;
use crate::text::{shown, shown_json, shown_lines};

/// Whether standard output was closed when the process began.
pub(super) static STDOUT_IS_CLOSED: AtomicBool = AtomicBool::new(false);

/// The two streams, and the amount of text that the user wants.
#[derive(Clone)]
pub(super) struct Console {
    level: i8,
    /// The progress display. `None` with `-q` and `-v`, and if standard error is no terminal.
    spinner: Option<ProgressBar>,
    /// The estimate that the progress display shows. `None` until a command asks for one.
    estimate: Arc<Mutex<Option<Estimate>>>,
    since: Instant,
}

impl Console {
    pub(super) fn new(quiet: bool, verbose: u8) -> Self {
        let since = Instant::now();
        let estimate = Arc::new(Mutex::new(None::<Estimate>));
        let level = if quiet { -1 } else { verbose.min(1) as i8 };
        let spinner = (level == 0 && io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::new_spinner();
            // The template has no colours, so NO_COLOR needs no care.
            if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed}{rest})") {
                let estimate = estimate.clone();
                bar.set_style(style.with_key("rest", move |_: &ProgressState, out: &mut dyn fmt::Write| {
                    let estimate = estimate.lock().unwrap_or_else(PoisonError::into_inner);
                    let words = estimate.as_ref().map(|estimate| estimate.in_words(since.elapsed().as_secs_f64()));
                    // Writing to the line of a terminal in memory cannot fail.
                    let _ = out.write_str(&words.unwrap_or_default());
                }));
            }
            bar
        });
        Self { level, spinner, estimate, since }
    }

    /// Shows the current step.
    pub(super) fn step(&self, what: &str) {
        if let Some(spinner) = &self.spinner {
            if let Some(estimate) = &mut *self.estimate.lock().unwrap_or_else(PoisonError::into_inner) {
                estimate.begin(what, self.since.elapsed().as_secs_f64());
            }
            spinner.set_message(shown(what).to_string());
            // The spinner turns on a thread of its own, whose stack must fit.
            if check_memory(OF_THREAD as u64).is_ok() {
                spinner.enable_steady_tick(Duration::from_millis(120));
            }
        } else if self.level >= 1 {
            self.to_stderr(format_args!("[{:8.3} s] {what}", self.since.elapsed().as_secs_f64()));
        }
    }

    /// Lets the progress display show how much is done and how long the rest takes.
    ///
    /// - `whole`: the share of a run that the command does
    pub(super) fn estimate(&self, whole: f64) {
        *self.estimate.lock().unwrap_or_else(PoisonError::into_inner) = Some(Estimate::new(whole));
    }

    /// A function that shows each step of a mover or a session.
    pub(super) fn progress(&self) -> impl Fn(&str) + Clone + Send + 'static {
        let console = self.clone();
        move |step| console.step(step)
    }

    /// Warns of parts of the mesh that outputs will not hold. A loss that is a detail is printed
    /// only with `-v`.
    pub(super) fn losses(&self, losses: Vec<Loss>) {
        for Loss { text, is_detail } in losses {
            if is_detail { self.detail(text) } else { self.warn(text) }
        }
    }

    /// Turns the spinner into a bar for this number of pieces of work, with the time left.
    pub(super) fn count(&self, pieces: usize) {
        if let Some(spinner) = &self.spinner {
            spinner.set_length(pieces as u64);
            spinner.set_position(0);
            spinner.reset_eta();
            if let Ok(style) = ProgressStyle::with_template("{spinner} {bar:30} {pos}/{len}, {eta} left: {msg}") {
                spinner.set_style(style);
            }
        }
    }

    /// Advances the bar by one piece of work.
    pub(super) fn advance(&self) {
        if let Some(spinner) = &self.spinner {
            spinner.inc(1);
        }
    }

    /// Prints a note, unless the user asked for silence (`-q`).
    pub(super) fn note(&self, what: impl Display) {
        if self.level >= 0 {
            self.to_stderr(what);
        }
    }

    /// Prints a warning, unless the user asked for silence (`-q`).
    pub(super) fn warn(&self, what: impl Display) {
        self.note(format_args!("warning: {what}"));
    }

    /// Prints a detail, if the user asked for details (`-v`).
    pub(super) fn detail(&self, what: impl Display) {
        if self.level >= 1 {
            self.to_stderr(what);
        }
    }

    /// Prints the failure that ends the command, with each of its lines on a line of its own.
    pub(super) fn fail(&self, failure: &Failure) {
        self.to_stderr(format_args!("error: {}", failure.message));
        for line in &failure.lines {
            self.to_stderr(format_args!("  {line}"));
        }
        if let Some(hint) = &failure.hint {
            self.to_stderr(format_args!("hint: {hint}"));
        }
    }

    /// Ends the progress display.
    pub(super) fn finish(&self) {
        if let Some(spinner) = &self.spinner {
            spinner.finish_and_clear();
        }
    }

    /// Writes lines of text to standard output. A closed pipe (`idmesh ... | head -1`) is no error.
    ///
    /// # Errors
    /// Standard output cannot be written for another reason, such as a full disk.
    pub(super) fn data(&self, text: &str) -> Result<(), Failure> {
        self.to_stdout(&shown_lines(text).to_string())
    }

    /// Writes JSON to standard output, as [`Console::data`] writes text. The values stay exact.
    ///
    /// # Errors
    /// As for [`Console::data`].
    pub(super) fn json(&self, text: &str) -> Result<(), Failure> {
        self.to_stdout(&shown_json(text))
    }

    /// Checks that standard output is open. Where the shell has closed it (`>&-`), what is written
    /// there would be lost without an error.
    ///
    /// # Errors
    /// Standard output is closed.
    pub(super) fn check_stdout(&self) -> Result<(), Failure> {
        match STDOUT_IS_CLOSED.load(Relaxed) {
            true => Err(Failure::new(Exit::BadInput, "cannot write to standard output: it is closed")),
            false => Ok(()),
        }
    }

    fn to_stdout(&self, text: &str) -> Result<(), Failure> {
        self.check_stdout()?;
        let write = || {
            let mut out = io::stdout().lock();
            out.write_all(text.as_bytes())?;
            out.flush()
        };
        let result = match &self.spinner {
            Some(spinner) => spinner.suspend(write),
            None => write(),
        };
        match result {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                Err(Failure::new(Exit::BadInput, format!("cannot write to standard output: {error}")))
            }
            _ => Ok(()),
        }
    }

    /// Prints one line to standard error, whatever the text holds. If standard error cannot be
    /// written, the line is lost, because there is no other place for an error.
    fn to_stderr(&self, what: impl Display) {
        let what = shown(what);
        let write = || drop(writeln!(io::stderr().lock(), "{what}"));
        match &self.spinner {
            Some(spinner) => spinner.suspend(write),
            None => write(),
        }
    }
}
