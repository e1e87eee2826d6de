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
#[inline(always)]
pub fn project<T: Real>(constraint: &[T; 4], v: [T; 3]) -> [T; 3] {
    let [x, y, z, of_kind] = *constraint;
    let along = x * v[0] + y * v[1] + z * v[2];
    if of_kind == T::from_f64(kind::FREE) {
        return v;
    }
    if of_kind == T::from_f64(kind::IN_PLANE) {
        return [v[0] - along * x, v[1] - along * y, v[2] - along * z];
    }
    if of_kind == T::from_f64(kind::ON_LINE) {
        return [along * x, along * y, along * z];
    }
    [T::ZERO; 3]
}
