//! The trait [`Stage`], and [`SetUp`], from which every stage is set up.
//!
//! [`crate::stages`] and [`crate::volume`] hold the stages.

use std::{borrow::Cow, collections::BTreeMap, sync::Arc};

use glam::DVec3;
use thiserror::Error;

use crate::{
    backend::{Backend, BackendError},
    families::Families,
    memory::MemoryError,
    mesh::{CornerCells, Displacement, FamilyId, TetMesh, half_edge::Surface},
    profile::Profile,
    relaxation::{Convergence, Method, Stopping},
    text::figures::place,
};

/// A stage of an update. A stage places the vertices of its families. The last stage, the volume,
/// places all other vertices.
///
/// The function `new` of a stage does everything that depends on the mesh alone, once per mesh.
/// [`Stage::run`] is called once per design. Each run starts from the undeformed mesh.
pub trait Stage {
    /// Moves the vertices of the stage. Earlier stages have moved their vertices before.
    ///
    /// - `set_up`: the same as for `new`
    /// - `displacement` `[n_vertices]`: in the mesh's unit; the stage changes the displacements of
    ///   its own vertices
    /// - `observer`: gets the names of the steps of a long stage as they begin
    ///
    /// # Errors
    /// - [`StageError::Backend`]: the backend failed
    /// - [`StageError::Memory`]: the design needs a path of steps, and the memory does not suffice
    ///   for it
    /// - [`StageError::Junction`]: a junction cannot slide in this design
    ///
    /// A relaxation that did not converge is no error; see [`Convergence::converged`].
    fn run(
        &mut self,
        set_up: &SetUp,
        displacement: &mut Displacement,
        observer: &dyn Fn(&str),
    ) -> Result<Convergence, StageError>;
}

/// The derivative of a stage, times a vector. The matrices are those of the undeformed mesh and
/// serve every design, so a product changes no later update.
///
/// A stage without it has no products yet; [`crate::stages::STAGES`] tells.
pub trait Products: Stage {
    /// Puts what products need of the last run into `kept`. A stage of which nothing is needed has
    /// nothing to do.
    fn keep(&mut self, _kept: &mut Kept) {}

    /// Change of the displacement that [`Stage::run`] makes.
    ///
    /// - `set_up`: the same as for `run`
    /// - `kept`: of the run
    /// - `change` `[n_vertices]`: change of the displacement, in any unit; the stage sets the
    ///   change of its own vertices
    /// - `stopping`: its tolerance is relative to the argument
    ///
    /// # Errors
    /// See [`NoProduct`].
    fn forward(
        &mut self,
        set_up: &SetUp,
        kept: &Kept,
        change: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct>;

    /// The transpose of [`Products::forward`].
    ///
    /// - `gradient` `[n_vertices]`: on entry the derivative of a number by the displacement after
    ///   the stage, on exit by the displacement before the stage, in any unit; zero at the stage's
    ///   own vertices
    /// - others: as for `forward`
    ///
    /// # Errors
    /// See [`NoProduct`].
    fn reverse(
        &mut self,
        set_up: &SetUp,
        kept: &Kept,
        gradient: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct>;
}

/// What the products of an update need of it: 48 bytes a vertex, and what the design has.
#[derive(Clone, Debug, Default)]
pub struct Kept {
    /// The displacement of the surfaces before the volume stage `[n_vertices]`, in the mesh's unit.
    pub surfaces: Displacement,
    /// The rotation vector of each vertex `[n_vertices]`, in radians. Empty if the springs are not
    /// rotation-aware, and if a device kept them; products then spread them again.
    pub rotations: Vec<DVec3>,
    /// The new profiles of each wing, by its name, in the order of the design.
    pub profiles: BTreeMap<String, Vec<Profile>>,
    /// For each wing, the displacement of its junction's vertices before they slid, in the mesh's
    /// unit.
    pub junctions: Vec<Vec<DVec3>>,
    /// The vertices that slid with the junction of a part, each with its displacement before that,
    /// in the mesh's unit.
    pub slid: Vec<(u32, DVec3)>,
}

impl Kept {
    /// [`Self::surfaces`] before parts slid on them.
    pub fn before_slides(&self) -> Cow<'_, [DVec3]> {
        let mut before = Cow::Borrowed(&self.surfaces[..]);
        if !self.slid.is_empty() {
            let before = before.to_mut();
            self.slid.iter().for_each(|&(vertex, displacement)| before[vertex as usize] = displacement);
        }
        before
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        let points = self.profiles.values().flatten().map(|profile| profile.points.capacity()).sum::<usize>();
        let junctions = self.junctions.iter().map(Vec::capacity).sum::<usize>();
        size_of::<DVec3>() * (self.surfaces.capacity() + self.rotations.capacity() + points + junctions)
            + size_of::<(u32, DVec3)>() * self.slid.capacity()
    }
}

/// Why a stage has no product.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum NoProduct {
    /// Several rotations fit the motion of the surface around a vertex equally well.
    #[error("several rotations fit the motion of the surface around vertex {vertex} equally well")]
    Rotation {
        /// The vertex.
        vertex: u32,
    },
    /// A vertex of a carenage slid to an end of the carenage, or to an edge too sharp to slide
    /// over.
    #[error("vertex {vertex} slid to an end or to a sharp edge of its carenage")]
    Carenage {
        /// The vertex.
        vertex: u32,
    },
    /// A vertex has a place that does not change smoothly.
    #[error("vertex {vertex} {why}")]
    Vertex {
        /// The vertex.
        vertex: u32,
        /// The cause.
        why: &'static str,
    },
    /// The match of a new profile has no derivative.
    #[error("profile {profile} of wing `{wing}` {why}")]
    Match {
        /// The wing.
        wing: String,
        /// The number of the profile.
        profile: i64,
        /// The cause.
        why: &'static str,
    },
    /// The backend failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
}

/// An error of a stage's run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StageError {
    /// One jump inverts tets, and the memory does not suffice for a path of steps.
    #[error("{cells}, moved in steps as one jump inverts some: {error}")]
    Memory {
        /// The cells of the mesh, such as `12 tets`.
        cells: String,
        /// The bytes needed and available.
        error: MemoryError,
    },
    /// A part whose junction slides does not meet the moved wing or body.
    #[error("the junction of `{family}` cannot slide on `{other}`: the part {why}, at {}", place(*at))]
    Junction {
        /// The part.
        family: String,
        /// The family on which it slides.
        other: String,
        /// Original position of the vertex.
        at: DVec3,
        /// The cause.
        why: String,
    },
    /// The backend failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
}

/// A displacement of a vertex by a family that does not place the vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// The family with which the design moves the vertex.
    pub family: FamilyId,
    /// The vertex.
    pub vertex: u32,
    /// The displacement by this family, in the mesh's unit.
    pub displacement: DVec3,
}

/// The arguments of every stage, at its set-up and at each run.
#[derive(Clone, Copy)]
pub struct SetUp<'a> {
    /// The undeformed mesh. Its tets are those of the mesh and the corner tets of other cells.
    pub mesh: &'a TetMesh,
    /// The cells behind the tets of `mesh`.
    pub cells: &'a Arc<CornerCells>,
    /// The mesh's oriented boundary.
    pub surface: &'a Surface,
    /// The roles of the mesh's families.
    pub families: &'a Families,
    /// The backend that relaxes networks.
    pub backend: &'a dyn Backend,
    /// The method of relaxations.
    pub method: Method,
    /// The stopping rule of relaxations.
    pub stopping: Stopping,
}
