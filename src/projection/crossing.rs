//! Surfaces that pass through themselves: their mesh overlaps itself, though every tet may have a positive volume.

use glam::DVec3;
use rayon::prelude::*;

use super::tree::{Leaf, TriangleTree, apart, bounds};

/// An end of an edge is beyond a triangle's plane when it is further from it than this fraction of the edge. Rounding in
/// flat surfaces far from the origin stays below; what passes through by less than this goes unseen.
const BEYOND: f64 = 1e-6;

/// A surface that is watched for passing through itself.
///
/// A triangle is *pierced* when an edge of another one passes through it. Triangles with a vertex in common with the edge
/// are left out: neighbours touch.
pub struct Crossings {
    tree: TriangleTree,
    /// Vertices of each triangle, in the order of the tree `[n_triangles]`.
    triangles: Vec<[u32; 3]>,
    /// The box around each, where it was looked at last `[n_triangles]`.
    boxes: Vec<[DVec3; 2]>,
}

impl Crossings {
    /// A surface of these triangles.
    ///
    /// - `vertices` `[n_vertices]`: about where they will be
    pub fn new(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let tree = TriangleTree::new(vertices, triangles);
        let triangles: Vec<_> = tree.order().iter().map(|&triangle| triangles[triangle as usize]).collect();
        Self { tree, boxes: vec![[DVec3::ZERO; 2]; triangles.len()], triangles }
    }

    /// The triangles that are pierced with the vertices here, ascending.
    ///
    /// - `vertices` `[n_vertices]`, finite
    pub fn pierced(&mut self, vertices: &[DVec3]) -> Vec<u32> {
        if self.triangles.is_empty() {
            return Vec::new();
        }
        self.tree.follow(vertices, &self.triangles);
        for (around, corners) in self.boxes.iter_mut().zip(self.tree.corners()) {
            *around = bounds(corners);
        }
        let of_pair = |pair: [u32; 2]| {
            let mut found = Vec::new();
            self.tree.each_pair(pair, |a, b| self.add_pierced(&a, &b, &mut found));
            found
        };
        let found: Vec<usize> = self.tree.pairs().into_par_iter().flat_map_iter(of_pair).collect();
        let mut found: Vec<u32> = found.into_iter().map(|place| self.tree.order()[place]).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// The triangles that are pierced after a motion and were not before, ascending; none where a vertex is no place, of
    /// which nothing can be said.
    ///
    /// - `original` `[n_vertices]`, finite; `moved` `[n_vertices]`
    pub fn pierced_anew(&mut self, original: &[DVec3], moved: &[DVec3]) -> Vec<u32> {
        if moved.iter().any(|at| !at.is_finite()) {
            return Vec::new();
        }
        let mut now = self.pierced(moved);
        if !now.is_empty() {
            let before = self.pierced(original);
            now.retain(|triangle| before.binary_search(triangle).is_err());
        }
        now
    }

    /// Adds the triangles of two leaves, or of one with itself, that edges of the other one pass through, by their places.
    fn add_pierced(&self, a: &Leaf, b: &Leaf, found: &mut Vec<usize>) {
        for first in a.places.clone() {
            let around = self.boxes[first];
            if apart(around, b.bounds) {
                continue;
            }
            let of_first = self.triangles[first];
            for second in b.places.clone() {
                // Within a leaf each pair comes twice, and a triangle with itself.
                if (a.places == b.places && second <= first) || apart(around, self.boxes[second]) {
                    continue;
                }
                let of_second = self.triangles[second];
                let common = of_first.iter().filter(|vertex| of_second.contains(vertex)).count();
                // Where two vertices are common, every edge touches the other triangle.
                if common > 1 {
                    continue;
                }
                let [first_corners, second_corners] = [&self.tree.corners()[first], &self.tree.corners()[second]];
                if passes(of_first, first_corners, of_second, second_corners) {
                    found.push(second);
                }
                if passes(of_second, second_corners, of_first, first_corners) {
                    found.push(first);
                }
            }
        }
    }
}

/// Whether an edge of a triangle passes through the inside of another one and does not touch it.
fn passes(vertices: [u32; 3], corners: &[DVec3; 3], of_other: [u32; 3], &[a, b, c]: &[DVec3; 3]) -> bool {
    let normal = (b - a).cross(c - a);
    let beside = [normal.dot(corners[0] - a), normal.dot(corners[1] - a), normal.dot(corners[2] - a)];
    for [from, to] in [[0, 1], [1, 2], [2, 0]] {
        // Each edge comes once from either side; one of them is enough.
        if vertices[from] > vertices[to] || (beside[from] > 0.0) == (beside[to] > 0.0) {
            continue;
        }
        if of_other.contains(&vertices[from]) || of_other.contains(&vertices[to]) {
            continue;
        }
        let (from, to, before, behind) = (corners[from], corners[to], beside[from], beside[to]);
        let beyond = BEYOND * from.distance(to) * normal.length();
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
