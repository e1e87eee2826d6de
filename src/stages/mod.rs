//! The pipeline: one file a stage, run in this order.
//!
//! | stage | moves | held | paper |
//! |---|---|---|---|
//! | [`wing`] | wing vertices, by their profiles; the junction onto its surface | - | 3.1 |
//! | [`trailing_edge`] | the rest of the trailing edge's boundary curve, then its inside | what the wing moved | 3.2 |
//! | [`wingtip`] | the tip's inside, pulled back by conservative springs | its boundary | 3.3 |
//! | [`carenage`] | carenage vertices, sliding on the original surface | its boundary | 3.4 |
//! | [`planes`] | vertices of plane families, in their plane | their boundary | - |
//! | [`volume`] | everything else; plane families slide on | the other surfaces | 3.4, last paragraph |
//!
//! [`sliding`] says where surface vertices may go afterwards, in local optimisation.
//!
//! A stage is set up once per mesh and run once per design on a [`Motion`]. A vertex on several families belongs to the
//! first of them in the order fixed, prescribed, wing, trailing edge, wingtip, carenage, plane; the plane families it
//! touches still limit it.

pub mod best_motion;
pub mod carenage;
pub mod families;
pub mod interior;
pub mod lattice;
pub mod partners;
pub mod patch;
pub mod planes;
pub mod rotation;
pub mod route;
pub mod shape;
pub mod sliding;
pub mod start;
pub mod trailing_edge;
pub mod volume;
pub mod wing;
pub mod wingtip;

pub use families::{Families, Owner, Role, SetupError, TipStart};
pub use start::Start;
pub use wing::WingProfiles;

use glam::DVec3;

use crate::{
    backend::Backend,
    mesh::{FamilyId, TetMesh, half_edge::Surface},
    relaxation::{Accuracy, Method},
};

/// Displacement of every vertex of the mesh `[n_vertices]`, filled in stage by stage.
pub type Motion = Vec<DVec3>;

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

/// What every stage is set up from.
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
    pub accuracy: Accuracy,
}
