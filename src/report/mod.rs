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
    /// The design, where several are run on one mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub design: Option<String>,
    /// Where the arithmetic ran.
    pub backend: Backend,
    /// Size of the mesh.
    pub mesh: Mesh,
    /// Quality and time of each stage, in order.
    pub stages: Vec<Stage>,
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

/// The states of the mesh that are measured (the paper's Table 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StageName {
    /// As read.
    Original,
    /// After the wing's vertices moved.
    Deformed,
    /// After the other families moved.
    Corrected,
    /// After the volume moved.
    Final,
}

/// Quality of the mesh at one stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stage {
    /// Which stage.
    pub name: StageName,
    /// Smallest beta.
    pub beta_min: f64,
    /// Largest beta.
    pub beta_max: f64,
    /// Mean beta over the tets.
    pub beta_mean: f64,
    /// Tets whose beta is not positive.
    pub inverted: usize,
    /// Time from the stage before to this one, s.
    pub seconds: f64,
}

impl Stage {
    /// The row of a stage.
    pub fn new(name: StageName, beta: &Statistics, seconds: f64) -> Self {
        let &Statistics { min, max, mean, inverted } = beta;
        Self { name, beta_min: min, beta_max: max, beta_mean: mean, inverted, seconds }
    }
}

/// How true a family stayed to its shape, in the mesh's unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FamilyReport {
    /// Largest distance of a carenage's vertices to its original surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_distance_to_original_surface: Option<f64>,
    /// Largest distance of a plane family's vertices to its plane; where it is not quite flat, to their own distances from it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_distance_to_plane: Option<f64>,
    /// Largest distance of a periodic plane's vertices from their places beside their partners.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_distance_of_partners: Option<f64>,
    /// Vertices that a design moves with another family, and this one holds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_back: Option<HeldBack>,
    /// Triangles that are turned over against those around them.
    #[serde(skip_serializing_if = "is_zero")]
    pub folded_triangles: usize,
    /// Triangles that the moved surface passes through, and did not before.
    #[serde(skip_serializing_if = "is_zero")]
    pub pierced_triangles: usize,
}

/// Vertices that are held back, in the mesh's unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HeldBack {
    /// How many they are.
    pub vertices: usize,
    /// Largest distance between where they are and where the design would have them.
    pub max_distance: f64,
}

fn is_false(flag: &bool) -> bool {
    !flag
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// How true a wing is to its new profiles.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProfileReport {
    /// Largest distance between the moved wing's facets, cut in the planes of its new profiles, and these, in the mesh's unit;
    /// the facets' sag is in it.
    pub max_distance_to_new_profiles: Option<f64>,
    /// How much farther the wing's vertices beside these planes lie from the new profiles than they lay from the old ones, at
    /// most, as share of the profile's length (about its chord).
    pub max_miss_of_vertices: Option<f64>,
    /// Whether the new profiles were compared with flat cuts through the wing's facets, because the old ones are such cuts or
    /// the new ones continue them; else they are compared with the sections that the vertices say, or with other old ones.
    #[serde(skip_serializing_if = "is_false")]
    pub compared_with_flat_cuts: bool,
    /// Why one of them could not be measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_measured: Option<String>,
}

/// How the volume's network was relaxed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Solver {
    /// `"jacobi"`, `"chebyshev"`, ...
    pub method: String,
    /// Sweeps over the network.
    pub sweeps: usize,
    /// Norm of the last residual over that of the first.
    pub relative_residual: f64,
}

/// The steps an update took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Path {
    /// Steps on the way to the result: 1 is a jump from the undeformed mesh.
    pub steps: usize,
    /// Steps that were tried and given up, the jump among them.
    pub given_up: usize,
    /// How much of the way valid meshes led, in `0..=1`. Less than 1: the path got stuck, and the mesh is the jump's.
    pub reached: f64,
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
