//! [`ClaimError`]: what is wrong with a folder of claims.

use std::path::PathBuf;

use thiserror::Error;

/// An error of a folder of claims.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ClaimError {
    /// The file that says what the claims are for is damaged.
    #[error("{}: expected the record of a claim folder of idmesh", path.display())]
    NoPurpose {
        /// The file.
        path: PathBuf,
    },
    /// The folder holds claims for another case, other inputs or other outputs.
    #[error("the claims in {} are for {}, not for {}", folder.display(), theirs, ours)]
    OtherBatch {
        /// The folder.
        folder: PathBuf,
        /// What the folder is for.
        theirs: String,
        /// What it was to be for.
        ours: String,
    },
    /// A design of the same name was claimed with other contents.
    #[error("the design {design} was claimed with other contents than it has now, see {}", path.display())]
    OtherDesign {
        /// The design.
        design: String,
        /// The claim.
        path: PathBuf,
    },
    /// Another job took a design over while this one moved the mesh.
    #[error("another job has taken the design over, see {}", path.display())]
    Lost {
        /// The claim that this job held.
        path: PathBuf,
    },
    /// Several jobs ended with one design in their hands.
    #[error("{times} jobs ended while they worked on this design, the last one as told in {}", path.display())]
    GivenUp {
        /// Number of jobs.
        times: u32,
        /// The last claim.
        path: PathBuf,
    },
}

impl ClaimError {
    /// A remedy that the user may try.
    pub(crate) fn hint(&self) -> &'static str {
        match self {
            Self::NoPurpose { .. } | Self::OtherBatch { .. } => {
                "each case, with its designs and its output folder, has a claim folder of its own"
            }
            Self::OtherDesign { .. } => {
                "--resume does designs again that have changed since they were done; two lists of designs need two claim folders"
            }
            Self::Lost { .. } => "a longer --claim-expires keeps the claims of jobs that stand still",
            Self::GivenUp { .. } => "run the design alone to see its end; --resume tries it again",
        }
    }
}
