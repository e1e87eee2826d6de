//! The flat section: the curve in which a plane cuts a wing's facets.
//!
//! The signs of the vertices alone decide which faces a plane cuts, and how the pieces join. A
//! crossing is identified by its edge. So rounding cannot break the curve. A vertex exactly on the
//! plane counts as above it; the crossings of its edges then coincide, and are merged at the end.
//!
//! A quadrilateral is cut at its own edges, not at a diagonal, so the division into triangles has
//! no part in a section. Where all four edges cross the plane (a saddle), the sign of the middle
//! decides which crossings join: the vertices on the other side are cut off one by one.

use std::collections::HashMap;
use std::ops::Range;

use glam::DVec3;

use super::bridge::{Bridge, bridged, check_edges};
use super::crossings::{Crossing, bridge_runs, crossing, is_closed, points_of};
use super::junctions::Junctions;
use crate::profile::curve::{short_end, twice_area};
use crate::profile::edges::trailing_edge;
use crate::profile::error::ShortEnd;
use crate::profile::{Plane, ProfileError, extent};

/// Points closer than this share of the section's size are one point.
const SAME: f64 = 1e-12;

/// A section cut from facets.
#[derive(Clone, Debug)]
pub(in crate::profile) struct FlatSection {
    /// Crossings in the order of [`super::cut()`]. If the section is closed, the last repeats the
    /// first.
    pub crossings: Vec<Crossing>,
    /// Index of the first crossing of a blunt base, if the base is part of a closed section.
    pub base: Option<usize>,
    /// The gaps that were bridged.
    pub bridges: Vec<Bridge>,
}

impl FlatSection {
    pub fn points(&self) -> Vec<DVec3> {
        self.crossings.iter().map(|crossing| crossing.at).collect()
    }

    pub fn is_closed(&self) -> bool {
        is_closed(&self.crossings)
    }

    /// The points on the wing's surface, without those of bridges.
    pub fn points_on_surface(&self) -> Vec<DVec3> {
        let on_surface = self.crossings.iter().filter(|crossing| !crossing.edges.is_empty());
        on_surface.map(|crossing| crossing.at).collect()
    }

    /// The bridges with their points, and with those on the surface at their ends.
    pub fn bridge_runs(&self) -> Vec<(Range<usize>, &Bridge)> {
        let of_run = |run: Range<usize>| {
            let run = run.start.saturating_sub(1)..(run.end + 1).min(self.crossings.len());
            let at = |place: usize| self.crossings[place].at;
            let ends = [at(run.start), at(run.end - 1)];
            let has = |bridge: &&Bridge| bridge.ends == ends || bridge.ends == [ends[1], ends[0]];
            Some((run, self.bridges.iter().find(has)?))
        };
        bridge_runs(&self.crossings).into_iter().filter_map(of_run).collect()
    }
}

/// The section of [`super::cut()`], with the edges.
pub(in crate::profile) fn flat_section(
    vertices: &[DVec3],
    faces: &[impl AsRef<[u32]>],
    plane: &Plane,
) -> Result<FlatSection, ProfileError> {
    flat_section_through(vertices, faces, plane, None)
}

/// The section of [`super::through_parts()`], with the edges.
///
/// - `junctions`: where the wing's surface ends on other families; `None` bridges nothing
pub(in crate::profile) fn flat_section_through(
    vertices: &[DVec3],
    faces: &[impl AsRef<[u32]>],
    plane: &Plane,
    junctions: Option<&Junctions>,
) -> Result<FlatSection, ProfileError> {
    check(vertices, faces)?;
    let at = plane.point.dot(plane.normal);
    let normal = plane.normal;
    let curves = match crossing_curves(vertices, faces, plane, true)? {
        curves if !curves.is_empty() => curves,
        // The wing may end exactly in the plane and lie above it. Then vertices in the plane must
        // count as below.
        _ => crossing_curves(vertices, faces, plane, false)?,
    };
    if curves.is_empty() {
        let distances = faces.iter().flat_map(AsRef::as_ref).map(|&v| vertices[v as usize].dot(normal));
        let (low, high) = distances.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), d| (l.min(d), h.max(d)));
        return Err(ProfileError::PlaneMisses { normal, at, low, high });
    }
    if let Some(junctions) = junctions
        && let Some((curve, bridges)) = bridged(&curves, vertices, faces, plane, junctions)?
    {
        let section = FlatSection { bridges, ..in_order(curve, plane) };
        check_edges(&section.crossings, section.base, &section.bridges, plane)?;
        return Ok(section);
    }
    let ends = curves.iter().filter(|curve| !is_closed(curve)).flat_map(|curve| [curve.first(), curve.last()]);
    let families = junctions.map_or_else(Vec::new, |junctions| junctions.families_at(ends.flatten()));
    let pieces = curves.len();
    if pieces > 1 {
        return Err(ProfileError::Pieces { normal, at, pieces, families: families.into() });
    }
    let Some(curve) = curves.into_iter().next() else { unreachable!("an empty list was returned above") };
    match (!is_closed(&curve)).then(|| short_end(&points_of(&curve))).flatten() {
        Some(position) => Err(ProfileError::CutShort { normal, at, end: Box::new(ShortEnd { position, families }) }),
        None => Ok(in_order(curve, plane)),
    }
}

/// Checks that all vertices of the faces exist and have finite positions.
pub(in crate::profile) fn check(vertices: &[DVec3], faces: &[impl AsRef<[u32]>]) -> Result<(), ProfileError> {
    for (face, corners) in faces.iter().enumerate() {
        for &vertex in corners.as_ref() {
            if !vertices.get(vertex as usize).is_some_and(|v| v.is_finite()) {
                return Err(ProfileError::Face { face, vertex, n_vertices: vertices.len() });
            }
        }
    }
    Ok(())
}

/// All curves of the cut, with coincident points merged. A closed curve repeats its first point.
fn crossing_curves(
    vertices: &[DVec3],
    faces: &[impl AsRef<[u32]>],
    plane: &Plane,
    zero_is_above: bool,
) -> Result<Vec<Vec<Crossing>>, ProfileError> {
    const NONE: usize = usize::MAX;
    let is_above = |distance: f64| distance > 0.0 || (distance == 0.0 && zero_is_above);
    let mut index: HashMap<(u32, u32), usize> = HashMap::new();
    let mut points: Vec<DVec3> = Vec::new();
    let mut edges: Vec<[u32; 2]> = Vec::new();
    let mut neighbours: Vec<[usize; 2]> = Vec::new();
    for face in faces {
        let corners = face.as_ref();
        let n = corners.len();
        let distance = |&vertex: &u32| plane.distance(vertices[vertex as usize]);
        let side = |vertex: &u32| is_above(distance(vertex));
        if corners.windows(2).all(|ends| side(&ends[0]) == side(&ends[1])) {
            continue;
        }
        let distances: Vec<f64> = corners.iter().map(distance).collect();
        let above: Vec<bool> = corners.iter().map(side).collect();
        // The crossing of the edge from each corner to the next.
        let mut cross = |k: usize| {
            let next = (k + 1) % n;
            (above[k] != above[next]).then(|| {
                let (i, j) = (corners[k], corners[next]);
                let edge = if above[k] { [j, i] } else { [i, j] };
                let (i, j) = (i.min(j), i.max(j));
                *index.entry((i, j)).or_insert_with(|| {
                    points.push(crossing(vertices[i as usize], vertices[j as usize], plane));
                    edges.push(edge);
                    neighbours.push([NONE; 2]);
                    points.len() - 1
                })
            })
        };
        let crossings: Vec<Option<usize>> = (0..n).map(&mut cross).collect();
        let found: Vec<usize> = crossings.iter().copied().flatten().collect();
        let pairs = match found[..] {
            [one, other] => vec![[one, other]],
            [_, _, _, _] => {
                // The sum of opposite corners first: the first corner does not matter.
                let middle = is_above((distances[0] + distances[2]) + (distances[1] + distances[3]));
                let cut_off = (0..n).filter(|&k| above[k] != middle);
                cut_off.filter_map(|k| Some([crossings[(k + n - 1) % n]?, crossings[k]?])).collect()
            }
            _ => Vec::new(),
        };
        // A face that names a vertex twice has both its crossings on one edge.
        for [one, other] in pairs.into_iter().filter(|[one, other]| one != other) {
            for (me, other) in [(one, other), (other, one)] {
                match neighbours[me].iter().position(|&n| n == NONE) {
                    Some(place) => neighbours[me][place] = other,
                    None => {
                        let at = plane.point.dot(plane.normal);
                        return Err(ProfileError::Branches { normal: plane.normal, at, position: points[me] });
                    }
                }
            }
        }
    }

    let size = extent(&points);
    let mut visited = vec![false; points.len()];
    let mut curves = Vec::new();
    // Open curves come first, from an end. The rest are loops.
    let is_end = |i: &usize| neighbours[*i].contains(&NONE);
    let starts: Vec<usize> = (0..points.len()).filter(is_end).chain(0..points.len()).collect();
    for start in starts {
        if visited[start] {
            continue;
        }
        let mut curve = Vec::new();
        let mut current = start;
        loop {
            visited[current] = true;
            curve.push(Crossing { at: points[current], edges: vec![edges[current]] });
            match neighbours[current].iter().find(|&&n| n != NONE && !visited[n]) {
                Some(&next) => current = next,
                None => break,
            }
        }
        if !is_end(&start) {
            curve.push(curve[0].clone());
        }
        merge(&mut curve, SAME * size);
        // A curve that shrinks to a point only touches the plane.
        if curve.len() > 1 {
            curves.push(curve);
        }
    }
    Ok(curves)
}

/// Merges points that coincide with the point before. The last point does not change.
fn merge(curve: &mut Vec<Crossing>, tolerance: f64) {
    let last = curve.last().map(|crossing| crossing.at);
    curve.dedup_by(|next, kept| {
        let same = next.at.distance(kept.at) <= tolerance;
        if same {
            kept.edges.append(&mut next.edges);
        }
        same
    });
    if let (Some(last), Some(end)) = (last, curve.last_mut()) {
        end.at = last;
    }
}

/// Brings a curve into the order lower trailing edge, leading edge, upper trailing edge.
fn in_order(mut curve: Vec<Crossing>, plane: &Plane) -> FlatSection {
    let up = if plane.normal.z.abs() < 0.9 { DVec3::Z } else { DVec3::Y };
    if !is_closed(&curve) {
        if starts_above(&points_of(&curve), up) {
            curve.reverse();
        }
        return FlatSection { crossings: curve, base: None, bridges: Vec::new() };
    }
    // The first crossing may have been merged with the last ones.
    let last = curve.pop();
    if let (Some(last), Some(first)) = (last, curve.first_mut()) {
        first.edges.extend(last.edges);
        first.edges.sort_unstable();
        first.edges.dedup();
    }
    let te = trailing_edge(&points_of(&curve));
    let n = curve.len();
    curve.rotate_left(te.start);
    // A blunt trailing edge within the family: its base follows after the two sides.
    let end = (te.end + n - te.start) % n;
    if starts_above(&points_of(&curve), up) {
        curve.rotate_left(end);
        curve[1..].reverse();
    }
    curve.push(curve[0].clone());
    FlatSection { crossings: curve, base: (end > 0).then_some(end), bridges: Vec::new() }
}

/// Whether a curve runs from the trailing edge along the upper side first.
fn starts_above(curve: &[DVec3], up: DVec3) -> bool {
    let te = (curve[0] + curve[curve.len() - 1]) / 2.0;
    let le =
        curve.iter().copied().fold(te, |le, p| if p.distance_squared(te) > le.distance_squared(te) { p } else { le });
    // The curve in order runs forward along the lower side and back along the upper one: it turns
    // from forward to up.
    twice_area(curve).dot((le - te).cross(up)) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ends of the pieces in which the plane z = 0 cuts one face, as pairs of edges.
    fn pieces(vertices: &[DVec3], face: &[u32]) -> Vec<Vec<[u32; 2]>> {
        let plane = Plane { point: DVec3::ZERO, normal: DVec3::Z };
        let curves = crossing_curves(vertices, &[face], &plane, true).unwrap();
        let edges = |curve: Vec<Crossing>| {
            let mut edges: Vec<[u32; 2]> = curve.iter().flat_map(|crossing| crossing.edges.clone()).collect();
            edges.iter_mut().for_each(|edge| edge.sort_unstable());
            edges.sort_unstable();
            edges
        };
        let mut pieces: Vec<Vec<[u32; 2]>> = curves.into_iter().map(edges).collect();
        pieces.sort_unstable();
        pieces
    }

    /// A square whose corners lie above and below the plane in turn. If its middle lies below, each
    /// corner above is cut off, and the other way round. Neither the corner with which the face
    /// begins, nor its orientation, nor the numbers of its vertices matter.
    ///
    /// Fails if the plane cuts the square's triangles on either side of a diagonal.
    #[test]
    fn the_middle_of_a_saddle_decides() {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        for (heights, cut_off) in [([1.0, -1.0, 1.0, -3.0], [0, 2]), ([1.0, -1.0, 3.0, -1.0], [1, 3])] {
            for numbers in [[0, 1, 2, 3], [2, 0, 3, 1], [3, 2, 1, 0], [1, 3, 0, 2]] {
                let mut vertices = [DVec3::ZERO; 4];
                for place in 0..4 {
                    let (x, y) = corners[place];
                    vertices[numbers[place] as usize] = DVec3::new(x, y, heights[place]);
                }
                let edge = |a: usize, b: usize| {
                    let (a, b) = (numbers[a % 4], numbers[b % 4]);
                    [a.min(b), a.max(b)]
                };
                let around = |place: usize| {
                    let mut edges = vec![edge(place + 3, place), edge(place, place + 1)];
                    edges.sort_unstable();
                    edges
                };
                let mut expected = cut_off.map(around).to_vec();
                expected.sort_unstable();
                for start in 0..4 {
                    let mut face = numbers;
                    face.rotate_left(start);
                    assert_eq!(pieces(&vertices, &face), expected, "{heights:?} {face:?}");
                    face.reverse();
                    assert_eq!(pieces(&vertices, &face), expected, "{heights:?} {face:?}");
                }
            }
        }
    }

    /// A warped quadrilateral is cut from edge to edge, also where its middle is off the section.
    #[test]
    fn a_section_has_no_point_on_a_diagonal() {
        let vertices = [[0.0, 0.0, -1.0], [1.0, 0.2, -0.5], [1.1, 1.0, 2.0], [0.0, 1.0, 0.7]].map(DVec3::from_array);
        assert_eq!(pieces(&vertices, &[0, 1, 2, 3]), [vec![[0, 3], [1, 2]]]);
        assert_eq!(pieces(&vertices, &[0, 1, 2]), [vec![[0, 2], [1, 2]]]);
    }
}
