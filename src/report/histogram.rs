//! The distribution of beta as a picture (the paper's Fig. 9), written as SVG by hand: one chart needs no plotting
//! library, and the same numbers give the same bytes.

use std::fmt::Write;

use crate::quality::Statistics;

/// One distribution of a [`histogram_svg`].
#[derive(Clone, Copy, Debug)]
pub struct Series<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Beta of each tet `[n_tets]`; values that are not finite are left out.
    pub beta: &'a [f64],
}

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 460.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 52.0;
const BOTTOM: f64 = 64.0;

/// Width of a bin. Beta ends at 0.11785 (the regular tet), so a valid mesh fills at most 48 bins.
const BIN: f64 = 0.0025;
/// Bins right of zero.
const POSITIVE_BINS: i64 = 48;

/// Colours that stay apart for colour-blind readers and in print (Okabe and Ito).
const COLOURS: [&str; 4] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"];

/// A chart of how many tets have which beta, one outline per series.
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

    let mut svg = String::new();
    // Writing to a string cannot fail.
    let _ = header(&mut svg, title);
    let _ = axes(&mut svg, (first_bin, POSITIVE_BINS), (tick, top), &x, &y);
    for (index, counts) in counts.iter().enumerate() {
        let _ = outline(&mut svg, COLOURS[index % COLOURS.len()], counts, first_bin, &x, &y);
    }
    let _ = legend(&mut svg, series);
    svg.push_str("</svg>\n");
    svg
}

fn bin(beta: f64) -> i64 {
    // The clamp keeps a value that is no beta at all from asking for endless bins.
    ((beta / BIN).floor() as i64).clamp(-POSITIVE_BINS, POSITIVE_BINS - 1)
}

fn count(beta: &[f64], first_bin: i64, n_bins: usize) -> Vec<usize> {
    let mut counts = vec![0; n_bins];
    for &beta in beta.iter().filter(|beta| beta.is_finite()) {
        counts[(bin(beta) - first_bin) as usize] += 1;
    }
    counts
}

/// A round step (1, 2 or 5 times a power of ten) that gives at most six ticks.
fn tick_size(largest: usize) -> usize {
    let mut power = 1;
    loop {
        if let Some(step) = [1, 2, 5].map(|step| step * power).into_iter().find(|step| largest.div_ceil(*step) <= 6) {
            return step;
        }
        power *= 10;
    }
}

fn header(svg: &mut String, title: &str) -> std::fmt::Result {
    writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" viewBox=\"0 0 {WIDTH} \
         {HEIGHT}\" font-family=\"sans-serif\" font-size=\"13\" fill=\"#222\">"
    )?;
    writeln!(svg, "<title>{}</title>", escape(title))?;
    writeln!(svg, "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>")?;
    writeln!(
        svg,
        "<text x=\"{}\" y=\"28\" font-size=\"16\" text-anchor=\"middle\">{}</text>",
        (LEFT + WIDTH - RIGHT) / 2.0,
        escape(title)
    )
}

fn axes(
    svg: &mut String,
    (first_bin, last_bin): (i64, i64),
    (tick, top): (usize, usize),
    x: &impl Fn(i64) -> f64,
    y: &impl Fn(usize) -> f64,
) -> std::fmt::Result {
    let (left, right, bottom) = (x(first_bin), x(last_bin), y(0));
    for count in (0..=top).step_by(tick) {
        let y = y(count);
        writeln!(svg, "<line x1=\"{left:.1}\" y1=\"{y:.1}\" x2=\"{right:.1}\" y2=\"{y:.1}\" stroke=\"#ddd\"/>")?;
        writeln!(svg, "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{count}</text>", left - 8.0, y + 4.5)?;
    }
    // A label every eight bins is every 0.02.
    for bin in (first_bin..=last_bin).filter(|bin| bin.rem_euclid(8) == 0) {
        let x = x(bin);
        writeln!(
            svg,
            "<line x1=\"{x:.1}\" y1=\"{bottom:.1}\" x2=\"{x:.1}\" y2=\"{:.1}\" stroke=\"#222\"/>",
            bottom + 5.0
        )?;
        let label = format!("{:.2}", bin as f64 * BIN);
        writeln!(svg, "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>", bottom + 20.0)?;
    }
    writeln!(svg, "<line x1=\"{left:.1}\" y1=\"{bottom:.1}\" x2=\"{right:.1}\" y2=\"{bottom:.1}\" stroke=\"#222\"/>")?;
    if first_bin < 0 {
        // Left of this line tets are inverted.
        let zero = x(0);
        writeln!(
            svg,
            "<line x1=\"{zero:.1}\" y1=\"{:.1}\" x2=\"{zero:.1}\" y2=\"{bottom:.1}\" stroke=\"#222\" \
             stroke-dasharray=\"4 3\"/>",
            y(top)
        )?;
        writeln!(svg, "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">inverted</text>", zero - 6.0, y(top) + 12.0)?;
    }
    writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">beta = V / l_max\u{b3}</text>",
        (left + right) / 2.0,
        HEIGHT - 20.0
    )?;
    let middle = (y(0) + y(top)) / 2.0;
    writeln!(
        svg,
        "<text x=\"22\" y=\"{middle:.1}\" text-anchor=\"middle\" transform=\"rotate(-90 22 {middle:.1})\">tets per \
         {BIN}</text>"
    )
}

fn outline(
    svg: &mut String,
    colour: &str,
    counts: &[usize],
    first_bin: i64,
    x: &impl Fn(i64) -> f64,
    y: &impl Fn(usize) -> f64,
) -> std::fmt::Result {
    write!(svg, "<path d=\"M{:.1} {:.1}", x(first_bin), y(0))?;
    for (index, &count) in counts.iter().enumerate() {
        write!(svg, " V{:.1} H{:.1}", y(count), x(first_bin + index as i64 + 1))?;
    }
    writeln!(svg, " V{:.1}\" fill=\"{colour}\" fill-opacity=\"0.15\" stroke=\"{colour}\" stroke-width=\"1.6\"/>", y(0))
}

fn legend(svg: &mut String, series: &[Series]) -> std::fmt::Result {
    for (index, series) in series.iter().enumerate() {
        let (x, y) = (WIDTH - RIGHT - 250.0, TOP + 18.0 + 20.0 * index as f64);
        let colour = COLOURS[index % COLOURS.len()];
        writeln!(
            svg,
            "<rect x=\"{x:.1}\" y=\"{:.1}\" width=\"14\" height=\"12\" fill=\"{colour}\" fill-opacity=\"0.15\" \
             stroke=\"{colour}\" stroke-width=\"1.6\"/>",
            y - 11.0
        )?;
        let mean = Statistics::new(series.beta).mean;
        let text = format!("{} ({} tets, mean {mean:.5})", series.name, series.beta.len());
        writeln!(svg, "<text x=\"{:.1}\" y=\"{y:.1}\">{}</text>", x + 22.0, escape(&text))?;
    }
    Ok(())
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
