//! Pages in a real browser: the script runs under the page's own policy, draws the mesh, and finds
//! the report's figures again.
//!
//! The tests need Chromium. `IDMESH_TEST_BROWSER=off` leaves them out.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use idmesh::formats::read_mixed;
use sha2::{Digest, Sha256};

use crate::fixture::*;
use crate::page::{HOSTILE, two_meshes, with_family};

/// Names of the browser in different systems.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// Whether the user left these tests out.
fn is_off() -> bool {
    let is_off = std::env::var("IDMESH_TEST_BROWSER").is_ok_and(|value| value == "off");
    if is_off {
        let thread = std::thread::current();
        eprintln!("SKIPPED by IDMESH_TEST_BROWSER=off: {}", thread.name().unwrap_or("a test of pages"));
    }
    is_off
}

/// The document after its script has run.
fn opened(page: &Path) -> String {
    let profile = tempfile::tempdir().unwrap();
    let runs = |name: &&str| Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success());
    let Some(browser) = NAMES.into_iter().find(runs) else {
        panic!("no Chromium found; install it (Debian: apt-get install chromium), or set IDMESH_TEST_BROWSER=off");
    };
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--no-first-run",
        ])
        .args(["--window-size=1400,1000", "--virtual-time-budget=60000", "--dump-dom"])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("file://{}", page.display()))
        .output()
        .unwrap();
    let document = String::from_utf8(output.stdout).unwrap();
    assert!(document.contains("<body"), "{}", String::from_utf8_lossy(&output.stderr));
    document
}

/// The document after a script of the test has run in a page that was ready. The page's policy
/// allows the script too.
fn driven(page: &Path, script: &str) -> String {
    let script = format!(
        "(async () => {{ const body = document.body, find = id => document.getElementById(id); \
         while (body.dataset.state !== 'ready') await new Promise(done => setTimeout(done, 20)); {script} }})()"
    );
    let sum = format!("script-src 'sha256-{}' ", STANDARD.encode(Sha256::digest(&script)));
    let text = fs::read_to_string(page).unwrap().replacen("script-src ", &sum, 1);
    let path = page.with_extension("driven.html");
    fs::write(&path, text.replacen("</body>", &format!("<script>{script}</script></body>"), 1)).unwrap();
    opened(&path)
}

/// What the script has written to the body: data-NAME by NAME.
fn data(document: &str) -> BTreeMap<String, String> {
    let body = document.split("<body").nth(1).unwrap().split('>').next().unwrap();
    let pairs = body.split(" data-").skip(1).filter_map(|pair| pair.split_once("=\""));
    pairs.map(|(name, value)| (name.to_owned(), value.trim_end().trim_end_matches('"').to_owned())).collect()
}

/// Checks that a page draws its mesh and finds its figures again. Returns the document.
#[track_caller]
fn assert_drawn(page: &Path) -> String {
    let document = opened(page);
    let data = data(&document);
    let number = |name: &str| data.get(name).and_then(|text| text.parse::<usize>().ok());
    assert_eq!(data.get("state").map(String::as_str), Some("ready"), "{data:?}");
    // The view has about 700 x 600 pixels.
    assert!(number("pixels").is_some_and(|pixels| pixels > 10_000), "{data:?}");
    assert_eq!((number("checked"), number("wrong")), (Some(20), Some(0)), "{data:?}");
    document
}

/// The example's page is below 1.5 MB. A figure that is not the mesh's is told as an error.
///
/// Fails if the script's checksum in the policy is not the script's, if an array is packed in
/// another way than it is unpacked, or if the page measures in another way than the report.
#[test]
fn the_page_of_the_example_draws_and_measures() {
    if is_off() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/wing-body");
    for name in ["case.toml", "wing-body.msh.gz", "old.csv", "new.csv"] {
        fs::copy(example.join(name), folder.path().join(name)).unwrap();
    }
    assert_good(&command(folder.path(), &["run", "case.toml", "--backend", "cpu"]).output().unwrap());
    let path = folder.path().join("report.html");
    let page = fs::read_to_string(&path).unwrap();
    assert!(page.len() < 1_500_000, "{} bytes", page.len());
    let document = assert_drawn(&path);
    assert!(document.contains("and found the same figures"));

    let (before, worst) = page.split_once("\"worst\":[").unwrap();
    let (cells, after) = worst.split_once("\"value\":").unwrap();
    let end = after.find(['}', ',']).unwrap();
    let value: f64 = after[..end].parse().unwrap();
    let wrong = format!("{before}\"worst\":[{cells}\"value\":{:e}{}", value * 1.0001, &after[end..]);
    fs::write(&path, wrong).unwrap();
    let document = opened(&path);
    assert_eq!(data(&document)["wrong"], "1");
    assert!(document.contains("Error: measured again"));
}

/// Fails if a name becomes an element, or stops the script.
#[test]
fn a_hostile_name_is_shown() {
    if is_off() {
        return;
    }
    let fixture = Fixture::new();
    with_family(&fixture, HOSTILE);
    assert_good(&fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--report", "page.html"]));
    let document = assert_drawn(&fixture.path("page.html"));
    assert!(!document.contains("<img"));
    // The table of families, and the list of the view.
    assert!(document.matches("&lt;/script&gt;&lt;img").count() >= 2);
}

/// Fails if the script of a batch's page does not run under the page's policy.
#[test]
fn the_page_of_a_batch_is_sorted_and_filtered() {
    if is_off() {
        return;
    }
    let fixture = Fixture::with_designs(2);
    let batch = ["batch", "case.toml", "--backend", "cpu", "--designs", "designs", "--out", "moved"];
    assert_good(&fixture.idmesh(&[&batch[..], &["--json", "all.jsonl"]].concat()));
    assert_good(&fixture.idmesh(&["report", "all.jsonl", "-o", "designs.html"]));
    let document = opened(&fixture.path("designs.html"));
    assert_eq!(data(&document)["state"], "ready");
    assert!(document.contains("<output id=\"shown\">2 of 2</output>"));
}

/// Above 200 000 cells a page holds a part of the mesh, says so, and has at most 3 MB.
#[test]
fn a_large_mesh_is_shown_in_part() {
    if is_off() {
        return;
    }
    let fixture = Fixture::new();
    let tets = |name: &str| -> usize {
        assert_good(&fixture.idmesh(&["quality", name, "--json", "quality.json"]));
        let figures: serde_json::Value = serde_json::from_str(&fixture.read("quality.json")).unwrap();
        figures["mesh"]["tets"].as_u64().unwrap() as usize
    };
    let mut fine = "box.msh".to_owned();
    while tets(&fine) <= 200_000 {
        let finer = format!("fine-{fine}");
        assert_good(&fixture.idmesh(&["refine", &fine, &finer]));
        fine = finer;
    }
    fixture.case("mesh = \"box.msh\"", &format!("mesh = \"{fine}\""));
    assert_good(&fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--report", "page.html"]));
    assert!(fixture.read("page.html").len() < 3_000_000);
    let document = assert_drawn(&fixture.path("page.html"));
    assert!(document.contains("The mesh is large: the view has its surfaces"));
}

/// A slice has the cells that the plane cuts near what moves: along an axis, by two angles, and
/// across the view, from the keyboard and from the controls.
///
/// Fails if a cell that is cut is left out, if angles turn the other way, or if a key does nothing.
#[test]
fn a_slice_lies_in_any_plane() {
    if is_off() {
        return;
    }
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--report", "page.html"]));
    let mesh = read_mixed(&fixture.path("moved.msh")).unwrap().mesh;
    let is_body = |family: &str| ["wing", "trailing_edge", "wingtip"].contains(&family);
    let of_body = mesh.triangles.iter().zip(&mesh.triangle_family);
    let of_body = of_body.filter(|(_, family)| is_body(&mesh.families[family.index()]));
    let points: Vec<DVec3> =
        of_body.flat_map(|(triangle, _)| triangle.map(|vertex| mesh.vertices[vertex as usize])).collect();
    let low = points.iter().copied().reduce(DVec3::min).unwrap();
    let high = points.iter().copied().reduce(DVec3::max).unwrap();
    let (middle, size) = (0.5 * (low + high), low.distance(high));
    let cut = |normal: DVec3, share: f64| {
        let half = 0.5 * normal.abs().dot(high - low);
        let place = normal.dot(middle) + 1.5 * half * (2.0 * share - 1.0);
        let beyond = |vertex: &u32| normal.dot(mesh.vertices[*vertex as usize]) - place;
        let is_cut = |tet: &&[u32; 4]| {
            tet.iter().any(|vertex| beyond(vertex) <= 0.0)
                && tet.iter().any(|vertex| beyond(vertex) >= 0.0)
                && tet.iter().any(|vertex| mesh.vertices[*vertex as usize].distance(middle) < 0.6 * size)
        };
        mesh.tets.iter().filter(is_cut).count().to_string()
    };
    let by_angles = |round: f64, up: f64| {
        let (round, up) = (round.to_radians(), up.to_radians());
        DVec3::new(up.cos() * round.cos(), up.cos() * round.sin(), up.sin())
    };
    let document = driven(
        &fixture.path("page.html"),
        "const set = (id, value) => { find(id).value = value; find(id).dispatchEvent(new Event('input')); }; \
         const key = key => find('canvas').dispatchEvent(new KeyboardEvent('keydown', { key })); \
         const told = () => body.dataset.slice; \
         body.dataset.none = told(); \
         set('axis', '1'); set('place', '.528'); body.dataset.along = told(); \
         set('axis', 'any'); set('round', '30'); set('up', '-20'); body.dataset.oblique = told(); \
         key('x'); body.dataset.x = told(); key(']'); body.dataset.further = told(); \
         key('p'); body.dataset.facing = ['round', 'up', 'axis'].map(id => find(id).value).join(' '); \
         set('axis', ''); find('facing').click(); body.dataset.click = find('axis').value;",
    );
    let data = data(&document);
    assert_eq!(data["state"], "ready", "{data:?}");
    assert_eq!(data["none"], "0");
    assert_eq!(data["along"], cut(DVec3::Y, 0.528), "{data:?}");
    assert_eq!(data["oblique"], cut(by_angles(30.0, -20.0), 0.528), "{data:?}");
    assert_eq!([&data["x"], &data["further"]], [&cut(DVec3::X, 0.528), &cut(DVec3::X, 0.538)], "{data:?}");
    assert!(data["oblique"] != data["along"] && data["along"] != "0", "{data:?}");
    // At first a page is seen from 2.2 rad around and 0.45 rad above, from the side of the wing.
    assert!(["126 26 any", "-126 26 any"].contains(&data["facing"].as_str()), "{data:?}");
    assert_eq!(data["click"], "any");
}

/// The page of a comparison draws the mesh in the colours of the distances, and a click flies to a
/// vertex.
///
/// Fails if the distances are packed in another way than they are unpacked.
#[test]
fn the_page_of_a_comparison_shows_distances() {
    if is_off() {
        return;
    }
    let fixture = Fixture::new();
    two_meshes(&fixture);
    let output = fixture.idmesh(&["compare", "first.msh", "second.msh", "--report", "page.html"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let document = driven(
        &fixture.path("page.html"),
        "document.querySelectorAll('#worst tr[data-cell]')[1].click(); \
         body.dataset.chosen = document.querySelector('.chosen').dataset.cell; \
         body.dataset.colours = find('colours').value; \
         body.dataset.ticks = [...find('ticks').children].map(tick => tick.textContent).join(' ');",
    );
    let data = data(&document);
    assert_eq!((data["state"].as_str(), data["wrong"].as_str()), ("ready", "0"), "{data:?}");
    assert!(data["pixels"].parse::<usize>().unwrap() > 10_000, "{data:?}");
    assert_eq!((data["chosen"].as_str(), data["colours"].as_str()), ("1", "distance"), "{data:?}");
    // Six powers of ten up to 0.125.
    assert_eq!(data["ticks"], "1.2e-7 0.00013 0.13", "{data:?}");
}
