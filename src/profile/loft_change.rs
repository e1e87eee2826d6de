//! [`LoftChange`]: the derivative of [`ProfileInterpolation::displacements`] by the points of the
//! new profiles.
//!
//! The interpolation is linear in the displacement of the knots, with factors from the old profiles
//! alone. Its transpose has the same factors. Not linear are the match of the profiles
//! ([`MatchChange`]), the limit of the parabolas' overshoot ([`Limit`]) and the length of the span
//! direction, which is a unit vector.
//!
//! # Kinks
//!
//! Where an overshoot reaches its limit the derivative jumps, and the value does not. On one side
//! the overshoot grows with the change of the profiles, on the other side its limit does.

use glam::DVec3;
use rayon::prelude::*;

use super::interpolation::{Lofted, ProfileInterpolation, transfer};
use super::kept::KeptSection;
use super::matching::{MatchChange, PlaneAffine};
use super::overshoot::{Bounds, Limit};
use super::places::Place;
use super::tilt::Tilt;
use super::trend::TrendMap;
use super::{Profile, ProfileError};

/// The derivative of a wing's interpolation at a design.
#[derive(Debug)]
pub(crate) struct LoftChange {
    flat: bool,
    /// Number of points of each profile, in the order of the design.
    n_points: Vec<usize>,
    /// In the order of the span.
    sections: Vec<SectionChange>,
    map: TrendMap,
    remainder: Vec<DVec3>,
    /// The vertices whose overshoot is reduced, ascending.
    limits: Vec<(usize, Limit)>,
}

/// The derivative of one section's change.
#[derive(Debug)]
struct SectionChange {
    /// The place of its profile in the design.
    place: usize,
    matched: MatchChange,
    /// Of the form in which the profile is compared.
    affine: PlaneAffine,
    knots: Vec<DVec3>,
    /// From the knots of the flat form to those of the smooth one. Empty if the form is smooth.
    transfer: Vec<(usize, [f64; 4])>,
    tilt: Tilt,
}

/// How the displacement of a wing changes with its profiles.
#[derive(Debug)]
pub(crate) struct WingChange {
    /// Change of the displacement of each vertex `[n_positions]`.
    pub displacement: Vec<DVec3>,
    remainder: Vec<DVec3>,
    map: TrendMap,
    normal: DVec3,
}

/// Why a design has no derivative by a profile: the profile's number, and the cause.
pub(crate) type WhyNot = (i64, &'static str);

impl LoftChange {
    /// The derivative at a design.
    ///
    /// - `new`: the design's profiles, which [`ProfileInterpolation::displacements`] takes
    ///
    /// # Errors
    /// Why there is none.
    pub fn new(wing: &ProfileInterpolation, new: &[Profile]) -> Result<Self, WhyNot> {
        let broken =
            |_: ProfileError| (new.first().map_or(0, |profile| profile.number), "has no match with the old one");
        let paired = wing.paired(new).map_err(broken)?;
        let changes = wing.forms.changes(&paired, &wing.trend, wing.flat_trend.as_ref()).map_err(broken)?;
        let flat = changes.flat;
        let section = |(k, (form, profile)): (usize, (&KeptSection, &&Profile))| {
            let place = new.iter().position(|other| std::ptr::eq(other, *profile)).unwrap_or(k);
            let section = form.section();
            let of_profile = |why| (profile.number, why);
            let transfer = if flat { transfer(&wing.forms.smooth[k].section(), &section) } else { Vec::new() };
            Ok(SectionChange {
                place,
                matched: section.match_change(profile).map_err(of_profile)?,
                affine: section.affine().clone(),
                knots: section.knots(),
                transfer,
                tilt: Tilt::new(form.new_normal(profile).map_err(broken)?, profile),
            })
        };
        let sections =
            changes.form.par_iter().zip(&paired).enumerate().map(section).collect::<Result<Vec<_>, WhyNot>>()?;
        let Lofted { map, remainder, whole, .. } = wing.lofted(changes);
        let limit = |(vertex, place): (usize, &Place)| {
            let above = place.above()?;
            let (lower, t) = place.lower;
            let straight = place.shares[lower].of(&remainder).lerp(above.of(&remainder), t);
            let left: DVec3 = place.shares.iter().map(|share| share.of(&remainder) * share.weight).sum();
            let whole: Vec<DVec3> = place.shares.iter().map(|share| share.of(&whole)).collect();
            let bounds = Bounds { whole: &whole, lower, t, small: wing.small };
            Some((vertex, Limit::new(left - straight, &bounds)?))
        };
        let limits = wing.places.par_iter().enumerate().filter_map(limit).collect();
        let n_points = new.iter().map(|profile| profile.points.len()).collect();
        Ok(Self { flat, n_points, sections, map, remainder, limits })
    }

    /// Change of the wing with its profiles.
    ///
    /// - `change`: of the points of each profile, in the order of the design
    pub fn forward(&self, wing: &ProfileInterpolation, change: &[Vec<DVec3>]) -> WingChange {
        let trend = wing.trend_of(self.flat);
        let of_knots: Vec<Vec<DVec3>> =
            self.sections.par_iter().map(|section| section.matched.forward(&change[section.place])).collect();
        let of_probes = self.sections.iter().zip(&of_knots).enumerate().flat_map(|(k, (section, of_knots))| {
            let map = section.affine.fit(&of_knots[..section.affine.knots.len()]).0;
            trend.probes(k).map(|probe| section.affine.evaluate(&map, probe))
        });
        let map = trend.fit(&of_probes.collect::<Vec<_>>());
        let mut remainder = Vec::with_capacity(wing.knots.len());
        for ((section, of_knots), &eta) in self.sections.iter().zip(&of_knots).zip(&wing.span.eta) {
            let pairs = section.knots.iter().zip(of_knots);
            let left: Vec<DVec3> = pairs.map(|(&knot, &change)| change - trend.at(&map, knot, eta)).collect();
            if section.transfer.is_empty() {
                remainder.extend(left);
            } else {
                remainder.extend(section.transfer.iter().map(|&(knot, weights)| {
                    weights.iter().zip(&left[knot..]).map(|(&weight, &value)| value * weight).sum::<DVec3>()
                }));
            }
        }
        let left = |place: &Place| -> DVec3 {
            place.shares.iter().map(|share| share.of(&remainder) * share.weight).sum::<DVec3>()
                + trend.at(&map, place.position, place.eta)
        };
        let mut displacement: Vec<DVec3> = wing.places.par_iter().map(left).collect();
        if !self.limits.is_empty() {
            let whole = of_knots_with_trend(wing, &remainder, |knot, eta| trend.at(&map, knot, eta));
            for (vertex, limit) in &self.limits {
                let place = &wing.places[*vertex];
                let (lower, t) = place.lower;
                let [below, above] = [lower, lower + 1].map(|share| place.shares[share].of(&remainder));
                let straight = below.lerp(above, t);
                let bow =
                    place.shares.iter().map(|share| share.of(&remainder) * share.weight).sum::<DVec3>() - straight;
                let whole: Vec<DVec3> = place.shares.iter().map(|share| share.of(&whole)).collect();
                displacement[*vertex] += limit.forward(bow, &whole) - bow;
            }
        }
        let normal = match &self.sections[..] {
            [only] => only.tilt.forward(&change[only.place]),
            _ => DVec3::ZERO,
        };
        WingChange { displacement, remainder, map, normal }
    }

    /// Change of the unit span-wise direction at a vertex.
    pub fn turned(&self, wing: &ProfileInterpolation, vertex: usize, change: &WingChange) -> DVec3 {
        if self.sections.len() == 1 {
            return change.normal;
        }
        across(self.slope(wing, vertex), self.slope_by(wing, vertex, &change.map, &change.remainder))
    }

    /// The unit span-wise direction at a vertex.
    pub fn direction(&self, wing: &ProfileInterpolation, vertex: usize) -> DVec3 {
        match &self.sections[..] {
            [only] => only.tilt.normal,
            _ => self.slope(wing, vertex).normalize_or_zero(),
        }
    }

    /// The moved wing's derivative along the span coordinate at a vertex.
    fn slope(&self, wing: &ProfileInterpolation, vertex: usize) -> DVec3 {
        wing.place_slope(&wing.places[vertex]) + self.slope_by(wing, vertex, &self.map, &self.remainder)
    }

    /// The part of the slope that is linear in the trend and the remainder.
    fn slope_by(&self, wing: &ProfileInterpolation, vertex: usize, map: &TrendMap, remainder: &[DVec3]) -> DVec3 {
        let place = &wing.places[vertex];
        let left: DVec3 = place.shares.iter().map(|share| share.of(remainder) * share.slope).sum();
        wing.trend_of(self.flat).slope(map, place.position, place.eta, wing.place_slope(place)) + left
    }

    /// The transpose of [`Self::forward`] and [`Self::turned`]: the derivative by the
    /// points of each profile, in the order of the design.
    ///
    /// - `by_displacement` `[n_positions]`
    /// - `by_direction`: vertices with the derivative by their span-wise direction
    pub fn reverse(
        &self,
        wing: &ProfileInterpolation,
        by_displacement: &[DVec3],
        by_direction: &[(usize, DVec3)],
    ) -> Vec<Vec<DVec3>> {
        let trend = wing.trend_of(self.flat);
        let mut by_map = vec![DVec3::ZERO; self.map.len()];
        let mut by_remainder = vec![DVec3::ZERO; self.remainder.len()];
        let mut by_whole = vec![DVec3::ZERO; if self.limits.is_empty() { 0 } else { self.remainder.len() }];
        let mut by_normal = DVec3::ZERO;
        let add = |by_map: &mut [DVec3], basis: [f64; 6], by: DVec3| {
            by_map.iter_mut().zip(basis).for_each(|(by_map, value)| *by_map += by * value);
        };
        let mut limits = self.limits.iter().peekable();
        for (vertex, (place, &by)) in wing.places.iter().zip(by_displacement).enumerate() {
            let limit = limits.next_if(|(of, _)| *of == vertex);
            if by == DVec3::ZERO {
                continue;
            }
            add(&mut by_map, trend.basis(place.position, place.eta), by);
            let mut by_left = by;
            if let Some((_, limit)) = limit {
                let (by_bow, by_own) = limit.reverse(by);
                place.shares.iter().zip(by_own).for_each(|(share, by)| share.add(by, &mut by_whole));
                let (lower, t) = place.lower;
                place.shares[lower].add((by - by_bow) * (1.0 - t), &mut by_remainder);
                place.shares[lower + 1].add((by - by_bow) * t, &mut by_remainder);
                by_left = by_bow;
            }
            place.shares.iter().for_each(|share| share.add(by_left * share.weight, &mut by_remainder));
        }
        for &(vertex, by) in by_direction {
            let place = &wing.places[vertex];
            if self.sections.len() == 1 {
                by_normal += by;
                continue;
            }
            let by = across(self.slope(wing, vertex), by);
            add(&mut by_map, trend.slope_basis(place.position, place.eta, wing.place_slope(place)), by);
            place.shares.iter().for_each(|share| share.add(by * share.slope, &mut by_remainder));
        }
        if !by_whole.is_empty() {
            for (k, arcs) in wing.arcs.iter().enumerate() {
                for knot in arcs.knots() {
                    by_remainder[knot] += by_whole[knot];
                    add(&mut by_map, trend.basis(wing.knots[knot], wing.span.eta[k]), by_whole[knot]);
                }
            }
        }
        let mut by_knots = Vec::with_capacity(self.sections.len());
        for ((section, arcs), &eta) in self.sections.iter().zip(&wing.arcs).zip(&wing.span.eta) {
            let by_smooth = &by_remainder[arcs.knots()];
            let mut by_left = vec![DVec3::ZERO; section.knots.len()];
            if section.transfer.is_empty() {
                by_left.copy_from_slice(by_smooth);
            } else {
                for (&(knot, weights), by) in section.transfer.iter().zip(by_smooth) {
                    weights.iter().zip(&mut by_left[knot..]).for_each(|(&weight, by_left)| *by_left += *by * weight);
                }
            }
            for (&knot, by) in section.knots.iter().zip(&by_left) {
                add(&mut by_map, trend.basis(knot, eta), -*by);
            }
            by_knots.push(by_left);
        }
        let by_probes = trend.fit_reverse(&by_map);
        let mut gradient: Vec<Vec<DVec3>> = self.n_points.iter().map(|&n| vec![DVec3::ZERO; n]).collect();
        let of_section = |(k, mut by_knots): (usize, Vec<DVec3>)| {
            let section = &self.sections[k];
            let mut by_affine = [DVec3::ZERO; 3];
            for (probe, by) in trend.probes(k).into_iter().zip(&by_probes[4 * k..]) {
                let basis = section.affine.basis(probe);
                by_affine.iter_mut().zip(basis).for_each(|(by_affine, value)| *by_affine += *by * value);
            }
            for (by_knot, by) in by_knots.iter_mut().zip(section.affine.fit_reverse(&by_affine)) {
                *by_knot += by;
            }
            section.matched.reverse(&by_knots, self.n_points[section.place])
        };
        let of_sections: Vec<Vec<DVec3>> = by_knots.into_par_iter().enumerate().map(of_section).collect();
        for (section, of_section) in self.sections.iter().zip(of_sections) {
            gradient[section.place] = of_section;
        }
        if let [only] = &self.sections[..] {
            only.tilt.reverse(by_normal, &mut gradient[only.place]);
        }
        gradient
    }
}

/// The derivative of `along`, made a unit vector, times a vector. It is its own transpose.
fn across(along: DVec3, change: DVec3) -> DVec3 {
    let (unit, length) = (along.normalize_or_zero(), along.length());
    if length > 0.0 { (change - unit * unit.dot(change)) / length } else { DVec3::ZERO }
}

/// Values at the knots of all sections with their trend.
fn of_knots_with_trend(
    wing: &ProfileInterpolation,
    remainder: &[DVec3],
    trend: impl Fn(DVec3, f64) -> DVec3,
) -> Vec<DVec3> {
    let knots = wing.arcs.iter().zip(&wing.span.eta).flat_map(|(arcs, &eta)| arcs.knots().map(move |knot| (knot, eta)));
    knots.map(|(knot, eta)| remainder[knot] + trend(wing.knots[knot], eta)).collect()
}
