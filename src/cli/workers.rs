//! The workers of a batch. Each has a mover of its own, and moves the mesh to one design after
//! another. The movers share the mesh and the device.

use std::fmt::Display;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::console::Console;
use super::failure::Failure;
use super::lines::Lines;
use super::queue::Queue;
use super::threads;
use crate::case::LoadedCase;
use crate::mover::{Design, Outcome};
use crate::report::{Checksums, RunReport, beta_text};
use crate::session::{
    ClaimError, DesignFiles, Done, EarlierResults, Held, Job, Outputs, ReplacedInputs, Session, SessionError, of_design,
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
    /// The most designs that a worker moves together.
    pub(super) together: usize,
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
        let Some(piece) = self.next(&is_over, true)? else { return Ok(0) };
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

    fn next(&self, is_over: &AtomicBool, may_wait: bool) -> Result<Option<Piece>, Failure> {
        while let Some((index, held)) = self.queue.next(&|| is_over.load(Relaxed), may_wait, self.console)? {
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
        let mut piece = first.map_or_else(|| self.next(is_over, true), |first| Ok(Some(first)))?;
        while let Some(first) = piece {
            let mut group = vec![first];
            // Designs that are in hand do not wait for those of other jobs.
            while group.len() < self.together
                && let Some(more) = self.next(is_over, false)?
            {
                group.push(more);
            }
            self.move_group(session, group, failed)?;
            piece = self.next(is_over, true)?;
        }
        Ok(())
    }

    /// Moves the mesh to some designs, writes their outputs and their lines, and prints remarks.
    ///
    /// # Errors
    /// Failures that would stop every other design too: a line cannot be written, or the backend
    /// failed.
    fn move_group(&self, session: &mut Session, group: Vec<Piece>, failed: &AtomicUsize) -> Result<(), Failure> {
        let read: Vec<_> = group.iter().map(|(index, held)| self.read(*index, held.as_ref())).collect();
        let designs: Vec<&Design> = read.iter().flatten().map(|ready| &ready.design).collect();
        let mut moved = session.update_many(&designs).into_iter();
        let moved: Vec<_> = read
            .into_iter()
            .map(|ready| {
                let ready = ready?;
                let moved = moved.next().expect("each design that was read has its outcome")?;
                Ok((ready, moved))
            })
            .collect();
        for ((index, held), moved) in group.into_iter().zip(moved) {
            let (end, report) = self.finish(session, &self.designs[index], held.as_ref(), moved)?;
            match (&self.queue, held, end) {
                (Queue::Shared { claims, .. }, Some(held), End::Done(_)) => {
                    claims.done(index, held, Done::from(&report))?
                }
                (Queue::Shared { claims, .. }, Some(held), End::Lost) => claims.lost(index, held),
                _ => {}
            }
            failed.fetch_add(usize::from(end == End::Done(false)), Relaxed);
            self.console.advance();
        }
        Ok(())
    }

    /// Writes the outputs of one design and its line, and prints remarks.
    ///
    /// # Errors
    /// As for [`Self::move_group`].
    fn finish(
        &self,
        session: &mut Session,
        design: &DesignFiles,
        held: Option<&Held>,
        moved: Result<(Ready, (Outcome, f64)), SessionError>,
    ) -> Result<(End, RunReport), Failure> {
        let (name, console) = (design.name.as_str(), self.console);
        let checksums = self.checksums.as_ref().map(|case| of_design(case, design));
        let moved = moved.and_then(|(ready, moved)| {
            // What passed since then is the time of other designs too.
            let own = ready.seconds + moved.1;
            let started = Duration::try_from_secs_f64(own).ok().and_then(|own| Instant::now().checked_sub(own));
            let job = ready.job(name, started.unwrap_or_else(Instant::now), checksums.as_ref(), held);
            session.write(job, moved)
        });
        let moved = moved.map_err(|error| self.replaced.about(design, error));
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

    /// Reads a design, and removes the files of its earlier result.
    fn read(&self, index: usize, held: Option<&Held>) -> Result<Ready, SessionError> {
        if let Some(given_up) = held.and_then(Held::given_up) {
            return Err(given_up.into());
        }
        let started = Instant::now();
        let files = &self.designs[index];
        let outputs = self.pattern.named(&files.name)?;
        // A design that cannot be read leaves no mesh of an earlier one either. The files of a
        // claimed design may be those of a job that has taken it over.
        if held.is_none() {
            outputs.remove_earlier(&self.case.inputs, None)?;
        }
        let design = self.replaced.read(self.case, files)?;
        Ok(Ready { design, outputs, seconds: started.elapsed().as_secs_f64() })
    }
}

/// A design that was read.
struct Ready {
    design: Design,
    outputs: Outputs,
    /// Time for reading, s.
    seconds: f64,
}

impl Ready {
    fn job<'j>(
        &'j self,
        name: &'j str,
        started: Instant,
        checksums: Option<&'j Checksums>,
        claim: Option<&'j Held>,
    ) -> Job<'j> {
        let Self { design, outputs, seconds } = self;
        Job { design, name: Some(name), started, read_seconds: *seconds, outputs, report: None, checksums, claim }
    }
}
