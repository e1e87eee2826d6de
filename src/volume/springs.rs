//! The spring network of the volume, which carries the surfaces' displacement inside.
//! [`crate::springs`] gives the stiffness. The rest edges of rotation-aware springs turn with the
//! surfaces (see `rotation`).
//!
//! The stiffness belongs to the undeformed mesh, so the result depends on the design alone.
//!
//! Vertices of plane families slide in their planes; all other surface vertices are held. Partners
//! in periodic planes first slide freely. Each set of partners then takes its mean displacement,
//! and the inside relaxes again with the partners held.

use glam::DVec3;

use super::{
    Start,
    edges::{EdgeGraph, EdgeSprings},
    rotation::{Rotation, rest_force, rotations_minus_identity},
    start::Equilibrium,
};
use crate::{
    backend::BackendError,
    constraint::Constraint,
    families::{PlacedBy, even},
    mesh::{Displacement, edges::VertexGraph},
    relaxation::{Convergence, Method, Network, Relaxer, Stopping},
    springs::Springs,
    stage::SetUp,
};

/// The network of all tets, set up once per mesh.
pub struct VolumeNetwork {
    pub(super) relaxer: Relaxer,
    /// Only with periodic planes.
    pub(super) tied: Option<Tied>,
    last: Equilibrium,
    /// Only with rotation-aware springs.
    pub(super) rotation: Option<Rotation>,
}

/// The network with periodic planes held, and the sets of vertices in these planes that move alike.
pub(super) struct Tied {
    pub(super) relaxer: Relaxer,
    pub(super) sets: Vec<Vec<u32>>,
}

impl VolumeNetwork {
    /// Evaluates the springs at the vertices of `set_up`'s mesh and sets up the networks.
    ///
    /// # Errors
    /// The backend failed, or the mesh does not fit the device.
    pub fn new(set_up: &SetUp, edge_graph: &EdgeGraph, springs: &Springs) -> Result<Self, BackendError> {
        Self::of(set_up, &edge_graph.graph, EdgeSprings::new(set_up, &edge_graph.tets, springs)?)
    }

    /// [`Self::new`], which takes the edges and frees most of their memory before it makes the
    /// networks.
    ///
    /// # Errors
    /// As for [`Self::new`].
    pub fn last(set_up: &SetUp, edge_graph: EdgeGraph, springs: &Springs) -> Result<Self, BackendError> {
        let EdgeGraph { tets, graph } = edge_graph;
        let of_edges = EdgeSprings::new(set_up, &tets, springs)?;
        drop(tets);
        Self::of(set_up, &graph, of_edges)
    }

    fn of(set_up: &SetUp, graph: &VertexGraph, springs: EdgeSprings) -> Result<Self, BackendError> {
        let SetUp { mesh, families, backend, method, .. } = *set_up;
        let EdgeSprings { length, stiffness, rotation_stiffness } = springs;
        let constraint: Vec<Constraint> = (0..mesh.vertices.len() as u32)
            .map(|vertex| match families.placed_by[vertex as usize] {
                PlacedBy::Volume => Constraint::Free,
                PlacedBy::Plane => families.plane_constraint(vertex),
                _ => Constraint::Held,
            })
            .collect();
        let anchor = vec![0.0; mesh.vertices.len()];
        let sets = families.partners.sliding(&families.placed_by);
        let tied = (!sets.is_empty()).then(|| {
            let mut constraint = constraint.clone();
            sets.iter().flatten().for_each(|&vertex| constraint[vertex as usize] = Constraint::Held);
            let network = Network::new(graph, &stiffness, &length, constraint, anchor.clone());
            Ok::<_, BackendError>(Tied { relaxer: Relaxer::new(network, backend, method)?, sets })
        });
        // The two networks are independent, so they are made in parallel.
        let (rotation, relaxer) = rayon::join(
            || rotation_stiffness.map(|stiffness| Rotation::new(set_up, graph, &stiffness)).transpose(),
            || Relaxer::new(Network::new(graph, &stiffness, &length, constraint, anchor), backend, method),
        );
        Ok(Self { relaxer: relaxer?, tied: tied.transpose()?, last: Equilibrium::default(), rotation: rotation? })
    }

    /// Constraint of each vertex after the surfaces have moved `[n_vertices]`.
    pub fn constraint(&self) -> &[Constraint] {
        &self.relaxer.network().constraint
    }

    /// The method that relaxes the springs; never [`Method::Auto`].
    pub fn method(&self) -> Method {
        self.relaxer.method()
    }

    /// Sets the start of further calls of [`Self::run`].
    pub fn start_from(&mut self, start: Start) {
        self.last.start_from(start);
        if let Some(rotation) = &mut self.rotation {
            rotation.start_from(start);
        }
    }

    /// Moves the inside after the surfaces. Returns the rotation vectors of all vertices
    /// `[n_vertices]`, in radians. There are none if the springs are not rotation-aware.
    ///
    /// - `vertices` `[n_vertices]`: undeformed positions, in the mesh's unit
    /// - `displacement` `[n_vertices]`: on entry the displacement of the surfaces, on exit of all
    ///   vertices, in the mesh's unit
    ///
    /// - `tell`: gets the share of the work that is done, now and then, in relaxations of many
    ///   sweeps
    ///
    /// # Errors
    /// The backend failed.
    pub fn run(
        &mut self,
        vertices: &[DVec3],
        displacement: &mut Displacement,
        stopping: &Stopping,
        tell: &dyn Fn(f64),
    ) -> Result<(Convergence, Vec<DVec3>), BackendError> {
        // The two relaxations take about the same time.
        let of_displacements = if self.rotation.is_some() { 0.5 } else { 1.0 };
        if displacement.iter().all(|displacement| *displacement == DVec3::ZERO) {
            let n_rotations = if self.rotation.is_some() { vertices.len() } else { 0 };
            return Ok((Convergence::nothing_to_do(), vec![DVec3::ZERO; n_rotations]));
        }
        let (force, rotations, spread) = match &mut self.rotation {
            None => (None, Vec::new(), Convergence::nothing_to_do()),
            Some(rotation) => {
                let (rotations, spread) =
                    rotation.spread(vertices, displacement, stopping, &|share| tell(0.5 * share))?;
                let turns = rotations_minus_identity(&rotations);
                (Some(rest_force(self.relaxer.network(), vertices, &turns)), rotations, spread)
            }
        };
        // The rotations of the surfaces depend on the displacement beside them, so the start of the
        // springs comes after them.
        self.last.recall(&self.relaxer.network().constraint, displacement);
        let tell = |share: f64| tell(1.0 - of_displacements * (1.0 - share));
        let mut convergence = self.relaxer.relax_and_tell(displacement, force.as_deref(), stopping, &tell)?;
        if self.rotation.is_some() {
            // The rotations are relaxed first.
            convergence = spread.and(convergence);
        }
        if let Some(Tied { relaxer, sets }) = &mut self.tied {
            sets.iter().for_each(|set| even(set, displacement, false));
            convergence = convergence.and(relaxer.relax(displacement, force.as_deref(), stopping)?);
        }
        self.last.keep(&convergence, displacement);
        Ok((convergence, rotations))
    }
}
