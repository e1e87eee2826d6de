//! What a stage is, and what every stage is set up from.

use glam::DVec3;

use crate::{
    backend::Backend,
    families::Families,
    mesh::{FamilyId, TetMesh, half_edge::Surface},
    relaxation::{Method, Stopping},
};

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
    pub stopping: Stopping,
}
