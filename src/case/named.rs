//! [`NamedFiles`]: the files that a case file names, also one with mistakes.
//!
//! Results of an earlier run must not pass for results of a run that fails. So a case that cannot
//! be run still says which files are its results, and which ones it reads.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::paths::{folder_of, has_extension, is_pattern, matches};
use super::{Case, Output, parse, read_case};
use crate::formats::{has_format, is_surface_file, mesh_path};

/// The files that a case file names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedFiles {
    /// Files that may be inputs: all that the case names, but its outputs, and the case file.
    pub inputs: Vec<PathBuf>,
    /// The files of the results.
    pub output: Output,
    /// Whether the results have these names for sure. A misspelt key may be the one that names
    /// them.
    pub are_outputs_sure: bool,
    /// The names of the tables `[profiles.NAME]`, ascending.
    pub tables: Vec<String>,
}

impl NamedFiles {
    /// The files of a case without mistakes.
    pub fn of(case: &Case) -> Self {
        let tables = case.profiles.keys().cloned().collect();
        Self { inputs: case.inputs(), output: case.output.clone(), are_outputs_sure: true, tables }
    }

    /// The files of a case file, as far as it can be read. `None` if it is no TOML, and if the
    /// memory does not hold it.
    pub fn read(path: &Path) -> Option<Self> {
        Self::parse(&String::from_utf8(read_case(path).ok()?).ok()?, path)
    }

    /// [`Self::read`] from the text of the case file at `path`.
    fn parse(text: &str, path: &Path) -> Option<Self> {
        if let Ok(case) = Case::parse(text, path) {
            return Some(Self::of(&case));
        }
        let mut top: Table = text.parse().ok()?;
        let folder = folder_of(path);
        let output = top.remove("output");
        let key = |key: &str| output.as_ref().and_then(|output| output.get(key));
        let unknown: Vec<&Value> =
            top.iter().filter(|(key, _)| !parse::KEYS.contains(&key.as_str())).map(|(_, value)| value).collect();
        let mut mesh = top.get("mesh").and_then(Value::as_str).map(|text| mesh_path(&folder.join(text)));
        let output_keys = output.as_ref().map_or_else(Vec::new, |output| match output {
            Value::Table(table) => table.keys().map(String::as_str).collect(),
            _ => vec!["no table"],
        });
        // A table without the name of such a file is no misspelt `[output]`.
        let is_other = |path: &Path| ["svg", "html", "glb"].iter().any(|extension| has_extension(path, extension));
        let is_result = |text: &str| has_format(Path::new(text)) || is_other(Path::new(text));
        let are_outputs_sure = mesh.is_some()
            && output_keys.iter().all(|key| parse::OUTPUT_KEYS.contains(key))
            && !unknown.iter().flat_map(|value| texts(value)).any(is_result);
        if mesh.is_none() {
            // The key may be misspelt.
            let meshes = unknown.iter().filter_map(|value| value.as_str()).map(|text| folder.join(text));
            mesh = meshes.map(|path| mesh_path(&path)).find(|path| has_format(path));
        }
        let meshes: Vec<PathBuf> = match key("mesh") {
            None => mesh.iter().map(|mesh| folder.join(parse::default_name(mesh))).collect(),
            Some(value) => texts(value).into_iter().map(|text| folder.join(text)).collect(),
        };
        let file = |name: &str| key(name).and_then(Value::as_str).map(|text| folder.join(text));
        // A file with another extension would not be written.
        let histogram = file("histogram").filter(|path| has_extension(path, "svg"));
        let report = file("report").filter(|path| has_extension(path, "html"));
        let sections = file("sections").filter(|path| has_extension(path, "svg"));
        let surface = key("surface").map_or_else(Vec::new, texts).into_iter().map(|text| folder.join(text));
        let surface = surface.filter(|path| is_surface_file(path)).collect();
        let tables = top.get("profiles").and_then(Value::as_table);
        let tables = tables.into_iter().flat_map(Table::keys).cloned().collect();
        // Any other text may name an input under a key with a mistake.
        let mut inputs: BTreeSet<PathBuf> = mesh.into_iter().chain([path.to_path_buf()]).collect();
        top.values().flat_map(texts).for_each(|text| add(text, folder, &mut inputs));
        let are_outputs_sure = are_outputs_sure && !meshes.is_empty();
        let output = Output { mesh: meshes, histogram, report, surface, sections };
        Some(Self { inputs: inputs.into_iter().collect(), output, are_outputs_sure, tables })
    }
}

/// All texts in a value and in its tables and lists.
fn texts(value: &Value) -> Vec<&str> {
    match value {
        Value::String(text) => vec![text],
        Value::Array(values) => values.iter().flat_map(texts).collect(),
        Value::Table(table) => table.values().flat_map(texts).collect(),
        _ => Vec::new(),
    }
}

/// Adds the file that a text may name, or the files of a pattern.
fn add(text: &str, folder: &Path, files: &mut BTreeSet<PathBuf>) {
    let path = folder.join(text);
    if let (true, Some(parent), Some(pattern)) = (is_pattern(text), path.parent(), path.file_name()) {
        let here = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
        let names = std::fs::read_dir(here).into_iter().flatten().flatten().map(|entry| entry.file_name());
        let fitting = names.filter(|name| matches(&pattern.to_string_lossy(), &name.to_string_lossy()));
        files.extend(fitting.map(|name| parent.join(name)));
    }
    files.insert(path);
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: &str = "mesh = \"a.msh\"\n[profiles.wing]\nnew = \"new.csv\"\n[family.wing]\nrole = \"wing\"\n";

    fn named(text: &str) -> Option<NamedFiles> {
        NamedFiles::parse(text, Path::new("in/case.toml"))
    }

    /// A case with a mistake names the files of the case without the mistake.
    #[test]
    fn a_mistake_hides_no_file() {
        let output = "[output]\nmesh = [\"moved.msh\", \"moved.vtu\"]\nhistogram = \"beta.svg\"\nreport = \"report.html\"\n\
             surface = [\"moved.vtp\", \"moved.glb\"]\nsections = \"sections.svg\"\n";
        for output in ["", output] {
            let good = named(&format!("{CASE}{output}")).unwrap();
            for (from, to) in [("role = \"wing\"", "role = \"wimg\""), ("new =", "nwe ="), ("[family", "[famly")] {
                let text = format!("{}{output}", CASE.replacen(from, to, 1));
                assert!(Case::parse(&text, Path::new("in/case.toml")).is_err(), "{text}");
                let found = named(&text).unwrap();
                assert_eq!((&found.output, &found.tables), (&good.output, &good.tables), "{text}");
                assert!(good.inputs.iter().all(|input| found.inputs.contains(input)), "{text}");
            }
        }
        // Without the name of the mesh there is no default name. Under a misspelt key the name is
        // likely the mesh's.
        assert_eq!(named(&CASE.replacen("mesh = \"a.msh\"", "", 1)).unwrap().output.mesh, [] as [PathBuf; 0]);
        let likely = named(&CASE.replacen("mesh", "mseh", 1)).unwrap();
        assert_eq!(likely.output.mesh, [PathBuf::from("in/moved.msh")]);
        assert!(likely.inputs.contains(&PathBuf::from("in/a.msh")));
        let misspelt = named(&format!("{}{output}", CASE.replacen("mesh", "mseh", 1))).unwrap();
        assert_eq!(misspelt.output, named(&format!("{CASE}{output}")).unwrap().output);
        assert!(misspelt.inputs.contains(&PathBuf::from("in/a.msh")));
        assert_eq!(named("mesh = "), None);
        // The run would refuse such a name.
        assert_eq!(named(&format!("{CASE}[output]\nhistogram = \"new.csv\"\n")).unwrap().output.histogram, None);
        assert_eq!(named(&format!("{CASE}[output]\nreport = \"new.csv\"\n")).unwrap().output.report, None);
    }

    /// Whether a mistake may hide the name of a result.
    #[test]
    fn names_of_results_are_sure_where_no_key_is_misspelt() {
        let output = "[output]\nmesh = \"moved.msh\"\n";
        let case = format!("{CASE}{output}");
        for (from, to, sure) in [
            ("mesh", "mesh", true),
            ("role = \"wing\"", "role = \"wimg\"", true),
            ("new =", "nwe =", true),
            ("mesh", "mseh", false),
            ("mesh = \"a.msh\"", "", false),
            ("[output]", "[outptu]", false),
            ("[output]", "[volum]\nsprings = \"original\"\n[output]", true),
            ("[output]\nmesh", "[output]\nmseh", false),
            ("[output]\nmesh", "[[output]]\nmesh", false),
            ("[output]\nmesh = \"moved.msh\"", "[output]\nmesh = 3", false),
        ] {
            let text = case.replacen(from, to, 1);
            assert_eq!(named(&text).unwrap().are_outputs_sure, sure, "{text}");
        }
    }

    #[test]
    fn the_files_of_a_pattern_may_be_inputs() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("moved.msh"), "").unwrap();
        let text = CASE.replacen("new = \"new.csv\"", "nwe = [\"m*.msh\"]", 1);
        let found = NamedFiles::parse(&text, &folder.path().join("case.toml")).unwrap();
        assert!(found.inputs.contains(&folder.path().join("moved.msh")), "{found:?}");
    }
}
