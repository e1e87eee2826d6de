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
    triangles: Vec<[u32; 3]>,
}

impl Crossings {
    /// A surface of these triangles.
    ///
    /// - `vertices` `[n_vertices]`: about where they will be
    pub fn new(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        Self { tree: TriangleTree::new(vertices, triangles), triangles: triangles.to_vec() }
    }

    /// The triangles that are pierced with the vertices here, ascending.
    ///
    /// - `vertices` `[n_vertices]`, finite
    pub fn pierced(&mut self, vertices: &[DVec3]) -> Vec<u32> {
        if self.triangles.is_empty() {
            return Vec::new();
        }
        self.tree.follow(vertices, &self.triangles);
        let of_pair = |pair: [u32; 2]| {
            let mut found = Vec::new();
            self.tree.each_pair(pair, |a, b| {
                self.add_pierced(&a, &b, &mut found);
                if a.triangles != b.triangles {
                    self.add_pierced(&b, &a, &mut found);
                }
            });
            found
        };
        let mut found: Vec<u32> = self.tree.pairs().into_par_iter().flat_map_iter(of_pair).collect();
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

    /// Adds the triangles of one leaf that edges of another one pass through.
    fn add_pierced(&self, edges: &Leaf, leaf: &Leaf, found: &mut Vec<u32>) {
        for (corners, &triangle) in edges.corners.iter().zip(edges.triangles) {
            let vertices = self.triangles[triangle as usize];
            // Each edge comes once from either side; one of them is enough.
            for [from, to] in [[0, 1], [1, 2], [2, 0]].into_iter().filter(|&[from, to]| vertices[from] < vertices[to]) {
                let ends = [from, to].map(|end| corners[end]);
                let around = bounds(&ends);
                if apart(around, leaf.bounds) {
                    continue;
                }
                for (others, &other) in leaf.corners.iter().zip(leaf.triangles) {
                    if !apart(around, bounds(others)) {
                        let of_other = self.triangles[other as usize];
                        let touch = of_other.contains(&vertices[from]) || of_other.contains(&vertices[to]);
                        if !touch && passes(ends[0], ends[1], *others) {
                            found.push(other);
                        }
                    }
                }
            }
        }
    }
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
