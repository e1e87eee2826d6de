//! Cuts profiles out of the wing's surface.
//!
//! Which triangles a plane cuts, and how the pieces join, is decided by the signs of the vertices alone, and a crossing
//! is known by its edge: so the curve is whole whatever the rounding. A vertex exactly on the plane counts as above it;
//! the crossings of its edges then coincide and are merged at the end.
//!
//! A cut through flat facets lies below the smooth surface that the vertices stand on, by up to the facets' sag.
//! [`cut`] gives this flat section, [`section`] the one that the vertices beside the plane say (see `carry`).

use std::collections::HashMap;

use glam::DVec3;

use super::edges::trailing_edge;
use super::{Plane, Profile, ProfileError, carry, extent};

/// Points closer than this share of the section's size are one point.
const SAME: f64 = 1e-12;

/// An open section ends at the trailing edge on both sides: no point stands farther behind, along the chord, than this share
/// of its length, or than half the thickness of its base, which may be oblique. A section that another body cuts short, or one
/// side of a wing alone, ends far from there on one side.
const BEHIND: f64 = 0.1;

/// The curve in which a plane cuts a wing's facets, in order: lower side of the trailing edge, leading edge, upper
/// side of the trailing edge. Open for a blunt trailing edge (its triangles are another family), closed with the first
/// point repeated for a sharp one.
///
/// - `vertices`: of the whole mesh, in its unit
/// - `triangles`: the wing's, any orientation
///
/// "Lower" is towards -z; towards -y for a plane whose normal is z.
///
/// # Errors
/// [`ProfileError::PlaneMisses`] with the wing's extent along the normal, [`ProfileError::Pieces`] with the number of
/// curves, [`ProfileError::CutShort`] for an open curve that does not end at the trailing edge on both sides,
/// [`ProfileError::Branches`] where the surface is no simple sheet, [`ProfileError::Triangle`].
pub fn cut(vertices: &[DVec3], triangles: &[[u32; 3]], plane: &Plane) -> Result<Vec<DVec3>, ProfileError> {
    Ok(flat_section(vertices, triangles, plane)?.points())
}

/// The section that a wing's vertices beside a plane say, in the order of [`cut`]: each is carried into the plane along the
/// wing's own span-wise direction.
///
/// # Errors
/// Those of [`cut`].
pub fn section(vertices: &[DVec3], triangles: &[[u32; 3]], plane: &Plane) -> Result<Vec<DVec3>, ProfileError> {
    let flat = flat_section(vertices, triangles, plane)?;
    Ok(carry::carried(vertices, triangles, plane, &flat))
}

/// A section cut from facets.
#[derive(Clone, Debug)]
pub(super) struct FlatSection {
    /// In the order of [`cut`]; the last repeats the first if the section is closed.
    pub crossings: Vec<Crossing>,
    /// Where the base of a blunt trailing edge begins that belongs to a closed section.
    pub base: Option<usize>,
}

/// Where the plane crosses the edges of the surface.
#[derive(Clone, Debug)]
pub(super) struct Crossing {
    pub at: DVec3,
    /// The edges that cross the plane there: the end below it and the end above it.
    pub edges: Vec<[u32; 2]>,
}

impl FlatSection {
    pub fn points(&self) -> Vec<DVec3> {
        self.crossings.iter().map(|crossing| crossing.at).collect()
    }

    pub fn is_closed(&self) -> bool {
        is_closed(&self.crossings)
    }
}

fn is_closed(curve: &[Crossing]) -> bool {
    curve.len() > 3 && curve[0].at == curve[curve.len() - 1].at
}

/// What [`cut`] gives, with the edges.
pub(super) fn flat_section(
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    plane: &Plane,
) -> Result<FlatSection, ProfileError> {
    check(vertices, triangles)?;
    let at = plane.point.dot(plane.normal);
    let normal = plane.normal;
    let mut curves = match crossing_curves(vertices, triangles, plane, true)? {
        curves if !curves.is_empty() => curves,
        // The wing may end exactly in the plane and lie above it: then its edge vertices must count as below.
        _ => crossing_curves(vertices, triangles, plane, false)?,
    };
    match (curves.pop(), curves.len()) {
        (None, _) => {
            let distances = triangles.iter().flatten().map(|&v| vertices[v as usize].dot(normal));
            let (low, high) = distances.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), d| (l.min(d), h.max(d)));
            Err(ProfileError::PlaneMisses { normal, at, low, high })
        }
        (Some(curve), 0) => match (!is_closed(&curve)).then(|| short_end(&points_of(&curve))).flatten() {
            Some(position) => Err(ProfileError::CutShort { normal, at, position }),
            None => Ok(in_order(curve, plane)),
        },
        (_, others) => Err(ProfileError::Pieces { normal, at, pieces: 1 + others }),
    }
}

/// The end of an open curve that is not at the trailing edge, if there is one.
pub(super) fn short_end(curve: &[DVec3]) -> Option<DVec3> {
    let (&first, &last) = (curve.first()?, curve.last()?);
    let middle = (first + last) / 2.0;
    let farther = |far: DVec3, &point: &DVec3| {
        if point.distance_squared(middle) > far.distance_squared(middle) { point } else { far }
    };
    let leading = curve.iter().fold(middle, farther);
    let chord = (middle - leading).try_normalize()?;
    let rear = curve.iter().map(|point| point.dot(chord)).fold(f64::NEG_INFINITY, f64::max);
    let length = rear - leading.dot(chord);
    let end = if first.dot(chord) < last.dot(chord) { first } else { last };
    let base = (last - first).reject_from_normalized(chord).length();
    (rear - end.dot(chord) > f64::max(BEHIND * length, base / 2.0)).then_some(end)
}

/// [`section`] at each of several planes, each with the number its profile shall carry.
///
/// # Errors
/// Those of [`cut`], for the first plane that fails.
pub fn cut_at_planes(
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    planes: &[(i64, Plane)],
) -> Result<Vec<Profile>, ProfileError> {
    let profile = |&(number, ref plane)| Ok(Profile { number, points: section(vertices, triangles, plane)? });
    planes.iter().map(profile).collect()
}

/// Every triangle's vertices exist and have finite positions.
pub(super) fn check(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Result<(), ProfileError> {
    for (triangle, corners) in triangles.iter().enumerate() {
        for &vertex in corners {
            if !vertices.get(vertex as usize).is_some_and(|v| v.is_finite()) {
                return Err(ProfileError::Triangle { triangle, vertex, n_vertices: vertices.len() });
            }
        }
    }
    Ok(())
}

/// All curves of the cut, each open or with its first point repeated, coincident points merged.
fn crossing_curves(
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    plane: &Plane,
    zero_is_above: bool,
) -> Result<Vec<Vec<Crossing>>, ProfileError> {
    const NONE: usize = usize::MAX;
    let above = |v: u32| {
        let d = plane.distance(vertices[v as usize]);
        d > 0.0 || (d == 0.0 && zero_is_above)
    };
    let mut index: HashMap<(u32, u32), usize> = HashMap::new();
    let mut points: Vec<DVec3> = Vec::new();
    let mut edges: Vec<[u32; 2]> = Vec::new();
    let mut neighbours: Vec<[usize; 2]> = Vec::new();
    for &[a, b, c] in triangles {
        let mut ends = [NONE; 2];
        let mut n_ends = 0;
        for (i, j) in [(a, b), (b, c), (c, a)] {
            if above(i) != above(j) && n_ends < 2 {
                let edge = if above(i) { [j, i] } else { [i, j] };
                let (i, j) = (i.min(j), i.max(j));
                ends[n_ends] = *index.entry((i, j)).or_insert_with(|| {
                    points.push(crossing(vertices[i as usize], vertices[j as usize], plane));
                    edges.push(edge);
                    neighbours.push([NONE; 2]);
                    points.len() - 1
                });
                n_ends += 1;
            }
        }
        // A triangle that names a vertex twice has both its crossings on one edge.
        if n_ends < 2 || ends[0] == ends[1] {
            continue;
        }
        for (me, other) in [(ends[0], ends[1]), (ends[1], ends[0])] {
            match neighbours[me].iter().position(|&n| n == NONE) {
                Some(place) => neighbours[me][place] = other,
                None => {
                    let at = plane.point.dot(plane.normal);
                    return Err(ProfileError::Branches { normal: plane.normal, at, position: points[me] });
                }
            }
        }
    }

    let size = extent(&points);
    let mut visited = vec![false; points.len()];
    let mut curves = Vec::new();
    // Open curves first, from an end; what is left then are loops.
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
        // What shrinks to a point only touches the plane.
        if curve.len() > 1 {
            curves.push(curve);
        }
    }
    Ok(curves)
}

/// Where an edge crosses the plane, exactly in the plane for one perpendicular to an axis.
fn crossing(a: DVec3, b: DVec3, plane: &Plane) -> DVec3 {
    let (da, db) = (plane.distance(a), plane.distance(b));
    let p = a + (b - a) * (da / (da - db)).clamp(0.0, 1.0);
    p - plane.normal * plane.distance(p)
}

/// Joins points that coincide with the one before; the last point stays.
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

/// Turns and, if closed, rotates a curve to lower trailing edge, leading edge, upper trailing edge.
fn in_order(mut curve: Vec<Crossing>, plane: &Plane) -> FlatSection {
    let up = if plane.normal.z.abs() < 0.9 { DVec3::Z } else { DVec3::Y };
    if !is_closed(&curve) {
        if starts_above(&points_of(&curve), up) {
            curve.reverse();
        }
        return FlatSection { crossings: curve, base: None };
    }
    // The first crossing may have joined with the last ones.
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
    FlatSection { crossings: curve, base: (end > 0).then_some(end) }
}

fn points_of(curve: &[Crossing]) -> Vec<DVec3> {
    curve.iter().map(|crossing| crossing.at).collect()
}

/// Whether a curve runs from the trailing edge along the upper side first.
fn starts_above(curve: &[DVec3], up: DVec3) -> bool {
    let te = (curve[0] + curve[curve.len() - 1]) / 2.0;
    let le =
        curve.iter().copied().fold(te, |le, p| if p.distance_squared(te) > le.distance_squared(te) { p } else { le });
    // Forward along the lower side, up round the leading edge and back: a turn from forward to up.
    twice_area(curve).dot((le - te).cross(up)) < 0.0
}

/// Twice the area vector of a curve, closed by the straight line from its end to its start.
pub(super) fn twice_area(curve: &[DVec3]) -> DVec3 {
    let Some(&origin) = curve.first() else { return DVec3::ZERO };
    curve.windows(2).map(|pair| (pair[0] - origin).cross(pair[1] - origin)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lower side of a blunt section ends `by` before the upper one; the base is 0.01 thick.
    ///
    /// Fails if `BEHIND` is 2 or 0.001.
    #[test]
    fn an_open_curve_ends_at_the_trailing_edge_on_both_sides() {
        let section = |by: f64| {
            [(1.0 - by, -0.005), (0.5, -0.06), (0.1, -0.05), (0.0, 0.0), (0.1, 0.05), (0.5, 0.06), (1.0, 0.005)]
                .map(|(x, z)| DVec3::new(x, 0.0, z))
        };
        assert_eq!(short_end(&section(0.05)), None);
        assert_eq!(short_end(&section(0.2)), Some(section(0.2)[0]));
    }
}
