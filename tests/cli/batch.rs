//! `idmesh batch`: many designs give what as many runs give, and one that fails stops no other.

use std::fs;
use std::io::Write;
use std::process::Stdio;

use idmesh::formats;
use serde_json::Value;

use crate::fixture::*;
use crate::wing_box::*;

const BATCH: [&str; 6] = ["batch", "case.toml", "--backend", "cpu", "--designs", "designs"];

fn batch(fixture: &Fixture, more: &[&str]) -> std::process::Output {
    fixture.idmesh(&[&BATCH, more].concat())
}

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn names(lines: &[Value]) -> Vec<&str> {
    lines.iter().map(|line| line["design"].as_str().unwrap()).collect()
}

/// A line without what differs from run to run.
fn timeless(mut line: Value) -> Value {
    line.as_object_mut().unwrap().remove("seconds");
    line.as_object_mut().unwrap().remove("stage_seconds");
    line.as_object_mut().unwrap().remove("checksums");
    line.as_object_mut().unwrap().remove("reasons");
    for stage in line["stages"].as_array_mut().into_iter().flatten() {
        stage.as_object_mut().unwrap().remove("seconds");
    }
    line
}

fn listed(fixture: &Fixture, folder: &str) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(fixture.path(folder)).unwrap().map(|entry| entry.unwrap());
    let mut files: Vec<_> =
        entries.map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap())).collect();
    files.sort();
    files
}

#[test]
fn a_batch_gives_what_single_runs_give() {
    let fixture = Fixture::with_raised_designs(&[("c", 0.03), ("a", 0.06), ("b.2", -0.05)]);
    fixture.write("designs/notes.md", "no design");
    assert_good(&batch(&fixture, &["--out", "moved", "--json", "all.jsonl"]));
    let lines = lines(&fixture.read("all.jsonl"));
    assert_eq!(names(&lines), ["a", "b.2", "c"]);
    assert_eq!(listed(&fixture, "moved").len(), 3);
    for line in lines {
        let name = line["design"].as_str().unwrap().to_owned();
        fs::copy(fixture.path(&format!("designs/{name}.csv")), fixture.path("new.csv")).unwrap();
        let alone = fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "-"]);
        assert_good(&alone);
        assert!(fixture.read(&format!("moved/{name}.msh")) == fixture.read("moved.msh"), "{name}");
        let mut alone = timeless(serde_json::from_str(&stdout(&alone)).unwrap());
        alone["design"] = name.into();
        assert_eq!(timeless(line), alone);
    }
}

/// Designs that fail, that are refused and that are good, in groups that are not full, also by
/// several workers.
///
/// Fails if a design gets the outcome of another one of its group.
#[test]
fn designs_together_change_no_byte() {
    let fixture = Fixture::with_raised_designs(&[("a", 0.06), ("c", 0.05), ("e", 0.03), ("f", 0.0), ("g", -0.04)]);
    let case = fixture.read("case.toml").replace("[solver]", "[solver]\nmethod = \"multigrid\"");
    fixture.write("case.toml", &case);
    fixture.write("designs/b.csv", "profile,x,y,z\n0,1,zwei,3\n");
    fixture.write("designs/d.csv", &profiles(&[(0, 0.3, 3.0), (1, 1.2, 3.0)]));
    let sorted = |file: &str| {
        let mut lines: Vec<Value> = lines(&fixture.read(file)).into_iter().map(timeless).collect();
        lines.sort_by_key(|line| line["design"].to_string());
        lines
    };
    let moved = |more: &[&str], number: usize| {
        let (folder, file) = (format!("moved{number}"), format!("all{number}.jsonl"));
        let output = batch(&fixture, &[&["--out", &folder, "--json", &file], more].concat());
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        assert!(stderr(&output).contains("error: 2 of 7 designs failed"), "{}", stderr(&output));
        (listed(&fixture, &folder), sorted(&file))
    };
    let (files, reports) = moved(&[], 0);
    assert_eq!(reports.len(), 7);
    let ways: [&[&str]; 4] = [
        &["--together", "2"],
        &["--together", "4"],
        &["--together", "3", "--jobs", "2"],
        &["--together", "3", "--claim", "claims"],
    ];
    for (more, number) in ways.into_iter().zip(1..) {
        let (files_together, mut reports_together) = moved(more, number);
        assert!(files_together == files, "{more:?}");
        for (one, other) in reports_together.iter_mut().zip(&reports) {
            // Messages name the files of results, which are in another folder.
            let folder = format!("moved{number}/");
            let text = one.to_string().replace(&folder, "moved0/");
            assert_eq!(text, other.to_string(), "{more:?}");
        }
    }
    let output = batch(&fixture, &["--together", "5"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
}

#[test]
fn designs_come_from_a_list_and_lines_go_to_standard_output() {
    let fixture = Fixture::with_raised_designs(&[("a", 0.06), ("b", 0.03)]);
    fixture.write("list.txt", "# the second first\ndesigns/b.csv # well\n\n  designs/a.csv\n");
    let output =
        fixture.idmesh(&["batch", "case.toml", "--backend", "cpu", "--designs", "list.txt", "--json", "-", "-q"]);
    assert_good(&output);
    assert_eq!(names(&lines(&stdout(&output))), ["b", "a"]);
    assert_eq!(stderr(&output), "");
    assert!(fixture.path("a.msh").is_file() && fixture.path("b.msh").is_file());
    assert!(!fixture.path("moved.msh").exists());
}

/// One that cannot be read, one that ends with inverted tets, and one whose file is missing stop no
/// other.
#[test]
fn failed_designs_stop_no_other() {
    let fixture = Fixture::with_raised_designs(&[("a", 0.06), ("c", 0.05), ("e", 0.03)]);
    fixture.write("designs/b.csv", "profile,x,y,z\n0,1,zwei,3\n");
    fixture.write("designs/d.csv", &profiles(&[(0, 0.3, 3.0), (1, 1.2, 3.0)]));
    // Results of earlier designs of these names.
    fs::create_dir(fixture.path("moved")).unwrap();
    fixture.write("moved/b.msh", "an older result");
    fixture.write("moved/d.msh", "an older result");
    let output = batch(&fixture, &["--out", "moved", "--json", "all.jsonl"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("error: 2 of 5 designs failed"), "{}", stderr(&output));
    let all = lines(&fixture.read("all.jsonl"));
    assert_eq!(names(&all), ["a", "b", "c", "d", "e"]);
    let exits: Vec<_> = all.iter().map(|line| line["exit"].as_u64()).collect();
    assert_eq!(exits, [Some(0), Some(3), Some(0), Some(5), Some(0)]);
    let error = all[1]["error"]["message"].as_str().unwrap();
    assert!(error.contains("b.csv") && error.contains("zwei"), "{error}");
    assert!(all[3]["stages"][3]["inverted"].as_u64().unwrap() > 0);
    let files: Vec<_> = listed(&fixture, "moved").into_iter().map(|file| file.0).collect();
    assert_eq!(files, ["a.msh", "c.msh", "d.invalid.msh", "d.inverted.vtu", "e.msh"]);

    fixture.write("list.txt", "designs/a.csv\ngone.csv\n");
    let output = fixture.idmesh(&["batch", "case.toml", "--backend", "cpu", "--designs", "list.txt", "--json", "-"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(lines(&stdout(&output))[1]["error"]["message"].as_str().unwrap().contains("gone.csv"));
}

#[test]
fn a_stopped_batch_is_taken_up_again() {
    let fixture = Fixture::with_raised_designs(&[("a", 0.06), ("b", 0.05), ("c", 0.04), ("d", 0.03)]);
    assert_good(&batch(&fixture, &["--out", "whole", "--json", "whole.jsonl"]));
    let whole = fixture.read("whole.jsonl");
    let ends: Vec<usize> = whole.match_indices('\n').map(|(at, _)| at + 1).collect();
    // Torn at a line's first byte, in its middle, before its line end, and after it.
    for (cut, kept) in [(ends[1] + 1, 2), ((ends[1] + ends[2]) / 2, 2), (ends[2] - 1, 3), (ends[2], 3)] {
        fixture.write("part.jsonl", &whole[..cut]);
        fs::create_dir_all(fixture.path("part")).unwrap();
        for (index, (name, bytes)) in listed(&fixture, "whole").iter().enumerate() {
            // Those of lines that are torn or missing are not there, or are not what they should
            // be.
            match index {
                _ if index < kept => fs::write(fixture.path(&format!("part/{name}")), bytes).unwrap(),
                2 => fs::write(fixture.path(&format!("part/{name}")), "old").unwrap(),
                _ => drop(fs::remove_file(fixture.path(&format!("part/{name}")))),
            }
        }
        let output = batch(&fixture, &["--out", "part", "--json", "part.jsonl", "--resume"]);
        assert_good(&output);
        assert!(stderr(&output).contains(&format!("{kept} of 4 designs are done already")), "{}", stderr(&output));
        assert!(listed(&fixture, "part") == listed(&fixture, "whole"), "cut at {cut}");
        let part = fixture.read("part.jsonl");
        assert_eq!(part[..ends[kept - 1]], whole[..ends[kept - 1]]);
        let timeless = |text: &str| lines(text).into_iter().map(timeless).collect::<Vec<_>>();
        assert_eq!(timeless(&part), timeless(&whole));
    }
    // A lost mesh is made again, its line replaced.
    fs::remove_file(fixture.path("part/b.msh")).unwrap();
    assert_good(&batch(&fixture, &["--out", "part", "--json", "part.jsonl", "--resume"]));
    assert!(listed(&fixture, "part") == listed(&fixture, "whole"));
    assert_eq!(names(&lines(&fixture.read("part.jsonl"))), ["a", "c", "d", "b"]);
    // Without --resume all begins anew.
    assert_good(&batch(&fixture, &["--out", "part", "--json", "part.jsonl"]));
    assert_eq!(names(&lines(&fixture.read("part.jsonl"))), ["a", "b", "c", "d"]);
}

/// A design that failed is no good one the second time either: one that did not converge has its
/// mesh and is left out, one whose mesh is invalid or that cannot be read is done again, and each
/// keeps one line. Fails if `--resume` takes every design that has its line and its outputs for a
/// good one.
#[test]
fn a_failed_design_stays_failed_when_a_batch_is_taken_up_again() {
    let resume = ["--out", "moved", "--json", "all.jsonl", "--resume"];
    let exits = |fixture: &Fixture| -> Vec<(String, Option<u64>)> {
        let lines = lines(&fixture.read("all.jsonl"));
        lines.iter().map(|line| (line["design"].as_str().unwrap().to_owned(), line["exit"].as_u64())).collect()
    };
    let fixture = Fixture::with_raised_designs(&[("a", 0.06), ("b", 0.05)]);
    let case = CASE.replace("new = \"new.csv\"", "new = \"new.csv\"\nold = \"old.csv\"");
    fixture.write("case.toml", &case.replace("1e-4", "1e-9\nmethod = \"jacobi\"\nmax_sweeps = 2"));
    assert_eq!(batch(&fixture, &resume[..4]).status.code(), Some(1));
    assert_eq!(exits(&fixture), [("a".to_owned(), Some(4)), ("b".to_owned(), Some(4))]);
    assert!(fixture.path("moved/a.msh").is_file() && fixture.path("moved/b.msh").is_file());
    let output = batch(&fixture, &resume);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    for words in ["2 of 2 designs are done already", "error: 2 of 2 designs failed"] {
        assert!(stderr(&output).contains(words), "\"{words}\" is not in: {}", stderr(&output));
    }
    assert_eq!(exits(&fixture), [("a".to_owned(), Some(4)), ("b".to_owned(), Some(4))]);

    let fixture = Fixture::with_raised_designs(&[("a", 0.06)]);
    fixture.write("designs/b.csv", &profiles(&[(0, 0.3, 3.0), (1, 1.2, 3.0)]));
    fixture.write("designs/c.csv", "profile,x,y,z\n0,1,zwei,3\n");
    let failed = [("a".to_owned(), Some(0)), ("b".to_owned(), Some(5)), ("c".to_owned(), Some(3))];
    for arguments in [&resume[..4], &resume] {
        let output = batch(&fixture, arguments);
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        assert!(stderr(&output).contains("error: 2 of 3 designs failed"), "{}", stderr(&output));
        assert_eq!(exits(&fixture), failed);
    }
    // Mended, they are done, and their old lines are gone.
    fixture.write("designs/b.csv", &profiles(&[(0, 0.3, 0.02), (1, 1.2, 0.05)]));
    fixture.write("designs/c.csv", &profiles(&[(0, 0.3, 0.02), (1, 1.2, 0.04)]));
    assert_good(&batch(&fixture, &resume));
    assert_eq!(exits(&fixture), ["a", "b", "c"].map(|name| (name.to_owned(), Some(0))));
    assert!(fixture.path("moved/b.msh").is_file() && fixture.path("moved/c.msh").is_file());
}

#[test]
fn shards_share_the_designs() {
    let fixture = Fixture::with_raised_designs(&[("a", 0.06), ("b", 0.05), ("c", 0.04)]);
    for (shard, expected) in [("1/2", &["a", "c"][..]), ("2/2", &["b"]), ("4/4", &[])] {
        let output = batch(&fixture, &["--out", "moved", "--json", "-", "--shard", shard]);
        assert_good(&output);
        assert_eq!(names(&lines(&stdout(&output))), expected, "{shard}");
    }
    let moved: Vec<_> = listed(&fixture, "moved").into_iter().map(|file| file.0).collect();
    assert_eq!(moved, ["a.msh", "b.msh", "c.msh"]);
    for wrong in ["0/2", "3/2", "x"] {
        assert_eq!(batch(&fixture, &["--shard", wrong]).status.code(), Some(2), "{wrong}");
    }
}

#[test]
fn prescribed_displacements_are_designs_too() {
    let fixture = Fixture::with_raised_designs(&[]);
    let mesh = WingBox::new();
    let rows = |dz: f64| -> String {
        let wing = mesh.family_vertices(0).into_iter().map(|vertex| mesh.vertices[vertex]);
        wing.map(|[x, y, z]| format!("{x},{y},{z},0,0,{dz}\n")).collect()
    };
    fixture.write("wing.csv", &rows(0.0));
    fixture.write("designs/a.csv", &rows(0.02));
    let case = CASE.replace("[profiles.wing]\nnew = \"new.csv\"\n", "");
    let case = case.replace("role = \"wing\"\n", "role = \"prescribed\"\ndisplacement = \"wing.csv\"\n");
    fixture.write("case.toml", &case);
    assert_good(&batch(&fixture, &["--out", "moved"]));
    fixture.write("wing.csv", &rows(0.02));
    assert_good(&fixture.run());
    assert!(fixture.read("moved/a.msh") == fixture.read("moved.msh"));
}

/// The wing as an STL file, raised. Its coordinates have few digits, so STL holds them all.
fn raised_stl(mesh: &WingBox, dz: f64) -> String {
    let mut text = String::from("solid wing\n");
    for (face, _) in mesh.triangles.iter().filter(|(_, family)| *family == 0) {
        text += "facet normal 0 0 0\nouter loop\n";
        face.iter().map(|&vertex| mesh.vertices[vertex]).for_each(|[x, y, z]| {
            text += &format!("vertex {x} {y} {}\n", z + dz);
        });
        text += "endloop\nendfacet\n";
    }
    text + "endsolid wing\n"
}

/// Tables and surfaces of one displacement give one mesh. A surface that does not fit fails alone.
/// Results in the folder of the designs are no designs.
///
/// Fails if results in the folder are taken for designs, or a gzipped surface for none.
#[test]
fn displaced_surfaces_are_designs_too() {
    let fixture = Fixture::with_raised_designs(&[]);
    let mesh = WingBox::new();
    let dz = 0.03125;
    let rows = |separator: &str| -> String {
        let wing = mesh.family_vertices(0).into_iter().map(|vertex| mesh.vertices[vertex]);
        wing.map(|at| format!("{},0,0,{dz}\n", at.map(|value| value.to_string()).join(",")).replace(',', separator))
            .collect()
    };
    fixture.write("wing.stl", &raised_stl(&mesh, 0.0));
    fixture.write("designs/a.csv", &rows(","));
    fixture.write("designs/b.dat", &rows(" "));
    fixture.write("designs/c.stl", &raised_stl(&mesh, dz));
    let halved = raised_stl(&mesh, dz).replacen("facet normal 0 0 0\nouter loop\nvertex", "", 1);
    fixture.write("designs/d.stl", &halved);
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packed.write_all(raised_stl(&mesh, dz).as_bytes()).unwrap();
    fs::write(fixture.path("designs/e.v2.STL.gz"), packed.finish().unwrap()).unwrap();
    let case = CASE.replace("[profiles.wing]\nnew = \"new.csv\"\n", "");
    let case = case.replace("role = \"wing\"\n", "role = \"prescribed\"\ndisplacement = \"wing.stl\"\n");
    fixture.write("case.toml", &case);
    for _ in 0..2 {
        let output = batch(&fixture, &["--out", "designs", "--json", "-"]);
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        let all = lines(&stdout(&output));
        assert_eq!(names(&all), ["a", "b", "c", "d", "e.v2"]);
        assert_eq!(all.iter().map(|line| line["exit"].as_u64().unwrap()).collect::<Vec<_>>(), [0, 0, 0, 3, 0]);
        assert!(all[3]["error"]["message"].as_str().unwrap().contains("d.stl:"), "{}", all[3]);
    }
    let [a, b, c, e] = ["a", "b", "c", "e.v2"].map(|name| fixture.read(&format!("designs/{name}.msh")));
    assert!(a == b && b == c && c == e && a != fixture.read("box.msh"));
    assert!(!fixture.path("designs/d.msh").exists());
}

/// A surface that does not fit its family ends a run without a mesh.
#[test]
fn a_surface_that_does_not_fit_is_refused() {
    let fixture = Fixture::new();
    let mesh = WingBox::new();
    let case = CASE.replace("[profiles.wing]\nnew = \"new.csv\"\n", "");
    let case = case.replace("role = \"wing\"\n", "role = \"prescribed\"\ndisplacement = \"wing.stl\"\n");
    fixture.write("case.toml", &case);
    fixture.write("wing.stl", &raised_stl(&mesh, 0.03125));
    assert_good(&fixture.run());
    let whole = raised_stl(&mesh, 0.03125);
    let start = whole.rfind("facet normal").unwrap();
    fixture.write("wing.stl", &format!("{}endsolid\n", &whole[..start]));
    fixture.refuses(3, &["wing.stl: the surface has", "triangles, the family `wing` has"]);
    assert!(!fixture.path("moved.msh").exists());
    fixture.write("wing.ply", "ply");
    fixture.write("case.toml", &case.replace("wing.stl", "wing.ply"));
    fixture.refuses(3, &["wing.ply", "save it as .vtp, .vtu, .stl or .msh"]);
}

/// Airfoils without a place take that of the case's.
#[test]
fn airfoils_take_the_cases_place() {
    let fixture = Fixture::with_raised_designs(&[]);
    // Points close enough for a curve through them to keep to the box.
    let airfoil = |thickness: f64| {
        let side = |x: i32, y: f64| format!("{} {}\n", f64::from(x) / 24.0, y * thickness);
        let upper = (0..=24).rev().map(|x| side(x, 1.0));
        let front = (1..16).map(|i| side(0, 1.0 - f64::from(i) / 8.0));
        let lower = (0..=24).map(|x| side(x, -1.0));
        std::iter::once("box\n".to_owned()).chain(upper).chain(front).chain(lower).collect::<String>()
    };
    fixture.write("old.csv", &profiles(&[(0, 0.75, 0.0)]));
    fixture.write("new.dat", &airfoil(0.33));
    fixture.write("designs/a.dat", &airfoil(0.35));
    let place = "\n[profiles.wing.placement.\"new.dat\"]\nchord = 0.75\nposition = [1.0, 0.75, 0.0]\n";
    let case = CASE.replace("new = \"new.csv\"\n", &format!("new = \"new.dat\"\nold = \"old.csv\"\n{place}"));
    fixture.write("case.toml", &case);
    assert_good(&batch(&fixture, &["--out", "moved"]));
    fs::copy(fixture.path("designs/a.dat"), fixture.path("new.dat")).unwrap();
    assert_good(&fixture.run());
    assert!(fixture.read("moved/a.msh") == fixture.read("moved.msh"));
    assert_ne!(fixture.read("moved.msh"), fixture.read("box.msh"));
}

/// An airfoil with two places in the case is one with two places in a design. Where the case has
/// two airfoils, nothing says which of them a design replaces.
#[test]
fn airfoils_take_all_places_of_the_cases_one() {
    let fixture = Fixture::with_raised_designs(&[]);
    let side = |x: i32, y: f64| format!("{} {}\n", f64::from(x) / 24.0, y * 0.33);
    let front = (1..16).map(|i| side(0, 1.0 - f64::from(i) / 8.0));
    let upper = (0..=24).rev().map(|x| side(x, 1.0));
    let points: String = upper.chain(front).chain((0..=24).map(|x| side(x, -1.0))).collect();
    fixture.write("new.dat", &points);
    fixture.write("tip.dat", &points);
    fixture.write("designs/a.dat", &points);
    let place = |name: &str, y: f64, z: f64| {
        format!("[[profiles.wing.placement.\"{name}\"]]\nchord = 0.75\nposition = [1.0, {y}, {z}]\n")
    };
    let case = |new: &str, tip: &str| {
        let places = place("new.dat", 0.3, 0.02) + &place(tip, 1.2, 0.05);
        let text = CASE.replace("new = \"new.csv\"\n", &format!("new = {new}\nold = \"old.csv\"\n{places}"));
        fixture.write("case.toml", &text);
    };
    case("\"new.dat\"", "new.dat");
    let output = batch(&fixture, &["--out", "moved"]);
    assert_good(&output);
    // The worst beta of the result stands in the design's line.
    let line = stderr(&output).lines().find(|line| line.starts_with("a: moved in ")).unwrap().to_owned();
    let worst: f64 = line.split("worst beta ").nth(1).unwrap().parse().unwrap();
    assert!(worst > 0.0 && worst < 0.118, "{line}");
    assert_good(&fixture.run());
    assert!(fixture.read("moved/a.msh") == fixture.read("moved.msh"));
    // Each place counts: both sections as a table give the same.
    let table = |points: &str| -> String {
        let row = |number: i32, y: f64, z: f64| {
            let rows = points.lines().map(move |line| {
                let (x, up) = line.split_once(' ').unwrap();
                let [x, up]: [f64; 2] = [x, up].map(|number| number.parse().unwrap());
                format!("{number},{},{y},{}\n", 1.0 + 0.75 * x, z + 0.75 * up)
            });
            rows.collect::<String>()
        };
        format!("profile,x,y,z\n{}{}", row(0, 0.3, 0.02), row(1, 1.2, 0.05))
    };
    let by_places = formats::read(&fixture.path("moved.msh")).unwrap().mesh.vertices;
    fixture.write("new.csv", &table(&points));
    fixture.case("new = \"new.csv\"\n", "new = \"new.csv\"\nold = \"old.csv\"\n");
    assert_good(&fixture.run());
    let by_table = formats::read(&fixture.path("moved.msh")).unwrap().mesh.vertices;
    assert!(by_places.iter().zip(&by_table).all(|(a, b)| a.abs_diff_eq(*b, 1e-9)));

    case("[\"new.dat\", \"tip.dat\"]", "tip.dat");
    assert_good(&fixture.run());
    let output = batch(&fixture, &["--out", "moved"]);
    assert_eq!(output.status.code(), Some(1));
    for words in
        ["a.dat: one airfoil in place of the 2 files", "a design replaces all sections", "[[profiles.NAME.placement"]
    {
        assert!(stderr(&output).contains(words), "{words}: {}", stderr(&output));
    }
}

/// Names of designs that come through a pipe are those of the working folder.
#[cfg(unix)]
#[test]
fn a_list_from_a_pipe_names_files_of_the_working_folder() {
    let fixture = Fixture::with_raised_designs(&[("a", 0.06)]);
    for list in ["/dev/stdin", "/proc/self/fd/0"] {
        let arguments = ["batch", "case.toml", "--backend", "cpu", "--designs", list, "--out", "moved"];
        let mut child =
            command(fixture.folder.path(), &arguments).stdin(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(b"designs/a.csv\n").unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(0), "{list}");
        fs::remove_file(fixture.path("moved/a.msh")).unwrap();
    }
}

/// Old profiles cut at other planes than a design's would move the wing otherwise than in a run of
/// its own. Planes differ by more than the digits of a file.
///
/// Fails if `PLANES` is 1e-2 or 1e-12.
#[test]
fn designs_in_other_planes_need_old_profiles() {
    let fixture = Fixture::with_raised_designs(&[("a", 0.06)]);
    fixture.write("case.toml", CASE);
    fixture.write("designs/b.csv", &profiles(&[(0, 0.3, 0.02), (1, 1.1, 0.05)]));
    fixture.write("designs/c.csv", &profiles(&[(0, 0.3, 0.02), (1, 1.2 + 1e-8, 0.05)]));
    fixture.write("designs/d.csv", &profiles(&[(0, 0.3, 0.02), (1, 1.2 + 1e-4, 0.05)]));
    let output = batch(&fixture, &["--json", "-"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let all = lines(&stdout(&output));
    assert!(all[0]["error"].is_null() && all[0]["valid"] == true);
    assert!(all[1]["error"]["message"].as_str().unwrap().contains("profile 1 is up to 1.0e-1 away"), "{}", all[1]);
    assert!(all[2]["error"].is_null());
    assert!(all[3]["error"]["message"].as_str().unwrap().contains("profile 1 is up to 1.0e-4 away"), "{}", all[3]);
}

#[test]
fn bad_batches_write_nothing() {
    let refuses = |fixture: &Fixture, more: &[&str], words: &[&str]| {
        fixture.refuses_command(&[&BATCH, &["--out", "moved"][..], more].concat(), 3, words);
    };
    let fixture = Fixture::with_raised_designs(&[]);
    refuses(&fixture, &["--json", "all.jsonl"], &["designs: no designs"]);
    fixture.write("designs/a.csv", &profiles(&[(0, 0.3, 0.0), (1, 1.2, 0.0)]));
    refuses(&fixture, &["--json", "designs/a.csv"], &["would overwrite the input"]);
    refuses(&fixture, &["--json", "none/all.jsonl"], &["none/all.jsonl"]);
    refuses(&fixture, &["--json", "-", "--resume"], &["--resume needs"]);
    fixture.write("all.jsonl", "my notes\n");
    refuses(&fixture, &["--json", "all.jsonl", "--resume"], &["all.jsonl: line 1 is no report"]);
    assert_eq!(fixture.read("all.jsonl"), "my notes\n");
    fixture.write("designs/a.dat", "");
    refuses(&fixture, &[], &["a.csv", "a.dat", "both be named a"]);
    fs::remove_file(fixture.path("designs/a.dat")).unwrap();
    fixture.case("mesh = \"moved.msh\"", "mesh = [\"moved.msh\", \"other.msh\"]");
    refuses(&fixture, &[], &["is the name of two outputs"]);
    fixture.case("mesh = \"moved.msh\"", "mesh = \"polyMesh\"");
    refuses(&fixture, &[], &["polyMesh has no extension"]);
    fixture.case("[profiles.wing]\nnew = \"new.csv\"\n", "");
    let case = fixture.read("case.toml").replace("role = \"wing\"\n", "role = \"fixed\"\n");
    fixture.write("case.toml", &case);
    refuses(&fixture, &[], &["no table [profiles.NAME] and 0 prescribed families"]);
    fixture.case("role = \"plane\"", "role = \"flat\"");
    refuses(&fixture, &["--json", "new.jsonl"], &["flat"]);
}

/// Entries of a list that are no files fail alone, wherever they lead: also to the folder that
/// holds the file of reports and the results.
#[test]
fn odd_entries_of_a_list_stop_no_other() {
    let fixture = Fixture::with_designs(2);
    fs::create_dir(fixture.path("moved")).unwrap();
    let folder = fixture.folder.path().to_str().unwrap().to_owned();
    let odd = [".", "..", "moved", "./moved/..", "/", "designs/", &folder, "none.csv"];
    fixture.write("list.txt", &format!("designs/0.csv\n{}\ndesigns/1.csv\n", odd.join("\n")));
    let arguments =
        ["batch", "case.toml", "--backend", "cpu", "--designs", "list.txt", "--out", "moved", "--json", "all.jsonl"];
    for _ in 0..2 {
        let output = fixture.idmesh(&arguments);
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        assert!(stderr(&output).contains("error: 8 of 10 designs failed"), "{}", stderr(&output));
        let lines = lines(&fixture.read("all.jsonl"));
        assert_eq!(lines.len(), 10);
        let good: Vec<_> = lines.iter().filter(|line| line["exit"] == 0).map(|line| line["design"].clone()).collect();
        assert_eq!(good, ["0", "1"]);
        for line in lines.iter().filter(|line| line["exit"] != 0) {
            let message = line["error"]["message"].as_str().unwrap();
            assert!(message.contains("is a folder") || message.contains("none.csv"), "{message}");
        }
        assert_eq!(listed(&fixture, "moved").len(), 2);
    }
}
