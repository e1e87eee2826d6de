//! Local optimisation in the volume stage: its goals, and the mesh that it works on.

use glam::DVec3;

use super::{sliding::SurfaceFreedom, springs::constraint};
use crate::{
    backend::BackendError,
    constraint::Constraint,
    quality::Statistics,
    smoothing::{Goal, Merit, QualityTarget, Raised, Smoothed, Smoother},
    stage::SetUp,
};

/// With the original shapes as target, local optimisation runs if the smallest beta is below this
/// share of the original mesh's. Springs alone keep this share on most designs. A larger share
/// would move vertices without need.
pub(super) const ENOUGH: f64 = 0.75;

/// With the target `Improve`, the goal as a multiple of the original mesh's smallest beta. With
/// sliding surfaces it is reached on wing-bodies of 98 000 and of 921 000 tets. The goal 2 takes
/// several times as long, and ends at 1.57 to 1.95.
pub(super) const IMPROVED: f64 = 1.5;

/// Most sweeps at the end of an update. Local optimisation ends by itself, after some tens, when it
/// no longer helps.
pub(super) const MOST_SWEEPS: usize = 400;

/// If more than this share of the tets is inverted, local optimisation does not try to untangle
/// them: it would take long and help little. A smaller share is a fault in a few places, from which
/// vertices may move away.
pub(super) const LOCAL: f64 = 1e-3;

/// So many corners are raised in a small mesh too. A prism has six.
const MOST_FLAT: usize = 60;

/// Most sweeps on the path of steps.
const REPAIR_SWEEPS: usize = 100;

/// A mesh during an update.
pub(super) struct MovedMesh {
    pub(super) vertices: Vec<DVec3>,
    /// Merit of each tet and corner tet `[n_simplices]`, which is beta for a tet; see [`Merit`].
    pub(super) beta: Vec<f64>,
    pub(super) worst: f64,
    /// Number of inverted tets and corner tets.
    pub(super) inverted: usize,
}

impl MovedMesh {
    pub(super) fn new(vertices: Vec<DVec3>, tets: &[[u32; 4]], merit: &Merit) -> Self {
        let beta = merit.of_all(tets, &vertices);
        Self::of(vertices, beta)
    }

    pub(super) fn of(vertices: Vec<DVec3>, beta: Vec<f64>) -> Self {
        let Statistics { inverted, min: worst, .. } = Statistics::new(&beta);
        Self { vertices, beta, worst, inverted }
    }

    /// Whether inverted tets, if any, are few enough for local optimisation.
    pub(super) fn is_local(&self) -> bool {
        self.inverted as f64 <= LOCAL * self.beta.len() as f64
    }
}

/// Local optimisation of a mesh. Most meshes do not need it, so it is set up when a result first
/// calls for it; in meshes of tets its arrays are a seventh of the memory otherwise.
pub(super) struct Smoothing {
    target: QualityTarget,
    /// The smallest beta to reach.
    goal: f64,
    /// Local optimisation runs only if the smallest beta is lower.
    pub(super) enough: f64,
    merit: Merit,
    /// Vertices that give wings their profiles: they do not slide.
    shaped: Vec<u32>,
    /// Vertices that have no springs to a held vertex, ascending; see [`Network::new`].
    ///
    /// [`Network::new`]: crate::relaxation::Network::new
    floating: Vec<u32>,
    ready: Option<Ready>,
}

/// What is set up once per mesh.
struct Ready {
    smoother: Smoother,
    freedom_of_surfaces: SurfaceFreedom,
}

impl Smoothing {
    /// - `lowest`: the undeformed mesh's smallest beta; any positive number if no cell is a tet
    /// - `shaped`: vertices that give wings their profiles: they do not slide
    /// - `floating`: vertices without springs to a held vertex, ascending
    pub(super) fn new(
        set_up: &SetUp,
        target: QualityTarget,
        lowest: f64,
        merit: Merit,
        shaped: &[u32],
        floating: &[u32],
    ) -> Self {
        let (enough, goal) = match target {
            QualityTarget::Improve => (IMPROVED * lowest, IMPROVED * lowest),
            QualityTarget::Original => (ENOUGH * lowest, lowest),
        };
        let (shaped, floating) = (shaped.to_vec(), floating.to_vec());
        let mut smoothing = Self { target, goal, enough, merit, shaped, floating, ready: None };
        // Every result of other cells than tets is searched for flat corners.
        if !set_up.cells.are_tets() {
            smoothing.ready(set_up);
        }
        smoothing
    }

    fn ready(&mut self, set_up: &SetUp) -> &mut Ready {
        let Self { target, merit, shaped, floating, ready, .. } = self;
        ready.get_or_insert_with(|| {
            let SetUp { mesh, surface, families, backend, .. } = *set_up;
            let freedom_of_surfaces = SurfaceFreedom::new(mesh, surface, families, shaped);
            // A vertex with a partner is held: moved alone it would leave its partner.
            let may = |vertex: u32| match families.partners.is_tied(vertex) {
                true => Constraint::Held,
                false => constraint(families, floating, vertex),
            };
            let may: Vec<Constraint> = (0..mesh.vertices.len() as u32).map(may).collect();
            let slides = freedom_of_surfaces.vertices();
            let smoother = Smoother::new(backend, &mesh.tets, &mesh.vertices, &may, &slides, *target);
            Ready { smoother: smoother.with_merit(merit.clone()), freedom_of_surfaces }
        })
    }

    /// Optimises a mesh whose surfaces have reached their places. Vertices of surfaces may slide.
    ///
    /// - `set_up`: of the undeformed mesh
    pub(super) fn run(&mut self, set_up: &SetUp, state: &MovedMesh) -> Result<(MovedMesh, Smoothed), BackendError> {
        let goal = Goal { beta: self.goal, max_sweeps: MOST_SWEEPS };
        let Ready { smoother, freedom_of_surfaces } = self.ready(set_up);
        let sliding = freedom_of_surfaces.on(set_up.mesh, set_up.surface, set_up.families, &state.vertices);
        let (mut vertices, mut beta) = (state.vertices.clone(), state.beta.clone());
        let smoothed = smoother.run(&mut vertices, &mut beta, &goal, Some(&sliding))?;
        Ok((MovedMesh::of(vertices, beta), smoothed))
    }

    /// Optimises the inside of a mesh on the path of steps, up to the beta `enough`, with the
    /// surfaces held.
    ///
    /// - `set_up`: of the undeformed mesh
    pub(super) fn repair(
        &mut self,
        set_up: &SetUp,
        state: MovedMesh,
        enough: f64,
    ) -> Result<(MovedMesh, Smoothed), BackendError> {
        let MovedMesh { mut vertices, mut beta, .. } = state;
        let goal = Goal { beta: enough, max_sweeps: REPAIR_SWEEPS };
        let smoothed = self.ready(set_up).smoother.run(&mut vertices, &mut beta, &goal, None)?;
        Ok((MovedMesh::of(vertices, beta), smoothed))
    }

    /// Raises single flat corners of other cells than tets; see [`Smoother::raise_flat_corners`].
    /// Where many are flat the motion as a whole is the cause, and nothing is done.
    ///
    /// - `smoothed`: of the run before, if there was one; returned with the vertices of both
    pub(super) fn raise_flat_corners(&self, state: &mut MovedMesh, smoothed: Option<Smoothed>) -> Option<Smoothed> {
        // A mesh of tets has no such corners.
        let Some(Ready { smoother, .. }) = &self.ready else { return smoothed };
        let most = MOST_FLAT.max((LOCAL * state.beta.len() as f64) as usize);
        let raised = smoother.raise_flat_corners(&mut state.vertices, &mut state.beta, most);
        if raised.moved == 0 {
            return smoothed;
        }
        let Statistics { inverted, min: beta_min, .. } = Statistics::new(&state.beta);
        state.worst = beta_min;
        let Raised { sweeps, moved, layers_changed } = raised;
        Some(after(smoothed, Smoothed { sweeps, inverted, beta_min, moved, layers_changed }))
    }
}

/// Two runs as one: the second one's mesh, and the work of both.
pub(super) fn after(first: Option<Smoothed>, second: Smoothed) -> Smoothed {
    let first = first.unwrap_or_default();
    Smoothed {
        sweeps: first.sweeps + second.sweeps,
        moved: first.moved + second.moved,
        layers_changed: first.layers_changed.max(second.layers_changed),
        ..second
    }
}
