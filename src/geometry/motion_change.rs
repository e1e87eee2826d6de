//! [`FittedChange`]: how a motion that is fitted to points changes with the places of these points,
//! and the transpose of that.
//!
//! With `p` and `q` the points before and after the motion, relative to their centres, `R` the best
//! rotation, `d` the directions in which the motion stretches and `e` the extents of the points in
//! them, the linear part of the motion is
//!
//! `R (1 - sum d d^T) + S sum d d^T / e`, with `S = sum q p^T`
//!
//! A rigid motion stretches in no direction. Only `R` and `S` depend on the points after the
//! motion. So a motion that stretches in all directions needs no rotation.

use glam::{DMat3, DVec3};

use super::fitted_motion::FittedMotion;
use super::rotation_vectors::{FittedRotation, axial, cross_matrix, outer};

/// The derivative of a fitted motion by the points after the motion.
#[derive(Clone, Debug)]
pub struct FittedChange {
    /// The points before the motion, relative to their centre, with their weights.
    points: Vec<(DVec3, f64)>,
    total: f64,
    centre: DVec3,
    /// `None` if the motion has no rotation that depends on the points.
    fit: Option<FittedRotation>,
    /// `R (1 - sum d d^T)`.
    turned: DMat3,
    /// `sum d d^T / e`.
    stretch: DMat3,
}

/// A change of a motion. That of a point `x` is `shift + linear (x - centre)`.
#[derive(Clone, Copy, Debug)]
pub struct MotionChange {
    centre: DVec3,
    shift: DVec3,
    linear: DMat3,
}

impl MotionChange {
    /// Change of the displacement of a point.
    ///
    /// - `at`: the point before the motion
    pub fn of(&self, at: DVec3) -> DVec3 {
        self.shift + self.linear * (at - self.centre)
    }

    /// The transpose of [`Self::of`]: adds the derivative by the motion, from the derivative by the
    /// displacement of a point.
    pub fn add(&mut self, at: DVec3, gradient: DVec3) {
        self.shift += gradient;
        self.linear += outer(gradient, at - self.centre);
    }
}

impl FittedChange {
    /// The derivative of [`FittedMotion::translation`].
    ///
    /// - `pairs`: as in [`FittedMotion::rigid`]
    pub fn translation(pairs: &[(DVec3, DVec3, f64)]) -> Self {
        let (centre, _) = FittedMotion::translation(pairs).centres();
        let total: f64 = pairs.iter().map(|pair| pair.2).sum();
        Self {
            points: pairs.iter().map(|pair| (pair.0 - centre, pair.2)).collect(),
            total: if total > 0.0 { total } else { 1.0 },
            centre,
            fit: None,
            turned: DMat3::ZERO,
            stretch: DMat3::ZERO,
        }
    }

    /// The derivative of [`FittedMotion::rigid`]. `None` if several rotations fit equally well.
    ///
    /// - `pairs`: as in [`FittedMotion::rigid`]
    pub fn rigid(pairs: &[(DVec3, DVec3, f64)]) -> Option<Self> {
        let (fit, turned) = rotation(pairs)?;
        Some(Self { fit: Some(fit), turned, ..Self::translation(pairs) })
    }

    /// The derivative of [`FittedMotion::affine`]. `None` if the motion does not stretch in all
    /// directions, and several rotations fit equally well.
    ///
    /// - `pairs`: as in [`FittedMotion::rigid`]
    pub fn affine(pairs: &[(DVec3, DVec3, f64)]) -> Option<Self> {
        let change = Self::translation(pairs);
        let directions = FittedMotion::stretched(&change.points);
        let stretch = directions.iter().fold(DMat3::ZERO, |sum, &(d, extent)| sum + outer(d, d) * (1.0 / extent));
        if directions.len() == 3 {
            return Some(Self { stretch, ..change });
        }
        let (fit, turned) = rotation(pairs)?;
        let across = directions.iter().fold(DMat3::IDENTITY, |across, &(d, _)| across - outer(d, d));
        Some(Self { fit: Some(fit), turned: turned * across, stretch, ..change })
    }

    /// A change of nothing, with the centre of this motion.
    pub fn none(&self) -> MotionChange {
        MotionChange { centre: self.centre, shift: DVec3::ZERO, linear: DMat3::ZERO }
    }

    /// Change of the motion.
    ///
    /// - `changes`: of the points after the motion, in the order of the pairs
    pub fn forward(&self, changes: &[DVec3]) -> MotionChange {
        let mut change = self.none();
        let mut of_sum = DMat3::ZERO;
        for (&of_point, &(point, weight)) in changes.iter().zip(&self.points) {
            change.shift += of_point * (weight / self.total);
            of_sum += outer(of_point * weight, point);
        }
        change.linear = of_sum * self.stretch;
        if let Some(fit) = &self.fit {
            change.linear += cross_matrix(fit.forward(of_sum)) * self.turned;
        }
        change
    }

    /// The transpose of [`Self::forward`]: the derivative of a number by the points after the
    /// motion, in the order of the pairs.
    ///
    /// - `by_motion`: the derivative of the number by the motion, with the centre of [`Self::none`]
    pub fn reverse(&self, by_motion: &MotionChange) -> Vec<DVec3> {
        let mut by_sum = by_motion.linear * self.stretch;
        if let Some(fit) = &self.fit {
            by_sum += fit.reverse(axial(by_motion.linear * self.turned.transpose()));
        }
        let by_point = |&(point, weight): &(DVec3, f64)| (by_sum * point + by_motion.shift / self.total) * weight;
        self.points.iter().map(by_point).collect()
    }
}

/// The best rotation of the pairs with its derivative.
fn rotation(pairs: &[(DVec3, DVec3, f64)]) -> Option<(FittedRotation, DMat3)> {
    let motion = FittedMotion::rigid(pairs);
    let (from, to) = motion.centres();
    let sum = pairs.iter().fold(DMat3::ZERO, |sum, pair| sum + outer((pair.1 - to) * pair.2, pair.0 - from));
    let turn = DMat3::from_quat(motion.rotation());
    Some((FittedRotation::new(turn, sum)?, turn))
}

#[cfg(test)]
mod tests {
    use super::*;

    type Pairs = Vec<(DVec3, DVec3, f64)>;
    type Fit = fn(&[(DVec3, DVec3, f64)]) -> FittedMotion;
    type Change = fn(&[(DVec3, DVec3, f64)]) -> Option<FittedChange>;

    const FITS: [(&str, Fit, Change); 3] = [
        ("translation", FittedMotion::translation, |pairs| Some(FittedChange::translation(pairs))),
        ("rigid", FittedMotion::rigid, FittedChange::rigid),
        ("affine", FittedMotion::affine, FittedChange::affine),
    ];

    fn noise(k: usize) -> DVec3 {
        let t = k as f64;
        DVec3::new((1.3 * t + 0.2).sin(), (2.9 * t).cos(), (0.7 * t * t + 1.1).sin())
    }

    /// Points in all directions, and points on a plane, before and after a motion with a bend.
    fn sets() -> Vec<(&'static str, Pairs)> {
        let moved = |at: DVec3| DVec3::new(at.x + 0.3 * at.y * at.y, 0.9 * at.y - 0.4 * at.x, at.z + 0.2 * at.x * at.z);
        let pair = |at: DVec3, weight| (at, moved(at), weight);
        let cloud = (0..9).map(|k| pair(noise(k), 1.0 + 0.5 * noise(k + 40).x)).collect();
        let flat = (0..9).map(|k| pair(noise(k).with_z(0.25), 1.0 + 0.5 * noise(k + 40).x)).collect();
        let rest = (0..9).map(|k| (noise(k), noise(k), 1.0)).collect();
        vec![("cloud", cloud), ("flat", flat), ("at rest", rest)]
    }

    /// Central differences of the fits themselves.
    ///
    /// Fails if either term of the linear part is left out.
    #[test]
    fn changes_are_the_limit_of_fits() {
        for (of, pairs) in sets() {
            let changes: Vec<DVec3> = (0..pairs.len()).map(|k| noise(k + 80)).collect();
            let shifted = |h: f64| -> Pairs {
                let shift = |(&(p, q, weight), change): (&(DVec3, DVec3, f64), &DVec3)| (p, q + *change * h, weight);
                pairs.iter().zip(&changes).map(shift).collect()
            };
            for (name, fit, change) in FITS {
                let h = 1e-5;
                let [plus, minus] = [h, -h].map(|h| fit(&shifted(h)));
                let found = change(&pairs).unwrap().forward(&changes);
                for at in [DVec3::ZERO, DVec3::new(0.3, -2.0, 1.0), DVec3::new(-1.0, 0.5, 3.0)] {
                    let expected = (plus.displacement(at) - minus.displacement(at)) / (2.0 * h);
                    let off = found.of(at).distance(expected) / expected.length();
                    assert!(off < 1e-8, "{of}, {name}, {at}: {off:e}");
                }
            }
        }
    }

    #[test]
    fn reverse_is_the_transpose() {
        for (of, pairs) in sets() {
            let changes: Vec<DVec3> = (0..pairs.len()).map(|k| noise(k + 80)).collect();
            for (name, _, change) in FITS {
                let change = change(&pairs).unwrap();
                let (forward, mut by_motion) = (change.forward(&changes), change.none());
                let mut one = 0.0;
                for k in 0..5 {
                    let (at, seed) = (noise(k + 200), noise(k + 300));
                    one += seed.dot(forward.of(at));
                    by_motion.add(at, seed);
                }
                let other: f64 = change.reverse(&by_motion).iter().zip(&changes).map(|(by, of)| by.dot(*of)).sum();
                assert!((one - other).abs() < 1e-13 * one.abs().max(1.0), "{of}, {name}: {one} {other}");
            }
        }
    }

    /// About a line every rotation fits. An affine motion of points in all directions needs none.
    #[test]
    fn a_motion_that_is_not_unique_has_no_derivative() {
        let line: Vec<_> = (0..5).map(|k| (DVec3::X * k as f64, DVec3::Y * k as f64, 1.0)).collect();
        assert!(FittedChange::rigid(&line).is_none() && FittedChange::affine(&line).is_none());
        let pressed: Vec<_> = (0..9).map(|k| (noise(k), DVec3::X * noise(k).x, 1.0)).collect();
        assert!(FittedChange::rigid(&pressed).is_none() && FittedChange::affine(&pressed).is_some());
    }
}
