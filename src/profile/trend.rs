//! The part of the profiles' change that goes on along the whole span: position, twist, chord and thickness.
//!
//! Each section's change is fitted by an affine map in its plane. The maps are fitted by least squares with
//!
//! ```text
//! trend(X) = b + A X + e B (X - c(eta)),    e = (eta - eta_0) / scale
//! ```
//!
//! where `c(eta)` is the straight line fitted to the sections' middles and `B` acts across the span alone: maps that are linear
//! along the span, about that line. Every section counts alike, however many points it has. An affine change of all sections
//! is reproduced exactly at every point. Directions that the sections cannot see get no coefficient: with one section the
//! map is its own all along the span, with two it is linear between both.

use glam::DVec3;

use super::least_squares::LeastSquares;
use super::matching::OldSection;
use super::span::Span;

/// Coefficients of a trend.
pub(super) type TrendMap = Vec<DVec3>;

/// What the fit needs of the sections; made once per mesh.
#[derive(Debug)]
pub(super) struct Trend {
    centre: DVec3,
    eta: f64,
    /// The line through the sections' middles: its place at `eta` is `centre`, its slope this.
    along: DVec3,
    scale: f64,
    /// Two directions across the span.
    across: [DVec3; 2],
    /// Points of each section that stand for its affine map, around the line.
    probes: Vec<[DVec3; 4]>,
    rows: Vec<[f64; 6]>,
    squares: LeastSquares,
}

impl Trend {
    /// Of sections in the order of the span.
    pub fn new<'a>(sections: impl Iterator<Item = &'a OldSection>, span: &Span) -> Self {
        let sections: Vec<&OldSection> = sections.collect();
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
            rows: Vec::new(),
            squares: LeastSquares::new(Vec::new()),
        };
        for (plane, &eta) in span.planes.iter().zip(&span.eta) {
            let on_line = trend.line(eta);
            let middle = on_line - plane.normal * plane.distance(on_line);
            let (u, v) = plane.normal.any_orthonormal_pair();
            let probes = [u, -u, v, -v].map(|direction| middle + direction * scale);
            trend.rows.extend(probes.map(|probe| trend.basis(probe, eta)));
            trend.probes.push(probes);
        }
        let column = |i: usize| trend.rows.iter().map(|row| row[i]).collect();
        trend.squares = LeastSquares::new((0..6).map(column).collect());
        trend
    }

    fn line(&self, eta: f64) -> DVec3 {
        self.centre + self.along * (eta - self.eta)
    }

    fn basis(&self, point: DVec3, eta: f64) -> [f64; 6] {
        let p = (point - self.centre) / self.scale;
        let e = (eta - self.eta) / self.scale;
        let q = (point - self.line(eta)) / self.scale;
        [1.0, p.x, p.y, p.z, e * q.dot(self.across[0]), e * q.dot(self.across[1])]
    }

    /// The trend of the sections' changes.
    ///
    /// - `change`: displacement at a point of section `i` by the affine map fitted to it
    pub fn fit(&self, change: impl Fn(usize, DVec3) -> DVec3) -> TrendMap {
        let targets: Vec<DVec3> = (0..self.probes.len())
            .flat_map(|section| self.probes[section].map(|probe| change(section, probe)))
            .collect();
        let mut map = self.squares.solve(&targets);
        // A second pass on what is left takes the rounding of the first.
        let left: Vec<DVec3> = targets.iter().zip(&self.rows).map(|(&d, row)| d - combine(&map, row)).collect();
        for (coefficient, more) in map.iter_mut().zip(self.squares.solve(&left)) {
            *coefficient += more;
        }
        map
    }

    /// Displacement at a point that stands at `eta`.
    pub fn at(&self, map: &TrendMap, point: DVec3, eta: f64) -> DVec3 {
        combine(map, &self.basis(point, eta))
    }

    /// Its derivative along the span at a point that goes on by `along` for each unit of `eta`.
    pub fn slope(&self, map: &TrendMap, point: DVec3, eta: f64, along: DVec3) -> DVec3 {
        let at = |way: f64| self.at(map, point + along * way, eta + way);
        // Of degree two along any line: the central difference is exact.
        (at(self.scale) - at(-self.scale)) / (2.0 * self.scale)
    }
}

fn combine(map: &[DVec3], row: &[f64; 6]) -> DVec3 {
    map.iter().zip(row).map(|(&coefficient, &value)| coefficient * value).sum()
}
