//! The report of a run: JSON, the table of the four stages, and the distribution of beta.
//!
//! The structs are plain data. The structs serialise to the JSON report, which other programs read,
//! so field names are part of idmesh's interface. Numbers that are not finite become `null`.

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
    /// Name of the design, if several are run on one mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub design: Option<String>,
    /// The device that computed.
    pub backend: Backend,
    /// Size of the mesh.
    pub mesh: Mesh,
    /// Quality and time of each stage, in order.
    pub stages: Vec<StageQuality>,
    /// Deviations of each family from its shape, by name.
    pub families: BTreeMap<String, FamilyReport>,
    /// Deviations of each wing from its new profiles, by family name.
    pub profiles: BTreeMap<String, ProfileReport>,
    /// The relaxation of the volume's network.
    pub solver: Solver,
    /// The steps of the volume stage.
    pub path: Path,
    /// Whether the moved mesh is the one that was asked for; see
    /// [`crate::mover::Outcome::is_valid`].
    pub valid: bool,
    /// Whether every relaxation reached its tolerance.
    pub converged: bool,
    /// The exit code that `idmesh run` has for this result.
    pub exit: u8,
    /// What is wrong, and where; `None` for a good result.
    pub error: Option<String>,
    /// What may help; `None` where nothing is known to help.
    pub hint: Option<String>,
    /// Local optimisation, if it ran.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smoothing: Option<Smoothing>,
    /// Seconds of each part of the run.
    pub seconds: Seconds,
}

/// The device that computed.
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
    /// Number of vertices of the family's triangles.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
}

impl Mesh {
    /// Counts the entities of a mesh.
    pub fn of(mesh: &TetMesh) -> Self {
        // A vertex counts once per family. Families come one after another, and each vertex keeps
        // the last family that counted it.
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

/// The result of local optimisation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Smoothing {
    /// Number of sweeps over the vertices at bad tets.
    pub sweeps: usize,
    /// Number of vertices that local optimisation moved.
    pub moved: usize,
}

/// Seconds of each part of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// Reading of the mesh and the profiles.
    pub read: f64,
    /// Set-up, once per mesh.
    pub setup: f64,
    /// Update, once per design: all stages, no files.
    pub update: f64,
    /// Writing of the moved mesh.
    pub write: f64,
    /// The whole run.
    pub total: f64,
}
