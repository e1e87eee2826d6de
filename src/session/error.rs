//! [`SessionError`]: the errors of a session, each with a hint for the user.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::ClaimError;
use crate::backend::BackendError;
use crate::case::{CaseError, LoadError, SeedError, displacement::DisplacementError};
use crate::families::guess::NoWing;
use crate::formats::{PlaceError, WriteError};
use crate::mover::{MoveError, NotDifferentiable, ProductError, Refused, StageError, Why};
use crate::profile::ProfileError;

/// An error of a session.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The case, its files or a design cannot be used.
    #[error(transparent)]
    Load(Box<LoadError>),
    /// Nothing in a mesh looks like a wing, so no case can be made of it.
    #[error("{}: {error}", path.display())]
    NoWing {
        /// The mesh.
        path: PathBuf,
        /// The cause.
        error: Box<NoWing>,
    },
    /// A file that would be made is there already.
    #[error("{} is there already, and would be lost", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The backend is not available, or it failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// A mesh cannot be written.
    #[error(transparent)]
    Mesh(#[from] WriteError),
    /// A file other than those of the case cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    CannotRead {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// A file other than a mesh, or a folder, cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    CannotWrite {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// A report cannot be made.
    #[error("cannot write the report: {0}")]
    Report(#[from] serde_json::Error),
    /// An output has the name of an input.
    #[error("the output {} would overwrite the input {}, expected another name", output.display(), input.display())]
    Overwrites {
        /// The output.
        output: PathBuf,
        /// The input.
        input: PathBuf,
    },
    /// Two outputs have one name.
    #[error("{} is the name of two outputs", path.display())]
    TwoOutputs {
        /// The name.
        path: PathBuf,
    },
    /// The name of an output has no extension, before which a design's name could stand.
    #[error("the output {} has no extension to put after a design's name", path.display())]
    NoExtension {
        /// The output.
        path: PathBuf,
    },
    /// No mesh was written, because vertices have no finite position.
    #[error("{0}; no mesh was written")]
    Refused(Refused),
    /// The seed of a gradient cannot be used.
    #[error(transparent)]
    Seed(#[from] SeedError),
    /// A result has no derivative, or its product failed.
    #[error(transparent)]
    Product(#[from] ProductError),
    /// The folder or the list of designs cannot be read.
    #[error("cannot read the designs {}: {source}", path.display())]
    UnreadableDesigns {
        /// The folder or the list.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// The list of designs has the extension of a design, and names no file.
    #[error(
        "{}: no line is the path of a file, expected a folder of designs, or a text file with the path of a design in \
         each line: is this a design itself?",
        path.display()
    )]
    NoList {
        /// The file.
        path: PathBuf,
    },
    /// The folder or the list of designs is empty.
    #[error("{}: no designs, expected at least one", path.display())]
    NoDesigns {
        /// The folder or the list.
        path: PathBuf,
    },
    /// Two designs would have results of one name.
    #[error(
        "the results of {} and {} would both be named {name}, expected different names", one.display(), other.display()
    )]
    SameName {
        /// The name.
        name: String,
        /// The first design.
        one: PathBuf,
        /// The second design.
        other: PathBuf,
    },
    /// The name of a design's file does not say which table it replaces.
    #[error(
        "{}: the case has the tables {}, expected a folder with a file for each, or files named NAME.{}.csv",
        path.display(),
        tables.iter().map(|table| format!("[profiles.{table}]")).collect::<Vec<_>>().join(", "),
        tables[0]
    )]
    NoTable {
        /// The file.
        path: PathBuf,
        /// The tables of the case.
        tables: Vec<String>,
    },
    /// A design is a folder where a file is wanted.
    #[error("the design {} is a folder, expected one file", path.display())]
    IsFolder {
        /// The folder.
        path: PathBuf,
    },
    /// The file of a design is a pipe, a device or a folder.
    #[error("the design {} is {}, expected a file", path.display(), kind_of(path))]
    NotAFile {
        /// The path.
        path: PathBuf,
    },
    /// A design has no file for a table.
    #[error("the design {} has no file for the table [profiles.{table}]", path.display())]
    LacksTable {
        /// The design.
        path: PathBuf,
        /// The table.
        table: String,
    },
    /// The case holds nothing that a design could replace.
    #[error(
        "{}: no table [profiles.NAME] and {prescribed} prescribed families, expected tables whose profiles the designs \
         replace, or one prescribed family",
        path.display()
    )]
    NothingVaries {
        /// The case file.
        path: PathBuf,
        /// Number of prescribed families of the case.
        prescribed: usize,
    },
    /// A profile of a design lies in another plane than the old profile that was cut from the mesh.
    #[error(
        "{}: profiles of `{wing}`: profile {profile} is up to {off:.1e} away from the plane at which the case's new profiles \
         let the old one be cut",
        path.display()
    )]
    OtherPlane {
        /// The design's file.
        path: PathBuf,
        /// The wing.
        wing: String,
        /// Number of the profile.
        profile: i64,
        /// Largest distance of the profile's points from the plane, in the mesh's unit.
        off: f64,
    },
    /// A design is one airfoil, and the case has several files of profiles, whose placements it
    /// could take.
    #[error(
        "{}: one airfoil in place of the {n_files} files that `new` of [profiles.{wing}] lists: which of them it replaces \
         cannot be told",
        path.display()
    )]
    WhichPlacement {
        /// The design's file.
        path: PathBuf,
        /// Number of the case's files.
        n_files: usize,
        /// The wing.
        wing: String,
    },
    /// Another job writes reports into the same file, which this job would replace.
    #[error("another job writes its reports into {} now, and this one would replace them", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// A folder of claims cannot be used, or a claim was lost.
    #[error(transparent)]
    Claim(#[from] ClaimError),
    /// A file of reports is the report of one run.
    #[error("{} is the report of one run, expected a file with the report of a design in each line", path.display())]
    OneRun {
        /// The file.
        path: PathBuf,
    },
    /// A line of a file of reports is no report.
    #[error("{}: line {line} is no report of a design", path.display())]
    NoReport {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
    },
}

/// What a path is, in words.
fn kind_of(path: &Path) -> &'static str {
    if path.is_dir() { "a folder without a file for a table of the case" } else { "a pipe or a device" }
}

/// The exit codes of a failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// `compare`: out of tolerance. `batch`: a design failed.
    Failed = 1,
    /// A file or the case is wrong, or an output cannot be written.
    BadInput = 3,
    /// A relaxation did not converge.
    NotConverged = 4,
    /// The moved mesh is not valid, for example because of inverted tets.
    Inverted = 5,
    /// No usable GPU.
    NoGpu = 6,
    /// `gradient`: the result has no derivative.
    NotDifferentiable = 7,
}

impl From<&Refused> for Exit {
    fn from(refused: &Refused) -> Self {
        match refused.why {
            Why::Invalid => Self::Inverted,
            Why::NotConverged | Why::NotFinite => Self::NotConverged,
        }
    }
}

impl From<LoadError> for SessionError {
    fn from(error: LoadError) -> Self {
        Self::Load(Box::new(error))
    }
}

impl From<PlaceError> for SessionError {
    fn from(error: PlaceError) -> Self {
        WriteError::from(error).into()
    }
}

impl From<DisplacementError> for SessionError {
    fn from(error: DisplacementError) -> Self {
        LoadError::from(error).into()
    }
}

impl SessionError {
    /// Makes the error of a design's profiles.
    pub(super) fn of_profiles(path: &Path, wing: &str, error: ProfileError) -> Self {
        LoadError::Profiles { paths: vec![path.to_path_buf()], wing: wing.to_owned(), error }.into()
    }

    /// The exit code of a command that ends with this error.
    pub fn exit(&self) -> Exit {
        match self {
            Self::Refused(refused) => refused.into(),
            Self::Product(ProductError::NotDifferentiable(_)) => Exit::NotDifferentiable,
            Self::Product(ProductError::NotConverged { .. }) => Exit::NotConverged,
            error if error.backend().is_some() => Exit::NoGpu,
            _ => Exit::BadInput,
        }
    }

    /// Whether the memory does not suffice for a mover.
    pub fn is_of_memory(&self) -> bool {
        matches!(self, Self::Load(error) if matches!(error.of_mover(), Some(MoveError::Memory { .. })))
    }

    /// The backend's error, if the backend failed.
    pub fn backend(&self) -> Option<&BackendError> {
        match self {
            Self::Backend(error) | Self::Product(ProductError::Backend(error)) => Some(error),
            Self::Load(error) => match error.of_mover()? {
                MoveError::Backend(error) => Some(error),
                _ => None,
            },
            _ => None,
        }
    }

    /// A remedy that the user may try.
    pub fn hint(&self) -> Option<String> {
        let hint = match self {
            Self::Load(error) if matches!(**error, LoadError::Case(CaseError::Families { .. })) => {
                "every family of the mesh needs a table [family.NAME] with a role"
            }
            Self::Load(error) if matches!(error.of_mover(), Some(MoveError::Stage(StageError::Junction { .. }))) => {
                "junction = \"glued\" keeps the curve where the surface under it has it: in the table of the rigid family, if \
                 the curve slides on one, else in the part's table"
            }
            Self::Load(error) if matches!(error.of_mover(), Some(MoveError::Stage(_))) => {
                "max_steps = 1 under [volume] makes do with one jump, come what may"
            }
            Self::NoWing { error, .. } => match **error {
                NoWing::NoneFound { .. } => "say which families are the wing: --wing NAME, or --wing UPPER,LOWER",
                NoWing::NotCut { .. } => "name all families that make up the wing's sections: --wing UPPER,LOWER",
            },
            Self::Exists { .. } => "--force replaces it; --output writes elsewhere",
            Self::NoExtension { .. } => "`batch` writes single files, such as moved.msh or moved.vtu",
            Self::LacksTable { table, .. } => {
                return Some(format!(
                    "a design of several tables is a folder with {table}.csv and the others, or NAME.{table}.csv"
                ));
            }
            Self::OtherPlane { .. } => "name the old profiles in the case: old = \"FILE\"",
            Self::WhichPlacement { .. } => {
                "a design replaces all sections: give all in one CSV; or let the case have one airfoil with several \
                 placements ([[profiles.NAME.placement.\"FILE\"]]), which the design's airfoil then takes"
            }
            Self::InUse { .. } => {
                "jobs share a file of reports with --resume, or with --shard if they share the designs; else each has its own"
            }
            Self::Claim(error) => error.hint(),
            Self::OneRun { .. } => "`idmesh run CASE --report FILE.html` makes the page of one run",
            Self::NoReport { .. } => {
                "expected the file of `idmesh batch --json`, with the report of a design in each line"
            }
            Self::Product(ProductError::NotDifferentiable(NotDifferentiable::Kink { .. })) => {
                "--frozen takes the derivative by the affine image; `match = \"points\"` under [profiles.NAME] has no such kink"
            }
            Self::Refused(refused) => return refused.hint.clone(),
            Self::Product(ProductError::NotDifferentiable(
                NotDifferentiable::Steps { .. } | NotDifferentiable::Optimised { .. },
            )) => {
                "`target = \"off\"` under [quality] turns local optimisation off, and `max_steps = 1` under [volume] allows \
                 one step; --frozen takes the frozen derivative"
            }
            _ => match self.backend()? {
                BackendError::NoAdapter(_) => "`idmesh adapters` lists the GPUs; --backend cpu needs none",
                _ => "--backend cpu computes without a GPU",
            },
        };
        Some(hint.to_owned())
    }
}
