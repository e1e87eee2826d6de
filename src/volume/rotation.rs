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

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};
use rayon::prelude::*;

use super::{Start, start::Equilibrium};
use crate::families::PlacedBy;
use crate::geometry::fitted_motion::FittedMotion;
use crate::mesh::Displacement;
use crate::stage::SetUp;
use crate::{
    backend::BackendError,
    constraint::Constraint,
    geometry::vertex_normals,
    mesh::{csr::Csr, edges::VertexGraph},
    relaxation::{Convergence, Network, Relaxer, Stopping},
};

/// Weight of the normal in the fit of a surface vertex, where each edge has weight 1. Edges alone
/// hardly determine a rotation about an axis in their plane.
const NORMAL: f64 = 3.0;

/// Tolerance of the rotations in radians, over the tolerance of the displacements in shortest
/// edges. An error of the rotation moves a vertex by the error times its distance from the
/// surfaces, some tens of edges.
const ANGLE: f64 = 1.0 / 32.0;

/// Weight of the body's own rotation in the fit. It matters only where the edges do not determine
/// the rotation: at a sharp edge the normals cancel, and about the edge itself every rotation would
/// fit.
const BODY: f64 = 0.01;

/// A moved family.
struct Body {
    /// All vertices of the family. The family's own rotation is fitted to them, because the placed
    /// vertices may lie on a line.
    vertices: Vec<u32>,
    /// The vertices that the family places. Each has a rotation of its own.
    placed: Vec<u32>,
}

/// The network that spreads rotations from the surfaces to all vertices.
pub struct Rotation {
    relaxer: Relaxer,
    last: Equilibrium,
    /// Neighbours of each surface vertex along the surface: `n_vertices` rows.
    ring: Arc<Csr>,
    bodies: Vec<Body>,
    triangles: Vec<[u32; 3]>,
}

impl Rotation {
    /// Sets up the network.
    ///
    /// - `graph`: the tets' edges
    /// - `edge_stiffness` `[n_edges]`: stiffness for rotations
    ///
    /// # Errors
    /// The backend failed, or the mesh does not fit the device.
    pub fn new(set_up: &SetUp, graph: &VertexGraph, edge_stiffness: &[f64]) -> Result<Self, BackendError> {
        let SetUp { mesh, surface, families, backend, method, .. } = *set_up;
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
        let network = Network::new(graph, edge_stiffness, &lengths, constraint, vec![0.0; n]);
        let ring = VertexGraph::new(n, &ring_edges(set_up)).neighbours;
        let mut taken = vec![false; n];
        let bodies = families
            .moved()
            .map(|family| {
                let own = |vertex: &u32| {
                    families.placed_by[*vertex as usize] == families.roles[family.index()].placed_by()
                        && !std::mem::replace(&mut taken[*vertex as usize], true)
                };
                let vertices = surface.vertices_of(family).to_vec();
                Body { placed: vertices.iter().copied().filter(own).collect(), vertices }
            })
            .collect();
        let relaxer = Relaxer::new(network, backend, method)?;
        Ok(Self { relaxer, last: Equilibrium::default(), ring, bodies, triangles: surface.triangles.clone() })
    }

    /// Sets the start of further relaxations.
    pub(super) fn start_from(&mut self, start: Start) {
        self.last.start_from(start);
    }

    /// The rotation matrix of every vertex minus the identity `[n_vertices]`.
    ///
    /// - `vertices` `[n_vertices]`: undeformed positions, in the mesh's unit
    /// - `displacement` `[n_vertices]`: displacement of the surfaces, in the mesh's unit
    /// - `stopping`: for displacements; the tolerance of the rotations follows from it
    ///
    /// # Errors
    /// The backend failed.
    pub fn spread(
        &mut self,
        vertices: &[DVec3],
        displacement: &Displacement,
        stopping: &Stopping,
    ) -> Result<(Vec<DMat3>, Convergence), BackendError> {
        let mut vectors = vec![DVec3::ZERO; vertices.len()];
        let moved: Vec<DVec3> = vertices.iter().zip(displacement).map(|(at, by)| *at + *by).collect();
        let normals = [vertices, &moved].map(|points| self.normals(points));
        for Body { vertices: all, placed } in &self.bodies {
            if all.iter().all(|&vertex| displacement[vertex as usize] == DVec3::ZERO) {
                continue;
            }
            let pairs: Vec<(DVec3, DVec3, f64)> =
                all.iter().map(|&v| (vertices[v as usize], moved[v as usize], 1.0)).collect();
            let body_rotation = FittedMotion::rigid(&pairs).rotation();
            let body = rotation_vector(body_rotation);
            let prior = DVec3::AXES.map(|axis| (axis * BODY.sqrt(), body_rotation * axis * BODY.sqrt()));
            let found: Vec<DVec3> = placed
                .par_iter()
                .map(|&vertex| {
                    let at = vertex as usize;
                    let arms = self.ring.row(at).iter().map(|&v| {
                        let before = vertices[v as usize] - vertices[at];
                        let scale = 1.0 / before.length();
                        (before * scale, (moved[v as usize] - moved[at]) * scale)
                    });
                    let normal = (normals[0][at] * NORMAL.sqrt(), normals[1][at] * NORMAL.sqrt());
                    let arms = arms.chain(prior).chain([normal]);
                    nearest_turn(rotation_vector(FittedMotion::rotation_of(arms)), body)
                })
                .collect();
            placed.iter().zip(found).for_each(|(&vertex, vector)| vectors[vertex as usize] = vector);
        }
        let stopping = Stopping { tolerance: ANGLE * stopping.tolerance, ..*stopping };
        self.last.recall(&self.relaxer.network().constraint, &mut vectors);
        let convergence = self.relaxer.relax(&mut vectors, None, &stopping)?;
        self.last.keep(&convergence, &vectors);
        let rotation_minus_identity = |vector: &DVec3| {
            if *vector == DVec3::ZERO {
                DMat3::ZERO
            } else {
                DMat3::from_quat(DQuat::from_scaled_axis(*vector)) - DMat3::IDENTITY
            }
        };
        Ok((vectors.par_iter().map(rotation_minus_identity).collect(), convergence))
    }

    fn normals(&self, points: &[DVec3]) -> Vec<DVec3> {
        vertex_normals(points, &self.triangles)
    }
}

/// The edges along which the rotations of surface vertices are fitted.
///
/// In a mesh of tets these are all edges of the surface. In a mesh with layers, plane families have
/// edges in the layers. The stage of the planes has only spread the displacements there roughly, so
/// these edges would turn the rotations of a wing that ends in the plane. Then the edges of the
/// families that move are taken.
fn ring_edges(set_up: &SetUp) -> Vec<[u32; 2]> {
    let SetUp { cells, surface, families, .. } = set_up;
    if cells.are_tets() {
        return surface.edges_of(&(0..surface.triangles.len() as u32).collect::<Vec<_>>());
    }
    surface.edges_of(families.moved().flat_map(|family| surface.triangles_of(family)))
}

/// Forces of springs whose rest edges turn with their ends `[n_vertices]`, in the unit of stiffness
/// times displacement: `sum_j k_ij ((R_i + R_j) / 2 - 1) (X_i - X_j)`.
///
/// - `network`: the springs
/// - `positions` `[n_vertices]`: undeformed positions, in the mesh's unit
/// - `rotation_minus_identity` `[n_vertices]`: rotation matrices minus the identity
pub fn rest_force(network: &Network, positions: &[DVec3], rotation_minus_identity: &[DMat3]) -> Vec<DVec3> {
    (0..network.len())
        .into_par_iter()
        .map(|row| {
            if network.constraint[row] == Constraint::Held {
                return DVec3::ZERO;
            }
            network.graph.range(row).zip(network.graph.row(row)).fold(DVec3::ZERO, |sum, (entry, &neighbour)| {
                let rest = positions[row] - positions[neighbour as usize];
                sum + network.stiffness[entry]
                    * 0.5
                    * ((rotation_minus_identity[row] + rotation_minus_identity[neighbour as usize]) * rest)
            })
        })
        .collect()
}

/// Rotation vector: the axis times the angle in radians, `0..=pi`.
fn rotation_vector(rotation: DQuat) -> DVec3 {
    (if rotation.w < 0.0 { -rotation } else { rotation }).to_scaled_axis()
}

/// Of the two rotation vectors of a rotation, the one nearer to the rotation vector of the body.
///
/// A vertex of a body that turns by nearly half a turn may turn by more than half. Its shorter
/// rotation vector then has the opposite direction.
fn nearest_turn(vector: DVec3, body: DVec3) -> DVec3 {
    let angle = vector.length();
    if angle == 0.0 {
        return vector;
    }
    let other = vector * (1.0 - std::f64::consts::TAU / angle);
    if other.distance_squared(body) < vector.distance_squared(body) { other } else { vector }
}
