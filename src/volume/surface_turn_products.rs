//! The derivative of [`SurfaceTurns::turns`]: how the rotations of the surfaces' vertices change
//! with the displacement of the surfaces, and the transpose.
//!
//! A rotation changes with the edges along the surface, with the normal, and a little with the
//! rotation of the whole family. The page on derivatives in the book has the formulas. The
//! derivative takes none of the short cuts of an update: a surface that does not move has a
//! derivative too.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::surface_turns::{BODY, Body, MovedSurfaces, NORMAL, SurfaceTurns, moved, nearest_turn};
use crate::{
    geometry::{
        corners,
        fitted_motion::FittedMotion,
        rotation_vectors::{FittedRotation, axial, cross_matrix, inverse_jacobian, outer, rotation_vector},
        triangle_normal,
    },
    mesh::Displacement,
    stage::NoProduct,
};

/// The surfaces at one displacement, with the derivatives of their rotations.
struct Linearised<'a> {
    surfaces: MovedSurfaces<'a>,
    /// Sums of the normals of the triangles around each vertex after the motion `[n_vertices]`,
    /// twice their areas long.
    areas: Vec<DVec3>,
    /// Families that place vertices.
    bodies: Vec<LinearisedBody<'a>>,
}

struct LinearisedBody<'a> {
    body: &'a Body,
    fit: FittedRotation,
    /// Centre of the family before the motion.
    centre: DVec3,
    /// Each vertex that the family places, in the family's order.
    placed: Vec<LinearisedVertex>,
}

struct LinearisedVertex {
    fit: FittedRotation,
    /// Rotation vector, in radians.
    vector: DVec3,
}

impl SurfaceTurns {
    /// Change of the rotation vectors `[n_vertices]`.
    ///
    /// - `vertices` `[n_vertices]`: undeformed positions, in the mesh's unit
    /// - `displacement` `[n_vertices]`: displacement of the surfaces, in the mesh's unit
    /// - `change` `[n_vertices]`: its change
    ///
    /// # Errors
    /// A rotation has no derivative.
    pub(super) fn forward(
        &self,
        vertices: &[DVec3],
        displacement: &Displacement,
        change: &Displacement,
    ) -> Result<Vec<DVec3>, NoProduct> {
        let moved = moved(vertices, displacement);
        let linearised = self.linearised(vertices, &moved)?;
        let mut area_change = vec![DVec3::ZERO; vertices.len()];
        for &triangle in &self.triangles {
            let ([a, b, c], [da, db, dc]) = (corners(&moved, triangle), corners(change, triangle));
            let of_triangle = (db - da).cross(c - a) + (b - a).cross(dc - da);
            triangle.iter().for_each(|&vertex| area_change[vertex as usize] += of_triangle);
        }
        let mut vectors = vec![DVec3::ZERO; vertices.len()];
        for LinearisedBody { body, fit, centre, placed } in &linearised.bodies {
            let sum = body.vertices.iter().fold(DMat3::ZERO, |sum, &vertex| {
                sum + outer(change[vertex as usize], vertices[vertex as usize] - *centre)
            });
            let of_body = cross_matrix(fit.forward(sum)) * fit.rotation * BODY;
            let vector_change = |(&vertex, of_vertex): (&u32, &LinearisedVertex)| {
                let at = vertex as usize;
                let of_arms = self.arms(&linearised.surfaces, vertex).fold(of_body, |sum, arm| {
                    sum + outer((change[arm.neighbour] - change[at]) * arm.scale, arm.before)
                });
                let [normal, _] = linearised.surfaces.normals_at(vertex);
                let of_normal = outer(linearised.across_normal(vertex, area_change[at]) * NORMAL, normal);
                inverse_jacobian(of_vertex.vector) * of_vertex.fit.forward(of_arms + of_normal)
            };
            let found: Vec<DVec3> = body.placed.par_iter().zip(placed).map(vector_change).collect();
            body.placed.iter().zip(found).for_each(|(&vertex, vector)| vectors[vertex as usize] = vector);
        }
        Ok(vectors)
    }

    /// The transpose of [`Self::forward`].
    ///
    /// - `by_vectors` `[n_vertices]`: the derivative of a number by the rotation vectors
    /// - `gradient` `[n_vertices]`: the derivative of the number by the displacement, to which the
    ///   rotations' part is added
    ///
    /// # Errors
    /// As for [`Self::forward`].
    pub(super) fn reverse(
        &self,
        vertices: &[DVec3],
        displacement: &Displacement,
        by_vectors: &[DVec3],
        gradient: &mut Displacement,
    ) -> Result<(), NoProduct> {
        let moved = moved(vertices, displacement);
        let linearised = self.linearised(vertices, &moved)?;
        let mut by_areas = vec![DVec3::ZERO; vertices.len()];
        for LinearisedBody { body, fit, centre, placed } in &linearised.bodies {
            let mut by_rotation = DMat3::ZERO;
            for (&vertex, of_vertex) in body.placed.iter().zip(placed) {
                let at = vertex as usize;
                let by_increment = inverse_jacobian(of_vertex.vector).transpose() * by_vectors[at];
                let by_sum = of_vertex.fit.reverse(by_increment);
                by_rotation += by_sum * BODY;
                for arm in self.arms(&linearised.surfaces, vertex) {
                    let by_arm = by_sum * arm.before * arm.scale;
                    gradient[arm.neighbour] += by_arm;
                    gradient[at] -= by_arm;
                }
                let [normal, _] = linearised.surfaces.normals_at(vertex);
                by_areas[at] += linearised.across_normal(vertex, by_sum * normal * NORMAL);
            }
            let by_sum = fit.reverse(axial(by_rotation * fit.rotation.transpose()));
            for &vertex in &body.vertices {
                gradient[vertex as usize] += by_sum * (vertices[vertex as usize] - *centre);
            }
        }
        for &triangle in &self.triangles {
            let [a, b, c] = corners(&moved, triangle);
            let by_area: DVec3 = corners(&by_areas, triangle).iter().sum();
            let (by_b, by_c) = ((c - a).cross(by_area), by_area.cross(b - a));
            for (vertex, by_corner) in triangle.iter().zip([-(by_b + by_c), by_b, by_c]) {
                gradient[*vertex as usize] += by_corner;
            }
        }
        Ok(())
    }

    fn linearised<'a>(&'a self, vertices: &'a [DVec3], moved: &'a [DVec3]) -> Result<Linearised<'a>, NoProduct> {
        let surfaces = self.moved_surfaces(vertices, moved);
        let mut areas = vec![DVec3::ZERO; vertices.len()];
        for &triangle in &self.triangles {
            let area = triangle_normal(corners(moved, triangle));
            triangle.iter().for_each(|&vertex| areas[vertex as usize] += area);
        }
        let bodies = self.bodies.iter().filter(|body| !body.placed.is_empty());
        let bodies = bodies.map(|body| self.linearised_body(body, &surfaces)).collect::<Result<_, _>>()?;
        Ok(Linearised { surfaces, areas, bodies })
    }

    fn linearised_body<'a>(&self, body: &'a Body, surfaces: &MovedSurfaces) -> Result<LinearisedBody<'a>, NoProduct> {
        let motion = body.motion(surfaces);
        let (turn, (centre, moved_centre)) = (motion.rotation(), motion.centres());
        let [before, after] = surfaces.at;
        let sum = body.vertices.iter().fold(DMat3::ZERO, |sum, &vertex| {
            sum + outer(after[vertex as usize] - moved_centre, before[vertex as usize] - centre)
        });
        let no_rotation = |vertex: u32| NoProduct::Rotation { vertex };
        let fit = FittedRotation::new(DMat3::from_quat(turn), sum).ok_or(no_rotation(body.placed[0]))?;
        let vector = rotation_vector(turn);
        let placed = body.placed.par_iter().map(|&vertex| {
            let sum = self.sum_of_arms(surfaces, turn, vertex);
            let turn = FittedMotion::rotation_nearest(sum);
            let fit = FittedRotation::new(DMat3::from_quat(turn), sum).ok_or(no_rotation(vertex))?;
            Ok(LinearisedVertex { fit, vector: nearest_turn(rotation_vector(turn), vector) })
        });
        Ok(LinearisedBody { body, fit, centre, placed: placed.collect::<Result<_, NoProduct>>()? })
    }
}

impl Linearised<'_> {
    /// Change of the normal of a vertex for a change of the sum of the normals around the vertex.
    /// The map is its own transpose.
    fn across_normal(&self, vertex: u32, change: DVec3) -> DVec3 {
        let [_, normal] = self.surfaces.normals_at(vertex);
        if normal == DVec3::ZERO {
            return DVec3::ZERO;
        }
        (change - normal * normal.dot(change)) / self.areas[vertex as usize].length()
    }
}
