//! [`PathBoxes`] finds the nearest point of a path in small steps without a look at every step.

use std::ops::Range;

use glam::DVec3;

use crate::geometry::{NOWHERE, bounds, nearest_on_segment};

/// A box is left out if it is farther away than the nearest point found so far by this share, and
/// by the other share of the largest coordinate. So rounding leaves out no step that is as near.
const ROUNDING: f64 = 1e-9;
const ROUNDING_OF_COORDINATES: f64 = 1e-15;

/// Steps in a leaf. To look at so many steps takes less time than three more levels of boxes, and
/// the boxes take an eighth of the memory.
const LEAF: usize = 8;

/// A tree of the boxes of a path's steps.
pub(super) struct PathBoxes {
    /// Number of leaves, a power of two.
    n_leaves: usize,
    /// Lower and upper corner of each node's box: the root at 1, the children of node i at 2 i and
    /// 2 i + 1. A leaf without a step has an empty box. Leaf i has the steps from `LEAF` i on.
    nodes: Vec<[DVec3; 2]>,
    /// Square of the rounding of the path's coordinates.
    rounding: f64,
}

impl PathBoxes {
    /// The boxes of a path of at least two points.
    pub fn new(path: &[DVec3]) -> Self {
        let n_leaves = (path.len() - 1).div_ceil(LEAF).next_power_of_two();
        let mut nodes = vec![NOWHERE; 2 * n_leaves];
        for (leaf, node) in nodes[n_leaves..].iter_mut().enumerate().take((path.len() - 1).div_ceil(LEAF)) {
            let steps = LEAF * leaf..(LEAF * (leaf + 1)).min(path.len() - 1);
            *node = bounds(path[steps.start..=steps.end].iter().copied()).unwrap_or(NOWHERE);
        }
        for i in (1..n_leaves).rev() {
            let [a, b] = [nodes[2 * i], nodes[2 * i + 1]];
            nodes[i] = [a[0].min(b[0]), a[1].max(b[1])];
        }
        let largest = path.iter().map(|point| point.abs().max_element()).fold(0.0, f64::max);
        Self { n_leaves, nodes, rounding: (ROUNDING_OF_COORDINATES * largest).powi(2) }
    }

    /// The step of the path with the point nearest to `at`, and the share of the step before this
    /// point. Of steps that are equally near it is the first.
    ///
    /// - `steps`: the steps that count, at least one; step i begins at point i
    pub fn nearest(&self, path: &[DVec3], at: DVec3, steps: Range<usize>) -> (usize, f64) {
        let (_, step, t) = self.search(path, at, steps);
        (step, t)
    }

    /// Square of the distance of a point from the path. NaN if the point is NaN.
    pub fn distance_squared(&self, path: &[DVec3], at: DVec3) -> f64 {
        self.search(path, at, 0..path.len() - 1).0
    }

    /// The square of the distance from the nearest point, and [`Self::nearest`].
    fn search(&self, path: &[DVec3], at: DVec3, steps: Range<usize>) -> (f64, usize, f64) {
        let on_step = |step: usize| {
            let (point, t) = nearest_on_segment(at, path[step], path[step + 1]);
            (point.distance_squared(at), step, t)
        };
        let nearer = |a: (f64, usize, f64), b: (f64, usize, f64)| {
            if a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).is_le() { a } else { b }
        };
        // Any step gives a bound, and the search mostly begins near its end.
        let mut best = nearer(on_step(steps.start + steps.len() / 2), on_step(steps.start));
        let off = |node: usize| {
            let [low, high] = self.nodes[node];
            at.clamp(low.min(high), high.max(low)).distance_squared(at)
        };
        // One node waits on each level, and two on the last: each with the square of its distance,
        // its first step and its number of steps.
        let mut waiting = [(0.0, 0, 0, 0); 2 + usize::BITS as usize];
        waiting[0] = (off(1), 1, 0, LEAF * self.n_leaves);
        let mut n_waiting = 1;
        while n_waiting > 0 {
            n_waiting -= 1;
            let (off_node, node, start, count) = waiting[n_waiting];
            let is_outside = start + count <= steps.start || start >= steps.end;
            // A distance that is no number leaves nothing out.
            if is_outside || off_node > best.0 * (1.0 + ROUNDING) + self.rounding {
                continue;
            }
            if count == LEAF {
                let of_leaf = start.max(steps.start)..(start + LEAF).min(steps.end);
                best = of_leaf.map(on_step).fold(best, nearer);
                continue;
            }
            let half = count / 2;
            let child = |node: usize, start: usize| (off(node), node, start, half);
            let [mut first, mut second] = [child(2 * node, start), child(2 * node + 1, start + half)];
            if second.0 < first.0 {
                (first, second) = (second, first);
            }
            waiting[n_waiting] = second;
            waiting[n_waiting + 1] = first;
            n_waiting += 2;
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Paths on a small lattice, so that many steps are equally near: the tree finds what a look at
    /// every step finds.
    #[test]
    fn the_nearest_of_all_steps_is_found() {
        let mut state = 5_u64;
        let mut any = |below: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) % below
        };
        for n in (2..60).cycle().take(3000) {
            let path: Vec<DVec3> = (0..n).map(|_| DVec3::new(any(9) as f64, any(9) as f64, any(3) as f64)).collect();
            let at = DVec3::new(any(19) as f64 / 2.0, any(19) as f64 / 2.0, any(3) as f64);
            let start = any(n as u64 - 1) as usize;
            let steps = start..start + 1 + any((n - 1 - start) as u64) as usize;
            let all = steps.clone().map(|step| {
                let (point, t) = nearest_on_segment(at, path[step], path[step + 1]);
                (point.distance_squared(at), step, t)
            });
            let (_, step, t) = all.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            let boxes = PathBoxes::new(&path);
            assert_eq!(boxes.nearest(&path, at, steps), (step, t));
            let all = path.windows(2).map(|ends| nearest_on_segment(at, ends[0], ends[1]).0.distance_squared(at));
            assert_eq!(boxes.distance_squared(&path, at), all.fold(f64::INFINITY, f64::min));
        }
    }
}
