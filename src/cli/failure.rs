//! [`Failure`]: the message, the hint and the exit code of a command that fails.

use std::path::Path;

use crate::backend::BackendError;
use crate::case::{LoadError, NamedFiles};
use crate::formats::{PlaceError, ReadError, WriteError};
use crate::mover::Refused;
pub(super) use crate::session::Exit;
use crate::session::SessionError;

/// The failure of a command.
#[derive(Clone, Debug)]
pub(super) struct Failure {
    pub(super) exit: Exit,
    pub(super) message: String,
    /// Lines that follow the message.
    pub(super) lines: Vec<String>,
    pub(super) hint: Option<String>,
}

impl Failure {
    pub(super) fn new(exit: Exit, message: impl Into<String>) -> Self {
        Self { exit, message: message.into(), lines: Vec::new(), hint: None }
    }

    pub(super) fn bad_input(message: impl Into<String>) -> Self {
        Self::new(Exit::BadInput, message)
    }

    /// Says that results of an earlier run may have stayed, because the case file does not name
    /// them, or not for sure.
    ///
    /// - `named`: the files that the case names; `None` if nothing can be read from it
    pub(super) fn with_results_left(mut self, case: &Path, named: Option<&NamedFiles>) -> Self {
        let told = match named {
            Some(named) if named.are_outputs_sure => return self,
            _ if !case.is_file() => return self,
            Some(named) if !named.output.mesh.is_empty() => {
                "results of an earlier run may be left, because a mistake may hide their names"
            }
            _ => "no results of an earlier run were removed, because the file does not name them",
        };
        self.message += &format!("; {told}");
        self
    }

    /// Puts a file's name before the message.
    pub(super) fn in_file(mut self, path: &Path) -> Self {
        self.message = format!("{}: {}", path.display(), self.message);
        self
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

impl From<PlaceError> for Failure {
    fn from(error: PlaceError) -> Self {
        SessionError::from(error).into()
    }
}

impl From<LoadError> for Failure {
    fn from(error: LoadError) -> Self {
        SessionError::from(error).into()
    }
}

impl From<BackendError> for Failure {
    fn from(error: BackendError) -> Self {
        SessionError::from(error).into()
    }
}

impl From<SessionError> for Failure {
    fn from(error: SessionError) -> Self {
        Self { exit: error.exit(), message: error.to_string(), lines: Vec::new(), hint: error.hint() }
    }
}

impl From<Refused> for Failure {
    fn from(refused: Refused) -> Self {
        let exit = Exit::from(&refused);
        match refused.lines() {
            lines if lines.len() > 1 => {
                let message = format!("the moved mesh may not be used, for {} reasons:", refused.faults.len());
                Self { exit, message, lines, hint: refused.hint }
            }
            _ => Self { exit, message: refused.message, lines: Vec::new(), hint: refused.hint },
        }
    }
}
