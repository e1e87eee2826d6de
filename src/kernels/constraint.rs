//! What a vertex may do; twin of `kernels/constraint.wgsl`.

use super::Real;

/// What the fourth component of a constraint says of the other three.
pub mod kind {
    /// Nothing: the vertex moves freely.
    pub const FREE: f64 = 0.0;
    /// Nothing: the vertex does not move.
    pub const HELD: f64 = 1.0;
    /// They are the unit normal of the plane the vertex moves in.
    pub const IN_PLANE: f64 = 2.0;
    /// They are the unit direction the vertex moves along.
    pub const ON_LINE: f64 = 3.0;
}

/// The part of a vector its vertex may follow: all of it, none, without its component along the normal, or only its
/// component along the direction.
///
/// - `v`: the vector, and idle components if any, which stay what they are but at held vertices
#[inline(always)]
pub fn project<T: Real, const N: usize>(constraint: &[T; 4], mut v: [T; N]) -> [T; N] {
    let [x, y, z, of_kind] = *constraint;
    let along = x * v[0] + y * v[1] + z * v[2];
    if of_kind == T::from_f64(kind::FREE) {
        return v;
    }
    if of_kind == T::from_f64(kind::IN_PLANE) {
        for axis in 0..3 {
            v[axis] = v[axis] - along * constraint[axis];
        }
        return v;
    }
    if of_kind == T::from_f64(kind::ON_LINE) {
        for axis in 0..3 {
            v[axis] = along * constraint[axis];
        }
        return v;
    }
    [T::ZERO; N]
}
