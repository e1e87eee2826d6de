//! The project as a whole: what a published package holds, and documents that name what exists.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use idmesh::formats::FORMATS;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn text(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The value of a line `key = "value"` or `key: value`.
fn value(text: &str, key: &str) -> String {
    let line = text.lines().find_map(|line| line.strip_prefix(key)).unwrap_or_else(|| panic!("no `{key}`"));
    line.trim_matches(|letter: char| " =:\"".contains(letter)).to_owned()
}

/// The files of a package that exist here; Cargo makes the others.
fn packaged() -> Vec<String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["package", "--list", "--allow-dirty", "--offline", "--locked"])
        .current_dir(root())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let list = String::from_utf8(output.stdout).unwrap().replace('\\', "/");
    list.lines().filter(|name| root().join(name).is_file()).map(str::to_owned).collect()
}

fn is_mesh(name: &str) -> bool {
    let name = name.strip_suffix(".gz").unwrap_or(name);
    let extensions = FORMATS.iter().flat_map(|format| format.extensions);
    name.contains("polyMesh/") || extensions.chain(&["cgns"]).any(|extension| name.ends_with(&format!(".{extension}")))
}

/// Fails if the limit of the package is 1 MiB.
#[test]
fn a_package_holds_the_program_and_the_mesh_of_its_demonstration() {
    let packaged = packaged();
    let meshes: Vec<_> = packaged.iter().filter(|name| is_mesh(name)).collect();
    assert_eq!(meshes, ["src/session/init/wing-body.msh.gz"]);
    for folder in ["tests/", "benches/", "fuzz/", ".ci/", ".github/"] {
        assert!(!packaged.iter().any(|name| name.starts_with(folder)), "{folder} is in the package");
    }

    for name in
        ["Cargo.lock", "README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE", "src/main.rs", "src/lib.rs"]
    {
        assert!(packaged.iter().any(|other| other == name), "{name} is not in the package");
    }
    let mut shaders = fs::read_dir(root().join("kernels")).unwrap();
    assert!(shaders.all(|entry| {
        let name = format!("kernels/{}", entry.unwrap().file_name().into_string().unwrap());
        packaged.contains(&name)
    }));

    // Most of it is text, which is packed to a third.
    let bytes: u64 = packaged.iter().map(|name| fs::metadata(root().join(name)).unwrap().len()).sum();
    assert!(bytes < 5 << 20, "{bytes} bytes in the package");
}

#[test]
fn meshes_are_known_by_their_names() {
    let meshes = ["tests/data/round.msh.gz", "examples/a/b.lb8.ugrid", "a.cgns", "case/constant/polyMesh/points"];
    assert!(meshes.into_iter().all(is_mesh));
    assert!(!["README.md", "src/mesh/mod.rs", "src/formats/vtu.rs"].into_iter().any(is_mesh));
}

#[test]
fn the_citation_is_of_this_version_and_licence() {
    let citation = text("CITATION.cff");
    assert_eq!(value(&citation, "version"), env!("CARGO_PKG_VERSION"));
    for licence in env!("CARGO_PKG_LICENSE").split(" OR ") {
        assert!(citation.contains(&format!("\n  - {licence}\n")), "{licence}");
    }
}

/// The words between backticks.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

#[test]
fn contributing_names_files_and_tests_that_exist() {
    let contributing = text("CONTRIBUTING.md");
    // Blocks of code have fences of three backticks, which would put the count out of step.
    let prose: String = contributing.split("```").step_by(2).collect();
    let mut code = String::new();
    for folder in ["src", "tests", "benches"] {
        rust(&root().join(folder), &mut code);
    }
    let (mut files, mut tests) = (0, 0);
    for word in quoted(&prose).filter(|word| !word.contains([' ', '*'])) {
        let top = word.split('/').next().unwrap();
        if word.contains('/') && ["src", "tests", "benches", "fuzz", ".ci", ".github", "kernels", "docs"].contains(&top)
        {
            assert!(root().join(word).exists(), "CONTRIBUTING.md names {word}, which is not there");
            files += 1;
        } else if word.matches('_').count() >= 2 && word.chars().all(|letter| letter.is_lowercase() || letter == '_') {
            assert!(code.contains(&format!("fn {word}()")), "CONTRIBUTING.md names {word}, which is no test");
            tests += 1;
        }
    }
    assert!(files > 10 && tests > 5, "{files} files and {tests} tests found in CONTRIBUTING.md");
}

fn rust(folder: &Path, code: &mut String) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust(&path, code);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            *code += &fs::read_to_string(path).unwrap();
        }
    }
}

/// Most columns of a line that holds a comment alone.
const COLUMNS: usize = 100;

/// Lines of comments that are too wide, `(number from 1, width)`. Tables, code blocks and lines
/// with a single word, such as an address, cannot be broken.
fn wide_comments(text: &str) -> Vec<(usize, usize)> {
    let mut in_code = false;
    let mut wide = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let Some(comment) = line.trim_start().strip_prefix("//") else {
            in_code = false;
            continue;
        };
        let comment = comment.trim_start_matches(['/', '!']).trim();
        if comment.starts_with("```") {
            in_code = !in_code;
        }
        let can_break = !in_code && !comment.starts_with('|') && comment.contains(' ');
        let width = line.chars().count();
        if can_break && width > COLUMNS {
            wide.push((number, width));
        }
    }
    wide
}

#[test]
fn comments_are_at_most_100_columns_wide() {
    let mut files = Vec::new();
    for folder in ["src", "python/src", "tests", "benches", "examples", "kernels"] {
        sources(&root().join(folder), &mut files);
    }
    let wide: Vec<String> = files
        .iter()
        .flat_map(|path| {
            let lines = wide_comments(&fs::read_to_string(path).unwrap());
            lines.into_iter().map(move |(number, width)| format!("{}:{number}: {width} columns", path.display()))
        })
        .collect();
    assert!(files.len() > 200, "{} files", files.len());
    assert!(wide.is_empty(), "{} comments are too wide:\n{}", wide.len(), wide.join("\n"));
}

#[test]
fn wide_comments_are_told_from_what_cannot_be_broken() {
    let words = "word ".repeat(30);
    let long = "a".repeat(120);
    let row = format!("| {words} |");
    let text = format!(
        "/// {words}\nlet x = 1; // {words}\n//! {row}\n/// ```\n/// {words}\n/// ```\n// {long}\n    // {words}\n// short"
    );
    let found: Vec<usize> = wide_comments(&text).into_iter().map(|(number, _)| number).collect();
    assert_eq!(found, [1, 8]);
    // 97 letters and the mark with its space are 100 columns, one more letter is too much.
    let exactly = |n: usize| format!("// a {}", "b".repeat(n - 2));
    assert!(wide_comments(&exactly(97)).is_empty());
    assert_eq!(wide_comments(&exactly(98)), [(1, 101)]);
}

/// The Rust and WGSL files below a folder.
fn sources(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs" || extension == "wgsl") {
            files.push(path);
        }
    }
}

/// The public modules that a file declares and does not hide.
fn shown_in(path: &Path) -> Vec<String> {
    let code = fs::read_to_string(path).unwrap();
    let lines: Vec<&str> = code.lines().collect();
    let is_hidden = |index: usize| index > 0 && lines[index - 1] == "#[doc(hidden)]";
    let declared = lines.iter().enumerate().filter(|&(index, _)| !is_hidden(index));
    let names = declared.filter_map(|(_, line)| line.strip_prefix("pub mod ")?.strip_suffix(';'));
    names.map(str::to_owned).collect()
}

/// Modules that `cargo doc` shows: those of the crate, and those within.
fn shown_modules() -> Vec<String> {
    let mut shown = shown_in(&root().join("src/lib.rs"));
    for module in shown.clone() {
        let path = root().join("src").join(&module).join("mod.rs");
        shown.extend(shown_in(&path).into_iter().map(|within| format!("{module}::{within}")));
    }
    shown
}

/// A reader of the documentation meets the rooms that a program needs, and no others.
#[test]
fn the_documentation_shows_a_dozen_modules() {
    let shown = shown_modules();
    assert!(shown.len() <= 12, "{shown:?}");
    for room in ["backend", "case", "families", "formats", "mesh", "mover", "profile", "report", "session"] {
        assert!(shown.iter().any(|module| module == room), "{room}: {shown:?}");
    }
}
