//! The command line: what bad input is told, which exit code it gets, and that it leaves no file behind.

#[path = "common/wing_box.rs"]
mod wing_box;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;
use wing_box::{WingBox, section};

const CASE: &str = r#"mesh = "box.msh"

[profiles.wing]
new = "new.csv"

[family.wing]
role = "wing"
[family.trailing_edge]
role = "trailing-edge"
[family.wingtip]
role = "wingtip"
coefficient = 0.5
[family.symmetry]
role = "plane"
[family.farfield]
role = "fixed"

[solver]
tolerance = 1e-4

[output]
mesh = "moved.msh"
"#;

/// A folder with a case, its mesh and its new profiles: the wing goes up by 0.02 at its root and 0.05 at its tip.
struct Fixture {
    folder: TempDir,
}

impl Fixture {
    fn new() -> Self {
        let fixture = Self { folder: tempfile::tempdir().unwrap() };
        fixture.write("box.msh", &WingBox::new().gmsh());
        fixture.write("case.toml", CASE);
        fixture.write("new.csv", &profiles(&[(0, 0.3, 0.02), (1, 1.2, 0.05)]));
        fixture
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Changes the case.
    fn case(&self, from: &str, to: &str) {
        assert!(CASE.contains(from), "{from} is not in the case");
        self.write("case.toml", &CASE.replacen(from, to, 1));
    }

    /// Changes the mesh.
    fn mesh(&self, change: impl FnOnce(&mut WingBox)) {
        let mut mesh = WingBox::new();
        change(&mut mesh);
        self.write("box.msh", &mesh.gmsh());
    }

    fn idmesh(&self, arguments: &[&str]) -> Output {
        command(self.folder.path(), arguments).output().unwrap()
    }

    /// Runs the case on the CPU.
    fn run(&self) -> Output {
        self.idmesh(&["run", "case.toml", "--backend", "cpu"])
    }

    /// Runs the case, expects one error line with these words and this exit code, and no file more or less.
    #[track_caller]
    fn refuses(&self, exit: i32, words: &[&str]) {
        self.refuses_command(&["run", "case.toml", "--backend", "cpu"], exit, words);
    }

    #[track_caller]
    fn refuses_command(&self, arguments: &[&str], exit: i32, words: &[&str]) {
        let before = self.files();
        let output = self.idmesh(arguments);
        let errors = stderr(&output);
        assert_eq!(output.status.code(), Some(exit), "{errors}");
        let lines: Vec<_> = errors.lines().filter(|line| line.starts_with("error: ")).collect();
        assert_eq!(lines.len(), 1, "{errors}");
        for word in words {
            assert!(lines[0].contains(word), "\"{word}\" is not in: {}", lines[0]);
        }
        assert!(!errors.contains("panicked"), "{errors}");
        assert_eq!(self.files(), before, "files were left behind");
    }
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_idmesh"));
    command.current_dir(folder).args(arguments).env("NODEVICE_SELECT", "1");
    command
}

/// A machine without any Vulkan driver.
fn without_gpu(command: &mut Command) -> &mut Command {
    command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent")
}

fn profiles(sections: &[(i64, f64, f64)]) -> String {
    let rows = sections.iter().map(|&(number, y, dz)| section(number, y, 0.0, dz));
    std::iter::once("profile,x,y,z\n".to_owned()).chain(rows).collect()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[track_caller]
fn assert_good(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
}

// What works.

#[test]
fn a_good_case_is_moved() {
    let fixture = Fixture::new();
    let output = fixture.run();
    assert_good(&output);
    let table = stdout(&output);
    let first: Vec<_> = table.lines().map(|line| line.split_whitespace().next().unwrap()).collect();
    assert_eq!(first, ["stage", "Original", "Deformed", "Corrected", "Final"]);
    assert_eq!(fixture.files(), ["box.msh", "case.toml", "moved.msh", "new.csv"]);
    let moved = fixture.read("moved.msh");
    assert_eq!(moved.lines().count(), fixture.read("box.msh").lines().count());
    assert_ne!(moved, fixture.read("box.msh"));
}

#[test]
fn standard_output_holds_only_the_json() {
    let fixture = Fixture::new();
    let output = fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--json", "-"]);
    assert_good(&output);
    let report: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let keys: Vec<_> = report.as_object().unwrap().keys().map(String::as_str).collect();
    assert_eq!(keys, ["backend", "case", "families", "idmesh", "mesh", "profiles", "seconds", "solver", "stages"]);
    assert_eq!(report["backend"]["kind"], "cpu");
    assert_eq!(report["stages"].as_array().unwrap().len(), 4);
    assert_eq!(report["stages"][3]["inverted"], 0);
}

#[test]
fn outputs_go_into_a_new_folder() {
    let fixture = Fixture::new();
    fixture.case("mesh = \"moved.msh\"", "mesh = [\"moved.msh\", \"moved.vtu\"]\nhistogram = \"beta.svg\"");
    assert_good(&fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "--out", "a/b", "--json", "report.json"]));
    for name in ["a/b/moved.msh", "a/b/moved.vtu", "a/b/beta.svg", "report.json"] {
        assert!(fixture.path(name).is_file(), "{name} is missing");
    }
    assert!(!fixture.path("moved.msh").exists());
}

#[test]
fn quiet_says_nothing() {
    let fixture = Fixture::new();
    let output = fixture.idmesh(&["-q", "run", "case.toml", "--backend", "cpu"]);
    assert_good(&output);
    assert_eq!(stderr(&output), "");
    let output = fixture.idmesh(&["run", "case.toml", "--backend", "cpu", "-v"]);
    assert!(stderr(&output).contains("volume"), "{}", stderr(&output));
}

/// A wing that is told to move by (0.01, 0, 0.02) does, to the last digit.
#[test]
fn prescribed_displacements_are_followed() {
    let fixture = Fixture::new();
    let mesh = WingBox::new();
    let wing = mesh.family_vertices(0);
    let rows: String = wing
        .iter()
        .map(|&vertex| mesh.vertices[vertex])
        .map(|[x, y, z]| format!("{x},{y},{z},0.01,0,0.02\n"))
        .collect();
    fixture.write("wing.csv", &rows);
    let case = CASE.replace("[profiles.wing]\nnew = \"new.csv\"\n", "");
    let case = case.replace("role = \"wing\"\n", "role = \"prescribed\"\ndisplacement = \"wing.csv\"\n");
    fixture.write("case.toml", &case);
    assert_good(&fixture.run());
    let moved = fixture.read("moved.msh");
    let nodes: Vec<&str> = moved.lines().skip_while(|line| *line != "$Nodes").skip(2).collect();
    for vertex in wing {
        let found: Vec<f64> = nodes[vertex].split_whitespace().skip(1).map(|text| text.parse().unwrap()).collect();
        let [x, y, z] = mesh.vertices[vertex];
        assert_eq!(found, [x + 0.01, y, z + 0.02]);
    }

    let half: String = rows.lines().skip(1).map(|line| format!("{line}\n")).collect();
    fixture.write("wing.csv", &half);
    fs::remove_file(fixture.path("moved.msh")).unwrap();
    fixture.refuses(3, &["wing.csv: 1 of the family's", "vertices have no row"]);
}

// Results that are not good.

#[test]
fn too_few_sweeps_are_not_convergence() {
    let fixture = Fixture::new();
    fixture.case("tolerance = 1e-4", "method = \"jacobi\"\ntolerance = 1e-9\nmax_sweeps = 2");
    let output = fixture.run();
    assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
    assert!(stderr(&output).contains("error: not converged"), "{}", stderr(&output));
}

#[test]
fn inverted_meshes_get_another_name() {
    let fixture = Fixture::new();
    // Up through the top of the box.
    fixture.write("new.csv", &profiles(&[(0, 0.3, 3.0), (1, 1.2, 3.0)]));
    fixture.write("moved.msh", "an older result");
    let output = fixture.run();
    assert_eq!(output.status.code(), Some(5), "{}", stderr(&output));
    assert!(stderr(&output).contains("inverted; the mesh is in moved.invalid.msh"), "{}", stderr(&output));
    assert!(fixture.path("moved.invalid.msh").is_file());
    assert_eq!(fixture.read("moved.msh"), "an older result");
}

// Bad meshes.

#[test]
fn meshes_that_cannot_be_read() {
    let fixture = Fixture::new();
    let whole = fixture.read("box.msh");
    fixture.write("box.msh", &whole[..whole.len() / 2]);
    fixture.refuses(3, &["box.msh:"]);
    fixture.write("box.msh", "");
    fixture.refuses(3, &["box.msh", "empty"]);
    fs::remove_file(fixture.path("box.msh")).unwrap();
    fixture.refuses(3, &["box.msh"]);
}

#[test]
fn coordinates_that_are_no_numbers() {
    let fixture = Fixture::new();
    fixture.mesh(|mesh| mesh.vertices[40][1] = f64::NAN);
    fixture.refuses(3, &["box.msh:", "vertex 41", "finite"]);
}

#[test]
fn tets_that_name_no_vertex() {
    let fixture = Fixture::new();
    fixture.mesh(|mesh| mesh.tets[7][2] = mesh.vertices.len() + 10);
    fixture.refuses(3, &["box.msh:", "tet", "names vertex"]);
}

#[test]
fn inverted_tets_in_the_input() {
    let fixture = Fixture::new();
    fixture.mesh(|mesh| mesh.tets[7].swap(0, 1));
    fixture.refuses(3, &["box.msh: 1 of", "inverted", "tet 7"]);
}

#[test]
fn doubled_tets() {
    let fixture = Fixture::new();
    fixture.mesh(|mesh| mesh.tets.push(mesh.tets[7]));
    fixture.refuses(3, &["box.msh", "tets"]);
}

// Bad cases.

#[test]
fn unknown_keys_name_the_nearest() {
    let fixture = Fixture::new();
    fixture.case("tolerance", "tolerence");
    fixture.refuses(3, &["case.toml:19:1: unknown key `tolerence` in [solver]; did you mean `tolerance`?"]);
}

#[test]
fn families_and_tables_must_agree() {
    let fixture = Fixture::new();
    fixture.case("[family.symmetry]\nrole = \"plane\"\n", "");
    fixture.refuses(3, &["case.toml", "no [family] table for `symmetry`"]);
    fixture.case("[family.symmetry]", "[family.pylon]\nrole = \"fixed\"\n[family.symmetry]");
    fixture.refuses(3, &["no family in the mesh for the table of `pylon`", "the mesh has `wing`, `trailing_edge`"]);
}

#[test]
fn coefficients_outside_their_range() {
    let fixture = Fixture::new();
    for text in ["1.5", "-0.1", "nan"] {
        fixture.case("0.5", text);
        fixture.refuses(3, &["case.toml:12:15: `coefficient` is", "expected 0 (rigid) to 1"]);
    }
}

#[test]
fn profiles_that_cannot_be_used() {
    let fixture = Fixture::new();
    fixture.write("new.csv", "profile,x,y,z\n0,1,0.3,0\n0,1.75,0.3,0\n");
    fixture.refuses(3, &["new.csv", "expected at least 3"]);
    let one_off = section(0, 0.3, 0.0, 0.0).replacen("0,1,0.3,0\n", "0,1,0.4,0\n", 1);
    fixture.write("new.csv", &format!("profile,x,y,z\n{one_off}"));
    fixture.refuses(3, &["new.csv", "profile 0 is not plane"]);
    fixture.write("new.csv", &profiles(&[(0, 0.3, 0.0), (1, 1.7, 0.0)]));
    fixture.refuses(3, &["new.csv", "misses the wing"]);
    fixture.write("new.csv", "profile,x,y,z\n0,1,0.3,zero\n");
    fixture.refuses(3, &["new.csv:2:"]);
    fs::remove_file(fixture.path("new.csv")).unwrap();
    fixture.refuses(3, &["new.csv"]);
}

#[test]
fn old_and_new_profiles_must_pair() {
    let fixture = Fixture::new();
    fixture.case("new = \"new.csv\"", "new = \"new.csv\"\nold = \"old.csv\"");
    fixture.write("old.csv", &profiles(&[(0, 0.3, 0.0), (2, 1.2, 0.0)]));
    fixture.refuses(3, &["same numbers", "[0, 2]", "[0, 1]"]);
}

// Outputs that cannot be written.

#[test]
fn outputs_are_checked_before_anything_is_computed() {
    let fixture = Fixture::new();
    fixture.write("file", "");
    fixture.refuses_command(&["run", "case.toml", "--backend", "cpu", "--out", "file"], 3, &["cannot write file"]);
    fixture.refuses_command(&["run", "case.toml", "--backend", "cpu", "--out", "file/a"], 3, &["cannot write file"]);
    fixture.refuses_command(&["run", "case.toml", "--json", "no/report.json"], 3, &["cannot write no/report.json"]);
    fixture.case("\"moved.msh\"", "\"file/moved.msh\"");
    fixture.refuses(3, &["cannot write file"]);
    fixture.case("\"moved.msh\"", "\"moved.stl\"");
    fixture.refuses(3, &["moved.stl", "unknown mesh format"]);
    fixture.case("\"moved.msh\"", "\"new.csv\"");
    fixture.refuses(3, &["new.csv would overwrite the input"]);
}

/// Bad input is found after the folder is made; then the folder goes away again.
#[test]
fn a_refused_run_leaves_no_folder() {
    let fixture = Fixture::new();
    fixture.mesh(|mesh| mesh.tets[7].swap(0, 1));
    fixture.refuses_command(&["run", "case.toml", "--backend", "cpu", "--out", "a/b"], 3, &["inverted"]);
}

#[test]
fn wrong_usage() {
    let fixture = Fixture::new();
    for arguments in [
        &[][..],
        &["run"],
        &["run", "case.toml", "--backend", "cuda"],
        &["run", "case.toml", "-q", "-v"],
        &["compare", "a", "b", "c"],
        &["compare", "a", "b", "--tolerance", "nan"],
        &["cut", "box.msh", "--family", "wing", "--out", "o.csv"],
        &["cut", "box.msh", "--family", "wing", "--out", "o.csv", "--planes", "2", "--at", "y=1"],
        &["cut", "box.msh", "--family", "wing", "--out", "o.csv", "--at", "1.0"],
    ] {
        let output = fixture.idmesh(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
    }
}

// GPUs.

#[test]
fn no_gpu_is_an_error_only_where_one_is_asked_for() {
    let fixture = Fixture::new();
    let run = |backend: &str| {
        let mut command = command(fixture.folder.path(), &["run", "case.toml", "--backend", backend]);
        without_gpu(&mut command).output().unwrap()
    };
    let before = fixture.files();
    let output = run("gpu");
    assert_eq!(output.status.code(), Some(6), "{}", stderr(&output));
    assert!(stderr(&output).contains("error: no usable GPU"), "{}", stderr(&output));
    assert_eq!(fixture.files(), before);
    let output = run("auto");
    assert_good(&output);
    assert!(stderr(&output).contains("computing on the CPU"), "{}", stderr(&output));

    let mut adapters = command(fixture.folder.path(), &["adapters"]);
    let output = without_gpu(&mut adapters).output().unwrap();
    assert_good(&output);
    assert_eq!(stdout(&output), "no adapters; auto computes on the CPU\n");
}

fn gpu_tests_are_off() -> bool {
    let off = !cfg!(feature = "gpu") || std::env::var("IDMESH_TEST_GPU").is_ok_and(|value| value == "off");
    if off {
        eprintln!("skipped: no GPU tests are wanted (IDMESH_TEST_GPU=off, or built without the gpu feature)");
    }
    off
}

#[test]
fn cpu_and_gpu_agree() {
    if gpu_tests_are_off() {
        return;
    }
    let fixture = Fixture::new();
    let output = fixture.idmesh(&["compare", "case.toml", "--tolerance", "1e-3", "--json", "-"]);
    assert_good(&output);
    let found: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(found["within_tolerance"], true);
    assert!(found["seconds"]["gpu"].as_f64().unwrap() > 0.0);
    // In single precision the two are never the same: a difference of zero would mean that one was compared with itself.
    assert!(found["max_difference"].as_f64().unwrap() > 0.0);
    let output = fixture.idmesh(&["adapters"]);
    assert!(stdout(&output).lines().count() >= 2, "{}", stdout(&output));
}

// The other commands.

#[test]
fn quality_counts_and_measures() {
    let fixture = Fixture::new();
    let mesh = WingBox::new();
    let output = fixture.idmesh(&["quality", "box.msh", "--json", "-", "--histogram", "beta.svg"]);
    assert_good(&output);
    let figures: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(figures["mesh"]["vertices"], mesh.vertices.len());
    assert_eq!(figures["mesh"]["tets"], mesh.tets.len());
    assert_eq!(figures["mesh"]["families"]["wing"]["vertices"], mesh.family_vertices(0).len());
    assert_eq!(figures["inverted"], 0);
    // Every tet is a sixth of a cell, its longest edge the cell's diagonal.
    let cell = [0.25f64, 0.375, 0.25];
    let diagonal = cell.map(|length| length * length).iter().sum::<f64>().sqrt();
    let beta = cell.iter().product::<f64>() / 6.0 / diagonal.powi(3);
    for key in ["beta_min", "beta_max", "beta_mean"] {
        assert!((figures[key].as_f64().unwrap() - beta).abs() < 1e-12, "{key}");
    }
    assert!(fixture.read("beta.svg").starts_with("<svg"));
    assert!(stdout(&fixture.idmesh(&["quality", "box.msh"])).contains("beta mean"));

    fixture.mesh(|mesh| mesh.tets[7].swap(0, 1));
    let text = stdout(&fixture.idmesh(&["quality", "box.msh"]));
    assert!(text.lines().any(|line| line.split_whitespace().eq(["inverted", "1"])), "{text}");
    fixture.refuses_command(&["quality", "nothing.msh"], 3, &["nothing.msh"]);
}

/// `idmesh quality ... | head -0`: the reader is gone before the first word.
#[test]
fn a_closed_pipe_is_no_error() {
    let fixture = Fixture::new();
    let mut child = command(fixture.folder.path(), &["quality", "box.msh"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_good(&output);
    assert_eq!(stderr(&output), "");
}

#[test]
fn cut_profiles_lie_on_their_planes() {
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&["cut", "box.msh", "--family", "wing", "--at", "y=0.3,y=1.2", "--out", "old.csv"]));
    let rows: Vec<Vec<f64>> = fixture
        .read("old.csv")
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|field| field.parse().unwrap()).collect())
        .collect();
    for (profile, y) in [(0.0, 0.3), (1.0, 1.2)] {
        let points: Vec<_> = rows.iter().filter(|row| row[0] == profile).collect();
        assert!(points.len() >= 7, "{} points", points.len());
        assert!(points.iter().all(|point| (point[2] - y).abs() < 1e-12));
        // From the lower to the upper side of the trailing edge.
        assert_eq!((points[0][1], points[0][3]), (1.75, -0.25));
        assert_eq!((points[points.len() - 1][1], points[points.len() - 1][3]), (1.75, 0.25));
    }
    assert_good(&fixture.idmesh(&["cut", "box.msh", "--family", "wing", "--planes", "3", "--out", "three.csv"]));
    assert_eq!(fixture.read("three.csv").lines().last().unwrap().split(',').next(), Some("2"));

    let cut =
        |family: &'static str, at: &'static str| ["cut", "box.msh", "--family", family, "--at", at, "--out", "o.csv"];
    fixture.refuses_command(&cut("wings", "y=1"), 3, &["no family `wings`", "did you mean `wing`?"]);
    fixture.refuses_command(&cut("wing", "y=1.7"), 3, &["misses the wing"]);
}

#[test]
fn meshes_are_compared_vertex_by_vertex() {
    let fixture = Fixture::new();
    fixture.write("same.msh", &fixture.read("box.msh"));
    let compare = |name: &str| fixture.idmesh(&["compare", "box.msh", name]);
    assert_good(&compare("same.msh"));
    let mut other = WingBox::new();
    other.vertices[40][2] += 0.01;
    fixture.write("other.msh", &other.gmsh());
    let output = compare("other.msh");
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).lines().any(|line| line.starts_with("worst vertex") && line.contains(" 40 at ")));
    assert!(stderr(&output).contains("error: out of tolerance"));
    assert_good(&fixture.idmesh(&["compare", "box.msh", "other.msh", "--tolerance", "0.1"]));

    other.vertices.push([0.0; 3]);
    fixture.write("more.msh", &other.gmsh());
    let output = compare("more.msh");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("nothing to compare"), "{}", stderr(&output));
    fixture.refuses_command(&["compare", "box.msh", "nothing.msh"], 3, &["nothing.msh"]);
}
