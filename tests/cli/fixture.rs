//! A folder with a case in it, and the command run there.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

use crate::schema::assert_report;
use crate::wing_box::{WingBox, section};

pub const CASE: &str = r#"mesh = "box.msh"

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

/// A folder with a case, its mesh and its new profiles: the wing goes up by 0.02 at its root and
/// 0.05 at its tip.
pub struct Fixture {
    pub folder: TempDir,
}

impl Fixture {
    pub fn new() -> Self {
        let fixture = Self { folder: tempfile::tempdir().unwrap() };
        fixture.write("box.msh", &WingBox::new().gmsh());
        fixture.write("case.toml", CASE);
        fixture.write("new.csv", &profiles(&[(0, 0.3, 0.02), (1, 1.2, 0.05)]));
        fixture
    }

    /// A case with a folder of this number of designs, all alike.
    pub fn with_designs(number: usize) -> Self {
        let fixture = Self::new();
        fs::create_dir(fixture.path("designs")).unwrap();
        for index in 0..number {
            fs::copy(fixture.path("new.csv"), fixture.path(&format!("designs/{index}.csv"))).unwrap();
        }
        fixture
    }

    /// A case with a folder of designs whose wings go up by these at their tips, and with old
    /// profiles, so that every run pairs the same.
    pub fn with_raised_designs(raised: &[(&str, f64)]) -> Self {
        let fixture = Self::new();
        fixture.case("new = \"new.csv\"", "new = \"new.csv\"\nold = \"old.csv\"");
        fixture.write("old.csv", &profiles(&[(0, 0.3, 0.0), (1, 1.2, 0.0)]));
        fs::create_dir(fixture.path("designs")).unwrap();
        raised.iter().for_each(|&(name, by)| fixture.raised_design(name, by));
        fixture
    }

    /// A design whose wing goes up by this at its tip.
    pub fn raised_design(&self, name: &str, by: f64) {
        self.write(&format!("designs/{name}.csv"), &profiles(&[(0, 0.3, 0.02), (1, 1.2, by)]));
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    pub fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Changes the case.
    pub fn case(&self, from: &str, to: &str) {
        assert!(CASE.contains(from), "{from} is not in the case");
        self.write("case.toml", &CASE.replacen(from, to, 1));
    }

    /// Changes the mesh.
    pub fn mesh(&self, change: impl FnOnce(&mut WingBox)) {
        let mut mesh = WingBox::new();
        change(&mut mesh);
        self.write("box.msh", &mesh.gmsh());
    }

    /// Runs the command. Every report that it writes is checked against the schema.
    #[track_caller]
    pub fn idmesh(&self, arguments: &[&str]) -> Output {
        let output = command(self.folder.path(), arguments).output().unwrap();
        if let (["run" | "batch", ..], Some(at)) = (arguments, arguments.iter().position(|&word| word == "--json")) {
            let text = match arguments[at + 1] {
                "-" => output.stdout.clone(),
                path if output.status.code() != Some(3) => fs::read(self.path(path)).unwrap_or_default(),
                _ => Vec::new(),
            };
            let reports = serde_json::Deserializer::from_slice(&text).into_iter::<serde_json::Value>();
            reports.for_each(|report| assert_report(&report.unwrap()));
        }
        output
    }

    /// Runs the case on the CPU.
    pub fn run(&self) -> Output {
        self.idmesh(&["run", "case.toml", "--backend", "cpu"])
    }

    /// Runs the case, expects one error with these words and this exit code, and no file more
    /// or less.
    #[track_caller]
    pub fn refuses(&self, exit: i32, words: &[&str]) {
        self.refuses_command(&["run", "case.toml", "--backend", "cpu"], exit, words);
    }

    #[track_caller]
    pub fn refuses_command(&self, arguments: &[&str], exit: i32, words: &[&str]) {
        // A run that is refused may take an earlier result away.
        let kept = || self.files().into_iter().filter(|name| !name.starts_with("moved.")).collect::<Vec<_>>();
        let (before, all) = (kept(), self.files());
        let output = self.idmesh(arguments);
        let errors = stderr(&output);
        assert_eq!(output.status.code(), Some(exit), "{errors}");
        let lines: Vec<_> = errors.lines().filter(|line| line.starts_with("error: ")).collect();
        assert_eq!(lines.len(), 1, "{errors}");
        // A message of several faults has each on a line of its own.
        let more = errors.lines().skip_while(|line| *line != lines[0]).skip(1);
        let message = std::iter::once(lines[0]).chain(more.take_while(|line| line.starts_with("  ")));
        let message = message.collect::<Vec<_>>().join("\n");
        for word in words {
            assert!(message.contains(word), "\"{word}\" is not in: {message}");
        }
        assert!(!errors.contains("panicked"), "{errors}");
        assert_eq!(kept(), before, "files were left behind or lost");
        assert!(self.files().iter().all(|name| all.contains(name)), "{:?} after {all:?}", self.files());
    }
}

pub fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_idmesh"));
    command.current_dir(folder).args(arguments).env("NODEVICE_SELECT", "1");
    command
}

/// A machine without any Vulkan driver.
pub fn without_gpu(command: &mut Command) -> &mut Command {
    command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent")
}

pub fn profiles(sections: &[(i64, f64, f64)]) -> String {
    let rows = sections.iter().map(|&(number, y, dz)| section(number, y, 0.0, dz));
    std::iter::once("profile,x,y,z\n".to_owned()).chain(rows).collect()
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[track_caller]
pub fn assert_good(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
}
