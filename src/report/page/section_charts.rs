//! The sections of a wing: old, asked and got, and the distance along the contour.

use glam::DVec3;

use super::super::outline::directions;
use super::super::svg::{COLOURS, Pixels, Svg};
use super::chart::{Axis, Chart, WIDE, polyline};
use super::html::number;
use crate::mover::Outcome;
use crate::profile::{Plane, Profile, distance};

/// Most points of a curve in a page.
const MOST_POINTS: usize = 300;

/// Height of the head of a picture of all sections, and of the line above each, in pixels.
const HEAD: f64 = 58.0;
const LINE: f64 = 26.0;

/// One section of a wing. Points are in the mesh's unit.
pub(super) struct Section<'a> {
    /// The old profile, if there is one of this number.
    pub old: Option<&'a Profile>,
    /// The new profile.
    pub asked: &'a Profile,
    /// The cut through the moved facets. Empty if the section cannot be cut.
    pub got: &'a [DVec3],
}

impl Section<'_> {
    /// The three curves, with equal axes. `None` if the new profile lies in no plane.
    pub fn curves(&self, title: &str) -> Option<Svg> {
        let (curves, height) = self.places()?;
        let mut svg = Svg::inline(WIDE, height, title);
        for (class, curve) in ["line before", "line asked", "line got"].into_iter().zip(&curves) {
            polyline(&mut svg, class, curve);
        }
        Some(svg)
    }

    /// The places of the old, the asked and the got curve in a picture [`WIDE`] wide, and its
    /// height. `None` if the new profile lies in no plane.
    fn places(&self) -> Option<([Vec<[f64; 2]>; 3], f64)> {
        let [across, up] = directions(&Plane::of_profile(self.asked).ok()?);
        let flat = |points: &[DVec3]| -> Vec<[f64; 2]> {
            let step = points.len().div_ceil(MOST_POINTS).max(1);
            let last = points.len().checked_sub(1);
            let shown = points.iter().enumerate().filter(|(at, _)| at % step == 0 || Some(*at) == last);
            shown.map(|(_, point)| [point.dot(across), point.dot(up)]).collect()
        };
        let old = self.old.map_or(Vec::new(), |old| flat(&old.points));
        let curves = [old, flat(&self.asked.points), flat(self.got)];
        let range = |axis: usize| {
            let values = curves.iter().flatten().map(move |point| point[axis]);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
        };
        let ((left, right), (bottom, top)) = (range(0), range(1));
        let scale = (WIDE - 16.0) / (right - left);
        // A section that turned by a right angle is as high as it was wide.
        let scale = scale.min(WIDE / (top - bottom).max(f64::MIN_POSITIVE));
        if !(scale.is_finite() && scale > 0.0) {
            return None;
        }
        let place = |[x, y]: [f64; 2]| [8.0 + (x - left) * scale, 8.0 + (top - y) * scale];
        Some((curves.map(|curve| curve.into_iter().map(place).collect()), (top - bottom) * scale + 16.0))
    }

    /// The distance of the moved section from the new profile, along the moved section. `None` if
    /// the section was not cut.
    pub fn distances(&self, title: &str) -> Option<Svg> {
        let step = self.got.len().div_ceil(MOST_POINTS).max(1);
        let mut length = 0.0;
        let mut curve = Vec::new();
        for (at, point) in self.got.iter().enumerate() {
            length += self.got[at.saturating_sub(1)].distance(*point);
            if at % step == 0 || at + 1 == self.got.len() {
                curve.push([length, distance::distance(*point, &self.asked.points)]);
            }
        }
        if curve.len() < 2 || length.is_nan() || length <= 0.0 {
            return None;
        }
        let most = curve.iter().map(|point| point[1]).fold(0.0, f64::max);
        let (x, y) = (Axis::linear(0.0, length), Axis::linear(0.0, if most > 0.0 { most } else { length * 1e-9 }));
        let labels = ["along the contour, from the lower side of the trailing edge", "distance of got from asked"];
        let mut chart = Chart::new([WIDE, 130.0], title, x, y, labels);
        chart.curve("line got", curve);
        Some(chart.svg)
    }
}

/// The sections of all wings as one picture (SVG): old, asked and got, with equal axes, each under
/// its name and the largest distance of got from asked.
///
/// - `old`: the old profiles of each wing, with the wing's name
pub fn sections_svg(outcome: &Outcome, old: &[(&str, &[Profile])]) -> String {
    let mut panels = Vec::new();
    let mut height = HEAD;
    for (wing, asked) in outcome.asked.iter().flat_map(|(wing, asked)| asked.iter().map(move |asked| (wing, asked))) {
        let old = old.iter().find(|(name, _)| name == wing);
        let old = old.and_then(|(_, old)| old.iter().find(|old| old.number == asked.number));
        let moved = outcome.sections.get(wing).into_iter().flatten().find(|moved| moved.profile == asked.number);
        let section = Section { old, asked, got: moved.map_or(&[], |moved| moved.points.as_slice()) };
        let Some((curves, high)) = section.places() else { continue };
        let distance = match moved {
            Some(moved) => format!("got is up to {} from asked", number(moved.max_distance_to_new_profile)),
            None => "the moved wing cannot be cut here".to_owned(),
        };
        panels.push((format!("{wing}, profile {}: {distance}", asked.number), curves, height));
        height += LINE + high;
    }
    let verdict = if outcome.is_valid() { "" } else { ", of a mesh that is not valid" };
    let mut svg = Svg::new(WIDE, height + 8.0, &format!("Sections, old, asked and got{verdict}"));
    svg.label(&[("x", &8), ("y", &22), ("font-size", &15)], format_args!("Sections{verdict}"));
    let styles = [("old", "#7a8494", 1.4, "5 3"), ("asked", COLOURS[0], 3.0, "none"), ("got", COLOURS[1], 1.4, "none")];
    for (at, (name, colour, _, _)) in styles.iter().enumerate() {
        let x = 8.0 + 90.0 * at as f64;
        svg.element("rect", &[("x", &x), ("y", &36), ("width", &18), ("height", &4), ("fill", colour)]);
        svg.label(&[("x", &(x + 24.0)), ("y", &42)], name);
    }
    for (words, curves, top) in panels {
        svg.label(&[("x", &8), ("y", &Pixels(top + 17.0)), ("font-size", &12)], words);
        for (curve, (_, colour, width, dashes)) in curves.iter().zip(&styles) {
            let points: Vec<String> =
                curve.iter().map(|[x, y]| format!("{},{}", Pixels(*x), Pixels(y + top + LINE))).collect();
            svg.element(
                "polyline",
                &[
                    ("points", &points.join(" ")),
                    ("fill", &"none"),
                    ("stroke", colour),
                    ("stroke-width", width),
                    ("stroke-dasharray", dashes),
                ],
            );
        }
    }
    svg.finish()
}
