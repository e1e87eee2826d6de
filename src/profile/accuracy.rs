//! Accuracy of the moved wing: deviation of its vertices from the new profiles.
//!
//! Facets miss a curved section by their sag, on a coarse mesh by half a percent of the chord, also
//! in a correct mesh. So the check takes vertices instead of facets. The *vertices* at the edges
//! that cross a profile's plane are carried into the plane along the wing's span-wise lines. Their
//! distances from the old profile before the motion, and from the new profile after it, are
//! compared; an increase is a deviation of the wing. The span-wise lines of the undeformed wing are
//! straight there. The lines of the moved wing follow the profiles.
//!
//! The paper has no such check.

use std::cell::OnceCell;
use std::collections::BTreeSet;

use glam::DVec3;
use rayon::prelude::*;

use super::along::ArcPlace;
use super::curve::ProfileCurve;
use super::displacement::ProfileDisplacement;
use super::distance::Polyline;
use super::edges::farthest;
use super::kept::KeptSection;
use super::locate::SectionGrid;
use super::near::Near;
use super::span::{Span, SpanWeights};
use super::wing_surface::WingSurface;
use super::{Plane, Profile, ProfileError, extent};
use crate::mesh::corners::Face;

/// Largest distance of the vertices beside a plane from the old profile, as a share of its length,
/// where another body cuts the wing's section short. Vertices carried along straight lines may be a
/// little off the profile where the wing turns, and where the profile has few points.
const OFF_WING: f64 = 0.03;

/// Largest excess, as a share of the profile's length, of the mirrored half's distance from an old
/// profile over the distance of the profile's own half.
const OFF_MIRROR: f64 = 0.01;

/// A direction that rises by less than this share of its length does not lead into the plane.
const GRAZING: f64 = 0.1;

/// The vertex with the largest deviation from a new profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Missed {
    /// Number of the profile.
    pub profile: i64,
    /// Increase of the vertex's distance, from the old profile before to the new profile after the
    /// motion, beyond the growth of the profile itself, as a share of the new profile's length
    /// (about its chord). 0 if no distance has grown.
    pub share: f64,
    /// Index of the vertex among the wing's vertices.
    pub vertex: usize,
}

/// The vertices that are checked.
#[derive(Debug, Default)]
pub(super) struct Watch {
    /// For each section, the vertices at the edges that cross its plane.
    sections: Vec<Watched>,
}

/// The checked vertices of one section. Each takes 13 bytes, because a wing may have many sections.
#[derive(Clone, Debug)]
struct Watched {
    vertices: Vec<u32>,
    /// Place along the section of each vertex, carried into the plane `[n_vertices]`.
    arcs: Vec<f64>,
    on_base: Vec<bool>,
    /// Largest distance of the carried vertices from the old section. An old section that another
    /// program cut from facets is off by the sag, which differs from place to place, and a vertex
    /// may slide to a place with more sag.
    old: f64,
    /// Length and thickness of the old section.
    size: [f64; 2],
}

/// A vertex beside a plane.
#[derive(Clone, Copy, Debug)]
struct Carried {
    vertex: u32,
    /// The point at which the vertex arrives in the plane.
    at: DVec3,
}

/// The edges of a face, each from a corner to the next.
fn edges_of(corners: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]])
}

impl Watch {
    /// Chooses the vertices and checks them against the old sections.
    ///
    /// - `sections`: the old sections, smooth
    /// - `compared`: whether a section was already compared with the wing's own section
    /// - `tau`: the parameters of [`SectionGrid`]
    /// - `along`: unit span-wise direction of the undeformed wing at a vertex
    ///
    /// # Errors
    /// [`ProfileError::OffWing`], [`ProfileError::OffMirror`]: the vertices beside a plane are far
    /// off its old profile.
    pub fn new(
        span: &Span,
        sections: &[KeptSection],
        compared: &[bool],
        surface: &WingSurface,
        tau: &[f64],
        along: impl Fn(usize) -> DVec3 + Sync,
    ) -> Result<Self, ProfileError> {
        let intervals = span.intervals(surface.positions);
        let watched = |place: usize| {
            let is_near = |end: &u32| {
                let of = |intervals: &Vec<usize>| intervals[*end as usize];
                intervals.as_ref().map(of).is_none_or(|interval| interval == place || interval + 1 == place)
            };
            let (plane, section, compared) = (&span.planes[place], sections[place].section(), compared[place]);
            let heights: Vec<f64> = surface.positions.iter().map(|&position| plane.distance(position)).collect();
            let beside = |faces: &[Face]| -> Vec<Carried> {
                let edges = faces.iter().flat_map(|face| edges_of(face.vertices()));
                // A vertex in the plane counts if the wing continues from it. Inside a cap that
                // lies in the plane it does not.
                let counts = |ends: [u32; 2]| {
                    let [end, other] = ends;
                    if !ends.iter().all(is_near) {
                        return false;
                    }
                    let [height, beyond] = [end, other].map(|end| heights[end as usize]);
                    height * beyond < 0.0 || height == 0.0 && beyond != 0.0
                };
                let ends = edges.flat_map(|[a, b]| [[a, b], [b, a]]).filter(|&ends| counts(ends));
                let vertices: BTreeSet<u32> = ends.map(|[end, _]| end).collect();
                let carried = |vertex: u32| {
                    let place = vertex as usize;
                    Carried { vertex, at: into(plane, surface.positions[place], along(place)) }
                };
                vertices.into_iter().map(carried).collect()
            };
            let mut vertices = beside(surface.faces);
            // A profile of few points may stand for a smooth curve or for straight lines. Before
            // the motion the larger of the two distances counts, after the motion the smaller one.
            let near = Near::new(&section);
            let both = |carried: &Carried| (near.curve(carried.at), near.lines(carried.at));
            let (mut old, mut distance): (f64, f64) = (0.0, 0.0);
            for (to_curve, to_lines) in vertices.par_iter().map(both).collect::<Vec<_>>() {
                old = old.max(to_curve).max(to_lines);
                distance = distance.max(to_curve.min(to_lines));
            }
            if !compared && distance > OFF_WING * section.length() {
                let (profile, share) = (section.profile().number, distance / section.length());
                return Err(ProfileError::OffWing { profile, distance, share });
            }
            let mirrored = beside(surface.mirrored);
            let off = mirrored.iter().map(both).map(|(to_curve, to_lines)| to_curve.min(to_lines)).fold(0.0, f64::max);
            let missing = mirrored.is_empty() && !surface.mirrored.is_empty() && !vertices.is_empty();
            if missing || off > distance + OFF_MIRROR * section.length() {
                return Err(ProfileError::OffMirror { profile: section.profile().number, distance: off });
            }
            vertices.extend(mirrored);
            let grid = SectionGrid::new(tau, place, std::slice::from_ref(&section));
            let only = SpanWeights::only(place);
            let along = |carried: &Carried| {
                let outward = surface.normals[carried.vertex as usize];
                let tau = grid.parameter(carried.at, outward, span.across(span.eta[place], place), &only);
                ArcPlace::of(&section, tau)
            };
            let places: Vec<ArcPlace> = vertices.iter().map(along).collect();
            Ok(Watched {
                vertices: vertices.iter().map(|carried| carried.vertex).collect(),
                arcs: places.iter().map(|place| place.arc).collect(),
                on_base: places.iter().map(|place| place.on_base).collect(),
                old,
                size: size(&section.profile().points),
            })
        };
        let sections: Vec<_> = (0..sections.len()).into_par_iter().map(watched).collect();
        Ok(Self { sections: sections.into_iter().collect::<Result<_, _>>()? })
    }

    /// The checked vertices of a section, with their places along the section.
    pub fn of_section(&self, section: usize) -> impl Iterator<Item = (usize, ArcPlace)> {
        let Watched { vertices, arcs, on_base, .. } = &self.sections[section];
        let places = arcs.iter().zip(on_base).map(|(&arc, &on_base)| ArcPlace { on_base, arc });
        vertices.iter().map(|&vertex| vertex as usize).zip(places)
    }

    /// Indices of all checked vertices.
    pub fn vertices(&self) -> impl Iterator<Item = usize> {
        self.sections.iter().flat_map(|watched| watched.vertices.iter().map(|&vertex| vertex as usize))
    }

    /// The vertex with the largest deviation in each section that has vertices. The deviation is
    /// infinite where there is no section to compare with.
    ///
    /// - `sections` `[n_sections]`: of the moved wing's vertices
    /// - `positions`: positions before the motion, by vertex
    /// - `moved` `[n_positions]`: positions at the end
    pub fn missed(
        &self,
        motion: &ProfileDisplacement,
        sections: &[&Profile],
        positions: impl Fn(usize) -> DVec3 + Sync,
        moved: &[DVec3],
    ) -> Vec<Missed> {
        let sections = sections.iter().zip(&motion.planes).zip(&self.sections).zip(&motion.carried);
        type Section<'a> = (((&'a &'a Profile, &'a Plane), &'a Watched), &'a Vec<DVec3>);
        let worst = |(((new, plane), watched), carried): Section| {
            let mut lines = new.points.clone();
            lines.dedup();
            let [length, thickness] = size(&lines);
            // A section that grows takes the distances of its vertices along. Where a plane passes
            // a round tip, the vertices beside it are far off the section, and stay as far.
            let growth = [length / watched.size[0], thickness / watched.size[1]].into_iter().fold(1.0, f64::max);
            let old = watched.old * growth;
            let straight = Polyline::new(&lines);
            let curve = OnceCell::new();
            let curve = || curve.get_or_init(|| ProfileCurve::new(&lines).path);
            let smooth = OnceCell::new();
            let smooth = || smooth.get_or_init(|| Polyline::new(curve()));
            let mut worst: Option<Missed> = None;
            for (&vertex, &carried) in watched.vertices.iter().zip(carried) {
                let vertex = vertex as usize;
                // A change by later stages, or by a family that holds the vertex, counts in the
                // plane. A slide along the span does not.
                let at = carried + (moved[vertex] - positions(vertex) - motion.displacement[vertex]);
                let at = into(plane, at, motion.span_direction[vertex]);
                let mut distance = straight.distance(at);
                let limit = old + length * worst.map_or(0.0, |worst| worst.share);
                // The curve may be nearer than the lines between its points. It is evaluated only
                // if the lines are too far, because it has many small steps.
                if distance > limit {
                    distance = distance.min(smooth().distance(at));
                }
                let share = (distance - old) / length;
                let share = if share.is_nan() { f64::INFINITY } else { share.max(0.0) };
                if worst.is_none_or(|worst| share > worst.share) {
                    worst = Some(Missed { profile: new.number, share, vertex });
                }
            }
            worst
        };
        sections.collect::<Vec<_>>().into_par_iter().filter_map(worst).collect()
    }
}

/// Length and thickness of a section: its extents along its chord and across.
fn size(points: &[DVec3]) -> [f64; 2] {
    let first = points[0];
    let one = points[farthest(points, first)];
    let other = points[farthest(points, one)];
    let chord = (other - one).normalize_or_zero();
    let across = |point: &DVec3| (*point - one).reject_from_normalized(chord);
    let up = points
        .iter()
        .map(across)
        .fold(DVec3::ZERO, |up, at| if at.length_squared() > up.length_squared() { at } else { up });
    let up = up.normalize_or_zero();
    let heights = points.iter().map(|point| across(point).dot(up));
    let (low, high) = heights.fold((0.0_f64, 0.0_f64), |(low, high), height| (low.min(height), high.max(height)));
    [extent(points), high - low]
}

/// The point at which a point arrives in a plane along a unit direction. If the direction hardly
/// leads there, along the normal.
pub(super) fn into(plane: &Plane, point: DVec3, along: DVec3) -> DVec3 {
    let rise = along.dot(plane.normal);
    let height = plane.distance(point);
    if rise.abs() < GRAZING { point - plane.normal * height } else { point - along * (height / rise) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A direction at 12 degrees to the plane leads into it, and one at 3 degrees does not: the way
    /// would be 20 times the height.
    ///
    /// Fails if `GRAZING` is 0 or 0.9.
    #[test]
    fn steep_directions_lead_into_the_plane() {
        let plane = Plane { point: DVec3::new(0.0, 2.0, 0.0), normal: DVec3::Y };
        let point = DVec3::new(1.0, 2.5, 3.0);
        let along = |rise: f64| DVec3::new((1.0 - rise * rise).sqrt(), rise, 0.0);
        let found = into(&plane, point, along(0.2));
        assert!(found.distance(DVec3::new(1.0 - 0.5 * 0.96f64.sqrt() / 0.2, 2.0, 3.0)) < 1e-12, "{found}");
        assert_eq!(into(&plane, point, along(0.05)), DVec3::new(1.0, 2.0, 3.0));
    }
}
