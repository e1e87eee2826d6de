//! The distribution of a measure of quality as a chart (the paper's Fig. 9).

use std::fmt::Display;

use super::svg::{Attributes, COLOURS, Pixels, Svg};
use crate::quality::Statistics;

/// One curve of a [`histogram_svg`].
#[derive(Clone, Copy, Debug)]
pub struct Series<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// The measure of each tet or cell `[n]`. Values that are not finite are left out.
    pub values: &'a [f64],
}

/// The measure that a [`histogram_svg`] shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// Beta of each tet.
    Beta,
    /// Scaled Jacobian of the worst corner of each cell. A mesh without tets has no beta.
    ScaledJacobian,
}

impl Measured {
    /// Width of a bin. The largest beta is 0.11785 (the regular tet), so a valid mesh fills at most
    /// 48 bins. The largest scaled Jacobian is 1.
    pub(super) fn bin(self) -> f64 {
        match self {
            Self::Beta => 0.0025,
            Self::ScaledJacobian => 0.025,
        }
    }

    /// Number of bins right of zero.
    pub(super) fn positive_bins(self) -> i64 {
        match self {
            Self::Beta => 48,
            Self::ScaledJacobian => 40,
        }
    }

    /// Number of decimals that the labels of the axis need, every eighth bin.
    fn decimals(self) -> usize {
        match self {
            Self::Beta => 2,
            Self::ScaledJacobian => 1,
        }
    }

    /// What has the measure.
    pub(super) fn noun(self) -> &'static str {
        match self {
            Self::Beta => "tets",
            Self::ScaledJacobian => "cells",
        }
    }

    pub(super) fn label(self) -> &'static str {
        match self {
            Self::Beta => "beta = V / l_max\u{b3}",
            Self::ScaledJacobian => "scaled Jacobian of the worst corner",
        }
    }

    pub(super) fn bin_of(self, value: f64) -> i64 {
        // The clamp limits the number of bins for values that cannot be a measure, and puts 1 into
        // the last bin.
        let n = self.positive_bins();
        ((value / self.bin()).floor() as i64).clamp(-n, n - 1)
    }
}

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 460.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 52.0;
const BOTTOM: f64 = 64.0;

/// A chart of the number of tets or cells in each bin of a measure, as an SVG document. Each series
/// has one outline.
pub fn histogram_svg(measure: Measured, title: &str, series: &[Series]) -> String {
    let finite = series.iter().flat_map(|series| series.values).filter(|value| value.is_finite());
    let first_bin = finite.map(|&value| measure.bin_of(value)).fold(0, i64::min);
    let last_bin = measure.positive_bins();
    let n_bins = (last_bin - first_bin) as usize;
    let counts: Vec<Vec<usize>> =
        series.iter().map(|series| count(measure, series.values, first_bin, n_bins)).collect();
    let largest = counts.iter().flatten().copied().max().unwrap_or(0).max(1);
    let tick = tick_size(largest);
    let top = largest.div_ceil(tick) * tick;

    let x = |bin: i64| LEFT + (bin - first_bin) as f64 / n_bins as f64 * (WIDTH - LEFT - RIGHT);
    let y = |count: usize| HEIGHT - BOTTOM - count as f64 / top as f64 * (HEIGHT - TOP - BOTTOM);

    let mut svg = Svg::new(WIDTH, HEIGHT, title);
    let middle = (LEFT + WIDTH - RIGHT) / 2.0;
    svg.label(&[("x", &middle), ("y", &28), ("font-size", &16), ("text-anchor", &"middle")], title);
    axes(&mut svg, measure, (first_bin, last_bin), (tick, top), &x, &y);
    for (index, counts) in counts.iter().enumerate() {
        outline(&mut svg, COLOURS[index % COLOURS.len()], counts, first_bin, &x, &y);
    }
    legend(&mut svg, measure, series);
    svg.finish()
}

pub(super) fn count(measure: Measured, values: &[f64], first_bin: i64, n_bins: usize) -> Vec<usize> {
    let mut counts = vec![0; n_bins];
    for &value in values.iter().filter(|value| value.is_finite()) {
        counts[(measure.bin_of(value) - first_bin) as usize] += 1;
    }
    counts
}

/// A round step (1, 2 or 5 times a power of ten) with at most six ticks.
fn tick_size(largest: usize) -> usize {
    let mut power = 1;
    loop {
        if let Some(step) = [1, 2, 5].map(|step| step * power).into_iter().find(|step| largest.div_ceil(*step) <= 6) {
            return step;
        }
        power *= 10;
    }
}

fn axes(
    svg: &mut Svg,
    measure: Measured,
    (first_bin, last_bin): (i64, i64),
    (tick, top): (usize, usize),
    x: &impl Fn(i64) -> f64,
    y: &impl Fn(usize) -> f64,
) {
    let (left, right, bottom) = (x(first_bin), x(last_bin), y(0));
    for count in (0..=top).step_by(tick) {
        let y = y(count);
        line(svg, [left, y], [right, y], &[("stroke", &"#ddd")]);
        label(svg, [left - 8.0, y + 4.5], "end", count);
    }
    // A label every eight bins, at a round number.
    for bin in (first_bin..=last_bin).filter(|bin| bin.rem_euclid(8) == 0) {
        let x = x(bin);
        line(svg, [x, bottom], [x, bottom + 5.0], &[("stroke", &"#222")]);
        label(svg, [x, bottom + 20.0], "middle", format_args!("{:.*}", measure.decimals(), bin as f64 * measure.bin()));
    }
    line(svg, [left, bottom], [right, bottom], &[("stroke", &"#222")]);
    if first_bin < 0 {
        // The line separates inverted tets or cells, on its left, from valid ones.
        let zero = x(0);
        line(svg, [zero, y(top)], [zero, bottom], &[("stroke", &"#222"), ("stroke-dasharray", &"4 3")]);
        label(svg, [zero - 6.0, y(top) + 12.0], "end", "inverted");
    }
    label(svg, [(left + right) / 2.0, HEIGHT - 20.0], "middle", measure.label());
    let middle = (y(0) + y(top)) / 2.0;
    let upright = format_args!("rotate(-90 22 {})", Pixels(middle));
    svg.label(
        &[("x", &22), ("y", &Pixels(middle)), ("text-anchor", &"middle"), ("transform", &upright)],
        format_args!("{} per {}", measure.noun(), measure.bin()),
    );
}

fn outline(
    svg: &mut Svg,
    colour: &str,
    counts: &[usize],
    first_bin: i64,
    x: &impl Fn(i64) -> f64,
    y: &impl Fn(usize) -> f64,
) {
    let mut path = format!("M{} {}", Pixels(x(first_bin)), Pixels(y(0)));
    for (index, &count) in counts.iter().enumerate() {
        path += &format!(" V{} H{}", Pixels(y(count)), Pixels(x(first_bin + index as i64 + 1)));
    }
    path += &format!(" V{}", Pixels(y(0)));
    svg.element(
        "path",
        &[("d", &path), ("fill", &colour), ("fill-opacity", &0.15), ("stroke", &colour), ("stroke-width", &1.6)],
    );
}

fn legend(svg: &mut Svg, measure: Measured, series: &[Series]) {
    for (index, series) in series.iter().enumerate() {
        let (x, y) = (WIDTH - RIGHT - 250.0, TOP + 18.0 + 20.0 * index as f64);
        let colour = COLOURS[index % COLOURS.len()];
        svg.element(
            "rect",
            &[
                ("x", &Pixels(x)),
                ("y", &Pixels(y - 11.0)),
                ("width", &14),
                ("height", &12),
                ("fill", &colour),
                ("fill-opacity", &0.15),
                ("stroke", &colour),
                ("stroke-width", &1.6),
            ],
        );
        let (count, noun) = (series.values.len(), measure.noun());
        // Nothing has no mean.
        let mean = match count {
            0 => String::new(),
            _ => format!(", mean {:.5}", Statistics::new(series.values).mean),
        };
        let text = format_args!("{} ({count} {noun}{mean})", series.name);
        svg.label(&[("x", &Pixels(x + 22.0)), ("y", &Pixels(y))], text);
    }
}

fn line(svg: &mut Svg, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], style: &Attributes) {
    let ends: [(&str, &dyn Display); 4] =
        [("x1", &Pixels(x1)), ("y1", &Pixels(y1)), ("x2", &Pixels(x2)), ("y2", &Pixels(y2))];
    svg.element("line", &[&ends, style].concat());
}

fn label(svg: &mut Svg, [x, y]: [f64; 2], anchor: &str, text: impl Display) {
    svg.label(&[("x", &Pixels(x)), ("y", &Pixels(y)), ("text-anchor", &anchor)], text);
}
