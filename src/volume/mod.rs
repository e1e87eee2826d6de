//! The stage that moves all vertices inside, after the surfaces: springs, a path of steps, and
//! local optimisation.
//!
//! **One jump.** The springs first move the inside in one jump from the undeformed mesh, which is
//! enough for most designs. If the jump inverts tets in a few places, local optimisation tries to
//! untangle the mesh there.
//!
//! **Path of steps.** If it cannot, the surfaces follow a route to their new places in steps (see
//! [`route`]). A step starts from the mesh of the step before, with the stiffness and rest edges of
//! that mesh. A step that inverts a tet beyond local optimisation is repeated at half its length,
//! with the same springs. After a successful step the next is twice as long. On the path local
//! optimisation moves inner vertices only, and runs only when tets get bad; at the end it may also
//! slide vertices of surfaces. All steps follow from the design and the undeformed mesh, so the
//! result depends on the design alone.
//!
//! **Cost.** Local optimisation comes first because a step needs a set-up of its own. A half
//! aircraft of 2.8 million tets in thin layers, with profiles 1 % thicker, has 52 inverted tets
//! after its jump. Local optimisation restores it in 4 s; with steps alone 157 s and 63 attempts
//! were needed. For a wing turned by 180 degrees local optimisation on the path saves 0.3 of the
//! time.
//!
//! The paper moves the inside in one jump, without local optimisation.

use std::thread;

use glam::DVec3;
use serde::Serialize;

pub mod edges;
mod optimisation;
mod products;
pub mod rotation;
pub mod route;
pub mod sliding;
pub mod springs;
pub mod start;
mod stepping;
mod surface_turn_products;
mod surface_turns;

pub use edges::EdgeGraph;
pub use start::Start;

use optimisation::{ENOUGH, IMPROVED, MovedMesh, Smoothing, after};
use route::{Bodies, OnBody};
use springs::{VolumeNetwork, constraint};
use stepping::Stepping;

use crate::{
    backend::BackendError,
    constraint::Constraint,
    families::Families,
    mesh::{Displacement, TetMesh},
    projection::crossing::Crossings,
    quality::{Statistics, faults},
    relaxation::{Convergence, Method, Stopping},
    smoothing::{Merit, QualityTarget, Smoothed, moved},
    springs::Springs,
    stage::{Kept, NoProduct, Products, SetUp, Stage, StageError},
};

/// Default for the number of steps that an update may try. A half turn takes four, or six without
/// local optimisation.
pub const MAX_STEPS: usize = 64;

/// The volume stage. Set up once per mesh.
pub struct VolumeStage {
    /// `None` after a path of steps, whose networks needed its memory. The next design sets it up
    /// again.
    volume: Option<VolumeNetwork>,
    /// Vertices without springs to a held vertex, ascending. They are held.
    floating: Vec<u32>,
    method: Method,
    start: Start,
    bodies: Bodies,
    smoothing: Option<Smoothing>,
    stepping: Stepping,
    /// Of the surfaces.
    crossings: Crossings,
    /// Whether the next result will be refused in any case.
    refusal_expected: bool,
    /// The jump that the next run goes on from.
    jump: Option<Jump>,
    /// What the last run made, until it is taken.
    result: Option<VolumeResult>,
}

/// The springs' jump from the undeformed mesh to a design.
pub struct Jump {
    /// Displacement of each vertex `[n_vertices]`, in the mesh's unit.
    displacement: Displacement,
    convergence: Convergence,
    /// The rotation vector of each vertex `[n_vertices]`, in radians. Empty if the springs are not
    /// rotation-aware.
    rotations: Vec<DVec3>,
}

/// How the inside is moved.
#[derive(Clone, Copy, Debug)]
pub struct VolumeSettings {
    /// Its springs.
    pub springs: &'static Springs,
    /// What local optimisation aims at; none is done without.
    pub quality: Option<QualityTarget>,
    /// Most steps of a run, the jump that is tried first and those given up included; 1 is the jump
    /// alone.
    pub max_steps: usize,
}

/// The steps of an update.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Path {
    /// Steps of the path to the result. 1 is a jump from the undeformed mesh.
    pub steps: usize,
    /// Steps that were tried and given up. The jump counts if steps followed it.
    pub given_up: usize,
    /// Share of the route with valid meshes, in `0..=1`. If it is less than 1, no further step
    /// succeeded, and the mesh is the jump's.
    pub reached: f64,
    /// Every step that was tried, in order, the jump first.
    pub tried: Vec<TriedStep>,
}

/// A step of the surfaces along their route, kept or given up. Shares of the route are from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TriedStep {
    /// Share of the route at which the step began.
    pub from: f64,
    /// Share of the route at which it ended.
    pub to: f64,
    /// The verdict on the step.
    pub verdict: StepVerdict,
    /// Number of tets that the springs left inverted. A corner of another cell counts as a tet.
    pub inverted: usize,
    /// The same after local optimisation, if it ran.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inverted_optimised: Option<usize>,
    /// The worst [`Merit`] in the end: beta in a mesh of tets. `None` if the springs did not
    /// converge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst: Option<f64>,
}

/// What became of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StepVerdict {
    /// It is a part of the path.
    Kept,
    /// Tets are inverted, or local optimisation at its end was not good enough.
    Inverted,
    /// Its springs did not converge.
    NotConverged,
}

impl Path {
    /// The step that made the mesh of the result.
    ///
    /// - `stuck`: whether the path reached no end, so that the mesh is the jump's
    fn last_mut(&mut self, stuck: bool) -> Option<&mut TriedStep> {
        if stuck { self.tried.first_mut() } else { self.tried.last_mut() }
    }
}

impl TriedStep {
    /// A step of which nothing was measured, because its springs did not converge.
    fn not_converged(from: f64, to: f64) -> Self {
        Self { from, to, verdict: StepVerdict::NotConverged, inverted: 0, inverted_optimised: None, worst: None }
    }

    /// A step with the mesh that the springs made.
    fn of(from: f64, to: f64, state: &MovedMesh) -> Self {
        let worst = state.worst.is_finite().then_some(state.worst);
        Self { from, to, verdict: StepVerdict::Inverted, inverted: state.inverted, inverted_optimised: None, worst }
    }

    /// The step after local optimisation.
    fn optimised(&mut self, state: &MovedMesh) {
        self.inverted_optimised = Some(state.inverted);
        self.worst = state.worst.is_finite().then_some(state.worst);
    }
}

/// What a run made, beside the displacement.
#[derive(Clone, Debug)]
pub struct VolumeResult {
    /// Positions of all vertices after the motion `[n_vertices]`, in the mesh's unit.
    pub vertices: Vec<DVec3>,
    /// Beta of each tet, and of each corner tet a number of the sign of its beta `[n_simplices]`.
    pub beta: Vec<f64>,
    /// Convergence of the springs, all steps together.
    pub convergence: Convergence,
    /// The steps taken.
    pub path: Path,
    /// The result of local optimisation at the end. `None` if it was off or not needed.
    pub smoothed: Option<Smoothed>,
    /// What products need of the jump.
    pub kept: Kept,
    /// Whether the springs of the jump reached their tolerance.
    pub jump_converged: bool,
}

impl VolumeStage {
    /// Sets up springs and local optimisation.
    ///
    /// - `edge_graph`: the edges of the mesh's cells
    /// - `lowest`: the undeformed mesh's smallest beta; any positive number if no cell is a tet
    /// - `shaped`: vertices that give wings their profiles: they do not slide
    ///
    /// # Errors
    /// The backend failed, or the mesh does not fit the device.
    pub fn new(
        set_up: &SetUp,
        edge_graph: EdgeGraph,
        settings: VolumeSettings,
        lowest: f64,
        shaped: &[u32],
    ) -> Result<Self, BackendError> {
        let SetUp { mesh, cells, surface, families, .. } = *set_up;
        let VolumeSettings { springs, quality, max_steps } = settings;
        let (volume, crossings) = rayon::join(
            || VolumeNetwork::last(set_up, edge_graph, springs),
            || Crossings::new(&mesh.vertices, &surface.triangles),
        );
        let volume = volume?;
        let floating = volume.floating(families);
        let enough = if quality == Some(QualityTarget::Improve) { IMPROVED } else { ENOUGH } * lowest;
        let merit = Merit::new(cells.clone(), &mesh.tets, &mesh.vertices, enough);
        let smoothing = quality.map(|target| Smoothing::new(set_up, target, lowest, merit.clone(), shaped, &floating));
        let stepping = Stepping { springs, lowest, max_steps, merit };
        let (method, start) = (volume.method(), Start::default());
        Ok(Self {
            volume: Some(volume),
            floating,
            method,
            start,
            bodies: Bodies::new(set_up),
            smoothing,
            stepping,
            crossings,
            refusal_expected: false,
            jump: None,
            result: None,
        })
    }

    /// The method that relaxes the volume's springs; never [`Method::Auto`].
    pub fn method(&self) -> Method {
        self.method
    }

    /// Lets vertices slide on rigid bodies along the path of steps.
    pub fn let_slide(&mut self, on_bodies: Vec<OnBody>) {
        self.bodies.let_slide(on_bodies);
    }

    /// Says whether the result of the next run will be refused for the places of surfaces, whatever
    /// the volume does. Then a run makes one jump, and repairs nothing.
    pub fn expect_refusal(&mut self, is_expected: bool) {
        self.refusal_expected = is_expected;
    }

    /// Sets the start of the springs for further updates.
    pub fn start_from(&mut self, start: Start) {
        self.start = start;
        if let Some(volume) = &mut self.volume {
            volume.start_from(start);
        }
    }

    /// The jumps of several designs, whose springs are read together. Each has the bits of the jump
    /// that a run of its design makes, if the springs start from the undeformed mesh.
    ///
    /// - `surfaces`: displacements after the stages of the surfaces `[n_vertices]`, in the mesh's
    ///   unit
    /// - `observer`: as for [`Stage::run`]
    ///
    /// # Errors
    /// The backend failed.
    pub fn jumps<'d>(
        &mut self,
        set_up: &SetUp,
        surfaces: impl Iterator<Item = &'d Displacement>,
        observer: &dyn Fn(&str),
    ) -> Result<Vec<Jump>, BackendError> {
        let mut displacements: Vec<Displacement> = surfaces.cloned().collect();
        let tell = |share: f64| observer(&told(share));
        let mut all: Vec<&mut Displacement> = displacements.iter_mut().collect();
        let results = self.network(set_up)?.0.run_together(&set_up.mesh.vertices, &mut all, &set_up.stopping, &tell)?;
        let jump = |(displacement, (convergence, rotations))| Jump { displacement, convergence, rotations };
        Ok(displacements.into_iter().zip(results).map(jump).collect())
    }

    /// Lets the next run go on from the jump of its design, or make its own.
    pub fn go_on_from(&mut self, jump: Option<Jump>) {
        self.jump = jump;
    }

    /// The start of the springs.
    pub fn start(&self) -> Start {
        self.start
    }

    /// What the last run made; none before the first one, or if it was taken.
    pub fn take_result(&mut self) -> Option<VolumeResult> {
        self.result.take()
    }

    /// The surface triangles that intersect others at `vertices` `[n_vertices]` and did not in the
    /// undeformed mesh; see [`Crossings::newly_self_intersecting`].
    pub fn newly_self_intersecting(&mut self, mesh: &TetMesh, vertices: &[DVec3]) -> Vec<u32> {
        self.crossings.newly_self_intersecting(&mesh.vertices, vertices)
    }

    /// The network of the undeformed mesh, which a path of steps may have used up, and the test of
    /// the surfaces.
    fn network(&mut self, set_up: &SetUp) -> Result<(&mut VolumeNetwork, &mut Crossings), BackendError> {
        let Self { volume, crossings, stepping, start, .. } = self;
        let network = match volume.take() {
            Some(network) => network,
            None => {
                let edge_graph = EdgeGraph::new(set_up.mesh, set_up.cells);
                let mut network = VolumeNetwork::last(set_up, edge_graph, stepping.springs)?;
                network.start_from(*start);
                network
            }
        };
        Ok((volume.insert(network), crossings))
    }

    /// Whether a tet with held vertices only is inverted. Then no path of steps helps.
    fn surfaces_invert(&self, state: &MovedMesh, mesh: &TetMesh, families: &Families) -> bool {
        let held = |&vertex: &u32| constraint(families, &self.floating, vertex) == Constraint::Held;
        mesh.tets.iter().zip(&state.beta).any(|(tet, &beta)| faults::is_inverted(beta) && tet.iter().all(held))
    }
}

impl Stage for VolumeStage {
    /// Moves everything that no stage has placed, and slides the plane families on;
    /// [`VolumeStage::take_result`] has the rest of what it makes.
    fn run(
        &mut self,
        set_up: &SetUp,
        displacement: &mut Displacement,
        observer: &dyn Fn(&str),
    ) -> Result<Convergence, StageError> {
        let SetUp { mesh, stopping, .. } = set_up;
        self.result = None;
        let surfaces = displacement.clone();
        let (mut convergence, rotations) = match self.jump.take() {
            Some(Jump { displacement: jump, convergence, rotations }) => {
                *displacement = jump;
                (convergence, rotations)
            }
            None => {
                let tell = |share: f64| observer(&told(share));
                let (network, crossings) = self.network(set_up)?;
                let mut run = || network.run(&mesh.vertices, displacement, stopping, &tell);
                match set_up.backend.work() {
                    // The springs keep the processor busy.
                    None => run()?,
                    // The surfaces are tested while the device works. Those that slide there are
                    // tested again at the end.
                    Some(_) => thread::scope(|scope| {
                        let at = displaced(&mesh.vertices, &surfaces);
                        scope.spawn(move || crossings.newly_self_intersecting(&mesh.vertices, &at));
                        run()
                    })?,
                }
            }
        };
        let jump_converged = convergence.converged;
        let mut state = MovedMesh::new(displaced(&mesh.vertices, displacement), &mesh.tets, &self.stepping.merit);
        let mut path = Path { steps: 1, tried: vec![TriedStep::of(0.0, 1.0, &state)], ..Path::default() };
        // No valid volume exists between surfaces that intersect. Where the jump did not converge,
        // the steps of a path would not either, and each of them would take all its sweeps.
        let mut stuck =
            state.inverted > 0 && (!jump_converged || !self.newly_self_intersecting(mesh, &state.vertices).is_empty());
        // Displacements that are not finite come from a relaxation that diverged. No path leads
        // there.
        let somewhere = surfaces.iter().all(|displacement| displacement.is_finite());
        let (mut smoothed, mut on_the_way) = (None, None);
        if state.inverted > 0
            && somewhere
            && !stuck
            && !self.refusal_expected
            && self.stepping.max_steps > 1
            && !self.surfaces_invert(&state, mesh, set_up.families)
        {
            // Optimisation of inverted corners of other cells changes the thickness of layers, so
            // steps come first there. It follows below if they do not reach the end.
            let mut repaired = None;
            if set_up.cells.are_tets() {
                repaired = self.stepping.repair_last(&state, self.smoothing.as_mut(), set_up, observer)?;
                repaired.iter().for_each(|(better, _)| path.tried[0].optimised(better));
            }
            if !repaired.as_ref().is_some_and(|(state, _)| self.stepping.is_good(state)) {
                let route = self.bodies.route(mesh, set_up.families, &surfaces);
                let (stepping, volume) = (self.stepping.clone(), self.volume.take());
                let followed = stepping.follow(&route, volume, self.smoothing.as_mut(), set_up, stopping, observer)?;
                convergence = convergence.and(followed.convergence);
                let jump = path.tried;
                path = followed.path;
                path.tried.splice(..0, jump);
                stuck = path.reached < 1.0;
                if path.reached >= 1.0 {
                    (state, smoothed, repaired) = (followed.state, followed.smoothed, None);
                    on_the_way = followed.on_the_way;
                }
            }
            if let Some((better, by)) = repaired {
                (state, smoothed) = (better, Some(by));
            }
        }
        if let Some(smoothing) = &mut self.smoothing
            && smoothed.is_none()
            && !self.refusal_expected
            && (!stuck || state.is_local())
            && state.worst < smoothing.enough
        {
            observer("smoothing");
            // Where few corners are flat, to raise them keeps the layers, which the rest may
            // change.
            smoothed = smoothing.raise_flat_corners(&mut state, None);
            if state.worst < smoothing.enough {
                let (better, by) = smoothing.run(set_up, &state)?;
                (state, smoothed) = (better, Some(after(smoothed, by)));
            }
            path.last_mut(stuck).into_iter().for_each(|step| step.optimised(&state));
        }
        if let Some(last) = path.last_mut(stuck)
            && state.inverted == 0
        {
            last.verdict = StepVerdict::Kept;
        }
        if !jump_converged {
            path.tried[0].verdict = StepVerdict::NotConverged;
        }
        if let Some(smoothing) = &self.smoothing
            && !self.refusal_expected
        {
            smoothed = smoothing.raise_flat_corners(&mut state, smoothed);
        }
        if let Some(before) = on_the_way {
            let end = Smoothed { inverted: state.inverted, beta_min: state.worst, ..Smoothed::default() };
            smoothed = Some(after(Some(before), smoothed.unwrap_or(end)));
        }
        for ((displacement, from), to) in displacement.iter_mut().zip(&mesh.vertices).zip(&state.vertices) {
            // A displacement that already gives the vertex's position keeps its bits.
            if moved(*from, *displacement) != *to {
                *displacement = *to - *from;
            }
        }
        if state.inverted == 0 {
            path.reached = 1.0;
        }
        // Of other cells the merit is no beta.
        if let Some(smoothed) = &mut smoothed
            && !set_up.cells.are_tets()
        {
            smoothed.inverted = set_up.cells.n_inverted(&state.beta);
            smoothed.beta_min = Statistics::new(&state.beta[..set_up.cells.n_tets]).min;
        }
        self.result = Some(VolumeResult {
            vertices: state.vertices,
            beta: state.beta,
            convergence: convergence.clone(),
            path,
            smoothed,
            kept: Kept { surfaces, rotations, ..Kept::default() },
            jump_converged,
        });
        Ok(convergence)
    }
}

impl Products for VolumeStage {
    /// The derivative of the jump. A path of steps and local optimisation have none.
    fn forward(
        &mut self,
        set_up: &SetUp,
        kept: &Kept,
        change: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        self.network(set_up)?.0.forward(&set_up.mesh.vertices, kept, change, stopping)
    }

    fn reverse(
        &mut self,
        set_up: &SetUp,
        kept: &Kept,
        gradient: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        self.network(set_up)?.0.reverse(&set_up.mesh.vertices, kept, gradient, stopping)
    }
}

/// The progress of the springs in words.
fn told(share: f64) -> String {
    format!("volume {:.0} %", 100.0 * share)
}

/// Positions `[n_vertices]` plus displacements `[n_vertices]`, see [`moved`].
pub fn displaced(vertices: &[DVec3], displacement: &[DVec3]) -> Vec<DVec3> {
    vertices.iter().zip(displacement).map(|(at, by)| moved(*at, *by)).collect()
}
