//! The shapes on which vertices slide: the original surface of a carenage, the plane of a plane
//! family.

use glam::{DMat3, DVec3};

use super::{MOST_FLAT, PlacedBy, Role, SetupError};
use crate::{
    geometry::{rotation_vectors::outer, triangle_normal},
    mesh::{FamilyId, TetMesh, half_edge::Surface},
    projection::{TargetSurface, continuation},
};

/// Default for the flatness of a plane family, as a fraction of its size.
const FLAT: f64 = 1e-6;

/// The surface of a carenage, or the plane of a plane family.
#[derive(Clone, Debug)]
pub enum FamilyShape {
    /// The original triangles of a carenage, continued across the wings' roots.
    Surface(TargetSurface),
    /// A point of the plane, and the plane's unit normal.
    Plane(DVec3, DVec3),
}

/// A shape for one vertex.
#[derive(Clone, Copy)]
pub struct ShapeAtVertex<'a> {
    pub(super) shape: &'a FamilyShape,
    /// Signed distance of the vertex from a plane, along the plane's normal, in the mesh's unit.
    pub(super) offset: f64,
}

impl ShapeAtVertex<'_> {
    /// The allowed point of the vertex nearest to `at`, in the mesh's unit.
    pub fn closest(&self, at: DVec3) -> DVec3 {
        match self.shape {
            FamilyShape::Surface(target) => target.closest(at).point,
            FamilyShape::Plane(point, normal) => at - *normal * (normal.dot(at - *point) - self.offset),
        }
    }

    /// [`Self::closest`] and its derivative by `at`.
    pub fn closest_change(&self, at: DVec3) -> (DVec3, DMat3) {
        match self.shape {
            FamilyShape::Surface(target) => target.closest_change(at),
            FamilyShape::Plane(_, normal) => (self.closest(at), DMat3::IDENTITY - outer(*normal, *normal)),
        }
    }

    /// Unit normal of the shape near `at`.
    pub fn normal(&self, at: DVec3) -> DVec3 {
        match self.shape {
            FamilyShape::Surface(target) => target.normal(&target.closest(at)),
            FamilyShape::Plane(_, normal) => *normal,
        }
    }

    /// The point where the line through `from` along a unit direction meets the allowed points of
    /// the vertex. The nearest allowed point if the line is nearly parallel to the shape.
    pub fn along(&self, from: DVec3, direction: DVec3) -> DVec3 {
        match self.shape {
            FamilyShape::Surface(target) => target.along(from, direction),
            FamilyShape::Plane(point, normal) => {
                let slope = normal.dot(direction);
                // As in `TargetSurface::along`: a line nearly parallel to the plane meets it too
                // far away.
                if slope.abs() < 0.2 {
                    self.closest(from)
                } else {
                    // A second projection, so that rounding does not leave the point off the plane.
                    self.closest(from - direction * ((normal.dot(from - *point) - self.offset) / slope))
                }
            }
        }
    }
}

/// The plane fitted to a family.
///
/// - `flat`: allowed distance of a vertex from the plane, as a fraction of the largest distance of
///   a vertex from their centre
///
/// # Errors
/// [`SetupError::NotPlane`]: a vertex lies farther off.
pub(super) fn fit_plane(
    mesh: &TetMesh,
    surface: &Surface,
    family: FamilyId,
    flat: Option<f64>,
) -> Result<FamilyShape, SetupError> {
    let vertices = surface.vertices_of(family);
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    let centre = vertices.iter().map(|&vertex| at(vertex)).sum::<DVec3>() / vertices.len().max(1) as f64;
    let area: DVec3 = surface.corners_of(family).map(|corners| triangle_normal(corners.map(at))).sum();
    let mut normal = area.normalize_or(DVec3::Y);
    // Rounding must not tilt a coordinate plane. Then "in the plane" can hold to the last bit.
    if let Some(axis) = DVec3::AXES.into_iter().find(|axis| axis.dot(normal).abs() > 1.0 - 1e-12) {
        normal = axis;
    }
    let off = |normal: DVec3| vertices.iter().map(|&vertex| normal.dot(at(vertex) - centre).abs()).fold(0.0, f64::max);
    // Noise must not tilt it either: a coordinate plane is taken if it fits about as well.
    let near =
        |axis: &DVec3| flat.is_some() && axis.cross(normal).length() < MOST_FLAT && off(*axis) <= 2.0 * off(normal);
    if let Some(axis) = DVec3::AXES.into_iter().find(near) {
        normal = axis;
    }
    let size = vertices.iter().map(|&vertex| at(vertex).distance(centre)).fold(0.0, f64::max);
    let distance = off(normal);
    let allowed = flat.unwrap_or(FLAT) * size;
    if distance > allowed {
        let family = mesh.families[family.index()].clone();
        return Err(SetupError::NotPlane { family, distance, allowed, least: rounded_up(distance / size) });
    }
    Ok(FamilyShape::Plane(centre, normal))
}

/// The smallest number with two digits that is not below `x > 0`.
fn rounded_up(x: f64) -> f64 {
    let digit = 10f64.powi(x.log10().floor() as i32 - 1);
    // The number is parsed from its two digits, as a case file holds it.
    let written = |count: f64| format!("{:.1e}", count * digit).parse::<f64>().unwrap_or(x);
    let count = (x / digit).ceil();
    if written(count) < x { written(count + 1.0) } else { written(count) }
}

/// The surface of a carenage: its triangles, and a patch over every hole under a wing.
///
/// # Errors
/// [`SetupError::Continuation`]: a hole cannot be closed.
pub(super) fn continued(
    mesh: &TetMesh,
    surface: &Surface,
    roles: &[Role],
    family: FamilyId,
) -> Result<FamilyShape, SetupError> {
    // The family's own vertices, in their order, so that a shape takes memory for its family alone.
    let vertices = surface.vertices_of(family);
    let number = |vertex: u32| vertices.partition_point(|&other| other < vertex) as u32;
    let own: Vec<[u32; 3]> = surface.corners_of(family).map(|corners| corners.map(number)).collect();
    let own_points: Vec<DVec3> = vertices.iter().map(|&vertex| mesh.vertices[vertex as usize]).collect();
    let (mut triangles, mut points) = (own.clone(), own_points.clone());
    for rim in surface.boundary_loops(family) {
        let under_a_wing = rim.iter().all(|&half_edge| {
            matches!(
                roles[surface.family_behind(half_edge).index()].placed_by(),
                PlacedBy::Wing | PlacedBy::TrailingEdge | PlacedBy::Attached | PlacedBy::Rigid | PlacedBy::Prescribed
            )
        });
        if under_a_wing {
            let rim: Vec<u32> = rim.iter().map(|&half_edge| number(surface.origin(half_edge))).collect();
            let patch = continuation::close(&own_points, &own, &rim)
                .map_err(|error| SetupError::Continuation { family: mesh.families[family.index()].clone(), error })?;
            let (old, new) = (own_points.len() as u32, points.len() as u32);
            points.extend(patch.points);
            triangles.extend(patch.triangles.into_iter().map(|t| t.map(|v| if v < old { v } else { v - old + new })));
        }
    }
    Ok(FamilyShape::Surface(TargetSurface::new(&points, triangles)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::half_face::HalfFaces;

    /// Each face of a tet is a carenage, in a mesh with many other vertices. A shape has the points
    /// of its own face alone, and projects on this face.
    #[test]
    fn a_shape_takes_memory_for_its_family_alone() {
        let mut vertices = vec![DVec3::splat(9.0); 1000];
        let corners = [10, 500, 700, 999];
        for (corner, at) in corners.into_iter().zip([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]) {
            vertices[corner as usize] = at;
        }
        let [a, b, c, d] = corners;
        let mesh = TetMesh {
            vertices,
            tets: vec![corners],
            triangles: vec![[a, b, c], [a, b, d], [a, c, d], [b, c, d]],
            triangle_family: (0..4).map(FamilyId).collect(),
            families: ["z", "y", "x", "slope"].map(str::to_owned).to_vec(),
        };
        let surface = Surface::new(&mesh, &HalfFaces::new(&mesh).unwrap()).unwrap();
        let at = DVec3::splat(0.25);
        let slope = at + DVec3::splat(0.25 / 3.0);
        for (family, expected) in [at.with_z(0.0), at.with_y(0.0), at.with_x(0.0), slope].into_iter().enumerate() {
            let shape = continued(&mesh, &surface, &[const { Role::Carenage }; 4], FamilyId(family as u16)).unwrap();
            let FamilyShape::Surface(target) = shape else { panic!("{family}") };
            assert_eq!(target.n_points(), 3);
            assert!(target.closest(at).point.distance(expected) < 1e-15, "{family}");
        }
    }

    #[test]
    fn numbers_are_rounded_up_to_two_digits() {
        for (x, up) in
            [(1.0, 1.0), (1.2e-5, 1.2e-5), (1.2000001e-5, 1.3e-5), (9.91e-4, 1e-3), (3.0e-7, 3e-7), (0.0999, 0.1)]
        {
            assert_eq!(rounded_up(x), up, "{x}");
        }
    }
}
