//! The derivative of [`Families::settle_along`].

use glam::{DMat3, DVec3};

use super::Families;
use super::shape::{FamilyShape, ShapeAtVertex};
use crate::geometry::rotation_vectors::outer;

impl ShapeAtVertex<'_> {
    /// [`Self::closest`], and its derivative by `at`.
    fn closest_change(&self, at: DVec3) -> (DVec3, DMat3) {
        match self.shape {
            FamilyShape::Surface(target) => {
                let on = target.closest(at);
                (on.point, target.projector(at, &on))
            }
            FamilyShape::Plane(_, normal) => (self.closest(at), DMat3::IDENTITY - outer(*normal, *normal)),
        }
    }

    /// The derivatives of [`Self::along`] by `from` and by `direction`. `None` where the point does
    /// not follow them smoothly.
    fn along_change(&self, from: DVec3, direction: DVec3) -> Option<(DMat3, DMat3)> {
        let to = self.along(from, direction);
        match self.shape {
            FamilyShape::Surface(target) => target.along_change(from, direction, to),
            FamilyShape::Plane(_, normal) => {
                let slope = normal.dot(direction);
                let closest = self.closest(from);
                if to == closest && slope.abs() < 0.2 {
                    return Some((DMat3::IDENTITY - outer(*normal, *normal), DMat3::ZERO));
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
        let shapes: Vec<ShapeAtVertex> = self.shapes_at(vertex).collect();
        match (&shapes[..], direction) {
            ([], _) => Some((DMat3::IDENTITY, DMat3::ZERO)),
            ([shape], Some(direction)) => shape.along_change(at, direction),
            ([shape], None) => Some((shape.closest_change(at).1, DMat3::ZERO)),
            (several, _) => {
                let (mut at, mut change) = (at, DMat3::IDENTITY);
                for _ in 0..100 {
                    let before = (at, change);
                    for shape in several {
                        let (closest, of_shape) = shape.closest_change(at);
                        (at, change) = (closest, of_shape * change);
                    }
                    // A vertex in its place may have a change that is not in its place yet.
                    if (at, change) == before {
                        break;
                    }
                }
                Some((change, DMat3::ZERO))
            }
        }
    }
}
