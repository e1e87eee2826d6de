//! [`LoadError`]: why a case and its files cannot be used.

use std::path::PathBuf;

use thiserror::Error;

use super::CaseError;
use super::displacement::DisplacementError;
use crate::formats::ReadError;
use crate::mover::MoveError;
use crate::profile::ProfileError;

/// An error of a case and of the files that it names.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The case file is wrong, or its families are not those of the mesh.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The mesh file cannot be read.
    #[error(transparent)]
    Mesh(#[from] ReadError),
    /// The mesh file calls two families cyclic, but only one of them has the role plane.
    #[error(
        "the mesh calls `{family}` and `{neighbour}` cyclic, each the neighbour of the other, but one has the role plane \
         and the other has not, expected it for both or none"
    )]
    Cyclic {
        /// The first family.
        family: String,
        /// The second family.
        neighbour: String,
    },
    /// A table of displacements is wrong, or does not fit its family.
    #[error(transparent)]
    Displacement(#[from] DisplacementError),
    /// A file of profiles cannot be read.
    #[error("{}: cannot read the profiles: {source}", path.display())]
    UnreadableProfiles {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// Profiles in a file are wrong. The error names the place.
    #[error(transparent)]
    ProfileFile(ProfileError),
    /// Several files of profiles do not fit together.
    #[error("{}: {error}", list(paths))]
    ProfileFiles {
        /// The files.
        paths: Vec<PathBuf>,
        /// The cause.
        error: ProfileError,
    },
    /// The profiles of a wing do not fit the mesh or its other profiles, or cannot be cut from the
    /// mesh.
    #[error("{}: profiles of `{wing}`: {error}", list(paths))]
    Profiles {
        /// The file of the profile at fault, or all files of the new profiles.
        paths: Vec<PathBuf>,
        /// The wing.
        wing: String,
        /// The cause.
        error: ProfileError,
    },
    /// The roles or the profiles do not fit the mesh, or a design does not fit both.
    #[error("{}: {error}", path.display())]
    InFile {
        /// The file at fault: the mesh or the case.
        path: PathBuf,
        /// The cause.
        error: Box<MoveError>,
    },
    /// The mover failed, and no file is at fault.
    #[error(transparent)]
    Move(Box<MoveError>),
}

impl LoadError {
    /// The mover's error, if the mover failed.
    pub fn of_mover(&self) -> Option<&MoveError> {
        match self {
            Self::InFile { error, .. } | Self::Move(error) => Some(error),
            _ => None,
        }
    }
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}
