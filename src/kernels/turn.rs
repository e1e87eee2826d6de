//! Quaternions of rotation vectors. Twin of `kernels/turn.wgsl`.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// Number of places.
    pub n_places: u32,
    /// Not used.
    pub padding: u32,
    /// Unit of the vectors in radians, a power of two.
    pub unit: f64,
}

/// A rotation as a quaternion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// The axis, times the sine of half the angle.
    pub vector: DVec3,
    /// The cosine of half the angle.
    pub scalar: f64,
}

/// `(-1)^k / (2k + 1)!` for k = 7, 6 ... 0: the sine over its argument.
const SINE: [f64; 8] = [
    -7.647163731819816e-13,
    1.6059043836821613e-10,
    -2.505210838544172e-08,
    2.7557319223985893e-06,
    -0.0001984126984126984,
    0.008333333333333333,
    -0.16666666666666666,
    1.0,
];

/// `(-1)^k / (2k)!` for k = 8, 7 ... 1, and 0: the cosine minus 1.
const COSINE: [f64; 9] = [
    4.779477332387385e-14,
    -1.1470745597729725e-11,
    2.08767569878681e-09,
    -2.755731922398589e-07,
    2.48015873015873e-05,
    -0.001388888888888889,
    0.041666666666666664,
    -0.5,
    0.0,
];

/// The quaternion of a rotation vector, with `+ - *` alone: every machine has the same bits. Right
/// to 1.3e-15 up to an angle of 2 pi; zero gives the identity.
///
/// The vector is divided by 8, and its sine and cosine are doubled twice: a quaternion has half of
/// the angle. Both numbers are those of the kernel, so there is no other twin.
///
/// - `vector`: in radians
///
/// Source: Taylor's series of sine and cosine, in Horner's form.
#[inline(always)]
pub fn run(vector: DVec3) -> Turn {
    let v = vector * 0.125;
    let s = v.x * v.x + v.y * v.y + v.z * v.z;
    let sum = |sum: f64, &term: &f64| sum * s + term;
    let [sine, mut c] = [SINE.as_slice(), &COSINE].map(|terms| terms[1..].iter().fold(terms[0], sum));
    let mut t = sine * v;
    for _ in 0..2 {
        let squared = t.x * t.x + t.y * t.y + t.z * t.z;
        t *= 2.0 * (1.0 + c);
        c = -2.0 * squared;
    }
    Turn { vector: t, scalar: 1.0 + c }
}

impl Turn {
    /// Half of the displacement of `arm` by the rotation: half of `R arm - arm`. Small rotations
    /// lose no digits.
    #[inline(always)]
    pub fn half_displacement(&self, arm: DVec3) -> DVec3 {
        let Self { vector: v, scalar } = *self;
        let t = cross(v, arm);
        scalar * t + cross(v, t)
    }
}

#[inline(always)]
fn cross(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::run;

    /// Against sine and cosine, up to an angle of 2 pi: 1.3e-15 by the series' own error.
    #[test]
    fn a_quaternion_has_the_sine_and_cosine_of_half_the_angle() {
        let axis = DVec3::new(2.0, -3.0, 6.0) / 7.0;
        for step in 0..=1000 {
            let angle = std::f64::consts::TAU * f64::from(step) / 1000.0;
            let (sin, cos) = (0.5 * angle).sin_cos();
            let turn = run(axis * angle);
            let off = (turn.vector - axis * sin).length().max((turn.scalar - cos).abs());
            assert!(off <= 1.5e-15, "{angle}: {off}");
        }
    }

    /// The identity moves nothing at all, and a small rotation loses no digit: half of `w x arm`.
    #[test]
    fn small_rotations_keep_their_digits() {
        let arm = DVec3::new(0.3, -0.7, 1.1);
        assert_eq!(run(DVec3::ZERO).half_displacement(arm), DVec3::ZERO);
        let w = DVec3::new(1e-9, 2e-9, -3e-9);
        let off = run(w).half_displacement(arm) - 0.5 * w.cross(arm);
        assert!(off.length() <= 1e-8 * w.length(), "{off}");
    }

    /// Twice the half displacement is the displacement by the rotation.
    #[test]
    fn an_arm_moves_as_by_a_rotation() {
        let arm = DVec3::new(0.3, -0.7, 1.1);
        for w in [DVec3::new(0.3, 0.2, -0.1), DVec3::new(-2.0, 1.0, 2.5), DVec3::new(0.0, 0.0, 5.0)] {
            let expected = DQuat::from_scaled_axis(w) * arm - arm;
            assert!((2.0 * run(w).half_displacement(arm) - expected).length() <= 1e-14);
        }
    }
}
