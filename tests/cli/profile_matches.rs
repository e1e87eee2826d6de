//! The key `match` of a case: it is obeyed, and the report says which match was made.

use serde_json::{Value, json};

use crate::fixture::*;

/// The case with old profiles, `families`, and lines of the table of profiles.
fn case(fixture: &Fixture, lines: &str) {
    let table = format!("[profiles.main]\nfamilies = \"wing\"\nnew = \"new.csv\"\nold = \"old.csv\"\n{lines}");
    fixture.case("[profiles.wing]\nnew = \"new.csv\"\n", &table);
    fixture.write("old.csv", &profiles(&[(0, 0.3, 0.0), (1, 1.2, 0.0)]));
}

/// The matches in the report of a run, with the moved mesh.
fn matches(fixture: &Fixture) -> (Value, String) {
    let output = fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "report.json"]);
    assert_good(&output);
    let report: Value = serde_json::from_str(&fixture.read("report.json")).unwrap();
    assert_eq!(report["profiles"]["main"]["match"], report["profiles"]["wing"]["match"]);
    (report["profiles"]["main"]["match"].clone(), fixture.read("moved.msh"))
}

/// New profiles with the old one's points are matched by points, and with a point more by measure.
/// The key takes the first ones to either match; a point more is refused where points must pair.
///
/// Fails if the key does not reach the wing, or if the report has no match.
#[test]
fn the_match_is_obeyed_and_reported() {
    let fixture = Fixture::new();
    let all = |by: &str| json!({ "0": by, "1": by });
    case(&fixture, "");
    let free = matches(&fixture);
    assert_eq!(free.0, all("points"));
    case(&fixture, "match = \"points\"\n");
    assert_eq!(matches(&fixture), free);
    case(&fixture, "match = \"measure\"\n");
    assert_eq!(matches(&fixture).0, all("measure"));

    // Half way between the first two points of the second profile.
    let new = fixture.read("new.csv");
    let rows: Vec<&str> = new.lines().filter(|row| row.starts_with("1,")).collect();
    let at = |row: &str| row.split(',').skip(1).map(|x| x.parse::<f64>().unwrap()).collect::<Vec<_>>();
    let middle: Vec<String> = at(rows[0]).iter().zip(at(rows[1])).map(|(a, b)| ((a + b) / 2.0).to_string()).collect();
    let row = format!("{}\n1,{}\n", rows[0], middle.join(","));
    fixture.write("new.csv", &new.replacen(&format!("{}\n", rows[0]), &row, 1));
    assert_eq!(matches(&fixture).0, all("measure"));
    case(&fixture, "");
    assert_eq!(matches(&fixture).0, json!({ "0": "points", "1": "measure" }));
    case(&fixture, "match = \"points\"\n");
    let counts = [rows.len() + 1, rows.len()].map(|n| format!("{n} points"));
    fixture.refuses(3, &["new.csv", "profile 1", &counts[0], &counts[1], "match"]);
}
