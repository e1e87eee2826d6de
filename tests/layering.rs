//! The map of the code holds: imports point downward, only some modules touch files, only one names
//! wgpu, nothing below the command line prints.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The layers, lowest first. A module may import from lower layers and from its own, but never in a
/// circle.
const LAYERS: &[&[&str]] = &[
    &["geometry", "mesh", "kernels", "quality", "text"],
    &["formats", "projection", "springs", "profile", "backend"],
    &["relaxation", "smoothing", "report"],
    &["families"],
    &["stage"],
    &["volume"],
    &["stages"],
    &["mover"],
    &["case"],
    &["cli"],
];

/// Modules that may touch files; the rest work on memory, so that they can be used from other
/// programs.
const FILES: &[&str] = &["formats", "case", "report", "cli"];

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
    let mut found = BTreeSet::new();
    for (at, _) in code.match_indices("crate::") {
        first_names(&code[at + "crate::".len()..], &mut found);
    }
    // A file `a/b.rs` is the module a::b, and `a/mod.rs` is a: from the one two steps lead up to
    // the crate, from the other one.
    let depth = name.trim_end_matches(".rs").split('/').filter(|part| *part != "mod").count();
    let up = "super::".repeat(depth);
    for (at, _) in code.match_indices(&up) {
        if !code[..at].ends_with("super::") {
            first_names(&code[at + up.len()..], &mut found);
        }
    }
    found
}

/// The first names of a path or of a group of paths.
fn first_names(after: &str, found: &mut BTreeSet<String>) {
    let Some(group) = after.strip_prefix('{') else {
        found.insert(identifier(after));
        return;
    };
    // Names at the first level of braces begin after `{` or `,`.
    let (mut depth, mut expecting) = (1, true);
    for (at, letter) in group.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 1 => expecting = true,
            _ if depth == 1 && expecting && !letter.is_whitespace() => {
                found.insert(identifier(&group[at..]));
                expecting = false;
            }
            _ => {}
        }
        if depth == 0 {
            break;
        }
    }
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
    // Take away modules that import nothing any more; what is left goes round.
    while let Some(free) = graph.iter().find(|(_, imports)| imports.is_empty()).map(|(module, _)| module.clone()) {
        graph.remove(&free);
        for imports in graph.values_mut() {
            imports.remove(&free);
        }
    }
    assert!(graph.is_empty(), "modules that import each other in a circle: {graph:?}");
}

#[test]
fn only_some_modules_touch_files() {
    for (name, module, code) in sources() {
        // The CPU backend asks the system for the processor's name, and for the memory that is
        // left.
        if FILES.contains(&module.as_str()) || ["backend/cpu/mod.rs", "backend/memory.rs"].contains(&name.as_str()) {
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
        if module == "cli" {
            continue;
        }
        for word in ["println!", "print!", "dbg!", "io::stdout", "io::stderr"] {
            assert!(!code.contains(word), "src/{name} prints: `{word}`");
        }
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
