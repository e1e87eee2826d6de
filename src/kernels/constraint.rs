//! The constraint of a vertex: free, held, in a plane or on a line. Twin of
//! `kernels/constraint.wgsl`.

use super::Real;

/// Kinds of constraints. A constraint is a vector of four components; the fourth is its kind.
pub mod kind {
    /// The vertex moves freely. The other components are not used.
    pub const FREE: f64 = 0.0;
    /// The vertex does not move. The other components are not used.
    pub const HELD: f64 = 1.0;
    /// The vertex moves in a plane. The other components are the plane's unit normal.
    pub const IN_PLANE: f64 = 2.0;
    /// The vertex moves on a line. The other components are the line's unit direction.
    pub const ON_LINE: f64 = 3.0;
}

/// Projects the vector of each design on the directions that a constraint allows.
///
/// | kind | result |
/// |---|---|
/// | free | `v` |
/// | held | 0 |
/// | in a plane with normal `n` | `v - n (n . v)` |
/// | on a line with direction `d` | `d (d . v)` |
///
/// - `v` `[N]`: a vector of three components for each of `N / 3` designs. A component that is left
///   changes at held vertices only
#[inline(always)]
pub fn project<T: Real, const N: usize>(constraint: &[T; 4], v: [T; N]) -> [T; N] {
    if constraint[3] == T::from_f64(kind::FREE) {
        return v;
    }
    if N > 4 { limited_apart(constraint, v) } else { limited(constraint, v) }
}

/// [`limited`] for several designs. A compiler that sees its sums beside those of a row puts the
/// components of the row into vector registers in an order that suits neither.
#[inline(never)]
fn limited_apart<T: Real, const N: usize>(constraint: &[T; 4], v: [T; N]) -> [T; N] {
    limited(constraint, v)
}

/// [`project`] at a vertex that is not free.
#[inline(always)]
pub fn limited<T: Real, const N: usize>(constraint: &[T; 4], mut v: [T; N]) -> [T; N] {
    let [x, y, z, of_kind] = *constraint;
    let along = |v: &[T; N], first: usize| x * v[first] + y * v[first + 1] + z * v[first + 2];
    if of_kind == T::from_f64(kind::IN_PLANE) {
        for first in (0..N / 3).map(|design| 3 * design) {
            let along = along(&v, first);
            for axis in 0..3 {
                v[first + axis] = v[first + axis] - along * constraint[axis];
            }
        }
        return v;
    }
    if of_kind == T::from_f64(kind::ON_LINE) {
        for first in (0..N / 3).map(|design| 3 * design) {
            let along = along(&v, first);
            for axis in 0..3 {
                v[first + axis] = along * constraint[axis];
            }
        }
        return v;
    }
    [T::ZERO; N]
}
