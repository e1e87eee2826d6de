//! What a stage is, and what every stage is set up from.

use glam::DVec3;
use thiserror::Error;

use crate::{
    backend::{Backend, BackendError},
    families::Families,
    memory::MemoryError,
    mesh::{Displacement, FamilyId, TetMesh, half_edge::Surface},
    relaxation::{Convergence, Method, Stopping},
};

/// One stage of the way from a design to a moved mesh: it places the vertices of its families, or
/// all that are left.
///
/// A stage is set up once per mesh by its `new`, which does what depends on the mesh alone, and run
/// once per design. Each run starts from the undeformed mesh. A tangent and an adjoint of `run`
/// will stand beside it later.
pub trait Stage {
    /// Moves the stage's vertices after those that the stages before it have moved.
    ///
    /// - `set_up`: what the stage was set up from
    /// - `displacement` `[n_vertices]`, in the unit of the mesh: what earlier stages have made of
    ///   it; the stage changes its own vertices'
    /// - `observer`: hears what a long stage does in the meantime
    ///
    /// # Errors
    /// The backend failed, or there is no memory for what the design needs. A relaxation that did
    /// not converge is a result.
    fn run(
        &mut self,
        set_up: &SetUp,
        displacement: &mut Displacement,
        observer: &dyn Fn(&str),
    ) -> Result<Convergence, StageError>;
}

/// Why a stage could not be run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StageError {
    /// One jump inverts tets, and the memory does not suffice for a path of steps.
    #[error("{n_tets} tets, moved in steps as one jump inverts some: {error}")]
    Memory {
        /// Tets of the mesh.
        n_tets: usize,
        /// What is lacking.
        error: MemoryError,
    },
    /// The backend failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
}

/// What a design would do to a vertex that another family places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// The family that would move it.
    pub family: FamilyId,
    /// The vertex.
    pub vertex: u32,
    /// Where to.
    pub displacement: DVec3,
}

/// What every stage is set up from, and gets again when it is run.
#[derive(Clone, Copy)]
pub struct SetUp<'a> {
    /// The undeformed mesh.
    pub mesh: &'a TetMesh,
    /// Its oriented boundary.
    pub surface: &'a Surface,
    /// What its families do.
    pub families: &'a Families,
    /// Where networks are relaxed.
    pub backend: &'a dyn Backend,
    /// How they are relaxed.
    pub method: Method,
    /// How far they will be.
    pub stopping: Stopping,
}
