//! The tables of a page.

use super::super::solver_quality::rows;
use super::super::{Checksums, RunReport, Sums, beta_text, stage_remark};
use super::Page;
use super::html::{Html, count, number, place};
use crate::mover::{Outcome, StageName, StageQuality};
use crate::smoothing::QualityTarget;
use crate::volume::{StepVerdict, TriedStep};

/// Most vertices without finite positions that are listed.
const LOST: usize = 20;

/// Most rows of the table of steps. The report has all of them.
const MOST_STEPS: usize = 200;

/// The stages, and the kinds of cells where not all are tets.
pub(super) fn stages(report: &RunReport, html: &mut Html) {
    let Some(stages) = &report.stages else { return };
    html.markup("<section><h2>Stages</h2>\n");
    let row = |stage: &StageQuality| {
        let name = match stage.name {
            StageName::Original => "original",
            StageName::Deformed => "deformed: the wings have moved",
            StageName::Corrected => "corrected: all surfaces have moved",
            StageName::Final => "final: the volume has moved",
        };
        vec![
            name.to_owned(),
            beta_text(stage.beta_min, 6),
            beta_text(stage.beta_mean, 7),
            count(stage.inverted),
            format!("{:.3}", stage.seconds),
        ]
    };
    let rows: Vec<_> = stages.iter().map(row).collect();
    html.table(&["stage", "beta min", "beta mean", "inverted", "seconds"], &rows);
    let remark = stage_remark(&report.mesh);
    if !remark.is_empty() {
        html.element("p class=\"note\"", remark.trim_end());
    }
    cells(report, html);
    if let Some(seconds) = &report.seconds {
        html.element(
            "p class=\"note\"",
            format_args!(
                "Reading took {:.2} s, set-up {:.2} s (once per mesh), and the update {:.2} s on {}.",
                seconds.read, seconds.setup, seconds.update, report.backend.kind
            ),
        );
    }
    html.markup("</section>\n");
}

/// The quality of each kind of cell, before and after.
fn cells(report: &RunReport, html: &mut Html) {
    let Some(kinds) = &report.cells else { return };
    let mut rows = Vec::new();
    for (name, kind) in kinds {
        let original = report.cells_original.as_ref().and_then(|original| original.get(name));
        let before = |value: Option<f64>| value.map_or(String::new(), |value| beta_text(value, 4));
        rows.push(vec![
            (*name).to_owned(),
            count(kind.count),
            count(kind.inverted),
            before(original.map(|original| original.jacobian_min)),
            beta_text(kind.jacobian_min, 4),
            before(original.map(|original| original.jacobian_mean)),
            beta_text(kind.jacobian_mean, 4),
            before(kind.shape_min),
        ]);
    }
    html.markup("<h3>Cells by kind, scaled Jacobian</h3>\n");
    let header = ["cells", "count", "inverted", "min, old", "new", "mean, old", "new", "shape min"];
    html.table(&header, &rows);
}

/// The worst cells. Each row has the number by which the view finds the cell.
pub(super) fn worst_cells(report: &RunReport, html: &mut Html) {
    let Some(worst) = report.worst_cells.as_ref().filter(|cells| !cells.is_empty()) else { return };
    html.markup("<section id=\"worst\"><h2>Worst cells</h2>\n");
    let name = if worst[0].measure == "beta" { "beta" } else { "scaled Jacobian" };
    html.element(
        "p class=\"note\"",
        format_args!(
            "The {} cells with the lowest {name}. They touch the family named, or are near it. A click on a row \
             shows the cell in the view.",
            worst.len()
        ),
    );
    let row = |cell: &super::super::WorstCell| {
        vec![
            format!("{}\u{a0}{}", cell.kind, cell.index),
            beta_text(cell.value, 6),
            beta_text(cell.original, 6),
            place(cell.at),
            match (&cell.family, cell.touches) {
                (Some(family), true) => family.clone(),
                (Some(family), false) => format!("near {family}"),
                (None, _) => String::new(),
            },
        ]
    };
    html.chosen(&["cell", "new", "old", "place", "family"], &worst.iter().map(row).collect::<Vec<_>>());
    html.markup("<p class=\"note\" id=\"measured\"></p></section>\n");
}

/// The vertices without finite positions, with their places in the original mesh.
pub(super) fn lost(outcome: &Outcome, lost: &[usize], html: &mut Html) {
    html.markup("<section><h2>Vertices without finite positions</h2>\n");
    let words = format!(
        "{} of {} vertices have no finite position, so there is no mesh to show. Their places were:",
        count(lost.len()),
        count(outcome.mesh().vertices.len())
    );
    html.element("p", words);
    let row = |&vertex: &usize| vec![vertex.to_string(), place(outcome.mesh().vertices[vertex].to_array())];
    html.table(&["vertex", "place"], &lost.iter().take(LOST).map(row).collect::<Vec<_>>());
    html.element("p class=\"note\"", format_args!("At most {LOST} are listed.")).markup("</section>\n");
}

/// The measures in the words of flow solvers, before and after.
pub(super) fn solver_quality(report: &RunReport, html: &mut Html) {
    let Some(quality) = &report.solver_quality else { return };
    html.markup("<section><h2>In the words of solvers</h2>\n");
    html.element(
        "p class=\"note\"",
        "What OpenFOAM's checkMesh prints of the cells, and SU2 of the dual volumes: each the worst of the mesh.",
    );
    let has_limits = !quality.limits.is_empty();
    let mut header = vec!["measure", "old", "new"];
    header.extend(has_limits.then_some("limit"));
    let row = |row: super::super::solver_quality::Row| {
        let mut cells = vec![row.name];
        cells.extend(row.values);
        cells.extend(has_limits.then(|| quality.limits.get(row.limit).map_or(String::new(), |&limit| number(limit))));
        cells
    };
    let rows: Vec<_> = rows(&[&quality.original, &quality.moved]).into_iter().map(row).collect();
    html.table(&header, &rows).markup("</section>\n");
}

/// The steps of the path and local optimisation.
pub(super) fn path(report: &RunReport, html: &mut Html) {
    let Some(path) = &report.path else { return };
    html.markup("<section><h2>Steps</h2>\n");
    let words = match (path.steps, path.given_up) {
        (1, 0) => "The volume moved in one jump.".to_owned(),
        (steps, given_up) => format!(
            "The volume moved in {} steps; {} steps were tried and given up. {:.0} % of the route had valid meshes.",
            count(steps),
            count(given_up),
            100.0 * path.reached
        ),
    };
    html.element("p", words);
    let row = |(number, step): (usize, &TriedStep)| {
        vec![
            if number == 0 { "jump".to_owned() } else { number.to_string() },
            format!("{:.1} to {:.1} %", 100.0 * step.from, 100.0 * step.to),
            match step.verdict {
                StepVerdict::Kept => "kept".to_owned(),
                StepVerdict::Inverted => "given up: inverted".to_owned(),
                StepVerdict::NotConverged => "given up: not converged".to_owned(),
            },
            step.worst.map_or(String::new(), |worst| beta_text(worst, 6)),
            step.worst.map_or(String::new(), |_| count(step.inverted)),
            step.inverted_optimised.map_or(String::new(), count),
        ]
    };
    if path.tried.len() > 1 {
        let rows: Vec<_> = path.tried.iter().take(MOST_STEPS).enumerate().map(row).collect();
        let worst = if report.mesh.n_cells() == report.mesh.tets { "worst beta" } else { "worst measure" };
        let header = ["step", "route", "verdict", worst, "inverted", "after optimisation"];
        html.markup("<div id=\"steps\">").table(&header, &rows).markup("</div>\n");
    }
    if path.tried.len() > MOST_STEPS {
        html.element("p class=\"note\"", format_args!("The first {MOST_STEPS} of {} steps.", path.tried.len()));
    }
    let words = match &report.smoothing {
        None => "Local optimisation did not run: it is off, or no cell needed it.".to_owned(),
        Some(smoothing) => format!(
            "Local optimisation moved {} vertices in {} sweeps.",
            count(smoothing.moved),
            count(smoothing.sweeps)
        ),
    };
    html.element("p", words).markup("</section>\n");
}

/// The families with their roles and their deviations.
pub(super) fn families(page: &Page, html: &mut Html) {
    let report = page.report;
    html.markup("<section><h2>Families</h2>\n");
    let row = |(family, size): (&String, &super::super::FamilySize)| {
        let role = page.roles.iter().find(|(name, _)| name == family).map_or("", |(_, role)| role);
        let of_family = report.families.as_ref().and_then(|families| families.get(family));
        let off = of_family.and_then(|of| of.max_distance_to_original_surface.or(of.max_distance_to_plane));
        vec![
            family.clone(),
            role.to_owned(),
            count(size.vertices),
            count(size.triangles + size.quadrilaterals),
            off.map_or(String::new(), number),
        ]
    };
    let rows: Vec<_> = report.mesh.families.iter().map(row).collect();
    html.table(&["family", "role", "vertices", "faces", "off its surface"], &rows);
    html.markup("</section>\n");
}

/// Settings, versions and the machine.
pub(super) fn settings(page: &Page, html: &mut Html) {
    let (report, settings) = (page.report, page.settings);
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let target = match settings.quality {
        None => "off",
        Some(QualityTarget::Original) => "original",
        Some(QualityTarget::Improve) => "improve",
    };
    let solver = report.solver.as_ref().map_or("", |solver| solver.method.as_str());
    let machine = [std::env::consts::OS, std::env::consts::ARCH].join(" ");
    let mut rows = vec![
        row("springs", settings.springs.name.to_owned()),
        row("method", format!("{} ({solver} in the volume)", settings.method.name())),
        row("tolerance", number(settings.stopping.tolerance)),
        row("most sweeps", count(settings.stopping.max_sweeps)),
        row("most steps", count(settings.max_steps)),
        row("local optimisation", target.to_owned()),
        row("idmesh", report.idmesh.clone()),
    ];
    if !report.backend.kind.is_empty() {
        rows.push(row("backend", format!("{}, {}", report.backend.kind, report.backend.adapter)));
    }
    if !report.backend.driver.is_empty() {
        rows.push(row("driver", report.backend.driver.clone()));
    }
    rows.push(row("machine", machine));
    rows.push(row("exit code", report.exit.to_string()));
    html.markup("<section class=\"names\"><h2>Settings</h2>\n").table(&["setting", "value"], &rows);
    html.markup("</section>\n");
}

/// The files with their checksums.
pub(super) fn files(report: &RunReport, html: &mut Html) {
    let Some(Checksums { case, mesh, inputs, design, outputs }) = &report.checksums else { return };
    let all: [(&str, &Sums); 5] =
        [("case", case), ("mesh", mesh), ("input", inputs), ("design", design), ("output", outputs)];
    let rows = all.into_iter().flat_map(|(kind, sums)| {
        let row = move |(path, sum): (&String, &Option<String>)| {
            vec![kind.to_owned(), path.clone(), sum.clone().unwrap_or_else(|| "\u{2013}".to_owned())]
        };
        sums.iter().map(row)
    });
    html.markup("<section class=\"names\"><h2>Files</h2>\n<p class=\"note\">Checksums are SHA-256.</p>\n");
    html.table(&["what", "file", "checksum"], &rows.collect::<Vec<_>>()).markup("</section>\n");
}
