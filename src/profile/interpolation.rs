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
//! the two neighbouring sections by at most [`OVERSHOOT`] of the change, see
//! `overshoot`.
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

use super::accuracy::{Missed, Watch, into};
use super::agreed::Agreed;
use super::along::{ArcPlace, SectionArcs, cubic_at};
use super::checks::{self, Closeness};
use super::cut::Gap;
use super::displacement::ProfileDisplacement;
use super::kept::KeptSection;
use super::locate::grid_parameters;
use super::matching::{OldSection, ProfileMatch};
pub use super::overshoot::OVERSHOOT;
use super::overshoot::{Bounds, Limit, SMALL};
use super::places::{Place, places};
use super::section::{Change, Changes, Forms};
use super::span::Span;
use super::spanwise;
use super::trend::{Trend, TrendMap};
use super::wing_surface::WingSurface;
use super::{Plane, Profile, ProfileError, Remark, extent};

/// The interpolation of a wing with its old profiles. Made once per mesh, used for any number of
/// new profiles.
#[derive(Debug)]
pub struct ProfileInterpolation {
    pub(super) span: Span,
    /// Old sections, in the order of the span.
    pub(super) forms: Forms,
    pub(super) numbers: Vec<i64>,
    /// First knot and arc lengths of each section's sides and base.
    pub(super) arcs: Vec<SectionArcs>,
    /// Knots of all sections, one section after another.
    pub(super) knots: Vec<DVec3>,
    pub(super) trend: Trend,
    /// Trend of the flat form.
    pub(super) flat_trend: Option<Trend>,
    /// The wing's vertices.
    pub(super) places: Vec<Place>,
    watch: Watch,
    extent: f64,
    /// Overshoots of smaller changes are not limited, in the mesh's unit.
    pub(super) small: f64,
    /// Least and greatest place of the wing along the span's normal.
    ends: [f64; 2],
    /// Reach of a wing beyond the plane of its only section, if the wing is not the same all along
    /// the span.
    alone: Option<f64>,
    /// The check that comes nearest to refusing the old profiles.
    closeness: Closeness,
    /// The bridged gaps of old profiles, each with the number of its profile.
    gaps: Vec<(i64, Gap)>,
}

impl ProfileInterpolation {
    /// Finds the parameters of every wing vertex between the old profiles, and checks the profiles
    /// against the wing.
    ///
    /// - `old`: the old profiles, at least one, in any order and direction
    ///
    /// # Errors
    /// - [`ProfileError::NoProfiles`], [`ProfileError::Doubled`], [`ProfileError::SamePlane`],
    ///   [`ProfileError::LeansBack`], [`ProfileError::Lengths`]
    /// - [`ProfileError::OffWing`], [`ProfileError::OffMirror`], [`ProfileError::Size`]: the old
    ///   profiles do not belong to this wing
    /// - the errors of profiles that are no plane curves, see [`super::Plane::of_profile`]
    pub fn new(old: &[Profile], surface: &WingSurface) -> Result<Self, ProfileError> {
        let WingSurface { positions, normals, .. } = *surface;
        if positions.len() != normals.len() {
            return Err(ProfileError::Lengths { positions: positions.len(), normals: normals.len() });
        }
        by_number(old)?;
        let size = old.iter().map(|profile| extent(&profile.points)).fold(0.0, f64::max);
        let (span, order) = Span::new(old, size)?;
        let agreed = Agreed::of(order.iter().map(|&i| &old[i]));
        let pairs = order.iter().zip(&span.planes).zip(agreed.towards);
        let section =
            |((&i, plane), towards): ((&usize, &Plane), Option<DVec3>)| KeptSection::new(&old[i], plane, towards);
        let sections = pairs.map(section).collect::<Result<Vec<_>, _>>()?;
        let (own, closeness) = checks::against_wing(&sections, &span, surface)?;
        let compared: Vec<bool> = own.iter().map(Option::is_some).collect();
        let (mut gaps, mut forms) = (Vec::new(), Vec::new());
        for (own, section) in own.into_iter().zip(&sections) {
            let number = section.profile().number;
            let (of_section, form) = own.map_or((Vec::new(), None), |own| (own.gaps, Some(own.forms)));
            gaps.extend(of_section.into_iter().map(|gap| (number, gap)));
            forms.push(form);
        }
        Ok(Self { closeness, gaps, ..Self::of_sections(Forms::new(sections, forms), &compared, span, surface)? })
    }

    /// The interpolation with a choice of how new profiles are matched.
    ///
    /// - `by`: `None` if each design decides
    #[must_use]
    pub fn matched_by(mut self, by: Option<ProfileMatch>) -> Self {
        self.forms.match_by(by);
        self
    }

    fn of_sections(forms: Forms, compared: &[bool], span: Span, surface: &WingSurface) -> Result<Self, ProfileError> {
        let sections = &forms.smooth;
        let numbers = sections.iter().map(|section| section.profile().number).collect();
        let tau = grid_parameters(sections.iter().any(KeptSection::has_base));
        let of_section = |section: &KeptSection| {
            let section = section.section();
            (section.knots(), section.side_arcs(), section.base_arcs())
        };
        let of_sections: Vec<_> = sections.par_iter().map(of_section).collect();
        let mut knots = Vec::with_capacity(of_sections.iter().map(|(knots, ..)| knots.len()).sum());
        let mut arcs = Vec::with_capacity(sections.len());
        for (of_section, sides, base) in of_sections {
            let base = base.map(|base| (knots.len() + sides.len(), base));
            arcs.push(SectionArcs { sides: (knots.len(), sides), base });
            knots.extend(of_section);
        }
        let trend = Trend::new(sections, &span);
        let flat_trend = forms.flat.as_ref().map(|flat| Trend::new(flat, &span));

        let (places, off) = places(sections, &arcs, &tau, &span, surface);
        checks::beside_wing(sections, compared, &span, surface, &off)?;
        let small = SMALL * sections.iter().map(KeptSection::length).sum::<f64>() / sections.len() as f64;
        let extent = extent(surface.positions);
        let along = surface.positions.iter().map(|position| position.dot(span.normal));
        let ends = along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)]);
        let alone = match &sections[..] {
            [only] => spanwise::reach_of_other_sections(only, surface.positions, &off),
            _ => None,
        };
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
            small,
            closeness: Closeness::default(),
            gaps: Vec::new(),
            extent,
            ends,
            alone,
        };
        let along = |place: usize| interpolation.along(&interpolation.places[place]);
        let (span, sections) = (&interpolation.span, &interpolation.forms.smooth);
        interpolation.watch = Watch::new(span, sections, compared, surface, &tau, along)?;
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
    ///   [`ProfileError::Turned`], [`ProfileError::FarAway`], [`ProfileError::Sharp`],
    ///   [`ProfileError::Swapped`], [`ProfileError::LacksPoints`], [`ProfileError::OnePlane`]: new
    ///   profiles that are no changed old ones
    /// - [`ProfileError::PointCounts`], [`ProfileError::PointOrder`]: the match is by points, and
    ///   they do not pair
    /// - the errors of profiles that are no plane curves
    pub fn displacements(&self, new: &[Profile]) -> Result<ProfileDisplacement, ProfileError> {
        let new = self.paired(new)?;
        let (closeness, mut remarks) =
            checks::against_old(self.forms.given(), &new, &self.span, self.extent, self.ends)?;
        let closeness = self.closeness.clone().max(closeness);
        let mut normal = DVec3::ZERO;
        for (section, profile) in self.forms.given().iter().zip(&new) {
            normal += section.new_normal(profile)?;
        }
        let normal = normal.normalize_or(self.span.normal);
        let changes = self.forms.changes(&new, &self.trend, self.flat_trend.as_ref())?;
        let (of_section, flat) = (&changes.of_section, changes.flat);
        let numbered = self.numbers.iter().zip(of_section);
        let matches = numbered.clone().map(|(&number, change)| (number, change.by)).collect();
        let why_not = numbered.clone().filter_map(|(&number, change)| Some((number, change.why_not?))).next();
        let kink = numbered.filter_map(|(&number, change)| Some((number, change.kink?))).next();
        if let (Some(reach), [only]) = (self.alone, &of_section[..])
            && !spanwise::is_shift(&only.knots, self.forms.smooth[0].length())
        {
            let (profile, chord) = (self.numbers[0], self.forms.smooth[0].length());
            remarks.push(Remark::Alone { profile, reach, chord });
        }
        let trend = self.trend_of(flat);
        let Lofted { map, remainder, whole, displaced } = self.lofted(changes);

        let at_place = |place: &Place| self.at_place(place, trend, &map, &remainder, &whole, normal);
        let (displacement, span_direction) = self.places.par_iter().map(at_place).unzip();
        let carried = self.arcs.par_iter().enumerate().map(|(k, arcs)| {
            let at = |(vertex, along): (usize, ArcPlace)| {
                let (knot, knots) = cubic_at(arcs, along);
                let place: &Place = &self.places[vertex];
                let at = into(&self.span.planes[k], place.position, self.along(place));
                let left: DVec3 = knots.iter().zip(&remainder[knot..]).map(|(&weight, &value)| value * weight).sum();
                at + left + trend.at(&map, at, self.span.eta[k])
            };
            self.watch.of_section(k).map(at).collect()
        });
        Ok(ProfileDisplacement {
            displacement,
            span_direction,
            displaced: flat.then_some(displaced),
            carried: carried.collect(),
            why_not,
            kink,
            matches,
            planes: new.iter().map(|new| Plane::of_profile(new)).collect::<Result<_, _>>()?,
            closeness,
            remarks,
            flat_cuts: flat,
        })
    }

    /// The trend of the form in which new profiles are compared.
    pub(super) fn trend_of(&self, flat: bool) -> &Trend {
        self.flat_trend.as_ref().filter(|_| flat).unwrap_or(&self.trend)
    }

    /// The trend of changes, and what is left at the knots.
    pub(super) fn lofted(&self, Changes { form, of_section, flat }: Changes) -> Lofted {
        let trend = self.trend_of(flat);
        let targets: Vec<DVec3> = of_section.iter().flat_map(|change| change.at_probes).collect();
        let map = trend.fit(&targets);

        let mut remainder = Vec::with_capacity(self.knots.len());
        let left = |(k, change): (usize, Change)| {
            let left_at = |knots: &[DVec3]| -> Vec<DVec3> {
                let pairs = knots.iter().zip(&change.knots);
                pairs.map(|(&knot, &d)| d - trend.at(&map, knot, self.span.eta[k])).collect()
            };
            let own = self.arcs[k].knots();
            if !flat {
                return (left_at(&self.knots[own]), None);
            }
            let (form, smooth) = (form[k].section(), self.forms.smooth[k].section());
            let left = transferred(&smooth, &form, &left_at(&form.knots()));
            let pairs = left.iter().zip(&self.knots[own]);
            let whole: Vec<DVec3> = pairs.map(|(&left, &knot)| left + trend.at(&map, knot, self.span.eta[k])).collect();
            (left, Some(smooth.displaced(&whole)))
        };
        let of_sections: Vec<_> = of_section.into_par_iter().enumerate().map(left).collect();
        let mut displaced = Vec::new();
        for (left, section) in of_sections {
            remainder.extend(left);
            displaced.extend(section);
        }
        let whole: Vec<DVec3> = self
            .arcs
            .iter()
            .enumerate()
            .flat_map(|(k, arcs)| arcs.knots().map(move |knot| (k, knot)))
            .map(|(k, knot)| remainder[knot] + trend.at(&map, self.knots[knot], self.span.eta[k]))
            .collect();
        Lofted { map, remainder, whole, displaced }
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
        if let Some(upper) = place.above() {
            let straight = place.shares[lower].of(remainder).lerp(upper.of(remainder), t);
            let whole: Vec<DVec3> = place.shares.iter().map(|share| share.of(whole)).collect();
            left = straight + Limit::limited(left - straight, &Bounds { whole: &whole, lower, t, small: self.small });
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
    pub(super) fn place_slope(&self, place: &Place) -> DVec3 {
        place.shares.iter().map(|share| share.of(&self.knots) * share.place_slope).sum()
    }

    /// Unit span-wise direction of the undeformed wing at a vertex.
    fn along(&self, place: &Place) -> DVec3 {
        self.place_slope(place).normalize_or(self.span.normal)
    }

    /// Deviation of the vertices beside the planes of the profiles from their sections: see
    /// [`Missed`].
    ///
    /// - `new`, `motion`: the new profiles and the result of [`Self::displacements`] for them
    /// - `moved` `[n_positions]`: positions of the wing's vertices at the end, in the mesh's unit
    ///
    /// # Errors
    /// The new profiles do not pair with the old ones.
    pub fn missed(
        &self,
        new: &[Profile],
        motion: &ProfileDisplacement,
        moved: &[DVec3],
    ) -> Result<Vec<Missed>, ProfileError> {
        let sections = match &motion.displaced {
            Some(displaced) => displaced.iter().collect(),
            None => self.paired(new)?,
        };
        Ok(self.watch.missed(motion, &sections, |vertex| self.places[vertex].position, moved))
    }

    /// The gaps of old profiles that pass through parts on the wing and are bridged as the wing's
    /// own sections are, each with the number of its profile. A profile that is another curve there
    /// is no guess, and left out.
    pub fn gaps(&self) -> &[(i64, Gap)] {
        &self.gaps
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

    /// The length of the old profile with the plane nearest to a point, in the mesh's unit.
    pub(crate) fn chord_near(&self, at: DVec3) -> f64 {
        let distance = |k: &usize| self.span.planes[*k].distance(at).abs();
        let nearest = (0..self.span.planes.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map_or(self.extent, |k| self.forms.smooth[k].length())
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
    pub(super) fn paired<'a>(&self, new: &'a [Profile]) -> Result<Vec<&'a Profile>, ProfileError> {
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

/// What a design's changes are made of.
pub(super) struct Lofted {
    pub map: TrendMap,
    /// Displacement of each knot without and with the trend.
    pub remainder: Vec<DVec3>,
    pub whole: Vec<DVec3>,
    /// See [`ProfileDisplacement::displaced`].
    pub displaced: Vec<Profile>,
}

/// Brings values at the knots of a flat section to the knots of the smooth one, by the common
/// parameter.
fn transferred(smooth: &OldSection, flat: &OldSection, values: &[DVec3]) -> Vec<DVec3> {
    let at = |(knot, knots): (usize, [f64; 4])| {
        knots.iter().zip(&values[knot..]).map(|(&weight, &value)| value * weight).sum()
    };
    transfer(smooth, flat).into_iter().map(at).collect()
}

/// For each knot of a smooth section, the first knot of the flat one that counts there, and the
/// weights.
pub(super) fn transfer(smooth: &OldSection, flat: &OldSection) -> Vec<(usize, [f64; 4])> {
    let sides = flat.side_arcs();
    let base = flat.base_arcs().map(|base| (sides.len(), base));
    let arcs = SectionArcs { sides: (0, sides), base };
    smooth.knot_parameters().into_iter().map(|tau| cubic_at(&arcs, ArcPlace::of(flat, tau))).collect()
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
