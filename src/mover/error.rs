//! [`MoveError`]: why a mover cannot be set up, or cannot move a design.

use glam::DVec3;
use thiserror::Error;

use crate::{
    backend::BackendError,
    families::SetupError,
    memory::MemoryError,
    mesh::MeshError,
    profile::ProfileError,
    stage::StageError,
    text::figures::place,
    text::nearest::{did_you_mean, quoted},
};

/// An error of a set-up or an update.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MoveError {
    /// The mesh is not valid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The roles or the old profiles do not fit the mesh.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// A wing's new profiles cannot be used.
    #[error("profiles of `{family}`: {error}")]
    Profiles {
        /// The wing.
        family: String,
        /// The cause.
        error: ProfileError,
    },
    /// A design has profiles for a name that is no wing of the mover, or displacements for a name
    /// that is no prescribed family.
    #[error(
        "the design has {} for `{name}`, which is none of the mover's{}; it has {}",
        if *prescribed { "a displacement" } else { "profiles" },
        did_you_mean(name, known).unwrap_or_default(),
        if known.is_empty() { "none".to_owned() } else { quoted(known) }
    )]
    Unknown {
        /// The name.
        name: String,
        /// Whether the design has displacements for the name. Otherwise the design has profiles for
        /// the name.
        prescribed: bool,
        /// The names of the mover's prescribed families, or of its wings.
        known: Vec<String>,
    },
    /// A prescribed family has no displacements, or a wrong number of displacements.
    #[error("family `{family}` has {expected} vertices, but {found} prescribed displacements were given")]
    Prescribed {
        /// The family.
        family: String,
        /// Vertices of the family.
        expected: usize,
        /// Displacements given.
        found: usize,
    },
    /// Two prescribed families move a vertex that both have to different places.
    #[error(
        "the prescribed families `{family}` and `{other}` share vertex {vertex} at {}, and its displacements \
         differ by {difference:.3e}, expected the same from both",
        place(*position)
    )]
    Disagree {
        /// The first family.
        family: String,
        /// The second family.
        other: String,
        /// The vertex, counted from 0.
        vertex: u32,
        /// Original position of the vertex.
        position: DVec3,
        /// Distance between the two places, in the mesh's unit.
        difference: f64,
    },
    /// The mesh is too large for the memory.
    #[error("{cells}: {error}")]
    Memory {
        /// The cells of the mesh, such as `12 tets`.
        cells: String,
        /// The bytes needed and available.
        error: MemoryError,
    },
    /// The progress function stopped the update; see
    /// [`Mover::update_telling`](super::Mover::update_telling).
    #[error("the update was stopped")]
    Stopped,
    /// A stage could not be run: the memory does not suffice for a path of steps, or a junction
    /// cannot slide.
    #[error(transparent)]
    Stage(StageError),
    /// The backend failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
}

impl From<StageError> for MoveError {
    fn from(error: StageError) -> Self {
        match error {
            StageError::Backend(error) => error.into(),
            error => Self::Stage(error),
        }
    }
}
