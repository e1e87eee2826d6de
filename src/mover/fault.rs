//! [`Fault`]: one reason why a moved mesh may not be used, for programs to read.

use glam::DVec3;
use serde::{Serialize, Serializer};

use crate::mesh::TetMesh;

/// One reason why a moved mesh may not be used.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Fault {
    /// The condition that does not hold.
    pub kind: FaultKind,
    /// The number of entities at fault; see [`FaultKind`].
    pub count: usize,
    /// The place of the worst entity. `None` if the fault has no place.
    pub place: Option<Place>,
    /// The fault in words.
    pub message: String,
}

/// The conditions of a mesh that may be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultKind {
    /// Vertices have no finite position. Counts vertices.
    NotFinite,
    /// Tets are inverted. Counts tets.
    Inverted,
    /// The surface self-intersects. Counts triangles.
    SelfIntersecting,
    /// Vertices left the carenage or the plane on which they slide. Counts vertices.
    OffSurface,
    /// Partners in periodic planes have parted. Counts pairs of vertices.
    Parted,
    /// A family holds vertices back that the design moves. Counts vertices.
    HeldBack,
    /// A rigid family is torn from a family that it hangs from. Counts rigid families.
    Strained,
    /// The surface of a rigid family is creased beside a junction that slides. Counts edges.
    Creased,
    /// The junction of a wing misses the surface that it shares with the wing. Counts vertices.
    MissedSurface,
    /// A wing misses its new profiles. Counts wings.
    MissedProfiles,
    /// A measure of a solver is beyond its limit. Counts faces, cells or vertices beyond it.
    BeyondLimit,
    /// Relaxations did not converge. Counts stages.
    NotConverged,
}

impl FaultKind {
    /// The kind as reports name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::NotFinite => "not-finite",
            Self::Inverted => "inverted",
            Self::SelfIntersecting => "self-intersecting",
            Self::OffSurface => "off-surface",
            Self::Parted => "parted",
            Self::HeldBack => "held-back",
            Self::Strained => "strained",
            Self::Creased => "creased",
            Self::MissedSurface => "missed-surface",
            Self::MissedProfiles => "missed-profiles",
            Self::BeyondLimit => "beyond-limit",
            Self::NotConverged => "not-converged",
        }
    }
}

impl Serialize for FaultKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// A place in the moved mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Place {
    /// Coordinates, in the mesh's unit.
    pub at: [f64; 3],
    /// The family there, or the nearest one.
    pub family: Option<String>,
}

impl Place {
    pub(super) fn new(at: DVec3, family: Option<&str>) -> Self {
        Self { at: at.to_array(), family: family.map(str::to_owned) }
    }

    /// The middle of a triangle, with the family of the triangle.
    ///
    /// - `vertices` `[n_vertices]`: moved positions
    pub(super) fn of_triangle(mesh: &TetMesh, vertices: &[DVec3], triangle: u32) -> Self {
        let middle =
            mesh.triangles[triangle as usize].map(|vertex| vertices[vertex as usize]).iter().sum::<DVec3>() / 3.0;
        let family = &mesh.families[mesh.triangle_family[triangle as usize].index()];
        Self::new(middle, Some(family))
    }
}
