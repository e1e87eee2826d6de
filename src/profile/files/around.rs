//! Curves of airfoils that start elsewhere than at a corner of the trailing edge.
//!
//! A file in Selig's order starts at one corner of the trailing edge and ends at the other one. The
//! straight line from its end to its start is then the base, or there is no such line. In any other
//! file this line goes on along the curve: along a side, or along the base, in the middle of which
//! the file starts.

use glam::{DVec2, DVec3};

use crate::profile::edges::{CORNER, TrailingEdge, trailing_edge, turn};

/// A gap wider than this multiple of the segments beside it is no segment of a side.
const GAP: f64 = 3.0;

/// A gap wider than this share of the greatest extent is no segment of a side.
const FAR: f64 = 0.5;

/// Fewest points of a curve round an airfoil.
const FEWEST: usize = 4;

/// The points of a curve that comes back to its start, from the trailing edge round to the trailing
/// edge. The curve is open where a single segment is the blunt trailing edge, and otherwise closed.
/// `None` if the points do not come back, or start and end at the corners of a base as they are.
///
/// - `points` `[n_points]`: in order along the curve; the last one may repeat the first
pub(super) fn turned_to_trailing_edge(points: &[DVec2]) -> Option<Vec<DVec2>> {
    let is_closed = points.len() > 1 && points[0] == points[points.len() - 1];
    let curve = &points[usize::from(is_closed)..];
    let n = curve.len();
    if n < FEWEST - usize::from(is_closed) {
        return None;
    }
    let ring: Vec<DVec3> = curve.iter().map(|point| point.extend(0.0)).collect();
    let TrailingEdge { start, end, .. } = trailing_edge(&ring);
    let base: Vec<usize> = (0..=(start + n - end) % n).map(|step| (end + step) % n).collect();
    let has_gap = base.windows(2).any(|pair| pair[1] == 0);
    let is_smooth_base = base.iter().skip(1).rev().skip(1).all(|&i| turn(&ring, i) < CORNER);
    if !is_closed {
        if has_gap && (base.len() == 2 || !is_smooth_base) {
            return None;
        }
        if !has_gap && !continues(curve, &ring) {
            return None;
        }
    }
    let mut turned = curve.to_vec();
    turned.rotate_left(start);
    if base.len() != 2 {
        turned.push(turned[0]);
    }
    Some(turned)
}

/// Whether the line from the end of an open curve to its start is a segment of a side: about as
/// long as the segments beside it, without a corner at one of its ends.
fn continues(curve: &[DVec2], ring: &[DVec3]) -> bool {
    let n = curve.len();
    let gap = curve[0].distance(curve[n - 1]);
    let beside = curve[0].distance(curve[1]).max(curve[n - 2].distance(curve[n - 1]));
    let low = curve.iter().copied().fold(DVec2::INFINITY, DVec2::min);
    let high = curve.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
    let is_smooth = turn(ring, 0) < CORNER || turn(ring, n - 1) < CORNER;
    is_smooth && gap <= GAP * beside && gap <= FAR * (high - low).max_element()
}

/// Whether points go on without a corner at a point and at the one before it.
pub(super) fn is_smooth(points: &[DVec2], at: usize) -> bool {
    let ring: Vec<DVec3> = points.iter().map(|point| point.extend(0.0)).collect();
    points[at] != points[at - 1] && turn(&ring, at) < CORNER && turn(&ring, at - 1) < CORNER
}
