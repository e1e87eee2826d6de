//! The sections of a wing: old, asked and got, and the distance along the contour.

use glam::DVec3;

use super::super::outline::directions;
use super::super::svg::Svg;
use super::chart::{Axis, Chart, WIDE, polyline};
use crate::profile::{Plane, Profile, distance};

/// Most points of a curve in a page.
const MOST_POINTS: usize = 300;

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
        let [across, up] = directions(&Plane::of_profile(self.asked).ok()?);
        let flat = |points: &[DVec3]| -> Vec<[f64; 2]> {
            let step = points.len().div_ceil(MOST_POINTS).max(1);
            let last = points.len().checked_sub(1);
            let shown = points.iter().enumerate().filter(|(at, _)| at % step == 0 || Some(*at) == last);
            shown.map(|(_, point)| [point.dot(across), point.dot(up)]).collect()
        };
        let old = self.old.map_or(Vec::new(), |old| flat(&old.points));
        let (asked, got) = (flat(&self.asked.points), flat(self.got));
        let all = || old.iter().chain(&asked).chain(&got);
        let range = |axis: usize| {
            let values = all().map(move |point| point[axis]);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
        };
        let ((left, right), (bottom, top)) = (range(0), range(1));
        let scale = (WIDE - 16.0) / (right - left);
        // A section that turned by a right angle is as high as it was wide.
        let scale = scale.min(WIDE / (top - bottom).max(f64::MIN_POSITIVE));
        if !(scale.is_finite() && scale > 0.0) {
            return None;
        }
        let height = (top - bottom) * scale + 16.0;
        let mut svg = Svg::inline(WIDE, height, title);
        let place = |&[x, y]: &[f64; 2]| [8.0 + (x - left) * scale, 8.0 + (top - y) * scale];
        for (class, curve) in [("line before", &old), ("line asked", &asked), ("line got", &got)] {
            polyline(&mut svg, class, &curve.iter().map(place).collect::<Vec<_>>());
        }
        Some(svg)
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
