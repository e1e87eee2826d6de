//! Which planes to cut: evenly along the span, or named one by one.

use glam::DVec3;

use super::cut::check;
use super::{Plane, ProfileError};

/// The outermost planes stay this share of the span away from the wing's ends: at the root the wing is cut obliquely by
/// the fuselage, at the tip it may be rounded, and a plane there cuts no whole section.
const MARGIN: f64 = 0.1;

/// The axis the wing spans, as a unit vector: y or z, whichever it is longer along (x is downstream, and a swept wing
/// may be longer along x than along its span).
///
/// # Errors
/// [`ProfileError::Triangle`].
pub fn span_axis(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Result<DVec3, ProfileError> {
    let (low, high) = bounds(vertices, triangles)?;
    Ok(if high.z - low.z > high.y - low.y { DVec3::Z } else { DVec3::Y })
}

/// `count` planes across the wing's span at equal distances, the first and the last a tenth of the span from its ends;
/// a single one stands in the middle.
///
/// # Errors
/// [`ProfileError::Triangle`], and [`ProfileError::NoProfiles`] for a count of zero.
pub fn evenly(vertices: &[DVec3], triangles: &[[u32; 3]], count: usize) -> Result<Vec<Plane>, ProfileError> {
    if count == 0 {
        return Err(ProfileError::NoProfiles);
    }
    let normal = span_axis(vertices, triangles)?;
    let (low, high) = bounds(vertices, triangles)?;
    let plane = |k: usize| {
        let share = if count == 1 { 0.5 } else { k as f64 / (count - 1) as f64 };
        let share = MARGIN + (1.0 - 2.0 * MARGIN) * share;
        Plane { point: normal * normal.dot(low.lerp(high, share)), normal }
    };
    Ok((0..count).map(plane).collect())
}

/// The plane named by a text such as `y=1.5`.
///
/// # Errors
/// [`ProfileError::PlaneText`] when the text is not `x=`, `y=` or `z=` and a finite number.
pub fn parse(text: &str) -> Result<Plane, ProfileError> {
    let fail = || ProfileError::PlaneText { text: text.to_string() };
    let (axis, value) = text.split_once('=').ok_or_else(fail)?;
    let normal = match axis.trim() {
        "x" | "X" => DVec3::X,
        "y" | "Y" => DVec3::Y,
        "z" | "Z" => DVec3::Z,
        _ => return Err(fail()),
    };
    match value.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(Plane { point: normal * value, normal }),
        _ => Err(fail()),
    }
}

/// Bounding box of the vertices the triangles use; empty at the origin without triangles.
fn bounds(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Result<(DVec3, DVec3), ProfileError> {
    check(vertices, triangles)?;
    let mut used = triangles.iter().flatten().map(|&v| vertices[v as usize]);
    let first = used.next().unwrap_or_default();
    Ok(used.fold((first, first), |(low, high), p| (low.min(p), high.max(p))))
}
