//! The surroundings: families inside the volume, planes around the mesh, and the far boundary.

use super::words::Named;
use super::{Certainty, Guesser};
use crate::families::misplaced::FAR;
use crate::families::shape::{FamilyShape, fit_plane};
use crate::families::{Role, SetupError};
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
                    (own, all) if own > 0 && all >= FAR => {
                        format!("a part of the far boundary, which reaches {all} of the six sides of the mesh's box")
                    }
                    _ if is_named => format!("its name says {}", self.word(family)),
                    _ => continue,
                };
                // What moves may end at a far boundary that stays, but then it is held back there.
                let is_inside = |other: &usize| bodies_or_far[*other] && self.sides(&[*other]) == 0;
                let certainty = match (is_named, self.neighbours[family].iter().any(is_inside)) {
                    (_, true) => Certainty::Doubtful,
                    (true, _) => Certainty::Sure,
                    _ => Certainty::Likely,
                };
                self.set(family, Role::Fixed, certainty, reason);
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
            let (is_plane, why) = match body {
                Some(body) => (true, format!("it touches {}", self.name(body))),
                None if is_named => (true, "it is called a plane".to_owned()),
                None => (false, "it touches nothing that moves".to_owned()),
            };
            let certainty = match (is_plane, is_named, flat) {
                (true, true, _) | (true, _, None) => Certainty::Sure,
                (true, ..) => Certainty::Doubtful,
                (false, ..) => Certainty::Likely,
            };
            let role = if is_plane { Role::Plane { flat, partner: None } } else { Role::Fixed };
            self.set(family, role, certainty, format!("{noise}, on a side of the mesh, and {why}"));
        }
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
