//! The work that front ends share. A front end is the command line or another program around
//! idmesh.
//!
//! A [`Session`] holds a loaded case with its mover. [`Session::finish`] moves the mesh to one
//! design, writes the results and returns the report, as `idmesh run` does.
//!
//! | file | holds |
//! |---|---|
//! | `mod` | [`Session`]: moves the mesh to a design, writes the results, makes the report |
//! | `outputs`, `names` | the files of results and the rule for their names |
//! | `inverted` | the file with the faulty tets of an invalid mesh |
//! | `files` | checks and writes other files and folders |
//! | `init` | makes a first case of a mesh |
//! | `array`, `shard` | the share of one job in the designs of an array of jobs |
//! | `claims`, `claim_error` | a folder through which jobs share designs one by one |
//! | `join` | joins files of reports |
//! | `designs`, `replaced_inputs` | the files of a batch's designs, and the part of the case that they replace |
//! | `checksums` | checksums of inputs, and their comparison with earlier ones |
//! | `earlier` | the results of an earlier run that still hold |
//! | `lines` | a file of reports, one a line, that several jobs share |
//! | `error` | [`SessionError`] |

mod array;
mod checksums;
mod claim_error;
mod claims;
mod designs;
mod earlier;
mod error;
mod files;
mod init;
mod inverted;
mod join;
mod lines;
mod names;
mod outputs;
mod replaced_inputs;
mod shard;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

pub use array::{ArrayError, ArrayJob};
pub use checksums::sums_of_case;
pub use claim_error::ClaimError;
pub use claims::{Claiming, Claims, Done, Held, Next};
pub use designs::{DesignFiles, Listed, list_designs};
pub use earlier::{EarlierResults, of_design};
pub use error::{Exit, SessionError};
pub use files::{
    Folder, ReadFiles, check_distinct, check_writable, remove_file, write_lines, write_surface, write_text, write_texts,
};
pub use init::{Proposal as InitProposal, Wanted as InitWanted, check_demo_is_free, check_free, propose, propose_demo};
pub use join::{Conflict, Joined, JoinedLine, join};
pub use lines::{Appending, Line, ReportFile};
pub use outputs::{Loss, Outputs};
pub use replaced_inputs::ReplacedInputs;
pub use shard::Shard;

use crate::backend::Backend;
use crate::case::LoadedCase;
use crate::formats::{FileSet, Placed, is_surface_file};
use crate::mesh::{OtherCells, TetMesh};
use crate::mover::{Design, Mover, MoverBuilder, Outcome, Refused, Why};
use crate::report::{self, Checksums, ReportError, RunReport, Seconds};
use crate::text::shown_json;
use files::cannot_write;

/// A loaded case with its mover.
pub struct Session<'a> {
    case: &'a LoadedCase,
    mover: Mover,
    device: Arc<dyn Backend>,
    backend: report::Backend,
    mesh: report::Mesh,
    /// Time of the mover's set-up, s.
    setup_seconds: f64,
}

/// Makes sessions that share the mesh and the device of another session, on any thread.
pub struct SessionMaker<'a> {
    case: &'a LoadedCase,
    mesh: Arc<TetMesh>,
    others: Arc<OtherCells>,
    device: Arc<dyn Backend>,
}

impl<'a> SessionMaker<'a> {
    /// Sets up a session.
    ///
    /// - `progress`: as for [`Session::new`]
    ///
    /// # Errors
    /// The memory does not suffice, or the backend failed.
    pub fn make(self, progress: impl Fn(&str) + Send + 'static) -> Result<Session<'a>, SessionError> {
        let builder = self.case.builder_of(self.mesh, self.others);
        Session::build(self.case, builder.progress(progress), self.device)
    }
}

/// A design to move, and the files to write.
#[derive(Clone, Copy)]
pub struct Job<'j> {
    /// The design.
    pub design: &'j Design,
    /// The design's name, for the report. `None` for the design of the case itself.
    pub name: Option<&'j str>,
    /// The moment at which the work on the design began.
    pub started: Instant,
    /// Time for reading the design's files, s.
    pub read_seconds: f64,
    /// The files to write.
    pub outputs: &'j Outputs,
    /// The file for the report, which gets its name together with the outputs.
    pub report: Option<&'j Path>,
    /// Checksums of the files that were read, if the report shall hold checksums.
    pub checksums: Option<&'j Checksums>,
    /// The claim on the design, if jobs share the designs. No file gets its name if another job has
    /// taken the design over meanwhile.
    pub claim: Option<&'j Held>,
}

/// A design that was moved and written.
#[non_exhaustive]
pub struct Finished {
    /// The report.
    pub report: RunReport,
    /// The files that were written.
    pub written: Vec<PathBuf>,
    /// Remarks on the result. The report has these, and what the outputs do not hold.
    pub warnings: Vec<String>,
    /// Whether the result may be used; an error holds its faults.
    pub verdict: Result<(), Refused>,
    placed: Placed,
}

impl Finished {
    /// Removes the files of the result again, because its report could not be written.
    pub fn withdraw(self) {
        self.placed.withdraw();
    }
}

impl<'a> Session<'a> {
    /// Sets up the mover of a case.
    ///
    /// - `progress`: gets the name of each step and each stage as it begins
    ///
    /// # Errors
    /// The mesh and the case do not go together, or the backend failed.
    pub fn new(
        case: &'a LoadedCase,
        backend: impl Into<Arc<dyn Backend>>,
        progress: impl Fn(&str) + Send + 'static,
    ) -> Result<Self, SessionError> {
        Self::with_room(case, backend, progress, 1)
    }

    /// [`Session::new`] for a program that will have several sessions of the case at once.
    ///
    /// - `sessions`: the number of sessions for which the memory must suffice
    ///
    /// # Errors
    /// As for [`Session::new`].
    pub fn with_room(
        case: &'a LoadedCase,
        backend: impl Into<Arc<dyn Backend>>,
        progress: impl Fn(&str) + Send + 'static,
        sessions: usize,
    ) -> Result<Self, SessionError> {
        Self::build(case, case.builder().movers(sessions).progress(progress), backend.into())
    }

    /// A maker of sessions that share the mesh and the device with this one.
    pub fn maker(&self) -> SessionMaker<'a> {
        let (mesh, others) = self.mover.shared_mesh();
        SessionMaker { case: self.case, mesh, others, device: self.device.clone() }
    }

    fn build(case: &'a LoadedCase, builder: MoverBuilder, device: Arc<dyn Backend>) -> Result<Self, SessionError> {
        let setup = Instant::now();
        let mover = builder.build(device.clone()).map_err(|error| case.about(error))?;
        let setup_seconds = setup.elapsed().as_secs_f64();
        let backend = report::Backend::of(device.info());
        Ok(Self { case, mover, device, backend, mesh: report::Mesh::of(case.file.cells()), setup_seconds })
    }

    /// Moves the mesh to a design. Returns the outcome and the time of the update, in s.
    ///
    /// # Errors
    /// The design does not fit the mesh, or the backend failed.
    pub fn update(&mut self, design: &Design) -> Result<(Outcome, f64), SessionError> {
        let start = Instant::now();
        let outcome = self.mover.update(design).map_err(|error| self.case.about_design(error, design))?;
        Ok((outcome, start.elapsed().as_secs_f64()))
    }

    /// [`Session::update`] for several designs, whose springs are read together; see
    /// [`Mover::update_many`]. The time of a design is its share of the time for all.
    pub fn update_many(&mut self, designs: &[&Design]) -> Vec<Result<(Outcome, f64), SessionError>> {
        let start = Instant::now();
        let outcomes = self.mover.update_many(designs);
        let share = start.elapsed().as_secs_f64() / designs.len().max(1) as f64;
        let of_design = |(outcome, design): (Result<Outcome, _>, &&Design)| {
            outcome.map(|outcome| (outcome, share)).map_err(|error| self.case.about_design(error, design).into())
        };
        outcomes.into_iter().zip(designs).map(of_design).collect()
    }

    /// The mover, for products with the derivative of an outcome.
    pub fn mover(&mut self) -> &mut Mover {
        &mut self.mover
    }

    /// Checks a design without moving the volume; see [`Mover::check`].
    ///
    /// # Errors
    /// The design does not fit the mesh.
    pub fn check(&mut self, design: &Design) -> Result<(), SessionError> {
        self.mover.check(design).map_err(|error| self.case.about_design(error, design).into())
    }

    /// Moves the mesh to a design and writes the results. All files get their names together, or
    /// none does.
    ///
    /// # Errors
    /// The design does not fit the mesh, the backend failed, a vertex has no finite position, a
    /// file cannot be written, or the claim was lost. Without finite positions
    /// ([`SessionError::Refused`]) the report and its page are written, and no mesh.
    pub fn finish(&mut self, job: Job) -> Result<Finished, SessionError> {
        self.clear(&job)?;
        let moved = self.update(job.design)?;
        self.write(job, moved)
    }

    /// Removes the files of an earlier result.
    ///
    /// # Errors
    /// A file cannot be removed.
    pub fn clear(&self, job: &Job) -> Result<(), SessionError> {
        // The files of a claimed design may be those of a job that has taken it over: they stay
        // until it is sure that none has.
        if job.claim.is_none() {
            job.outputs.remove_earlier(&self.case.inputs, None)?;
        }
        Ok(())
    }

    /// The part of [`Session::finish`] after the motion.
    ///
    /// - `moved`: of [`Session::update`] or [`Session::update_many`]
    ///
    /// # Errors
    /// As for [`Session::finish`].
    pub fn write(&mut self, job: Job, moved: (Outcome, f64)) -> Result<Finished, SessionError> {
        let (outcome, update) = moved;
        if let Err(refused) = outcome.check()
            && refused.why == Why::NotFinite
        {
            return Err(self.refuse(&job, &outcome, refused)?);
        }
        let write = Instant::now();
        self.mover.tell("writing");
        let mut files = if job.checksums.is_some() { FileSet::with_checksums() } else { FileSet::default() };
        // The measures take time, and only a report, a page or limits need them. A file is written
        // by one thread, so the others measure meanwhile.
        let with_measures = job.checksums.is_some() || !outcome.limits().is_empty();
        rayon::in_place_scope(|others| {
            if with_measures {
                others.spawn(|_| {
                    let _ = (outcome.original_solver_measures(), outcome.solver_measures());
                });
            }
            job.outputs.add_to(&mut files, self.case, job.name, &outcome)
        })?;
        // A file that is there already belongs to the result too.
        let sums_of = |files: &FileSet| {
            let sums = files.files().chain(files.kept());
            sums.map(|(path, sum)| (path.display().to_string(), sum.map(str::to_owned))).collect()
        };
        let written: Vec<_> = files.files().map(|(path, _)| path.to_path_buf()).collect();
        let pictures: Vec<PathBuf> = job.outputs.pictures().collect();
        let is_mesh = |path: &&PathBuf| !pictures.contains(path) && !is_surface_file(path);
        let meshes: Vec<_> = written.iter().filter(is_mesh).cloned().collect();
        let verdict = outcome.check().map_err(|refused| in_files(refused, &outcome, &meshes));
        let refused = verdict.as_ref().err();
        let mut report = self.report(job.name, refused.map(Exit::from)).of_outcome(&outcome, refused);
        if with_measures {
            report = report.with_solver_quality(&outcome);
        }
        report = report.with_outlines(&outcome, self.case.old_profiles());
        let of_outcome = std::mem::take(&mut report.warnings);
        let warnings: Vec<String> = self.case.warnings().iter().cloned().chain(of_outcome).collect();
        let losses = job.outputs.losses(self.case)?.into_iter().filter(|loss| !loss.is_detail).map(|loss| loss.text);
        report.warnings = losses.chain(warnings.iter().cloned()).collect();
        report.checksums = job.checksums.map(|checksums| Checksums { outputs: sums_of(&files), ..checksums.clone() });
        let setup = self.setup_seconds;
        let seconds = || {
            let [write, total] = [write.elapsed(), job.started.elapsed()].map(|time| time.as_secs_f64());
            Some(Seconds { read: job.read_seconds, setup, update, write, total })
        };
        report.seconds = seconds();
        if job.outputs.page.is_some() {
            self.mover.tell("writing the page");
            job.outputs.add_page(&mut files, self.case, &report, &outcome)?;
            // The page cannot hold its own checksum, nor the time that it took.
            report.checksums.iter_mut().for_each(|checksums| checksums.outputs = sums_of(&files));
            report.seconds = seconds();
        }
        let mut written: Vec<_> = files.files().map(|(path, _)| path.to_path_buf()).collect();
        let report = report.with_reasons();
        if let Some(path) = job.report {
            add_report(&mut files, path, &report)?;
            written.push(path.to_path_buf());
        }
        // Another run may have put files under these names meanwhile.
        let check = || job.claim.map_or(Ok(()), Held::check);
        let placed = job.outputs.place(files, &self.case.inputs, job.report, check)?;
        Ok(Finished { report, written, warnings, verdict, placed })
    }

    /// Writes the report and the page of an outcome without finite positions, in place of the files
    /// of an earlier result. Returns the error that says so.
    fn refuse(&self, job: &Job, outcome: &Outcome, refused: Refused) -> Result<SessionError, SessionError> {
        let error = SessionError::Refused(refused);
        let report = self.failed(job.name, &error, job.checksums);
        let check = || job.claim.map_or(Ok(()), Held::check);
        job.outputs.place_refused(self.case, (&report, job.report), outcome, check)?;
        Ok(error)
    }

    /// The report of a design that could not be moved.
    ///
    /// - `checksums`: of the files that were read
    pub fn failed(&self, name: Option<&str>, error: &SessionError, checksums: Option<&Checksums>) -> RunReport {
        let mut report = self.report(name, Some(error.exit()));
        report.error = Some(match error {
            SessionError::Refused(refused) => ReportError::of_refused(refused),
            error => ReportError::of_message("input", error.to_string(), error.hint()),
        });
        report.checksums = checksums.cloned();
        report.with_reasons()
    }

    /// A report without measures.
    fn report(&self, name: Option<&str>, exit: Option<Exit>) -> RunReport {
        let case = self.case.case.path.display().to_string();
        let exit = exit.map_or(0, |exit| exit as u8);
        RunReport::failed(case, name.map(str::to_owned), self.backend.clone(), self.mesh.clone(), exit)
    }
}

/// Adds the file of a report to those of its result.
fn add_report(files: &mut FileSet, path: &Path, report: &RunReport) -> Result<(), SessionError> {
    let mut text = shown_json(&serde_json::to_string_pretty(report)?);
    text.push('\n');
    files.add(path, move |out| out.write_all(text.as_bytes())).map_err(|error| cannot_write(path, error))
}

/// Adds the names of the files with the invalid mesh to the message.
fn in_files(mut refused: Refused, outcome: &Outcome, written: &[PathBuf]) -> Refused {
    if !outcome.is_valid() && !written.is_empty() {
        let names: Vec<_> = written.iter().map(|path| path.display().to_string()).collect();
        refused.message += &format!("; the mesh is in {}", names.join(", "));
    }
    refused
}
