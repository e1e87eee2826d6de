//! Joins the two sides of an airfoil to one curve, from the trailing edge round the leading edge
//! and back. Checks that the curve has the origin and the chord that a placement assumes.

use std::path::Path;

use glam::{DVec2, DVec3};

use super::around::{is_smooth, turned_to_trailing_edge};
use super::fail;
use crate::geometry::nearest_on_segment;
use crate::profile::ProfileError;

/// Two points farther apart than this share of the chord do not follow each other along a side. A
/// side has at least this extent.
const FAR: f64 = 0.5;

/// A curve ends at the trailing edge if its ends are behind all but this share of the chord.
const END: f64 = 0.05;

/// No points have this range.
const NO_RANGE: (f64, f64) = (f64::INFINITY, f64::NEG_INFINITY);

/// The least and the greatest x of some points.
fn range(points: &[DVec2]) -> (f64, f64) {
    points.iter().fold(NO_RANGE, with)
}

/// A range with one more point.
fn with((low, high): (f64, f64), point: &DVec2) -> (f64, f64) {
    #[cfg(test)]
    tests::LOOKED_AT.set(tests::LOOKED_AT.get() + 1);
    (low.min(point.x), high.max(point.x))
}

/// Points with the ranges of both parts into which any point divides them. A file may have a blank
/// line, or a jump, at every point.
struct Divided<'p> {
    points: &'p [DVec2],
    /// The range of the points before each point, and of all points `[n_points + 1]`.
    before: Vec<(f64, f64)>,
    /// The range of the points from each point on, and of none `[n_points + 1]`.
    from: Vec<(f64, f64)>,
}

impl<'p> Divided<'p> {
    fn new(points: &'p [DVec2]) -> Self {
        let ranges = |range: &mut (f64, f64), point: &DVec2| {
            *range = with(*range, point);
            Some(*range)
        };
        let before = std::iter::once(NO_RANGE).chain(points.iter().scan(NO_RANGE, ranges)).collect();
        let mut from: Vec<_> = std::iter::once(NO_RANGE).chain(points.iter().rev().scan(NO_RANGE, ranges)).collect();
        from.reverse();
        Self { points, before, from }
    }

    /// Whether both parts are as long as a side.
    fn is_between_sides(&self, at: usize) -> bool {
        let is_side = |(low, high): (f64, f64)| high - low >= FAR * self.chord();
        is_side(self.before[at]) && is_side(self.from[at])
    }

    fn chord(&self) -> f64 {
        let (low, high) = self.from[0];
        high - low
    }

    /// Whether the points before `at` are a closed curve of their own.
    fn is_ring_before(&self, at: usize) -> bool {
        is_ring(&self.points[..at], self.before[at])
    }

    /// Whether the points from `at` on are a closed curve of their own.
    fn is_ring_from(&self, at: usize) -> bool {
        is_ring(&self.points[at..], self.from[at])
    }
}

/// Whether points with this range are a closed curve. Both sides of an element end at its trailing
/// edge, and a side of an airfoil ends at both edges.
fn is_ring(points: &[DVec2], (low, high): (f64, f64)) -> bool {
    let is_at_end = |point: Option<&DVec2>| point.is_some_and(|point| point.x >= high - END * (high - low));
    points.len() > 3 && is_at_end(points.first()) && is_at_end(points.last())
}

/// The first point of the second side, as far as the file gives it.
pub(super) enum Break<'a> {
    /// The index of the point.
    At(usize),
    /// Candidates: the points after blank lines.
    Perhaps(&'a [usize]),
}

/// The curve from one side of the trailing edge round the leading edge to the other.
///
/// - `lines` `[n_points]`: line of each point, from 0
/// - `points` `[n_points]`: one curve, or both sides, each in either direction
///
/// # Errors
/// [`ProfileError::Line`]
pub(super) fn join(path: &Path, lines: &[usize], points: &[DVec2], second: &Break) -> Result<Vec<DVec2>, ProfileError> {
    let (low, high) = range(points);
    let (chord, middle) = (high - low, 0.5 * (low + high));
    let is_trailing = |point: &DVec2| point.x > middle;
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return Ok(Vec::new()) };
    let divided = Divided::new(points);
    if let Some(element) = second_element(&divided, second) {
        let what = "a second closed curve begins, another element".to_string();
        let expected = "an airfoil of one element: give each element a file of its own";
        return Err(fail(path, lines[element], what, expected));
    }
    // A point where x jumps from one end of the chord to the other.
    let starts_again =
        |at: &usize| (points[*at].x - points[*at - 1].x).abs() > FAR * chord && divided.is_between_sides(*at);
    let meeting = match *second {
        Break::At(at) => {
            let at = Some(at).filter(|at| (1..points.len()).contains(at));
            if let Some(at) = at {
                check_break(path, lines, points, at, (1..points.len()).find(starts_again))?;
            }
            at
        }
        Break::Perhaps(blanks) => {
            let mut again = (1..points.len()).filter(starts_again);
            let at = again.next();
            if let Some(third) = again.next() {
                let what = "the points begin a third time at an end of the chord".to_string();
                return Err(fail(path, lines[third], what, "one airfoil: one curve, or its two sides"));
            }
            // Two sides may meet at the trailing edge. Then only a blank line in the file marks the
            // point.
            let apart =
                blanks.iter().find(|at| blanks.len() == 1 && !is_trailing(first) && divided.is_between_sides(**at));
            at.or(apart.copied())
        }
    };
    if let Some(at) = meeting {
        let (one, other) = points.split_at(at);
        let turned = |side: &[DVec2], towards_leading: bool| {
            let mut side = side.to_vec();
            if is_trailing(&side[0]) != towards_leading {
                side.reverse();
            }
            side
        };
        let mut curve = turned(one, true);
        curve.extend(turned(other, false));
        return Ok(curve);
    }
    let is_at_end = |point: &DVec2| point.x >= high - END * chord;
    if let Some(curve) = turned_to_trailing_edge(points).filter(|curve| is_at_end(&curve[0])) {
        return Ok(curve);
    }
    for (point, line) in [(first, lines[0]), (last, lines[lines.len() - 1])] {
        if !is_at_end(point) && chord > 0.0 {
            let what = format!("the points begin or end at x = {}, which is not the trailing edge", point.x);
            let expected = "points from the trailing edge round the leading edge and back, a curve that comes back to its \
                            start, or two sides with a blank line between them";
            return Err(fail(path, line, what, expected));
        }
    }
    Ok(points.to_vec())
}

/// Checks that the second side begins where the file says. There the points jump from edge to edge,
/// or the sides meet at an edge. No jump is anywhere else.
///
/// - `at`: the first point of the second side, as the file says
/// - `jump`: the first point after a jump
///
/// # Errors
/// [`ProfileError::Line`] of a first point of a side that the file does not give.
fn check_break(
    path: &Path,
    lines: &[usize],
    points: &[DVec2],
    at: usize,
    jump: Option<usize>,
) -> Result<(), ProfileError> {
    let expected = "the second side where the numbers of points or the label before the points say";
    if let Some(jump) = jump.filter(|&jump| jump != at) {
        let what = format!("the second side begins here, after {jump} points, not after {at}");
        return Err(fail(path, lines[jump], what, expected));
    }
    let (low, high) = range(points);
    let is_trailing = |point: &DVec2| point.x > 0.5 * (low + high);
    if jump.is_none() && is_trailing(&points[at]) && is_trailing(&points[at - 1]) && is_smooth(points, at) {
        let what = format!("no side begins here, after {at} points");
        return Err(fail(path, lines[at], what, expected));
    }
    Ok(())
}

/// The first point of a second element: of a second block that is a closed curve of its own, or the
/// one after a curve that has come back to its first point.
fn second_element(divided: &Divided, second: &Break) -> Option<usize> {
    let points = divided.points;
    let blocks = match second {
        Break::At(at) => std::slice::from_ref(at),
        Break::Perhaps(blanks) => blanks,
    };
    let in_blocks =
        blocks.iter().find(|&&at| at < points.len() && divided.is_ring_before(at) && divided.is_ring_from(at));
    // Two sides may begin at one point, but then the last segment before it is a whole side long.
    let jump = |at: usize| points[at].distance(points[at - 1]);
    let chord = divided.chord();
    let closes = |at: &usize| points[*at] == points[0] && jump(*at) <= FAR * chord && divided.is_ring_before(at + 1);
    // From the trailing edge of an element to the one of the next it is far for either of them.
    let is_apart = |at: &usize| {
        let length = |(low, high): (f64, f64)| high - low;
        let shorter = length(divided.before[*at]).min(length(divided.from[*at]));
        // Points of a base have no length along the chord.
        shorter > END * chord && jump(*at) > FAR * shorter && divided.is_ring_before(*at) && divided.is_ring_from(*at)
    };
    let inside = 4..points.len().saturating_sub(3);
    let after = || inside.clone().find(closes).map(|at| at + 1).or_else(|| inside.clone().find(is_apart));
    in_blocks.copied().or_else(after)
}

/// Brings an airfoil in percent of its chord to chord 1.
pub(super) fn in_chords(curve: &mut [DVec2]) {
    let (low, high) = range(curve);
    if (high - low - PERCENT).abs() <= OFF * PERCENT {
        curve.iter_mut().for_each(|point| *point /= PERCENT);
    }
}

/// The chord of an airfoil in percent.
const PERCENT: f64 = 100.0;

/// Largest distance of the leading edge from the origin, and of the chord from 1, as a share of the
/// chord.
const OFF: f64 = 0.01;

/// Checks that an airfoil's leading edge is the origin and that its chord is 1, as a placement
/// assumes.
///
/// - `line`: line of the first point
/// - `curve`: from one side of the trailing edge to the other
///
/// # Errors
/// [`ProfileError::Line`]
pub(super) fn check_place(path: &Path, line: usize, curve: &[DVec2]) -> Result<(), ProfileError> {
    let (Some(first), Some(last)) = (curve.first(), curve.last()) else { return Ok(()) };
    // A blunt nose has several points with the least x.
    let (low, high) = range(curve);
    let foremost = || curve.iter().filter(|point| point.x <= low + 1e-3 * (high - low));
    let nose = DVec2::new(low, foremost().map(|point| point.y).sum::<f64>() / foremost().count() as f64);
    let chord = (0.5 * (first + last)).distance(nose);
    // The curve passes through the origin, but no point has to lie there. With camber the nose is a
    // little below or above.
    let to_origin = curve.windows(2).map(|pair| {
        let [from, to] = [pair[0], pair[1]].map(|end| end.extend(0.0));
        nearest_on_segment(DVec3::ZERO, from, to).0.length()
    });
    let off = to_origin.fold(f64::INFINITY, f64::min).max(nose.x.abs());
    if off <= OFF * chord && (chord - 1.0).abs() <= OFF {
        return Ok(());
    }
    let what =
        format!("the airfoil's leading edge is at x = {:.6}, y = {:.6} and its chord is {chord:.6}", nose.x, nose.y);
    let expected = "the leading edge at x = 0, y = 0 and a chord of 1 or 100, both within 1 % of the chord: take the leading edge \
                    off the coordinates and divide them by the chord; `chord` and `position` of the placement say where it goes";
    Err(fail(path, line, what, expected))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    thread_local! {
        /// The number of points of which ranges were made.
        pub(super) static LOOKED_AT: Cell<usize> = const { Cell::new(0) };
    }

    /// The number of points of which ranges are made, in a file with a blank line after each point.
    fn looked_at(points: &[DVec2]) -> usize {
        let lines: Vec<usize> = (0..points.len()).map(|point| 2 * point).collect();
        let blanks: Vec<usize> = (1..points.len()).collect();
        LOOKED_AT.set(0);
        let _ = join(Path::new("airfoil.dat"), &lines, points, &Break::Perhaps(&blanks));
        LOOKED_AT.get()
    }

    /// The work grows with the number of points, not with its square: on a curve, on points that
    /// come back to the first again and again, and on points that jump from end to end.
    #[test]
    fn a_file_with_many_blank_lines_is_not_looked_at_again_and_again() {
        let n = 1000;
        let at = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
        let curve = |i: usize| DVec2::new(0.5 + 0.5 * at(i).cos(), 0.1 * at(i).sin());
        let back =
            |i: usize| if i.is_multiple_of(3) { DVec2::ZERO } else { DVec2::new(0.3 * (i % 3) as f64, i as f64) };
        let jumping = |i: usize| DVec2::new((i % 2) as f64, i as f64);
        for points in
            [(0..=n).map(curve).collect::<Vec<_>>(), (0..n).map(back).collect(), (0..n).map(jumping).collect()]
        {
            assert!(looked_at(&points) <= 10 * points.len(), "{}", looked_at(&points));
        }
    }
}
