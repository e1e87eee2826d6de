//! A tree of bounding boxes over triangles, in flat arrays, for closest points and pairs of
//! overlapping boxes.

use std::ops::Range;

use glam::DVec3;

use super::Closest;
use crate::geometry::{NOWHERE, apart, bounds, closest_on_triangle, corners, unit_normal};

const LEAF: usize = 4;

#[derive(Clone, Copy, Debug)]
struct Node {
    low: DVec3,
    high: DVec3,
    /// First triangle of a leaf, or index of the second child. The first child follows its parent.
    start: u32,
    /// Number of triangles of a leaf, 0 for an inner node.
    count: u32,
}

/// A tree of bounding boxes over triangles.
#[derive(Clone, Debug)]
pub struct TriangleTree {
    nodes: Vec<Node>,
    corners: Vec<[DVec3; 3]>,
    index: Vec<u32>,
    /// Index in `corners` of each triangle `[n_triangles]`.
    place: Vec<u32>,
}

/// A leaf of the tree.
pub(super) struct Leaf {
    /// Lowest and highest corner of the leaf's box.
    pub(super) bounds: [DVec3; 2],
    /// Range of the leaf's triangles in the order of the tree.
    pub(super) places: Range<usize>,
}

impl TriangleTree {
    /// Builds the tree in `O(n log n)`.
    ///
    /// - `points` `[n_points]`: in any unit
    /// - `triangles` `[n_triangles]`
    pub fn new(points: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let corners: Vec<[DVec3; 3]> = triangles.iter().map(|&triangle| corners(points, triangle)).collect();
        let centres: Vec<DVec3> = corners.iter().map(|[a, b, c]| (a + b + c) / 3.0).collect();
        let mut index: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut nodes = Vec::with_capacity(triangles.len());
        if !index.is_empty() {
            split(&corners, &centres, &mut index, 0, &mut nodes);
        }
        let mut place = vec![0; triangles.len()];
        index.iter().enumerate().for_each(|(at, &triangle)| place[triangle as usize] = at as u32);
        Self { nodes, corners: index.iter().map(|&triangle| corners[triangle as usize]).collect(), index, place }
    }

    /// The closest point of the triangles. Among equally near triangles the lowest index wins.
    ///
    /// # Panics
    /// The tree is empty.
    pub fn closest(&self, at: DVec3) -> Closest {
        assert!(!self.nodes.is_empty(), "a surface to project onto has triangles");
        let mut best =
            Closest { point: at, triangle: u32::MAX, barycentric: [0.0; 3], distance_squared: f64::INFINITY };
        let mut stack = Vec::with_capacity(64);
        stack.push((0u32, box_distance(&self.nodes[0], at)));
        while let Some((node, distance)) = stack.pop() {
            if distance > best.distance_squared {
                continue;
            }
            let Node { start, count, .. } = self.nodes[node as usize];
            if count == 0 {
                let (near, far) = (node + 1, start);
                let near_distance = box_distance(&self.nodes[near as usize], at);
                let far_distance = box_distance(&self.nodes[far as usize], at);
                if near_distance < far_distance {
                    stack.extend([(far, far_distance), (near, near_distance)]);
                } else {
                    stack.extend([(near, near_distance), (far, far_distance)]);
                }
                continue;
            }
            for slot in start as usize..(start + count) as usize {
                let (point, barycentric) = closest_on_triangle(at, self.corners[slot]);
                let distance_squared = (point - at).length_squared();
                let triangle = self.index[slot];
                if distance_squared < best.distance_squared
                    || distance_squared == best.distance_squared && triangle < best.triangle
                {
                    best = Closest { point, triangle, barycentric, distance_squared };
                }
            }
        }
        best
    }

    /// The place on a line where it crosses the triangles nearest to its start, as the distance
    /// from there. `None` if there is no crossing within `reach` on either side.
    ///
    /// - `direction`: unit vector
    pub(super) fn crossing(&self, from: DVec3, direction: DVec3, reach: f64) -> Option<f64> {
        let mut nearest: Option<f64> = None;
        let mut stack: Vec<u32> = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(node) = stack.pop() {
            let Node { low, high, start, count } = self.nodes[node as usize];
            let limit = nearest.map_or(reach, f64::abs);
            if !meets([low, high], from, direction, limit) {
                continue;
            }
            if count == 0 {
                stack.extend([start, node + 1]);
                continue;
            }
            for corners in &self.corners[start as usize..(start + count) as usize] {
                let travel = crossing_of(*corners, from, direction);
                nearest = travel.filter(|travel| travel.abs() <= nearest.map_or(reach, f64::abs)).or(nearest);
            }
        }
        nearest
    }

    /// The triangles in the order of the tree, in which neighbours get close numbers
    /// `[n_triangles]`.
    pub(super) fn order(&self) -> &[u32] {
        &self.index
    }

    /// The corners of the triangles, in the order of the tree `[n_triangles]`.
    pub(super) fn corners(&self) -> &[[DVec3; 3]] {
        &self.corners
    }

    /// Moves the boxes to new positions of the points. The tree keeps its division, so it is fast
    /// as long as neighbours stay neighbours.
    ///
    /// - `points` `[n_points]`
    /// - `triangles` `[n_triangles]`: in the order of the tree
    pub(super) fn follow(&mut self, points: &[DVec3], triangles: &[[u32; 3]]) {
        for (own, triangle) in self.corners.iter_mut().zip(triangles) {
            *own = corners(points, *triangle);
        }
        for at in (0..self.nodes.len()).rev() {
            let Node { start, count, .. } = self.nodes[at];
            let [low, high] = if count == 0 {
                let (first, second) = (self.nodes[at + 1], self.nodes[start as usize]);
                [first.low.min(second.low), first.high.max(second.high)]
            } else {
                let of_leaf = self.corners[start as usize..(start + count) as usize].as_flattened();
                bounds(of_leaf.iter().copied()).unwrap_or(NOWHERE)
            };
            self.nodes[at] = Node { low, high, start, count };
        }
    }

    /// Pairs of nodes that together hold all pairs of triangles whose boxes overlap: some tens of
    /// tasks for [`Self::each_pair`].
    pub(super) fn pairs(&self) -> Vec<[u32; 2]> {
        let (mut pairs, mut of_leaves) = (vec![[0, 0]], Vec::new());
        for _ in 0..6 {
            let mut divided = Vec::new();
            of_leaves.extend(pairs.into_iter().filter(|&pair| !self.divide(pair, &mut divided)));
            pairs = divided;
        }
        pairs.extend(of_leaves);
        pairs
    }

    /// Visits the pairs of leaves below a pair of nodes whose boxes overlap, each pair once. A leaf
    /// with itself is a pair too.
    pub(super) fn each_pair(&self, pair: [u32; 2], mut visit: impl FnMut(Leaf, Leaf)) {
        let mut pairs = vec![pair];
        while let Some([a, b]) = pairs.pop() {
            if !self.divide([a, b], &mut pairs) {
                visit(self.leaf(a), self.leaf(b));
            }
        }
    }

    /// Replaces a pair of nodes by pairs of their children in `pairs`. Adds nothing if the boxes do
    /// not overlap. Returns `false` for two leaves, which cannot be divided.
    fn divide(&self, [a, b]: [u32; 2], pairs: &mut Vec<[u32; 2]>) -> bool {
        let [of_a, of_b] = [a, b].map(|node| &self.nodes[node as usize]);
        if a == b {
            if of_a.count == 0 {
                pairs.push([a + 1, a + 1]);
                pairs.push([of_a.start, of_a.start]);
                pairs.push([a + 1, of_a.start]);
            }
            return of_a.count == 0;
        }
        if apart([of_a.low, of_a.high], [of_b.low, of_b.high]) {
            return true;
        }
        let size = |node: &Node| node.high.distance_squared(node.low);
        match (of_a.count == 0, of_b.count == 0) {
            (false, false) => return false,
            (true, inner) if !inner || size(of_a) >= size(of_b) => {
                pairs.push([a + 1, b]);
                pairs.push([of_a.start, b]);
            }
            _ => {
                pairs.push([a, b + 1]);
                pairs.push([a, of_b.start]);
            }
        }
        true
    }

    fn leaf(&self, node: u32) -> Leaf {
        let Node { low, high, start, count } = self.nodes[node as usize];
        Leaf { bounds: [low, high], places: start as usize..(start + count) as usize }
    }

    /// The corners of one triangle.
    pub(super) fn corners_of(&self, triangle: u32) -> [DVec3; 3] {
        self.corners[self.place[triangle as usize] as usize]
    }

    /// Unit normal of one triangle.
    pub fn facet_normal(&self, triangle: u32) -> DVec3 {
        unit_normal(self.corners_of(triangle))
    }
}

/// Whether a line passes through a box, not farther than `reach` from its start. Boxes are a little
/// larger than they are, so that rounding loses none.
fn meets([low, high]: [DVec3; 2], from: DVec3, direction: DVec3, reach: f64) -> bool {
    let slack = 1e-12 * (high - low).max_element().max(from.abs().max_element());
    let (mut first, mut last) = (-reach, reach);
    for axis in 0..3 {
        let ends = [low[axis] - slack - from[axis], high[axis] + slack - from[axis]];
        if direction[axis] == 0.0 {
            if ends[0] > 0.0 || ends[1] < 0.0 {
                return false;
            }
            continue;
        }
        let [a, b] = ends.map(|end| end / direction[axis]);
        (first, last) = (first.max(a.min(b)), last.min(a.max(b)));
    }
    first <= last
}

/// The place on a line where it crosses a triangle, as the distance from its start. Lines through
/// an edge cross both triangles beside it.
///
/// The line `f + t d` meets the plane `a + u (b - a) + v (c - a)` where Cramer's rule has t, u, v.
fn crossing_of([a, b, c]: [DVec3; 3], from: DVec3, direction: DVec3) -> Option<f64> {
    /// Slack of `u`, `v` and `1 - u - v` for rounding.
    const EDGE: f64 = 1e-9;
    let (one, two, start) = (b - a, c - a, from - a);
    let normal = one.cross(two);
    let slope = -direction.dot(normal);
    let across = start.cross(direction);
    let [u, v] = [two.dot(across) / slope, -one.dot(across) / slope];
    let travel = start.dot(normal) / slope;
    (u >= -EDGE && v >= -EDGE && u + v <= 1.0 + EDGE && travel.is_finite()).then_some(travel)
}

/// Builds the node for the triangles in `index`, whose first element has the place `offset` in the
/// whole order.
fn split(corners: &[[DVec3; 3]], centres: &[DVec3], index: &mut [u32], offset: usize, nodes: &mut Vec<Node>) {
    let [low, high] = bounds(index.iter().flat_map(|&triangle| corners[triangle as usize])).unwrap_or(NOWHERE);
    let this = nodes.len();
    nodes.push(Node { low, high, start: offset as u32, count: index.len() as u32 });
    if index.len() <= LEAF {
        return;
    }
    let [first, last] = bounds(index.iter().map(|&triangle| centres[triangle as usize])).unwrap_or(NOWHERE);
    let axis = (last - first).max_position();
    let middle = index.len() / 2;
    index.select_nth_unstable_by(middle, |&a, &b| {
        centres[a as usize][axis].total_cmp(&centres[b as usize][axis]).then(a.cmp(&b))
    });
    let (first, second) = index.split_at_mut(middle);
    split(corners, centres, first, offset, nodes);
    nodes[this].start = nodes.len() as u32;
    nodes[this].count = 0;
    split(corners, centres, second, offset + middle, nodes);
}

fn box_distance(node: &Node, at: DVec3) -> f64 {
    (at.clamp(node.low, node.high) - at).length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Crossings of lines with a grid of triangles over the unit square, whose height is known. Of
    /// two layers the nearer one counts, on either side of the start.
    #[test]
    fn lines_cross_where_they_should() {
        let mut points = Vec::new();
        let mut triangles = Vec::new();
        for height in [0.0, 0.5] {
            let first = points.len() as u32;
            for k in 0..81 {
                points.push(DVec3::new(f64::from(k % 9) / 8.0, f64::from(k / 9) / 8.0, height));
            }
            for cell in 0..64 {
                let a = first + cell / 8 * 9 + cell % 8;
                triangles.extend([[a, a + 1, a + 10], [a, a + 10, a + 9]]);
            }
        }
        let tree = TriangleTree::new(&points, &triangles);
        for k in 0..200 {
            let t = f64::from(k);
            let at = DVec3::new(0.5 + 0.4 * (1.3 * t).sin(), 0.5 + 0.4 * (0.7 * t).cos(), 0.0);
            let direction = DVec3::new(0.3 * (2.1 * t).cos(), 0.3 * (1.7 * t).sin(), 1.0).normalize();
            for travel in [0.11, -0.13] {
                let found = tree.crossing(at - travel * direction, direction, 1.0).unwrap();
                assert!((found - travel).abs() < 1e-12, "{k}: {found} {travel}");
            }
        }
        // Through a corner of eight triangles, past the edge, along the layer, and too far.
        let corner = DVec3::new(0.5, 0.5, -0.2);
        assert!((tree.crossing(corner, DVec3::Z, 1.0).unwrap() - 0.2).abs() < 1e-12);
        assert_eq!(tree.crossing(DVec3::new(1.1, 0.5, -0.2), DVec3::Z, 1.0), None);
        assert_eq!(tree.crossing(DVec3::new(-1.0, 0.5, 0.2), DVec3::X, 9.0), None);
        assert_eq!(tree.crossing(corner, DVec3::Z, 0.1), None);
    }
}
