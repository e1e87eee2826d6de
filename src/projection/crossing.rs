//! Surfaces that pass through themselves: their mesh overlaps itself, though every tet may have a positive volume.

use glam::DVec3;
use rayon::prelude::*;

use super::TriangleTree;

/// An end of an edge is beyond a triangle's plane when it is further from it than this fraction of the edge. Rounding in
/// flat surfaces far from the origin stays below; what passes through by less than this goes unseen.
const BEYOND: f64 = 1e-6;

/// The triangles that an edge of another one passes through, ascending. Triangles with a vertex in common with the edge
/// are left out: neighbours touch.
///
/// - `vertices` `[n_vertices]`, finite
pub fn pierced(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Vec<u32> {
    if triangles.is_empty() {
        return Vec::new();
    }
    let tree = TriangleTree::new(vertices, triangles);
    let at = |vertex: u32| vertices[vertex as usize];
    let of_triangle = |&[a, b, c]: &[u32; 3]| {
        let mut found = Vec::new();
        // Each edge comes once from either side; one of them is enough.
        for (from, to) in [(a, b), (b, c), (c, a)].into_iter().filter(|(from, to)| from < to) {
            tree.each_overlapping(at(from).min(at(to)), at(from).max(at(to)), |other| {
                let corners = triangles[other as usize];
                if !corners.contains(&from) && !corners.contains(&to) && passes(at(from), at(to), corners.map(at)) {
                    found.push(other);
                }
            });
        }
        found
    };
    let mut found: Vec<u32> = triangles.par_iter().flat_map_iter(of_triangle).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// The triangles that are pierced after a motion and were not before, ascending; none where a vertex is no place, of
/// which nothing can be said.
///
/// - `original` `[n_vertices]`, finite; `moved` `[n_vertices]`
pub fn pierced_anew(original: &[DVec3], moved: &[DVec3], triangles: &[[u32; 3]]) -> Vec<u32> {
    if moved.iter().any(|at| !at.is_finite()) {
        return Vec::new();
    }
    let mut now = pierced(moved, triangles);
    if !now.is_empty() {
        let before = pierced(original, triangles);
        now.retain(|triangle| before.binary_search(triangle).is_err());
    }
    now
}

/// Whether a segment passes through the inside of a triangle.
fn passes(from: DVec3, to: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let beyond = BEYOND * from.distance(to);
    let (before, behind) = (normal.dot(from - a), normal.dot(to - a));
    if before.abs() <= beyond || behind.abs() <= beyond || (before > 0.0) == (behind > 0.0) {
        return false;
    }
    let side = |p: DVec3, q: DVec3| (to - from).dot((p - from).cross(q - from));
    let sides = [side(a, b), side(b, c), side(c, a)];
    sides.iter().all(|&side| side > 0.0) || sides.iter().all(|&side| side < 0.0)
}
