//! The chart: worst beta against the motion, a panel for each kind.

use std::fmt::Write;

use crate::{
    bodies::Kind,
    runs::{Run, TARGETS},
};

const PANEL: f64 = 300.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 76.0;
const GAP: f64 = 36.0;
const TOP: f64 = 64.0;
const BOTTOM: f64 = 60.0;
/// Colours that stay apart for colour-blind readers and in print (Okabe and Ito).
const COLOURS: [&str; TARGETS.len()] = ["#0072b2", "#d55e00", "#009e73"];

/// Worst beta against the motion, a panel for each kind. Inverted tets go far below zero: what is beyond the scale stands
/// at its lower end.
pub fn chart(kinds: &[Kind], runs: &[Run], original: f64) -> Result<String, std::fmt::Error> {
    let highest = runs.iter().map(|run| run.worst).fold(original, f64::max);
    let step = step(highest / 5.0);
    let top = (highest / step).ceil() * step;
    let bottom = -(0.4 * top / step).ceil() * step;
    let y = |beta: f64| TOP + (top - beta.max(bottom)) / (top - bottom) * (HEIGHT - TOP - BOTTOM);
    let width = LEFT + kinds.len() as f64 * (PANEL + GAP);

    let mut svg = String::new();
    writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{HEIGHT}\" viewBox=\"0 0 {width} {HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"13\" fill=\"#222\">"
    )?;
    writeln!(
        svg,
        "<title>Worst beta against the motion</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>"
    )?;
    writeln!(
        svg,
        "<text transform=\"translate(18 {}) rotate(-90)\" text-anchor=\"middle\">worst beta (below {bottom:.3}: drawn \
         there)</text>",
        (TOP + HEIGHT - BOTTOM) / 2.0
    )?;
    let entries = TARGETS.iter().zip(COLOURS).map(|((name, _), colour)| (format!("target {name}"), colour, "none"));
    for (at, (text, colour, dashes)) in entries.chain([("original mesh".to_owned(), "#666", "6 4")]).enumerate() {
        let x = LEFT + 150.0 * at as f64;
        writeln!(
            svg,
            "<line x1=\"{x}\" y1=\"24\" x2=\"{}\" y2=\"24\" stroke=\"{colour}\" stroke-width=\"2\" \
             stroke-dasharray=\"{dashes}\"/>\n<text x=\"{}\" y=\"28.5\">{text}</text>",
            x + 28.0,
            x + 35.0
        )?;
    }
    for (kind, Kind { name, unit, amounts }) in kinds.iter().enumerate() {
        let left = LEFT + kind as f64 * (PANEL + GAP);
        let (right, floor) = (left + PANEL, HEIGHT - BOTTOM);
        let x = |amount: f64| left + amount / amounts[amounts.len() - 1] * PANEL;
        for line in (bottom / step).round() as i64..=(top / step).round() as i64 {
            let (beta, stroke) = (line as f64 * step, if line == 0 { "#222" } else { "#ddd" });
            let y = y(beta);
            writeln!(svg, "<line x1=\"{left}\" y1=\"{y:.1}\" x2=\"{right}\" y2=\"{y:.1}\" stroke=\"{stroke}\"/>")?;
            if kind == 0 {
                writeln!(svg, "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{beta:.3}</text>", left - 8.0, y + 4.5)?;
            }
        }
        let mut labelled = left - 24.0;
        for &amount in *amounts {
            let x = x(amount);
            writeln!(svg, "<line x1=\"{x:.1}\" y1=\"{floor}\" x2=\"{x:.1}\" y2=\"{}\" stroke=\"#222\"/>", floor + 5.0)?;
            // Where amounts stand too close together only some have a label.
            if x >= labelled + 24.0 {
                labelled = x;
                writeln!(svg, "<text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{amount}</text>", floor + 20.0)?;
            }
        }
        let middle = (left + right) / 2.0;
        writeln!(svg, "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{name}, {unit}</text>", floor + 42.0)?;
        let y0 = y(original);
        writeln!(
            svg,
            "<line x1=\"{left}\" y1=\"{y0:.1}\" x2=\"{right}\" y2=\"{y0:.1}\" stroke=\"#666\" stroke-width=\"2\" \
             stroke-dasharray=\"6 4\"/>"
        )?;
        for (target, colour) in COLOURS.iter().enumerate() {
            let of_line = runs.iter().filter(|run| run.kind == kind && run.target == target);
            let points: Vec<(f64, f64)> = of_line.map(|run| (x(run.amount), y(run.worst))).collect();
            let line: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
            writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
                line.join(" ")
            )?;
            for (x, y) in points {
                writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{colour}\"/>")?;
            }
        }
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// The next 1, 2 or 5 times a power of ten.
fn step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|step| step * power).into_iter().find(|&step| step >= least).unwrap_or(power)
}
