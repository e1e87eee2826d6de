//! The cubic along a section: the knots and weights at a point of the section.

use super::curve::bracket;
use super::matching::OldSection;

/// Arc lengths of the knots of one section.
#[derive(Clone, Debug)]
pub(super) struct SectionArcs {
    /// First knot of the two sides, and the arc lengths of the sides' knots.
    pub(super) sides: (usize, Vec<f64>),
    /// First knot and arc lengths of a blunt base, if there is one.
    pub(super) base: Option<(usize, Vec<f64>)>,
}

impl SectionArcs {
    /// One past the section's last knot.
    pub(super) fn end(&self) -> usize {
        self.sides.0 + self.sides.1.len() + self.base.as_ref().map_or(0, |base| base.1.len())
    }
}

/// First knot and weights of a section's cubic at a parameter.
pub(super) fn cubic_at(arcs: &SectionArcs, section: &OldSection, tau: f64) -> (usize, [f64; 4]) {
    let ((first, knot_arcs), arc) = match (&arcs.base, &section.measured_base) {
        (Some(base), Some(measured)) if tau > 2.0 => (base, measured.arc(tau)),
        _ => (&arcs.sides, section.measured.arc(tau.min(2.0))),
    };
    let (knot, weights) = cubic(knot_arcs, arc);
    (first + knot, weights)
}

/// First knot and weights of the cubic at arc length `x`. The cubic is Hermite's, with the slopes
/// of the parabolas through three neighbouring knots.
///
/// - `knots`: ascending arc lengths, at least two
fn cubic(knots: &[f64], x: f64) -> (usize, [f64; 4]) {
    let n = knots.len();
    let (i, t) = bracket(knots, x);
    let h = knots[i + 1] - knots[i];
    let first = i.saturating_sub(1);
    let mut weights = [0.0; 4];
    weights[i - first] += (1.0 - t) * (1.0 - t) * (1.0 + 2.0 * t);
    weights[i + 1 - first] += t * t * (3.0 - 2.0 * t);
    // Adds the slope at knot k of the parabola through knots k - 1, k, k + 1, times `share`.
    let mut slope = |k: usize, share: f64| {
        let (l, r) = (knots[k] - knots[k - 1], knots[k + 1] - knots[k]);
        weights[k - 1 - first] -= share * r / (l * (l + r));
        weights[k - first] += share * (r - l) / (l * r);
        weights[k + 1 - first] += share * l / (r * (l + r));
    };
    let (start, end) = (h * t * (1.0 - t) * (1.0 - t), -h * t * t * (1.0 - t));
    // At an end of the curve the slope is the parabola's: twice the chord's slope minus the slope
    // at the other knot.
    let mut chord = 0.0;
    match (i > 0, i + 2 < n) {
        (true, true) => {
            slope(i, start);
            slope(i + 1, end);
        }
        (true, false) => {
            slope(i, start - end);
            chord = 2.0 * end;
        }
        (false, true) => {
            slope(i + 1, end - start);
            chord = 2.0 * start;
        }
        (false, false) => chord = start + end,
    }
    weights[i - first] -= chord / h;
    weights[i + 1 - first] += chord / h;
    (first, weights)
}
