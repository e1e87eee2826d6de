//! The trend: the part of the profiles' change that continues along the whole span, in position,
//! twist, chord and thickness.
//!
//! Each section's change is fitted by an affine map in its plane. The maps are fitted by least
//! squares with
//!
//! ```text
//! trend(X) = b + A X + e B (X - c(eta)),    e = (eta - eta_0) / scale
//! ```
//!
//! `c(eta)` is the straight line fitted to the sections' middles, and `B` acts across the span
//! only. So the map is linear along the span, about this line. Every section has the same weight,
//! whatever its number of points. An affine change of all sections is reproduced exactly at every
//! point. Directions that the sections do not determine get no coefficient: with one section the
//! map is constant along the span, with two it is linear between them.

use glam::DVec3;

use super::kept::KeptSection;
use super::least_squares::LeastSquares;
use super::span::Span;

/// Coefficients of a trend.
pub(super) type TrendMap = Vec<DVec3>;

/// The fit for given sections. Made once per mesh.
#[derive(Debug)]
pub(super) struct Trend {
    centre: DVec3,
    eta: f64,
    /// Slope of the line through the sections' middles. At `eta` the line passes through `centre`.
    along: DVec3,
    scale: f64,
    /// Two directions across the span.
    across: [DVec3; 2],
    /// Points of each section, around the line, at which its affine map is evaluated.
    probes: Vec<[DVec3; 4]>,
    /// Span coordinate of each section.
    etas: Vec<f64>,
    squares: LeastSquares,
}

impl Trend {
    /// Prepares the fit for sections in the order of the span.
    pub fn new(sections: &[KeptSection], span: &Span) -> Self {
        let n = sections.len().max(1) as f64;
        let middles: Vec<DVec3> = sections.iter().map(|section| section.middle()).collect();
        let centre = middles.iter().sum::<DVec3>() / n;
        let eta = span.eta.iter().sum::<f64>() / n;
        let scale = (sections.iter().map(|section| section.length()).sum::<f64>() / n).max(f64::MIN_POSITIVE);
        let square: f64 = span.eta.iter().map(|other| (other - eta).powi(2)).sum();
        let moment: DVec3 =
            middles.iter().zip(&span.eta).map(|(&middle, other)| (middle - centre) * (other - eta)).sum();
        let along = if square > 0.0 { moment / square } else { span.normal };
        let (u, v) = span.normal.any_orthonormal_pair();
        let mut trend = Self {
            centre,
            eta,
            along,
            scale,
            across: [u, v],
            probes: Vec::new(),
            etas: span.eta.clone(),
            squares: LeastSquares::new(Vec::new()),
        };
        let mut rows = Vec::with_capacity(4 * sections.len());
        for (plane, &eta) in span.planes.iter().zip(&span.eta) {
            let on_line = trend.line(eta);
            let middle = on_line - plane.normal * plane.distance(on_line);
            let (u, v) = plane.normal.any_orthonormal_pair();
            let probes = [u, -u, v, -v].map(|direction| middle + direction * scale);
            rows.extend(probes.map(|probe| trend.basis(probe, eta)));
            trend.probes.push(probes);
        }
        let column = |i: usize| rows.iter().map(|row| row[i]).collect();
        trend.squares = LeastSquares::new((0..6).map(column).collect());
        trend
    }

    fn line(&self, eta: f64) -> DVec3 {
        self.centre + self.along * (eta - self.eta)
    }

    /// The values at a point that the coefficients multiply.
    pub fn basis(&self, point: DVec3, eta: f64) -> [f64; 6] {
        let p = (point - self.centre) / self.scale;
        let e = (eta - self.eta) / self.scale;
        let q = (point - self.line(eta)) / self.scale;
        [1.0, p.x, p.y, p.z, e * q.dot(self.across[0]), e * q.dot(self.across[1])]
    }

    /// The points of a section at which the change of its affine map counts.
    pub fn probes(&self, section: usize) -> [DVec3; 4] {
        self.probes[section]
    }

    /// The trend of the sections' changes.
    ///
    /// - `targets`: displacements at the probes of one section after the other, by the affine map
    ///   fitted to the section
    pub fn fit(&self, targets: &[DVec3]) -> TrendMap {
        let mut map = self.squares.solve(targets);
        // A second fit of what is left removes the rounding of the first.
        let probes = self.probes.iter().zip(&self.etas).flat_map(|(probes, &eta)| probes.map(|probe| (probe, eta)));
        let left: Vec<DVec3> =
            targets.iter().zip(probes).map(|(&d, (probe, eta))| d - self.at(&map, probe, eta)).collect();
        for (coefficient, more) in map.iter_mut().zip(self.squares.solve(&left)) {
            *coefficient += more;
        }
        map
    }

    /// The transpose of [`Self::fit`]: the derivative by the targets.
    pub fn fit_reverse(&self, by_map: &TrendMap) -> Vec<DVec3> {
        self.squares.solve_reverse(by_map)
    }

    /// Displacement at a point with the span coordinate `eta`.
    pub fn at(&self, map: &TrendMap, point: DVec3, eta: f64) -> DVec3 {
        combine(map, &self.basis(point, eta))
    }

    /// Derivative of the displacement along the span, at a point that moves by `along` per unit of
    /// `eta`.
    pub fn slope(&self, map: &TrendMap, point: DVec3, eta: f64, along: DVec3) -> DVec3 {
        let at = |way: f64| self.at(map, point + along * way, eta + way);
        // The displacement has degree two along any line, so the central difference is exact.
        (at(self.scale) - at(-self.scale)) / (2.0 * self.scale)
    }

    /// The values that the coefficients multiply in [`Self::slope`].
    pub fn slope_basis(&self, point: DVec3, eta: f64, along: DVec3) -> [f64; 6] {
        let at = |way: f64| self.basis(point + along * way, eta + way);
        let (after, before) = (at(self.scale), at(-self.scale));
        std::array::from_fn(|i| (after[i] - before[i]) / (2.0 * self.scale))
    }
}

fn combine(map: &[DVec3], row: &[f64; 6]) -> DVec3 {
    map.iter().zip(row).map(|(&coefficient, &value)| coefficient * value).sum()
}
