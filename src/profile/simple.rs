//! Whether a section is a simple curve.

use glam::{DVec2, DVec3};

use super::{Plane, extent};

/// Near the trailing edge, within this share of the size, the two sides may touch: there digits decide.
const TRAILING_EDGE: f64 = 5e-3;

/// A point where the two sides of a section cross, if they do.
///
/// - `sides`: from one end of the trailing edge to the other
pub(super) fn crossing(sides: &[DVec3], plane: &Plane) -> Option<DVec3> {
    let (&first, &last) = (sides.first()?, sides.last()?);
    let (u, v) = plane.normal.any_orthonormal_pair();
    let flat: Vec<DVec2> = sides.iter().map(|p| DVec2::new((p - first).dot(u), (p - first).dot(v))).collect();
    let near = TRAILING_EDGE * extent(sides);
    let at_edge = |p: DVec3| p.distance(first).min(p.distance(last)) <= near;
    for i in 0..flat.len() - 1 {
        let (a, b) = (flat[i], flat[i + 1]);
        let (low, high) = (a.min(b), a.max(b));
        for j in i + 2..flat.len() - 1 {
            let (c, d) = (flat[j], flat[j + 1]);
            let apart = c.max(d).cmplt(low) | c.min(d).cmpgt(high);
            if !apart.any() && separates(a, b, c, d) && separates(c, d, a, b) && !at_edge(sides[i]) {
                return Some(sides[i]);
            }
        }
    }
    None
}

/// Whether `c` and `d` lie strictly on different sides of the line through `a` and `b`.
fn separates(a: DVec2, b: DVec2, c: DVec2, d: DVec2) -> bool {
    (b - a).perp_dot(c - a) * (b - a).perp_dot(d - a) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sides of an open section cross at this place of the chord: behind it the upper one lies below.
    fn crosses_at(place: f64) -> bool {
        let side = |sign: f64| {
            move |i: i32| {
                let x = f64::from(i) / 1000.0;
                DVec3::new(x, 0.0, sign * 0.2 * x.sqrt() * (place - x))
            }
        };
        let sides: Vec<DVec3> = (1..=1000).rev().map(side(-1.0)).chain((0..=1000).map(side(1.0))).collect();
        crossing(&sides, &Plane { point: DVec3::ZERO, normal: DVec3::Y }).is_some()
    }

    /// Fails if `TRAILING_EDGE` is 0.2 or 0.
    #[test]
    fn sides_may_cross_where_digits_decide() {
        assert!(crosses_at(0.9505));
        assert!(!crosses_at(0.9985));
    }
}
