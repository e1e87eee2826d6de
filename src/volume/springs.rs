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
    rotation::{Rotation, rest_load},
    start::Equilibrium,
};
use crate::{
    backend::BackendError,
    constraint::Constraint,
    families::{Families, PlacedBy, even},
    mesh::{Displacement, edges::VertexGraph},
    relaxation::{Convergence, Method, MovingGraph, Network, Relaxer, Stopping, Unrelaxed},
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
    /// Whether the device keeps rotations and displacements.
    is_resident: bool,
}

/// The network with periodic planes held, and the sets of vertices in these planes that move alike.
pub(super) struct Tied {
    pub(super) relaxer: Relaxer,
    pub(super) sets: Vec<Vec<u32>>,
}

/// The springs for displacements, and for rotations if the springs are rotation-aware.
struct Networks {
    displacement: Network,
    /// With the sets of partners in periodic planes held; see [`Tied`].
    tied: Option<(Network, Vec<Vec<u32>>)>,
    rotation: Option<Network>,
}

impl Networks {
    fn new(set_up: &SetUp, graph: &VertexGraph, springs: EdgeSprings) -> Self {
        let SetUp { mesh, families, .. } = *set_up;
        let EdgeSprings { length, stiffness, rotation_stiffness } = springs;
        let network = |held: &[Vec<u32>]| {
            let n_vertices = mesh.vertices.len();
            let mut constraint: Vec<Constraint> =
                (0..n_vertices as u32).map(|vertex| constraint(families, &[], vertex)).collect();
            held.iter().flatten().for_each(|&vertex| constraint[vertex as usize] = Constraint::Held);
            Network::new(graph, &stiffness, &length, constraint, vec![0.0; n_vertices])
        };
        let sets = families.partners.sliding(&families.placed_by);
        let tied = (!sets.is_empty()).then(|| (network(&sets), sets));
        let (displacement, rotation) = rayon::join(
            || network(&[]),
            || rotation_stiffness.map(|stiffness| Rotation::network(set_up, graph, &stiffness)),
        );
        Self { displacement, tied, rotation }
    }
}

/// Constraint of a vertex after the surfaces have moved.
///
/// - `floating`: vertices without springs to a held vertex, ascending
pub(super) fn constraint(families: &Families, floating: &[u32], vertex: u32) -> Constraint {
    if floating.binary_search(&vertex).is_ok() {
        return Constraint::Held;
    }
    match families.placed_by[vertex as usize] {
        PlacedBy::Volume => Constraint::Free,
        PlacedBy::Plane => families.plane_constraint(vertex),
        _ => Constraint::Held,
    }
}

impl VolumeNetwork {
    /// Evaluates the springs at the vertices of `set_up`'s mesh and sets up the networks.
    ///
    /// # Errors
    /// The backend failed, or the mesh does not fit the device.
    pub fn new(set_up: &SetUp, edge_graph: &EdgeGraph, springs: &Springs) -> Result<Self, BackendError> {
        let of_edges = EdgeSprings::new(set_up, &edge_graph.tets, springs)?;
        Self::of(set_up, Networks::new(set_up, &edge_graph.graph, of_edges))
    }

    /// [`Self::new`], which takes the edges and frees their memory before it relaxes anything.
    ///
    /// # Errors
    /// As for [`Self::new`].
    pub fn last(set_up: &SetUp, edge_graph: EdgeGraph, springs: &Springs) -> Result<Self, BackendError> {
        let EdgeGraph { tets, graph } = edge_graph;
        let of_edges = EdgeSprings::new(set_up, &tets, springs)?;
        drop(tets);
        let networks = Networks::new(set_up, &graph, of_edges);
        drop(graph);
        Self::of(set_up, networks)
    }

    fn of(set_up: &SetUp, networks: Networks) -> Result<Self, BackendError> {
        let SetUp { backend, method, .. } = *set_up;
        let Networks { displacement, tied, rotation } = networks;
        let tied = tied.map(|(network, sets)| {
            Ok::<_, BackendError>(Tied { relaxer: Relaxer::new(network, backend, method)?, sets })
        });
        let moving = MovingGraph::new(&displacement);
        // The two networks are independent, so they are made in parallel.
        let (rotation, relaxer) = rayon::join(
            || rotation.map(|network| Rotation::new(set_up, network, &moving)).transpose(),
            || Relaxer::along(displacement, &moving, backend, method),
        );
        let (mut relaxer, tied, mut rotation) = (relaxer?, tied.transpose()?, rotation?);
        // Partners need the displacements on the CPU.
        let is_resident = tied.is_none()
            && relaxer.reside(Vec::new())?
            && match &mut rotation {
                None => true,
                Some(rotation) => rotation.reside(&mut relaxer, &set_up.mesh.vertices)?,
            };
        Ok(Self { relaxer, tied, last: Equilibrium::default(), rotation, is_resident })
    }

    /// Constraint of each vertex after the surfaces have moved `[n_vertices]`.
    pub fn constraint(&self) -> &[Constraint] {
        &self.relaxer.network().constraint
    }

    /// The vertices that are held because no chain of springs ties them to a held vertex,
    /// ascending.
    pub(super) fn floating(&self, families: &Families) -> Vec<u32> {
        let is_held = |(_, constraint): &(u32, &Constraint)| **constraint == Constraint::Held;
        let held = (0..).zip(self.constraint()).filter(is_held).map(|(vertex, _)| vertex);
        held.filter(|&vertex| constraint(families, &[], vertex) != Constraint::Held).collect()
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
    /// `[n_vertices]`, in radians. There are none if the springs are not rotation-aware, and none
    /// if the device keeps them; see [`Self::rotations`].
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
        let results = self.run_together(vertices, &mut [displacement], stopping, tell)?;
        Ok(results.into_iter().next().unwrap_or_default())
    }

    /// [`Self::run`] for several designs. Each has the result that it has alone, to the bit, if
    /// relaxations start from the undeformed mesh.
    ///
    /// # Errors
    /// The backend failed.
    pub fn run_together(
        &mut self,
        vertices: &[DVec3],
        displacements: &mut [&mut Displacement],
        stopping: &Stopping,
        tell: &dyn Fn(f64),
    ) -> Result<Vec<(Convergence, Vec<DVec3>)>, BackendError> {
        let rests = |displacement: &Displacement| displacement.iter().all(|by| *by == DVec3::ZERO);
        let n_rotations = if self.rotation.is_some() { vertices.len() } else { 0 };
        let nothing = || (Convergence::nothing_to_do(), vec![DVec3::ZERO; n_rotations]);
        let (mut results, mut moving) = (Vec::new(), Vec::new());
        for displacement in displacements.iter_mut() {
            if rests(displacement) {
                results.push(Some(nothing()));
            } else {
                results.push(None);
                moving.push(&mut **displacement);
            }
        }
        let mut moved = self.run_moving(vertices, &mut moving, stopping, tell)?.into_iter();
        Ok(results.into_iter().filter_map(|result| result.or_else(|| moved.next())).collect())
    }

    /// [`Self::run_together`] for designs that move something.
    fn run_moving(
        &mut self,
        vertices: &[DVec3],
        displacements: &mut [&mut Displacement],
        stopping: &Stopping,
        tell: &dyn Fn(f64),
    ) -> Result<Vec<(Convergence, Vec<DVec3>)>, BackendError> {
        if self.is_resident && self.last.is_undeformed() {
            let mut on_device =
                |displacement: &mut Displacement| self.run_on_device(vertices, displacement, stopping, tell);
            return displacements.iter_mut().map(|displacement| Ok((on_device(displacement)?, Vec::new()))).collect();
        }
        // The two relaxations take about the same time.
        let of_displacements = if self.rotation.is_some() { 0.5 } else { 1.0 };
        let mut loads: Vec<Option<Vec<DVec3>>> = vec![None; displacements.len()];
        let mut results = vec![(Convergence::nothing_to_do(), Vec::new()); displacements.len()];
        if let Some(rotation) = &mut self.rotation {
            let turned = rotation.spread(vertices, displacements, stopping, &|share| tell(0.5 * share))?;
            for (((rotations, spread), load), result) in turned.into_iter().zip(&mut loads).zip(&mut results) {
                *load = Some(rest_load(self.relaxer.network(), vertices, &rotations));
                *result = (spread, rotations);
            }
        }
        // The rotations of the surfaces depend on the displacement beside them, so the start of the
        // springs comes after them.
        let constraint = &self.relaxer.network().constraint;
        displacements.iter_mut().for_each(|displacement| self.last.recall(constraint, displacement));
        let tell = |share: f64| tell(1.0 - of_displacements * (1.0 - share));
        let of_springs = self.relaxer.relax_together(unrelaxed(displacements, &loads), stopping, &tell)?;
        for ((result, _), of_springs) in results.iter_mut().zip(of_springs) {
            // The rotations are relaxed first.
            *result = match &self.rotation {
                Some(_) => std::mem::take(result).and(of_springs),
                None => of_springs,
            };
        }
        if let Some(Tied { relaxer, sets }) = &mut self.tied {
            for displacement in displacements.iter_mut() {
                sets.iter().for_each(|set| even(set, displacement, false));
            }
            let tied = relaxer.relax_together(unrelaxed(displacements, &loads), stopping, &|_| ())?;
            for ((result, _), tied) in results.iter_mut().zip(tied) {
                *result = std::mem::take(result).and(tied);
            }
        }
        for ((result, _), displacement) in results.iter().zip(displacements) {
            self.last.keep(result, displacement);
        }
        Ok(results)
    }

    /// [`Self::run`], with rotations and forces that stay on the device.
    fn run_on_device(
        &mut self,
        vertices: &[DVec3],
        displacement: &mut Displacement,
        stopping: &Stopping,
        tell: &dyn Fn(f64),
    ) -> Result<Convergence, BackendError> {
        let Some(rotation) = &mut self.rotation else {
            return self.relaxer.relax_on_device(displacement, None, true, stopping, tell);
        };
        let (turns, spread) =
            rotation.spread_on_device(vertices, displacement, stopping, &|share| tell(0.5 * share))?;
        let tell = |share: f64| tell(0.5 * (1.0 + share));
        Ok(spread.and(self.relaxer.relax_on_device(displacement, turns, true, stopping, &tell)?))
    }

    /// The rotation vectors of a run that returned none: they are spread again.
    ///
    /// - `surfaces` `[n_vertices]`: displacement of the surfaces in the run, in the mesh's unit
    ///
    /// # Errors
    /// The backend failed.
    pub(super) fn rotations(
        &mut self,
        vertices: &[DVec3],
        surfaces: &Displacement,
        stopping: &Stopping,
    ) -> Result<Vec<DVec3>, BackendError> {
        match &mut self.rotation {
            None => Ok(Vec::new()),
            Some(rotation) => {
                let of_designs = rotation.spread(vertices, &[&mut surfaces.clone()], stopping, &|_| ())?;
                Ok(of_designs.into_iter().next().unwrap_or_default().0)
            }
        }
    }
}

/// The designs for a relaxer.
fn unrelaxed<'a>(displacements: &'a mut [&mut Displacement], loads: &'a [Option<Vec<DVec3>>]) -> Vec<Unrelaxed<'a>> {
    let of_designs = displacements.iter_mut().zip(loads);
    of_designs.map(|(displacement, load)| Unrelaxed { displacement, load: load.as_deref() }).collect()
}
