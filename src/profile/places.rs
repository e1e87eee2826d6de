//! The places of a wing's vertices between its profiles.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::along::{ArcPlace, SectionArcs, cubic_at};
use super::kept::KeptSection;
use super::locate::{SectionGrid, point};
use super::matching::OldSection;
use super::span::{Span, SpanWeights};
use super::wing_surface::WingSurface;

/// The most sections that have their curves at one time. The curves of a section take 80 kilobytes.
pub(crate) const SECTIONS_AT_ONCE: usize = 68;
/// Intervals between sections whose vertices are placed together. Four sections count in an
/// interval, so up to three more sections than intervals count in a block.
const BLOCK: usize = SECTIONS_AT_ONCE - 4;

/// A wing vertex between the profiles.
#[derive(Clone, Debug, Default)]
pub(super) struct Place {
    pub position: DVec3,
    pub eta: f64,
    /// The sections that count for the vertex, at most four.
    pub shares: Vec<Share>,
    /// Index in `shares` of the section below the vertex, and the share of the way to the next
    /// section.
    pub lower: (usize, f64),
}

impl Place {
    /// The share of the section above the vertex, if more than two sections count.
    pub fn above(&self) -> Option<&Share> {
        self.shares.get(self.lower.0 + 1).filter(|_| self.shares.len() > 2)
    }
}

/// The weight of one section for a vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    /// The first of at most four knots, and the weights of the knots.
    knot: u32,
    knots: [f64; 4],
    /// Weight of the section's remainder, and its derivative along the span coordinate.
    pub weight: f64,
    pub slope: f64,
    /// Derivative of the section's weight for the position.
    pub place_slope: f64,
}

impl Share {
    /// The cubic through values at the knots of all sections.
    pub fn of(&self, values: &[DVec3]) -> DVec3 {
        let values = &values[self.knot as usize..];
        self.knots
            .iter()
            .zip(values)
            .filter(|(weight, _)| **weight != 0.0)
            .map(|(&weight, &value)| value * weight)
            .sum()
    }

    /// The transpose of [`Self::of`]: adds to the derivatives by the values at the knots.
    pub fn add(&self, by: DVec3, by_values: &mut [DVec3]) {
        let by_values = &mut by_values[self.knot as usize..];
        for (&weight, by_value) in self.knots.iter().zip(by_values).filter(|(weight, _)| **weight != 0.0) {
            *by_value += by * weight;
        }
    }
}

/// Finds the place of each vertex, and its distance from the section interpolated there.
///
/// - `arcs` `[n_sections]`: of the knots
/// - `tau`: the parameters of [`SectionGrid`]
pub(super) fn places(
    sections: &[KeptSection],
    arcs: &[SectionArcs],
    tau: &[f64],
    span: &Span,
    surface: &WingSurface,
) -> (Vec<Place>, Vec<f64>) {
    let coordinates: Vec<(f64, usize)> =
        surface.positions.par_iter().map(|&position| span.coordinate(position)).collect();
    let n_blocks = sections.len().div_ceil(BLOCK);
    let mut of_block = vec![Vec::new(); n_blocks];
    for (vertex, &(_, interval)) in coordinates.iter().enumerate() {
        of_block[interval / BLOCK].push(vertex);
    }
    let mut places = vec![Place::default(); surface.positions.len()];
    let mut off = vec![0.0; surface.positions.len()];
    for vertices in of_block.into_iter().filter(|vertices| !vertices.is_empty()) {
        let weights = |vertex: usize| {
            let (eta, interval) = coordinates[vertex];
            [span.place(eta, interval), span.change(eta, interval)]
        };
        let needed = vertices.iter().flat_map(|&vertex| weights(vertex)).map(|of| of.first..of.first + of.count);
        let needed = needed.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end)).unwrap_or_default();
        let block = Block::new(sections, needed, tau);
        let place = |&vertex: &usize| {
            let [at, change] = weights(vertex);
            let (position, outward) = (surface.positions[vertex], surface.normals[vertex]);
            let (eta, interval) = coordinates[vertex];
            let directions = [outward, span.across(eta, interval)];
            let floor = span.stands_on(outward, directions[1], interval);
            let (place, off) = block.place(arcs, position, directions, floor, &at, &change);
            (vertex, Place { eta, ..place }, off)
        };
        for (vertex, place, distance) in vertices.par_iter().map(place).collect::<Vec<_>>() {
            (places[vertex], off[vertex]) = (place, distance);
        }
    }
    (places, off)
}

/// Neighbouring sections with their curves.
struct Block<'a> {
    first: usize,
    sections: Vec<OldSection>,
    grid: SectionGrid<'a>,
}

impl<'a> Block<'a> {
    fn new(sections: &[KeptSection], needed: Range<usize>, tau: &'a [f64]) -> Self {
        let first = needed.start;
        let sections: Vec<OldSection> = sections[needed].par_iter().map(KeptSection::section).collect();
        let grid = SectionGrid::new(tau, first, &sections);
        Self { first, sections, grid }
    }

    /// The place of a vertex, without its span coordinate, and its distance from the interpolated
    /// section.
    ///
    /// - `directions`: the outward normal there, and the direction across the sections
    /// - `floor`: the section that stands on the surface there
    /// - `at`, `change`: weights of the position and of a change
    fn place(
        &self,
        arcs: &[SectionArcs],
        position: DVec3,
        [outward, across]: [DVec3; 2],
        floor: Option<usize>,
        at: &SpanWeights,
        change: &SpanWeights,
    ) -> (Place, f64) {
        let section = |k: usize| &self.sections[k - self.first];
        let behind = floor.and_then(|section| self.grid.behind(position, outward, across, section));
        let tau = behind.unwrap_or_else(|| self.grid.parameter(position, outward, across, at));
        let shares = (0..change.count).map(|i| {
            let k = change.first + i;
            let (knot, knots) = cubic_at(&arcs[k], ArcPlace::of(section(k), tau));
            let place_slope = k.checked_sub(at.first).map_or(0.0, |i| at.slope.get(i).copied().unwrap_or(0.0));
            Share { knot: knot as u32, knots, weight: change.weight[i], slope: change.slope[i], place_slope }
        });
        let shares = shares.collect();
        let on_section = (0..at.count).map(|i| point(section(at.first + i), tau) * at.weight[i]).sum::<DVec3>();
        let place = Place { position, eta: 0.0, shares, lower: (change.lower, change.share) };
        (place, on_section.distance(position))
    }
}
