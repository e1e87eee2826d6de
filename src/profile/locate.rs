//! Parameter of the section point that belongs to a wing vertex.
//!
//! At the vertex's span coordinate the old profiles are interpolated to a virtual section. The
//! vertex takes the parameter of the nearest point with an outward normal on the vertex's side.
//! Without this condition a vertex of a thin trailing edge could take a point of the other side.
//! A wing behind a fence that stands on it takes the nearest point of the fence's own section.

use glam::DVec3;

use super::matching::OldSection;
use super::span::SpanWeights;
use crate::geometry::nearest_on_segment;

/// Steps of the virtual section on each side. A step is 0.4 % of a side. Only the parameter depends
/// on it, not the shape of the moved wing.
const STEPS: usize = 256;
/// Squared distances that differ by less than this share are alike.
const ALIKE: f64 = 1e-9;
/// Steps of the base of a blunt trailing edge.
const BASE_STEPS: usize = 16;

/// Neighbouring old profiles at common parameters.
#[derive(Debug)]
pub(super) struct SectionGrid<'a> {
    tau: &'a [f64],
    /// Index of the first profile of `points` among all profiles.
    first: usize,
    /// Points of each profile at the parameters `tau` `[n_profiles][n_tau]`.
    points: Vec<Vec<DVec3>>,
}

/// The common parameters of a wing's grids.
///
/// - `with_base`: whether any section of the wing has the base of a blunt trailing edge
pub(super) fn grid_parameters(with_base: bool) -> Vec<f64> {
    let mut tau: Vec<f64> = (0..=2 * STEPS).map(|i| i as f64 / STEPS as f64).collect();
    if with_base {
        tau.extend((1..=BASE_STEPS).map(|i| 2.0 + i as f64 / BASE_STEPS as f64));
    }
    tau
}

impl<'a> SectionGrid<'a> {
    /// The grid of neighbouring sections.
    ///
    /// - `first`: index of the first of them among all sections
    pub fn new(tau: &'a [f64], first: usize, sections: &[OldSection]) -> Self {
        let sample = |section: &OldSection| tau.iter().map(|&t| point(section, t)).collect();
        let points = sections.iter().map(sample).collect();
        Self { tau, first, points }
    }

    /// Parameter of the point nearest to `position` on the section interpolated with `weights`.
    ///
    /// - `outward`: the surface's outward normal there; if it is zero, every point is a candidate
    /// - `across`: the sections run counter-clockwise about this direction
    pub fn parameter(&self, position: DVec3, outward: DVec3, across: DVec3, weights: &SpanWeights) -> f64 {
        let section = |j: usize| {
            let share = |i: usize| self.points[weights.first + i - self.first][j] * weights.weight[i];
            (0..weights.count).map(share).sum::<DVec3>()
        };
        let mut best = [(f64::INFINITY, 0.0); 2];
        let mut start = section(0);
        for j in 1..self.tau.len() {
            let end = section(j);
            let (nearest, t) = nearest_on_segment(position, start, end);
            let candidate = (nearest.distance_squared(position), self.tau[j - 1] + (self.tau[j] - self.tau[j - 1]) * t);
            let looks_out = (end - start).cross(across).dot(outward) > 0.0;
            for (place, allowed) in [looks_out, true].into_iter().enumerate() {
                if allowed && candidate.0 < best[place].0 {
                    best[place] = candidate;
                }
            }
            start = end;
        }
        if best[0].0.is_finite() { best[0].1 } else { best[1].1 }
    }

    /// Parameter of a vertex of a surface on which a section stands, as a fence stands on a wing,
    /// if the vertex lies behind the section. Its normal tells the section's other side, which the
    /// wing continues. `None` if the vertex lies before the section, or beside its ends.
    ///
    /// - `section`: the number of the section among all
    /// - `outward`, `across`: as in [`Self::parameter`]
    pub fn behind(&self, position: DVec3, outward: DVec3, across: DVec3, section: usize) -> Option<f64> {
        let points = &self.points[section - self.first];
        // The squared distance and the parameter of the nearest point of both sides.
        let mut best = [(f64::INFINITY, 0.0); 2];
        for j in 1..=2 * STEPS {
            let [start, end] = [points[j - 1], points[j]];
            let (nearest, t) = nearest_on_segment(position, start, end);
            let distance = nearest.distance_squared(position);
            let looks_out = (end - start).cross(across).dot(outward) > 0.0;
            let best = &mut best[usize::from(looks_out)];
            if distance < best.0 {
                *best = (distance, self.tau[j - 1] + (self.tau[j] - self.tau[j - 1]) * t);
            }
        }
        // The leading edge is of both sides.
        let [(distance, tau), (before, _)] = best;
        (distance < (1.0 - ALIKE) * before && tau > 0.0 && tau < 2.0).then_some(tau)
    }
}

/// The point of a section at a parameter.
pub(super) fn point(section: &OldSection, tau: f64) -> DVec3 {
    match &section.measured_base {
        Some(base) if tau > 2.0 => base.point(tau),
        None if tau > 2.0 => section.measured.point(2.0).lerp(section.measured.point(0.0), tau - 2.0),
        _ => section.measured.point(tau),
    }
}
