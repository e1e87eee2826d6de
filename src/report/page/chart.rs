//! [`Chart`]: a diagram with two axes, whose colours come from the page's style sheet.

use std::fmt::Display;

use super::super::svg::{Pixels, Svg};
use super::html::number;

/// The width of a chart over the whole column, in pixels of the picture.
pub(super) const WIDE: f64 = 460.0;

/// The range of an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    pub low: f64,
    pub high: f64,
    pub is_log: bool,
}

impl Axis {
    /// A linear axis. A range without length gets one.
    pub fn linear(low: f64, high: f64) -> Self {
        let wide = if high > low { 0.0 } else { low.abs().max(1.0) * 0.5 };
        Self { low: low - wide, high: high + wide, is_log: false }
    }

    /// A logarithmic axis over whole powers of ten.
    pub fn powers(low: f64, high: f64) -> Self {
        let (low, high) = (low.log10().floor(), high.log10().ceil());
        Self { low: 10f64.powf(low), high: 10f64.powf(high.max(low + 1.0)), is_log: true }
    }

    /// The place of a value along the axis, from 0 to 1 in the range.
    fn share(&self, value: f64) -> f64 {
        match self.is_log {
            true => (value.max(self.low) / self.low).log10() / (self.high / self.low).log10(),
            false => (value - self.low) / (self.high - self.low),
        }
    }

    /// Round values in the range.
    ///
    /// - `most`: about so many
    fn ticks(&self, most: usize) -> Vec<f64> {
        if self.is_log {
            let (low, high) = (self.low.log10().round() as i32, self.high.log10().round() as i32);
            let step = ((high - low) as usize).div_ceil(most).max(1);
            return (low..=high).rev().step_by(step).map(|power| 10f64.powi(power)).collect();
        }
        let rough = (self.high - self.low) / most as f64;
        let power = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|step| step * power).into_iter().find(|step| *step >= rough);
        let step = step.unwrap_or(rough);
        let (first, last) = ((self.low / step - 1e-9).ceil() as i64, (self.high / step + 1e-9).floor() as i64);
        (first..=last).map(|tick| tick as f64 * step).collect()
    }
}

/// A chart in the making.
pub(super) struct Chart {
    pub svg: Svg,
    x: Axis,
    y: Axis,
    /// The left, right, top and bottom end of the area between the axes.
    area: [f64; 4],
}

impl Chart {
    /// An empty chart with its axes.
    ///
    /// - `size`: of the picture
    /// - `title`: description for screen readers
    /// - `labels`: of the two axes
    pub fn new(size: [f64; 2], title: &str, x: Axis, y: Axis, labels: [&str; 2]) -> Self {
        let [width, height] = size;
        let area = [54.0, width - 18.0, 22.0, height - 38.0];
        let mut chart = Self { svg: Svg::inline(width, height, title), x, y, area };
        let [left, right, top, bottom] = area;
        for tick in y.ticks(4) {
            let at = chart.place(x.low, tick)[1];
            chart.line("grid", [left, at], [right, at]);
            chart.label("end", [left - 6.0, at + 4.0], number(tick));
        }
        for tick in x.ticks(if width > 300.0 { 6 } else { 3 }) {
            let at = chart.place(tick, y.low)[0];
            chart.line("axis", [at, bottom], [at, bottom + 4.0]);
            chart.label("middle", [at, bottom + 17.0], number(tick));
        }
        chart.line("axis", [left, bottom], [right, bottom]);
        chart.label("middle", [(left + right) / 2.0, height - 5.0], labels[0]);
        chart.label("start", [6.0, top - 9.0], labels[1]);
        chart
    }

    /// The place of a point in the picture.
    pub fn place(&self, x: f64, y: f64) -> [f64; 2] {
        let [left, right, top, bottom] = self.area;
        [left + self.x.share(x) * (right - left), bottom - self.y.share(y).clamp(-0.02, 1.02) * (bottom - top)]
    }

    /// Adds a curve through points.
    ///
    /// - `class`: of the style sheet
    pub fn curve(&mut self, class: &'static str, points: impl IntoIterator<Item = [f64; 2]>) {
        let places: Vec<[f64; 2]> = points.into_iter().map(|[x, y]| self.place(x, y)).collect();
        polyline(&mut self.svg, class, &places);
    }

    /// Adds a dot.
    pub fn dot(&mut self, class: &'static str, x: f64, y: f64) {
        let [x, y] = self.place(x, y);
        self.svg.element("circle", &[("class", &class), ("cx", &Pixels(x)), ("cy", &Pixels(y)), ("r", &2.5)]);
    }

    /// Adds a line between two places of the picture.
    pub fn line(&mut self, class: &'static str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) {
        let ends: [(&str, &dyn Display); 5] =
            [("class", &class), ("x1", &Pixels(x1)), ("y1", &Pixels(y1)), ("x2", &Pixels(x2)), ("y2", &Pixels(y2))];
        self.svg.element("line", &ends);
    }

    /// Adds an upright line at a value of the first axis, with words.
    pub fn mark(&mut self, x: f64, words: &str) {
        let [_, _, top, bottom] = self.area;
        let at = self.place(x, self.y.low)[0];
        self.line("mark", [at, top], [at, bottom]);
        self.label("end", [at - 4.0, top + 10.0], words);
    }

    fn label(&mut self, anchor: &'static str, [x, y]: [f64; 2], text: impl Display) {
        self.svg.label(&[("x", &Pixels(x)), ("y", &Pixels(y)), ("text-anchor", &anchor)], text);
    }
}

/// Adds a line through places of a picture. Places closer than half a pixel to the one before are
/// left out.
pub(super) fn polyline(svg: &mut Svg, class: &'static str, places: &[[f64; 2]]) {
    let mut path = String::new();
    let mut before: Option<[f64; 2]> = None;
    for (index, &[x, y]) in places.iter().enumerate() {
        let is_near = before.is_some_and(|[u, v]| (x - u).abs() + (y - v).abs() < 0.5);
        if is_near && index + 1 < places.len() || !(x + y).is_finite() {
            continue;
        }
        path += &format!("{}{} {}", if before.is_none() { 'M' } else { 'L' }, Pixels(x), Pixels(y));
        before = Some([x, y]);
    }
    svg.element("path", &[("class", &class), ("d", &path)]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        assert_eq!(Axis::linear(0.0, 0.12).ticks(6), [0.0, 0.02, 0.04, 0.06, 0.08, 0.1, 0.12]);
        assert_eq!(Axis::powers(0.002, 50.0).ticks(5), [100.0, 10.0, 1.0, 0.1, 0.01, 0.001]);
        assert_eq!(Axis::linear(3.0, 3.0).ticks(3), [2.0, 3.0, 4.0]);
    }
}
