//! From the displacement of the profiles to the displacement of every wing vertex.
//!
//! ```text
//! u(X) = trend(X) + sum_k w_k(eta) sum_j c_kj(tau) [D_kj - trend(P_kj)]
//! ```
//!
//! - `P_kj`, `D_kj`: knot j of old profile k and its displacement, see [`super::matching`].
//! - `trend`: least-squares polynomial in 1, x, y, z and, with three and more planes, eta². Its degree drops by itself in
//!   directions the profiles cannot see. It makes an affine change of all profiles, and one quadratic along the span,
//!   exact to rounding at every vertex, also off the loft and beyond the outermost planes.
//! - `eta`, `w_k`: span coordinate of X and the planes' weights (linear for two planes, blended parabolas for more),
//!   exactly one plane's on that plane.
//! - `tau`, `c_kj`: the point of the section X stands at, see `locate`, and the cubic through the four knots round it.
//!
//! The ends of the edges that cross a profile's plane are corrected so that the facets between them have the profile's
//! remainder there too (see `crossings`); the trend stays exact at the vertices.
//!
//! The paper's step 3 is one least-squares polynomial of degree up to two in x, y, z. It smooths: the wing would miss its
//! new profiles by as much as the displacement differs from a quadratic. And a wing swept by more than its chord ties x
//! to y in the data, so that the x² term is fitted on the sections and then acts between the planes, as a dihedral.
//! Hence no x², xz, z² here, and the remainder is interpolated.
//!
//! The trend's slope across a thin wing comes from its change of thickness. Where the surface between the planes is off
//! the straight loft by d, that slope moves it by slope times d: right if all space is stretched, wrong if only the
//! sections are. Planes at the kinks of a wing keep d small.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::crossings::{self, Corrector, Crossing};
use super::curve::bracket;
use super::least_squares::LeastSquares;
use super::locate::SectionGrid;
use super::matching::OldSection;
use super::span::Span;
use super::{Profile, ProfileError, extent};

/// Everything about a wing and its old profiles that new profiles do not change. Made once per mesh.
#[derive(Debug)]
pub struct WingLoft {
    span: Span,
    /// In the order of the span.
    sections: Vec<OldSection>,
    numbers: Vec<i64>,
    /// Knots of all sections, back to back.
    knots: Vec<DVec3>,
    trend: Trend,
    /// The wing's vertices and after them the crossings.
    places: Vec<Place>,
    /// Rows of the places, back to back.
    terms: Vec<Term>,
    corrector: Corrector,
}

/// What new profiles do to the wing.
#[derive(Clone, Debug, PartialEq)]
pub struct WingMotion {
    /// Displacement of each wing vertex `[n_positions]`, in the unit of the mesh.
    pub displacement: Vec<DVec3>,
    /// Unit direction along which the moved wing runs span-wise at each vertex `[n_positions]`, at constant parameter of
    /// the sections, towards growing span coordinate.
    pub generator: Vec<DVec3>,
}

/// A point of the wing's surface between the profiles.
#[derive(Clone, Copy, Debug)]
struct Place {
    position: DVec3,
    eta: f64,
    /// Where its row in the terms ends; it begins where the last one's ended.
    end: usize,
}

/// How much one knot counts at a place.
#[derive(Clone, Copy, Debug)]
struct Term {
    knot: u32,
    weight: f64,
    /// Derivative of `weight` along the span coordinate.
    slope: f64,
}

impl WingLoft {
    /// Finds where every wing vertex stands between the old profiles.
    ///
    /// - `old`: the old profiles, at least one, in any order and direction
    /// - `positions` `[n]`: the wing's vertices, in the unit of the profiles
    /// - `normals` `[n]`: unit outward normals of the wing's surface there; a zero normal matches either side
    /// - `edges`: the edges of the wing's surface as pairs of places in `positions`: where they cross a profile's plane
    ///   the moved facets meet the new profile. Without them the vertices alone are moved.
    ///
    /// # Errors
    /// [`ProfileError::NoProfiles`], [`ProfileError::Doubled`], [`ProfileError::SamePlane`],
    /// [`ProfileError::Lengths`], and those of profiles that are no plane curves (see [`super::Plane::of_profile`]).
    pub fn new(
        old: &[Profile],
        positions: &[DVec3],
        normals: &[DVec3],
        edges: &[[u32; 2]],
    ) -> Result<Self, ProfileError> {
        if positions.len() != normals.len() {
            return Err(ProfileError::Lengths { positions: positions.len(), normals: normals.len() });
        }
        by_number(old)?;
        let size = old.iter().map(|profile| extent(&profile.points)).fold(0.0, f64::max);
        let (span, order) = Span::new(old, size)?;
        let pairs = order.iter().zip(&span.planes);
        let sections = pairs.map(|(&i, plane)| OldSection::new(&old[i], plane)).collect::<Result<Vec<_>, _>>()?;
        let grid = SectionGrid::new(&sections, span.normal);

        let mut knots = Vec::new();
        let mut knot_eta = Vec::new();
        let mut arcs = Vec::new();
        for (section, &eta) in sections.iter().zip(&span.eta) {
            let sides = (knots.len(), section.side_arcs());
            let base = section.base_arcs().map(|base| (knots.len() + sides.1.len(), base));
            arcs.push((sides, base));
            knots.extend(section.knots());
            knot_eta.resize(knots.len(), eta);
        }
        let trend = Trend::new(&knots, &knot_eta, span.planes.len() >= 3);

        let distances: Vec<Vec<f64>> =
            span.planes.iter().map(|plane| positions.iter().map(|&p| plane.distance(p)).collect()).collect();
        let crossings = crossings::find(&distances, edges);
        let crossing = |values: &[DVec3], crossing: &Crossing| {
            let [a, b] = crossing.ends.map(|end| values[end as usize]);
            a.lerp(b, crossing.at)
        };
        let at_crossings = crossings.iter().map(|c| (crossing(positions, c), crossing(normals, c)));
        let points: Vec<(DVec3, DVec3)> =
            positions.iter().copied().zip(normals.iter().copied()).chain(at_crossings).collect();

        let rows: Vec<(f64, Vec<Term>)> = points
            .par_iter()
            .map(|&(position, outward)| {
                let (eta, interval) = span.coordinate(position);
                let planes = span.weights(eta, interval);
                let tau = grid.parameter(position, outward, &planes);
                let mut row = Vec::with_capacity(16);
                for i in 0..planes.count {
                    let section = &sections[planes.first + i];
                    let (sides, base) = &arcs[planes.first + i];
                    let ((first, knot_arcs), arc) = match (base, &section.measured_base) {
                        (Some(base), Some(measured)) if tau > 2.0 => (base, measured.arc(tau)),
                        _ => (sides, section.measured.arc(tau.min(2.0))),
                    };
                    for (knot, weight) in cubic(knot_arcs, arc) {
                        let (weight, slope) = (planes.weight[i] * weight, planes.slope[i] * weight);
                        row.push(Term { knot: (first + knot) as u32, weight, slope });
                    }
                }
                (eta, row)
            })
            .collect();
        let mut places = Vec::with_capacity(points.len());
        let mut terms = Vec::new();
        for (&(position, _), (eta, row)) in points.iter().zip(rows) {
            terms.extend(row);
            places.push(Place { position, eta, end: terms.len() });
        }
        let numbers = order.iter().map(|&i| old[i].number).collect();
        let corrector = Corrector::new(crossings, positions.len());
        Ok(Self { span, sections, numbers, knots, trend, places, terms, corrector })
    }

    /// Displacement of every wing vertex for one design. Cheap: no search, a few multiplications a vertex.
    ///
    /// - `new`: the new profiles, with the old ones' numbers, in any order, direction and count of points
    ///
    /// A profile that agrees with its old one to 12 digits moves by exactly zero, and if all do, so does every vertex.
    ///
    /// # Errors
    /// [`ProfileError::Numbers`] when the numbers differ from the old ones, [`ProfileError::Doubled`], and those of
    /// profiles that are no plane curves.
    pub fn displacements(&self, new: &[Profile]) -> Result<WingMotion, ProfileError> {
        let by_number = by_number(new)?;
        let mut matched = Vec::with_capacity(self.knots.len());
        let mut normal = DVec3::ZERO;
        for (number, section) in self.numbers.iter().zip(&self.sections) {
            let Some(&profile) = by_number.get(number) else { return Err(self.wrong_numbers(new)) };
            matched.extend(section.displacements(profile)?);
            normal += section.new_normal(profile)?;
        }
        if by_number.len() != self.numbers.len() {
            return Err(self.wrong_numbers(new));
        }
        let normal = normal.normalize_or(self.span.normal);
        let trend = self.trend.fit(&matched);
        let remainder: Vec<DVec3> =
            matched.iter().enumerate().map(|(i, &d)| d - self.trend.at_knot(&trend, i)).collect();
        let moved: Vec<DVec3> = self.knots.iter().zip(&matched).map(|(&p, &d)| p + d).collect();

        let at_place = |i: usize| {
            let place = &self.places[i];
            let begin = if i == 0 { 0 } else { self.places[i - 1].end };
            let (mut displacement, mut along) = (DVec3::ZERO, DVec3::ZERO);
            for term in &self.terms[begin..place.end] {
                displacement += remainder[term.knot as usize] * term.weight;
                along += moved[term.knot as usize] * term.slope;
            }
            (displacement, along.normalize_or(normal))
        };
        let (mut displacement, mut generator): (Vec<DVec3>, Vec<DVec3>) =
            (0..self.places.len()).into_par_iter().map(at_place).unzip();
        let vertices = self.places.len() - self.corrector.n_crossings();
        let at_crossings = displacement.split_off(vertices);
        generator.truncate(vertices);
        self.corrector.correct(&at_crossings, &mut displacement);
        for (displacement, place) in displacement.iter_mut().zip(&self.places) {
            *displacement += self.trend.evaluate(&trend, place.position, place.eta);
        }
        Ok(WingMotion { displacement, generator })
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

fn by_number(profiles: &[Profile]) -> Result<HashMap<i64, &Profile>, ProfileError> {
    let mut map = HashMap::new();
    for profile in profiles {
        if map.insert(profile.number, profile).is_some() {
            return Err(ProfileError::Doubled { profile: profile.number });
        }
    }
    Ok(map)
}

/// Knots and weights of the cubic at arc length `x`: Hermite, with the slopes of the parabolas through three neighbours.
///
/// - `knots`: ascending arc lengths, at least two
fn cubic(knots: &[f64], x: f64) -> Vec<(usize, f64)> {
    let n = knots.len();
    let (i, t) = bracket(knots, x);
    let h = knots[i + 1] - knots[i];
    let first = i.saturating_sub(1);
    let mut weights = [0.0; 4];
    weights[i - first] += (1.0 - t) * (1.0 - t) * (1.0 + 2.0 * t);
    weights[i + 1 - first] += t * t * (3.0 - 2.0 * t);
    // Slope of the parabola through knots k - 1, k, k + 1 at k, times `share`.
    let mut slope = |k: usize, share: f64| {
        let (l, r) = (knots[k] - knots[k - 1], knots[k + 1] - knots[k]);
        weights[k - 1 - first] -= share * r / (l * (l + r));
        weights[k - first] += share * (r - l) / (l * r);
        weights[k + 1 - first] += share * l / (r * (l + r));
    };
    let (start, end) = (h * t * (1.0 - t) * (1.0 - t), -h * t * t * (1.0 - t));
    // At an end of the curve: twice the chord's slope less the other knot's, that is the parabola's.
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
    (first..n.min(first + 4)).zip(weights).filter(|(_, weight)| *weight != 0.0).collect()
}

/// The polynomial part of the displacement.
#[derive(Debug)]
struct Trend {
    centre: DVec3,
    eta: f64,
    scale: f64,
    quadratic: bool,
    /// Basis at the knots `[n_knots]`.
    rows: Vec<[f64; 5]>,
    squares: LeastSquares,
}

impl Trend {
    fn new(knots: &[DVec3], eta: &[f64], quadratic: bool) -> Self {
        let n = knots.len().max(1) as f64;
        let centre = knots.iter().sum::<DVec3>() / n;
        let scale = extent(knots).max(f64::MIN_POSITIVE);
        let mean_eta = eta.iter().sum::<f64>() / n;
        let mut trend =
            Self { centre, eta: mean_eta, scale, quadratic, rows: Vec::new(), squares: LeastSquares::new(Vec::new()) };
        trend.rows = knots.iter().zip(eta).map(|(&p, &eta)| trend.basis(p, eta)).collect();
        let column = |i: usize| trend.rows.iter().map(|row| row[i]).collect();
        trend.squares = LeastSquares::new((0..5).map(column).collect());
        trend
    }

    fn basis(&self, point: DVec3, eta: f64) -> [f64; 5] {
        let q = (point - self.centre) / self.scale;
        let e = (eta - self.eta) / self.scale;
        [1.0, q.x, q.y, q.z, if self.quadratic { e * e } else { 0.0 }]
    }

    fn fit(&self, displacement: &[DVec3]) -> Vec<DVec3> {
        let mut map = self.squares.solve(displacement);
        // A second pass on what is left takes the rounding of the first.
        let left: Vec<DVec3> = displacement.iter().enumerate().map(|(i, &d)| d - self.at_knot(&map, i)).collect();
        for (coefficient, more) in map.iter_mut().zip(self.squares.solve(&left)) {
            *coefficient += more;
        }
        map
    }

    fn at_knot(&self, map: &[DVec3], knot: usize) -> DVec3 {
        combine(map, &self.rows[knot])
    }

    fn evaluate(&self, map: &[DVec3], point: DVec3, eta: f64) -> DVec3 {
        combine(map, &self.basis(point, eta))
    }
}

fn combine(map: &[DVec3], row: &[f64; 5]) -> DVec3 {
    map.iter().zip(row).map(|(&coefficient, &value)| coefficient * value).sum()
}
