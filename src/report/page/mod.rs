//! [`Page`]: the report of a run as one HTML file, to be read in a browser without a network.
//!
//! The text, the tables and the charts need no script. `view.js` draws the mesh in three dimensions
//! and measures the worst cells again. The page names no outside source, and its policy (CSP)
//! allows none: style and script are known by their checksums.
//!
//! | file | holds |
//! |---|---|
//! | `html` | the text of a page; escapes what does not come from the source |
//! | `verdict` | the first lines: whether the mesh may be used, where it is worst, what moved |
//! | `tables` | stages, cells, worst cells, families, settings, files |
//! | `chart` | a diagram with two axes |
//! | `quality_charts`, `section_charts`, `relaxation_charts` | what the diagrams show |
//! | `scene`, `coding` | the mesh for the script, and how it is packed |
//! | `style.css`, `view.js` | the style sheet and the script |
//! | `batch`, `batch.js` | the page of many designs |
//! | `comparison` | the page of two results of one mesh |

mod batch;
mod chart;
mod coding;
mod comparison;
mod html;
mod quality_charts;
mod relaxation_charts;
mod scene;
mod section_charts;
mod tables;
mod verdict;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};

use super::{Measured, RunReport};
use crate::mesh::{CellMeasures, HybridMesh, measures};
use crate::mover::{Outcome, Settings};
use crate::profile::Profile;
pub use batch::batch_html;
pub use comparison::ComparisonPage;
use html::{Html, number};
use relaxation_charts::Group;
use scene::{Scene, Subject};
use section_charts::Section;
pub use section_charts::sections_svg;

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("view.js");

/// Begins every page, so that idmesh knows its own.
const BEGIN: &str =
    "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<meta name=\"generator\" content=\"idmesh\">\n";

/// Most sections of all wings that are drawn. The table of the report has all of them.
const MOST_SECTIONS: usize = 24;

/// Most lines of a list of warnings.
const MOST_WARNINGS: usize = 50;

/// What a page shows.
pub struct Page<'a> {
    /// The report.
    pub report: &'a RunReport,
    /// The outcome that the report is of.
    pub outcome: &'a Outcome,
    /// The old profiles of each wing, with the wing's name, in the mesh's unit.
    pub old: Vec<(&'a str, &'a [Profile])>,
    /// The settings of the mover.
    pub settings: &'a Settings,
    /// The name of each family's role, with the family's name.
    pub roles: Vec<(&'a str, &'static str)>,
}

/// Whether a file is a page of idmesh.
pub fn is_page(bytes: &[u8]) -> bool {
    bytes.starts_with(BEGIN.as_bytes())
}

impl Page<'_> {
    /// The page as HTML. A mesh without finite positions is not shown.
    ///
    /// # Errors
    /// The mesh cannot be packed.
    pub fn html(&self) -> std::io::Result<String> {
        let positions = self.outcome.even_if_invalid().vertices().iter().enumerate();
        let lost: Vec<usize> = positions.filter(|(_, at)| !at.is_finite()).map(|(vertex, _)| vertex).collect();
        let scene = lost.is_empty().then(|| self.scene()).transpose()?;
        let mut html = Html::default();
        let title = format!("{}: {}", self.name(), verdict::word(self.report));
        begin(&mut html, &title, scene.as_ref().map(|_| SCRIPT));
        html.markup("<style>").markup(STYLE).markup("</style>\n<body data-state=\"text\">\n");
        verdict::write(self, &mut html);
        html.markup("<main>\n<div class=\"text\">\n");
        tables::stages(self.report, &mut html);
        tables::worst_cells(self.report, &mut html);
        tables::solver_quality(self.report, &mut html);
        if scene.is_some() {
            self.distributions(&mut html);
            self.sections(&mut html);
        } else {
            tables::lost(self.outcome, &lost, &mut html);
        }
        html.markup("</div>\n");
        scene.iter().for_each(|scene| view(scene, &mut html));
        html.markup("<div class=\"text\">\n");
        tables::path(self.report, &mut html);
        self.relaxations(&mut html);
        tables::families(self, &mut html);
        tables::settings(self, &mut html);
        tables::files(self.report, &mut html);
        html.markup("</div>\n</main>\n");
        if let Some(scene) = &scene {
            html.data("meta", &scene.meta).packed("packed", &scene.packed);
            html.markup("<script>").markup(SCRIPT).markup("</script>\n");
        }
        html.markup("</body>\n</html>\n");
        Ok(html.finish())
    }

    fn scene(&self) -> std::io::Result<Scene> {
        let is_body = |role: &str| ["wing", "trailing-edge", "wingtip", "prescribed"].contains(&role);
        let bodies: Vec<&str> = self.roles.iter().filter(|(_, role)| is_body(role)).map(|(name, _)| *name).collect();
        let worst = self.report.worst_cells.as_deref().unwrap_or_default();
        Subject::of(self.outcome).scene(&bodies, |shown| shown.worst_cells(worst))
    }

    /// The name of the design, or of the case.
    fn name(&self) -> &str {
        let file = self.report.case.rsplit(['/', '\\']).next().unwrap_or_default();
        self.report.design.as_deref().unwrap_or(file)
    }

    fn distributions(&self, html: &mut Html) {
        html.markup("<section><h2>Quality, old and new</h2>\n");
        legend(html, &[("old", "original mesh"), ("new", "moved mesh")]);
        let outcome = self.outcome;
        let [all, tail] = match &outcome.cell_measures {
            None => quality_charts::distributions(Measured::Beta, &outcome.original_beta, &outcome.beta),
            Some(new) => {
                let mesh = HybridMesh { mesh: outcome.mesh(), others: outcome.other_cells() };
                let old = measures(mesh, mesh.vertices(), None);
                let jacobians = |of: &[CellMeasures]| -> Vec<f64> { of.iter().map(|cell| cell.jacobian).collect() };
                quality_charts::distributions(Measured::ScaledJacobian, &jacobians(&old), &jacobians(new))
            }
        };
        html.picture(all).picture(tail).markup("</section>\n");
    }

    fn sections(&self, html: &mut Html) {
        let count: usize = self.outcome.asked.values().map(Vec::len).sum();
        if count == 0 {
            return;
        }
        html.markup("<section><h2>Sections</h2>\n");
        let names =
            [("before", "old"), ("asked", "asked: the new profile"), ("got", "got: cut through the moved facets")];
        legend(html, &names);
        if count > MOST_SECTIONS {
            html.element("p class=\"note\"", format_args!("The first {MOST_SECTIONS} of {count} sections."));
        }
        let all = self.outcome.asked.iter().flat_map(|(wing, new)| new.iter().map(move |new| (wing, new)));
        for (wing, asked) in all.take(MOST_SECTIONS) {
            let old = self.old.iter().find(|(name, _)| name == wing);
            let old = old.and_then(|(_, old)| old.iter().find(|old| old.number == asked.number));
            let moved = self.outcome.sections.get(wing).into_iter().flatten();
            let moved = moved.into_iter().find(|moved| moved.profile == asked.number);
            let section = Section { old, asked, got: moved.map_or(&[], |moved| moved.points.as_slice()) };
            let name = format!("{wing}, profile {}", asked.number);
            html.element("h3", &name);
            let title = |what: &str| format!("{name}: {what}");
            match section.curves(&title("old, asked and got")) {
                Some(curves) => html.picture(curves),
                None => html.element("p class=\"note\"", "The new profile lies in no plane."),
            };
            match (moved, section.distances(&title("distance of got from asked"))) {
                (Some(moved), Some(distances)) => {
                    let most = number(moved.max_distance_to_new_profile);
                    html.element("p class=\"note\"", format_args!("Largest distance of got from asked: {most}."));
                    html.picture(distances)
                }
                _ => html.element("p class=\"note\"", "The moved wing cannot be cut in the plane of this profile."),
            };
        }
        html.markup("</section>\n");
    }

    fn relaxations(&self, html: &mut Html) {
        let groups = Group::all(&self.outcome.relaxations);
        if groups.is_empty() {
            return;
        }
        html.markup("<section><h2>Convergence</h2>\n<p class=\"note\">");
        html.text(format_args!(
            "Largest change of a vertex by each batch of sweeps, in shortest edges of the vertex. A relaxation ends when the \
             estimated error is below {}.",
            number(self.settings.stopping.tolerance)
        ));
        html.markup("</p>\n<div class=\"tiles\">\n");
        for group in groups {
            html.markup("<figure>").picture(group.chart());
            html.markup("<figcaption>")
                .element("b", &group.name)
                .text(group.words())
                .markup("</figcaption></figure>\n");
        }
        html.markup("</div></section>\n");
    }
}

/// Begins a page with its policy: no source but the page itself, and no style and no script but its
/// own.
fn begin(html: &mut Html, title: &str, script: Option<&str>) {
    html.markup(BEGIN);
    html.markup("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    let policy = format!(
        "default-src 'none'; style-src '{}'; script-src '{}'; base-uri 'none'; form-action 'none'",
        checksum(STYLE),
        script.map_or("none".to_owned(), checksum)
    );
    html.markup("<meta http-equiv=\"Content-Security-Policy\" content=\"").text(policy).markup("\">\n");
    html.element("title", title);
}

/// The names of the lines in a chart.
fn legend(html: &mut Html, names: &[(&'static str, &str)]) {
    html.markup("<p class=\"legend\">");
    for (class, name) in names {
        html.markup("<span class=\"key ").markup(class).markup("\"></span>").element("span", name);
    }
    html.markup("</p>\n");
}

/// The view in three dimensions, and what stands for it where it cannot be drawn.
fn view(scene: &Scene, html: &mut Html) {
    html.markup(include_str!("view.html"));
    if !scene.part.words().is_empty() {
        html.element("p class=\"note\"", scene.part.words());
    }
    html.markup("</section>\n");
}

/// The checksum of a text as a Content-Security-Policy names it.
fn checksum(text: &str) -> String {
    format!("sha256-{}", STANDARD.encode(Sha256::digest(text)))
}
