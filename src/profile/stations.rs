//! Planes for cuts: at equal distances along the span, or named one by one.

use glam::DVec3;

use super::cut::{check, cut};
use super::{Plane, ProfileError, extent};
use crate::geometry;

/// Distance of the outermost planes from the wing's ends, as a share of the span: the first of
/// these with a full section. The fuselage may cut the root obliquely, and the tip may be round.
const MARGINS: [f64; 9] = [0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1];

/// A full section has at least this share of the length extrapolated from the sections farther
/// inside.
const FULL: f64 = 0.97;

/// The axis along the wing's span, as a unit vector: y or z, whichever extent is larger. x points
/// downstream, and a swept wing may be longer along x than along its span.
///
/// # Errors
/// [`ProfileError::Face`]
pub fn span_axis(vertices: &[DVec3], faces: &[impl AsRef<[u32]>]) -> Result<DVec3, ProfileError> {
    let [low, high] = bounds(vertices, faces)?;
    Ok(if high.z - low.z > high.y - low.y { DVec3::Z } else { DVec3::Y })
}

/// `count` planes across the wing's span at equal distances. The first and the last are as near to
/// the wing's ends as there are full sections, at most a tenth of the span away. A single plane
/// stands in the middle.
///
/// # Errors
/// [`ProfileError::Face`], and [`ProfileError::NoProfiles`] for a count of zero.
pub fn evenly(vertices: &[DVec3], faces: &[impl AsRef<[u32]>], count: usize) -> Result<Vec<Plane>, ProfileError> {
    if count == 0 {
        return Err(ProfileError::NoProfiles);
    }
    let normal = span_axis(vertices, faces)?;
    let [low, high] = bounds(vertices, faces)?;
    let plane = |share: f64| Plane { point: normal * normal.dot(low.lerp(high, share)), normal };
    if count == 1 {
        return Ok(vec![plane(0.5)]);
    }
    let length = |share: f64| cut(vertices, faces, &plane(share)).ok().map(|section| extent(&section));
    let margin = |at: &dyn Fn(f64) -> f64| {
        let last = MARGINS[MARGINS.len() - 1];
        let Some((near, far)) = length(at(last)).zip(length(at(2.0 * last))) else { return last };
        let full = |margin: &f64| {
            let expected = near + (near - far) * (last - margin) / last;
            length(at(*margin)).is_some_and(|length| length >= FULL * expected)
        };
        MARGINS.into_iter().find(full).unwrap_or(last)
    };
    let (first, last) = (margin(&|share| share), 1.0 - margin(&|share| 1.0 - share));
    Ok((0..count).map(|k| plane(first + (last - first) * k as f64 / (count - 1) as f64)).collect())
}

/// The plane named by a text such as `y=1.5`.
///
/// # Errors
/// [`ProfileError::PlaneText`]: the text is not `x=`, `y=` or `z=` and a finite number.
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

/// Bounding box of the vertices of the faces. Without faces it is the origin.
fn bounds(vertices: &[DVec3], faces: &[impl AsRef<[u32]>]) -> Result<[DVec3; 2], ProfileError> {
    check(vertices, faces)?;
    Ok(geometry::bounds(faces.iter().flat_map(AsRef::as_ref).map(|&v| vertices[v as usize])).unwrap_or_default())
}
