//! Tests whether a section is a simple curve.

use glam::{DVec2, DVec3};

use super::{Plane, extent};

/// Within this share of the size from the trailing edge the two sides may touch, because rounding
/// decides there.
const TRAILING_EDGE: f64 = 5e-3;

/// A point where the two sides of a section cross, if there is one. The time grows with
/// n log n in the number of points, unless much of the curve lies on top of itself.
///
/// - `sides`: from one end of the trailing edge to the other
pub(super) fn crossing(sides: &[DVec3], plane: &Plane) -> Option<DVec3> {
    let (&first, &last) = (sides.first()?, sides.last()?);
    let (u, v) = plane.normal.any_orthonormal_pair();
    let flat: Vec<DVec2> = sides.iter().map(|p| DVec2::new((p - first).dot(u), (p - first).dot(v))).collect();
    let near = TRAILING_EDGE * extent(sides);
    let at_edge = |p: DVec3| p.distance(first).min(p.distance(last)) <= near;
    let boxes = Boxes::new(flat.windows(2).map(|ends| (ends[0].min(ends[1]), ends[0].max(ends[1]))));
    let crosses = |i: usize| {
        let (a, b) = (flat[i], flat[i + 1]);
        boxes.any_over((a.min(b), a.max(b)), i + 2, &mut |j| {
            let (c, d) = (flat[j], flat[j + 1]);
            separates(a, b, c, d) && separates(c, d, a, b)
        })
    };
    (0..flat.len() - 1).find(|&i| !at_edge(sides[i]) && crosses(i)).map(|i| sides[i])
}

/// The lower and the upper corner of a box.
type Box2 = (DVec2, DVec2);

/// A tree of the boxes of consecutive pieces of a curve.
struct Boxes {
    /// Number of leaves, a power of two.
    n_leaves: usize,
    /// The box of each node: the root at 1, the children of node i at 2 i and 2 i + 1. A leaf
    /// without a piece has an empty box.
    nodes: Vec<Box2>,
}

impl Boxes {
    fn new(pieces: impl ExactSizeIterator<Item = Box2>) -> Self {
        let n_leaves = pieces.len().next_power_of_two();
        let empty = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let mut nodes = vec![empty; 2 * n_leaves];
        nodes[n_leaves..].iter_mut().zip(pieces).for_each(|(node, piece)| *node = piece);
        for i in (1..n_leaves).rev() {
            let [a, b] = [nodes[2 * i], nodes[2 * i + 1]];
            nodes[i] = (a.0.min(b.0), a.1.max(b.1));
        }
        Self { n_leaves, nodes }
    }

    /// Whether any piece from `first` on, whose box is not apart from this one, passes a test.
    fn any_over(&self, (low, high): Box2, first: usize, test: &mut dyn FnMut(usize) -> bool) -> bool {
        // Nodes to visit, each with its first piece and its number of pieces.
        let mut waiting = vec![(1, 0, self.n_leaves)];
        while let Some((node, start, count)) = waiting.pop() {
            let (c, d) = self.nodes[node];
            if start + count <= first || (d.cmplt(low) | c.cmpgt(high)).any() {
                continue;
            }
            if count > 1 {
                let half = count / 2;
                waiting.push((2 * node + 1, start + half, half));
                waiting.push((2 * node, start, half));
            } else if test(start) {
                return true;
            }
        }
        false
    }
}

/// Whether `c` and `d` lie strictly on different sides of the line through `a` and `b`.
fn separates(a: DVec2, b: DVec2, c: DVec2, d: DVec2) -> bool {
    (b - a).perp_dot(c - a) * (b - a).perp_dot(d - a) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sides of an open section cross at this place of the chord: behind it the upper one lies
    /// below.
    fn crosses_at(place: f64) -> bool {
        let side = |sign: f64| {
            move |i: i32| {
                let x = f64::from(i) / 1000.0;
                DVec3::new(x, 0.0, sign * 0.2 * x.sqrt() * (place - x))
            }
        };
        let sides: Vec<DVec3> = (1..=1000).rev().map(side(-1.0)).chain((0..=1000).map(side(1.0))).collect();
        crossing(&sides, &Plane { point: DVec3::ZERO, normal: DVec3::Y }).is_some()
    }

    /// Every curve of a few points of a small lattice: the tree finds the first crossing that a
    /// test of all pairs of pieces finds.
    #[test]
    fn the_tree_finds_what_all_pairs_find() {
        let mut state = 7_u64;
        let mut any = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 % 23.0
        };
        let mut counts = [0, 0];
        for n in (3..40).cycle().take(2000) {
            let sides: Vec<DVec3> = (0..n).map(|_| DVec3::new(any(), 0.0, any())).collect();
            let flat: Vec<DVec2> = sides.iter().map(|p| DVec2::new(p.x, p.z)).collect();
            let near = TRAILING_EDGE * extent(&sides);
            let far = |p: DVec3| p.distance(sides[0]).min(p.distance(sides[n - 1])) > near;
            let cross = |i: usize, j: usize| {
                let (a, b, c, d) = (flat[i], flat[i + 1], flat[j], flat[j + 1]);
                separates(a, b, c, d) && separates(c, d, a, b)
            };
            let expected = (0..n - 1).find(|&i| far(sides[i]) && (i + 2..n - 1).any(|j| cross(i, j)));
            let plane = Plane { point: DVec3::ZERO, normal: DVec3::Y };
            assert_eq!(crossing(&sides, &plane), expected.map(|i| sides[i]));
            counts[usize::from(expected.is_some())] += 1;
        }
        assert!(counts.iter().all(|&count| count > 100), "{counts:?}");
    }

    /// The number of pairs that are looked at grows with the number of points, not with its square.
    #[test]
    fn few_pairs_are_looked_at() {
        let looked_at = |n: usize| {
            let at = |i: usize| {
                let angle = std::f64::consts::TAU * i as f64 / n as f64;
                DVec2::new(angle.cos(), 0.1 * angle.sin())
            };
            let flat: Vec<DVec2> = (0..n).map(at).collect();
            let boxes = Boxes::new(flat.windows(2).map(|ends| (ends[0].min(ends[1]), ends[0].max(ends[1]))));
            let mut count = 0;
            for i in 0..n - 1 {
                let (a, b) = (flat[i], flat[i + 1]);
                boxes.any_over((a.min(b), a.max(b)), i + 2, &mut |_| {
                    count += 1;
                    false
                });
            }
            count
        };
        assert!(looked_at(20_000) <= 2 * 20_000, "{}", looked_at(20_000));
    }

    /// Fails if `TRAILING_EDGE` is 0.2 or 0.
    #[test]
    fn sides_may_cross_where_digits_decide() {
        assert!(crosses_at(0.9505));
        assert!(!crosses_at(0.9985));
    }
}
