//! What a run tells about itself: the JSON report, the table of the four stages, the distribution of beta.
//!
//! The structs are plain data and serialise to the report other programs read; field names are therefore part of
//! idmesh's interface. Numbers that are not finite become `null` there.

mod histogram;
#[doc(hidden)]
pub mod svg;
mod table;

use std::collections::BTreeMap;

use serde::Serialize;

use crate::mesh::TetMesh;
use crate::mover::{FamilyReport, ProfileReport, Solver, StageQuality};
use crate::volume::Path;

pub use histogram::{Series, histogram_svg};
pub use table::stage_table;
pub(crate) use table::{aligned, beta_text};

/// The report of one design.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunReport {
    /// Version of idmesh.
    pub idmesh: String,
    /// The case file, as the user named it.
    pub case: String,
    /// The design, where several are run on one mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub design: Option<String>,
    /// Where the arithmetic ran.
    pub backend: Backend,
    /// Size of the mesh.
    pub mesh: Mesh,
    /// Quality and time of each stage, in order.
    pub stages: Vec<StageQuality>,
    /// How true each family stayed to its shape, by name.
    pub families: BTreeMap<String, FamilyReport>,
    /// How true each wing is to its new profiles, by family name.
    pub profiles: BTreeMap<String, ProfileReport>,
    /// How the volume's network was relaxed.
    pub solver: Solver,
    /// The steps of the inside.
    pub path: Path,
    /// What local optimisation did, where it ran.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smoothing: Option<Smoothing>,
    /// Where the time went.
    pub seconds: Seconds,
}

/// Where the arithmetic ran.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Backend {
    /// `"gpu"` or `"cpu"`.
    pub kind: String,
    /// Name of the adapter or processor.
    pub adapter: String,
    /// Driver name and version; empty for the CPU.
    pub driver: String,
}

/// Size of a mesh.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Mesh {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of tets.
    pub tets: usize,
    /// Size of each family, by name.
    pub families: BTreeMap<String, FamilySize>,
}

/// Size of a family.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FamilySize {
    /// Number of vertices of its triangles.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
}

impl Mesh {
    /// Counts a mesh.
    pub fn of(mesh: &TetMesh) -> Self {
        // A vertex counts once per family; the family that counted it last is kept per vertex, family by family.
        let mut sizes = vec![FamilySize::default(); mesh.families.len()];
        let mut counted_for = vec![usize::MAX; mesh.vertices.len()];
        let mut order: Vec<usize> = (0..mesh.triangles.len()).collect();
        order.sort_by_key(|&triangle| mesh.triangle_family[triangle]);
        for triangle in order {
            let family = mesh.triangle_family[triangle].index();
            sizes[family].triangles += 1;
            for vertex in mesh.triangles[triangle] {
                if std::mem::replace(&mut counted_for[vertex as usize], family) != family {
                    sizes[family].vertices += 1;
                }
            }
        }
        let families = mesh.families.iter().cloned().zip(sizes).collect();
        Self { vertices: mesh.vertices.len(), tets: mesh.tets.len(), families }
    }
}

/// What local optimisation did.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Smoothing {
    /// Sweeps over the vertices at bad tets.
    pub sweeps: usize,
    /// Vertices it moved.
    pub moved: usize,
}

/// Where the time went, s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// Reading the mesh and the profiles.
    pub read: f64,
    /// What is done once per mesh.
    pub setup: f64,
    /// What every design costs: all stages, no files.
    pub update: f64,
    /// Writing the moved mesh.
    pub write: f64,
    /// All of it.
    pub total: f64,
}
