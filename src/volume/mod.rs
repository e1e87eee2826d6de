//! Everything inside, once the surfaces have moved: springs, a path of steps where one jump is too far, local optimisation.
//!
//! One jump from the undeformed mesh is tried first, and is enough for what designs usually ask. Where it inverts tets in a few
//! places, they are repaired there. Where they cannot be, the surfaces are led to their places in steps (see [`route`]). A step
//! starts from the mesh the one before left: the springs' stiffness and rest edges are those of that mesh. A step that inverts a
//! tet beyond repair is made half as long, with the same springs; after one that goes well the next is twice as long. On the
//! way only the inside is optimised, and only when tets get bad; in the end the whole mesh is. All steps follow from the design
//! and the undeformed mesh, so the result still depends on the design alone.
//!
//! Repairs first save the set-ups of steps: a half aircraft of 2.8 million tets in thin layers, its profiles 1 % thicker, has 52
//! inverted tets after its jump and is as good as before in 4 s; in steps alone it took 157 s and 63 attempts. A wing turned by
//! 180 degrees takes 0.7 of the time.
//!
//! The paper moves in one step and stops there.

use std::f64::consts::PI;

use glam::DVec3;
use thiserror::Error;

pub mod edges;
pub mod rotation;
pub mod route;
pub mod sliding;
pub mod springs;
pub mod start;

pub use edges::EdgeGraph;
pub use start::Start;

use route::{Bodies, Route};
use sliding::SurfaceFreedom;
use springs::VolumeNetwork;

use crate::{
    backend::{BackendError, Constraint, MemoryError, check_memory},
    mesh::{Displacement, TetMesh},
    projection::crossing::Crossings,
    quality::{self, Statistics, faults},
    relaxation::{Convergence, Method, Stopping},
    report::Path,
    smoothing::{Goal, QualityTarget, Smoothed, Smoother, moved},
    springs::Springs,
    stage::SetUp,
};

/// With the original shapes as target, the share of the original mesh's smallest beta that is good enough. Springs alone
/// keep this on most designs; repairing less would move vertices for nothing.
const ENOUGH: f64 = 0.75;

/// With improvement as target, the multiple of the original mesh's smallest beta aimed at. Where surfaces slide it is
/// reached on wing-bodies of 98 000 and of 921 000 tets; aiming at 2 takes several times as long, and ends at 1.57 to 1.95.
const IMPROVED: f64 = 1.5;

/// Most sweeps of the optimisation: it ends by itself when it no longer helps, after some tens.
const MOST_SWEEPS: usize = 400;

/// How many steps an update may try, if nothing else is said. A half turn takes four, six without repairs.
pub const MAX_STEPS: usize = 64;

/// The first step on a path turns no body by more than this, in radians; steps get longer when they go well.
const FIRST_TURN: f64 = PI / 6.0;

/// On the way tets are repaired when the worst beta falls below the first of these shares of the original mesh's, up to the
/// second. With 0.5 and 0.75 a wing's half turn takes twice as long and leaves a lower mean; with 0.2 and 0.3 its last steps
/// start from tets so bad that they take many more of them.
const REPAIR: (f64, f64) = (0.3, 0.5);

/// Steps shorter than this share of the way are not tried: a tet that stands in the way of one stands in the way of all.
const SHORTEST: f64 = 1.0 / 256.0;

/// Where more than this share of the tets is inverted nothing is repaired: it would take long and help little. Less is a fault
/// in a few places, which vertices may slide out of.
const LOCAL: f64 = 1e-3;

/// Most sweeps of a repair on the way.
const REPAIR_SWEEPS: usize = 100;

/// Memory that a path of steps takes at most for each tet, once the networks of the jump are gone: the edges of the tets and the networks
/// of a step; 345 to 363 in meshes of 0.1 to 6.5 million tets.
const PATH_BYTES: u64 = 380;

/// The inside of a mesh, set up once per mesh.
pub struct VolumeStage {
    /// None after a path of steps, whose networks had its place in the memory; the next design sets it up anew.
    volume: Option<VolumeNetwork>,
    constraint: Vec<Constraint>,
    method: Method,
    start: Start,
    bodies: Bodies,
    smoothing: Option<Smoothing>,
    stepping: Stepping,
}

/// What a path goes by.
#[derive(Clone, Copy)]
struct Stepping {
    springs: &'static Springs,
    /// Smallest beta of the undeformed mesh.
    lowest: f64,
    max_steps: usize,
}

struct Smoothing {
    smoother: Smoother,
    freedom_of_surfaces: SurfaceFreedom,
    /// The smallest beta to reach.
    goal: f64,
    /// The smallest beta that is left alone.
    enough: f64,
}

/// Why the inside could not be moved.
#[derive(Debug, Error)]
pub enum VolumeError {
    /// One jump inverts tets, and there is no memory for a path of steps.
    #[error("{n_tets} tets, moved in steps as one jump inverts some: {error}")]
    Memory {
        /// Tets of the mesh.
        n_tets: usize,
        /// What is lacking.
        error: MemoryError,
    },
    /// The backend failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
}

/// How the inside was moved.
#[derive(Clone, Debug)]
pub struct VolumeResult {
    /// The moved vertices `[n_vertices]`.
    pub vertices: Vec<DVec3>,
    /// Beta of each tet `[n_tets]`.
    pub beta: Vec<f64>,
    /// How the springs were relaxed, all steps together.
    pub convergence: Convergence,
    /// The steps it took.
    pub path: Path,
    /// What local optimisation did in the end; `None` where it was off or nothing called for it.
    pub smoothed: Option<Smoothed>,
}

/// A mesh on the way.
struct MovedMesh {
    vertices: Vec<DVec3>,
    beta: Vec<f64>,
    worst: f64,
    inverted: usize,
}

impl MovedMesh {
    fn new(vertices: Vec<DVec3>, tets: &[[u32; 4]]) -> Self {
        let beta = quality::betas(&vertices, tets);
        Self::of(vertices, beta)
    }

    fn of(vertices: Vec<DVec3>, beta: Vec<f64>) -> Self {
        let Statistics { inverted, min: worst, .. } = Statistics::new(&beta);
        Self { vertices, beta, worst, inverted }
    }

    /// Whether what is inverted, if anything, is a fault in a few places.
    fn is_local(&self) -> bool {
        self.inverted as f64 <= LOCAL * self.beta.len() as f64
    }
}

impl Smoothing {
    /// Optimises a mesh whose surfaces are in their places, on which vertices may slide.
    fn run(&mut self, set_up: &SetUp, state: &MovedMesh) -> Result<(MovedMesh, Smoothed), BackendError> {
        let Self { smoother, freedom_of_surfaces, goal, .. } = self;
        let sliding = freedom_of_surfaces.on(set_up.mesh, set_up.surface, set_up.families, &state.vertices);
        let goal = Goal { beta: *goal, max_sweeps: MOST_SWEEPS };
        let (mut vertices, mut beta) = (state.vertices.clone(), state.beta.clone());
        let smoothed = smoother.run(&mut vertices, &mut beta, &goal, Some(&sliding))?;
        Ok((MovedMesh::of(vertices, beta), smoothed))
    }

    /// Repairs the inside of a mesh on the way, up to this beta.
    fn repair(&mut self, state: MovedMesh, enough: f64) -> Result<MovedMesh, BackendError> {
        let MovedMesh { mut vertices, mut beta, .. } = state;
        let goal = Goal { beta: enough, max_sweeps: REPAIR_SWEEPS };
        self.smoother.run(&mut vertices, &mut beta, &goal, None)?;
        Ok(MovedMesh::of(vertices, beta))
    }
}

impl VolumeStage {
    /// Sets springs and optimisation up.
    ///
    /// - `edge_graph`: the edges of the mesh's tets
    /// - `lowest`: the undeformed mesh's smallest beta
    /// - `max_steps`: how many steps an update may try, the jump among them
    ///
    /// # Errors
    /// The backend failed or the mesh does not fit.
    pub fn new(
        set_up: &SetUp,
        edge_graph: EdgeGraph,
        springs: &'static Springs,
        quality: Option<QualityTarget>,
        lowest: f64,
        max_steps: usize,
        shaped: &[u32],
    ) -> Result<Self, BackendError> {
        let SetUp { mesh, surface, families, backend, .. } = *set_up;
        let volume = VolumeNetwork::last(set_up, edge_graph, springs)?;
        let constraint = volume.constraint().to_vec();
        let smoothing = match quality {
            None => None,
            Some(target) => {
                let freedom_of_surfaces = SurfaceFreedom::new(mesh, surface, families, shaped);
                // Alone, one of two partners would leave the other.
                let may = |(vertex, may): (u32, &Constraint)| {
                    if families.partners.is_tied(vertex) { Constraint::Held } else { *may }
                };
                let may: Vec<Constraint> = (0..).zip(&constraint).map(may).collect();
                let smoother =
                    Smoother::new(backend, &mesh.tets, &mesh.vertices, &may, &freedom_of_surfaces.vertices(), target);
                let (enough, goal) = match target {
                    QualityTarget::Original => (ENOUGH * lowest, lowest),
                    QualityTarget::Improve => (IMPROVED * lowest, IMPROVED * lowest),
                };
                Some(Smoothing { smoother, freedom_of_surfaces, goal, enough })
            }
        };
        let stepping = Stepping { springs, lowest, max_steps };
        let (method, start) = (volume.method(), Start::default());
        Ok(Self { volume: Some(volume), constraint, method, start, bodies: Bodies::new(set_up), smoothing, stepping })
    }

    /// How the volume's springs are relaxed; never [`Method::Auto`].
    pub fn method(&self) -> Method {
        self.method
    }

    /// Where the springs start from now on.
    pub fn start_from(&mut self, start: Start) {
        self.start = start;
        if let Some(volume) = &mut self.volume {
            volume.start_from(start);
        }
    }

    /// Moves the inside after the surfaces.
    ///
    /// - `crossings`: of the surfaces
    /// - `displacement` `[n_vertices]`: the displacement of the surfaces; becomes that of all vertices
    ///
    /// # Errors
    /// The backend failed, or there is no memory for a path of steps that the design needs.
    pub fn run(
        &mut self,
        set_up: &SetUp,
        crossings: &mut Crossings,
        displacement: &mut Displacement,
        stopping: &Stopping,
        observer: &dyn Fn(&str),
    ) -> Result<VolumeResult, VolumeError> {
        let mesh = set_up.mesh;
        let surfaces = displacement.clone();
        let volume = match &mut self.volume {
            Some(volume) => volume,
            none => {
                let mut volume = VolumeNetwork::last(set_up, EdgeGraph::new(mesh), self.stepping.springs)?;
                volume.start_from(self.start);
                none.insert(volume)
            }
        };
        let mut convergence = volume.run(&mesh.vertices, displacement, stopping)?;
        let mut state = MovedMesh::new(displaced(&mesh.vertices, displacement), &mesh.tets);
        let mut path = Path { steps: 1, given_up: 0, reached: 0.0 };
        // No volume fits surfaces that pass through each other.
        let mut stuck =
            state.inverted > 0 && !crossings.newly_self_intersecting(&mesh.vertices, &state.vertices).is_empty();
        // A relaxation that diverged left no place to go to.
        let somewhere = surfaces.iter().all(|displacement| displacement.is_finite());
        let mut smoothed = None;
        if state.inverted > 0
            && somewhere
            && !stuck
            && self.stepping.max_steps > 1
            && !self.surfaces_invert(&state, mesh)
        {
            let mut repaired = self.stepping.repair_last(&state, self.smoothing.as_mut(), set_up, observer)?;
            if !repaired.as_ref().is_some_and(|(state, _)| self.stepping.is_good(state)) {
                let route = self.bodies.route(mesh, set_up.families, &surfaces);
                let (stepping, volume) = (self.stepping, self.volume.take());
                let followed = stepping.follow(&route, volume, self.smoothing.as_mut(), set_up, stopping, observer)?;
                convergence = convergence.and(followed.convergence);
                path = followed.path;
                stuck = path.reached < 1.0;
                if path.reached >= 1.0 {
                    (state, smoothed, repaired) = (followed.state, followed.smoothed, None);
                }
            }
            if let Some((better, by)) = repaired {
                (state, smoothed) = (better, Some(by));
            }
        }
        if let Some(smoothing) = &mut self.smoothing
            && smoothed.is_none()
            && (!stuck || state.is_local())
            && state.worst < smoothing.enough
        {
            observer("smoothing");
            let (better, by) = smoothing.run(set_up, &state)?;
            (state, smoothed) = (better, Some(by));
        }
        for ((displacement, from), to) in displacement.iter_mut().zip(&mesh.vertices).zip(&state.vertices) {
            // What the springs or the surfaces gave keeps its bits.
            if moved(*from, *displacement) != *to {
                *displacement = *to - *from;
            }
        }
        if state.inverted == 0 {
            path.reached = 1.0;
        }
        Ok(VolumeResult { vertices: state.vertices, beta: state.beta, convergence, path, smoothed })
    }

    /// Whether a tet is inverted by its surface vertices alone: no path would help it.
    fn surfaces_invert(&self, state: &MovedMesh, mesh: &TetMesh) -> bool {
        let held = |&vertex: &u32| self.constraint[vertex as usize] == Constraint::Held;
        mesh.tets.iter().zip(&state.beta).any(|(tet, &beta)| faults::is_inverted(beta) && tet.iter().all(held))
    }
}

impl Stepping {
    /// A mesh at the end of the way, optimised, if it has faults in a few places alone: it needs no shorter steps if they can be
    /// repaired where they are.
    fn repair_last(
        &self,
        state: &MovedMesh,
        smoothing: Option<&mut Smoothing>,
        set_up: &SetUp,
        observer: &dyn Fn(&str),
    ) -> Result<Option<(MovedMesh, Smoothed)>, BackendError> {
        let Some(smoothing) = smoothing.filter(|_| state.inverted > 0 && state.is_local()) else { return Ok(None) };
        observer("smoothing");
        smoothing.run(set_up, state).map(Some)
    }

    /// Whether what was repaired may stay as it is.
    fn is_good(&self, repaired: &MovedMesh) -> bool {
        repaired.worst >= ENOUGH * self.lowest
    }

    /// Leads the surfaces along their route, in steps that invert no tet.
    ///
    /// - `volume`: of the undeformed mesh, for the steps that start there; gone afterwards
    fn follow(
        &self,
        route: &Route,
        volume: Option<VolumeNetwork>,
        mut smoothing: Option<&mut Smoothing>,
        set_up: &SetUp,
        stopping: &Stopping,
        observer: &dyn Fn(&str),
    ) -> Result<Followed, VolumeError> {
        let mut networks = NetworksAtShape::new(volume);
        let mut mesh = set_up.mesh.clone();
        let mut state = MovedMesh::new(mesh.vertices.clone(), &mesh.tets);
        let mut surfaces = route.at(0.0);
        let mut path = Path { steps: 0, given_up: 1, reached: 0.0 };
        let mut convergence = Convergence::nothing_to_do();
        let mut smoothed = None;
        let mut step = f64::min(0.5, FIRST_TURN / route.largest_turn());
        while path.reached < 1.0 && step >= SHORTEST && path.steps + path.given_up < self.max_steps {
            observer(&format!("step to {:.0} %", 100.0 * (path.reached + step).min(1.0)));
            // Not a sliver at the end.
            let progress = if path.reached + 1.1 * step >= 1.0 { 1.0 } else { path.reached + step };
            let next = route.at(progress);
            mesh.vertices.copy_from_slice(&state.vertices);
            let mut displacement: Displacement = next.iter().zip(&surfaces).map(|(next, now)| *next - *now).collect();
            let volume = networks.at(&SetUp { mesh: &mesh, ..*set_up }, self.springs)?;
            convergence = convergence.and(volume.run(&mesh.vertices, &mut displacement, stopping)?);
            let mut vertices = displaced(&mesh.vertices, &displacement);
            for (vertex, constraint) in volume.constraint().iter().enumerate() {
                // Steps do not add up to the last bit.
                if *constraint == Constraint::Held {
                    vertices[vertex] = moved(set_up.mesh.vertices[vertex], next[vertex]);
                }
            }
            let mut tried = MovedMesh::new(vertices, &mesh.tets);
            if progress == 1.0 {
                let repaired = self.repair_last(&tried, smoothing.as_deref_mut(), set_up, observer)?;
                if let Some((good, by)) = repaired.filter(|(state, _)| self.is_good(state)) {
                    (tried, smoothed) = (good, Some(by));
                }
            } else if let Some(smoothing) = &mut smoothing
                && tried.worst < REPAIR.0 * self.lowest
                && tried.is_local()
            {
                tried = smoothing.repair(tried, REPAIR.1 * self.lowest)?;
            }
            if tried.inverted > 0 {
                path.given_up += 1;
                step *= 0.5;
                continue;
            }
            networks.volume = None;
            state = tried;
            surfaces = next;
            path.steps += 1;
            path.reached = progress;
            step *= 2.0;
        }
        Ok(Followed { state, convergence, path, smoothed })
    }
}

/// The networks at one shape of the mesh: a large mesh's have room but once.
struct NetworksAtShape {
    volume: Option<VolumeNetwork>,
    edge_graph: Option<EdgeGraph>,
}

impl NetworksAtShape {
    /// Those of the undeformed mesh, wherever they started from last.
    fn new(mut volume: Option<VolumeNetwork>) -> Self {
        if let Some(volume) = &mut volume {
            volume.start_from(Start::default());
        }
        Self { volume, edge_graph: None }
    }

    /// Those that are there, or else new ones at the shape of `set_up`'s mesh.
    fn at(&mut self, set_up: &SetUp, springs: &Springs) -> Result<&mut VolumeNetwork, VolumeError> {
        let volume = match self.volume.take() {
            Some(volume) => volume,
            None => {
                let edge_graph = match self.edge_graph.take() {
                    Some(edge_graph) => edge_graph,
                    None => {
                        let n_tets = set_up.mesh.tets.len();
                        check_memory(PATH_BYTES * n_tets as u64)
                            .map_err(|error| VolumeError::Memory { n_tets, error })?;
                        EdgeGraph::new(set_up.mesh)
                    }
                };
                VolumeNetwork::new(set_up, self.edge_graph.insert(edge_graph), springs)?
            }
        };
        Ok(self.volume.insert(volume))
    }
}

struct Followed {
    state: MovedMesh,
    convergence: Convergence,
    path: Path,
    /// What was repaired in the end, if it had to be.
    smoothed: Option<Smoothed>,
}

/// The vertices where a motion puts them; see [`moved`].
pub fn displaced(vertices: &[DVec3], displacement: &[DVec3]) -> Vec<DVec3> {
    vertices.iter().zip(displacement).map(|(at, by)| moved(*at, *by)).collect()
}
