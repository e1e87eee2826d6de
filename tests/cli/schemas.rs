//! The schema of a case agrees with the parser: the same keys, the same words.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use idmesh::case::Case;
use idmesh::families::ROLES;
use serde_json::Value;

use crate::fixture::*;
use crate::schema::faults_of_case;

fn example() -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/wing-body/case.toml")).unwrap()
}

fn schema() -> Value {
    serde_json::from_str(idmesh::case::SCHEMA).unwrap()
}

#[test]
fn schemas_are_printed_as_they_are() {
    let fixture = Fixture::new();
    for (name, schema) in [("case", idmesh::case::SCHEMA), ("report", idmesh::report::SCHEMA)] {
        let output = fixture.idmesh(&["schema", name]);
        assert_good(&output);
        assert_eq!((stdout(&output), stderr(&output)), (schema.to_owned(), String::new()));
    }
    fixture.refuses_command(&["schema", "mesh"], 2, &["mesh"]);
}

/// The example names the schema in its first line, by a path that leads there. The schema takes the
/// example, the case of the tests and the cases that `init` and `demo` make.
#[test]
fn cases_keep_to_the_schema() {
    let example = example();
    let named = example.lines().next().unwrap().strip_prefix("#:schema ").unwrap().to_owned();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/wing-body");
    assert_eq!(fs::read_to_string(folder.join(named)).unwrap(), idmesh::case::SCHEMA);
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&["demo", "--backend", "cpu"]));
    let of_book = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/src/case.md")).unwrap();
    let of_book = of_book.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    for case in [&example, CASE, &fixture.read("idmesh-demo/case.toml"), of_book] {
        assert_eq!(faults_of_case(case), [""; 0], "{case}");
    }
}

/// A misspelt key, a wrong word and a key of another role.
#[test]
fn mistakes_are_found() {
    for (from, to) in [
        ("mesh = \"wing", "mseh = \"wing"),
        ("new = ", "nwe = "),
        ("role = \"wing\"", "role = \"wnig\""),
        ("coefficient = 0.5", "coeficient = 0.5"),
        ("coefficient = 0.5", "coefficient = 1.5"),
        ("role = \"plane\"", "role = \"fixed\"\nflat = 1e-3"),
        ("target = ", "traget = "),
        ("tolerance = 1e-4", "tolerance = 0"),
        ("[solver]", "[slover]"),
        ("histogram = ", "histogramm = "),
    ] {
        let example = example();
        assert!(example.contains(from), "{from}");
        assert_ne!(faults_of_case(&example.replacen(from, to, 1)), [""; 0], "{to}");
        assert!(Case::parse(&example.replacen(from, to, 1), Path::new("case.toml")).is_err(), "{to}");
    }
}

/// The words after "expected" in the parser's message on a case with a mistake.
fn expected(case: &str) -> BTreeSet<String> {
    let message = Case::parse(case, Path::new("case.toml")).unwrap_err().to_string();
    let (_, list) = message.split_once("expected ").unwrap_or_else(|| panic!("{message}"));
    list.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

fn keys(object: &Value) -> BTreeSet<String> {
    object["properties"].as_object().unwrap().keys().cloned().collect()
}

fn words(list: &Value) -> BTreeSet<String> {
    list["enum"].as_array().unwrap().iter().map(|word| word.as_str().unwrap().to_owned()).collect()
}

/// Each table with a key that no table has, and each key with a word that no key has: the parser
/// lists what it knows.
#[test]
fn the_parser_and_the_schema_know_the_same() {
    let schema = schema();
    let top = &schema["properties"];
    let of = |name: &str| &schema["definitions"][name];
    const START: &str = "mesh = \"a.msh\"\n";
    let wing = format!("{START}[family.wing]\nrole = \"wing\"\n[profiles.wing]\nnew = \"a.dat\"\n");
    assert_eq!(expected(&format!("qqqqqq = 1\n{START}")), keys(&schema));
    for (table, known) in [
        ("[volume]\n", keys(&top["volume"])),
        ("[quality]\n", keys(&top["quality"])),
        ("[quality.limits]\n", keys(&top["quality"]["properties"]["limits"]["anyOf"][1])),
        ("[solver]\n", keys(&top["solver"])),
        ("[output]\n", keys(&top["output"])),
        ("", keys(of("profiles"))),
        ("[profiles.wing.placement.\"a.dat\"]\n", keys(of("placement"))),
    ] {
        assert_eq!(expected(&format!("{wing}{table}qqqqqq = 1\n")), known, "{table}");
    }
    for (table, known) in [
        ("[volume]\nsprings = ", words(&top["volume"]["properties"]["springs"])),
        ("[quality]\ntarget = ", words(&top["quality"]["properties"]["target"])),
        ("[quality]\nlimits = ", words(&top["quality"]["properties"]["limits"]["anyOf"][0])),
        ("[solver]\nmethod = ", words(&top["solver"]["properties"]["method"])),
        ("match = ", words(&of("profiles")["properties"]["match"])),
        (
            "[profiles.wing.placement.\"a.dat\"]\nchord = 1\nposition = [0, 0, 0]\nplane = ",
            words(&of("placement")["properties"]["plane"]),
        ),
    ] {
        assert_eq!(expected(&format!("{wing}{table}\"qqqqqq\"\n")), known, "{table}");
    }
    // Each role has its keys, and each key its words.
    let variants = of("family")["anyOf"].as_array().unwrap();
    let all = variants.iter().flat_map(keys).collect::<BTreeSet<_>>();
    assert_eq!(expected(&format!("{START}[family.a]\nrole = \"wing\"\nqqqqqq = 1\n")), all);
    let mut roles = BTreeSet::new();
    for variant in variants {
        for role in words(&variant["properties"]["role"]) {
            let row = ROLES.iter().find(|row| row.name == role || row.aliases.contains(&role.as_str())).unwrap();
            let own: BTreeSet<String> =
                std::iter::once("role").chain(row.keys.iter().copied()).map(str::to_owned).collect();
            assert_eq!(keys(variant), own, "{role}");
            assert!(roles.insert(role));
        }
    }
    let named = ROLES.iter().flat_map(|row| std::iter::once(&row.name).chain(row.aliases));
    assert_eq!(roles, named.map(|name| (*name).to_owned()).collect());
    let starts = words(of("start"));
    assert_eq!(expected(&format!("{START}[family.a]\nrole = \"wingtip\"\nstart = \"qqqqqq\"\n")), starts);
    let junctions = words(&variants[2]["properties"]["junction"]);
    assert_eq!(expected(&format!("{START}[family.a]\nrole = \"attached\"\njunction = \"qqqqqq\"\n")), junctions);
    let of_body = words(&variants[3]["properties"]["junction"]);
    assert_eq!(expected(&format!("{START}[family.a]\nrole = \"rigid\"\njunction = \"qqqqqq\"\n")), of_body);
}
