//! Self-intersections of surfaces. The mesh of such a surface overlaps itself, although every tet
//! may have positive volume.

use glam::DVec3;
use rayon::prelude::*;

use super::tree::{Leaf, TriangleTree};
use crate::geometry::{NOWHERE, apart, bounds, triangle_normal};

/// An end of an edge is beyond a triangle's plane if its distance exceeds this fraction of the
/// edge. Rounding in flat surfaces far from the origin stays below the limit. A smaller
/// intersection is not found.
const BEYOND: f64 = 1e-6;

/// A surface that is tested for self-intersections. Set up once per mesh.
///
/// A triangle is *self-intersecting* if an edge of another triangle passes through it. Edges that
/// share a vertex with the triangle do not count, because neighbours touch.
pub struct Crossings {
    tree: TriangleTree,
    /// Vertices of each triangle, in the order of the tree `[n_triangles]`.
    triangles: Vec<[u32; 3]>,
    /// The box around each triangle at the last test `[n_triangles]`, in the order of the tree.
    boxes: Vec<[DVec3; 2]>,
    /// What the last test found, at the corners that the tree has. `None` before the first test.
    last: Option<Vec<Pierced>>,
}

/// A triangle and another one, an edge of which passes through it, by their places in the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Pierced {
    triangle: usize,
    by: usize,
}

impl Crossings {
    /// Sets up the test.
    ///
    /// - `vertices` `[n_vertices]`: positions near the later ones, in the mesh's unit
    /// - `triangles` `[n_triangles]`
    pub fn new(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let tree = TriangleTree::new(vertices, triangles);
        let triangles: Vec<_> = tree.order().iter().map(|&triangle| triangles[triangle as usize]).collect();
        Self { tree, boxes: vec![[DVec3::ZERO; 2]; triangles.len()], triangles, last: None }
    }

    /// The self-intersecting triangles, ascending. Pairs of triangles that both are where the last
    /// test had them are not tested again.
    ///
    /// - `vertices` `[n_vertices]`: positions, finite, in the mesh's unit
    pub fn self_intersecting(&mut self, vertices: &[DVec3]) -> Vec<u32> {
        let is_new = self.moved_since(vertices);
        if is_new.contains(&true) {
            self.tree.follow(vertices, &self.triangles);
            for (around, corners) in self.boxes.iter_mut().zip(self.tree.corners()) {
                *around = bounds(*corners).unwrap_or(NOWHERE);
            }
            let of_pair = |pair: [u32; 2]| {
                let mut found = Vec::new();
                self.tree.each_pair(pair, |a, b| self.add_intersecting(&a, &b, &is_new, &mut found));
                found
            };
            let mut found: Vec<Pierced> = self.tree.pairs().into_par_iter().flat_map_iter(of_pair).collect();
            let stays = |pierced: &Pierced| !is_new[pierced.triangle] && !is_new[pierced.by];
            found.extend(self.last.iter().flatten().copied().filter(stays));
            self.last = Some(found);
        }
        let pierced = self.last.iter().flatten();
        let mut found: Vec<u32> = pierced.map(|pierced| self.tree.order()[pierced.triangle]).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Whether each triangle is elsewhere than at the last test `[n_triangles]`, in the order of
    /// the tree.
    fn moved_since(&self, vertices: &[DVec3]) -> Vec<bool> {
        if self.last.is_none() {
            return vec![true; self.triangles.len()];
        }
        let elsewhere = |(triangle, corners): (&[u32; 3], &[DVec3; 3])| {
            triangle.iter().zip(corners).any(|(&vertex, corner)| vertices[vertex as usize] != *corner)
        };
        self.triangles.iter().zip(self.tree.corners()).map(elsewhere).collect()
    }

    /// The triangles that are self-intersecting after a motion and were not before, ascending.
    /// Empty if a moved position is not finite.
    ///
    /// - `original` `[n_vertices]`: finite positions; `moved` `[n_vertices]`
    pub fn newly_self_intersecting(&mut self, original: &[DVec3], moved: &[DVec3]) -> Vec<u32> {
        if moved.iter().any(|at| !at.is_finite()) {
            return Vec::new();
        }
        let mut now = self.self_intersecting(moved);
        if !now.is_empty() {
            let before = self.self_intersecting(original);
            now.retain(|triangle| before.binary_search(triangle).is_err());
        }
        now
    }

    /// Adds the self-intersecting triangles of a pair of leaves, or of one leaf with itself.
    ///
    /// - `is_new` `[n_triangles]`: pairs without such a triangle are left out
    fn add_intersecting(&self, a: &Leaf, b: &Leaf, is_new: &[bool], found: &mut Vec<Pierced>) {
        for first in a.places.clone() {
            let around = self.boxes[first];
            if apart(around, b.bounds) {
                continue;
            }
            let of_first = self.triangles[first];
            for second in b.places.clone() {
                if !(is_new[first] || is_new[second]) {
                    continue;
                }
                // Within a leaf each pair comes twice, and a triangle also with itself.
                if (a.places == b.places && second <= first) || apart(around, self.boxes[second]) {
                    continue;
                }
                let of_second = self.triangles[second];
                let common = of_first.map(|vertex| of_second.contains(&vertex));
                // With two common vertices every edge touches the other triangle.
                if common.iter().filter(|common| **common).count() > 1 {
                    continue;
                }
                let [first_corners, second_corners] = [&self.tree.corners()[first], &self.tree.corners()[second]];
                let above = Heights::new(first_corners, second_corners);
                // If a triangle lies on one side of the other's plane, no edge of either passes
                // through the other.
                if above.on_one_side(common) {
                    continue;
                }
                if above.passes(of_first, first_corners, of_second, second_corners) {
                    found.push(Pierced { triangle: second, by: first });
                }
                let above = Heights::new(second_corners, first_corners);
                if above.passes(of_second, second_corners, of_first, first_corners) {
                    found.push(Pierced { triangle: first, by: second });
                }
            }
        }
    }
}

/// Whether an edge of one of two triangles passes through the other, as for [`Crossings`].
///
/// - `vertices` `[n_vertices]`: positions, in any unit
/// - `a`, `b`: vertices of the triangles
pub fn crosses(vertices: &[DVec3], a: [u32; 3], b: [u32; 3]) -> bool {
    let corners = |triangle: [u32; 3]| triangle.map(|vertex| vertices[vertex as usize]);
    let (of_a, of_b) = (corners(a), corners(b));
    a.iter().filter(|vertex| b.contains(vertex)).count() <= 1
        && (Heights::new(&of_a, &of_b).passes(a, &of_a, b, &of_b)
            || Heights::new(&of_b, &of_a).passes(b, &of_b, a, &of_a))
}

/// Heights of a triangle's corners above the plane of another triangle.
struct Heights {
    /// Height of each corner, times the length of `normal`.
    above: [f64; 3],
    /// Normal of the other triangle. Its length is twice the area.
    normal: DVec3,
}

impl Heights {
    fn new(corners: &[DVec3; 3], other: &[DVec3; 3]) -> Self {
        let normal = triangle_normal(*other);
        Self { above: corners.map(|corner| normal.dot(corner - other[0])), normal }
    }

    /// Whether all corners, except those left out, are above the plane, or all are below.
    fn on_one_side(&self, left_out: [bool; 3]) -> bool {
        let all = |is_there: fn(f64) -> bool| (0..3).all(|at| left_out[at] || is_there(self.above[at]));
        all(|above| above > 0.0) || all(|above| above < 0.0)
    }

    /// Whether an edge of the triangle passes through the inside of the other triangle without
    /// touching its boundary.
    fn passes(&self, vertices: [u32; 3], corners: &[DVec3; 3], of_other: [u32; 3], &[a, b, c]: &[DVec3; 3]) -> bool {
        for [from, to] in [[0, 1], [1, 2], [2, 0]] {
            // Each edge occurs once in each direction; one of them is enough.
            if vertices[from] > vertices[to] || (self.above[from] > 0.0) == (self.above[to] > 0.0) {
                continue;
            }
            if of_other.contains(&vertices[from]) || of_other.contains(&vertices[to]) {
                continue;
            }
            let (from, to, before, behind) = (corners[from], corners[to], self.above[from], self.above[to]);
            let beyond = BEYOND * from.distance(to) * self.normal.length();
            if before.abs() <= beyond || behind.abs() <= beyond {
                continue;
            }
            let side = |p: DVec3, q: DVec3| (to - from).dot((p - from).cross(q - from));
            let sides = [side(a, b), side(b, c), side(c, a)];
            if sides.iter().all(|&side| side > 0.0) || sides.iter().all(|&side| side < 0.0) {
                return true;
            }
        }
        false
    }
}
