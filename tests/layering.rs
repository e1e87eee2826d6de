//! The map of the code holds: imports point downward, no files of a room import each other in a
//! circle, only some modules touch files, only one names wgpu, nothing below the command line
//! prints.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The layers, lowest first. A module may import from lower layers and from its own, but never in a
/// circle.
const LAYERS: &[&[&str]] = &[
    &["geometry", "mesh", "kernels", "quality", "text", "constraint", "memory", "solver_measures"],
    &["formats", "projection", "springs", "profile", "backend"],
    &["relaxation", "smoothing"],
    &["families"],
    &["stage"],
    &["volume"],
    &["stages"],
    &["mover"],
    &["case", "report"],
    &["session"],
    &["cli"],
];

/// Modules that may touch files; the rest work on memory, so that they can be used from other
/// programs.
const FILES: &[&str] = &["formats", "case", "report", "session", "cli"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// Each source file: its path under `src`, its top module, and its code without comments, strings
/// and unit tests.
fn sources() -> Vec<(String, String, String)> {
    let mut files = Vec::new();
    rust_files(&root(), &mut files);
    let sources: Vec<_> = files
        .iter()
        .map(|path| {
            let name = path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/");
            let module = name.split('/').next().unwrap().trim_end_matches(".rs").to_owned();
            (name, module, code(&fs::read_to_string(path).unwrap()))
        })
        .collect();
    assert!(sources.len() > 10, "no sources found under {}", root().display());
    sources
}

/// Rust text without comments, without the contents of strings, and up to its unit tests.
fn code(text: &str) -> String {
    let mut code = String::new();
    let mut rest = text;
    while let Some(letter) = rest.chars().next() {
        let skipped = match letter {
            '/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            '/' if rest.starts_with("/*") => rest.find("*/").map_or(rest.len(), |end| end + 2),
            // Raw strings, whose quotes may stand inside, have as many #s before as after.
            'r' if raw_string(rest).is_some() && !code.ends_with(|c: char| c.is_alphanumeric() || c == '_') => {
                raw_string(rest).unwrap()
            }
            '"' => string(rest),
            // A character such as '"' is no string; a lifetime is no character.
            '\'' if rest.starts_with("'\"'") => 3,
            '\'' if rest.starts_with("'\\") => 2 + rest[2..].find('\'').map_or(0, |end| end.max(1) + 1),
            _ => {
                code.push(letter);
                rest = &rest[letter.len_utf8()..];
                continue;
            }
        };
        code.push(' ');
        rest = &rest[skipped..];
    }
    match code.find("#[cfg(test)]") {
        Some(tests) => code[..tests].to_owned(),
        None => code,
    }
}

/// Length of the string literal that a text begins with.
fn string(text: &str) -> usize {
    let mut escaped = false;
    for (at, letter) in text.char_indices().skip(1) {
        match letter {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return at + 1,
            _ => {}
        }
    }
    text.len()
}

/// Length of the raw string literal that a text begins with, if it does.
fn raw_string(text: &str) -> Option<usize> {
    let hashes = text[1..].chars().take_while(|&letter| letter == '#').count();
    let body = text[1 + hashes..].strip_prefix('"')?;
    let end = format!("\"{}", "#".repeat(hashes));
    Some(2 + hashes + body.find(&end)? + end.len())
}

/// The top modules that the code of a file names after `crate::`, or after as many `super::` as
/// lead there; grouped imports included.
///
/// - `name`: the file's path under `src`
fn imports(name: &str, code: &str) -> BTreeSet<String> {
    paths_below(name, code, &[]).into_iter().filter_map(|path| path.first().cloned()).collect()
}

/// The module that a file is, as the names that lead to it: `a/b.rs` is a::b, and `a/mod.rs` is a.
fn module_of(name: &str) -> Vec<&str> {
    name.trim_end_matches(".rs").split('/').filter(|part| *part != "mod").collect()
}

/// The paths that the code of a file names below a module in which it is, from `crate::` or through
/// `super::`.
///
/// - `name`: the file's path under `src`
/// - `module`: the names that lead from the crate to the module
fn paths_below(name: &str, code: &str, module: &[&str]) -> Vec<Vec<String>> {
    let from_crate = code.match_indices("crate::").flat_map(|(at, word)| paths(&code[at + word.len()..]));
    let below = |path: &Vec<String>| path.len() > module.len() && path[..module.len()] == *module;
    let mut found: Vec<_> = from_crate.filter(below).map(|path| path[module.len()..].to_vec()).collect();
    let up = "super::".repeat(module_of(name).len() - module.len());
    if !up.is_empty() {
        let through_super = code.match_indices(&up).filter(|(at, _)| !code[..*at].ends_with("super::"));
        let after = through_super.map(|(at, up)| &code[at + up.len()..]).filter(|after| !after.starts_with("super::"));
        found.extend(after.flat_map(paths));
    }
    found
}

/// The paths that a path with groups in braces stands for; an alias comes last.
fn paths(text: &str) -> Vec<Vec<String>> {
    if let Some(group) = text.strip_prefix('{') {
        return members(group).into_iter().flat_map(paths).collect();
    }
    let first = identifier(text);
    match text[first.len()..].strip_prefix("::") {
        Some(rest) => paths(rest).into_iter().map(|path| [vec![first.clone()], path].concat()).collect(),
        None => {
            let alias = text[first.len()..].strip_prefix(" as ").map(identifier);
            vec![std::iter::once(first).chain(alias).collect()]
        }
    }
}

/// What stands between commas in a group in braces, without its opening brace.
fn members(group: &str) -> Vec<&str> {
    let (mut depth, mut from, mut found) = (0, 0, Vec::new());
    for (at, letter) in group.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' if depth > 0 => depth -= 1,
            ',' | '}' if depth == 0 => {
                found.push(group[from..at].trim());
                from = at + 1;
                if letter == '}' {
                    break;
                }
            }
            _ => {}
        }
    }
    found.retain(|member| !member.is_empty());
    found
}

fn identifier(text: &str) -> String {
    text.chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect()
}

fn layer(module: &str) -> Option<usize> {
    LAYERS.iter().position(|layer| layer.contains(&module))
}

#[test]
fn every_module_has_a_layer() {
    for (name, module, _) in sources() {
        assert!(
            ["lib", "main"].contains(&module.as_str()) || layer(&module).is_some(),
            "src/{name}: module `{module}` is in no layer of this test and of ARCHITECTURE.md"
        );
    }
}

#[test]
fn imports_point_downward() {
    let mut wrong = Vec::new();
    for (name, module, code) in sources() {
        let Some(own) = layer(&module) else { continue };
        for import in imports(&name, &code) {
            if layer(&import).is_some_and(|other| other > own) {
                wrong.push(format!("src/{name}: `{module}` imports `{import}`, which is above it"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn imports_make_no_circle() {
    let mut graph: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (name, module, code) in sources().into_iter().filter(|(_, module, _)| layer(module).is_some()) {
        let known = imports(&name, &code).into_iter().filter(|import| layer(import).is_some() && *import != module);
        graph.entry(module.clone()).or_default().extend(known);
    }
    let graph = circles(graph);
    assert!(graph.is_empty(), "modules that import each other in a circle: {graph:?}");
}

/// What is left of a graph of imports when all is taken away that imports nothing any more: it goes
/// round.
fn circles(mut graph: BTreeMap<String, BTreeSet<String>>) -> BTreeMap<String, BTreeSet<String>> {
    while let Some(free) = graph.iter().find(|(_, imports)| imports.is_empty()).map(|(module, _)| module.clone()) {
        graph.remove(&free);
        for imports in graph.values_mut() {
            imports.remove(&free);
        }
    }
    graph
}

/// Within a room, a file or folder is a unit. What its `mod.rs` hands on from a unit counts as that
/// unit's; what it holds itself is not looked at.
#[test]
fn files_of_a_room_make_no_circle() {
    for room in LAYERS.concat().into_iter().filter(|room| root().join(room).is_dir()) {
        let files = sources().into_iter().filter(|(_, module, _)| module == room);
        let files: Vec<_> = files.map(|(name, _, code)| (name, code)).collect();
        let graph = circles(units(room, &files));
        assert!(graph.is_empty(), "src/{room}: files that import each other in a circle: {graph:?}");
    }
}

/// For each unit of a room the others that it imports.
///
/// - `files`: the room's files, by their paths under `src`, with their code
fn units(room: &str, files: &[(String, String)]) -> BTreeMap<String, BTreeSet<String>> {
    let unit = |name: &str| module_of(name).get(1).map(|unit| (*unit).to_owned());
    let mut graph: BTreeMap<String, BTreeSet<String>> =
        files.iter().filter_map(|(name, _)| Some((unit(name)?, BTreeSet::new()))).collect();
    let own = &files.iter().find(|(name, _)| unit(name).is_none()).expect("a room has a mod.rs").1;
    let uses = own.match_indices("use ").flat_map(|(at, word)| paths(&own[at + word.len()..]));
    let handed_on: BTreeMap<String, String> =
        uses.filter_map(|path| Some((path.last()?.clone(), path.first()?.clone()))).collect();
    for (name, code) in files {
        let Some(own) = unit(name) else { continue };
        for path in paths_below(name, code, &[room]) {
            let other = if graph.contains_key(&path[0]) { Some(&path[0]) } else { handed_on.get(&path[0]) };
            if let Some(other) = other.filter(|other| graph.contains_key(*other) && **other != own) {
                graph.get_mut(&own).unwrap().insert(other.clone());
            }
        }
    }
    graph
}

#[test]
fn only_some_modules_touch_files() {
    for (name, module, code) in sources() {
        // The CPU backend asks the system for the processor's name, `memory` for what is left of
        // it.
        if FILES.contains(&module.as_str()) || ["backend/cpu/mod.rs", "memory.rs"].contains(&name.as_str()) {
            continue;
        }
        for word in ["std::fs", "fs::", "File::", "OpenOptions", "tempfile"] {
            assert!(!code.contains(word), "src/{name} touches files: `{word}`");
        }
    }
}

#[test]
fn only_the_gpu_backend_names_wgpu() {
    for (name, _, code) in sources() {
        assert!(!code.contains("wgpu") || name.starts_with("backend/gpu/"), "src/{name} names wgpu");
    }
}

#[test]
fn nothing_below_the_command_line_prints() {
    for (name, module, code) in sources() {
        // The program tells that the memory is exhausted, where nothing else can.
        if module == "cli" || name == "main.rs" {
            continue;
        }
        for word in ["println!", "print!", "dbg!", "io::stdout", "io::stderr"] {
            assert!(!code.contains(word), "src/{name} prints: `{word}`");
        }
    }
}

/// The forms of an import that the reader does not see are not used.
fn unseen_forms(name: &str, code: &str) -> Vec<&'static str> {
    let mut found = Vec::new();
    for form in ["crate as ", "self as ", "extern crate", "crate::*", "super::*", "r#", "crate:: ", "super:: "] {
        if code.contains(form) {
            found.push(form);
        }
    }
    // A module within the file is one deeper, and needs one more to leave the room.
    let deepest = "super::".repeat(module_of(name).len() + 1);
    if code.contains(&deepest) {
        found.push("more `super` than the file is deep");
    }
    if name == "lib.rs" && code.lines().any(|line| line.starts_with("pub use ") && line != "pub use glam::DVec3;") {
        found.push("a name of a module handed on by the crate");
    }
    found
}

#[test]
fn no_import_is_hidden_from_the_reader() {
    for (name, _, code) in sources().into_iter().filter(|(name, ..)| !name.ends_with("/tests.rs")) {
        assert_eq!(unseen_forms(&name, &code), [""; 0], "src/{name}");
    }
    let seen = |name, code| unseen_forms(name, code).len();
    assert_eq!(seen("quality/mod.rs", "use crate as root; use root::report::RunReport;"), 1);
    assert_eq!(seen("quality/mod.rs", "use super::*;"), 1);
    assert_eq!(seen("constraint.rs", "mod x { pub use super::super::report::RunReport; }"), 1);
    assert_eq!(seen("lib.rs", "pub use report::StageTable;"), 1);
    assert_eq!(seen("quality/faults.rs", "use super::betas; use crate::mesh::TetMesh;"), 0);
}

/// The reader stops at the unit tests, so nothing stands behind them.
#[test]
fn unit_tests_stand_last() {
    let mut files = Vec::new();
    rust_files(&root(), &mut files);
    for path in files {
        let text = fs::read_to_string(&path).unwrap();
        let Some((_, tests)) = text.split_once("\n#[cfg(test)]\n") else { continue };
        let declared = tests.starts_with("mod tests;") && tests.lines().count() == 1;
        let held = tests.starts_with("mod tests {") && tests.matches("\n}").count() == 1 && tests.ends_with("\n}\n");
        assert!(declared || held, "{}: something stands behind the unit tests", path.display());
    }
}

/// The reader of imports does not look for a way up within a group, so there is none.
#[test]
fn no_group_goes_up() {
    for (name, _, code) in sources() {
        assert!(!goes_up_in_a_group(&code), "src/{name}: `super` within the braces of a path");
    }
    assert!(goes_up_in_a_group("use super::{betas, super::report};"));
    assert!(!goes_up_in_a_group("use super::{betas}; mod a { use super::b; }"));
}

fn goes_up_in_a_group(code: &str) -> bool {
    code.split("::{").skip(1).any(|group| group.split('}').next().is_some_and(|group| group.contains("super")))
}

/// The reader above must see what it looks for, and only that.
#[test]
fn the_code_reader_sees_imports() {
    let text = r##"
        //! Uses [`crate::cli`] only in words.
        use crate::mesh::{TetMesh, csr::Csr};
        use crate::{quality::{Statistics, betas}, report, stages::{Role,
            wing::Wings}};
        const TEXT: &str = "crate::formats and \" crate::case";
        const RAW: &str = r#"crate::kernels " crate::kernels"#;
        const QUOTE: char = '"';
        fn f<'a>(x: &'a crate::springs::Springs) {}
        #[cfg(test)]
        mod tests { use crate::mover::Mover; }
    "##;
    let found: Vec<_> = imports("profile/files/csv.rs", &code(text)).into_iter().collect();
    assert_eq!(found, ["mesh", "quality", "report", "springs", "stages"]);
    // Up through `super`, by a re-export too.
    let named = |name: &str, text: &str| imports(name, text).into_iter().collect::<Vec<_>>();
    assert_eq!(named("quality/mod.rs", "pub use super::report::Stage;"), ["report"]);
    assert_eq!(named("quality/faults.rs", "use super::super::{report::Stage, cli};"), ["cli", "report"]);
    assert_eq!(named("quality/faults.rs", "use super::betas;"), [] as [&str; 0]);
}

/// The reader of a room sees ways round by `super`, by the crate, from a folder, and by a name that
/// `mod.rs` hands on.
#[test]
fn the_reader_of_a_room_sees_circles() {
    let round = |files: &[(&str, &str)]| {
        let files: Vec<_> = files.iter().map(|&(name, code)| (name.to_owned(), code.to_owned())).collect();
        circles(units("room", &files)).into_keys().collect::<Vec<_>>()
    };
    let own = ("room/mod.rs", "mod a; mod b; mod c; pub use a::{First as Alpha, sub::Second};");
    let b = ("room/b.rs", "use super::c;");
    assert_eq!(round(&[own, ("room/a.rs", "use super::b::f;"), b, ("room/c.rs", "")]), [] as [&str; 0]);
    for back in
        ["use super::a::f;", "use crate::{mesh, room::{d, a::f}};", "fn f(x: &super::Second) {}", "crate::room::Alpha"]
    {
        assert_eq!(round(&[own, ("room/a.rs", "use super::b::f;"), b, ("room/c.rs", back)]), ["a", "b", "c"], "{back}");
    }
    let folder =
        |code| [own, ("room/a/mod.rs", ""), ("room/a/sub.rs", code), ("room/b.rs", "use super::a;"), ("room/c.rs", "")];
    assert_eq!(round(&folder("use super::b;")), [] as [&str; 0]);
    assert_eq!(round(&folder("use super::super::b;")), ["a", "b"]);
}
