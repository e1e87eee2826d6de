//! What an [`Outcome`](super::Outcome) says of the moved mesh: how true its surfaces are, and what is wrong with them.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use super::{Design, MISSED, Mover};
use crate::{
    mesh::FamilyId,
    profile::{Missed, Plane, ProfileError, cut, distance},
    relaxation::Convergence,
    report::{FamilyReport, ProfileReport, Solver},
    stages::families::Shape,
};

/// A vertex is off its carenage or plane beyond this fraction of the family's size: what a plane family may deviate from
/// one in the first place.
const STRAYED: f64 = 1e-6;

impl Mover {
    pub(super) fn solver_report(&self, volume: &Convergence) -> Solver {
        Solver {
            method: self.interior.method().name().to_owned(),
            sweeps: volume.sweeps,
            relative_residual: volume.relative_residual,
        }
    }

    /// The carenages and planes that vertices left, by name, with their largest distance.
    pub(super) fn strayed(&self, families: &BTreeMap<String, FamilyReport>) -> BTreeMap<String, f64> {
        let size = |name: &str| {
            let family = self.mesh.family(name).expect("reports are by the mesh's families");
            let at = |vertex: u32| self.ordered.vertices[vertex as usize];
            let vertices = self.surface.vertices_of(family);
            let low = vertices.iter().map(|&vertex| at(vertex)).reduce(DVec3::min);
            let high = vertices.iter().map(|&vertex| at(vertex)).reduce(DVec3::max);
            low.zip(high).map_or(0.0, |(low, high)| low.distance(high))
        };
        let strayed = families.iter().filter_map(|(name, report)| {
            let distance = report.max_distance_to_original_surface.or(report.max_distance_to_plane)?;
            (distance.is_nan() || distance > STRAYED * size(name)).then(|| (name.clone(), distance))
        });
        strayed.collect()
    }

    pub(super) fn family_reports(
        &self,
        vertices: &[DVec3],
        folded: &BTreeMap<String, usize>,
        pierced: &[u32],
    ) -> BTreeMap<String, FamilyReport> {
        let reports = self.families.shapes.iter().enumerate().filter_map(|(index, shape)| {
            let shape = shape.as_ref()?;
            let distance = self
                .surface
                .vertices_of(FamilyId(index as u16))
                .par_iter()
                .map(|&vertex| shape.closest(vertices[vertex as usize]).distance(vertices[vertex as usize]))
                .reduce(|| 0.0, f64::max);
            let report = match shape {
                Shape::Surface(_) => {
                    FamilyReport { max_distance_to_original_surface: Some(distance), ..FamilyReport::default() }
                }
                Shape::Plane(..) => FamilyReport { max_distance_to_plane: Some(distance), ..FamilyReport::default() },
            };
            Some((self.mesh.families[index].clone(), report))
        });
        let mut reports: BTreeMap<_, _> = reports.collect();
        for (family, &count) in folded {
            reports.entry(family.clone()).or_default().folded_triangles = count;
        }
        for &triangle in pierced {
            let family = &self.mesh.families[self.surface.family[triangle as usize].index()];
            reports.entry(family.clone()).or_default().pierced_triangles += 1;
        }
        reports
    }

    /// How true the moved wings are to their new profiles, by the name of the wing and of each of its families.
    ///
    /// - `missed`: the worst vertex of each profile, by wing
    pub(super) fn profile_reports(
        &self,
        vertices: &[DVec3],
        design: &Design,
        missed: &BTreeMap<String, Vec<Missed>>,
    ) -> BTreeMap<String, ProfileReport> {
        let mut reports = BTreeMap::new();
        for (wing, families) in &self.wing_families {
            let Some(new) = design.profiles.get(wing) else { continue };
            let corners = families.iter().flat_map(|&family| self.surface.corners_of(family));
            let triangles: Vec<[u32; 3]> = corners.collect();
            let furthest = new
                .iter()
                .map(|new| {
                    let section = cut::cut(vertices, &triangles, &Plane::of_profile(new)?)?;
                    Ok(distance::max_distance(&section, &new.points))
                })
                .try_fold(0.0, |furthest, distance: Result<f64, ProfileError>| distance.map(|d| f64::max(furthest, d)));
            let share = missed.get(wing).and_then(|missed| missed.iter().map(|missed| missed.share).reduce(f64::max));
            let report = ProfileReport {
                max_distance_to_new_profiles: furthest.as_ref().ok().copied(),
                max_miss_of_vertices: share,
                not_measured: match (&furthest, share) {
                    (Err(error), _) => Some(error.to_string()),
                    (_, None) => Some("no edge of the wing crosses the planes of its profiles".to_owned()),
                    _ => None,
                },
            };
            for &family in families {
                reports.insert(self.mesh.families[family.index()].clone(), report.clone());
            }
            reports.insert(wing.clone(), report);
        }
        reports
    }

    /// The wings that miss their new profiles by more than what is allowed, with their worst vertex in the mesh's order.
    pub(super) fn beyond(&self, missed: BTreeMap<String, Vec<Missed>>) -> BTreeMap<String, Missed> {
        let worst = |(wing, missed): (String, Vec<Missed>)| {
            let worst = missed.into_iter().max_by(|a, b| a.share.total_cmp(&b.share))?;
            let vertex = self.order.vertex(worst.vertex as u32) as usize;
            (worst.share > MISSED).then_some((wing, Missed { vertex, ..worst }))
        };
        missed.into_iter().filter_map(worst).collect()
    }
}
