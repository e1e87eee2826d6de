//! The distribution of beta as a chart (the paper's Fig. 9).

use std::fmt::Display;

use super::svg::{Attributes, COLOURS, Pixels, Svg};
use crate::quality::Statistics;

/// One curve of a [`histogram_svg`].
#[derive(Clone, Copy, Debug)]
pub struct Series<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Beta of each tet `[n_tets]`. Values that are not finite are left out.
    pub beta: &'a [f64],
}

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 460.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 52.0;
const BOTTOM: f64 = 64.0;

/// Width of a bin. The largest beta is 0.11785 (the regular tet), so a valid mesh fills at most 48
/// bins.
const BIN: f64 = 0.0025;
/// Number of bins right of zero.
const POSITIVE_BINS: i64 = 48;

/// A chart of the number of tets in each bin of beta, as an SVG document. Each series has one
/// outline.
pub fn histogram_svg(title: &str, series: &[Series]) -> String {
    let first_bin = series.iter().flat_map(|series| series.beta).filter(|beta| beta.is_finite()).map(|&beta| bin(beta));
    let first_bin = first_bin.fold(0, i64::min);
    let n_bins = (POSITIVE_BINS - first_bin) as usize;
    let counts: Vec<Vec<usize>> = series.iter().map(|series| count(series.beta, first_bin, n_bins)).collect();
    let largest = counts.iter().flatten().copied().max().unwrap_or(0).max(1);
    let tick = tick_size(largest);
    let top = largest.div_ceil(tick) * tick;

    let x = |bin: i64| LEFT + (bin - first_bin) as f64 / n_bins as f64 * (WIDTH - LEFT - RIGHT);
    let y = |count: usize| HEIGHT - BOTTOM - count as f64 / top as f64 * (HEIGHT - TOP - BOTTOM);

    let mut svg = Svg::new(WIDTH, HEIGHT, title);
    let middle = (LEFT + WIDTH - RIGHT) / 2.0;
    svg.label(&[("x", &middle), ("y", &28), ("font-size", &16), ("text-anchor", &"middle")], title);
    axes(&mut svg, (first_bin, POSITIVE_BINS), (tick, top), &x, &y);
    for (index, counts) in counts.iter().enumerate() {
        outline(&mut svg, COLOURS[index % COLOURS.len()], counts, first_bin, &x, &y);
    }
    legend(&mut svg, series);
    svg.finish()
}

fn bin(beta: f64) -> i64 {
    // The clamp limits the number of bins for values that cannot be a beta.
    ((beta / BIN).floor() as i64).clamp(-POSITIVE_BINS, POSITIVE_BINS - 1)
}

fn count(beta: &[f64], first_bin: i64, n_bins: usize) -> Vec<usize> {
    let mut counts = vec![0; n_bins];
    for &beta in beta.iter().filter(|beta| beta.is_finite()) {
        counts[(bin(beta) - first_bin) as usize] += 1;
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
    // A label every eight bins, that is every 0.02.
    for bin in (first_bin..=last_bin).filter(|bin| bin.rem_euclid(8) == 0) {
        let x = x(bin);
        line(svg, [x, bottom], [x, bottom + 5.0], &[("stroke", &"#222")]);
        label(svg, [x, bottom + 20.0], "middle", format_args!("{:.2}", bin as f64 * BIN));
    }
    line(svg, [left, bottom], [right, bottom], &[("stroke", &"#222")]);
    if first_bin < 0 {
        // The line separates inverted tets, on its left, from valid ones.
        let zero = x(0);
        line(svg, [zero, y(top)], [zero, bottom], &[("stroke", &"#222"), ("stroke-dasharray", &"4 3")]);
        label(svg, [zero - 6.0, y(top) + 12.0], "end", "inverted");
    }
    label(svg, [(left + right) / 2.0, HEIGHT - 20.0], "middle", "beta = V / l_max\u{b3}");
    let middle = (y(0) + y(top)) / 2.0;
    let upright = format_args!("rotate(-90 22 {})", Pixels(middle));
    svg.label(
        &[("x", &22), ("y", &Pixels(middle)), ("text-anchor", &"middle"), ("transform", &upright)],
        format_args!("tets per {BIN}"),
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

fn legend(svg: &mut Svg, series: &[Series]) {
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
        let mean = Statistics::new(series.beta).mean;
        let text = format_args!("{} ({} tets, mean {mean:.5})", series.name, series.beta.len());
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
