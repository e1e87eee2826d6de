//! The report of a run: JSON, the table of the four stages, and the distribution of beta.
//!
//! The structs are plain data. They serialise to the JSON report, which other programs read, so
//! field names are part of idmesh's interface. Numbers that are not finite become `null`.

mod histogram;
#[doc(hidden)]
pub mod svg;
mod table;

use std::collections::BTreeMap;

use serde::Serialize;

use crate::mesh::TetMesh;
use crate::quality::Statistics;

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
    pub stages: Vec<Stage>,
    /// Deviations of each family from its shape, by name.
    pub families: BTreeMap<String, FamilyReport>,
    /// Deviations of each wing from its new profiles, by family name.
    pub profiles: BTreeMap<String, ProfileReport>,
    /// The relaxation of the volume's network.
    pub solver: Solver,
    /// The steps of the volume stage.
    pub path: Path,
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

/// The states of a mesh that are measured (the paper's Table 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StageName {
    /// The mesh as read.
    Original,
    /// The mesh after the wing's vertices have moved.
    Deformed,
    /// The mesh after the other families have moved.
    Corrected,
    /// The mesh after the volume has moved.
    Final,
}

/// Quality of the mesh at one stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stage {
    /// The state of the mesh.
    pub name: StageName,
    /// Smallest beta, without unit.
    pub beta_min: f64,
    /// Largest beta.
    pub beta_max: f64,
    /// Mean beta over the tets.
    pub beta_mean: f64,
    /// Number of tets whose beta is not positive.
    pub inverted: usize,
    /// Time since the stage before, in seconds.
    pub seconds: f64,
}

impl Stage {
    /// The row of a stage in the report. `seconds` is the time since the stage before.
    pub fn new(name: StageName, beta: &Statistics, seconds: f64) -> Self {
        let &Statistics { min, max, mean, inverted } = beta;
        Self { name, beta_min: min, beta_max: max, beta_mean: mean, inverted, seconds }
    }
}

/// Deviations of a family from its shape. Distances are in the mesh's unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FamilyReport {
    /// Largest distance of a carenage's vertices from its original surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_distance_to_original_surface: Option<f64>,
    /// Largest distance of a plane family's vertices from its plane. With `flat`, the largest
    /// change of the vertices' own distances from the plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_distance_to_plane: Option<f64>,
    /// Largest change of the vector between two partners of periodic planes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_distance_of_partners: Option<f64>,
    /// Vertices that this family holds although a design moves them with another family.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_back: Option<HeldBack>,
    /// Number of triangles that are turned over against the triangles around them.
    #[serde(skip_serializing_if = "is_zero")]
    pub folded_triangles: usize,
    /// Number of triangles that self-intersect after the motion and did not before.
    #[serde(skip_serializing_if = "is_zero")]
    pub pierced_triangles: usize,
}

/// Vertices that are held back. Distances are in the mesh's unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HeldBack {
    /// Number of vertices.
    pub vertices: usize,
    /// Largest distance between a vertex and its place in the design.
    pub max_distance: f64,
}

fn is_false(flag: &bool) -> bool {
    !flag
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// Deviations of a wing from its new profiles.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProfileReport {
    /// Largest distance between the new profiles and the moved wing's facets, cut in the planes of
    /// the profiles, in the mesh's unit. It includes the sag of the facets.
    pub max_distance_to_new_profiles: Option<f64>,
    /// Deviation of the wing's vertices beside the profiles' planes: the largest increase of a
    /// vertex's distance, from the distance to the old profile to the distance to the new one, as a
    /// share of the profile's length (about its chord).
    pub max_miss_of_vertices: Option<f64>,
    /// Whether the new profiles were compared with flat cuts through the wing's facets: the old
    /// profiles are such cuts, or the new ones continue them. Otherwise they were compared with the
    /// sections that the vertices define, or with other old profiles.
    #[serde(skip_serializing_if = "is_false")]
    pub compared_with_flat_cuts: bool,
    /// The reason why a deviation could not be measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_measured: Option<String>,
}

/// The relaxation of the volume's network.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Solver {
    /// The method: `"jacobi"`, `"chebyshev"` or `"multigrid"`.
    pub method: String,
    /// Sweeps over the network.
    pub sweeps: usize,
    /// Norm of the last residual over the norm of the first.
    pub relative_residual: f64,
}

/// The steps of an update.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Path {
    /// Steps of the path to the result. 1 is a jump from the undeformed mesh.
    pub steps: usize,
    /// Steps that were tried and given up, including the jump.
    pub given_up: usize,
    /// Share of the route with valid meshes, in `0..=1`. If it is less than 1, no further step
    /// succeeded, and the mesh is the jump's.
    pub reached: f64,
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
