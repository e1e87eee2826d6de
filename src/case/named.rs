//! [`NamedFiles`]: the files that a case file names, also one with mistakes.
//!
//! Results of an earlier run must not pass for results of a run that fails. So a case that cannot
//! be run still says which files are its results, and which ones it reads.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::paths::{is_pattern, matches};
use super::{Case, Output, parse, read_case};
use crate::formats::mesh_path;

/// The files that a case file names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedFiles {
    /// Files that may be inputs: all that the case names, but its outputs, and the case file.
    pub inputs: Vec<PathBuf>,
    /// The files of the results.
    pub output: Output,
    /// The names of the tables `[profiles.NAME]`, ascending.
    pub tables: Vec<String>,
}

impl NamedFiles {
    /// The files of a case without mistakes.
    pub fn of(case: &Case) -> Self {
        let tables = case.profiles.keys().cloned().collect();
        Self { inputs: case.inputs(), output: case.output.clone(), tables }
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
        let folder = path.parent().unwrap_or(Path::new(""));
        let output = top.remove("output");
        let key = |key: &str| output.as_ref().and_then(|output| output.get(key));
        let mesh = top.get("mesh").and_then(Value::as_str).map(|text| mesh_path(&folder.join(text)));
        let meshes = match key("mesh") {
            None => mesh.iter().map(|mesh| folder.join(parse::default_name(mesh))).collect(),
            Some(value) => texts(value).into_iter().map(|text| folder.join(text)).collect(),
        };
        let histogram = key("histogram").and_then(Value::as_str).map(|text| folder.join(text));
        // A file with another extension would not be written.
        let histogram = histogram.filter(|path| parse::is_svg(path));
        let tables = top.get("profiles").and_then(Value::as_table);
        let tables = tables.into_iter().flat_map(Table::keys).cloned().collect();
        // Any other text may name an input under a key with a mistake.
        let mut inputs: BTreeSet<PathBuf> = mesh.into_iter().chain([path.to_path_buf()]).collect();
        top.values().flat_map(texts).for_each(|text| add(text, folder, &mut inputs));
        Some(Self { inputs: inputs.into_iter().collect(), output: Output { mesh: meshes, histogram }, tables })
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
        let output = "[output]\nmesh = [\"moved.msh\", \"moved.vtu\"]\nhistogram = \"beta.svg\"\n";
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
        // Without the name of the mesh there is no default name.
        assert_eq!(named(&CASE.replacen("mesh", "mseh", 1)).unwrap().output.mesh, [] as [PathBuf; 0]);
        let misspelt = named(&format!("{}{output}", CASE.replacen("mesh", "mseh", 1))).unwrap();
        assert_eq!(misspelt.output, named(&format!("{CASE}{output}")).unwrap().output);
        assert!(misspelt.inputs.contains(&PathBuf::from("in/a.msh")));
        assert_eq!(named("mesh = "), None);
        // The run would refuse such a name.
        assert_eq!(named(&format!("{CASE}[output]\nhistogram = \"new.csv\"\n")).unwrap().output.histogram, None);
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
