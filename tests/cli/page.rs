//! The page of a run: it is written and removed like the other outputs, shows the figures of the
//! report, and holds names as text.

use std::fs;

use serde_json::Value;

use crate::fixture::*;
use crate::wing_box::WingBox;

const RUN: [&str; 6] = ["run", "case.toml", "--backend", "cpu", "--json", "report.json"];

/// Runs the case with `report` in its outputs.
fn with_page(fixture: &Fixture) {
    fixture.case("mesh = \"moved.msh\"", "mesh = \"moved.msh\"\nreport = \"page.html\"");
}

fn report(fixture: &Fixture) -> Value {
    serde_json::from_str(&fixture.read("report.json")).unwrap()
}

/// The words of a page, without its tags.
fn words(page: &str) -> String {
    page.split('<').filter_map(|piece| piece.split_once('>')).map(|(_, text)| text).collect::<Vec<_>>().join(" ")
}

/// A good result, a bad one and none. Fails if a page of another result is left, if a refused
/// result has no page, or if the page does not say why.
#[test]
fn every_result_has_its_own_page() {
    let fixture = Fixture::new();
    with_page(&fixture);
    let output = fixture.idmesh(&RUN);
    assert_good(&output);
    assert!(stderr(&output).contains("wrote page.html\n"), "{}", stderr(&output));
    assert!(words(&fixture.read("page.html")).contains("valid"));
    // The page is an output like the others, and the report has its checksum.
    assert_eq!(report(&fixture)["checksums"]["outputs"].as_object().unwrap().len(), 2);

    fixture.write("new.csv", &profiles(&[(0, 0.3, 3.0), (1, 1.2, 3.0)]));
    assert_eq!(fixture.idmesh(&RUN).status.code(), Some(5));
    let page = words(&fixture.read("page.html"));
    let message = report(&fixture)["error"]["message"].as_str().unwrap().lines().next().unwrap().to_owned();
    let shown = message.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;");
    assert!(page.contains("refused") && page.contains(&shown), "{message}");

    fixture.write("new.csv", "profile,x,y,z\n0,no,number,0\n");
    assert_eq!(fixture.idmesh(&RUN).status.code(), Some(3));
    assert!(!fixture.path("page.html").exists());
}

/// `--report` names the page in place of the case. Fails if both are written, or none.
#[test]
fn the_option_names_the_page() {
    let fixture = Fixture::new();
    with_page(&fixture);
    assert_good(&fixture.idmesh(&[&RUN[..], &["--report", "other.HTML", "--out", "moved"]].concat()));
    assert!(fixture.path("other.HTML").is_file());
    assert!(!fixture.path("page.html").exists() && !fixture.path("moved/page.html").exists());
    assert_good(&fixture.idmesh(&[&RUN[..], &["--out", "moved"]].concat()));
    assert!(fixture.path("moved/page.html").is_file());
    let output = fixture.idmesh(&["run", "case.toml", "--report", "report.json"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("expected a name ending in .html"), "{}", stderr(&output));
}

/// Fails if a page may have the name of an input, of another output or of the report.
#[test]
fn a_page_takes_no_other_name() {
    let fixture = Fixture::new();
    let run = |more: &[&str]| fixture.idmesh(&[&["run", "case.toml", "--backend", "cpu"][..], more].concat());
    let both = run(&["--report", "a.html", "--json", "a.html"]);
    assert_eq!(both.status.code(), Some(3));
    fs::rename(fixture.path("new.csv"), fixture.path("new.html")).unwrap();
    fixture.case("new.csv", "new.html");
    let input = run(&["--report", "new.html"]);
    assert_eq!(input.status.code(), Some(3));
    assert!(fixture.read("new.html").starts_with("profile"));
}

/// Fails if a mistake in a case takes away a file that is no page of idmesh, or leaves one that is.
#[test]
fn a_case_with_a_mistake_leaves_no_page() {
    let fixture = Fixture::new();
    with_page(&fixture);
    assert_good(&fixture.idmesh(&RUN));
    let page = fixture.read("page.html");
    let good = fixture.read("case.toml");
    fixture.write("case.toml", &good.replace("role = \"wing\"", "role = \"wimg\""));
    assert_eq!(fixture.idmesh(&RUN).status.code(), Some(3));
    assert!(!fixture.path("page.html").exists());
    for (text, is_left) in [(page.as_str(), false), ("<!doctype html>\n<title>My site</title>", true)] {
        fixture.write("page.html", text);
        assert_eq!(fixture.idmesh(&RUN).status.code(), Some(3));
        assert_eq!(fixture.path("page.html").exists(), is_left);
    }
}

/// Each figure that the page shows is that of the report: worst cells, stages, counts. Fails if the
/// page ranks other cells, or rounds in another way.
#[test]
fn the_figures_are_those_of_the_report() {
    let fixture = Fixture::new();
    with_page(&fixture);
    assert_good(&fixture.idmesh(&RUN));
    let (report, page) = (report(&fixture), fixture.read("page.html"));
    let row = |cells: &[String]| cells.iter().map(|cell| format!("<td>{cell}</td>\n")).collect::<String>();
    for cell in report["worst_cells"].as_array().unwrap() {
        let figures = [&cell["value"], &cell["original"]].map(|value| format!("{:.6}", value.as_f64().unwrap()));
        let name = format!("{}\u{a0}{}", cell["kind"].as_str().unwrap(), cell["index"]);
        let beginning = row(&[vec![name], figures.to_vec()].concat());
        assert!(page.contains(&beginning), "{beginning}");
    }
    let worst = &report["worst_cells"][0];
    assert_eq!(worst["value"], report["stages"][3]["beta_min"]);
    for stage in report["stages"].as_array().unwrap() {
        let figures = row(&[format!("{:.6}", stage["beta_min"].as_f64().unwrap())]);
        assert!(page.contains(&figures), "{figures}");
    }
    for sum in report["checksums"]["inputs"].as_object().unwrap().values() {
        assert!(page.contains(sum.as_str().unwrap()));
    }
    // The section's figure, and a curve for each relaxation.
    assert_eq!(report["sections"]["wing"].as_array().unwrap().len(), 2);
    let relaxations = report["relaxations"].as_array().unwrap();
    assert!(relaxations.iter().any(|one| one["stage"] == "volume" && !one["changes"].as_array().unwrap().is_empty()));
    assert!(page.contains("Largest distance of got from asked: "));
}

/// The mesh and the case with a family of another name.
pub fn with_family(fixture: &Fixture, name: &str) {
    fixture.write("box.msh", &fixture.read("box.msh").replace("\"symmetry\"", &format!("\"{name}\"")));
    fixture.write("case.toml", &fixture.read("case.toml").replace("[family.symmetry]", &format!("[family.'{name}']")));
}

/// A name that would end the script, and one that would begin an element.
pub const HOSTILE: &str = "</script><img src=x onerror=document.body.remove()>&amp;";

/// Fails if a name becomes markup, or if the page names another source. That of a browser is in
/// `browser`.
#[test]
fn a_page_holds_names_as_text_and_no_address() {
    let fixture = Fixture::new();
    with_page(&fixture);
    with_family(&fixture, HOSTILE);
    assert_good(&fixture.idmesh(&RUN));
    assert!(report(&fixture)["mesh"]["families"][HOSTILE].is_object());
    let page = fixture.read("page.html");
    assert!(!page.contains("<img"));
    // The data, the packed mesh and the script.
    assert_eq!(page.matches("</script>").count(), 3);
    assert!(page.contains("&lt;/script&gt;&lt;img"));
    for outside in ["http:", "https:", "src=", "href=", "url(", "@import", "import("] {
        let found = page.replace("&lt;img src=x", "").replace("\\u003cimg src=x", "");
        assert!(!found.contains(outside), "{outside}");
    }
    let policy = page.split("Content-Security-Policy\" content=\"").nth(1).unwrap().split('"').next().unwrap();
    assert!(policy.starts_with("default-src 'none'; style-src 'sha256-"), "{policy}");
    assert!(!policy.contains("unsafe") && !policy.contains('*'), "{policy}");
}

/// A batch makes a page for each design, with the design's name.
#[test]
fn designs_have_pages() {
    let fixture = Fixture::with_designs(2);
    with_page(&fixture);
    assert_good(&fixture.idmesh(&["batch", "case.toml", "--backend", "cpu", "--designs", "designs", "--out", "moved"]));
    for name in ["0", "1"] {
        assert!(fixture.read(&format!("moved/{name}.html")).contains(&format!("<title>{name}: valid</title>")));
    }
}

/// The page of a batch has a row for each design of the reports, and joins them as `--join` does.
/// Fails if a design is left out, if `--join` is not done beside it, or if nothing is asked for.
#[test]
fn a_batch_has_a_page_of_its_designs() {
    let fixture = Fixture::with_designs(3);
    fixture.write("designs/2.csv", "profile,x,y,z\n0,no,number,0\n");
    let batch = ["batch", "case.toml", "--backend", "cpu", "--designs", "designs", "--out", "moved"];
    let output = fixture.idmesh(&[&batch[..], &["--json", "all.jsonl"]].concat());
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert_good(&fixture.idmesh(&["report", "all.jsonl", "-o", "designs.html", "--join", "-"]));
    assert_good(&fixture.idmesh(&["report", "all.jsonl", "all.jsonl", "-o", "designs.html"]));
    let page = fixture.read("designs.html");
    for (name, verdict) in [("0", "valid"), ("1", "valid"), ("2", "not moved")] {
        assert_eq!(page.matches(&format!("<td>{name}</td>\n<td>{verdict}</td>")).count(), 1, "{name}");
    }
    assert!(page.contains("2 of 3 valid") && !page.contains("http:"));
    // Both sections of both designs that were moved.
    assert_eq!(page.matches("<svg class=\"small\"").count(), 4);
    assert!(page.contains("wing, profile 1: up to 0.05 apart") && page.contains("wing, profile 0: up to 0.02 apart"));
    assert_eq!(fixture.idmesh(&["report", "all.jsonl"]).status.code(), Some(2));
    assert_eq!(fixture.idmesh(&["report", "all.jsonl", "-o", "all.jsonl"]).status.code(), Some(2));
}

/// Two meshes that differ at two vertices, of the wing and inside, by 0.125 and 0.0625.
pub fn two_meshes(fixture: &Fixture) -> [usize; 2] {
    fs::copy(fixture.path("box.msh"), fixture.path("first.msh")).unwrap();
    let mut moved = [0; 2];
    fixture.mesh(|mesh| {
        let on_wing = mesh.family_vertices(0)[3];
        let surface: Vec<usize> = (0..5).flat_map(|family| mesh.family_vertices(family)).collect();
        let inside = (0..mesh.vertices.len()).find(|vertex| !surface.contains(vertex)).unwrap();
        mesh.vertices[on_wing][2] += 0.125;
        mesh.vertices[inside][0] -= 0.0625;
        moved = [on_wing, inside];
    });
    fs::rename(fixture.path("box.msh"), fixture.path("second.msh")).unwrap();
    moved
}

/// Fails if the page ranks the vertices in another way, puts a vertex into another family, is left
/// out where the meshes do not agree, or takes the name of another output.
#[test]
fn a_comparison_has_a_page() {
    let fixture = Fixture::new();
    let [on_wing, inside] = two_meshes(&fixture);
    let compare = |more: &[&str]| fixture.idmesh(&[&["compare", "first.msh", "second.msh"], more].concat());
    let output = compare(&["--report", "page.html", "--json", "figures.json"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let figures: Value = serde_json::from_str(&fixture.read("figures.json")).unwrap();
    let (page, relative) = (fixture.read("page.html"), figures["relative_difference"].as_f64().unwrap());
    assert_eq!(
        (figures["worst_vertex"].as_u64(), figures["max_difference"].as_f64()),
        (Some(on_wing as u64), Some(0.125))
    );
    let words = words(&page);
    assert!(words.contains("out of tolerance") && words.contains("first.msh against second.msh"), "{words}");
    let row = |number: usize, vertex: usize, distance: &str| {
        format!("<tr data-cell=\"{number}\" tabindex=\"0\"><td>{vertex}</td>\n<td>{distance}</td>")
    };
    assert!(page.contains(&row(0, on_wing, "0.125")) && page.contains(&row(1, inside, "0.0625")));
    assert_eq!(page.matches("<tr data-cell").count(), 2);
    // The largest and the mean of 0.125 on one vertex of many, and of the one inside.
    let of_wing = WingBox::new().family_vertices(0).len();
    assert!(page.contains(&format!("<td>wing</td>\n<td>{of_wing}</td>\n<td>0.125</td>")));
    assert!(page.contains("<td>inside</td>") && page.contains("</td>\n<td>0.0625</td>"));
    assert!(relative > 0.0 && !page.contains("http:"));
    // Accepted.
    assert_good(&compare(&["--report", "page.html", "--tolerance", "1"]));
    assert!(fixture.read("page.html").contains("within tolerance"));
    assert_eq!(compare(&["--report", "a.html", "--json", "a.html"]).status.code(), Some(3));
    assert_eq!(compare(&["--report", "page.txt"]).status.code(), Some(2));
}
