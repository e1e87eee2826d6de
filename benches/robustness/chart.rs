//! The chart: the worst cell against the motion, a panel for each kind.

use std::fmt::Display;

use idmesh::report::svg::{Attributes, COLOURS, Pixels, Svg};

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

/// The worst cell against the motion, a panel for each kind. Inverted cells go far below zero: what
/// is beyond the scale stands at its lower end.
///
/// - `measure`: the measure's name
pub fn chart(kinds: &[Kind], measure: &str, runs: &[Run], original: f64) -> String {
    let highest = runs.iter().map(|run| run.worst).fold(original, f64::max);
    let step = step(highest / 5.0);
    let top = (highest / step).ceil() * step;
    let bottom = -(0.4 * top / step).ceil() * step;
    let y = |beta: f64| TOP + (top - beta.max(bottom)) / (top - bottom) * (HEIGHT - TOP - BOTTOM);
    let width = LEFT + kinds.len() as f64 * (PANEL + GAP);

    let mut svg = Svg::new(width, HEIGHT, &format!("Worst {measure} against the motion"));
    let upright = format_args!("translate(18 {}) rotate(-90)", (TOP + HEIGHT - BOTTOM) / 2.0);
    svg.label(
        &[("transform", &upright), ("text-anchor", &"middle")],
        format_args!("worst {measure} (below {bottom:.3}: drawn there)"),
    );
    let entries = TARGETS.iter().zip(COLOURS).map(|((name, _), colour)| (format!("target {name}"), colour, "none"));
    for (at, (text, colour, dashes)) in entries.chain([("original mesh".to_owned(), "#666", "6 4")]).enumerate() {
        let x = LEFT + 150.0 * at as f64;
        line(
            &mut svg,
            (&x, &24),
            (&(x + 28.0), &24),
            &[("stroke", &colour), ("stroke-width", &2), ("stroke-dasharray", &dashes)],
        );
        svg.label(&[("x", &(x + 35.0)), ("y", &28.5)], text);
    }
    for (kind, Kind { name, unit, amounts }) in kinds.iter().enumerate() {
        let left = LEFT + kind as f64 * (PANEL + GAP);
        let (right, floor) = (left + PANEL, HEIGHT - BOTTOM);
        let x = |amount: f64| left + amount / amounts[amounts.len() - 1] * PANEL;
        for level in (bottom / step).round() as i64..=(top / step).round() as i64 {
            let (beta, stroke) = (level as f64 * step, if level == 0 { "#222" } else { "#ddd" });
            let y = y(beta);
            line(&mut svg, (&left, &Pixels(y)), (&right, &Pixels(y)), &[("stroke", &stroke)]);
            if kind == 0 {
                let at: &Attributes = &[("x", &(left - 8.0)), ("y", &Pixels(y + 4.5)), ("text-anchor", &"end")];
                svg.label(at, format_args!("{beta:.3}"));
            }
        }
        let mut labelled = left - 24.0;
        for &amount in *amounts {
            let x = x(amount);
            line(&mut svg, (&Pixels(x), &floor), (&Pixels(x), &(floor + 5.0)), &[("stroke", &"#222")]);
            // Where amounts stand too close together only some have a label.
            if x >= labelled + 24.0 {
                labelled = x;
                svg.label(&[("x", &Pixels(x)), ("y", &(floor + 20.0)), ("text-anchor", &"middle")], amount);
            }
        }
        let middle = (left + right) / 2.0;
        let below: &Attributes = &[("x", &middle), ("y", &(floor + 42.0)), ("text-anchor", &"middle")];
        svg.label(below, format_args!("{name}, {unit}"));
        let y0 = Pixels(y(original));
        line(
            &mut svg,
            (&left, &y0),
            (&right, &y0),
            &[("stroke", &"#666"), ("stroke-width", &2), ("stroke-dasharray", &"6 4")],
        );
        for (target, colour) in COLOURS[..TARGETS.len()].iter().enumerate() {
            let of_line = runs.iter().filter(|run| run.kind == kind && run.target == target);
            let points: Vec<[Pixels; 2]> = of_line.map(|run| [x(run.amount), y(run.worst)].map(Pixels)).collect();
            let path: Vec<String> = points.iter().map(|[x, y]| format!("{x},{y}")).collect();
            svg.element(
                "polyline",
                &[("points", &path.join(" ")), ("fill", &"none"), ("stroke", colour), ("stroke-width", &2)],
            );
            for [x, y] in &points {
                svg.element("circle", &[("cx", x), ("cy", y), ("r", &3), ("fill", colour)]);
            }
        }
    }
    svg.finish()
}

type End<'a> = (&'a dyn Display, &'a dyn Display);

fn line(svg: &mut Svg, (x1, y1): End, (x2, y2): End, style: &Attributes) {
    svg.element("line", &[&[("x1", x1), ("y1", y1), ("x2", x2), ("y2", y2)], style].concat());
}

/// The next 1, 2 or 5 times a power of ten.
fn step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|step| step * power).into_iter().find(|&step| step >= least).unwrap_or(power)
}
