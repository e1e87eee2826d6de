//! [`Limit`]: blended parabolas along the span leave the straight interpolation between two
//! sections by no more than a share of the change.

use glam::DVec3;

use crate::geometry::nearest_on_segment;

/// Largest distance from the straight interpolation between two neighbouring sections, as a share
/// of the change. The change is the largest displacement of the sections that count, or the largest
/// difference between these displacements if it is less.
pub const OVERSHOOT: f64 = 0.1;

/// An overshoot below this share of the displacement counts as none where its limit is
/// differentiated.
const NO_BOW: f64 = 1e-9;

/// The largest overshoot of the parabolas that is allowed.
enum Allowed {
    /// By the displacement of this section, which is the largest.
    Largest(usize),
    /// By the difference of these two sections' displacements, which is the largest.
    Apart(usize, usize),
}

impl Allowed {
    /// The overshoot, and what allows it.
    ///
    /// - `whole`: displacement of each section that counts
    fn by(whole: &[DVec3]) -> (f64, Self) {
        let mut apart = (0.0, (0, 0));
        for (i, &a) in whole.iter().enumerate() {
            for (j, &b) in whole[..i].iter().enumerate() {
                if a.distance(b) > apart.0 {
                    apart = (a.distance(b), (i, j));
                }
            }
        }
        let mut largest = (0.0, 0);
        for (i, whole) in whole.iter().enumerate() {
            if whole.length() > largest.0 {
                largest = (whole.length(), i);
            }
        }
        let allowed = OVERSHOOT * f64::min(largest.0, apart.0);
        (allowed, if largest.0 <= apart.0 { Self::Largest(largest.1) } else { Self::Apart(apart.1.0, apart.1.1) })
    }
}

/// The limit of a vertex whose overshoot is reduced, and its derivative.
#[derive(Debug)]
pub(super) struct Limit {
    share: f64,
    bow: DVec3,
    /// Derivative of the share by the bow, and by the displacement of each section that counts.
    by_bow: DVec3,
    by_whole: Vec<DVec3>,
}

impl Limit {
    /// The part of the parabolas beyond the straight interpolation between two sections, reduced
    /// where it is too large.
    ///
    /// - `whole`: displacement of each section that counts
    /// - `lower`, `t`: the section below, and the share of the way to the next one
    pub fn limited(bow: DVec3, whole: &[DVec3], lower: usize, t: f64) -> DVec3 {
        Self::share(bow, whole, lower, t).map_or(bow, |share| bow * share)
    }

    /// The share of the bow that is left. `None` if it stays whole.
    fn share(bow: DVec3, whole: &[DVec3], lower: usize, t: f64) -> Option<f64> {
        let (allowed, _) = Allowed::by(whole);
        let (from, to) = (whole[lower], whole[lower + 1]);
        let on_way = from.lerp(to, t);
        let off = |share: f64| super::distance::distance(on_way + bow * share, &[from, to]);
        if off(1.0) <= allowed {
            return None;
        }
        // The distance grows with the share, so bisection finds the largest share allowed.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..50 {
            let middle = (low + high) / 2.0;
            if off(middle) <= allowed { low = middle } else { high = middle }
        }
        Some(low)
    }

    /// The derivative. `None` where the bow stays whole.
    pub fn new(bow: DVec3, whole: &[DVec3], lower: usize, t: f64) -> Option<Self> {
        let (_, by) = Allowed::by(whole);
        let largest = whole.iter().map(|whole| whole.length()).fold(0.0, f64::max);
        if bow.length() <= NO_BOW * largest {
            return None;
        }
        let share = Self::share(bow, whole, lower, t)?;
        let (from, to) = (whole[lower], whole[lower + 1]);
        let at = from.lerp(to, t) + bow * share;
        let (nearest, on_way) = nearest_on_segment(at, from, to);
        let away = (at - nearest).normalize_or(bow.normalize_or_zero());
        // The distance from the segment stays the allowed one:
        // away . (d on_way + share d bow + bow d share - d nearest) = d allowed.
        let slope = away.dot(bow);
        if slope <= 0.0 {
            return None;
        }
        let mut by_whole = vec![DVec3::ZERO; whole.len()];
        match by {
            Allowed::Largest(i) => by_whole[i] += whole[i].normalize_or_zero() * OVERSHOOT,
            Allowed::Apart(i, j) => {
                let apart = (whole[i] - whole[j]).normalize_or_zero() * OVERSHOOT;
                by_whole[i] += apart;
                by_whole[j] -= apart;
            }
        }
        by_whole[lower] -= away * (on_way - t);
        by_whole[lower + 1] += away * (on_way - t);
        by_whole.iter_mut().for_each(|by| *by /= slope);
        Some(Self { share, bow, by_bow: away * (-share / slope), by_whole })
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

    /// The four displacements and the bow at two designs: one whose largest difference allows the
    /// overshoot, and one whose largest displacement does.
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

    /// Fails if the share does not follow the bow, or the sections below and above.
    #[test]
    fn a_limit_has_its_derivative() {
        let (lower, t) = (1, 0.3);
        let (of_bow, of_whole) = (
            DVec3::new(0.3, -0.2, 0.7),
            [DVec3::new(0.5, 1.0, -0.2), DVec3::new(-0.4, 0.3, 0.9), DVec3::new(0.8, 0.1, 0.2), -DVec3::ONE],
        );
        for (bow, whole) in cases() {
            assert!(Limit::limited(bow, &whole, lower, t).length() < 0.9 * bow.length());
            let limit = Limit::new(bow, &whole, lower, t).unwrap();
            let exact = limit.forward(of_bow, &of_whole);
            let h = 1e-6;
            let [plus, minus] = [h, -h].map(|h| {
                let whole: Vec<DVec3> = whole.iter().zip(of_whole).map(|(whole, by)| *whole + by * h).collect();
                Limit::limited(bow + of_bow * h, &whole, lower, t)
            });
            let difference = (plus - minus) / (2.0 * h);
            assert!(difference.distance(exact) < 1e-8, "{difference} instead of {exact}");
            let seed = DVec3::new(1.0, -2.0, 0.5);
            let (by_bow, by_whole) = limit.reverse(seed);
            let along = by_bow.dot(of_bow) + by_whole.zip(of_whole).map(|(by, of)| by.dot(of)).sum::<f64>();
            assert!((along - seed.dot(exact)).abs() < 1e-14, "{along} instead of {}", seed.dot(exact));
        }
    }

    /// At rest, and where all sections move alike, there is no limit to differentiate.
    #[test]
    fn rest_has_no_limit() {
        assert!(Limit::new(DVec3::ZERO, &[DVec3::ZERO; 3], 0, 0.5).is_none());
        assert!(Limit::new(DVec3::Z * 1e-17, &[DVec3::X; 3], 0, 0.5).is_none());
    }
}
