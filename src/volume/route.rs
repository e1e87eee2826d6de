//! The way of the moved surfaces from their original places to their new ones.
//!
//! A design says where the surfaces end, not how they get there. The straight way would shrink a body that turns: half-way
//! through half a turn it has no chord left. So the best rigid motion of each moved body (wing, trailing edge and wingtip
//! families that hang together are one) is followed as a screw, turning about one axis and travelling along it, and what
//! the body does beyond it grows in proportion, in the body's own frame. Carenage and plane vertices go straight, and
//! everything that has to lie on a carenage or plane is brought back onto it on the way.
//!
//! A rotation is known up to full turns only: the way is the shorter one, at most half a turn. The paper moves in one step.

use std::f64::consts::PI;

use glam::{DQuat, DVec3};

use crate::families::Families;
use crate::families::PlacedBy;
use crate::geometry::fitted_motion::FittedMotion;
use crate::mesh::Displacement;
use crate::mesh::{FamilyId, TetMesh};
use crate::stage::SetUp;

/// A rotation by less than this, in radians, is followed as a translation: its axis is too far away to be found, and
/// the two ways differ by less than 1e-6 of the distance.
const LEAST_TURN: f64 = 1e-5;

/// The bodies of a mesh. Made once per mesh.
pub struct Bodies {
    /// The vertices of each body, ascending.
    bodies: Vec<Vec<u32>>,
    /// The carenage and plane vertices.
    others: Vec<u32>,
}

impl Bodies {
    /// Finds the moved families that hang together.
    pub fn new(set_up: &SetUp) -> Self {
        let SetUp { surface, families, .. } = *set_up;
        let is_body = |placed_by: PlacedBy| {
            matches!(placed_by, PlacedBy::Prescribed | PlacedBy::Wing | PlacedBy::TrailingEdge | PlacedBy::Wingtip)
        };
        let mut bodies: Vec<Vec<u32>> = Vec::new();
        for index in 0..families.roles.len() {
            if !is_body(families.roles[index].placed_by()) {
                continue;
            }
            let own = |vertex: &u32| is_body(families.placed_by[*vertex as usize]);
            let mut body: Vec<u32> = surface.vertices_of(FamilyId(index as u16)).iter().copied().filter(own).collect();
            // Those it shares a vertex with become one with it.
            bodies.retain_mut(|other| {
                let joined = other.iter().any(|vertex| body.binary_search(vertex).is_ok());
                if joined {
                    body.append(other);
                    body.sort_unstable();
                    body.dedup();
                }
                !joined
            });
            bodies.push(body);
        }
        let others = (0..families.placed_by.len() as u32)
            .filter(|&vertex| matches!(families.placed_by[vertex as usize], PlacedBy::Carenage | PlacedBy::Plane))
            .collect();
        Self { bodies, others }
    }

    /// The way of the surfaces to where `displacement` `[n_vertices]` takes them.
    pub fn route<'a>(&'a self, mesh: &'a TetMesh, families: &'a Families, displacement: &'a Displacement) -> Route<'a> {
        let screws = self.bodies.iter().map(|body| {
            let pairs: Vec<(DVec3, DVec3, f64)> = body
                .iter()
                .map(|&vertex| {
                    let from = mesh.vertices[vertex as usize];
                    (from, from + displacement[vertex as usize], 1.0)
                })
                .collect();
            Screw::new(&FittedMotion::rigid(&pairs))
        });
        Route { screws: screws.collect(), bodies: self, mesh, families, displacement }
    }
}

/// The way of one design's surfaces.
pub struct Route<'a> {
    screws: Vec<Screw>,
    bodies: &'a Bodies,
    mesh: &'a TetMesh,
    families: &'a Families,
    displacement: &'a Displacement,
}

impl Route<'_> {
    /// Largest angle a body turns by, in radians.
    pub fn largest_turn(&self) -> f64 {
        self.screws.iter().map(|screw| screw.angle).fold(0.0, f64::max)
    }

    /// Displacement of every surface vertex from its original place at `progress` in `0..=1` of the way; zero inside.
    ///
    /// At 1 it is the design's to the bit.
    pub fn at(&self, progress: f64) -> Displacement {
        let mut now = vec![DVec3::ZERO; self.displacement.len()];
        let mut place = |vertex: u32, displacement: DVec3| {
            let (from, whole) = (self.mesh.vertices[vertex as usize], self.displacement[vertex as usize]);
            now[vertex as usize] = if progress >= 1.0 || whole == DVec3::ZERO {
                whole
            } else {
                self.families.settle(vertex, from + displacement) - from
            };
        };
        for (body, screw) in self.bodies.bodies.iter().zip(&self.screws) {
            for &vertex in body {
                let from = self.mesh.vertices[vertex as usize];
                let beyond = screw.back(from + self.displacement[vertex as usize]) - from;
                place(vertex, screw.at(progress, from + progress * beyond) - from);
            }
        }
        for &vertex in &self.bodies.others {
            place(vertex, progress * self.displacement[vertex as usize]);
        }
        now
    }
}

/// A rigid motion as one turn about an axis and a travel along it.
struct Screw {
    axis: DVec3,
    /// 0 to pi.
    angle: f64,
    /// A point of the axis.
    hinge: DVec3,
    travel: DVec3,
}

impl Screw {
    fn new(displacement: &FittedMotion) -> Self {
        let (axis, angle) = displacement.rotation().to_axis_angle();
        let (axis, angle) = if angle > PI { (-axis, 2.0 * PI - angle) } else { (axis, angle) };
        let (from, to) = displacement.centres();
        let shift = to - from;
        if angle < LEAST_TURN {
            return Self { axis, angle: 0.0, hinge: from, travel: shift };
        }
        let along = axis * axis.dot(shift);
        let across = shift - along;
        // The point that the turn and the travel across the axis leave where it is.
        let hinge = from + 0.5 * (across + axis.cross(across) / (0.5 * angle).tan());
        Self { axis, angle, hinge, travel: along }
    }

    fn at(&self, progress: f64, point: DVec3) -> DVec3 {
        let turn = DQuat::from_axis_angle(self.axis, progress * self.angle);
        self.hinge + turn * (point - self.hinge) + progress * self.travel
    }

    /// Where the whole motion takes a point from.
    fn back(&self, point: DVec3) -> DVec3 {
        let turn = DQuat::from_axis_angle(self.axis, -self.angle);
        self.hinge + turn * (point - self.travel - self.hinge)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter turn about a hinge with a travel along it: half-way is an eighth of a turn and half the travel.
    ///
    /// Fails if `LEAST_TURN` is 1.
    #[test]
    fn a_screw_is_followed_about_its_hinge() {
        let hinge = DVec3::new(2.0, 0.0, -1.0);
        let turn = |p: DVec3, angle: f64| hinge + DQuat::from_rotation_y(angle) * (p - hinge);
        let points = [[0.0, 0.0, 0.0], [1.0, 0.5, 0.0], [0.0, 2.0, 0.3], [0.5, 0.5, 1.0]].map(DVec3::from);
        for angle in [0.5 * PI, 0.999 * PI, -0.3, 1e-3] {
            let pairs: Vec<_> = points.iter().map(|&p| (p, turn(p, angle) + 0.4 * DVec3::Y, 1.0)).collect();
            let screw = Screw::new(&FittedMotion::rigid(&pairs));
            for p in points {
                assert!(screw.at(0.5, p).distance(turn(p, 0.5 * angle) + 0.2 * DVec3::Y) < 1e-9, "{angle}");
                assert!(screw.at(1.0, p).distance(turn(p, angle) + 0.4 * DVec3::Y) < 1e-9, "{angle}");
                assert!(screw.back(screw.at(1.0, p)).distance(p) < 1e-9, "{angle}");
            }
        }
    }

    /// Fails if `LEAST_TURN` is 0.
    #[test]
    fn a_translation_is_followed_straight() {
        let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let pairs: Vec<_> = points.iter().map(|&p| (p, p + DVec3::new(3.0, -1.0, 2.0), 1.0)).collect();
        let screw = Screw::new(&FittedMotion::rigid(&pairs));
        assert!(screw.at(0.5, DVec3::X).distance(DVec3::new(2.5, -0.5, 1.0)) < 1e-12);
    }
}
