//! [`Outline`]: a section of a wing as two short curves, few enough for a line of a batch's
//! reports.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::Serialize;

use crate::mover::Outcome;
use crate::profile::{Plane, Profile, distance};

/// Most sections of a report.
const SECTIONS: usize = 4;

/// Most points of a curve.
const POINTS: usize = 48;

/// Most points of a curve that is made shorter.
const LONGEST: usize = 4000;

/// A section that changes by less than this share of its size has not changed.
const CHANGED: f64 = 1e-6;

/// The old and the new curve of a section. Points are in the plane of the new profile, to the right
/// and upward where an aircraft lies as usual, in the mesh's unit with about four digits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outline {
    /// The number of the profile.
    pub profile: i64,
    /// Largest distance of the new profile from the old one, in the mesh's unit.
    pub change: f64,
    /// The old profile.
    pub old: Vec<[f64; 2]>,
    /// The cut through the moved facets, or the new profile if there is none.
    pub new: Vec<[f64; 2]>,
}

impl Outline {
    /// The sections of an outcome that change most, by the wing's name. At most `SECTIONS` of all
    /// wings, the largest change of a wing first.
    ///
    /// - `old`: the old profiles of each wing, with the wing's name
    pub fn of_outcome<'a>(
        outcome: &Outcome,
        old: impl Iterator<Item = (&'a str, &'a [Profile])>,
    ) -> BTreeMap<String, Vec<Self>> {
        let mut found: Vec<(f64, &str, Self)> = Vec::new();
        for (wing, old) in old {
            let moved = outcome.sections.get(wing).into_iter().flatten();
            for asked in outcome.asked.get(wing).into_iter().flatten() {
                let Some(old) = old.iter().find(|old| old.number == asked.number) else { continue };
                let got = moved.clone().find(|moved| moved.profile == asked.number);
                let got = got.map(|got| got.points.as_slice()).filter(|points| points.len() > 1);
                let change = distance::max_distance(&asked.points, &old.points);
                let share = change / size(&asked.points);
                let Ok(plane) = Plane::of_profile(asked) else { continue };
                if share > CHANGED {
                    let outline = Self::new(asked.number, change, &plane, [&old.points, got.unwrap_or(&asked.points)]);
                    found.push((share, wing, outline));
                }
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut outlines: BTreeMap<String, Vec<Self>> = BTreeMap::new();
        for (_, wing, outline) in found.into_iter().take(SECTIONS) {
            outlines.entry(wing.to_owned()).or_default().push(outline);
        }
        outlines
    }

    fn new(profile: i64, change: f64, plane: &Plane, curves: [&[DVec3]; 2]) -> Self {
        let [across, up] = directions(plane);
        let size = size(curves[0]).max(size(curves[1]));
        let decimals = (4.0 - size.log10().floor()).clamp(0.0, 300.0) as usize;
        let rounded = |value: f64| format!("{value:.decimals$}").parse::<f64>().unwrap_or(value);
        let [old, new] = curves.map(|points| {
            let step = points.len().div_ceil(LONGEST).max(1);
            let flat: Vec<[f64; 2]> =
                points.iter().step_by(step).map(|point| [point.dot(across), point.dot(up)]).collect();
            shortened(&flat, size).into_iter().map(|point| point.map(rounded)).collect()
        });
        Self { profile, change, old, new }
    }
}

/// The diagonal of the box around points.
fn size(points: &[DVec3]) -> f64 {
    let first = points.first().copied().unwrap_or_default();
    let (low, high) = points.iter().fold((first, first), |(low, high), &at| (low.min(at), high.max(at)));
    low.distance(high)
}

/// A curve with at most [`POINTS`] of its points, near all of them.
fn shortened(points: &[[f64; 2]], size: f64) -> Vec<[f64; 2]> {
    let mut tolerance = 1e-3 * size;
    loop {
        let short = simplified(points, tolerance);
        if short.len() <= POINTS || tolerance >= size || size.is_nan() {
            return short;
        }
        tolerance *= 1.5;
    }
}

/// The points of a curve that it needs to stay within a tolerance (Douglas and Peucker, 1973). The
/// point furthest from the first one is always kept, because a closed curve ends where it begins.
fn simplified(points: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    let last = points.len().saturating_sub(1);
    let apart = |a: usize, b: usize| f64::hypot(points[a][0] - points[b][0], points[a][1] - points[b][1]);
    let Some(far) = (0..points.len()).max_by(|&a, &b| apart(0, a).total_cmp(&apart(0, b))) else { return Vec::new() };
    let mut is_kept = vec![false; points.len()];
    [0, far, last].iter().for_each(|&point| is_kept[point] = true);
    let mut spans = vec![(0, far), (far, last)];
    while let Some((from, to)) = spans.pop() {
        let off = |point: usize| off_segment(points[point], points[from], points[to]);
        let Some(most) = (from + 1..to).max_by(|&a, &b| off(a).total_cmp(&off(b))) else { continue };
        if off(most) > tolerance {
            is_kept[most] = true;
            spans.extend([(from, most), (most, to)]);
        }
    }
    points.iter().zip(is_kept).filter(|(_, is_kept)| *is_kept).map(|(point, _)| *point).collect()
}

/// The distance of a point from a segment.
fn off_segment(point: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let [ux, uy] = [to[0] - from[0], to[1] - from[1]];
    let [px, py] = [point[0] - from[0], point[1] - from[1]];
    let squared = ux * ux + uy * uy;
    let along = if squared > 0.0 { ((px * ux + py * uy) / squared).clamp(0.0, 1.0) } else { 0.0 };
    f64::hypot(px - along * ux, py - along * uy)
}

/// The directions to the right and upward in the picture of a plane: downstream and up where an
/// aircraft lies as usual.
pub(super) fn directions(plane: &Plane) -> [DVec3; 2] {
    let up = if plane.normal.z.abs() < 0.9 { DVec3::Z } else { DVec3::Y };
    let up = up.reject_from_normalized(plane.normal).normalize_or_zero();
    let across = up.cross(plane.normal);
    let downstream = if plane.normal.x.abs() < 0.9 { DVec3::X } else { DVec3::Y };
    [if across.dot(downstream) < 0.0 { -across } else { across }, up]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails if a section of a wing along y is drawn upside down, or with its nose to the right.
    #[test]
    fn sections_lie_as_in_books() {
        let plane = |normal| Plane { point: DVec3::ZERO, normal };
        assert_eq!(directions(&plane(DVec3::Y)), [DVec3::X, DVec3::Z]);
        assert_eq!(directions(&plane(DVec3::Z)), [DVec3::X, DVec3::Y]);
        assert_eq!(directions(&plane(DVec3::X)), [DVec3::Y, DVec3::Z]);
    }

    /// Fails if a point further off than the tolerance is left out, or if a closed curve shrinks to
    /// its end.
    #[test]
    fn a_short_curve_stays_near_the_long_one() {
        let ellipse: Vec<[f64; 2]> = (0..=1000)
            .map(|step| std::f64::consts::TAU * f64::from(step) / 1000.0)
            .map(|angle| [angle.cos(), 0.06 * angle.sin()])
            .collect();
        let short = shortened(&ellipse, 2.0);
        assert!((10..=POINTS).contains(&short.len()), "{}", short.len());
        let off = |point: &[f64; 2]| {
            short.windows(2).map(|span| off_segment(*point, span[0], span[1])).fold(f64::INFINITY, f64::min)
        };
        assert!(ellipse.iter().all(|point| off(point) <= 2e-3));
        assert_eq!([short[0], short[short.len() - 1]], [ellipse[0], ellipse[1000]]);
        assert!(shortened(&[], 1.0).is_empty());
    }
}
