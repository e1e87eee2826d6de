//! [`batch_html`]: the reports of many designs as one page: a table that sorts and filters, and the
//! worst quality as a line.

use serde_json::Value;

use super::super::beta_text;
use super::super::svg::{Svg, escape};
use super::chart::{Axis, Chart, polyline};
use super::html::{Html, count, number};
use super::{STYLE, begin};

const SCRIPT: &str = include_str!("batch.js");

/// Most bytes of a page before its script.
const MOST_BYTES: usize = 2_980_000;

/// Most designs with a dot each on the line of their qualities.
const MOST_DOTS: usize = 500;

/// Largest width and height of a picture of a section.
const SMALL: [f64; 2] = [100.0, 44.0];

/// Most points of a curve in a picture.
const MOST_POINTS: usize = 200;

/// Most pictures of a design. Where the page has no place for so many, there are fewer.
const PICTURES: [usize; 3] = [4, 2, 1];

/// What the page shows of a design. Its report is not kept, so that many long reports take little
/// memory.
struct Design {
    name: String,
    is_valid: bool,
    /// The lowest quality in the original mesh and in the moved one.
    lowest: [Option<f64>; 2],
    /// The cells of the row in the table, without the pictures.
    row: Vec<String>,
    /// Pictures of the sections that change most, the largest change first. `None` for a section
    /// whose curves are no curves.
    pictures: Vec<Option<Svg>>,
}

impl Design {
    fn of(report: &Value, n_pictures: usize) -> Self {
        let report = Report { name: report["design"].as_str().unwrap_or("\u{2013}"), report };
        Self {
            name: report.name.to_owned(),
            is_valid: report.verdict() == "valid",
            lowest: [report.lowest(0), report.lowest(3)],
            row: report.row(),
            pictures: report.pictures(n_pictures),
        }
    }

    /// Bytes of its first pictures.
    fn bytes_of(&self, n_pictures: usize) -> usize {
        self.pictures.iter().take(n_pictures).flatten().map(|picture| picture.n_bytes() + 8).sum()
    }
}

/// The designs, with no more pictures than a page may have.
fn designs(reports: impl IntoIterator<Item = Value>, case: &mut Option<String>) -> Vec<Design> {
    let mut designs: Vec<Design> = Vec::new();
    let (mut most, mut bytes) = (PICTURES[0], PICTURES.map(|_| 0));
    for report in reports {
        case.get_or_insert_with(|| report["case"].as_str().unwrap_or_default().to_owned());
        // The pictures of the last number may fill the page before its last design.
        let is_full = bytes[PICTURES.len() - 1] > MOST_BYTES;
        let design = Design::of(&report, if is_full { 0 } else { most });
        PICTURES.iter().zip(&mut bytes).for_each(|(&n, bytes)| *bytes += design.bytes_of(n));
        designs.push(design);
        let fitting = PICTURES.iter().zip(bytes).find(|&(&n, bytes)| n == 1 || bytes <= MOST_BYTES);
        let next = fitting.map_or(1, |(&n, _)| n);
        if next < most {
            most = next;
            designs.iter_mut().for_each(|design| design.pictures.truncate(most));
        }
    }
    designs
}

/// One design, from the line of its report. A line of an older version may lack any figure.
struct Report<'a> {
    name: &'a str,
    report: &'a Value,
}

impl Report<'_> {
    fn exit(&self) -> Option<u64> {
        self.report["exit"].as_u64()
    }

    /// The result in a word.
    fn verdict(&self) -> &'static str {
        match (self.exit(), self.report["valid"].as_bool()) {
            (Some(0), _) => "valid",
            (Some(4), _) => "not converged",
            (Some(5), _) => "refused",
            (Some(_), _) => "not moved",
            (None, Some(true)) => "valid",
            (None, _) => "refused",
        }
    }

    /// The lowest quality in the moved mesh, or in the original one.
    ///
    /// - `stage`: the place of the row in the table of stages
    fn lowest(&self, stage: usize) -> Option<f64> {
        let beta = self.report["stages"][stage]["beta_min"].as_f64();
        let kinds = &self.report[if stage == 0 { "cells_original" } else { "cells" }];
        let jacobians = kinds.as_object().into_iter().flatten().filter_map(|(_, kind)| kind["jacobian_min"].as_f64());
        jacobians.reduce(f64::min).or(beta)
    }

    /// The reason why there is no result, or where the worst cell is.
    fn remark(&self) -> String {
        if let Some(message) = self.report["error"]["message"].as_str() {
            return message.lines().next().unwrap_or_default().to_owned();
        }
        match self.report["worst_cells"][0]["family"].as_str() {
            Some(family) => format!("worst cell near {family}"),
            None => String::new(),
        }
    }

    /// Pictures of the sections that change most, old and new.
    fn pictures(&self, most: usize) -> Vec<Option<Svg>> {
        let wings = self.report["outlines"].as_object().into_iter().flatten();
        let outlines = wings.flat_map(|(wing, of_wing)| {
            of_wing.as_array().into_iter().flatten().map(move |outline| (wing.as_str(), outline))
        });
        let mut outlines: Vec<(&str, &Value)> = outlines.collect();
        let change = |outline: &Value| outline["change"].as_f64().unwrap_or(0.0);
        outlines.sort_by(|a, b| change(b.1).total_cmp(&change(a.1)));
        outlines.into_iter().take(most).map(|(wing, outline)| picture(wing, outline)).collect()
    }

    fn row(&self) -> Vec<String> {
        let quality = |stage| self.lowest(stage).map_or(String::new(), |value| beta_text(value, 6));
        let distance = self.report["checks"]["max_distance_to_new_profiles"].as_f64();
        let inverted = self.report["checks"]["inverted_tets"].as_u64();
        let seconds = self.report["seconds"]["update"].as_f64();
        vec![
            self.name.to_owned(),
            self.verdict().to_owned(),
            quality(3),
            quality(0),
            inverted.map_or(String::new(), |inverted| count(inverted as usize)),
            distance.map_or(String::new(), number),
            seconds.map_or(String::new(), |seconds| format!("{seconds:.2}")),
            self.remark(),
        ]
    }
}

/// A small picture of a section, old and new. `None` if its curves are no curves.
fn picture(wing: &str, outline: &Value) -> Option<Svg> {
    let curve = |name: &str| -> Vec<[f64; 2]> {
        let points = outline[name].as_array().into_iter().flatten().take(MOST_POINTS);
        let point = |point: &Value| Some([point[0].as_f64()?, point[1].as_f64()?]);
        points.filter_map(point).filter(|[x, y]| x.is_finite() && y.is_finite()).collect()
    };
    let curves = [curve("old"), curve("new")];
    let all = || curves.iter().flatten();
    let [low, high] = [f64::min, f64::max].map(|of| all().copied().reduce(|a, b| [of(a[0], b[0]), of(a[1], b[1])]));
    let ([left, bottom], [right, top]) = (low?, high?);
    let scale = ((SMALL[0] - 2.0) / (right - left)).min((SMALL[1] - 2.0) / (top - bottom));
    if !(scale.is_finite() && scale > 0.0) {
        return None;
    }
    let change = outline["change"].as_f64().map_or(String::new(), |change| format!(": up to {} apart", number(change)));
    let title = format!("{wing}, profile {}{change}", outline["profile"]);
    let mut svg = Svg::small(SMALL[0], (top - bottom) * scale + 2.0, &title);
    for (class, curve) in ["old", "new"].into_iter().zip(&curves) {
        let place = |&[x, y]: &[f64; 2]| [1.0 + (x - left) * scale, 1.0 + (top - y) * scale];
        polyline(&mut svg, class, &curve.iter().map(place).collect::<Vec<_>>());
    }
    Some(svg)
}

/// The page of a batch, as HTML. A page of some 7 000 designs and fewer has at most 3 MB: pictures
/// are left out where they would make it larger.
///
/// - `reports`: the reports of the designs, in the order in which they are shown; each is taken
///   once, and none is kept
pub fn batch_html(reports: impl IntoIterator<Item = Value>) -> String {
    let mut case = None;
    let designs = designs(reports, &mut case);
    let good = designs.iter().filter(|design| design.is_valid).count();
    let mut html = Html::default();
    begin(&mut html, &format!("{} designs, {good} valid", designs.len()), Some(SCRIPT));
    html.markup("<style>").markup(STYLE).markup("</style>\n<body class=\"batch\" data-state=\"text\">\n<header>\n");
    let case = case.unwrap_or_default();
    html.element("p class=\"from\"", format_args!("idmesh {}, {case}", env!("CARGO_PKG_VERSION")));
    html.markup(if good == designs.len() && good > 0 {
        "<h1><span class=\"badge good\">"
    } else {
        "<h1><span class=\"badge bad\">"
    });
    html.text(format_args!("{good} of {} valid", designs.len())).markup("</span> designs</h1>\n");
    html.element("p class=\"lead\"", lead(&designs)).markup("</header>\n");
    line(&designs, &mut html);
    html.markup("<section><h2>Designs</h2>\n<form class=\"controls\" id=\"controls\" hidden>\n");
    html.markup(
        "<label>show <input type=\"search\" id=\"words\" placeholder=\"part of a name or a remark\"></label>\n",
    );
    html.markup("<label>result <select id=\"verdict\"><option value=\"\">all</option><option>valid</option>");
    html.markup("<option>not converged</option><option>refused</option><option>not moved</option></select></label>\n");
    html.markup("<output id=\"shown\"></output>\n</form>\n");
    let header = [
        "design",
        "result",
        "worst, new",
        "worst, old",
        "inverted",
        "off the profiles",
        "seconds",
        "sections",
        "remark",
    ];
    // The elements of a row take some bytes too, and so does an escaped letter.
    let of_row = |design: &Design| 40 + design.row.iter().map(|cell| escape(cell).len() + 10).sum::<usize>();
    let texts: usize = designs.iter().map(of_row).sum();
    let (most, fitting, remark) = fitting(&designs, MOST_BYTES.saturating_sub(html.n_bytes() + texts));
    let rows = designs.into_iter().enumerate().map(|(at, design)| {
        let n_pictures = if at < fitting { most } else { 0 };
        (design.row, design.pictures.into_iter().take(n_pictures).flatten().collect())
    });
    html.pictured(&header, rows.collect());
    html.element("p class=\"note\"", remark);
    html.element(
        "p class=\"note\"",
        "The worst quality is beta in a mesh of tets, else the scaled Jacobian of a corner.",
    );
    html.markup("</section>\n<script>").markup(SCRIPT).markup("</script>\n</body>\n</html>\n");
    html.finish()
}

/// How many pictures each design has, as many as the bytes allow, how many designs have any, and
/// what they show, in words.
fn fitting(designs: &[Design], bytes: usize) -> (usize, usize, String) {
    for most in PICTURES {
        let mut left = bytes;
        let mut fitting = 0;
        for design in designs {
            let Some(rest) = left.checked_sub(design.bytes_of(most)) else { break };
            (left, fitting) = (rest, fitting + 1);
        }
        if fitting < designs.len() && most > 1 {
            continue;
        }
        let mut words = format!(
            "The pictures show the sections that change most, at most {most} of a design: old in grey, new in blue."
        );
        if fitting < designs.len() {
            words +=
                &format!(" The page would be too large with more than the pictures of its first {fitting} designs.");
        }
        return (most, fitting, words);
    }
    (0, 0, String::new())
}

/// The design with the lowest quality, in words.
fn lead(designs: &[Design]) -> String {
    let lowest = designs.iter().filter_map(|design| Some((design.lowest[1]?, design)));
    match lowest.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((quality, design)) => format!("The lowest quality is {}, of the design {}.", number(quality), design.name),
        None => "No design has a result.".to_owned(),
    }
}

/// The worst quality of each design, over that of the original mesh.
fn line(designs: &[Design], html: &mut Html) {
    let points = |stage: usize| -> Vec<[f64; 2]> {
        let all = designs.iter().enumerate();
        all.filter_map(|(at, design)| Some([at as f64 + 1.0, design.lowest[stage]?])).collect()
    };
    let (old, new) = (points(0), points(1));
    if new.is_empty() {
        return;
    }
    let values = || old.iter().chain(&new).map(|point| point[1]);
    let low = values().fold(0.0, f64::min);
    let high = values().fold(f64::NEG_INFINITY, f64::max);
    html.markup("<section><h2>Worst quality</h2>\n");
    super::legend(html, &[("old", "original mesh"), ("new", "moved mesh")]);
    let axes = (Axis::linear(1.0, designs.len() as f64), Axis::linear(low, high.max(low)));
    let labels = ["designs, in the order of their names", "worst quality"];
    let mut chart = Chart::new([900.0, 220.0], "Worst quality of each design", axes.0, axes.1, labels);
    chart.curve("line old", old);
    for &[x, y] in new.iter().filter(|_| new.len() <= MOST_DOTS) {
        chart.dot("new", x, y);
    }
    chart.curve("line new", new);
    if low < 0.0 {
        let [left, right] = [1.0, designs.len() as f64].map(|x| chart.place(x, 0.0));
        chart.line("mark", left, right);
    }
    html.picture(chart.svg).markup("</section>\n");
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Fails if a design is left out, a name becomes markup, or a design that was not moved passes
    /// for a valid one.
    #[test]
    fn every_design_has_a_row() {
        let good = json!({ "design": "</script><b>", "exit": 0, "valid": true, "case": "a.toml",
            "stages": [{ "beta_min": 0.02 }, {}, {}, { "beta_min": 0.0125 }] });
        let failed = json!({ "design": "b", "exit": 3, "valid": false, "error": { "message": "no such file\nhint" } });
        let page = batch_html([good, failed]);
        assert!(
            page.contains("&lt;/script&gt;&lt;b&gt;</td>\n<td>valid</td>\n<td>0.012500</td>\n<td>0.020000</td>"),
            "{page}"
        );
        assert!(page.contains("<td>b</td>\n<td>not moved</td>") && page.contains("<td>no such file</td>"));
        assert!(page.contains("1 of 2 valid") && page.contains("of the design &lt;/script&gt;"));
        assert_eq!(page.matches("</script>").count(), 1);
        // No design is no success.
        assert!(batch_html([]).contains("badge bad") && !batch_html([]).contains("badge good"));
    }

    /// A line of a design with some sections, whose curves have 48 points each.
    fn with_sections(name: usize, n_sections: usize) -> Value {
        let curve = |up: f64| -> Vec<[f64; 2]> {
            let at = |step: u32| std::f64::consts::TAU * f64::from(step) / 47.0;
            (0..48).map(|step| [at(step).cos(), up * at(step).sin()]).collect()
        };
        let section = |number: usize| {
            let change = 0.01 * number as f64;
            json!({ "profile": number, "change": change, "old": curve(0.1), "new": curve(0.12) })
        };
        let sections: Vec<Value> = (0..n_sections).map(section).collect();
        json!({ "design": format!("design-{name}"), "exit": 0, "valid": true, "outlines": { "<wing>": sections },
            "stages": [{ "beta_min": 0.02 }, {}, {}, { "beta_min": 0.0125 }] })
    }

    /// The largest change comes first, in equal scales. Fails if a name becomes markup, or if a
    /// curve is drawn outside of its picture.
    #[test]
    fn sections_are_drawn_old_and_new() {
        let page = batch_html([with_sections(0, 2)]);
        let pictures: Vec<&str> = page.split("<svg class=\"small\"").skip(1).collect();
        assert_eq!(pictures.len(), 2);
        assert!(pictures[0].contains("&lt;wing&gt;, profile 1: up to 0.01 apart"), "{}", pictures[0]);
        // The new curve is 2 wide and 0.24 high: 98 by 11.8, with a margin of 1.
        assert!(pictures[0].contains("viewBox=\"0 0 100 14\""), "{}", pictures[0]);
        for class in ["old", "new"] {
            let path =
                pictures[0].split(&format!("class=\"{class}\" d=\"M")).nth(1).unwrap().split('"').next().unwrap();
            let numbers: Vec<f64> = path.split(['L', ' ']).map(|number| number.parse().unwrap()).collect();
            assert!(numbers.iter().step_by(2).all(|x| (0.9..=99.1).contains(x)), "{path}");
            assert!(numbers.iter().skip(1).step_by(2).all(|y| (0.9..=12.9).contains(y)), "{path}");
        }
    }

    /// Fails if a page of many designs has more than 3 MB, loses a row, or leaves pictures out
    /// without a word.
    #[test]
    fn a_page_of_many_designs_has_at_most_3_mb() {
        for (n_designs, each) in [(500, 4), (1500, 1), (5000, 1)] {
            let reports: Vec<Value> = (0..n_designs).map(|name| with_sections(name, 4)).collect();
            let page = batch_html(reports);
            assert!(page.len() <= 3_000_000, "{n_designs}: {}", page.len());
            assert_eq!(page.matches("<td>design-").count(), n_designs);
            let pictures = page.matches("<svg class=\"small\"").count();
            if n_designs == 5000 {
                assert!(pictures > 500 && pictures < n_designs, "{pictures}");
                assert!(page.contains(&format!("the pictures of its first {pictures} designs")));
            } else {
                assert_eq!(pictures, n_designs * each, "{n_designs}: {}", page.len());
            }
        }
        let odd = json!({ "design": "odd", "outlines": { "wing": [{ "old": [[1, 1]], "new": "none" }, 7] } });
        assert!(!batch_html([odd]).contains("class=\"small\""));
    }
}
