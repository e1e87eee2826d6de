//! The derivative of [`Families::settle_along`].

use glam::{DMat3, DVec3};

use super::Families;
use super::shape::{FamilyShape, ShapeAtVertex};
use crate::geometry::rotation_vectors::outer;

impl ShapeAtVertex<'_> {
    /// The derivatives of [`Self::along`] by `from` and by `direction`. `None` where the point does
    /// not follow them smoothly.
    fn along_change(&self, from: DVec3, direction: DVec3) -> Option<(DMat3, DMat3)> {
        let to = self.along(from, direction);
        match self.shape {
            FamilyShape::Surface(target) => target.along_change(from, direction, to),
            FamilyShape::Plane(_, normal) => {
                let (closest, change) = self.closest_change(from);
                let slope = normal.dot(direction);
                // As in `along`: a line nearly parallel to the plane does not count.
                if to == closest && slope.abs() < 0.2 {
                    return Some((change, DMat3::ZERO));
                }
                let change = DMat3::IDENTITY - outer(direction, *normal) * (1.0 / slope);
                Some((change, change * (to - from).dot(direction)))
            }
        }
    }
}

impl Families {
    /// The derivatives of [`Self::settle_along`] by `at` and by `direction`. `None` where the point
    /// does not follow them smoothly. On an edge of a surface, as at rest, they are those of the
    /// plane across the smooth normal.
    pub fn settle_along_change(&self, vertex: u32, at: DVec3, direction: Option<DVec3>) -> Option<(DMat3, DMat3)> {
        let mut shapes = self.shapes_at(vertex);
        match (shapes.next(), shapes.next(), direction) {
            (Some(shape), None, Some(direction)) => shape.along_change(at, direction),
            _ => Some((self.settle_change(vertex, at), DMat3::ZERO)),
        }
    }
}
