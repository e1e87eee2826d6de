//! The first lines of a page: whether the mesh may be used, where it is worst, and what moved.

use glam::DVec3;

use super::super::{RunReport, WorstCell};
use super::Page;
use super::html::{Html, count, number, place};
use crate::mesh::HybridMesh;
use crate::mover::StageName;

/// The verdict in a word.
pub(super) fn word(report: &RunReport) -> &'static str {
    let repaired = report.repaired.is_some_and(|repaired| repaired.optimised_vertices > 0);
    match (report.valid, report.exit) {
        (true, 0) if repaired => "valid, repaired",
        (true, 0) => "valid",
        (true, _) | (false, 4) => "not converged",
        (false, _) => "refused",
    }
}

/// Writes the head of the page.
pub(super) fn write(page: &Page, html: &mut Html) {
    let report = page.report;
    html.markup("<header>\n");
    html.element("p class=\"from\"", format_args!("idmesh {}, {}", report.idmesh, report.case));
    html.markup(match (report.valid, report.exit) {
        (true, 0) => "<h1><span class=\"badge good\">",
        (true, _) => "<h1><span class=\"badge fair\">",
        (false, _) => "<h1><span class=\"badge bad\">",
    });
    html.text(word(report)).markup("</span> ").text(page.name()).markup("</h1>\n");
    html.element("p class=\"lead\"", lead(report));
    if let Some(error) = &report.error {
        // Several faults stand on lines of their own.
        for line in error.message.lines() {
            html.element("p class=\"fault\"", line);
        }
        if let Some(hint) = &error.hint {
            html.element("p class=\"fault\"", format_args!("What may help: {hint}"));
        }
    }
    html.markup("<dl class=\"cards\">\n");
    worst(report, html);
    displacement(page, html);
    inverted(report, html);
    profiles(report, html);
    html.markup("</dl>\n");
    warnings(report, html);
    html.markup("</header>\n");
}

/// One sentence on the result.
fn lead(report: &RunReport) -> String {
    let cells = count(report.mesh.n_cells());
    let repaired = report.repaired.map_or(0, |repaired| repaired.optimised_vertices);
    match (report.valid, report.exit) {
        (true, 0) if repaired > 0 => format!(
            "The moved mesh may be used: all {cells} cells are valid. Local optimisation moved {} vertices.",
            count(repaired)
        ),
        (true, 0) => format!("The moved mesh may be used: all {cells} cells are valid."),
        (true, _) => "The moved mesh is valid, but a relaxation did not reach its tolerance.".to_owned(),
        (false, 4) => "There is no moved mesh: vertices have no finite position.".to_owned(),
        (false, _) => "The moved mesh may not be used. It is written under names with \"invalid\".".to_owned(),
    }
}

/// A card with a figure and what it is.
fn card(html: &mut Html, name: &'static str, figure: &str, words: &str) {
    html.markup("<div>").element("dt", name).element("dd class=\"figure\"", figure);
    html.element("dd", words).markup("</div>\n");
}

/// Where a cell is, in words.
fn family(cell: &WorstCell) -> String {
    match (&cell.family, cell.touches) {
        (Some(family), true) => format!("touches {family}"),
        (Some(family), false) => format!("nearest to {family}"),
        (None, _) => String::new(),
    }
}

fn worst(report: &RunReport, html: &mut Html) {
    let Some(worst) = report.worst_cells.as_ref().and_then(|cells| cells.first()) else { return };
    let name = if worst.measure == "beta" { "Worst beta" } else { "Worst scaled Jacobian" };
    let at = place(worst.at);
    let WorstCell { kind, index, .. } = worst;
    let kinds = report.cells_original.iter().flat_map(|kinds| kinds.values());
    let lowest = match worst.measure {
        "beta" => report.stages.as_ref().and_then(|stages| stages.first()).map(|stage| stage.beta_min),
        _ => kinds.map(|kind| kind.jacobian_min).reduce(f64::min),
    };
    let before = match lowest {
        Some(lowest) if lowest > 0.0 => {
            let share = 100.0 * worst.value / lowest;
            format!("{share:.0} % of the worst before, {}: ", number(lowest))
        }
        _ => String::new(),
    };
    card(html, name, &number(worst.value), &format!("{before}{kind} {index}, {}, at {at}", family(worst)));
}

/// What moved: the largest displacement and its place.
fn displacement(page: &Page, html: &mut Html) {
    let moved = page.outcome.even_if_invalid().displacement();
    let longest = moved.iter().enumerate().max_by(|a, b| a.1.length_squared().total_cmp(&b.1.length_squared()));
    let Some((vertex, largest)) = longest.filter(|(_, largest)| largest.is_finite()) else { return };
    if *largest == DVec3::ZERO {
        return card(html, "Largest displacement", "0", "nothing moved");
    }
    let mesh = HybridMesh { mesh: page.outcome.mesh(), others: page.outcome.other_cells() };
    let of_face = (0..mesh.n_faces() as u32).find(|&face| mesh.face_vertices(face).contains(&(vertex as u32)));
    let family = of_face.and_then(|face| mesh.family_of(face)).map(|family| &mesh.mesh.families[family.index()]);
    let on = family.map_or("inside".to_owned(), |family| format!("on {family}"));
    let at = place(page.outcome.mesh().vertices[vertex].to_array());
    let n_moved = moved.iter().filter(|moved| **moved != DVec3::ZERO).count();
    let words = format!("{on}, from {at}. {} of {} vertices moved.", count(n_moved), count(moved.len()));
    card(html, "Largest displacement", &number(largest.length()), &words);
}

fn inverted(report: &RunReport, html: &mut Html) {
    let Some(stages) = &report.stages else { return };
    let at = |name| stages.iter().find(|stage| stage.name == name).map_or(0, |stage| stage.inverted);
    let (before, between) = (at(StageName::Original), at(StageName::Corrected));
    let words =
        format!("{} in the original mesh, {} after the surfaces alone had moved", count(before), count(between));
    card(html, "Inverted cells", &count(at(StageName::Final)), &words);
}

fn profiles(report: &RunReport, html: &mut Html) {
    let Some(distance) = report.checks.as_ref().and_then(|checks| checks.max_distance_to_new_profiles) else { return };
    card(html, "Distance from the new profiles", &number(distance), "the largest; it includes the sag of the facets");
}

fn warnings(report: &RunReport, html: &mut Html) {
    if report.warnings.is_empty() {
        return;
    }
    html.markup("<ul class=\"warnings\">\n");
    for warning in report.warnings.iter().take(super::MOST_WARNINGS) {
        html.element("li", warning);
    }
    let more = report.warnings.len().saturating_sub(super::MOST_WARNINGS);
    if more > 0 {
        html.element("li", format_args!("and {more} more warnings"));
    }
    html.markup("</ul>\n");
}
