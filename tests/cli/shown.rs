//! Names and contents of files are shown as text: no terminal obeys them, they begin no line of
//! their own, and files beside a mesh that are links out of its folder are not quoted.

use std::fs;
use std::process::Output;

use serde_json::Value;

use crate::fixture::*;

/// A name with a sequence that sets a terminal's title, with a C1 control, with a character that
/// turns the direction of text, and with one that has no width.
const EVIL: &str = "wi\x1b]0;t\x07\u{9b}\x7f\u{202e}\u{200b}ng";

/// The same name as a reader sees it.
const ESCAPED: &str = "wi\\x1b]0;t\\x07\\x9b\\x7f\\u{202e}\\u{200b}ng";

/// Checks that a terminal obeys nothing in a text but the ends of its lines.
#[track_caller]
fn assert_plain(text: &str) {
    let is_plain = |letter: char| {
        let is_format = matches!(letter, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}');
        letter == '\n' || !letter.is_control() && !is_format && !('\u{e0000}'..='\u{e007f}').contains(&letter)
    };
    assert!(text.chars().all(is_plain), "{text:?}");
}

#[track_caller]
fn assert_both_plain(output: &Output) {
    assert_plain(&stdout(output));
    assert_plain(&stderr(output));
}

/// A case on a mesh whose wing has this name.
fn named(name: &str) -> Fixture {
    let fixture = Fixture::new();
    fixture.write("box.msh", &fixture.read("box.msh").replacen("\"wing\"", &format!("\"{name}\""), 1));
    fixture
}

/// The table of families in the output of `quality`.
fn of_families(text: &str) -> Vec<&str> {
    text.lines().skip_while(|line| !line.starts_with("family")).take_while(|line| !line.is_empty()).collect()
}

#[test]
fn names_of_families_are_escaped() {
    let fixture = named(EVIL);
    let output = fixture.idmesh(&["quality", "box.msh"]);
    assert_both_plain(&output);
    let text = stdout(&output);
    let row = text.lines().find(|line| line.starts_with(ESCAPED)).unwrap();
    // The columns end where those of the other families end.
    assert!(of_families(&text).iter().all(|line| line.len() == row.len()), "{text}");
    fixture.refuses(3, &[ESCAPED]);
    assert_both_plain(&fixture.run());
}

/// A program that reads the JSON gets the name itself, and a terminal does not obey it.
#[test]
fn json_keeps_names() {
    let fixture = named(EVIL);
    let output = fixture.idmesh(&["quality", "box.msh", "--json", "-"]);
    assert_both_plain(&output);
    let figures: Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert!(figures["mesh"]["families"].as_object().unwrap().contains_key(EVIL), "{figures}");
    // A file is shown on a terminal too.
    fixture.idmesh(&["quality", "box.msh", "--json", "figures.json"]);
    assert_plain(&fixture.read("figures.json"));
    assert_eq!(serde_json::from_str::<Value>(&fixture.read("figures.json")).unwrap(), figures);
}

#[test]
fn long_names_leave_tables_narrow_and_stay_whole_elsewhere() {
    let name = format!("{}_upper", "wing".repeat(50));
    let fixture = named(&name);
    let text = stdout(&fixture.idmesh(&["quality", "box.msh"]));
    let rows = of_families(&text);
    assert!(rows.iter().all(|row| row.len() == rows[0].len() && row.len() < 80), "{text}");
    assert!(rows.iter().any(|row| row.starts_with("wingwing") && row.contains("...") && row.contains("_upper ")));
    let figures = stdout(&fixture.idmesh(&["quality", "box.msh", "--json", "-"]));
    assert!(figures.contains(&format!("\"{name}\"")), "{figures}");
    fixture.refuses(3, &[&name]);
}

/// Every text of a message can hold a line end: keys, names of files, contents of files. The
/// fixture checks that one line alone begins like an error.
#[test]
fn no_text_begins_a_line_of_its_own() {
    let fixture = Fixture::new();
    fixture.write("case.toml", &format!("{CASE}\n[\"\\nerror: all is \\u001b[1mwell\"]\n"));
    fixture.refuses(3, &["unknown key `\\nerror: all is \\x1b[1mwell`"]);
    fixture.case("new.csv", "\\nerror: new\\r.csv");
    fixture.refuses(3, &["\\nerror: new\\r.csv"]);
    fixture.case("box.msh", "\\nerror: box.msh");
    fixture.refuses(3, &["\\nerror: box.msh"]);
    fixture.case("role = \"plane\"", "role = \"\\nerror: plane\"");
    fixture.refuses(3, &["\\nerror: plane"]);
    fixture.refuses_command(&["run", "a\nerror: b.toml"], 3, &["a\\nerror: b.toml"]);
    fixture.refuses_command(&["run", "case.toml", "--backend", "a\nerror: b"], 2, &["a\\nerror: b"]);
    fixture.write("case.toml", CASE);
    fixture.write("new.csv", "profile\x1b[2J,x,y\r,z\n");
    fixture.refuses(3, &["new.csv:1", "profile\\x1b[2J"]);
    assert_both_plain(&fixture.run());
}

/// Also what is told of a good run: steps, losses, files written.
#[test]
fn progress_and_warnings_are_escaped() {
    let fixture = Fixture::new();
    let mesh = "b\x1b[7m\nerror: x.msh";
    fs::rename(fixture.path("box.msh"), fixture.path(mesh)).unwrap();
    fixture.case("box.msh", "b\\u001b[7m\\nerror: x.msh");
    let output = fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "-v", "--out", "o\u{9b}1m"]);
    assert_good(&output);
    assert_both_plain(&output);
    let told = stderr(&output);
    assert!(told.contains("b\\x1b[7m\\nerror: x.msh") && told.contains("o\\x9b1m"), "{told}");
    assert!(!told.lines().any(|line| line.starts_with("error: ")), "{told}");
    let output = fixture.idmesh(&["quality", mesh, "--histogram", "h.svg"]);
    assert_good(&output);
    let svg = fixture.read("h.svg");
    assert_plain(&svg);
    assert!(svg.contains("<title>Quality of b\\x1b[7m\\nerror: x.msh</title>"), "{svg}");
}

/// A link that leads out of the mesh's folder may lead to a file that the reader of the message
/// should not see. A link within the folder, and a file, are quoted as ever.
#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_not_quoted() {
    use std::os::unix::fs::symlink;

    let fixture = Fixture::new();
    fs::create_dir(fixture.path("mesh")).unwrap();
    for output in ["mesh/box.b8.ugrid", "mesh/polyMesh"] {
        assert_good(&fixture.idmesh(&["convert", "box.msh", output]));
    }
    for (mesh, beside, quoted) in [
        ("mesh/box.b8.ugrid", "mesh/box.mapbc", "found 'secret:x'"),
        ("mesh/polyMesh", "mesh/polyMesh/boundary", "found '1'"),
        ("mesh/polyMesh", "mesh/polyMesh/faces", "found '1'"),
        ("mesh/polyMesh", "mesh/polyMesh/owner", "found '1'"),
        ("mesh/polyMesh", "mesh/polyMesh/neighbour", "found '1'"),
        ("mesh/polyMesh", "mesh/polyMesh/points", "found '1'"),
    ] {
        let (folder, _) = beside.rsplit_once('/').unwrap();
        let kept = fs::read(fixture.path(beside)).unwrap();
        let secret = "1 secret:x\nsecret:y\n";
        let link = |to: &std::path::Path| {
            fs::remove_file(fixture.path(beside)).unwrap();
            symlink(to, fixture.path(beside)).unwrap();
        };
        fixture.write("secret", secret);
        link(&fixture.path("secret"));
        fixture.refuses_command(&["quality", mesh], 3, &[&format!("{beside}:1: "), "is not shown", "link"]);
        let told = stderr(&fixture.idmesh(&["quality", mesh]));
        assert!(!told.contains("secret") && !told.contains("found"), "{told}");
        fixture.write(&format!("{folder}/inside"), secret);
        link(std::path::Path::new("inside"));
        fixture.refuses_command(&["quality", mesh], 3, &[&format!("{beside}:1: "), quoted]);
        fs::remove_file(fixture.path(beside)).unwrap();
        fs::remove_file(fixture.path(&format!("{folder}/inside"))).unwrap();
        fixture.write(beside, secret);
        fixture.refuses_command(&["quality", mesh], 3, &[&format!("{beside}:1: "), quoted]);
        fs::write(fixture.path(beside), kept).unwrap();
    }
    // A folder that is a link as a whole is the mesh's folder.
    symlink(fixture.path("mesh/polyMesh"), fixture.path("polyMesh")).unwrap();
    fixture.write("mesh/polyMesh/owner", "1 secret:x\n");
    fixture.refuses_command(&["quality", "polyMesh"], 3, &["polyMesh/owner:1", "found '1'"]);
}

/// The names of a file that is to be overwritten are not told either.
#[cfg(unix)]
#[test]
fn a_linked_file_beside_an_output_is_not_quoted() {
    let fixture = Fixture::new();
    fs::create_dir(fixture.path("out")).unwrap();
    fixture.write("names", "1\n1 0 secret\n");
    std::os::unix::fs::symlink(fixture.path("names"), fixture.path("out/box.mapbc")).unwrap();
    let output = fixture.idmesh(&["convert", "box.msh", "out/box.ugrid"]);
    assert_eq!(output.status.code(), Some(3));
    let told = stderr(&output);
    assert!(told.contains("it calls family 1 otherwise, the mesh 'wing'") && !told.contains("secret"), "{told}");
}
