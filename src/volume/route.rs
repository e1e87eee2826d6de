//! Route of the moved surfaces from their original places to their new places.
//!
//! A design gives the end of the motion only. A straight route would shrink a body that turns:
//! half-way through half a turn its chord would vanish. So each moved body follows a screw: a
//! rotation about one axis and a translation along the axis, taken from the body's best rigid
//! motion. Families of wings, trailing edges and wingtips that touch form one body. Each rigid
//! family is a body of its own, and so are the attached families of an assembly. The rest of the
//! body's motion grows in proportion to the progress, in the body's own frame. Vertices of
//! carenages and planes go straight. Vertices on carenages or planes are put back on them at each
//! step. So are the vertices of a rigid body that slide on it ([`OnBody`]), in the body's own
//! frame.
//!
//! A rotation is known up to full turns only. The route takes the shorter way, at most half a turn.
//! The paper moves in one step.

use std::collections::{BTreeSet, HashMap};
use std::f64::consts::PI;

use glam::{DQuat, DVec3};

use crate::families::Families;
use crate::families::PlacedBy;
use crate::geometry::fitted_motion::FittedMotion;
use crate::mesh::Displacement;
use crate::mesh::{FamilyId, TetMesh};
use crate::projection::curved::{CurvedSurface, Start};
use crate::stage::SetUp;

/// A rotation by a smaller angle, in radians, is followed as a translation. Its axis is too far
/// away to be computed, and the two ways differ by less than 1e-6 of the distance.
const LEAST_TURN: f64 = 1e-5;

/// The bodies of a mesh. Made once per mesh.
pub struct Bodies {
    /// Vertices of each body, ascending.
    bodies: Vec<Vec<u32>>,
    /// Vertices of carenages and planes.
    others: Vec<u32>,
    on_bodies: Vec<OnBody>,
    /// The vertices of `on_bodies`, each with the place of its surface there.
    sliding: HashMap<u32, (usize, Start)>,
}

/// Vertices that may slide on the surface of a rigid body.
pub struct OnBody {
    /// The undeformed surface, in the mesh's unit.
    pub surface: CurvedSurface,
    /// The vertices, in the mover's order, each with its undeformed place on the surface.
    pub vertices: Vec<(u32, Start)>,
}

impl Bodies {
    /// Groups the moved families that touch into bodies.
    pub fn new(set_up: &SetUp) -> Self {
        let SetUp { surface, families, .. } = *set_up;
        let is_body = |placed_by: PlacedBy| {
            matches!(placed_by, PlacedBy::Prescribed | PlacedBy::Wing | PlacedBy::TrailingEdge | PlacedBy::Attached)
        };
        let hung: BTreeSet<FamilyId> = families.hung().flat_map(|assembly| &assembly.families).copied().collect();
        let mut bodies: Vec<Vec<u32>> = Vec::new();
        for index in 0..families.roles.len() {
            if !is_body(families.roles[index].placed_by()) || hung.contains(&FamilyId(index as u16)) {
                continue;
            }
            let own = |vertex: &u32| is_body(families.placed_by[*vertex as usize]);
            let mut body: Vec<u32> = surface.vertices_of(FamilyId(index as u16)).iter().copied().filter(own).collect();
            // A family joins the bodies with which it shares a vertex.
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
        for assembly in families.hung() {
            let placed = |family: FamilyId, by: PlacedBy| {
                let own = assembly.vertices_of(surface, family);
                own.filter(move |&vertex| families.placed_by[vertex as usize] == by)
            };
            let rigid = assembly.families.iter().map(|&family| placed(family, PlacedBy::Rigid).collect());
            let attached = assembly.families.iter().flat_map(|&family| placed(family, PlacedBy::Attached));
            let attached: BTreeSet<u32> = attached.collect();
            bodies.extend(rigid.chain([attached.into_iter().collect()]).filter(|body: &Vec<u32>| !body.is_empty()));
        }
        let others = (0..families.placed_by.len() as u32)
            .filter(|&vertex| matches!(families.placed_by[vertex as usize], PlacedBy::Carenage | PlacedBy::Plane))
            .collect();
        Self { bodies, others, on_bodies: Vec::new(), sliding: HashMap::new() }
    }

    /// Lets vertices slide on rigid bodies.
    pub fn let_slide(&mut self, on_bodies: Vec<OnBody>) {
        let numbered = on_bodies.iter().enumerate();
        let vertices =
            numbered.flat_map(|(place, on)| on.vertices.iter().map(move |&(vertex, at)| (vertex, (place, at))));
        self.sliding = vertices.collect();
        self.on_bodies = on_bodies;
    }

    /// The place of a vertex in the frame of its body: on the body's surface, if it slides there.
    fn on_body(&self, vertex: u32, at: DVec3) -> DVec3 {
        let Some(&(on, start)) = self.sliding.get(&vertex) else { return at };
        self.on_bodies[on].surface.beside(start, at).foot
    }

    /// The route of the surfaces.
    ///
    /// - `displacement` `[n_vertices]`: displacement of the surfaces at the end, in the mesh's unit
    pub fn route<'a>(&'a self, mesh: &'a TetMesh, families: &'a Families, displacement: &'a Displacement) -> Route<'a> {
        let screws = self.bodies.iter().map(|body| {
            let pair = |&vertex: &u32| {
                let from = mesh.vertices[vertex as usize];
                (from, from + displacement[vertex as usize], 1.0)
            };
            // Vertices that slide on a body do not tell its motion.
            let mut pairs: Vec<(DVec3, DVec3, f64)> =
                body.iter().filter(|vertex| !self.sliding.contains_key(vertex)).map(pair).collect();
            if pairs.len() < 3 {
                pairs = body.iter().map(pair).collect();
            }
            Screw::new(&FittedMotion::rigid(&pairs))
        });
        Route { screws: screws.collect(), bodies: self, mesh, families, displacement }
    }
}

/// The route of the surfaces for one design.
pub struct Route<'a> {
    screws: Vec<Screw>,
    bodies: &'a Bodies,
    mesh: &'a TetMesh,
    families: &'a Families,
    displacement: &'a Displacement,
}

impl Route<'_> {
    /// Largest angle by which a body turns, in radians.
    pub fn largest_turn(&self) -> f64 {
        self.screws.iter().map(|screw| screw.angle).fold(0.0, f64::max)
    }

    /// Displacement of every surface vertex from its original place `[n_vertices]`, in the mesh's
    /// unit; zero for inner vertices.
    ///
    /// - `progress`: 0 at the start, 1 at the end, where the displacement has the bits of the
    ///   design's
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
                let own = from + progress * beyond;
                place(vertex, screw.at(progress, self.bodies.on_body(vertex, own)) - from);
            }
        }
        for &vertex in &self.bodies.others {
            place(vertex, progress * self.displacement[vertex as usize]);
        }
        now
    }
}

/// A rigid motion as a screw: one rotation about an axis and a translation along the axis.
struct Screw {
    axis: DVec3,
    /// Angle in radians, 0 to pi.
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
        // The rotation and the translation across the axis leave this point in its place.
        let hinge = from + 0.5 * (across + axis.cross(across) / (0.5 * angle).tan());
        Self { axis, angle, hinge, travel: along }
    }

    fn at(&self, progress: f64, point: DVec3) -> DVec3 {
        let turn = DQuat::from_axis_angle(self.axis, progress * self.angle);
        self.hinge + turn * (point - self.hinge) + progress * self.travel
    }

    /// The preimage of a point under the whole motion.
    fn back(&self, point: DVec3) -> DVec3 {
        let turn = DQuat::from_axis_angle(self.axis, -self.angle);
        self.hinge + turn * (point - self.travel - self.hinge)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half-way round a cylinder a vertex that slides is on the cylinder; the chord is 0.08 off.
    #[test]
    fn a_vertex_slides_on_its_body() {
        let (around, step) = (17u32, 0.05);
        let at = |i: u32, j: u32| {
            let angle = step * f64::from(i);
            DVec3::new(angle.cos(), angle.sin(), step * f64::from(j))
        };
        let points: Vec<DVec3> = (0..3).flat_map(|j| (0..around).map(move |i| at(i, j))).collect();
        let number = |i: u32, j: u32| j * around + i;
        let cells = (0..2).flat_map(|j| (0..around - 1).map(move |i| (i, j)));
        let triangles = cells.flat_map(|(i, j)| {
            let [a, b, c, d] = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
            [[a, b, c], [a, c, d]]
        });
        let surface = CurvedSurface::new(points, triangles.collect(), &[]).unwrap();
        let vertices = vec![(7, surface.start_at(number(0, 1)).unwrap())];
        let mut bodies =
            Bodies { bodies: Vec::new(), others: Vec::new(), on_bodies: Vec::new(), sliding: HashMap::new() };
        bodies.let_slide(vec![OnBody { surface, vertices }]);
        let (from, to) = (at(0, 1), at(16, 1));
        for (progress, angle) in [(0.0, 0.0), (0.5, 0.4_f64), (1.0, 0.8)] {
            let place = bodies.on_body(7, from.lerp(to, progress));
            let off = (place.x.hypot(place.y) - 1.0).abs();
            let turned = place.y.atan2(place.x) - angle;
            assert!(off < 1e-4 && turned.abs() < 0.1 * step && (place.z - step).abs() < 1e-12, "{progress}: {place}");
        }
        assert_eq!(bodies.on_body(8, from), from);
    }

    /// A quarter turn about a hinge with a travel along it: half-way is an eighth of a turn and
    /// half the travel.
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
