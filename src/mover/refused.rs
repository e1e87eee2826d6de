//! [`Refused`]: the faults of a moved mesh that may not be used.
//!
//! [`Outcome::check`] finds the faults. Its message names each fault, the stage in which it began,
//! its place, and a remedy.

use std::{collections::BTreeMap, fmt};

use glam::DVec3;
use thiserror::Error;

use super::{Beyond, MISSED, Moved, Outcome, StageName, warnings::counts};
use crate::geometry::triangle_normal;
use crate::mesh::TetMesh;
use crate::projection::crossing::crosses;
use crate::quality::faults::{self, Cluster};
use crate::text::figures::{Shortest, place};

/// The condition that a refused result does not meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// Vertices have no finite position.
    NotFinite,
    /// The mesh is not valid; see [`Outcome::is_valid`].
    Invalid,
    /// A relaxation did not reach its tolerance.
    NotConverged,
}

/// A result that may not be used.
#[derive(Clone, PartialEq, Eq, Error)]
#[error("{message}")]
#[non_exhaustive]
pub struct Refused {
    /// The condition that the result does not meet.
    pub why: Why,
    /// The faults with their places.
    pub message: String,
    /// A remedy to try.
    pub hint: Option<String>,
}

/// As a program prints an error that it returns from `main`: the faults, and what may help.
impl fmt::Debug for Refused {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.hint {
            Some(hint) => write!(f, "{self}; hint: {hint}"),
            None => write!(f, "{self}"),
        }
    }
}

impl Outcome {
    /// Returns the moved mesh, if it is finite and valid and every relaxation converged.
    ///
    /// # Errors
    /// As [`Outcome::check`].
    pub fn valid(&self) -> Result<&Moved, Refused> {
        self.check()?;
        Ok(&self.moved)
    }

    /// Checks that the moved mesh is finite and valid ([`Outcome::is_valid`]), and that every
    /// relaxation converged.
    ///
    /// # Errors
    /// The first of these conditions that does not hold, in the order of [`Why`].
    pub fn check(&self) -> Result<(), Refused> {
        let lost = self.moved.vertices.iter().filter(|vertex| !vertex.is_finite()).count();
        if lost > 0 {
            let message = format!("not converged: {lost} vertices have no finite position");
            return Err(Refused { why: Why::NotFinite, message, hint: None });
        }
        if !self.is_valid() {
            return Err(self.invalid());
        }
        if !self.found.converged {
            let message = self.not_converged();
            let hint = Some("raise max_sweeps or tolerance in [solver]".to_owned());
            return Err(Refused { why: Why::NotConverged, message, hint });
        }
        Ok(())
    }

    /// The faults of a mesh that is not valid: the stage in which they began, the place of the
    /// worst tet, and a remedy to try.
    fn invalid(&self) -> Refused {
        let mesh = self.mesh();
        let clusters = faults::clusters(&self.moved.vertices, &mesh.tets, &self.beta);
        let family = |cluster: &Cluster| {
            let triangle = faults::nearest_triangle(&self.moved.vertices, &mesh.tets, &mesh.triangles, cluster)?;
            Some(mesh.families[mesh.triangle_family[triangle as usize].index()].as_str())
        };
        let mut faults = Vec::new();
        if self.inverted > 0 {
            faults.push(format!("{} of {} tets are inverted", self.inverted, self.beta.len()));
        }
        if let Some(&first) = self.self_intersecting.first() {
            let mut by_family: BTreeMap<String, usize> = BTreeMap::new();
            for &triangle in &self.self_intersecting {
                *by_family
                    .entry(mesh.families[mesh.triangle_family[triangle as usize].index()].clone())
                    .or_default() += 1;
            }
            faults.push(format!(
                "the moved surface passes through itself ({}), first {}",
                counts(&by_family),
                passage(mesh, &self.moved.vertices, first)
            ));
        }
        if !self.off_surface.is_empty() {
            let off_surface: Vec<_> =
                self.off_surface.iter().map(|(name, by)| format!("{name} by {}", Shortest(short(*by)))).collect();
            faults.push(format!("vertices left the surface they slide on ({})", off_surface.join(", ")));
        }
        if !self.parted.is_empty() {
            let parted: Vec<_> =
                self.parted.iter().map(|(name, by)| format!("{name} by {}", Shortest(short(*by)))).collect();
            faults.push(format!(
                "partners in periodic planes are no longer apart by the same way ({})",
                parted.join(", ")
            ));
        }
        for held in &self.held_back {
            let Some(Beyond { distance, edge, at }) = held.beyond else { continue };
            faults.push(format!(
                "`{}` holds vertices of `{}` back by more than their shortest edge, at {} by {} where that is {}",
                held.by,
                held.family,
                short_place(at),
                Shortest(short(distance)),
                Shortest(short(edge))
            ));
        }
        for (wing, missed) in &self.missed {
            faults.push(format!(
                "the wing of `{wing}` misses its new profile {} by {:.2} % of the chord at {}, allowed is {} %",
                missed.profile,
                100.0 * missed.share,
                short_place(self.moved.vertices[missed.vertex]),
                100.0 * MISSED
            ));
        }
        let mut message = faults.join(", and ");
        if let Some(worst) = clusters.first() {
            let near = family(worst).map(|family| format!(" near `{family}`")).unwrap_or_default();
            message += &format!("; {}, the worst tet at {}{near}", places(clusters.len()), short_place(worst.at));
        }
        if self.inverted > 0 {
            message += &format!("; inverted by stage: {}", stages(self));
        }
        if let Some((stage, count)) = self.folds.first() {
            message += &format!("; triangles folded first by stage {stage}: {count}");
        }
        if self.path.reached > 0.0 && self.path.reached < 1.0 {
            message += &format!("; valid meshes lead up to {:.0} % of the motion", 100.0 * self.path.reached);
        }
        if !self.converged {
            message += &format!("; {}", self.not_converged());
        }
        Refused { why: Why::Invalid, message, hint: Some(hint(self)) }
    }

    /// The stages that did not converge, with the error that each left.
    fn not_converged(&self) -> String {
        let stages = self.unconverged.iter();
        let stages: Vec<_> =
            stages.map(|(stage, error)| format!("{stage} (about {error:.1e} of an edge left)")).collect();
        format!("not converged: {}", stages.join(", "))
    }
}

/// Describes a self-intersection: the triangle `first`, the first triangle that crosses it, and the
/// distance and angle between the two before the motion.
fn passage(mesh: &TetMesh, moved: &[DVec3], first: u32) -> String {
    let of =
        |vertices: &[DVec3], triangle: u32| mesh.triangles[triangle as usize].map(|vertex| vertices[vertex as usize]);
    let middle = |[a, b, c]: [DVec3; 3]| (a + b + c) / 3.0;
    let place = |triangle: u32| {
        let family = &mesh.families[mesh.triangle_family[triangle as usize].index()];
        format!("`{family}` at {}", short_place(middle(of(moved, triangle))))
    };
    let crossing = |other: &u32| crosses(moved, mesh.triangles[first as usize], mesh.triangles[*other as usize]);
    let Some(other) = (0..mesh.triangles.len() as u32).find(crossing) else { return place(first) };
    let [one, two] = [first, other].map(|triangle| of(&mesh.vertices, triangle));
    // Planes at a small angle mean a thin surface, whether the normals point the same way or
    // opposite ways.
    let angle = triangle_normal(one).angle_between(triangle_normal(two)).to_degrees();
    format!(
        "{} with {}, which were {} apart before, their planes at {:.0} degrees",
        place(first),
        place(other),
        Shortest(short(middle(one).distance(middle(two)))),
        angle.min(180.0 - angle)
    )
}

fn places(n: usize) -> String {
    if n == 1 { "in one place".to_owned() } else { format!("in {n} places") }
}

/// `deformed 20, corrected 24, final 3`: the inverted tets at each stage after the first.
fn stages(outcome: &Outcome) -> String {
    let name = |name| match name {
        StageName::Original => "original",
        StageName::Deformed => "deformed",
        StageName::Corrected => "corrected",
        StageName::Final => "final",
    };
    let moved = outcome.stages.iter().filter(|stage| stage.name != StageName::Original);
    moved.map(|stage| format!("{} {}", name(stage.name), stage.inverted)).collect::<Vec<_>>().join(", ")
}

fn hint(outcome: &Outcome) -> String {
    if outcome.held_back.iter().any(|held| held.beyond.is_some()) {
        return "give what holds them a role that lets them move, such as carenage or plane, or profiles that leave them \
                where they are"
            .to_owned();
    }
    if !outcome.converged {
        return "the relaxation did not converge either: raise max_sweeps or tolerance in [solver] first".to_owned();
    }
    if !outcome.self_intersecting.is_empty() {
        let suspect = match &outcome.nearest_to_refusal {
            Some((wing, closeness)) => format!("; of the profiles of `{wing}` {closeness}"),
            None => String::new(),
        };
        return format!(
            "no volume fits a surface that passes through itself: correct its profiles or displacements first{suspect}"
        );
    }
    if !outcome.parted.is_empty() {
        return "partners that a design prescribes must move alike: correct their displacements first".to_owned();
    }
    if !outcome.folded.is_empty() {
        return format!(
            "the moved surface itself is folded ({}), and no volume fits it: correct its profiles or displacements first",
            counts(&outcome.folded)
        );
    }
    if outcome.inverted == 0 && !outcome.missed.is_empty() {
        return "a family that holds the wing back, or a change too uneven along the span for these profiles: give more of \
                them there"
            .to_owned();
    }
    if !outcome.optimises {
        return "target = \"original\" in [quality] repairs tets; a smaller change of the surface keeps more of them valid"
            .to_owned();
    }
    "a smaller change of the surface, or the same in another place, keeps more tets valid".to_owned()
}

fn short_place(at: DVec3) -> String {
    place(at.map(short))
}

/// A coordinate with six significant digits, without trailing zeros.
fn short(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_short() {
        assert_eq!(short(1.0 / 3.0).to_string(), "0.333333");
        assert_eq!(short(1.5).to_string(), "1.5");
    }
}
