//! [`Limit`]: blended parabolas along the span leave the straight interpolation between two
//! sections by no more than a share of the change.
//!
//! ```text
//! a     = sqrt(sum_i |w_i - mean|^2 + d^2)
//! off^2 = min over s in [0, 1] of |b - (s - t) v|^2 + (s - t)^2 d a
//! ```
//!
//! | symbol | is |
//! |---|---|
//! | `w_i` | displacement of section i at the vertex's place along the sections |
//! | `v`, `t` | `w` of the section above less `w` of the section below, and the share of the way between them |
//! | `b` | the bow: the parabolas less the straight interpolation |
//! | `d` | [`SMALL`] of the chord |
//! | `a` | the change along the span |
//!
//! A bow with `off > OVERSHOOT a` is shortened until `off = OVERSHOOT a`. With `d = 0` `off` is the
//! distance of the displacement from those between both sections. The length `d` leaves small
//! motions alone, so that the interpolation is linear beside a design at which sections rest or
//! move alike. With `d = 0` its derivative would jump at each such design, and a loop usually
//! starts at one.

use glam::DVec3;

/// Largest distance from the straight interpolation between two neighbouring sections, as a share
/// of the change. The change is the root of the sum of squares of the differences between the
/// displacement of each section and their mean: for two to four sections, 0.7 to 1 of the largest
/// difference between two of them.
pub const OVERSHOOT: f64 = 0.1;

/// A change by this share of the chord counts as large.
pub(super) const SMALL: f64 = 1e-3;

/// The limit of a vertex whose overshoot is reduced, and its derivative.
#[derive(Debug)]
pub(super) struct Limit {
    share: f64,
    bow: DVec3,
    /// Derivative of the share by the bow, and by the displacement of each section that counts.
    by_bow: DVec3,
    by_whole: Vec<DVec3>,
}

/// What limits the bow of a vertex.
pub(super) struct Bounds<'a> {
    /// Displacement of each section that counts.
    pub whole: &'a [DVec3],
    /// The section below.
    pub lower: usize,
    /// Share of the way to the next section.
    pub t: f64,
    /// A small length, `d` in the module's formulas, in the mesh's unit.
    pub small: f64,
}

impl Bounds<'_> {
    fn mean(&self) -> DVec3 {
        self.whole.iter().sum::<DVec3>() / self.whole.len() as f64
    }

    /// The change along the span.
    fn change(&self) -> f64 {
        let mean = self.mean();
        let squares = self.whole.iter().map(|whole| whole.distance_squared(mean)).sum::<f64>();
        (squares + self.small * self.small).sqrt()
    }

    /// From the displacement of the section below to that of the section above.
    fn between(&self) -> DVec3 {
        self.whole[self.lower + 1] - self.whole[self.lower]
    }

    /// The way from the vertex to the nearest place between the sections, as a share of the way
    /// between them, and what is left of the bow there.
    fn nearest(&self, bow: DVec3, change: f64) -> (f64, DVec3) {
        let between = self.between();
        let way = bow.dot(between) / (between.length_squared() + self.small * change);
        let way = if way.is_finite() { way.clamp(-self.t, 1.0 - self.t) } else { 0.0 };
        (way, bow - between * way)
    }

    fn off(&self, bow: DVec3, change: f64) -> f64 {
        let (way, left) = self.nearest(bow, change);
        (left.length_squared() + way * way * self.small * change).sqrt()
    }

    /// The share of the bow that is left. `None` if it stays whole.
    fn share(&self, bow: DVec3) -> Option<f64> {
        let change = self.change();
        let allowed = OVERSHOOT * change;
        if self.off(bow, change) <= allowed {
            return None;
        }
        // The distance grows with the share, so bisection finds the largest share allowed.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..50 {
            let middle = (low + high) / 2.0;
            if self.off(bow * middle, change) <= allowed { low = middle } else { high = middle }
        }
        Some(low)
    }
}

impl Limit {
    /// The part of the parabolas beyond the straight interpolation between two sections, reduced
    /// where it is too large.
    pub fn limited(bow: DVec3, bounds: &Bounds) -> DVec3 {
        bounds.share(bow).map_or(bow, |share| bow * share)
    }

    /// The derivative. `None` where the bow stays whole.
    pub fn new(bow: DVec3, bounds: &Bounds) -> Option<Self> {
        let share = bounds.share(bow)?;
        let change = bounds.change();
        let (way, left) = bounds.nearest(bow * share, change);
        // `off` stays the allowed one. The nearest place between the sections is the best one, so
        // its own change does not count:
        // left . (share d bow + bow d share - way d between) + way^2 small / 2 d change
        //     = OVERSHOOT off d change.
        let slope = left.dot(bow);
        if slope <= 0.0 {
            return None;
        }
        let mean = bounds.mean();
        let by_change = OVERSHOOT * bounds.off(bow * share, change) - 0.5 * way * way * bounds.small;
        let by_allowed = |whole: &DVec3| (*whole - mean) * (by_change / change);
        let mut by_whole: Vec<DVec3> = bounds.whole.iter().map(by_allowed).collect();
        by_whole[bounds.lower] -= left * way;
        by_whole[bounds.lower + 1] += left * way;
        by_whole.iter_mut().for_each(|by| *by /= slope);
        Some(Self { share, bow, by_bow: left * (-share / slope), by_whole })
    }

    /// Change of the reduced bow.
    pub fn forward(&self, bow: DVec3, whole: &[DVec3]) -> DVec3 {
        let share =
            self.by_bow.dot(bow) + self.by_whole.iter().zip(whole).map(|(by, whole)| by.dot(*whole)).sum::<f64>();
        bow * self.share + self.bow * share
    }

    /// The transpose of [`Self::forward`]: the derivatives by the bow and by the displacements.
    pub fn reverse(&self, by: DVec3) -> (DVec3, impl Iterator<Item = DVec3>) {
        let by_share = self.bow.dot(by);
        (by * self.share + self.by_bow * by_share, self.by_whole.iter().map(move |own| *own * by_share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The four displacements and the bow at two designs: one whose sections move alike, and one
    /// whose sections move apart.
    fn cases() -> [(DVec3, [DVec3; 4]); 2] {
        let whole = [
            DVec3::new(0.1, 0.0, 1.0),
            DVec3::new(0.0, 0.2, 1.1),
            DVec3::new(0.3, 0.1, 0.8),
            DVec3::new(0.1, 0.0, 1.2),
        ];
        let opposite = whole.map(|whole| if whole.y > 0.05 { whole } else { -whole });
        [(DVec3::new(0.1, 0.3, -0.2), whole), (DVec3::new(0.5, 0.1, -0.2), opposite)]
    }

    /// Fails if the share does not follow the bow, or the sections below and above, or if the
    /// nearest place between the sections is not the best one.
    #[test]
    fn a_limit_has_its_derivative() {
        let (lower, t, small) = (1, 0.3, 0.2);
        let (of_bow, of_whole) = (
            DVec3::new(0.3, -0.2, 0.7),
            [DVec3::new(0.5, 1.0, -0.2), DVec3::new(-0.4, 0.3, 0.9), DVec3::new(0.8, 0.1, 0.2), -DVec3::ONE],
        );
        for (bow, whole) in cases() {
            let limited = |bow: DVec3, whole: &[DVec3]| Limit::limited(bow, &Bounds { whole, lower, t, small });
            assert!(limited(bow, &whole).length() < 0.9 * bow.length());
            let limit = Limit::new(bow, &Bounds { whole: &whole, lower, t, small }).unwrap();
            let exact = limit.forward(of_bow, &of_whole);
            let h = 1e-6;
            let [plus, minus] = [h, -h].map(|h| {
                let whole: Vec<DVec3> = whole.iter().zip(of_whole).map(|(whole, by)| *whole + by * h).collect();
                limited(bow + of_bow * h, &whole)
            });
            let difference = (plus - minus) / (2.0 * h);
            assert!(difference.distance(exact) < 1e-8, "{difference} instead of {exact}");
            let seed = DVec3::new(1.0, -2.0, 0.5);
            let (by_bow, by_whole) = limit.reverse(seed);
            let along = by_bow.dot(of_bow) + by_whole.zip(of_whole).map(|(by, of)| by.dot(of)).sum::<f64>();
            assert!((along - seed.dot(exact)).abs() < 1e-14, "{along} instead of {}", seed.dot(exact));
        }
    }

    /// At rest, and where all sections move alike, small bows stay whole.
    ///
    /// Fails if `SMALL` is 0.
    #[test]
    fn small_motions_have_no_limit() {
        for whole in [DVec3::ZERO, DVec3::X] {
            let bounds = Bounds { whole: &[whole; 3], lower: 0, t: 0.5, small: SMALL };
            assert!(Limit::new(DVec3::ZERO, &bounds).is_none());
            assert!(Limit::new(DVec3::Z * 0.9e-4, &bounds).is_none());
            assert!(Limit::new(DVec3::Z * 1.1e-4, &bounds).is_some());
        }
    }

    /// One section moves far; the sections below and above a vertex rest. A small motion of one of
    /// them has a derivative: both one-sided differences agree.
    ///
    /// Fails if `off` is the distance itself, without `d`.
    #[test]
    fn sections_at_rest_beside_a_large_motion_have_their_derivative() {
        let (bow, lower, t, small) = (DVec3::Z * 0.3, 0, 0.5, SMALL);
        let limited = |h: f64| {
            let whole = [DVec3::Z * h, DVec3::ZERO, DVec3::Z];
            Limit::limited(bow, &Bounds { whole: &whole, lower, t, small }).z
        };
        let h = 1e-7;
        let [plus, minus] = [limited(h) - limited(0.0), limited(0.0) - limited(-h)].map(|difference| difference / h);
        assert!((plus - minus).abs() < 1e-3, "{plus} and {minus}");
    }
}
