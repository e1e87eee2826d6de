//! How a command fails: one line, perhaps a hint, and an exit code.

use crate::backend::BackendError;
use crate::case::CaseError;
use crate::case::displacement::DisplacementError;
use crate::formats::{ReadError, WriteError};
use crate::mover::MoveError;

/// The exit codes of a failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Exit {
    /// `compare`: out of tolerance. `batch`: a design failed.
    Unfit = 1,
    /// A file or the case is wrong, or an output cannot be written.
    BadInput = 3,
    /// A relaxation did not converge.
    NotConverged = 4,
    /// Inverted tets remain.
    Inverted = 5,
    /// No usable GPU.
    NoGpu = 6,
}

/// Why a command ends early.
#[derive(Clone, Debug)]
pub(super) struct Failure {
    pub(super) exit: Exit,
    pub(super) message: String,
    pub(super) hint: Option<String>,
}

impl Failure {
    pub(super) fn new(exit: Exit, message: impl Into<String>) -> Self {
        Self { exit, message: message.into(), hint: None }
    }

    pub(super) fn bad_input(message: impl Into<String>) -> Self {
        Self::new(Exit::BadInput, message)
    }

    pub(super) fn with_hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Puts a file's name before the message.
    pub(super) fn in_file(mut self, path: &std::path::Path) -> Self {
        self.message = format!("{}: {}", path.display(), self.message);
        self
    }
}

impl From<CaseError> for Failure {
    fn from(error: CaseError) -> Self {
        let failure = Self::bad_input(error.to_string());
        match error {
            CaseError::Families { .. } => {
                failure.with_hint("every family of the mesh needs a table [family.NAME] with a role")
            }
            _ => failure,
        }
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        Self::bad_input(error.to_string())
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        Self::bad_input(error.to_string())
    }
}

impl From<DisplacementError> for Failure {
    fn from(error: DisplacementError) -> Self {
        Self::bad_input(error.to_string())
    }
}

impl From<BackendError> for Failure {
    fn from(error: BackendError) -> Self {
        let failure = Self::new(Exit::NoGpu, error.to_string());
        match error {
            BackendError::NoAdapter(_) => {
                failure.with_hint("`idmesh adapters` lists the GPUs; --backend cpu needs none")
            }
            _ => failure.with_hint("--backend cpu computes without a GPU"),
        }
    }
}

impl From<MoveError> for Failure {
    fn from(error: MoveError) -> Self {
        match error {
            MoveError::Backend(error) => error.into(),
            error @ MoveError::Stage(_) => Self::bad_input(error.to_string())
                .with_hint("max_steps = 1 under [volume] makes do with one jump, come what may"),
            error => Self::bad_input(error.to_string()),
        }
    }
}
