//! From the displacement of the profiles to the displacement of every wing vertex.
//!
//! ```text
//! u(X) = trend(X) + sum_k w_k(eta) sum_j c_kj(tau) [D_kj - trend(P_kj)]
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `P_kj`, `D_kj` | knot j of old profile k and its displacement, see [`super::matching`] |
//! | `trend` | position, twist, chord and thickness, linear along the span, see `trend` |
//! | `eta`, `w_k` | span coordinate of X, and the weights of the planes, see `span` |
//! | `tau`, `c_kj` | parameter of X along the section, see `locate`, and the cubic through the four knots around it |
//!
//! The trend makes an affine change of all profiles exact to rounding at every vertex, also between
//! the profiles and beyond the outermost planes. The weights are linear for two planes and blended
//! parabolas for more; on a plane only this plane counts. A change that is quadratic along the span
//! is exact between the outermost planes. Beyond them the remainder is constant.
//!
//! Blended parabolas overshoot beside a section that changes alone, and without bound where the
//! planes have uneven distances. So the displacement may leave the straight interpolation between
//! the two neighbouring sections by at most [`OVERSHOOT`] of the change.
//!
//! **Difference from the paper.** Step 3 of the paper is one least-squares polynomial of degree up
//! to two in x, y, z. The polynomial smooths: the wing would miss its new profiles wherever the
//! displacement is not quadratic. On a wing swept by more than its chord x depends on y in the
//! data. The x² term is then fitted on the sections, and acts as a dihedral between the planes. So
//! x², xz and z² are not used here, and the remainder is interpolated.
//!
//! **Limits.** Vertices move, not facets: a facet between two vertices misses a curved section by
//! its sag, before and after the motion. The trend's slope across a thin wing comes from its change
//! of thickness. If the surface between the planes differs from the straight interpolation by d,
//! the trend moves it by slope times d. This is right if all space is stretched, and wrong if only
//! the sections are. Planes at the kinks of a wing keep d small.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::accuracy::{Carried, Missed, Watch};
use super::along::{SectionArcs, cubic_at};
use super::checks::{self, Closeness};
use super::displacement::ProfileDisplacement;
use super::locate::{SectionGrid, point};
use super::matching::OldSection;
use super::section::{Changes, Forms};
use super::span::{Span, SpanWeights};
use super::trend::{Trend, TrendMap};
use super::wing_surface::WingSurface;
use super::{Plane, Profile, ProfileError, extent};

/// Largest distance from the straight interpolation between two neighbouring sections, as a share
/// of the change. The change is the largest displacement of the sections that count, or the largest
/// difference between these displacements if it is less.
pub const OVERSHOOT: f64 = 0.1;

/// The interpolation of a wing with its old profiles. Made once per mesh, used for any number of
/// new profiles.
#[derive(Debug)]
pub struct ProfileInterpolation {
    span: Span,
    /// Old sections, in the order of the span.
    forms: Forms,
    numbers: Vec<i64>,
    /// First knot and arc lengths of each section's sides and base.
    arcs: Vec<SectionArcs>,
    /// Knots of all sections, one section after another.
    knots: Vec<DVec3>,
    trend: Trend,
    /// Trend of the flat form.
    flat_trend: Option<Trend>,
    /// The wing's vertices.
    places: Vec<Place>,
    watch: Watch,
    /// For each section, first knot and weights for the vertices of `watch`.
    watched: Vec<Vec<(usize, [f64; 4])>>,
    extent: f64,
    /// The check that comes nearest to refusing the old profiles.
    closeness: Closeness,
}

/// A wing vertex between the profiles.
#[derive(Clone, Debug)]
struct Place {
    position: DVec3,
    eta: f64,
    /// The sections that count for the vertex, at most four.
    shares: Vec<Share>,
    /// Index in `shares` of the section below the vertex, and the share of the way to the next
    /// section.
    lower: (usize, f64),
}

/// The weight of one section for a vertex.
#[derive(Clone, Copy, Debug)]
struct Share {
    /// The first of at most four knots, and the weights of the knots.
    knot: u32,
    knots: [f64; 4],
    /// Weight of the section's remainder, and its derivative along the span coordinate.
    weight: f64,
    slope: f64,
    /// Derivative of the section's weight for the position.
    place_slope: f64,
}

impl Share {
    fn of(&self, values: &[DVec3]) -> DVec3 {
        let values = &values[self.knot as usize..];
        self.knots
            .iter()
            .zip(values)
            .filter(|(weight, _)| **weight != 0.0)
            .map(|(&weight, &value)| value * weight)
            .sum()
    }
}

impl ProfileInterpolation {
    /// Finds the parameters of every wing vertex between the old profiles, and checks the profiles
    /// against the wing.
    ///
    /// - `old`: the old profiles, at least one, in any order and direction
    ///
    /// # Errors
    /// - [`ProfileError::NoProfiles`], [`ProfileError::Doubled`], [`ProfileError::SamePlane`],
    ///   [`ProfileError::Lengths`]
    /// - [`ProfileError::OffWing`], [`ProfileError::OffMirror`], [`ProfileError::Size`]: the old
    ///   profiles do not belong to this wing
    /// - the errors of profiles that are no plane curves, see [`super::Plane::of_profile`]
    pub fn new(old: &[Profile], surface: &WingSurface) -> Result<Self, ProfileError> {
        let WingSurface { positions, normals, triangles, .. } = *surface;
        if positions.len() != normals.len() {
            return Err(ProfileError::Lengths { positions: positions.len(), normals: normals.len() });
        }
        by_number(old)?;
        let size = old.iter().map(|profile| extent(&profile.points)).fold(0.0, f64::max);
        let (span, order) = Span::new(old, size)?;
        let pairs = order.iter().zip(&span.planes);
        let sections = pairs.map(|(&i, plane)| OldSection::new(&old[i], plane)).collect::<Result<Vec<_>, _>>()?;
        let (own, closeness) = checks::against_wing(&sections, &span, positions, triangles)?;
        let compared: Vec<bool> = own.iter().map(Option::is_some).collect();
        Ok(Self { closeness, ..Self::of_sections(Forms::new(sections, own), &compared, span, surface)? })
    }

    fn of_sections(forms: Forms, compared: &[bool], span: Span, surface: &WingSurface) -> Result<Self, ProfileError> {
        let sections = &forms.smooth;
        let numbers = sections.iter().map(|section| section.profile().number).collect();
        let grid = SectionGrid::new(sections, span.normal);
        let mut knots = Vec::new();
        let mut arcs = Vec::new();
        for section in sections {
            let sides = (knots.len(), section.side_arcs());
            let base = section.base_arcs().map(|base| (knots.len() + sides.1.len(), base));
            arcs.push(SectionArcs { sides, base });
            knots.extend(section.knots());
        }
        let trend = Trend::new(sections.iter(), &span);
        let flat_trend = forms.flat.as_ref().map(|flat| Trend::new(flat.iter(), &span));

        let points = surface.positions.par_iter().zip(surface.normals);
        let (places, off): (Vec<Place>, Vec<f64>) = points
            .map(|(&position, &outward)| {
                let (eta, interval) = span.coordinate(position);
                let at = span.place(eta, interval);
                let change = span.change(eta, interval);
                let tau = grid.parameter(position, outward, &at);
                let shares = (0..change.count).map(|i| {
                    let section = change.first + i;
                    let (knot, knots) = cubic_at(&arcs[section], &sections[section], tau);
                    let place_slope =
                        section.checked_sub(at.first).map_or(0.0, |i| at.slope.get(i).copied().unwrap_or(0.0));
                    Share { knot: knot as u32, knots, weight: change.weight[i], slope: change.slope[i], place_slope }
                });
                let section = (0..at.count).map(|i| point(&sections[at.first + i], tau) * at.weight[i]).sum::<DVec3>();
                let place = Place { position, eta, shares: shares.collect(), lower: (change.lower, change.share) };
                (place, section.distance(position))
            })
            .unzip();
        checks::beside_wing(sections, compared, &span, surface, &off)?;
        let extent = extent(surface.positions);
        let mut interpolation = Self {
            span,
            forms,
            numbers,
            arcs,
            knots,
            trend,
            flat_trend,
            places,
            watch: Watch::default(),
            watched: Vec::new(),
            closeness: Closeness::default(),
            extent,
        };
        let along = |place: usize| {
            interpolation.place_slope(&interpolation.places[place]).normalize_or(interpolation.span.normal)
        };
        interpolation.watch = Watch::new(&interpolation.span, &interpolation.forms.smooth, compared, surface, along)?;
        let of_section = |section: usize| {
            let only = SpanWeights::only(section);
            let knots = |carried: &Carried| {
                let tau = grid.parameter(carried.at, surface.normals[carried.vertex], &only);
                cubic_at(&interpolation.arcs[section], &interpolation.forms.smooth[section], tau)
            };
            interpolation.watch.of_section(section).iter().map(knots).collect()
        };
        interpolation.watched = (0..interpolation.numbers.len()).map(of_section).collect();
        Ok(interpolation)
    }

    /// Displacement of every wing vertex for one design. There is no search: the cost is a few
    /// multiplications per vertex.
    ///
    /// - `new`: the new profiles with the numbers of the old ones, in any order, direction and
    ///   number of points
    ///
    /// A profile that agrees with its old one to 12 digits moves by exactly zero. If all agree, no
    /// vertex moves.
    ///
    /// # Errors
    /// - [`ProfileError::Numbers`]: the numbers differ from the old ones
    /// - [`ProfileError::Doubled`]: two profiles have one number
    /// - [`ProfileError::Size`], [`ProfileError::Order`], [`ProfileError::NotInOrder`],
    ///   [`ProfileError::Turned`], [`ProfileError::FarAway`], [`ProfileError::Sharp`]: new profiles
    ///   that are no changed old ones
    /// - the errors of profiles that are no plane curves
    pub fn displacements(&self, new: &[Profile]) -> Result<ProfileDisplacement, ProfileError> {
        let new = self.paired(new)?;
        let closeness = checks::against_old(self.forms.given(), &new, &self.span, self.extent)?;
        let closeness = self.closeness.clone().max(closeness);
        let mut normal = DVec3::ZERO;
        for (section, profile) in self.forms.given().iter().zip(&new) {
            normal += section.new_normal(profile)?;
        }
        let normal = normal.normalize_or(self.span.normal);
        let Changes { form, knots: changes, flat } = self.forms.changes(&new)?;
        let trend = self.flat_trend.as_ref().filter(|_| flat).unwrap_or(&self.trend);
        let affine: Vec<_> = form.iter().zip(&changes).map(|(section, change)| section.affine_change(change)).collect();
        let map = trend.fit(|section, point| affine[section](point));

        let mut remainder = Vec::with_capacity(self.knots.len());
        for (k, (section, change)) in form.iter().zip(&changes).enumerate() {
            let left: Vec<DVec3> = section
                .knots()
                .iter()
                .zip(change)
                .map(|(&knot, &d)| d - trend.at(&map, knot, self.span.eta[k]))
                .collect();
            if flat { remainder.extend(self.transferred(k, section, &left)) } else { remainder.extend(left) }
        }
        let whole: Vec<DVec3> = self
            .arcs
            .iter()
            .enumerate()
            .flat_map(|(k, arcs)| (arcs.sides.0..arcs.end()).map(move |knot| (k, knot)))
            .map(|(k, knot)| remainder[knot] + trend.at(&map, self.knots[knot], self.span.eta[k]))
            .collect();

        let at_place = |place: &Place| self.at_place(place, trend, &map, &remainder, &whole, normal);
        let (displacement, span_direction) = self.places.par_iter().map(at_place).unzip();
        let sections = self.arcs.iter().zip(&self.forms.smooth).zip(&new).map(|((arcs, section), &new)| {
            if flat { section.displaced(&whole[arcs.sides.0..arcs.end()]) } else { new.clone() }
        });
        let carried = self.watched.iter().enumerate().map(|(k, watched)| {
            let at = |(carried, &(knot, knots)): (&Carried, &(usize, [f64; 4]))| {
                let left: DVec3 = knots.iter().zip(&remainder[knot..]).map(|(&weight, &value)| value * weight).sum();
                carried.at + left + trend.at(&map, carried.at, self.span.eta[k])
            };
            self.watch.of_section(k).iter().zip(watched).map(at).collect()
        });
        Ok(ProfileDisplacement {
            displacement,
            span_direction,
            sections: sections.collect(),
            carried: carried.collect(),
            planes: new.iter().map(|new| Plane::of_profile(new)).collect::<Result<_, _>>()?,
            closeness,
            flat_cuts: flat,
        })
    }

    /// Displacement and span-wise direction of a vertex.
    ///
    /// - `remainder`, `whole`: displacement of each knot without and with the trend
    /// - `normal`: the direction if there is only one section
    fn at_place(
        &self,
        place: &Place,
        trend: &Trend,
        map: &TrendMap,
        remainder: &[DVec3],
        whole: &[DVec3],
        normal: DVec3,
    ) -> (DVec3, DVec3) {
        let (mut left, mut slope) = (DVec3::ZERO, DVec3::ZERO);
        for share in &place.shares {
            let value = share.of(remainder);
            left += value * share.weight;
            slope += value * share.slope;
        }
        let (lower, t) = place.lower;
        if let Some(upper) = place.shares.get(lower + 1).filter(|_| place.shares.len() > 2) {
            let straight = place.shares[lower].of(remainder).lerp(upper.of(remainder), t);
            let whole: Vec<DVec3> = place.shares.iter().map(|share| share.of(whole)).collect();
            left = straight + limited(left - straight, &whole, lower, t);
        }
        let displacement = left + trend.at(map, place.position, place.eta);
        if self.span.planes.len() < 2 {
            return (displacement, normal);
        }
        let along = self.place_slope(place);
        let span_direction = along + trend.slope(map, place.position, place.eta, along) + slope;
        (displacement, span_direction.normalize_or(normal))
    }

    /// Derivative of the undeformed wing's position with respect to the span coordinate, at
    /// constant parameter.
    fn place_slope(&self, place: &Place) -> DVec3 {
        place.shares.iter().map(|share| share.of(&self.knots) * share.place_slope).sum()
    }

    /// Brings values at the knots of a flat section to the knots of the smooth one, by the common
    /// parameter.
    fn transferred(&self, section: usize, flat: &OldSection, values: &[DVec3]) -> Vec<DVec3> {
        let smooth = &self.forms.smooth[section];
        let arcs = SectionArcs {
            sides: (0, flat.side_arcs()),
            base: flat.base_arcs().map(|base| (flat.side_arcs().len(), base)),
        };
        let at = |tau: f64| {
            let (knot, knots) = cubic_at(&arcs, flat, tau);
            knots.iter().zip(&values[knot..]).map(|(&weight, &value)| value * weight).sum()
        };
        smooth.knot_parameters().into_iter().map(at).collect()
    }

    /// Deviation of the vertices beside the planes of the profiles from their sections: see
    /// [`Missed`].
    ///
    /// - `motion`: the result of [`Self::displacements`]
    /// - `moved` `[n_positions]`: positions of the wing's vertices at the end, in the mesh's unit
    pub fn missed(&self, motion: &ProfileDisplacement, moved: &[DVec3]) -> Vec<Missed> {
        self.watch.missed(motion, |vertex| self.places[vertex].position, moved)
    }

    /// Indices of the vertices at the edges that cross the planes of the profiles.
    pub fn beside_sections(&self) -> impl Iterator<Item = usize> + '_ {
        self.watch.vertices()
    }

    /// Whether each vertex is at an edge that crosses the plane of a profile, or beyond such a
    /// plane as seen from the point `from` `[n_positions]`.
    pub(crate) fn sections_and_beyond(&self, from: DVec3) -> Vec<bool> {
        let mut beyond: Vec<bool> = self
            .places
            .iter()
            .map(|place| {
                self.span.planes.iter().any(|plane| plane.distance(place.position) * plane.distance(from) <= 0.0)
            })
            .collect();
        self.watch.vertices().for_each(|vertex| beyond[vertex] = true);
        beyond
    }

    /// Reach of the wing beyond its outermost sections, below the first and above the last one, as
    /// a share of the span between them. `None` for a single section, which moves the whole span
    /// alike.
    pub fn reach(&self) -> Option<[f64; 2]> {
        let (first, last) = (self.span.eta[0], self.span.eta[self.span.eta.len() - 1]);
        let etas = self.places.iter().map(|place| place.eta);
        let (low, high) = etas.fold((first, last), |(low, high), eta| (low.min(eta), high.max(eta)));
        (last > first).then(|| [(first - low) / (last - first), (high - last) / (last - first)])
    }

    /// The new profiles in the order of the sections.
    fn paired<'a>(&self, new: &'a [Profile]) -> Result<Vec<&'a Profile>, ProfileError> {
        let by_number = by_number(new)?;
        let paired: Option<Vec<&Profile>> = self.numbers.iter().map(|number| by_number.get(number).copied()).collect();
        paired.filter(|paired| paired.len() == by_number.len()).ok_or_else(|| self.wrong_numbers(new))
    }

    fn wrong_numbers(&self, new: &[Profile]) -> ProfileError {
        let sorted = |mut numbers: Vec<i64>| {
            numbers.sort_unstable();
            numbers
        };
        let new = sorted(new.iter().map(|profile| profile.number).collect());
        ProfileError::Numbers { old: sorted(self.numbers.clone()), new }
    }
}

/// The part of the parabolas beyond the straight interpolation between two sections, reduced where
/// it is too large.
///
/// - `whole`: displacement of each section that counts
fn limited(bow: DVec3, whole: &[DVec3], lower: usize, t: f64) -> DVec3 {
    let pairs = whole.iter().enumerate().flat_map(|(i, &a)| whole[..i].iter().map(move |&b| a.distance(b)));
    let largest = whole.iter().map(|whole| whole.length()).fold(0.0, f64::max);
    let allowed = OVERSHOOT * largest.min(pairs.fold(0.0, f64::max));
    let (from, to) = (whole[lower], whole[lower + 1]);
    let on_way = from.lerp(to, t);
    let off = |share: f64| super::distance::distance(on_way + bow * share, &[from, to]);
    if off(1.0) <= allowed {
        return bow;
    }
    // The distance grows with the share, so bisection finds the largest share allowed.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..50 {
        let middle = (low + high) / 2.0;
        if off(middle) <= allowed { low = middle } else { high = middle }
    }
    bow * low
}

fn by_number(profiles: &[Profile]) -> Result<HashMap<i64, &Profile>, ProfileError> {
    let mut map = HashMap::new();
    for profile in profiles {
        if map.insert(profile.number, profile).is_some() {
            return Err(ProfileError::Doubled { profile: profile.number });
        }
    }
    Ok(map)
}
