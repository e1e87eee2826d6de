//! Every case and every part of one is taken by the parser, and every word that the parser knows is
//! in the book.

use std::path::Path;

use idmesh::case::Case;
use toml::{Table, Value};

use super::{page, pages, root, workplace};
use crate::fixture::{assert_good, command};

/// The keys whose values a table of the book lists: the first cell of its head, and where the key
/// stands in a case.
const KEYS: [(&str, &[&str]); 6] = [
    ("role", &["family", "new"]),
    ("mirror", &["profiles", "wing"]),
    ("start", &["family", "wingtip"]),
    ("springs", &["volume"]),
    ("target", &["quality"]),
    ("method", &["solver"]),
];

/// The case of the example.
fn example() -> Table {
    std::fs::read_to_string(root().join("examples/wing-body/case.toml")).unwrap().parse().unwrap()
}

/// Puts a part of a case over the whole of one.
fn put(whole: &mut Table, part: Table) {
    for (key, value) in part {
        match (whole.get_mut(&key), value) {
            (Some(Value::Table(whole)), Value::Table(part)) => put(whole, part),
            (_, value) => {
                whole.insert(key, value);
            }
        }
    }
}

/// What the parser says to the example with something put over it.
fn parse_with(part: Table) -> Result<Case, String> {
    let mut case = example();
    put(&mut case, part);
    Case::parse(&toml::to_string(&case).unwrap(), Path::new("case.toml")).map_err(|error| error.to_string())
}

/// Checks that what a page shows of a report is in the report, each figure within 2 % or half a
/// unit of 1e-5.
fn is_part_of(part: &serde_json::Value, whole: &serde_json::Value, place: &str) {
    use serde_json::Value;
    match (part, whole) {
        (Value::Object(part), Value::Object(whole)) => {
            for (key, value) in part {
                let found = whole.get(key).unwrap_or_else(|| panic!("{place}: the report has no `{key}`"));
                is_part_of(value, found, &format!("{place}/{key}"));
            }
        }
        (Value::Array(part), Value::Array(whole)) => {
            assert_eq!(part.len(), whole.len(), "{place}");
            part.iter().zip(whole).for_each(|(part, whole)| is_part_of(part, whole, place));
        }
        (Value::Number(_), Value::Number(_)) => {
            let [shown, found] = [part, whole].map(|value| value.as_f64().unwrap());
            assert!(
                (shown - found).abs() <= 0.02 * found.abs() + 5e-6,
                "{place}: {shown} shown, {found} in the report"
            );
        }
        _ => assert_eq!(part, whole, "{place}"),
    }
}

/// Fails if a page shows a figure or a key that its run does not have.
#[test]
fn every_case_is_taken() {
    let (mut n_parts, mut n_reports) = (0, 0);
    for page in pages() {
        for block in page.blocks("toml") {
            let place = format!("{}:{}", page.name(), block.line);
            let text = block.lines.join("\n");
            let table: Table = text.parse().unwrap_or_else(|error| panic!("{place}: {error}"));
            if !table.contains_key("mesh") {
                parse_with(table).unwrap_or_else(|error| panic!("{place}: {error}"));
                n_parts += 1;
                continue;
            }
            let folder = workplace();
            std::fs::write(folder.path().join("page.toml"), text).unwrap();
            let arguments = ["run", "page.toml", "--backend", "cpu", "--json", "report.json"];
            assert_good(&command(folder.path(), &arguments).output().unwrap());
            // What the page shows of the report, before the next case.
            let of_run = std::fs::read_to_string(folder.path().join("report.json")).unwrap();
            let end = page.blocks("toml").iter().map(|next| next.line).filter(|&line| line > block.line).min();
            let is_of_case = |line: usize| line > block.line && end.is_none_or(|end| line < end);
            for shown in page.blocks("json").into_iter().filter(|shown| is_of_case(shown.line)) {
                let part = serde_json::from_str(&shown.lines.join("\n")).unwrap();
                is_part_of(&part, &serde_json::from_str(&of_run).unwrap(), &place);
                n_reports += 1;
            }
        }
    }
    assert!(n_reports >= 6, "{n_reports} reports");
    assert!(n_parts >= 5, "{n_parts} parts of cases");
    assert!(pages().iter().flat_map(|page| page.blocks("toml")).any(|block| block.lines[0].starts_with("mesh")));
}

/// The values that tables of `case.md` list for a key, in the form they have in a case.
fn listed(key: &str) -> Vec<String> {
    let page = page("docs/src/case.md");
    let mut values = Vec::new();
    // Whether the line is in a table, and whether that is a table of the key's values.
    let (mut in_table, mut listing) = (false, false);
    for (_, line) in page.prose() {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let is_row = cells.len() > 2;
        let is_head = is_row && !in_table;
        listing = is_row && if is_head { cells[1].trim_matches('`') == key } else { listing };
        in_table = is_row;
        if listing && !is_head {
            values.extend(cells[1].split('`').skip(1).step_by(2).map(str::to_owned));
        }
    }
    // Roles are listed as words.
    if key == "role" { values.iter().map(|word| format!("\"{word}\"")).collect() } else { values }
}

fn part(path: &[&str], key: &str, value: &str) -> Table {
    let also = match value {
        "\"prescribed\"" => "displacement = \"FILE.csv\"",
        "\"wing\"" => "[profiles.new]\nnew = \"new.csv\"",
        _ => "",
    };
    format!("[{}]\n{key} = {value}\n{also}", path.join(".")).parse().unwrap()
}

#[test]
fn listed_values_are_taken() {
    for (key, path) in KEYS {
        let values = listed(key);
        assert!(values.len() >= 3, "{key}: {values:?}");
        for value in values {
            parse_with(part(path, key, &value)).unwrap_or_else(|error| panic!("{key} = {value}: {error}"));
        }
    }
}

/// The parser lists the words it knows where it meets one that it does not know.
#[test]
fn no_known_word_is_left_out() {
    for (key, path) in KEYS.into_iter().filter(|&(key, _)| key != "mirror") {
        let error = parse_with(part(path, key, "\"?\"")).unwrap_err();
        let (_, words) = error.split_once("expected ").unwrap_or_else(|| panic!("{error}"));
        let words: Vec<String> = words.split('`').skip(1).step_by(2).map(|word| format!("\"{word}\"")).collect();
        assert!(words.len() >= 3, "{error}");
        let listed = listed(key);
        for word in words {
            assert!(listed.contains(&word), "docs/src/case.md lists {listed:?} for `{key}`, not {word}");
        }
    }
}

/// Every key of the report in `report.md` is one of a run of the example.
#[test]
fn keys_of_the_report_are_those_of_a_run() {
    let folder = workplace();
    let arguments = ["run", "case.toml", "--backend", "cpu", "--json", "report.json"];
    assert_good(&command(folder.path(), &arguments).output().unwrap());
    let text = std::fs::read_to_string(folder.path().join("report.json")).unwrap();
    let known = keys(&text);
    let page = page("docs/src/report.md");
    let blocks = page.blocks("text");
    let shown = keys(&blocks[0].lines.join("\n"));
    assert!(shown.len() > 30, "{shown:?}");
    for key in shown {
        assert!(known.contains(&key), "a report has no key `{key}`");
    }
}

/// The words in quotes before a colon.
fn keys(json: &str) -> Vec<String> {
    let pieces: Vec<&str> = json.split('"').collect();
    let is_key = |pair: &&[&str]| pair[1].trim_start().starts_with(':');
    pieces[1..].chunks(2).filter(|pair| pair.len() == 2).filter(is_key).map(|pair| pair[0].to_owned()).collect()
}
