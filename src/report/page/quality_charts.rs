//! Distributions of the quality, old over new: all cells, and the tail of the worst ones.

use super::super::histogram::{Measured, count as counts};
use super::super::svg::Svg;
use super::super::worst_cells::lowest;
use super::chart::{Axis, Chart, WIDE};

/// The share of the cells in the tail.
const TAIL: f64 = 0.01;

/// Names of the two distributions in the style sheet.
const CLASSES: [&str; 2] = ["line old", "line new"];

/// The charts of the distributions of a measure: of all cells, and of the worst 1 %.
///
/// - `old`, `new` `[n_cells]`: the measure of each cell
pub(super) fn distributions(measure: Measured, old: &[f64], new: &[f64]) -> [Svg; 2] {
    [histogram(measure, [old, new]), tail(measure, [old, new])]
}

fn histogram(measure: Measured, both: [&[f64]; 2]) -> Svg {
    let finite = both.iter().flat_map(|values| values.iter()).filter(|value| value.is_finite());
    let first = finite.map(|&value| measure.bin_of(value)).fold(0, i64::min);
    let last = measure.positive_bins();
    let counted = both.map(|values| counts(measure, values, first, (last - first) as usize));
    let most = counted.iter().flatten().copied().max().unwrap_or(0).max(1);
    let x = Axis::linear(first as f64 * measure.bin(), last as f64 * measure.bin());
    let y = Axis::linear(0.0, most as f64);
    let title = format!("Distribution of {} before and after", measure.label());
    let across = format!("{} per {}", measure.noun(), measure.bin());
    let mut chart = Chart::new([WIDE, 230.0], &title, x, y, [measure.label(), &across]);
    for (class, counted) in CLASSES.into_iter().zip(counted) {
        let steps = counted.iter().enumerate().flat_map(|(bin, &count)| {
            let from = (first + bin as i64) as f64 * measure.bin();
            [[from, count as f64], [from + measure.bin(), count as f64]]
        });
        chart.curve(class, steps);
    }
    if first < 0 {
        chart.mark(0.0, "inverted");
    }
    chart.svg
}

/// The number of cells below each value, for the worst ones, on a logarithmic axis.
fn tail(measure: Measured, both: [&[f64]; 2]) -> Svg {
    let worst = both.map(|values| {
        let n = ((TAIL * values.len() as f64).ceil() as usize).max(20).min(values.len());
        let values: Vec<f64> = lowest(values, n).into_iter().map(|cell| values[cell]).collect();
        values.into_iter().filter(|value| value.is_finite()).collect::<Vec<_>>()
    });
    let least = worst.iter().filter_map(|values| values.first()).copied().reduce(f64::min).unwrap_or(0.0);
    let most = worst.iter().filter_map(|values| values.last()).copied().reduce(f64::max).unwrap_or(1.0);
    let n = worst.iter().map(Vec::len).max().unwrap_or(1).max(10);
    let title = format!("The worst 1 % of the {} before and after", measure.noun());
    let across = format!("{} with less", measure.noun());
    let label = format!("{}, the worst 1 %", measure.label());
    let x = Axis::linear(least, most);
    let mut chart = Chart::new([WIDE, 210.0], &title, x, Axis::powers(1.0, n as f64), [&label, &across]);
    for (class, values) in CLASSES.into_iter().zip(&worst) {
        // The steps of the first cells are seen one by one, and those of the others are not.
        let shown =
            (0..values.len()).filter(|&rank| rank < 40 || rank.is_multiple_of(rank / 20) || rank + 1 == values.len());
        chart.curve(
            class,
            shown.flat_map(|rank| [[values[rank], rank.max(1) as f64], [values[rank], rank as f64 + 1.0]]),
        );
    }
    if least < 0.0 {
        chart.mark(0.0, "inverted");
    }
    chart.svg
}
