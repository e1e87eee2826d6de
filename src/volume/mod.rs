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

use glam::DVec3;
use thiserror::Error;

pub mod edges;
mod optimisation;
pub mod rotation;
pub mod route;
pub mod sliding;
pub mod springs;
pub mod start;
mod stepping;

pub use edges::EdgeGraph;
pub use start::Start;

use optimisation::{ENOUGH, IMPROVED, MovedMesh, Smoothing};
use route::Bodies;
use sliding::SurfaceFreedom;
use springs::VolumeNetwork;
use stepping::Stepping;

use crate::{
    backend::{BackendError, Constraint, MemoryError},
    mesh::{Displacement, TetMesh},
    projection::crossing::Crossings,
    quality::faults,
    relaxation::{Convergence, Method, Stopping},
    report::Path,
    smoothing::{QualityTarget, Smoothed, Smoother, moved},
    springs::Springs,
    stage::SetUp,
};

/// Default for the number of steps that an update may try. A half turn takes four, or six without
/// local optimisation.
pub const MAX_STEPS: usize = 64;

/// The volume stage. Set up once per mesh.
pub struct VolumeStage {
    /// `None` after a path of steps, whose networks needed its memory. The next design sets it up
    /// again.
    volume: Option<VolumeNetwork>,
    constraint: Vec<Constraint>,
    method: Method,
    start: Start,
    bodies: Bodies,
    smoothing: Option<Smoothing>,
    stepping: Stepping,
}

/// An error of the volume stage.
#[derive(Debug, Error)]
pub enum VolumeError {
    /// One jump inverts tets, and the memory does not suffice for a path of steps.
    #[error("{n_tets} tets, moved in steps as one jump inverts some: {error}")]
    Memory {
        /// Number of tets of the mesh.
        n_tets: usize,
        /// The memory that is missing.
        error: MemoryError,
    },
    /// The backend failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
}

/// The result of the volume stage.
#[derive(Clone, Debug)]
pub struct VolumeResult {
    /// Positions of all vertices after the motion `[n_vertices]`, in the mesh's unit.
    pub vertices: Vec<DVec3>,
    /// Beta of each tet `[n_tets]`.
    pub beta: Vec<f64>,
    /// Convergence of the springs, all steps together.
    pub convergence: Convergence,
    /// The steps taken.
    pub path: Path,
    /// The result of local optimisation at the end. `None` if it was off or not needed.
    pub smoothed: Option<Smoothed>,
}

impl VolumeStage {
    /// Sets up springs and local optimisation.
    ///
    /// - `edge_graph`: edges of the mesh's tets
    /// - `springs`: the kind of springs
    /// - `quality`: the target of local optimisation; `None` turns it off
    /// - `lowest`: smallest beta of the undeformed mesh
    /// - `max_steps`: most steps that an update may try, including the jump
    /// - `shaped`: vertices of wings that must not slide, see [`SurfaceFreedom::new`]
    ///
    /// # Errors
    /// The backend failed, or the mesh does not fit the device.
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
                // A vertex with a partner is held: moved alone it would leave its partner.
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

    /// The method that relaxes the volume's springs; never [`Method::Auto`].
    pub fn method(&self) -> Method {
        self.method
    }

    /// Sets the start of the springs for further updates.
    pub fn start_from(&mut self, start: Start) {
        self.start = start;
        if let Some(volume) = &mut self.volume {
            volume.start_from(start);
        }
    }

    /// Moves the inside after the surfaces.
    ///
    /// - `crossings`: finds self-intersections of the surfaces
    /// - `displacement` `[n_vertices]`: on entry the displacement of the surfaces, on exit of all
    ///   vertices, in the mesh's unit
    /// - `observer`: receives the name of each part of the work
    ///
    /// # Errors
    /// The backend failed, or the memory does not suffice for a path of steps that the design
    /// needs.
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
        // No valid volume exists between surfaces that intersect.
        let mut stuck =
            state.inverted > 0 && !crossings.newly_self_intersecting(&mesh.vertices, &state.vertices).is_empty();
        // Displacements that are not finite come from a relaxation that diverged. No path leads
        // there.
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
            // A displacement that already gives the vertex's position keeps its bits.
            if moved(*from, *displacement) != *to {
                *displacement = *to - *from;
            }
        }
        if state.inverted == 0 {
            path.reached = 1.0;
        }
        Ok(VolumeResult { vertices: state.vertices, beta: state.beta, convergence, path, smoothed })
    }

    /// Whether a tet with held vertices only is inverted. Then no path of steps helps.
    fn surfaces_invert(&self, state: &MovedMesh, mesh: &TetMesh) -> bool {
        let held = |&vertex: &u32| self.constraint[vertex as usize] == Constraint::Held;
        mesh.tets.iter().zip(&state.beta).any(|(tet, &beta)| faults::is_inverted(beta) && tet.iter().all(held))
    }
}

/// Positions `[n_vertices]` plus displacements `[n_vertices]`, see [`moved`].
pub fn displaced(vertices: &[DVec3], displacement: &[DVec3]) -> Vec<DVec3> {
    vertices.iter().zip(displacement).map(|(at, by)| moved(*at, *by)).collect()
}
