//! [`Mover`] moves one mesh to many designs. A mover is set up once per mesh and run once per
//! design.
//!
//! [`MoverBuilder::build`] makes everything that depends on the mesh alone: topology, places of
//! wing vertices among the old profiles, continued surfaces, stiffness, spectra and device buffers.
//! [`Mover::update`] starts from the undeformed mesh every time, so a result depends on the design
//! alone. After [`Mover::start_from`] with [`Start::LastDesign`] a result depends on earlier
//! designs within the tolerance. Every front end (command line, examples, tests, benchmarks) moves
//! meshes through a [`Mover`].
//!
//! Inside, vertices and tets stand in an [`Order`] of their own. Arguments and results are in the
//! order of the mesh that was given.

mod builder;
mod creases;
mod design;
mod differentiable;
mod error;
mod fault;
mod fold_check;
mod held_back;
mod in_work;
mod meter;
mod needs;
mod outcome;
#[doc(hidden)]
pub mod prescribed;
mod product_error;
mod products;
mod refused;
mod reports;
mod settings;
mod simplex_view;
mod stage_clock;
mod stopwatch;
mod surface_betas;
mod together;
mod warnings;

use std::{
    collections::BTreeMap,
    ops::ControlFlow,
    sync::{Arc, OnceLock},
};

use glam::DVec3;

pub use crate::{memory::MemoryError, stage::StageError};
pub use crate::{
    relaxation::{Method, Stopping},
    smoothing::{QualityTarget, Smoothed},
    solver_measures::{Exceeded, LimitError, LimitRow, Limits, OpenFoam, SolverMeasures, Su2, Tally},
    springs::{SPRINGS, Springs},
    stages::{MISSED_SURFACE, MissedSurface, SharedCurve},
    volume::{MAX_STEPS, Path, Start},
};
pub use builder::MoverBuilder;
use builder::Progress;
pub use creases::{CREASED, Crease};
pub use design::Design;
pub use differentiable::Derivative;
use differentiable::Differentiable;
pub use error::MoveError;
pub use fault::{Fault, FaultKind, Place};
use fold_check::FoldCheck;
pub use held_back::{Beyond, HeldBack};
use in_work::{Amend, InWork, Listener, StageWatch, end_stage};
use meter::Meter;
use outcome::Found;
pub use outcome::{
    Deviation, FamilyReport, HeldBackSummary, Moved, MovedSection, Outcome, ProfileReport, Solver, StageName,
    StageQuality, StageRelaxation, Strained,
};
pub use product_error::{NotDifferentiable, ProductError};
pub use products::Gradient;
pub use refused::{Refused, Why};
pub use settings::Settings;
use stage_clock::StageClock;
pub use stage_clock::StageSeconds;
use surface_betas::SurfaceBetas;
pub use warnings::Warning;

use crate::{
    backend::Backend,
    families::{Families, PlacedBy, Role, SetupError, held_by_roles},
    memory::check_memory,
    mesh::Displacement,
    mesh::{
        self, CornerCells, FamilyId, HybridMesh, KindQuality, Order, OtherCells, TetMesh, Topology, half_edge::Surface,
    },
    quality::{self, Statistics, faults::EdgeAngles},
    stage::{Kept, SetUp, Stage, Wanted},
    stages::{MadeBySurfaces, STAGES, Stages, WingProfiles, Wings},
    volume::{EdgeGraph, VolumeResult, VolumeSettings, displaced},
};

/// Moves one mesh to one design after another.
pub struct Mover {
    mesh: Arc<TetMesh>,
    others: Arc<OtherCells>,
    progress: Progress,
    optimises: bool,
    /// The vertices of each family `[n_families]`, ascending, in the order of `mesh`.
    family_vertices: Vec<Vec<u32>>,
    order: Arc<Order>,
    /// The mesh in `order`, in which the corner tets of other cells follow the tets. All fields
    /// below are in `order` too.
    ordered: TetMesh,
    cells: Arc<CornerCells>,
    surface: Surface,
    edge_angles: EdgeAngles,
    families: Families,
    stopping: Stopping,
    method: Method,
    backend: Arc<dyn Backend>,
    original_beta: Vec<f64>,
    /// `None` if there are other cells than tets.
    surface_betas: Option<SurfaceBetas>,
    /// Quality of each kind of cell of the undeformed mesh. `None` for a mesh of tets.
    original_kinds: Option<Vec<KindQuality>>,
    /// The families of each wing, by name.
    wing_families: BTreeMap<String, Vec<FamilyId>>,
    stages: Stages,
    meter: Arc<Meter>,
}

/// Largest increase of a wing vertex's distance from its profile in a valid outcome, as a fraction
/// of the profile's length (about its chord); see [`Missed`](crate::profile::Missed).
pub const MISSED: f64 = 2e-3;

/// Largest distance of a vertex of a rigid family from where the family's motion has it, as a
/// fraction of the vertex's shortest edge in the family. Only vertices that another family places
/// have such a distance, and all of it falls on one row of triangles.
pub const STRAINED: f64 = 0.2;

impl Mover {
    /// Begins a mover of this mesh; see [`MoverBuilder`].
    pub fn builder(mesh: impl Into<Arc<TetMesh>>) -> MoverBuilder {
        MoverBuilder::new(mesh.into())
    }

    /// Checks the mesh and sets every stage up.
    ///
    /// - `roles` `[n_families]`
    /// - `settings`: with the number of movers for which the memory must suffice
    ///
    /// # Errors
    /// See [`MoverBuilder::build`].
    fn set_up(
        mut mesh: Arc<TetMesh>,
        others: Arc<OtherCells>,
        roles: Vec<Role>,
        wings: &[WingProfiles],
        (settings, movers): (Settings, usize),
        backend: Arc<dyn Backend>,
        observer: Progress,
    ) -> Result<Self, MoveError> {
        let of_mover = needs::bytes(HybridMesh { mesh: &mesh, others: &others }, wings);
        check_memory(of_mover.saturating_mul(movers as u64))
            .map_err(|error| MoveError::Memory { cells: mesh::counted(mesh.tets.len(), others.n_cells()), error })?;
        observer("topology");
        // Movers of one mesh share it.
        if !mesh.has_turned_tets() {
            Arc::make_mut(&mut mesh).turn_tets();
        }
        let given = HybridMesh { mesh: &mesh, others: &others };
        mesh::check(given)?;
        let order = Arc::new(Order::new(given, &held_by_roles(given, &roles)));
        let (of_tets, of_others) = (order.of(&mesh), order.of_others(&others));
        let hybrid = HybridMesh { mesh: &of_tets, others: &of_others };
        // A mesh of tets is not copied.
        let corners = (!others.is_empty()).then(|| CornerCells::new(hybrid));
        let cells = match &corners {
            Some((_, cells)) => Arc::new(cells.clone()),
            None => Arc::new(CornerCells::of_tets(mesh.tets.len())),
        };
        let simplices = corners.as_ref().map_or(&of_tets, |(simplices, _)| simplices);
        let (topology, edge_graph) = rayon::join(|| Topology::new(hybrid), || EdgeGraph::new(simplices, &cells));
        // Errors name vertices and cells by their numbers in the mesh that was given.
        let Topology { surface, .. } = topology.or_else(|error| Topology::new(given).and(Err(error)))?;
        check_inside(given, &surface, &roles)?;
        let ordered = corners.map_or(of_tets, |(simplices, _)| simplices);
        let Settings { springs, method, stopping, quality, limits, max_steps } = settings;
        observer("families");
        let families = Families::new(&ordered, &surface, roles)?;
        let set_up = SetUp {
            mesh: &ordered,
            cells: &cells,
            surface: &surface,
            families: &families,
            backend: backend.as_ref(),
            method,
            stopping,
        };
        let wing_families = wings.iter().map(|wing| (wing.name.clone(), wing.families.clone())).collect();
        let (original_beta, edge_angles) = rayon::join(
            || quality::betas(&ordered.vertices, &ordered.tets),
            || EdgeAngles::new(&ordered.vertices, &surface.triangles, &surface.opposite),
        );
        let original_kinds =
            (!cells.are_tets()).then(|| mesh::by_kind(given, &mesh::measures(given, &mesh.vertices, None), false));
        // Without tets beta has no meaning, and any scale does.
        let lowest = if cells.n_tets > 0 { Statistics::new(&original_beta[..cells.n_tets]).min } else { 1.0 };
        let volume = VolumeSettings { springs, quality, max_steps };
        let surface_betas = cells.are_tets().then(|| SurfaceBetas::new(&ordered, &families, &original_beta));
        let stages = Stages::new(&set_up, wings, edge_graph, volume, lowest, &*observer)?;
        let family_vertices = |family| {
            let mut vertices: Vec<u32> =
                surface.vertices_of(FamilyId(family)).iter().map(|&place| order.vertex(place)).collect();
            vertices.sort_unstable();
            vertices
        };
        Ok(Self {
            family_vertices: (0..mesh.families.len() as u16).map(family_vertices).collect(),
            original_kinds,
            meter: Arc::new(Meter::new(mesh.clone(), others.clone(), limits)),
            mesh,
            others,
            progress: observer,
            optimises: quality.is_some(),
            order,
            ordered,
            cells,
            surface,
            edge_angles,
            families,
            stopping,
            method,
            backend,
            surface_betas,
            original_beta,
            wing_families,
            stages,
        })
    }

    /// The undeformed mesh in the order in which it was given, with its tets turned by
    /// [`TetMesh::turn_tets`].
    pub fn mesh(&self) -> &TetMesh {
        &self.mesh
    }

    /// The undeformed mesh and its cells that are no tets, for further movers.
    pub(crate) fn shared_mesh(&self) -> (Arc<TetMesh>, Arc<OtherCells>) {
        (self.mesh.clone(), self.others.clone())
    }

    /// The backend that relaxes networks and optimises tets.
    pub fn backend(&self) -> &dyn Backend {
        self.backend.as_ref()
    }

    /// The vertices of a family, ascending; `None` if the mesh has no family of this name.
    pub fn family_vertices(&self, family: &str) -> Option<&[u32]> {
        Some(&self.family_vertices[self.mesh.family(family)?.index()])
    }

    /// Tells the progress function that a piece of work begins.
    pub(crate) fn tell(&self, what: &str) {
        (self.progress)(what);
    }

    /// Replaces the function that gets the name of each stage as the stage begins.
    pub fn on_progress(&mut self, progress: impl Fn(&str) + Send + 'static) {
        self.progress = Box::new(progress);
    }

    /// Sets where the volume's springs start in later updates. The default is
    /// [`Start::Undeformed`].
    pub fn start_from(&mut self, start: Start) {
        self.stages.volume.start_from(start);
    }

    /// Moves the undeformed mesh to a design.
    ///
    /// # Errors
    /// - [`MoveError::Unknown`], [`MoveError::Profiles`], [`MoveError::Prescribed`],
    ///   [`MoveError::Disagree`]: the design does not fit the mesh
    /// - [`MoveError::Stage`]: the memory does not suffice for a path of steps, or a junction
    ///   cannot slide
    /// - [`MoveError::Backend`]: the backend failed
    ///
    /// Inverted tets and relaxations that did not converge are no errors; see [`Outcome`].
    pub fn update(&mut self, design: &Design) -> Result<Outcome, MoveError> {
        self.run(design, None, &|_| ControlFlow::Continue(()))
    }

    /// Checks a design as far as it can be checked without moving the volume: its names, its
    /// prescribed displacements, and its new profiles against the old ones.
    ///
    /// # Errors
    /// Those of [`Mover::update`] that say that the design does not fit the mesh.
    pub fn check(&mut self, design: &Design) -> Result<(), MoveError> {
        self.check_names(design)?;
        let Self { ordered: mesh, order, families, stages, family_vertices, .. } = self;
        place_given(mesh, order, family_vertices, families, &mut stages.wings, design).map(drop)
    }

    /// [`Mover::update`] with a function that may stop the update. The function hears what the
    /// progress function hears; see [`MoverBuilder::progress`]. After [`ControlFlow::Break`] the
    /// present stage goes on to its end, and no further stage begins.
    ///
    /// # Errors
    /// [`MoveError::Stopped`]: the function stopped the update. Otherwise as [`Mover::update`].
    pub fn update_telling(
        &mut self,
        design: &Design,
        progress: &dyn Fn(&str) -> ControlFlow<()>,
    ) -> Result<Outcome, MoveError> {
        self.run(design, None, progress)
    }

    /// [`Mover::update`] with a function that may change the displacements after each stage.
    ///
    /// - `amend`: gets the name of a stage as the stage ends, and the displacements so far
    ///   `[n_vertices]`, in the mesh's unit and order. Changed displacements are checked like the
    ///   stage's own.
    ///
    /// # Errors
    /// As [`Mover::update`].
    #[doc(hidden)]
    pub fn update_amended(
        &mut self,
        design: &Design,
        amend: &mut dyn FnMut(&str, &mut Displacement),
    ) -> Result<Outcome, MoveError> {
        self.run(design, Some(amend), &|_| ControlFlow::Continue(()))
    }

    fn run(
        &mut self,
        design: &Design,
        mut amend: Option<&mut Amend>,
        tell: &dyn Fn(&str) -> ControlFlow<()>,
    ) -> Result<Outcome, MoveError> {
        let work = self.move_surfaces(design, amend.as_deref_mut(), tell)?;
        self.move_inside(design, work, amend, tell)
    }

    /// The part of an update before the volume.
    fn move_surfaces(
        &mut self,
        design: &Design,
        mut amend: Option<&mut Amend>,
        tell: &dyn Fn(&str) -> ControlFlow<()>,
    ) -> Result<InWork, MoveError> {
        self.check_names(design)?;
        let device_work = self.backend.work().unwrap_or_default();
        let Self { ordered: mesh, cells, order, surface, edge_angles, families, stages, progress, .. } = self;
        let listener = Listener::new(progress, tell);
        let observer = |what: &str| listener.hear(what);
        let (backend, method, stopping) = (self.backend.as_ref(), self.method, self.stopping);
        let set_up = SetUp { mesh, cells, surface, families, backend, method, stopping };
        let mut clock = StageClock::start(backend);
        let mut watch = StageWatch::new(cells.clone());
        let mut fold_check = FoldCheck::new(mesh, surface);
        let betas = &self.original_beta;
        match &self.surface_betas {
            Some(of_surfaces) => watch.record_statistics(StageName::Original, &of_surfaces.undeformed(betas)),
            None => {
                watch.record(StageName::Original, betas);
            }
        }
        let mut record = |name, here: &[DVec3]| match &self.surface_betas {
            Some(of_surfaces) => watch.record_statistics(name, &of_surfaces.at(mesh, families, betas, here)),
            None => {
                watch.record(name, &quality::betas_after(betas.clone(), &mesh.vertices, here, &mesh.tets));
            }
        };

        observer(STAGES[0].name);
        let (mut displacement, wanted) =
            place_given(mesh, order, &self.family_vertices, families, &mut stages.wings, design)?;
        record(StageName::Deformed, &displaced(&mesh.vertices, &displacement));

        let mut ends = Vec::with_capacity(STAGES.len());
        for row in STAGES.iter().filter(|row| row.placed_by < PlacedBy::Volume) {
            // The first stage began with the interpolation of the profiles.
            if row.placed_by > PlacedBy::Wing {
                observer(row.name);
            }
            listener.go_on()?;
            ends.push((row.name, (row.of)(stages).run(&set_up, &mut displacement, &observer)?));
            let here = end_stage(&set_up, order, row, amend.as_deref_mut(), &mut displacement);
            fold_check.fold_check(&set_up, edge_angles, row, &here);
            if row.placed_by == PlacedBy::Plane {
                record(StageName::Corrected, &here);
            }
            clock.end(backend, row.name);
        }
        // Vertices that are held have their final displacement since the wing's stage.
        let held_back = held_back::held_back(mesh, surface, families, &wanted, &displacement);
        let made = MadeBySurfaces::default();
        Ok(InWork { displacement, held_back, ends, watch, clock, fold_check, device_work, made, jump: None })
    }

    /// The part of an update from the volume on.
    fn move_inside(
        &mut self,
        design: &Design,
        work: InWork,
        amend: Option<&mut Amend>,
        tell: &dyn Fn(&str) -> ControlFlow<()>,
    ) -> Result<Outcome, MoveError> {
        let InWork {
            mut displacement,
            held_back,
            mut ends,
            mut watch,
            mut clock,
            mut fold_check,
            device_work,
            jump,
            ..
        } = work;
        let Self { ordered: mesh, cells, order, surface, edge_angles, families, stages, progress, .. } = self;
        let listener = Listener::new(progress, tell);
        let (backend, method, stopping) = (self.backend.as_ref(), self.method, self.stopping);
        let set_up = SetUp { mesh, cells, surface, families, backend, method, stopping };
        let row = &STAGES[STAGES.len() - 1];
        listener.hear(row.name);
        stages.volume.expect_refusal(held_back.iter().any(|held| held.beyond.is_some()));
        listener.go_on()?;
        // No jump of a design that ended early is left for another one.
        stages.volume.go_on_from(jump);
        ends.push((row.name, stages.volume.run(&set_up, &mut displacement, &|what| listener.hear(what))?));
        let here = end_stage(&set_up, order, row, amend, &mut displacement);
        fold_check.fold_check(&set_up, edge_angles, row, &here);
        clock.end(backend, row.name);
        listener.go_on()?;
        let VolumeResult { vertices, beta, convergence: volume, path, smoothed, kept, jump_converged } =
            stages.volume.take_result().expect("the volume is the last stage");
        let beta = quality::betas_after(beta, &vertices, &here, &mesh.tets);
        drop(vertices);
        let vertices = here;
        let mut inverted = watch.record(StageName::Final, &beta).inverted;
        let given = HybridMesh { mesh: &self.mesh, others: &self.others };
        let measures = (!self.cells.are_tets())
            .then(|| mesh::measures(given, &self.order.of_vertices(&vertices), Some(&self.mesh.vertices)));
        let kinds = measures.as_ref().map(|measures| mesh::by_kind(given, measures, true));
        if let Some(kinds) = &kinds {
            inverted = kinds.iter().map(|kind| kind.inverted).sum();
            // The volume of a whole cell counts too.
            watch
                .stages
                .iter_mut()
                .filter(|stage| stage.name == StageName::Final)
                .for_each(|stage| stage.inverted = inverted);
        }

        let unconverged: Vec<_> =
            ends.iter().filter(|(_, end)| !end.converged).map(|(stage, end)| (*stage, end.error)).collect();
        let failed = ends.iter().find_map(|(_, end)| end.failed);
        let FoldCheck { folds, folded, .. } = fold_check;
        // The volume is the last stage. Its jump counts, not the steps that may have followed.
        let surfaces_converged = ends.iter().rev().skip(1).all(|(_, end)| end.converged);
        let kept = match products::without_products(&self.ordered, &self.families) {
            Some(why) => Err(why),
            None if let Some(why) = products::not_matched(&self.stages.wings) => Err(why),
            None if !(surfaces_converged && jump_converged) => Err(NotDifferentiable::Unconverged),
            None => {
                let mut kept = Kept { profiles: design.profiles.clone(), ..kept };
                let products = STAGES.iter().filter_map(|row| row.products);
                products.for_each(|products| products(&mut self.stages).keep(&mut kept));
                Ok(kept)
            }
        };
        let mut folded = folded;
        for (family, count) in self.turned_over(&vertices) {
            let own = folded.entry(family).or_default();
            *own = count.max(*own);
        }
        let folded =
            folded.into_iter().map(|(family, count)| (self.mesh.families[family.index()].clone(), count)).collect();
        let self_intersecting = self.stages.volume.newly_self_intersecting(&self.ordered, &vertices);
        let distances_off = self.distances_off(&vertices);
        let families = self.family_reports(&vertices, &distances_off, &folded, &self_intersecting, &held_back);
        let missed = self
            .stages
            .wings
            .missed(&design.profiles, &vertices)
            .map_err(|(family, error)| MoveError::Profiles { family, error })?;
        let creases = self.creases(&vertices);
        let mut warnings = self.warnings(&vertices, &held_back, design, &missed, (&folded, creases.others), smoothed);
        let longest = families.iter().filter_map(|(family, report)| Some((family, report.edge_ratios?[1])));
        warnings.extend(warnings::stretched(longest));
        let (profiles, sections) = self.profile_reports(&vertices, design, &missed, &self.stages.wings.flat_cuts());
        let parted = self.parted(&vertices);
        // Each array in the order of the mover is freed before the next one is brought into the
        // order of the mesh.
        let of_tets = |ordered: Vec<f64>| self.order.of_tets(&ordered[..self.cells.n_tets]);
        let of_vertices = |ordered: Vec<DVec3>| self.order.of_vertices(&ordered);
        let beta = of_tets(beta);
        let moved = Moved { displacement: of_vertices(displacement), vertices: of_vertices(vertices) };
        Ok(Outcome {
            differentiable: Differentiable::new(
                kept,
                path.steps,
                smoothed.map_or(0, |smoothed| smoothed.moved),
                products::kinked(&self.stages.wings),
            ),
            off_surface: self.off_surface(&distances_off),
            parted,
            strained: self.strained(),
            missed_surfaces: self.missed_surfaces(),
            warnings,
            creased: creases.bodies,
            held_back,
            families,
            profiles,
            sections,
            asked: design.profiles.clone(),
            relaxations: StageRelaxation::of_stages(ends),
            missed: self.beyond(missed),
            nearest_to_refusal: self.stages.wings.nearest_to_refusal(),
            solver: self.solver_report(&volume),
            device_work: self.backend.work().map(|work| work.since(device_work)),
            stage_seconds: clock.stop(self.backend.as_ref()),
            stages: watch.stages,
            original_beta: self.order.of_tets(&self.original_beta[..self.cells.n_tets]),
            beta,
            cell_measures: measures,
            kinds,
            original_kinds: self.original_kinds.clone(),
            converged: unconverged.is_empty(),
            unconverged,
            inverted,
            folds,
            folded,
            self_intersecting: self.surface.in_mesh(&self_intersecting),
            path,
            smoothed,
            moved,
            mesh: self.mesh.clone(),
            others: self.others.clone(),
            optimises: self.optimises,
            failed,
            found: Found::default(),
            meter: self.meter.clone(),
            measured: OnceLock::new(),
            exceeded: Vec::new(),
        }
        .judged())
    }

    /// Refuses a design with names that the mover does not have. Otherwise a part of the design
    /// would be ignored in silence.
    fn check_names(&self, design: &Design) -> Result<(), MoveError> {
        let wings: Vec<String> = self.wing_families.keys().cloned().collect();
        let of_role = self.families.families_of(PlacedBy::Prescribed);
        let prescribed: Vec<String> = of_role.map(|family| self.mesh.families[family.index()].clone()).collect();
        let unknown = |prescribed, name: &String, known| MoveError::Unknown { name: name.clone(), prescribed, known };
        if let Some(name) = design.profiles.keys().find(|name| !wings.contains(name)) {
            return Err(unknown(false, name, wings));
        }
        match design.prescribed.keys().find(|name| !prescribed.contains(name)) {
            Some(name) => Err(unknown(true, name, prescribed)),
            None => Ok(()),
        }
    }
}

/// Places the vertices that profiles and tables of displacements move. Returns the displacements
/// `[n_vertices]`, and the positions that were asked for.
fn place_given(
    mesh: &TetMesh,
    order: &Order,
    family_vertices: &[Vec<u32>],
    families: &Families,
    wings: &mut Wings,
    design: &Design,
) -> Result<(Displacement, Vec<Wanted>), MoveError> {
    let mut displacement: Displacement = vec![DVec3::ZERO; mesh.vertices.len()];
    let mut wanted = Vec::new();
    prescribed::prescribe(mesh, order, family_vertices, families, design, &mut displacement, &mut wanted)?;
    wings
        .interpolate(families, &design.profiles, &mut displacement, &mut wanted)
        .map_err(|(family, error)| MoveError::Profiles { family, error })?;
    Ok((displacement, wanted))
}

/// Checks that families inside the volume have the role interior, and no others.
fn check_inside(mesh: HybridMesh, surface: &Surface, roles: &[Role]) -> Result<(), SetupError> {
    let mut has_faces = vec![false; roles.len()];
    (0..mesh.n_faces() as u32).filter_map(|face| mesh.family_of(face)).for_each(|id| has_faces[id.index()] = true);
    for (index, role) in roles.iter().enumerate() {
        let on_boundary = !surface.triangles_of(FamilyId(index as u16)).is_empty();
        let family = || mesh.mesh.families[index].clone();
        if *role == Role::Interior && on_boundary {
            return Err(SetupError::NotInside { family: family() });
        }
        if *role != Role::Interior && has_faces[index] && !on_boundary {
            return Err(SetupError::Inside { family: family(), role: role.name() });
        }
    }
    Ok(())
}
