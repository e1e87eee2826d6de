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
//! | `designs`, `replaced_inputs` | the files of a batch's designs, and the part of the case that they replace |
//! | `lines` | reports as JSON Lines, and those that an earlier run left |
//! | `error` | [`SessionError`] |

mod designs;
mod error;
mod files;
mod inverted;
mod lines;
mod names;
mod outputs;
mod replaced_inputs;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

pub use designs::{DesignFiles, Shard, find_designs};
pub use error::{Exit, SessionError};
pub use files::{Folder, check_distinct, check_writable, remove_file, write_text};
pub use lines::{EarlierReports, ReportFile};
pub use outputs::{Loss, Outputs};
pub use replaced_inputs::ReplacedInputs;

use crate::backend::Backend;
use crate::case::LoadedCase;
use crate::mover::{Design, Mover, Outcome, Refused};
use crate::report::{self, RunReport, Seconds};

/// A loaded case with its mover.
pub struct Session<'a> {
    case: &'a LoadedCase,
    mover: Mover,
    backend: report::Backend,
    mesh: report::Mesh,
    /// Time of the mover's set-up, s.
    setup_seconds: f64,
}

/// A design that was moved and written.
#[non_exhaustive]
pub struct Finished {
    /// The report. Its `total` time is the sum of the times to read, to update and to write,
    /// without the set-up.
    pub report: RunReport,
    /// The files that were written, without the histogram.
    pub written: Vec<PathBuf>,
    /// Remarks on the result, one line each; see [`Warning`](crate::mover::Warning).
    pub warnings: Vec<String>,
    /// Whether the result may be used; an error holds its faults.
    pub verdict: Result<(), Refused>,
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
        let backend = backend.into();
        let setup = Instant::now();
        let built = case.builder().progress(progress).build(backend.clone());
        let mover = built.map_err(|error| case.about(error))?;
        let setup_seconds = setup.elapsed().as_secs_f64();
        let info = backend.info();
        let backend = report::Backend { kind: info.kind.to_owned(), adapter: info.adapter, driver: info.driver };
        Ok(Self { case, mover, backend, mesh: report::Mesh::of(&case.file.mesh), setup_seconds })
    }

    /// Moves the mesh to a design. Returns the outcome and the time of the update, in s.
    ///
    /// # Errors
    /// The design does not fit the mesh, or the backend failed.
    pub fn update(&mut self, design: &Design) -> Result<(Outcome, f64), SessionError> {
        let start = Instant::now();
        let outcome = self.mover.update(design).map_err(|error| self.case.about(error))?;
        Ok((outcome, start.elapsed().as_secs_f64()))
    }

    /// Moves the mesh to a design and writes the results.
    ///
    /// - `name`: the design's name, for the report
    /// - `read_seconds`: the time for reading the design's files, in s
    /// - `outputs`: the files to write
    ///
    /// # Errors
    /// The design does not fit the mesh, the backend failed, a vertex has no finite position, or a
    /// file cannot be written.
    pub fn finish(
        &mut self,
        design: &Design,
        name: Option<&str>,
        read_seconds: f64,
        outputs: &Outputs,
    ) -> Result<Finished, SessionError> {
        outputs.remove_earlier(&self.case.inputs)?;
        let (outcome, update) = self.update(design)?;
        let write = Instant::now();
        self.mover.tell("writing");
        let written = outputs.write(self.case, &outcome)?;
        let write = write.elapsed().as_secs_f64();
        outputs.write_histogram(self.case, name, &outcome)?;
        let verdict = outcome.check().map_err(|refused| in_files(refused, &outcome, &written));
        let setup = self.setup_seconds;
        let report = RunReport {
            idmesh: env!("CARGO_PKG_VERSION").to_owned(),
            case: self.case.case.path.display().to_string(),
            design: name.map(str::to_owned),
            backend: self.backend.clone(),
            mesh: self.mesh.clone(),
            stages: outcome.stages.clone(),
            families: outcome.families.clone(),
            profiles: outcome.profiles.clone(),
            solver: outcome.solver.clone(),
            path: outcome.path,
            valid: outcome.is_valid(),
            converged: outcome.converged,
            exit: verdict.as_ref().err().map_or(0, |refused| Exit::from(refused) as u8),
            error: verdict.as_ref().err().map(|refused| refused.message.clone()),
            hint: verdict.as_ref().err().and_then(|refused| refused.hint.clone()),
            smoothing: outcome.smoothed.map(|done| report::Smoothing { sweeps: done.sweeps, moved: done.moved }),
            seconds: Seconds { read: read_seconds, setup, update, write, total: read_seconds + update + write },
        };
        let warnings = outcome.warnings.iter().map(ToString::to_string).collect();
        Ok(Finished { report, written, warnings, verdict })
    }
}

/// Adds the names of the files with the invalid mesh to the message.
fn in_files(mut refused: Refused, outcome: &Outcome, written: &[PathBuf]) -> Refused {
    if !outcome.is_valid() && !written.is_empty() {
        let names: Vec<_> = written.iter().map(|path| path.display().to_string()).collect();
        refused.message += &format!("; the mesh is in {}", names.join(", "));
    }
    refused
}
