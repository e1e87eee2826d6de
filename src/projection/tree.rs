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

    /// Unit normal of one triangle.
    pub fn facet_normal(&self, triangle: u32) -> DVec3 {
        unit_normal(self.corners[self.place[triangle as usize] as usize])
    }
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
