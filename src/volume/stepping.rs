//! The path of steps: the surfaces follow their route, with a new volume network for each step.

use std::f64::consts::PI;

use super::{
    EdgeGraph, Path, Start, StepVerdict, TriedStep, displaced,
    optimisation::{ENOUGH, MovedMesh, Smoothing, after},
    route::Route,
    springs::VolumeNetwork,
};
use crate::{
    backend::BackendError,
    constraint::Constraint,
    memory::check_memory,
    mesh::Displacement,
    relaxation::{Convergence, Stopping},
    smoothing::{Merit, Smoothed, moved},
    springs::Springs,
    stage::{SetUp, StageError},
};

/// The first step turns no body by more than this angle, in radians. Steps get longer while they
/// succeed.
const FIRST_TURN: f64 = PI / 6.0;

/// On the path local optimisation runs when the worst beta falls below the first of these shares of
/// the original mesh's, and ends at the second.
///
/// With 0.5 and 0.75 a wing's half turn takes twice as long and ends with a lower mean beta. With
/// 0.2 and 0.3 the last steps start from tets so bad that many more steps are needed.
const REPAIR: (f64, f64) = (0.3, 0.5);

/// Shorter steps, as a share of the route, are not tried. A tet that stops a step this short stops
/// every step.
const SHORTEST: f64 = 1.0 / 256.0;

/// Most bytes of a path of steps per tet, after the networks of the jump are gone: the edges of the
/// tets and the networks of a step. Measured were 345 to 363 on meshes of 0.1 to 6.5 million tets.
const PATH_BYTES: u64 = 380;

/// Settings of a path of steps.
#[derive(Clone)]
pub(super) struct Stepping {
    pub(super) springs: &'static Springs,
    /// Smallest beta of the undeformed mesh.
    pub(super) lowest: f64,
    pub(super) max_steps: usize,
    pub(super) merit: Merit,
}

impl Stepping {
    /// Local optimisation of a mesh at the end of the route. `None` if the mesh has no inverted
    /// tet, or too many. A success saves shorter steps.
    pub(super) fn repair_last(
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

    /// Whether the result of local optimisation is good enough.
    pub(super) fn is_good(&self, repaired: &MovedMesh) -> bool {
        repaired.worst >= ENOUGH * self.lowest
    }

    /// Moves the surfaces along their route, in steps that invert no tet.
    ///
    /// - `volume`: network of the undeformed mesh, for steps from there; used up
    ///
    /// # Errors
    /// The backend failed, or the memory does not suffice for a path of steps.
    pub(super) fn follow(
        &self,
        route: &Route,
        volume: Option<VolumeNetwork>,
        mut smoothing: Option<&mut Smoothing>,
        set_up: &SetUp,
        stopping: &Stopping,
        observer: &dyn Fn(&str),
    ) -> Result<Followed, StageError> {
        let mut networks = NetworksAtShape::new(volume);
        let mut mesh = set_up.mesh.clone();
        let mut state = MovedMesh::new(mesh.vertices.clone(), &mesh.tets, &self.merit);
        let mut surfaces = route.at(0.0);
        let mut path = Path { given_up: 1, ..Path::default() };
        let mut convergence = Convergence::nothing_to_do();
        let (mut smoothed, mut on_the_way) = (None, None);
        let mut step = f64::min(0.5, FIRST_TURN / route.largest_turn());
        while path.reached < 1.0 && step >= SHORTEST && path.steps + path.given_up < self.max_steps {
            observer(&format!("step to {:.0} %", 100.0 * (path.reached + step).min(1.0)));
            // A short rest at the end is added to the last step.
            let progress = if path.reached + 1.1 * step >= 1.0 { 1.0 } else { path.reached + step };
            let next = route.at(progress);
            mesh.vertices.copy_from_slice(&state.vertices);
            let mut displacement: Displacement = next.iter().zip(&surfaces).map(|(next, now)| *next - *now).collect();
            let volume = networks.at(&SetUp { mesh: &mesh, ..*set_up }, self.springs)?;
            convergence = convergence.and(volume.run(&mesh.vertices, &mut displacement, stopping, &|_| ())?.0);
            if !convergence.converged {
                // A shorter step may not converge either, and would take all its sweeps.
                path.tried.push(TriedStep::not_converged(path.reached, progress));
                path.given_up += 1;
                break;
            }
            let mut vertices = displaced(&mesh.vertices, &displacement);
            for (vertex, constraint) in volume.constraint().iter().enumerate() {
                // Held vertices take the route's position, because the steps do not add up to the
                // last bit.
                if *constraint == Constraint::Held {
                    vertices[vertex] = moved(set_up.mesh.vertices[vertex], next[vertex]);
                }
            }
            let mut tried = MovedMesh::new(vertices, &mesh.tets, &self.merit);
            let mut told = TriedStep::of(path.reached, progress, &tried);
            // Optimisation of inverted corners of other cells changes the thickness of layers. A
            // shorter step keeps it.
            if tried.inverted > 0 && !set_up.cells.are_tets() {
                path.tried.push(told);
                path.given_up += 1;
                step *= 0.5;
                continue;
            }
            if progress == 1.0 {
                let repaired = self.repair_last(&tried, smoothing.as_deref_mut(), set_up, observer)?;
                repaired.iter().for_each(|(better, _)| told.optimised(better));
                if let Some((good, by)) = repaired.filter(|(state, _)| self.is_good(state)) {
                    (tried, smoothed) = (good, Some(by));
                }
            } else if let Some(smoothing) = &mut smoothing
                && tried.worst < REPAIR.0 * self.lowest
                && tried.is_local()
            {
                let by;
                (tried, by) = smoothing.repair(set_up, tried, REPAIR.1 * self.lowest)?;
                on_the_way = Some(after(on_the_way, by));
                told.optimised(&tried);
            }
            if tried.inverted > 0 {
                path.tried.push(told);
                path.given_up += 1;
                step *= 0.5;
                continue;
            }
            path.tried.push(TriedStep { verdict: StepVerdict::Kept, ..told });
            networks.volume = None;
            state = tried;
            surfaces = next;
            path.steps += 1;
            path.reached = progress;
            step *= 2.0;
        }
        Ok(Followed { state, convergence, path, smoothed, on_the_way })
    }
}

/// The networks at one shape of the mesh. For a large mesh the memory holds one of them only.
struct NetworksAtShape {
    volume: Option<VolumeNetwork>,
    edge_graph: Option<EdgeGraph>,
}

impl NetworksAtShape {
    /// The networks of the undeformed mesh, which start from the undeformed mesh from now on.
    fn new(mut volume: Option<VolumeNetwork>) -> Self {
        if let Some(volume) = &mut volume {
            volume.start_from(Start::default());
        }
        Self { volume, edge_graph: None }
    }

    /// The networks at the shape of `set_up`'s mesh: those present, or else new ones.
    fn at(&mut self, set_up: &SetUp, springs: &Springs) -> Result<&mut VolumeNetwork, StageError> {
        let volume = match self.volume.take() {
            Some(volume) => volume,
            None => {
                let edge_graph = match self.edge_graph.take() {
                    Some(edge_graph) => edge_graph,
                    None => {
                        let n_tets = set_up.mesh.tets.len();
                        check_memory(PATH_BYTES * n_tets as u64)
                            .map_err(|error| StageError::Memory { cells: set_up.cells.counted(), error })?;
                        EdgeGraph::new(set_up.mesh, set_up.cells)
                    }
                };
                VolumeNetwork::new(set_up, self.edge_graph.insert(edge_graph), springs)?
            }
        };
        Ok(self.volume.insert(volume))
    }
}

/// The result of a path of steps.
pub(super) struct Followed {
    pub(super) state: MovedMesh,
    pub(super) convergence: Convergence,
    pub(super) path: Path,
    /// The result of local optimisation at the end, if it was needed.
    pub(super) smoothed: Option<Smoothed>,
    /// The work of local optimisation in the steps before.
    pub(super) on_the_way: Option<Smoothed>,
}
