//! [`Mover`]: the one door to idmesh. Set up once per mesh, run once per design.
//!
//! Everything that depends on the mesh alone (topology, wing vertices' places among the old
//! profiles, continued surfaces, stiffness, spectra, device buffers) is made by [`Mover::new`];
//! [`Mover::update`] starts from the undeformed mesh every time, so its result depends on the
//! design alone, unless it is told to start from the last design.
//!
//! Inside, vertices and tets stand in an [`Order`] of their own; what goes in and what comes out is
//! in that of the mesh.

mod fold_check;
mod held_back;
pub mod prescribed;
mod reports;
mod warnings;

use std::{collections::BTreeMap, sync::Arc, time::Instant};

use glam::DVec3;
use thiserror::Error;

use fold_check::FoldCheck;
pub use held_back::{Beyond, HeldBack};
pub use warnings::Warning;

use crate::{
    backend::{Backend, BackendError, MemoryError, check_memory},
    families::{Families, PlacedBy, Role, SetupError},
    mesh::Displacement,
    mesh::{self, FamilyId, MeshError, Order, TetMesh, Topology, half_edge::Surface},
    profile::{Closeness, Missed, Profile, ProfileError},
    projection::crossing::Crossings,
    quality::{self, Statistics, faults::EdgeAngles},
    relaxation::{Method, Stopping},
    report::{FamilyReport, Path, ProfileReport, Solver, Stage, StageName},
    smoothing::{QualityTarget, Smoothed},
    springs::Springs,
    stage::SetUp,
    stages::{
        WingProfiles, carenage::Carenages, planes::Planes, trailing_edge::TrailingEdges, wing::Wings, wingtip::Wingtips,
    },
    volume::{
        EdgeGraph, Start, {VolumeError, VolumeResult, VolumeStage, displaced},
    },
};

/// What is moved, and how.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Role of each family `[n_families]`.
    pub roles: Vec<Role>,
    /// The wings with their old profiles.
    pub wings: Vec<WingProfiles>,
    /// The volume's springs.
    pub springs: &'static Springs,
    /// How networks are relaxed.
    pub method: Method,
    /// How far networks are relaxed.
    pub stopping: Stopping,
    /// What local optimisation aims at; none is done without.
    pub quality: Option<QualityTarget>,
    /// Most steps of an update, the jump that is tried first and those given up included; 1 is the
    /// jump alone.
    pub max_steps: usize,
}

/// One design: what replaces the old shape.
#[derive(Clone, Debug, Default)]
pub struct Design {
    /// New profiles of each wing, by its name, paired with the old ones by number.
    pub profiles: BTreeMap<String, Vec<Profile>>,
    /// Displacement of each prescribed family's vertices, in the order of
    /// [`Mover::family_vertices`].
    pub prescribed: BTreeMap<FamilyId, Vec<DVec3>>,
}

/// What an update made.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The moved vertices `[n_vertices]`.
    pub vertices: Vec<DVec3>,
    /// Their displacement from the original mesh `[n_vertices]`.
    pub displacement: Displacement,
    /// Quality at the four stages of the paper's Table 1.
    pub stages: Vec<Stage>,
    /// Beta of each tet of the original mesh `[n_tets]`.
    pub original_beta: Vec<f64>,
    /// Beta of each tet of the final mesh `[n_tets]`.
    pub beta: Vec<f64>,
    /// How true the carenages and planes stayed to their shapes, by family name.
    pub families: BTreeMap<String, FamilyReport>,
    /// How true the wings are to their new profiles, by family name.
    pub profiles: BTreeMap<String, ProfileReport>,
    /// How the volume was relaxed.
    pub solver: Solver,
    /// The steps the inside took.
    pub path: Path,
    /// What local optimisation did; `None` where it was off or nothing called for it.
    pub smoothed: Option<Smoothed>,
    /// Whether every relaxation reached its tolerance.
    pub converged: bool,
    /// Stages whose relaxation did not reach its tolerance, with the estimated error left, in
    /// shortest edges.
    pub unconverged: Vec<(&'static str, f64)>,
    /// Tets without positive volume.
    pub inverted: usize,
    /// Stages after which a triangle of a family placed so far was folded, with their number.
    pub folds: Vec<(&'static str, usize)>,
    /// Carenages and planes that vertices left by more than 1e-6 of their size, by name, with the
    /// largest distance.
    pub off_surface: BTreeMap<String, f64>,
    /// Periodic planes whose partners are apart by more than rounding, by name, with the largest
    /// distance.
    pub parted: BTreeMap<String, f64>,
    /// Vertices that the design moves and fixed or prescribed families hold.
    pub held_back: Vec<HeldBack>,
    /// Surface triangles that are turned over against those around them, by family name; families
    /// without any are left out. See [`quality::faults::folded`].
    pub folded: BTreeMap<String, usize>,
    /// The wing whose profiles come nearest to being refused, and what is suspect about them.
    pub nearest_to_refusal: Option<(String, Closeness)>,
    /// Wings whose vertices miss their new profiles by more than [`MISSED`] of the chord, by name:
    /// the worst vertex, as one of the mesh.
    pub missed: BTreeMap<String, Missed>,
    /// Triangles of the mesh that the moved surface passes through, and did not before, ascending.
    /// Where there are any, the mesh overlaps itself even if no tet is inverted.
    pub self_intersecting: Vec<u32>,
    /// What a user should know of, although the mesh is valid.
    pub warnings: Vec<Warning>,
}

impl Outcome {
    /// Whether the moved mesh is what was asked for: no tet is inverted, the surface does not pass
    /// through itself, what slides on a carenage or in a plane is there, the wings have their new
    /// profiles, periodic planes match, and no vertex is held back by more than its shortest edge.
    pub fn is_valid(&self) -> bool {
        self.inverted == 0
            && self.self_intersecting.is_empty()
            && self.off_surface.is_empty()
            && self.missed.is_empty()
            && self.parted.is_empty()
            && self.held_back.iter().all(|held| held.beyond.is_none())
    }
}

/// Why a mesh could not be moved.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MoveError {
    /// The mesh is not valid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The mesh and its roles do not go together.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// A wing's new profiles cannot be used.
    #[error("profiles of `{family}`: {error}")]
    Profiles {
        /// The wing.
        family: String,
        /// What is wrong with them.
        error: ProfileError,
    },
    /// A prescribed family has no displacement, or one of the wrong length.
    #[error("family `{family}` has {expected} vertices, but {found} prescribed displacements were given")]
    Prescribed {
        /// The family.
        family: String,
        /// Vertices of the family.
        expected: usize,
        /// Displacements given.
        found: usize,
    },
    /// Two prescribed families move a vertex of both to different places.
    #[error(
        "the prescribed families `{family}` and `{other}` share vertex {vertex} at ({}, {}, {}), and its displacements \
         differ by {difference:.3e}, expected the same from both",
        position.x, position.y, position.z
    )]
    Disagree {
        /// The first family.
        family: String,
        /// The second family.
        other: String,
        /// The vertex, counted from 0.
        vertex: u32,
        /// Where it is.
        position: DVec3,
        /// The distance between the places the two move it to.
        difference: f64,
    },
    /// The mesh is too large for the memory.
    #[error("{n_tets} tets: {error}")]
    Memory {
        /// Tets of the mesh.
        n_tets: usize,
        /// What is lacking.
        error: MemoryError,
    },
    /// There is no memory to lead the inside to the design in steps.
    #[error(transparent)]
    VolumeResult(VolumeError),
    /// The backend failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
}

impl From<VolumeError> for MoveError {
    fn from(error: VolumeError) -> Self {
        match error {
            VolumeError::Backend(error) => error.into(),
            error => Self::VolumeResult(error),
        }
    }
}

/// Moves one mesh, design after design.
pub struct Mover {
    mesh: TetMesh,
    /// Its vertices of each family `[n_families]`, ascending.
    family_vertices: Vec<Vec<u32>>,
    order: Order,
    /// The mesh in that order, as everything below.
    ordered: TetMesh,
    surface: Surface,
    edge_angles: EdgeAngles,
    crossings: Crossings,
    families: Families,
    stopping: Stopping,
    method: Method,
    backend: Arc<dyn Backend>,
    original_beta: Vec<f64>,
    wings: Wings,
    /// The families of each wing, by name.
    wing_families: BTreeMap<String, Vec<FamilyId>>,
    trailing_edges: TrailingEdges,
    wingtips: Wingtips,
    carenages: Carenages,
    planes: Planes,
    interior: VolumeStage,
}

/// Greatest share of the chord by which a wing's vertices may miss their new profiles.
pub const MISSED: f64 = 2e-3;

/// Memory that a mover takes at most for each tet, updates included, beside the mesh it is given;
/// measured with 6.5 million tets.
const BYTES: u64 = 600;

impl Mover {
    /// Checks the mesh and sets every stage up; `observer` hears the name of each as it begins.
    ///
    /// # Errors
    /// The mesh is not valid or too large for the memory, its roles or old profiles do not fit it,
    /// or the backend failed.
    pub fn new(
        mut mesh: TetMesh,
        settings: Settings,
        backend: Arc<dyn Backend>,
        observer: &dyn Fn(&str),
    ) -> Result<Self, MoveError> {
        check_memory(BYTES * mesh.tets.len() as u64)
            .map_err(|error| MoveError::Memory { n_tets: mesh.tets.len(), error })?;
        observer("topology");
        mesh.turn_tets();
        mesh::check(&mesh)?;
        let order = Order::breadth_first(&mesh);
        let ordered = order.of(&mesh);
        let (topology, edge_graph) = rayon::join(|| Topology::new(&ordered), || EdgeGraph::new(&ordered));
        // Errors name what stands in the mesh that was given.
        let Topology { surface, .. } = topology.or_else(|error| Topology::new(&mesh).and(Err(error)))?;
        let Settings { roles, wings, springs, method, stopping, quality, max_steps } = settings;
        observer("families");
        let families = Families::new(&ordered, &surface, roles)?;
        let set_up = SetUp {
            mesh: &ordered,
            surface: &surface,
            families: &families,
            backend: backend.as_ref(),
            method,
            stopping,
        };
        observer("profiles");
        let wing_families = wings.iter().map(|wing| (wing.name.clone(), wing.families.clone())).collect();
        let wings = Wings::new(&set_up, &wings)?;
        observer("springs");
        let original_beta = quality::betas(&ordered.vertices, &ordered.tets);
        let lowest = Statistics::new(&original_beta).min;
        let shaped = wings.beside_sections();
        let of_surfaces = || {
            let edge_angles = EdgeAngles::new(&ordered.vertices, &surface.triangles, &surface.opposite);
            let crossings = Crossings::new(&ordered.vertices, &surface.triangles);
            let trailing_edges = TrailingEdges::new(&set_up)?;
            let wingtips = Wingtips::new(&set_up)?;
            let carenages = Carenages::new(&set_up)?;
            Ok::<_, SetupError>((edge_angles, crossings, trailing_edges, wingtips, carenages, Planes::new(&set_up)?))
        };
        let (of_surfaces, interior) = rayon::join(of_surfaces, || {
            VolumeStage::new(&set_up, edge_graph, springs, quality, lowest, max_steps, &shaped)
        });
        let (edge_angles, crossings, trailing_edges, wingtips, carenages, planes) = of_surfaces?;
        let interior = interior?;
        let family_vertices = |family| {
            let mut vertices: Vec<u32> =
                surface.vertices_of(FamilyId(family)).iter().map(|&place| order.vertex(place)).collect();
            vertices.sort_unstable();
            vertices
        };
        Ok(Self {
            family_vertices: (0..mesh.families.len() as u16).map(family_vertices).collect(),
            mesh,
            order,
            ordered,
            surface,
            edge_angles,
            crossings,
            families,
            stopping,
            method,
            backend,
            original_beta,
            wings,
            wing_families,
            trailing_edges,
            wingtips,
            carenages,
            planes,
            interior,
        })
    }

    /// The undeformed mesh, its tets turned as by [`TetMesh::turn_tets`].
    pub fn mesh(&self) -> &TetMesh {
        &self.mesh
    }

    /// Where the arithmetic runs.
    pub fn backend(&self) -> &dyn Backend {
        self.backend.as_ref()
    }

    /// The vertices of a family, ascending.
    pub fn family_vertices(&self, family: FamilyId) -> &[u32] {
        &self.family_vertices[family.index()]
    }

    /// Where updates start from now on: from the undeformed mesh unless something else is said.
    pub fn start_from(&mut self, start: Start) {
        self.interior.start_from(start);
    }

    /// Moves the undeformed mesh to a design; `observer` hears the name of each stage as it begins.
    ///
    /// # Errors
    /// The design does not fit the mesh, or the backend failed. Inverted tets and relaxations that
    /// did not converge are results: see [`Outcome`].
    pub fn update(&mut self, design: &Design, observer: &dyn Fn(&str)) -> Result<Outcome, MoveError> {
        self.run(design, observer, None)
    }

    /// [`Mover::update`] with a say in each stage: `amend` gets a stage's name as it ends and the
    /// displacement so far `[n_vertices]`, and may change it. What it makes is judged like the
    /// stage's own work.
    ///
    /// # Errors
    /// As [`Mover::update`].
    pub fn update_amended(
        &mut self,
        design: &Design,
        observer: &dyn Fn(&str),
        amend: &mut dyn FnMut(&str, &mut Displacement),
    ) -> Result<Outcome, MoveError> {
        self.run(design, observer, Some(amend))
    }

    fn run(
        &mut self,
        design: &Design,
        observer: &dyn Fn(&str),
        mut amend: Option<&mut Amend>,
    ) -> Result<Outcome, MoveError> {
        let Self { ordered: mesh, order, surface, edge_angles, families, stopping, .. } = self;
        let mut watch = StageWatch { last: Instant::now(), stages: Vec::new() };
        let mut fold_check = FoldCheck::new(mesh, surface, edge_angles, families);
        let mut end = |stage: &'static str, last: PlacedBy, displacement: &mut Displacement| {
            if last < PlacedBy::Volume {
                families.partners.even(families, displacement);
            }
            if let Some(amend) = &mut amend {
                let mut given = order.of_vertices(displacement);
                amend(stage, &mut given);
                *displacement = order.to_vertices(&given);
            }
            let here = displaced(&mesh.vertices, displacement);
            fold_check.fold_check(stage, last, &here);
            here
        };
        watch.record(StageName::Original, &self.original_beta);

        observer("wing");
        let mut displacement: Displacement = vec![DVec3::ZERO; mesh.vertices.len()];
        let mut wanted = Vec::new();
        prescribed::prescribe(mesh, order, &self.family_vertices, families, design, &mut displacement, &mut wanted)?;
        let of_wings = self
            .wings
            .interpolate(families, &design.profiles, &mut displacement, &mut wanted)
            .map_err(|(family, error)| MoveError::Profiles { family, error })?;
        let deformed = displaced(&mesh.vertices, &displacement);
        let deformed_beta = quality::betas_after(self.original_beta.clone(), &mesh.vertices, &deformed, &mesh.tets);
        watch.record(StageName::Deformed, &deformed_beta);

        let junction = self.wings.join(mesh, families, &of_wings, &mut displacement, stopping)?;
        end("wing", PlacedBy::Wing, &mut displacement);
        observer("trailing edge");
        let trailing_edge = self.trailing_edges.run(mesh, families, &mut displacement, stopping)?;
        end("trailing edge", PlacedBy::TrailingEdge, &mut displacement);
        observer("wingtip");
        let wingtip = self.wingtips.run(mesh, families, &mut displacement, stopping)?;
        end("wingtip", PlacedBy::Wingtip, &mut displacement);
        observer("carenage");
        let carenage = self.carenages.run(mesh, families, &mut displacement, stopping)?;
        end("carenage", PlacedBy::Carenage, &mut displacement);
        observer("planes");
        let planes = self.planes.run(&mut displacement, stopping)?;
        let corrected = end("planes", PlacedBy::Plane, &mut displacement);
        let corrected_beta = quality::betas_after(deformed_beta, &deformed, &corrected, &mesh.tets);
        watch.record(StageName::Corrected, &corrected_beta);

        observer("volume");
        let set_up =
            SetUp { mesh, surface, families, backend: self.backend.as_ref(), method: self.method, stopping: *stopping };
        let VolumeResult { vertices, beta, convergence: volume, path, smoothed } =
            self.interior.run(&set_up, &mut self.crossings, &mut displacement, stopping, observer)?;
        let amended = end("volume", PlacedBy::Volume, &mut displacement);
        let beta = quality::betas_after(beta, &vertices, &amended, &mesh.tets);
        let vertices = amended;
        let inverted = watch.record(StageName::Final, &beta).inverted;

        let ends = [
            ("wing", junction),
            ("trailing edge", trailing_edge),
            ("wingtip", wingtip),
            ("carenage", carenage),
            ("planes", planes),
            ("volume", volume),
        ];
        let unconverged: Vec<_> =
            ends.iter().filter(|(_, end)| !end.converged).map(|&(stage, end)| (stage, end.error)).collect();
        let FoldCheck { folds, folded, .. } = fold_check;
        let folded =
            folded.into_iter().map(|(family, count)| (self.mesh.families[family.index()].clone(), count)).collect();
        let self_intersecting = self.crossings.newly_self_intersecting(&self.ordered.vertices, &vertices);
        // Where the vertices are in the end: those that are held have been there since the wing's
        // stage.
        let held_back = self.held_back(&wanted, &displacement);
        let families = self.family_reports(&vertices, &folded, &self_intersecting, &held_back);
        let missed = self.wings.missed(&of_wings, &vertices);
        Ok(Outcome {
            off_surface: self.off_surface(&families),
            parted: self.parted(&families),
            warnings: self.warnings(&vertices, &held_back, design, &missed),
            held_back,
            families,
            profiles: self.profile_reports(&vertices, design, &missed, &self.wings.flat_cuts(&of_wings)),
            missed: self.beyond(missed),
            nearest_to_refusal: self.wings.nearest_to_refusal(&of_wings),
            solver: self.solver_report(&volume),
            stages: watch.stages,
            original_beta: self.order.of_tets(&self.original_beta),
            beta: self.order.of_tets(&beta),
            converged: unconverged.is_empty(),
            unconverged,
            inverted,
            folds,
            folded,
            self_intersecting: self.surface.in_mesh(&self_intersecting),
            path,
            smoothed,
            displacement: self.order.of_vertices(&displacement),
            vertices: self.order.of_vertices(&vertices),
        })
    }
}

/// A say in the displacement after a stage, of which it gets the name.
type Amend<'a> = dyn FnMut(&str, &mut Displacement) + 'a;

struct StageWatch {
    last: Instant,
    stages: Vec<Stage>,
}

impl StageWatch {
    /// Notes the quality at a stage and the time since the one before, measuring included.
    fn record(&mut self, name: StageName, betas: &[f64]) -> Statistics {
        let statistics = Statistics::new(betas);
        let seconds = if self.stages.is_empty() { 0.0 } else { self.last.elapsed().as_secs_f64() };
        self.stages.push(Stage::new(name, &statistics, seconds));
        self.last = Instant::now();
        statistics
    }
}
