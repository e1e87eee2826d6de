//! [`batch_html`]: the reports of many designs as one page: a table that sorts and filters, and the
//! worst quality as a line.

use serde_json::Value;

use super::super::beta_text;
use super::chart::{Axis, Chart};
use super::html::{Html, count, number};
use super::{STYLE, begin};

const SCRIPT: &str = include_str!("batch.js");

/// One design, from the line of its report. A line of an older version may lack any figure.
struct Design<'a> {
    name: &'a str,
    report: &'a Value,
}

impl<'a> Design<'a> {
    fn of(report: &'a Value) -> Self {
        Self { name: report["design"].as_str().unwrap_or("\u{2013}"), report }
    }

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

/// The page of a batch, as HTML.
///
/// - `reports`: the reports of the designs, in the order in which they are shown
pub fn batch_html(reports: &[Value]) -> String {
    let designs: Vec<Design> = reports.iter().map(Design::of).collect();
    let good = designs.iter().filter(|design| design.verdict() == "valid").count();
    let mut html = Html::default();
    begin(&mut html, &format!("{} designs, {good} valid", designs.len()), SCRIPT);
    html.markup("<style>").markup(STYLE).markup("</style>\n<body class=\"batch\" data-state=\"text\">\n<header>\n");
    let case = reports.first().and_then(|report| report["case"].as_str()).unwrap_or_default();
    html.element("p class=\"from\"", format_args!("idmesh {}, {case}", env!("CARGO_PKG_VERSION")));
    html.markup(if good == designs.len() {
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
    let header = ["design", "result", "worst, new", "worst, old", "inverted", "off the profiles", "seconds", "remark"];
    html.table(&header, &designs.iter().map(Design::row).collect::<Vec<_>>());
    html.element(
        "p class=\"note\"",
        "The worst quality is beta in a mesh of tets, else the scaled Jacobian of a corner.",
    );
    html.markup("</section>\n<script>").markup(SCRIPT).markup("</script>\n</body>\n</html>\n");
    html.finish()
}

/// The design with the lowest quality, in words.
fn lead(designs: &[Design]) -> String {
    let lowest = designs.iter().filter_map(|design| Some((design.lowest(3)?, design)));
    match lowest.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((quality, design)) => format!("The lowest quality is {}, of the design {}.", number(quality), design.name),
        None => "No design has a result.".to_owned(),
    }
}

/// The worst quality of each design, over that of the original mesh.
fn line(designs: &[Design], html: &mut Html) {
    let points = |stage: usize| -> Vec<[f64; 2]> {
        let all = designs.iter().enumerate();
        all.filter_map(|(at, design)| Some([at as f64 + 1.0, design.lowest(stage)?])).collect()
    };
    let (old, new) = (points(0), points(3));
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
    for &[x, y] in &new {
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
        let page = batch_html(&[good, failed]);
        assert!(
            page.contains("&lt;/script&gt;&lt;b&gt;</td>\n<td>valid</td>\n<td>0.012500</td>\n<td>0.020000</td>"),
            "{page}"
        );
        assert!(page.contains("<td>b</td>\n<td>not moved</td>") && page.contains("<td>no such file</td>"));
        assert!(page.contains("1 of 2 valid") && page.contains("of the design &lt;/script&gt;"));
        assert_eq!(page.matches("</script>").count(), 1);
        assert!(!batch_html(&[]).is_empty());
    }
}
