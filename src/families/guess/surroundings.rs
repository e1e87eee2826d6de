//! The surroundings: families inside the volume, planes around the mesh, and the far boundary.

use glam::DVec3;

use super::words::Named;
use super::{Certainty, Guesser};
use crate::families::misplaced::FAR;
use crate::families::shape::{FamilyShape, fit_plane};
use crate::families::{Role, SetupError};
use crate::geometry::triangle_normal;
use crate::mesh::FamilyId;

/// A family this far off its plane, as a share of its size, may be a plane with noise.
const NOISE: f64 = 5e-3;

/// A plane family named so may have this much more noise.
const NAMED_NOISE: f64 = 5e-2;

/// A plane around the mesh.
#[derive(Clone, Copy)]
struct Around {
    flat: Option<f64>,
}

impl Guesser<'_> {
    /// Families inside the volume, planes around the mesh, and the far boundary.
    pub(super) fn guess_surroundings(&mut self) {
        for family in 0..self.n_families() {
            if self.known.inside[family] {
                self.set(family, Role::Interior, Certainty::Sure, "its faces lie inside the volume, between two cells");
            } else if self.surface.vertices_of(FamilyId(family as u16)).is_empty() {
                self.set(family, Role::Fixed, Certainty::Sure, "it has no faces");
            }
        }
        let may_be = |family: usize| self.is_open(family) && !self.known.wing.contains(&FamilyId(family as u16));
        let plane = |family: usize| if may_be(family) { self.plane_around(family) } else { None };
        let planes: Vec<Option<Around>> = (0..self.n_families()).map(plane).collect();
        let bodies_or_far: Vec<bool> =
            (0..self.n_families()).map(|family| self.is_open(family) && planes[family].is_none()).collect();
        for part in self.parts(|_, family| bodies_or_far[family]) {
            let sides_of_part = self.sides(&part);
            for &family in &part {
                let sides = self.sides(&[family]);
                let is_named = self.says(family, Named::Far);
                let reason = match (sides, sides_of_part) {
                    _ if self.known.wing.contains(&FamilyId(family as u16)) => continue,
                    (6, _) => "the far boundary: it reaches all six sides of the mesh's box".to_owned(),
                    (own, _) if own >= FAR => {
                        format!("the far boundary: it reaches {own} of the six sides of the mesh's box")
                    }
                    // A body that ends in one side of the box, which the far boundary holds.
                    _ if self.is_body_at_side(family, &part, sides_of_part) => continue,
                    (own, all) if own > 0 && all >= FAR => {
                        format!("a part of the far boundary, which reaches {all} of the six sides of the mesh's box")
                    }
                    _ if is_named => format!("its name says {}", self.word(family)),
                    _ => continue,
                };
                // What moves may end at a far boundary that stays, but then it is held back there.
                let is_body = |other: &usize| {
                    let ends_here = || part.contains(other) && self.is_body_at_side(*other, &part, sides_of_part);
                    bodies_or_far[*other] && (self.sides(&[*other]) == 0 || ends_here())
                };
                let body = self.neighbours[family].iter().copied().find(is_body);
                let (certainty, but) = match body {
                    Some(body) => {
                        let body = self.name(body);
                        (Certainty::Doubtful, format!("; but {body} ends in it, as in a plane of symmetry"))
                    }
                    None if is_named => (Certainty::Sure, String::new()),
                    None => (Certainty::Likely, String::new()),
                };
                self.set(family, Role::Fixed, certainty, reason + &but);
            }
        }
        for (family, plane) in planes.iter().enumerate() {
            let Some(Around { flat }) = *plane else { continue };
            let touches = |other: &usize| planes[*other].is_none() && self.guesses[*other].is_none();
            let body = self.neighbours[family].iter().copied().find(touches);
            let is_named =
                self.says(family, Named::Plane) || self.known.planes_of_file.contains(&FamilyId(family as u16));
            let noise = match flat {
                None => "flat".to_owned(),
                Some(flat) => format!("flat to {flat:e} of its size"),
            };
            let leaves = if flat.is_some() { self.share_off(family) } else { 0.0 };
            let (is_plane, why) = match body {
                Some(body) => (true, format!("it touches {}", self.name(body))),
                None if is_named => (true, "it is called a plane".to_owned()),
                None => (false, "it touches nothing that moves".to_owned()),
            };
            let certainty = match (is_plane, is_named, flat) {
                _ if is_plane && leaves > 0.0 => Certainty::Doubtful,
                (true, true, _) | (true, _, None) => Certainty::Sure,
                (true, ..) => Certainty::Doubtful,
                (false, ..) => Certainty::Likely,
            };
            let role = if is_plane { Role::Plane { flat, partner: None } } else { Role::Fixed };
            let but = match is_plane && leaves > 0.0 {
                true => format!(
                    "; but {:.1} % of its faces turn away from the plane: it may hold a body too, which needs a family of its own",
                    100.0 * leaves
                ),
                false => String::new(),
            };
            self.set(family, role, certainty, format!("{noise}, on a side of the mesh, and {why}{but}"));
        }
    }

    /// Whether a family of a part that holds the far boundary is none of it: it ends in one side of
    /// the box, and the others reach all sides of the part without it.
    fn is_body_at_side(&self, family: usize, part: &[usize], sides_of_part: usize) -> bool {
        let others: Vec<usize> = part.iter().copied().filter(|&other| other != family).collect();
        sides_of_part >= FAR
            && !self.says(family, Named::Far)
            && self.sides(&[family]) == 1
            && self.sides(&others) == sides_of_part
    }

    /// Share of a family's faces, by number, that stand on the plane fitted to the family more than
    /// they lie in it. The faces of a plane with noise do not.
    fn share_off(&self, family: usize) -> f64 {
        let triangles = self.surface.corners_of(FamilyId(family as u16));
        let normals: Vec<DVec3> =
            triangles.map(|corners| triangle_normal(corners.map(|v| self.mesh.vertices()[v as usize]))).collect();
        let mean = normals.iter().copied().sum::<DVec3>().normalize_or_zero();
        let off = normals.iter().filter(|normal| normal.dot(mean) < 0.7 * normal.length()).count();
        off as f64 / normals.len().max(1) as f64
    }

    /// The plane of a family that bounds the whole mesh on one side.
    fn plane_around(&self, family: usize) -> Option<Around> {
        let id = FamilyId(family as u16);
        let is_named = self.says(family, Named::Plane) || self.known.planes_of_file.contains(&id);
        let fit = |flat| fit_plane(self.mesh.mesh, self.surface, id, flat);
        let (shape, flat) = match fit(None) {
            Ok(shape) => (shape, None),
            Err(SetupError::NotPlane { least, .. }) if least <= if is_named { NAMED_NOISE } else { NOISE } => {
                (fit(Some(least)).ok()?, Some(least))
            }
            Err(_) => return None,
        };
        let FamilyShape::Plane(point, normal) = shape else { return None };
        let size = self.points(family).map(|at| at.distance(point)).fold(0.0, f64::max);
        let near = 2.0 * flat.unwrap_or(1e-6) * size;
        let (mut low, mut high): (f64, f64) = (0.0, 0.0);
        for &vertex in self.surface.vertices() {
            let distance = normal.dot(self.mesh.vertices()[vertex as usize] - point);
            (low, high) = (low.min(distance), high.max(distance));
            if low < -near && high > near {
                return None;
            }
        }
        // A surface that is thin itself, such as a sheet, has all its vertices near every plane.
        (high - low > 4.0 * near).then_some(Around { flat })
    }
}
