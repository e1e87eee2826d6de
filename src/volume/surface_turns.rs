//! Rotations of the moved surfaces' own vertices.
//!
//! Each vertex of a moved family gets the rotation that fits the motion of its edges along the
//! surface, of its normal and, with little weight, of its whole family.

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};
use rayon::prelude::*;

use crate::{
    geometry::{
        fitted_motion::FittedMotion,
        rotation_vectors::{outer, rotation_vector},
        vertex_normals,
    },
    mesh::{Displacement, csr::Csr, edges::VertexGraph},
    stage::SetUp,
};

/// Weight of the normal in the fit of a surface vertex, where each edge has weight 1. Edges alone
/// hardly determine a rotation about an axis in their plane.
pub(super) const NORMAL: f64 = 3.0;

/// Weight of the body's own rotation in the fit. It matters only where the edges do not determine
/// the rotation: at a sharp edge the normals cancel, and about the edge itself every rotation would
/// fit.
pub(super) const BODY: f64 = 0.01;

/// Where the surfaces have vertices with rotations of their own, and what these are fitted to.
pub(super) struct SurfaceTurns {
    /// Neighbours of each surface vertex along the surface: `n_vertices` rows.
    ring: Arc<Csr>,
    pub(super) bodies: Vec<Body>,
    /// The triangles whose areas make the normals: quadrilaterals in both divisions.
    pub(super) triangles: Vec<[u32; 3]>,
}

/// A moved family.
pub(super) struct Body {
    /// All vertices of the family. The family's own rotation is fitted to them, because the placed
    /// vertices may lie on a line.
    pub(super) vertices: Vec<u32>,
    /// The vertices that the family places. Each has a rotation of its own.
    pub(super) placed: Vec<u32>,
}

/// The surfaces before and after their motion.
pub(super) struct MovedSurfaces<'a> {
    /// Positions `[n_vertices]` before and after, in the mesh's unit. Only those of surface
    /// vertices are used.
    pub(super) at: [&'a [DVec3]; 2],
    /// Normals of the surface vertices `[n_vertices]` before and after.
    pub(super) normals: [Vec<DVec3>; 2],
}

/// An edge along the surface from a vertex.
pub(super) struct Arm {
    /// The edge before the motion, of length 1.
    pub(super) before: DVec3,
    /// The edge after the motion, in the length before.
    pub(super) after: DVec3,
    /// The other end.
    pub(super) neighbour: usize,
    /// One over the length before.
    pub(super) scale: f64,
}

impl SurfaceTurns {
    /// Sets up the surfaces of a mesh.
    pub(super) fn new(set_up: &SetUp) -> Self {
        let SetUp { mesh, surface, families, .. } = *set_up;
        let n = mesh.vertices.len();
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
        let ring = VertexGraph::new(n, &ring_edges(set_up)).neighbours;
        Self { ring, bodies, triangles: surface.triangles_of_both_divisions() }
    }

    /// The rotation vector of every vertex `[n_vertices]`, in radians. Vertices that no moved
    /// family places have none, which is zero.
    ///
    /// - `vertices` `[n_vertices]`: undeformed positions, in the mesh's unit
    /// - `displacement` `[n_vertices]`: displacement of the surfaces, in the mesh's unit
    pub(super) fn turns(&self, vertices: &[DVec3], displacement: &Displacement) -> Vec<DVec3> {
        let moved = moved(vertices, displacement);
        let surfaces = self.moved_surfaces(vertices, &moved);
        let rests = |&vertex: &u32| displacement[vertex as usize] == DVec3::ZERO;
        let mut vectors = vec![DVec3::ZERO; vertices.len()];
        for body in &self.bodies {
            let is_still = body.vertices.iter().all(rests);
            let rotation = if is_still { DQuat::IDENTITY } else { body.motion(&surfaces).rotation() };
            let vector = rotation_vector(rotation);
            let turn = |vertex: &u32| {
                // Where nothing moves, rounding must not turn anything.
                let [before, after] = surfaces.normals_at(*vertex);
                if is_still && before == after && self.ring.row(*vertex as usize).iter().all(rests) {
                    return DVec3::ZERO;
                }
                let sum = self.sum_of_arms(&surfaces, rotation, *vertex);
                nearest_turn(rotation_vector(FittedMotion::rotation_nearest(sum)), vector)
            };
            let found: Vec<DVec3> = body.placed.par_iter().map(turn).collect();
            body.placed.iter().zip(found).for_each(|(&vertex, vector)| vectors[vertex as usize] = vector);
        }
        vectors
    }

    /// The surfaces at these positions `[n_vertices]` before and after their motion.
    pub(super) fn moved_surfaces<'a>(&self, vertices: &'a [DVec3], moved: &'a [DVec3]) -> MovedSurfaces<'a> {
        let at = [vertices, moved];
        MovedSurfaces { at, normals: at.map(|points| vertex_normals(points, &self.triangles)) }
    }

    /// The arms of a surface vertex.
    pub(super) fn arms(&self, surfaces: &MovedSurfaces, vertex: u32) -> impl Iterator<Item = Arm> {
        let [vertices, moved] = surfaces.at;
        let at = vertex as usize;
        self.ring.row(at).iter().map(move |&neighbour| {
            let neighbour = neighbour as usize;
            let before = vertices[neighbour] - vertices[at];
            let scale = 1.0 / before.length();
            Arm { before: before * scale, after: (moved[neighbour] - moved[at]) * scale, neighbour, scale }
        })
    }

    /// The sum `sum q p^T` whose best rotation is the rotation of a surface vertex: over its arms,
    /// its normal and the rotation of its body.
    pub(super) fn sum_of_arms(&self, surfaces: &MovedSurfaces, body: DQuat, vertex: u32) -> DMat3 {
        let arms = self.arms(surfaces, vertex).map(|arm| (arm.before, arm.after));
        let prior = DVec3::AXES.map(|axis| (axis * BODY.sqrt(), body * axis * BODY.sqrt()));
        let [before, after] = surfaces.normals_at(vertex).map(|normal| normal * NORMAL.sqrt());
        arms.chain(prior).chain([(before, after)]).fold(DMat3::ZERO, |sum, (p, q)| sum + outer(q, p))
    }
}

impl MovedSurfaces<'_> {
    /// Normals of a surface vertex before and after the motion.
    pub(super) fn normals_at(&self, vertex: u32) -> [DVec3; 2] {
        [0, 1].map(|which| self.normals[which][vertex as usize])
    }
}

impl Body {
    /// The rigid motion that fits the motion of all vertices of the family best.
    pub(super) fn motion(&self, surfaces: &MovedSurfaces) -> FittedMotion {
        let [before, after] = surfaces.at;
        let pair = |&vertex: &u32| (before[vertex as usize], after[vertex as usize], 1.0);
        FittedMotion::rigid(&self.vertices.iter().map(pair).collect::<Vec<_>>())
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

/// Of the two rotation vectors of a rotation, the one nearer to the rotation vector of the body.
///
/// A vertex of a body that turns by nearly half a turn may turn by more than half. Its shorter
/// rotation vector then has the opposite direction.
pub(super) fn nearest_turn(vector: DVec3, body: DVec3) -> DVec3 {
    let angle = vector.length();
    if angle == 0.0 {
        return vector;
    }
    let other = vector * (1.0 - std::f64::consts::TAU / angle);
    if other.distance_squared(body) < vector.distance_squared(body) { other } else { vector }
}

/// Positions `[n_vertices]` after a displacement `[n_vertices]`.
pub(super) fn moved(vertices: &[DVec3], displacement: &Displacement) -> Vec<DVec3> {
    vertices.iter().zip(displacement).map(|(at, by)| *at + *by).collect()
}
