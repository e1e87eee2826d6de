//! Rotations of the moved surfaces, spread through the volume: with them rotation-aware springs
//! turn their rest edges.
//!
//! Springs that keep the *difference* of two displacements small resist a rotation as if it were a
//! strain, and x, y and z are independent of each other. So meshes of such springs fail at a few
//! degrees. Rotation-aware springs work in two relaxations:
//!
//! 1. Every surface vertex gets a rotation, fitted to the motion of its edges along the surface and
//!    of its normal. Springs of their own spread the rotation vectors through the volume.
//! 2. Each spring pulls towards its rest edge, rotated by the mean of the rotations at its ends:
//!    `sum_j k_ij (x_i - x_j) = sum_j k_ij (R_i + R_j) / 2 (X_i - X_j)`.
//!
//! Both matrices belong to the undeformed mesh, so the result depends on the design alone. The
//! paper's springs have no such term.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::{Start, start::Equilibrium, surface_turns::SurfaceTurns};
use crate::{
    backend::BackendError,
    constraint::Constraint,
    families::PlacedBy,
    kernels::{
        rest_load,
        turn::{self, Turn},
    },
    mesh::{Displacement, edges::VertexGraph},
    relaxation::{Convergence, MovingGraph, Network, Relaxer, Stopping, Unrelaxed},
    stage::{NoProduct, SetUp},
};

/// Tolerance of the rotations in radians, over the tolerance of the displacements in shortest
/// edges. An error of the rotation moves a vertex by the error times its distance from the
/// surfaces, some tens of edges.
const ANGLE: f64 = 1.0 / 32.0;

/// The network that spreads rotations from the surfaces to all vertices.
pub struct Rotation {
    relaxer: Relaxer,
    last: Equilibrium,
    surfaces: SurfaceTurns,
}

impl Rotation {
    /// The network's springs.
    ///
    /// - `graph`: the tets' edges
    /// - `edge_stiffness` `[n_edges]`: stiffness for rotations
    pub(super) fn network(set_up: &SetUp, graph: &VertexGraph, edge_stiffness: &[f64]) -> Network {
        let SetUp { mesh, families, .. } = *set_up;
        let n = mesh.vertices.len();
        let constraint = (0..n as u32)
            .map(|vertex| match families.placed_by[vertex as usize] {
                PlacedBy::Volume => Constraint::Free,
                // A rotation about the normal keeps a plane. No rotation keeps two planes.
                PlacedBy::Plane => match families.plane_constraint(vertex) {
                    Constraint::InPlane(normal) => Constraint::OnLine(normal),
                    _ => Constraint::Held,
                },
                _ => Constraint::Held,
            })
            .collect();
        // Length 1 for each edge, so errors are in radians.
        let lengths = vec![1.0; edge_stiffness.len()];
        Network::new(graph, edge_stiffness, &lengths, constraint, vec![0.0; n])
    }

    /// Sets up the network.
    ///
    /// - `network`: of [`Self::network`]
    /// - `moving`: the moving graph of the displacements, which is shared if it is the same
    ///
    /// # Errors
    /// The backend failed, or the mesh does not fit the device.
    pub(super) fn new(set_up: &SetUp, network: Network, moving: &MovingGraph) -> Result<Self, BackendError> {
        let relaxer = Relaxer::along(network, moving, set_up.backend, set_up.method)?;
        Ok(Self { relaxer, last: Equilibrium::default(), surfaces: SurfaceTurns::new(set_up) })
    }

    /// Sets the start of further relaxations.
    pub(super) fn start_from(&mut self, start: Start) {
        self.last.start_from(start);
    }

    /// The rotation vector of every vertex `[n_vertices]`, in radians, for each of several designs.
    ///
    /// - `vertices` `[n_vertices]`: undeformed positions, in the mesh's unit
    /// - `displacements`: displacement of the surfaces in each design `[n_vertices]`, in the mesh's
    ///   unit
    /// - `stopping`: for displacements; the tolerance of the rotations follows from it
    /// - `tell`: gets the share of the work that is done, now and then, in a relaxation of many
    ///   sweeps
    ///
    /// # Errors
    /// The backend failed.
    pub fn spread(
        &mut self,
        vertices: &[DVec3],
        displacements: &[&mut Displacement],
        stopping: &Stopping,
        tell: &dyn Fn(f64),
    ) -> Result<Vec<(Vec<DVec3>, Convergence)>, BackendError> {
        let of_design = |displacement: &&mut Displacement| self.surfaces.turns(vertices, displacement);
        let mut all: Vec<Vec<DVec3>> = displacements.iter().map(of_design).collect();
        let stopping = Stopping { tolerance: ANGLE * stopping.tolerance, ..*stopping };
        let constraint = &self.relaxer.network().constraint;
        all.iter_mut().for_each(|vectors| self.last.recall(constraint, vectors));
        let designs = all.iter_mut().map(|vectors| Unrelaxed { displacement: vectors, load: None }).collect();
        let results = self.relaxer.relax_together(designs, &stopping, tell)?;
        let with_result = |(vectors, mut convergence): (Vec<DVec3>, Convergence)| {
            convergence.history = convergence.history.of_rotations();
            self.last.keep(&convergence, &vectors);
            (vectors, convergence)
        };
        Ok(all.into_iter().zip(results).map(with_result).collect())
    }

    /// Prepares [`Self::spread_on_device`]. `false` if the device does not keep the rotations.
    ///
    /// - `springs`: the springs that turn with the rotations, prepared by [`Relaxer::reside`]
    /// - `positions` `[n_vertices]`: undeformed positions, in the mesh's unit
    ///
    /// # Errors
    /// The backend failed.
    pub(super) fn reside(&mut self, springs: &mut Relaxer, positions: &[DVec3]) -> Result<bool, BackendError> {
        let constraint = &self.relaxer.network().constraint;
        let rests = |vertex: &u32| constraint[*vertex as usize] == Constraint::Held;
        let further = springs.places().into_iter().filter(rests).collect();
        if !self.relaxer.reside(further)? {
            return Ok(false);
        }
        springs.turn_with(&mut self.relaxer, positions)?;
        Ok(true)
    }

    /// [`Self::spread`], with rotations that stay on the device. Returns their unit there; `None`
    /// if nothing turns.
    ///
    /// # Errors
    /// The backend failed.
    pub(super) fn spread_on_device(
        &mut self,
        vertices: &[DVec3],
        displacement: &Displacement,
        stopping: &Stopping,
        tell: &dyn Fn(f64),
    ) -> Result<(Option<f64>, Convergence), BackendError> {
        let mut vectors = self.surfaces.turns(vertices, displacement);
        if vectors.iter().all(|vector| *vector == DVec3::ZERO) {
            return Ok((None, Convergence::nothing_to_do()));
        }
        let stopping = Stopping { tolerance: ANGLE * stopping.tolerance, ..*stopping };
        let mut convergence = self.relaxer.relax_on_device(&mut vectors, None, false, &stopping, tell)?;
        convergence.history = convergence.history.of_rotations();
        Ok((self.relaxer.unit_on_device(), convergence))
    }

    /// Change of the rotation vector of every vertex `[n_vertices]`.
    ///
    /// - `vertices`, `displacement` `[n_vertices]`: as for [`Self::spread`]
    /// - `change` `[n_vertices]`: change of the surfaces' displacement
    /// - `stopping`: its tolerance is relative to the argument
    ///
    /// # Errors
    /// The backend failed, or a rotation has no derivative.
    pub(super) fn forward(
        &mut self,
        vertices: &[DVec3],
        displacement: &Displacement,
        change: &Displacement,
        stopping: &Stopping,
    ) -> Result<(Vec<DVec3>, Convergence), NoProduct> {
        let mut vectors = self.surfaces.forward(vertices, displacement, change)?;
        let convergence = self.relaxer.forward(&mut vectors, None, stopping)?;
        Ok((vectors, convergence))
    }

    /// The transpose of [`Self::forward`].
    ///
    /// - `by_vectors` `[n_vertices]`: the derivative of a number by the rotation vectors
    /// - `gradient` `[n_vertices]`: the derivative of the number by the surfaces' displacement, to
    ///   which the rotations' part is added
    ///
    /// # Errors
    /// As for [`Self::forward`].
    pub(super) fn reverse(
        &mut self,
        vertices: &[DVec3],
        displacement: &Displacement,
        mut by_vectors: Vec<DVec3>,
        gradient: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        let (_, convergence) = self.relaxer.reverse(&mut by_vectors, stopping)?;
        self.surfaces.reverse(vertices, displacement, &by_vectors, gradient)?;
        Ok(convergence)
    }
}

/// Loads of springs whose rest edges turn with their ends `[n_vertices]`, in the mesh's unit: the
/// forces `sum_j k_ij ((R_i + R_j) / 2 - 1) (X_i - X_j)` over the total stiffness of the row.
///
/// - `network`: the springs
/// - `positions` `[n_vertices]`: undeformed positions, in the mesh's unit
/// - `vectors` `[n_vertices]`: rotation vectors, in radians
pub fn rest_load(network: &Network, positions: &[DVec3], vectors: &[DVec3]) -> Vec<DVec3> {
    let turns: Vec<Turn> = vectors.par_iter().map(|vector| turn::run(*vector)).collect();
    let of_row = |row: usize| match network.constraint[row] {
        Constraint::Held => DVec3::ZERO,
        _ => rest_load::run(network.springs(row), positions, &turns, row),
    };
    (0..network.len()).into_par_iter().map(of_row).collect()
}

/// Change of the forces of springs whose rest edges turn with their ends `[n_vertices]`, in the
/// unit of stiffness times displacement: `sum_j k_ij (T_i + T_j) / 2 (X_i - X_j)`.
///
/// - `network`: the springs
/// - `positions` `[n_vertices]`: undeformed positions, in the mesh's unit
/// - `turns` `[n_vertices]`: changes T of the rotation matrices
pub(super) fn change_of_forces(network: &Network, positions: &[DVec3], turns: &[DMat3]) -> Vec<DVec3> {
    (0..network.len())
        .into_par_iter()
        .map(|row| {
            if network.constraint[row] == Constraint::Held {
                return DVec3::ZERO;
            }
            network.graph.range(row).zip(network.graph.row(row)).fold(DVec3::ZERO, |sum, (entry, &neighbour)| {
                let rest = positions[row] - positions[neighbour as usize];
                sum + network.stiffness[entry] * 0.5 * ((turns[row] + turns[neighbour as usize]) * rest)
            })
        })
        .collect()
}
