//! The workers of a batch. Each has a mover of its own, and moves the mesh to one design after
//! another. The movers share the mesh and the device.

use std::fmt::Display;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use super::console::Console;
use super::failure::Failure;
use super::lines::Lines;
use super::queue::Queue;
use super::threads;
use crate::case::LoadedCase;
use crate::report::{Checksums, RunReport, beta_text};
use crate::session::{
    ClaimError, DesignFiles, Done, EarlierResults, Finished, Held, Job, Outputs, ReplacedInputs, Session, SessionError,
    of_design,
};

/// The worst measures of a result in words, for its line on a terminal.
fn worst(report: &RunReport) -> String {
    let last = report.stages.iter().flatten().next_back().filter(|_| report.mesh.tets > 0);
    let beta = last.map(|stage| format!(", worst beta {}", beta_text(stage.beta_min, 4)));
    let jacobians = report.cells.iter().flat_map(|cells| cells.values()).map(|kind| kind.jacobian_min);
    let jacobian = jacobians.reduce(f64::min).map(|least| format!(", worst scaled Jacobian {}", beta_text(least, 4)));
    beta.into_iter().chain(jacobian).collect()
}

/// What all workers share.
pub(super) struct Batch<'a> {
    pub(super) case: &'a LoadedCase,
    pub(super) designs: &'a [DesignFiles],
    pub(super) replaced: ReplacedInputs,
    /// The outputs of the case, to which a design gives its name.
    pub(super) pattern: Outputs,
    pub(super) earlier: EarlierResults,
    pub(super) queue: Queue<'a>,
    pub(super) lines: Mutex<Lines<'a>>,
    /// Checksums of the case's files, if there are lines or claims to hold them.
    pub(super) checksums: Option<Checksums>,
    pub(super) console: &'a Console,
}

/// A design with its claim.
type Piece = (usize, Option<Held>);

/// How the work on a design ended.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    /// The design has its result, or the reason why it has none. Whether it may be used.
    Done(bool),
    /// Another job has taken the design over.
    Lost,
}

impl<'a> Batch<'a> {
    /// Moves the mesh to all designs that are left, and returns the number of those that failed.
    ///
    /// - `jobs`: the most designs that are in work at once
    /// - `first`: makes the first session
    ///
    /// # Errors
    /// A failure that would stop every design: the mesh and the case do not go together, a line
    /// cannot be written, or the backend failed.
    pub(super) fn run(
        &self,
        jobs: usize,
        first: impl FnOnce() -> Result<Session<'a>, Failure>,
    ) -> Result<usize, Failure> {
        let failed = AtomicUsize::new(0);
        let is_over = AtomicBool::new(false);
        // Designs that are done take no mover.
        let Some(piece) = self.next(&is_over)? else { return Ok(0) };
        let mut session = first()?;
        let work = |session: &mut Session<'a>, piece: Option<Piece>| {
            let result = self.work(session, piece, &failed, &is_over);
            is_over.fetch_or(result.is_err(), Relaxed);
            result
        };
        std::thread::scope(|scope| {
            let mut others = Vec::new();
            // The design in hand is one of the first worker's.
            for _ in 1..jobs {
                let (work, console, maker) = (&work, self.console, session.maker());
                let fewer = move |why: &dyn Display| {
                    console.warn(format_args!("fewer designs are in work at once: {why}"));
                };
                let thread = threads::beside(scope, move || match maker.make(console.progress()) {
                    Ok(mut session) => work(&mut session, None),
                    Err(error) => {
                        fewer(&error);
                        Ok(())
                    }
                });
                match thread {
                    Ok(thread) => others.push(thread),
                    Err(failure) => fewer(&failure.message),
                }
            }
            let mut result = work(&mut session, Some(piece));
            for thread in others {
                let of_thread = thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
                result = result.and(of_thread);
            }
            result
        })?;
        Ok(failed.into_inner())
    }

    fn next(&self, is_over: &AtomicBool) -> Result<Option<Piece>, Failure> {
        while let Some((index, held)) = self.queue.next(&|| is_over.load(Relaxed), self.console)? {
            let design = &self.designs[index];
            match (held, self.earlier.line(design), &self.queue) {
                // A batch without claims has done the design before.
                (Some(held), Some(line), Queue::Shared { claims, .. }) if held.is_first() => {
                    claims.done(index, held, Done::from(line))?;
                }
                (held, ..) => return Ok(Some((index, held))),
            }
        }
        Ok(None)
    }

    /// The work of one worker.
    fn work(
        &self,
        session: &mut Session,
        first: Option<Piece>,
        failed: &AtomicUsize,
        is_over: &AtomicBool,
    ) -> Result<(), Failure> {
        let mut piece = first.map_or_else(|| self.next(is_over), |first| Ok(Some(first)))?;
        while let Some((index, held)) = piece {
            let (end, report) = self.finish(session, &self.designs[index], held.as_ref())?;
            match (&self.queue, held, end) {
                (Queue::Shared { claims, .. }, Some(held), End::Done(_)) => {
                    claims.done(index, held, Done::from(&report))?
                }
                (Queue::Shared { claims, .. }, Some(held), End::Lost) => claims.lost(index, held),
                _ => {}
            }
            failed.fetch_add(usize::from(end == End::Done(false)), Relaxed);
            self.console.advance();
            piece = self.next(is_over)?;
        }
        Ok(())
    }

    /// Moves the mesh to one design, writes its outputs and its line, and prints remarks.
    ///
    /// # Errors
    /// Failures that would stop every other design too: the line cannot be written, or the backend
    /// failed.
    fn finish(
        &self,
        session: &mut Session,
        design: &DesignFiles,
        held: Option<&Held>,
    ) -> Result<(End, RunReport), Failure> {
        let (name, console) = (design.name.as_str(), self.console);
        let checksums = self.checksums.as_ref().map(|case| of_design(case, design));
        let moved = match held.and_then(Held::given_up) {
            Some(given_up) => Err(given_up.into()),
            None => self.move_to(session, design, checksums.as_ref(), held),
        };
        let is_lost = |error: &SessionError| matches!(error, SessionError::Claim(ClaimError::Lost { .. }));
        let finished = match moved {
            Ok(finished) => finished,
            Err(error) if error.backend().is_some() => return Err(error.into()),
            Err(error) => {
                let hint = error.hint().map(|hint| format!("; {hint}")).unwrap_or_default();
                console.warn(format_args!("{name}: {error}{hint}"));
                let report = session.failed(Some(name), &error, checksums.as_ref());
                // The job that has the design now tells of it.
                if is_lost(&error) || held.is_some_and(|held| held.check().is_err()) {
                    return Ok((End::Lost, report));
                }
                // A refused result has its page instead.
                if held.is_some() && !matches!(error, SessionError::Refused(_)) {
                    self.pattern.named(name)?.remove_earlier(&self.case.inputs, None)?;
                }
                self.append(&report)?;
                return Ok((End::Done(false), report));
            }
        };
        if let Err(failure) = self.append(&finished.report) {
            finished.withdraw();
            return Err(failure);
        }
        for warning in &finished.warnings {
            console.warn(format_args!("{name}: {warning}"));
        }
        match &finished.verdict {
            Ok(()) => {
                let seconds = finished.report.seconds.map_or(0.0, |seconds| seconds.total);
                console.note(format_args!("{name}: moved in {seconds:.3} s{}", worst(&finished.report)));
            }
            Err(refused) => console.warn(format_args!("{name}: {refused}")),
        }
        Ok((End::Done(finished.verdict.is_ok()), finished.report))
    }

    /// Appends the line of a design. Lines of several workers follow one another whole.
    fn append(&self, report: &RunReport) -> Result<(), Failure> {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner).append(report)
    }

    fn move_to(
        &self,
        session: &mut Session,
        files: &DesignFiles,
        checksums: Option<&Checksums>,
        held: Option<&Held>,
    ) -> Result<Finished, SessionError> {
        let started = Instant::now();
        let outputs = self.pattern.named(&files.name)?;
        // A design that cannot be read leaves no mesh of an earlier one either. The files of a
        // claimed design may be those of a job that has taken it over.
        if held.is_none() {
            outputs.remove_earlier(&self.case.inputs, None)?;
        }
        let design = self.replaced.read(self.case, files)?;
        let read_seconds = started.elapsed().as_secs_f64();
        let name = Some(files.name.as_str());
        let job = Job {
            design: &design,
            name,
            started,
            read_seconds,
            outputs: &outputs,
            report: None::<&Path>,
            checksums,
            claim: held,
        };
        session.finish(job).map_err(|error| self.replaced.about(files, error))
    }
}
