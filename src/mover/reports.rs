//! Measures an [`Outcome`](super::Outcome) holds: deviations of surfaces from their shapes and of
//! wings from their profiles.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    Design, Deviation, FamilyReport, HeldBack, MISSED, MissedSurface, MovedSection, Mover, ProfileReport, STRAINED,
    Solver, Strained,
};
use crate::{
    families::{PlacedBy, Role, shape::FamilyShape},
    geometry::triangle_normal,
    mesh::{FamilyId, corners::Face},
    profile::{Missed, Plane, Profile, ProfileError, cut, distance},
    projection::TargetSurface,
    relaxation::Convergence,
    stages::{
        rigid::{Body, Strain},
        wing::junctions,
    },
};

/// A vertex is off its carenage or plane beyond this fraction of the family's size. A plane family
/// may deviate from a plane by the same fraction in the undeformed mesh.
const OFF_SURFACE: f64 = 1e-6;

/// Partners in periodic planes have parted beyond this fraction of the mesh's size.
const PARTED: f64 = 1e-12;

/// The cut of a quadrilateral is measured at the ends of so many equal parts. The sag at the
/// leading edge is largest far from the middle: the middle alone shows 0.6 of it.
const PLACES: u32 = 16;

impl Mover {
    pub(super) fn solver_report(&self, volume: &Convergence) -> Solver {
        Solver {
            method: self.stages.volume.method().name().to_owned(),
            sweeps: volume.sweeps,
            relative_residual: volume.relative_residual,
        }
    }

    /// Distances of the vertices of carenages and planes from their surfaces, by family, in the
    /// order of the family's vertices, in the mesh's unit.
    ///
    /// - `vertices` `[n_vertices]`: moved positions in the mover's order, in the mesh's unit
    pub(super) fn distances_off(&self, vertices: &[DVec3]) -> BTreeMap<FamilyId, Vec<f64>> {
        let families = &self.families;
        let of_family = |(index, shape): (usize, &Option<FamilyShape>)| {
            shape.as_ref()?;
            let family = FamilyId(index as u16);
            let off = |&vertex: &u32| {
                let at = vertices[vertex as usize];
                families.kept(family, vertex).map_or(0.0, |kept| kept.closest(at).distance(at))
            };
            Some((family, self.surface.vertices_of(family).par_iter().map(off).collect()))
        };
        families.shapes.iter().enumerate().filter_map(of_family).collect()
    }

    /// The carenages and planes with vertices off the surface, by name.
    ///
    /// - `distances_off`: as [`Mover::distances_off`] returns them
    pub(super) fn off_surface(&self, distances_off: &BTreeMap<FamilyId, Vec<f64>>) -> BTreeMap<String, Deviation> {
        let of_family = |(&family, distances): (&FamilyId, &Vec<f64>)| {
            let vertices = self.surface.vertices_of(family).iter().copied();
            let distances = vertices.zip(distances.iter().copied());
            let deviation = self.deviation(distances, OFF_SURFACE * self.size_of(family))?;
            Some((self.mesh.families[family.index()].clone(), deviation))
        };
        distances_off.iter().filter_map(of_family).collect()
    }

    /// The periodic planes that no longer match, by name. A deviation is a change of the vector
    /// between two partners.
    ///
    /// - `vertices` `[n_vertices]`: moved positions in the mover's order, in the mesh's unit
    pub(super) fn parted(&self, vertices: &[DVec3]) -> BTreeMap<String, Deviation> {
        let low = self.ordered.vertices.iter().copied().reduce(DVec3::min).unwrap_or_default();
        let high = self.ordered.vertices.iter().copied().reduce(DVec3::max).unwrap_or_default();
        // Far from the origin, the rounding of coordinates exceeds this fraction of the mesh's
        // size. Every step rounds again.
        let allowed = PARTED * low.distance(high) + 64.0 * f64::EPSILON * low.abs().max(high.abs()).max_element();
        let mut parted = BTreeMap::new();
        for pair in &self.families.partners.pairs {
            let Some(deviation) = self.deviation(pair.changes(&self.ordered.vertices, vertices), allowed) else {
                continue;
            };
            for family in pair.families {
                parted.insert(self.mesh.families[family.index()].clone(), deviation);
            }
        }
        parted
    }

    /// The deviation of vertices with these distances from their places, if a distance exceeds
    /// `allowed`. A distance that is not a number does.
    fn deviation(&self, distances: impl Iterator<Item = (u32, f64)>, allowed: f64) -> Option<Deviation> {
        let beyond: Vec<_> = distances.filter(|(_, distance)| distance.is_nan() || *distance > allowed).collect();
        let &(vertex, distance) = beyond.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let prescribed = beyond.iter().find_map(|&(vertex, _)| {
            let is_prescribed = self.families.placed_by[vertex as usize] == PlacedBy::Prescribed;
            is_prescribed.then(|| self.families.holder(&self.surface, vertex)).flatten()
        });
        let vertex = self.order.vertex(vertex) as usize;
        Some(Deviation { distance, vertices: beyond.len(), vertex, prescribed })
    }

    pub(super) fn family_reports(
        &self,
        vertices: &[DVec3],
        distances_off: &BTreeMap<FamilyId, Vec<f64>>,
        folded: &BTreeMap<String, usize>,
        self_intersecting: &[u32],
        held_back: &[HeldBack],
    ) -> BTreeMap<String, FamilyReport> {
        let families = &self.families;
        let reports = distances_off.iter().filter_map(|(family, distances)| {
            let shape = families.shapes[family.index()].as_ref()?;
            let distance = distances.iter().copied().fold(0.0, f64::max);
            let report = match shape {
                FamilyShape::Surface(_) => {
                    FamilyReport { max_distance_to_original_surface: Some(distance), ..FamilyReport::default() }
                }
                FamilyShape::Plane(..) => {
                    FamilyReport { max_distance_to_plane: Some(distance), ..FamilyReport::default() }
                }
            };
            Some((self.mesh.families[family.index()].clone(), report))
        });
        let mut reports: BTreeMap<_, _> = reports.collect();
        for pair in &families.partners.pairs {
            let (distance, _) = pair.apart(&self.ordered.vertices, vertices);
            for family in pair.families {
                let name = self.mesh.families[family.index()].clone();
                reports.entry(name).or_default().max_distance_of_partners = Some(distance);
            }
        }
        for (name, report) in self.assembly_reports(vertices) {
            let entry: &mut FamilyReport = reports.entry(name).or_default();
            *entry = FamilyReport { max_distance_of_partners: entry.max_distance_of_partners, ..report };
        }
        for held in held_back {
            let entry = reports.entry(held.by.clone()).or_default().held_back.get_or_insert_default();
            entry.vertices += held.vertices;
            entry.max_distance = entry.max_distance.max(held.max_distance);
        }
        for (family, &count) in folded {
            reports.entry(family.clone()).or_default().folded_triangles = count;
        }
        for &triangle in self_intersecting {
            let family = &self.mesh.families[self.surface.family[triangle as usize].index()];
            reports.entry(family.clone()).or_default().pierced_triangles += 1;
        }
        reports
    }

    /// Number of triangles of attached families that are turned over against their assembly's
    /// motion, by family. A crease that ends inside a family turns some without a
    /// [fold](crate::quality::faults::folded).
    ///
    /// - `vertices` `[n_vertices]`: moved positions in the mover's order, in the mesh's unit
    pub(super) fn turned_over(&self, vertices: &[DVec3]) -> BTreeMap<FamilyId, usize> {
        let (families, original) = (&self.families, &self.ordered.vertices);
        let mut turned: BTreeMap<FamilyId, Vec<u32>> = BTreeMap::new();
        for (assembly, carried) in families.assemblies.iter().zip(self.stages.rigids.carried()) {
            let rotation = carried.motion.rotation();
            let placed_by = |family: &FamilyId| families.roles[family.index()].placed_by();
            for family in assembly.families.iter().copied().filter(|family| placed_by(family) == PlacedBy::Attached) {
                let is_turned = |&&triangle: &&u32| {
                    let corners = self.surface.triangles[triangle as usize];
                    let normal =
                        |positions: &[DVec3]| triangle_normal(corners.map(|vertex| positions[vertex as usize]));
                    let is_own = corners.iter().any(|&vertex| assembly.has(vertex));
                    is_own && normal(vertices).dot(rotation * normal(original)) < 0.0
                };
                let of_family = self.surface.triangles_of(family).iter().filter(is_turned);
                turned.entry(family).or_default().extend(of_family);
            }
        }
        // A quadrilateral is turned if one of its triangles is.
        let count = |(family, triangles)| (family, self.surface.one_of_each_face(triangles).len());
        turned.into_iter().map(count).filter(|(_, count)| *count > 0).collect()
    }

    /// Motions and deviations of attached and rigid families, by name. Of several bodies of a
    /// family the motion is that of the one that turns the most.
    ///
    /// - `vertices` `[n_vertices]`: moved positions in the mover's order, in the mesh's unit
    fn assembly_reports(&self, vertices: &[DVec3]) -> BTreeMap<String, FamilyReport> {
        let (families, original) = (&self.families, &self.ordered.vertices);
        let role = |family: FamilyId| Some(families.roles[family.index()].name());
        let larger = |a: Option<f64>, b: f64| Some(a.map_or(b, |a| a.max(b)));
        let mut reports: BTreeMap<FamilyId, FamilyReport> = BTreeMap::new();
        for (index, (assembly, carried)) in families.assemblies.iter().zip(self.stages.rigids.carried()).enumerate() {
            let is_attached = |family: &FamilyId| matches!(families.roles[family.index()], Role::Attached { .. });
            let back = |vertex: u32| carried.motion.back(vertices[vertex as usize]);
            let continued = self.stages.attached.continuation(index, &self.ordered, back);
            for family in assembly.families.iter().copied().filter(is_attached) {
                // A part that slides is one surface: its vertices slide over the seams of families.
                let is_of = |other: &FamilyId| *other == family || !continued.is_empty();
                let of = assembly.families.iter().copied().filter(is_attached).filter(is_of);
                let corners = |t: [u32; 3]| t.map(|vertex| original[vertex as usize]);
                let corners = of.flat_map(|family| self.surface.corners_of(family)).map(corners);
                let corners = corners.chain(continued.iter().copied());
                let points: Vec<DVec3> = corners.flatten().collect();
                let triangles = (0..points.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
                let still = TargetSurface::new(&points, triangles);
                let own: Vec<u32> = assembly.vertices_of(&self.surface, family).collect();
                let distance = own.par_iter().map(|&vertex| still.closest(back(vertex)).distance_squared.sqrt());
                let distance = distance.reduce(|| 0.0, f64::max);
                let report = reports.entry(family).or_default();
                report.role = role(family);
                report.residual = larger(report.residual, carried.residual);
                report.max_slide = self.stages.attached.slides().get(&family).copied();
                report.max_distance_to_carried_surface = larger(report.max_distance_to_carried_surface, distance);
            }
        }
        for body in self.stages.rigids.bodies() {
            let report = reports.entry(body.family).or_default();
            let turn = body.motion.angle().to_degrees();
            if report.turn_degrees.is_some_and(|largest| largest >= turn) {
                continue;
            }
            let shifts = body.vertices.iter().map(|&vertex| body.motion.displacement(original[vertex as usize]));
            let shift = shifts.sum::<DVec3>() / body.vertices.len().max(1) as f64;
            report.role = role(body.family);
            report.max_slide = self.stages.attached.slides().get(&body.family).copied();
            (report.turn_degrees, report.shift) = (Some(turn), Some(shift.to_array()));
        }
        for (&family, report) in &mut reports {
            let gives_way = report.residual.is_some() || report.max_slide.is_some();
            report.edge_ratios = gives_way.then(|| self.edge_ratios(family, vertices));
        }
        reports.into_iter().map(|(family, report)| (self.mesh.families[family.index()].clone(), report)).collect()
    }

    /// The smallest and the largest ratio of an edge's length to its length before, in a family.
    fn edge_ratios(&self, family: FamilyId, vertices: &[DVec3]) -> [f64; 2] {
        let length = |positions: &[DVec3], [a, b]: [u32; 2]| positions[a as usize].distance(positions[b as usize]);
        let edges = self.surface.edges_of(self.surface.triangles_of(family));
        let ratios = edges.into_iter().map(|edge| length(vertices, edge) / length(&self.ordered.vertices, edge));
        ratios.fold([f64::INFINITY, 0.0], |[low, high], ratio| [low.min(ratio), high.max(ratio)])
    }

    /// Wings whose junctions miss their surfaces, with vertices in the order of the mesh that was
    /// given.
    pub(super) fn missed_surfaces(&self) -> BTreeMap<String, MissedSurface> {
        let of_mesh = |(wing, missed): (&String, &MissedSurface)| {
            (wing.clone(), MissedSurface { vertex: self.order.vertex(missed.vertex), ..*missed })
        };
        self.stages.wings.missed_surfaces().iter().map(of_mesh).collect()
    }

    /// Rigid families that are torn from what they touch, by name.
    pub(super) fn strained(&self) -> BTreeMap<String, Strained> {
        let of_body = |body: &Body| {
            let Strain { vertex, distance, edge } = body.strain?;
            if distance <= STRAINED * edge {
                return None;
            }
            let by = self.families.other_holder(&self.surface, vertex, body.family)?;
            let name = |family: FamilyId| self.mesh.families[family.index()].clone();
            let at = self.ordered.vertices[vertex as usize];
            Some((name(body.family), Strained { by: name(by), at, distance, edge }))
        };
        self.stages.rigids.bodies().iter().filter_map(of_body).collect()
    }

    /// Deviations of the moved wings from their new profiles, by the name of the wing and of each
    /// of its families; and the sections of the wings, by the name of the wing.
    ///
    /// - `vertices` `[n_vertices]`: moved positions in the mover's order, in the mesh's unit
    /// - `missed`: the worst vertex of each profile, by wing
    /// - `flat_cuts`: the wings whose new profiles were compared with flat cuts
    pub(super) fn profile_reports(
        &self,
        vertices: &[DVec3],
        design: &Design,
        missed: &BTreeMap<String, Vec<Missed>>,
        flat_cuts: &[String],
    ) -> (BTreeMap<String, ProfileReport>, BTreeMap<String, Vec<MovedSection>>) {
        let (mut reports, mut all_sections) = (BTreeMap::new(), BTreeMap::new());
        for (wing, families) in &self.wing_families {
            let Some(new) = design.profiles.get(wing) else { continue };
            let faces: Vec<Face> = families.iter().flat_map(|&family| self.surface.faces_of(family)).collect();
            // On quadrilaterals the cut has points on the edges of the mesh alone, and most edges
            // of a wing run through its vertices along the span. So the sag of the faces shows
            // between. Bridges over parts are guesses, and count nowhere.
            let has_quads = faces.iter().any(|face| face.vertices().len() > 3);
            let measured = |cut: &cut::ThroughParts| {
                let is_whole = cut.on_surface.len() == cut.points.len();
                let ends = cut.on_surface.windows(2).filter(|_| has_quads && is_whole);
                let between = |ends: &[DVec3]| {
                    let [from, to] = [ends[0], ends[1]];
                    (1..PLACES).map(move |k| from.lerp(to, f64::from(k) / f64::from(PLACES)))
                };
                cut.on_surface.iter().copied().chain(ends.flat_map(between)).collect::<Vec<_>>()
            };
            let junctions = junctions(&self.mesh, &self.surface, &self.families.roles, families, |vertex| vertex);
            let section = |new: &Profile| {
                let cut = cut::cut_through_parts(vertices, &faces, &Plane::of_profile(new)?, &junctions)?;
                let max_distance_to_new_profile = distance::max_distance(&measured(&cut), &new.points);
                Ok(MovedSection { profile: new.number, max_distance_to_new_profile, points: cut.points })
            };
            let sections: Vec<Result<MovedSection, ProfileError>> = new.iter().map(section).collect();
            let distances = sections.iter().map(|section| section.as_ref().map(|of| of.max_distance_to_new_profile));
            let furthest = distances
                .map(|distance| distance.map_err(Clone::clone))
                .try_fold(0.0, |furthest, distance: Result<f64, ProfileError>| distance.map(|d| f64::max(furthest, d)));
            let share = missed.get(wing).and_then(|missed| missed.iter().map(|missed| missed.share).reduce(f64::max));
            let report = ProfileReport {
                max_distance_to_new_profiles: furthest.as_ref().ok().copied(),
                max_miss_of_vertices: share,
                compared_with_flat_cuts: flat_cuts.contains(wing),
                matches: self.stages.wings.matches(wing),
                not_measured: match (&furthest, share) {
                    (Err(error), _) => Some(error.to_string()),
                    (_, None) => Some("no edge of the wing crosses the planes of its profiles".to_owned()),
                    _ => None,
                },
                shared_curves: self
                    .stages
                    .wings
                    .shared_curves()
                    .filter(|(of, _)| of == wing)
                    .map(|(_, curve)| curve.clone())
                    .collect(),
            };
            for &family in families {
                reports.insert(self.mesh.families[family.index()].clone(), report.clone());
            }
            reports.insert(wing.clone(), report);
            all_sections.insert(wing.clone(), sections.into_iter().flatten().collect());
        }
        (reports, all_sections)
    }

    /// The wings that miss their new profiles by more than [`MISSED`], with the worst vertex in the
    /// order of the mesh that was given.
    pub(super) fn beyond(&self, missed: BTreeMap<String, Vec<Missed>>) -> BTreeMap<String, Missed> {
        let worst = |(wing, missed): (String, Vec<Missed>)| {
            let worst = missed.into_iter().max_by(|a, b| a.share.total_cmp(&b.share))?;
            let vertex = self.order.vertex(worst.vertex as u32) as usize;
            (worst.share > MISSED).then_some((wing, Missed { vertex, ..worst }))
        };
        missed.into_iter().filter_map(worst).collect()
    }
}
