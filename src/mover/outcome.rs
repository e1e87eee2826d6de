//! [`Outcome`]: the result of an update, and the check that it may be used.
//!
//! [`Outcome::valid`] returns the moved mesh only if every relaxation converged and the mesh is
//! valid. Otherwise it returns an error that names the faults. [`Outcome::even_if_invalid`] returns
//! the moved mesh in every case. The report holds the types that serialise, so their field names
//! are part of the interface.

use std::{
    collections::BTreeMap,
    sync::{Arc, OnceLock},
};

use glam::DVec3;
use serde::Serialize;

use super::{Crease, HeldBack, StageSeconds, Warning, differentiable::Differentiable, meter::Meter};
use crate::{
    backend::DeviceWork,
    mesh::{CellMeasures, Displacement, FamilyId, KindQuality, OtherCells, TetMesh},
    profile::{Closeness, Missed, Profile, ProfileMatch},
    quality::Statistics,
    relaxation::{Convergence, Method, Relaxation},
    smoothing::Smoothed,
    solver_measures::{Exceeded, Limits, SolverMeasures},
    stages::{MissedSurface, SharedCurve},
    volume::Path,
};

/// The moved vertices of a design. Tets, triangles and families are those of [`Outcome::mesh`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moved {
    pub(super) vertices: Vec<DVec3>,
    pub(super) displacement: Displacement,
}

impl Moved {
    /// The moved vertices `[n_vertices]`, in the mesh's unit and in the order of the mesh that was
    /// given.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// The displacement of each vertex from the original mesh `[n_vertices]`, in the mesh's unit
    /// and order.
    pub fn displacement(&self) -> &[DVec3] {
        &self.displacement
    }

    /// The vertices and the displacement, without a copy.
    pub fn into_arrays(self) -> (Vec<DVec3>, Vec<DVec3>) {
        (self.vertices, self.displacement)
    }

    /// The inverse of [`Moved::into_arrays`].
    pub fn from_arrays(vertices: Vec<DVec3>, displacement: Vec<DVec3>) -> Self {
        Self { vertices, displacement }
    }
}

/// The result of an update. Lengths are in the mesh's unit.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Outcome {
    pub(super) moved: Moved,
    /// The undeformed mesh.
    pub(super) mesh: Arc<TetMesh>,
    /// Its cells that are no tets.
    pub(super) others: Arc<OtherCells>,
    /// Whether the settings allow local optimisation.
    pub(super) optimises: bool,
    /// The method of a relaxation that did not converge.
    pub(super) failed: Option<Method>,
    /// Whether the result is good, as the update found. The public fields can be changed, this
    /// field cannot.
    pub(super) found: Found,
    pub(super) differentiable: Differentiable,
    pub(super) meter: Arc<Meter>,
    pub(super) measured: OnceLock<SolverMeasures>,
    /// The measures of solvers beyond their limits, as the update found.
    pub(super) exceeded: Vec<Exceeded>,
    /// Quality at the four stages of the paper's Table 1.
    pub stages: Vec<StageQuality>,
    /// Beta of each tet of the original mesh `[n_tets]`.
    pub original_beta: Vec<f64>,
    /// Beta of each tet of the final mesh `[n_tets]`.
    pub beta: Vec<f64>,
    /// Scaled Jacobian and shape of the worst corner of each cell of the final mesh `[n_cells]`, in
    /// the order of [`HybridMesh`](crate::mesh::HybridMesh): tets, then pyramids, prisms and
    /// hexahedra. `None` for a mesh of tets, whose measure is [`Outcome::beta`].
    pub cell_measures: Option<Vec<CellMeasures>>,
    /// Quality of each kind of cell of the final mesh. `None` for a mesh of tets.
    pub kinds: Option<Vec<KindQuality>>,
    /// Quality of each kind of cell of the original mesh, without shapes. `None` for a mesh of
    /// tets.
    pub original_kinds: Option<Vec<KindQuality>>,
    /// Deviations of families from their shapes, by family name. Families with nothing to report
    /// are left out.
    pub families: BTreeMap<String, FamilyReport>,
    /// Deviations of wings from their new profiles, by the name of the wing and of each of its
    /// families.
    pub profiles: BTreeMap<String, ProfileReport>,
    /// The sections of the moved wings, by the wing's name, in the order of the design's new
    /// profiles. Sections that cannot be cut are left out.
    pub sections: BTreeMap<String, Vec<MovedSection>>,
    /// The design's new profiles, by the wing's name.
    pub asked: BTreeMap<String, Vec<Profile>>,
    /// How the relaxations went, in the order of the stages.
    pub relaxations: Vec<StageRelaxation>,
    /// The relaxation of the volume's network.
    pub solver: Solver,
    /// The steps of the volume stage.
    pub path: Path,
    /// What passed between the CPU and the device, and what the device was told to do. Updates at
    /// the same time on the same device count together. `None` for the CPU.
    pub device_work: Option<DeviceWork>,
    /// Seconds of each stage, in order, and of the measures of the result.
    pub stage_seconds: Vec<StageSeconds>,
    /// The work of local optimisation. `None` if it was off or not needed.
    pub smoothed: Option<Smoothed>,
    /// Whether every relaxation reached its tolerance.
    pub converged: bool,
    /// Stages with a relaxation that did not reach its tolerance, and the estimated error of each,
    /// as a fraction of a vertex's shortest edge.
    pub unconverged: Vec<(&'static str, f64)>,
    /// Number of inverted cells. A tet is inverted if its volume is not positive, another cell if
    /// the volume of a corner or of the cell is not.
    pub inverted: usize,
    /// Stages that left folded triangles in families placed so far, with the number of these
    /// triangles.
    pub folds: Vec<(&'static str, usize)>,
    /// Carenages and planes with vertices that left them by more than 1e-6 of the family's size, by
    /// name.
    pub off_surface: BTreeMap<String, Deviation>,
    /// Periodic planes with vectors between partners that changed by more than rounding, by name.
    pub parted: BTreeMap<String, Deviation>,
    /// Vertices that the design moves with one family, and that a fixed or prescribed family holds.
    pub held_back: Vec<HeldBack>,
    /// Rigid families that touch a wing, a prescribed, a fixed or another rigid family and go
    /// elsewhere than the shared vertices by more than [`super::STRAINED`] of an edge, by name.
    pub strained: BTreeMap<String, Strained>,
    /// Rigid families on which junctions slide, and whose surface is creased beside a junction, by
    /// name.
    pub creased: BTreeMap<String, Crease>,
    /// Wings whose junctions miss the surfaces that they share with other families, by name. The
    /// vertices are numbered in the mesh's order.
    pub missed_surfaces: BTreeMap<String, MissedSurface>,
    /// Number of surface triangles that are turned over against the triangles around them, by
    /// family name. Families without such triangles are left out. See
    /// [`crate::quality::faults::folded`].
    pub folded: BTreeMap<String, usize>,
    /// The wing with the profiles that came nearest to a refusal, and the check that came nearest.
    pub nearest_to_refusal: Option<(String, Closeness)>,
    /// Wings that miss their new profiles by more than [`super::MISSED`], by name, with the worst
    /// vertex in the mesh's order.
    pub missed: BTreeMap<String, Missed>,
    /// Boundary faces of the mesh that self-intersect after the motion and did not before,
    /// ascending: indices of triangles, and after these of quadrilaterals. With such a face the
    /// mesh overlaps itself, even if no tet is inverted.
    pub self_intersecting: Vec<u32>,
    /// Remarks on the result that do not make it invalid.
    pub warnings: Vec<Warning>,
}

/// The vertex of a rigid family that another family takes farthest from where the rigid motion has
/// it, by the vertex's shortest edge. Lengths are in the mesh's unit.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Strained {
    /// The family that places the vertex.
    pub by: String,
    /// Original position of the vertex.
    pub at: DVec3,
    /// Distance of the vertex from where the rigid motion has it.
    pub distance: f64,
    /// The vertex's shortest edge in the rigid family.
    pub edge: f64,
}

/// Vertices of a family that deviate from their place by more than is allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Deviation {
    /// Largest distance, in the mesh's unit.
    pub distance: f64,
    /// Number of vertices that deviate.
    pub vertices: usize,
    /// The worst vertex, in the mesh's order.
    pub vertex: usize,
    /// A prescribed family that has moved such a vertex. No stage slides its vertices back.
    pub prescribed: Option<FamilyId>,
}

/// Whether a result is good, as the update found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    pub(super) is_valid: bool,
    pub(super) converged: bool,
}

impl Outcome {
    /// The outcome with what its fields say of it.
    pub(super) fn judged(mut self) -> Self {
        if !self.meter.limits.is_empty() {
            self.exceeded = self.meter.limits.exceeded(self.solver_measures());
        }
        let is_valid = self.inverted == 0
            && self.exceeded.is_empty()
            && self.self_intersecting.is_empty()
            && self.off_surface.is_empty()
            && self.missed.is_empty()
            && self.parted.is_empty()
            && self.strained.is_empty()
            && self.creased.is_empty()
            && self.missed_surfaces.is_empty()
            && self.held_back.iter().all(|held| held.beyond.is_none());
        self.found = Found { is_valid, converged: self.converged };
        self
    }

    /// The moved mesh, valid or not. An invalid mesh serves to look at or to measure, not to
    /// compute a flow.
    pub fn even_if_invalid(&self) -> &Moved {
        &self.moved
    }

    /// Exchanges the moved mesh. A front end with arrays of its own takes the moved mesh out, and
    /// puts it back before it writes or checks the outcome.
    #[doc(hidden)]
    pub fn replace_moved(&mut self, moved: Moved) -> Moved {
        std::mem::replace(&mut self.moved, moved)
    }

    /// Whether the moved mesh is valid. A valid mesh meets these conditions:
    ///
    /// - No tet is inverted.
    /// - No surface triangle self-intersects that did not before.
    /// - Vertices of carenages and planes are on their surfaces.
    /// - Wings have their new profiles within [`super::MISSED`].
    /// - Periodic planes match.
    /// - No vertex is held back by more than its shortest edge.
    /// - The junctions of wings reach their surfaces along the span, within
    ///   [`super::MISSED_SURFACE`] of the chord.
    /// - No rigid family is strained by more than [`super::STRAINED`] of an edge.
    /// - No edge of a rigid family is creased by more than [`super::CREASED`] degrees.
    /// - No measure of a solver is beyond its limit in [`super::Settings::limits`].
    ///
    /// A valid mesh may come from relaxations that did not converge; see [`Outcome::converged`].
    /// [`Outcome::check`] tests both.
    pub fn is_valid(&self) -> bool {
        self.found.is_valid
    }

    /// The moved mesh in the words of flow solvers. Measured when first asked for.
    pub fn solver_measures(&self) -> &SolverMeasures {
        self.measured.get_or_init(|| self.meter.of(&self.moved.vertices))
    }

    /// The original mesh in the words of flow solvers. Measured once per mesh, when first asked
    /// for.
    pub fn original_solver_measures(&self) -> &SolverMeasures {
        self.meter.original()
    }

    /// The limits on the measures of solvers, of the mover's settings.
    pub fn limits(&self) -> &Limits {
        &self.meter.limits
    }

    /// The measures of solvers beyond their limits; see [`super::Settings::limits`].
    pub fn exceeded(&self) -> &[Exceeded] {
        &self.exceeded
    }

    /// The undeformed mesh in the order in which it was given, with its tets turned by
    /// [`TetMesh::turn_tets`].
    pub fn mesh(&self) -> &TetMesh {
        &self.mesh
    }

    /// The cells of [`Outcome::mesh`] that are no tets, and its quadrilaterals.
    pub fn other_cells(&self) -> &OtherCells {
        &self.others
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
pub struct StageQuality {
    /// The state of the mesh.
    pub name: StageName,
    /// Smallest beta.
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

impl StageQuality {
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
    /// Of an attached or a rigid family: its role.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub role: Option<&'static str>,
    /// Of an attached family: the largest distance of a vertex of its assembly's root from where
    /// the root's best rigid motion has it. This is what the family gives way by.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual: Option<f64>,
    /// Of an attached family: largest distance of its vertices from its original surface, carried
    /// by the root's best rigid motion and continued beyond junctions that slide.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_distance_to_carried_surface: Option<f64>,
    /// Of an attached family whose junction slides on a wing, or of a rigid one on which junctions
    /// slide: the largest distance of a vertex of the junction from where it would be if it were
    /// glued.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_slide: Option<f64>,
    /// Of an attached family, or of a rigid one on which junctions slide: the smallest and the
    /// largest ratio of an edge's length to its length before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edge_ratios: Option<[f64; 2]>,
    /// Of a rigid family: the angle of its turn, in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turn_degrees: Option<f64>,
    /// Of a rigid family: the shift of the mean of its vertices.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift: Option<[f64; 3]>,
    /// Vertices that this family holds although a design moves them with another family.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_back: Option<HeldBackSummary>,
    /// Number of triangles that are turned over against the triangles around them.
    #[serde(skip_serializing_if = "is_zero")]
    pub folded_triangles: usize,
    /// Number of triangles that self-intersect after the motion and did not before.
    #[serde(skip_serializing_if = "is_zero")]
    pub pierced_triangles: usize,
}

/// Vertices that are held back. Distances are in the mesh's unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HeldBackSummary {
    /// Number of the vertices.
    pub vertices: usize,
    /// Largest distance of a vertex from its place in the design.
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
    /// the profiles, in the mesh's unit. The sag of the facets is included.
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
    /// How each new profile was matched with the old one, by the number of the profile.
    #[serde(rename = "match")]
    pub matches: BTreeMap<i64, ProfileMatch>,
    /// The reason why a deviation could not be measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_measured: Option<String>,
    /// Curves that the wing shares with wings of other profiles, which place their vertices.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub shared_curves: Vec<SharedCurve>,
}

/// The section of a moved wing in the plane of a new profile. Lengths are in the mesh's unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MovedSection {
    /// The number of the profile.
    pub profile: i64,
    /// Largest distance of the section from the new profile. The sag of the facets is included, and
    /// bridges through parts on the wing are not.
    pub max_distance_to_new_profile: f64,
    /// The cut through the moved facets, in order, with bridges through parts on the wing. The
    /// report leaves it out.
    #[serde(skip)]
    pub points: Vec<DVec3>,
}

/// One relaxation of a stage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageRelaxation {
    /// The stage, as [`crate::stages::STAGES`] names it.
    pub stage: &'static str,
    /// The relaxation.
    #[serde(flatten)]
    pub relaxation: Relaxation,
}

impl StageRelaxation {
    /// The relaxations of all stages, in order.
    pub(super) fn of_stages(ends: Vec<(&'static str, Convergence)>) -> Vec<Self> {
        let of_stage = |(stage, end): (&'static str, Convergence)| {
            let relaxations = end.history.relaxations().to_vec();
            relaxations.into_iter().map(move |relaxation| Self { stage, relaxation })
        };
        ends.into_iter().flat_map(of_stage).collect()
    }
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
