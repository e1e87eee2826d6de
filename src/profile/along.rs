//! The cubic along a section: the knots and weights at a point of the section.

use std::ops::Range;

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
    /// The section's knots.
    pub(super) fn knots(&self) -> Range<usize> {
        let end = self.sides.0 + self.sides.1.len() + self.base.as_ref().map_or(0, |base| base.1.len());
        self.sides.0..end
    }
}

/// A place along a section.
#[derive(Clone, Copy, Debug)]
pub(super) struct ArcPlace {
    /// Whether the place is on a blunt base.
    pub on_base: bool,
    /// Arc length from the start of the sides, or of the base, in the mesh's unit.
    pub arc: f64,
}

impl ArcPlace {
    /// The place at a parameter.
    pub fn of(section: &OldSection, tau: f64) -> Self {
        match &section.measured_base {
            Some(measured) if tau > 2.0 => Self { on_base: true, arc: measured.arc(tau) },
            _ => Self { on_base: false, arc: section.measured.arc(tau.min(2.0)) },
        }
    }
}

/// First knot and weights of a section's cubic at a place.
pub(super) fn cubic_at(arcs: &SectionArcs, place: ArcPlace) -> (usize, [f64; 4]) {
    let (first, knot_arcs) = arcs.base.as_ref().filter(|_| place.on_base).unwrap_or(&arcs.sides);
    let (knot, weights) = cubic(knot_arcs, place.arc);
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
