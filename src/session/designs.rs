//! The files of a batch's designs.
//!
//! [`list_designs`] lists the designs of a folder or of a text file.

use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::path::{Path, PathBuf};

use super::SessionError;
use crate::case::design_list;
use crate::formats::read_named;
use crate::text::decode;

/// The name of a design and its files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DesignFiles {
    /// The name that the design's results get.
    pub name: String,
    /// Path of the design's file or folder.
    path: PathBuf,
    /// The file for each table `[profiles.TABLE]` of the case. Empty if the design is one file.
    tables: BTreeMap<String, PathBuf>,
}

impl DesignFiles {
    /// Whether the design is one file.
    pub fn is_single(&self) -> bool {
        self.tables.is_empty()
    }

    /// All files of the design.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        let single = self.is_single().then_some(&self.path);
        self.tables.values().chain(single).map(PathBuf::as_path)
    }

    /// The file of a design that is one file.
    ///
    /// # Errors
    /// [`SessionError::IsFolder`]: the design has several files.
    pub fn only(&self) -> Result<&Path, SessionError> {
        if self.is_single() {
            return Ok(&self.path);
        }
        Err(SessionError::IsFolder { path: self.path.clone() })
    }

    /// The file that replaces the profiles of a table.
    ///
    /// # Errors
    /// [`SessionError::LacksTable`]: the design has no file for the table.
    pub fn of_table(&self, table: &str) -> Result<&Path, SessionError> {
        let lacks = || SessionError::LacksTable { path: self.path.clone(), table: table.to_owned() };
        self.tables.get(table).map(PathBuf::as_path).ok_or_else(lacks)
    }
}

/// Designs of which some may have one name.
#[derive(Debug)]
pub struct Listed {
    /// The designs. Of those with one name the first.
    pub designs: Vec<DesignFiles>,
    /// The error of the first two designs with one name.
    pub fault: Option<SessionError>,
}

/// Lists the designs of a folder, sorted by name, or the designs that a text file names, in its
/// order.
///
/// The text file holds one path a line, relative to the text file's folder. Those of a pipe or a
/// device, such as `/dev/stdin`, are relative to the working folder. A comment begins with `#`.
///
/// | tables of the case | a design is |
/// |---|---|
/// | at most one | a file `NAME.EXT` |
/// | several | files `NAME.TABLE.EXT`, one for each table |
/// | at least one | a folder `NAME` with a file `TABLE.EXT` for each table |
///
/// - `extensions`: the values of `EXT`
/// - `tables`: names of the case's tables of profiles
///
/// # Errors
/// - [`SessionError::UnreadableDesigns`]: the folder or the text file cannot be read
/// - [`SessionError::NoList`]: the text file is itself a design
/// - [`SessionError::NoDesigns`]: no design is found
pub fn list_designs(path: &Path, extensions: &[&str], tables: &[String]) -> Result<Listed, SessionError> {
    let cannot_read = |source| SessionError::UnreadableDesigns { path: path.to_path_buf(), source };
    let paths = if path.is_dir() {
        let mut paths = entries(path).map_err(cannot_read)?;
        paths.retain(|path| is_design(path, extensions) || !of_folder(path, extensions, tables).is_empty());
        paths
    } else {
        // What a shell makes of `<(...)` is no file beside which designs could be.
        let listed = design_list::parse(&decode(&read_named(path).map_err(cannot_read)?), path);
        // Text files of both kinds have the extension txt.
        let is_profile = path.extension().is_none_or(|extension| extension != "txt") && is_design(path, extensions);
        if is_profile && !listed.iter().any(|path| path.exists()) {
            return Err(SessionError::NoList { path: path.to_path_buf() });
        }
        listed
    };
    if paths.is_empty() {
        return Err(SessionError::NoDesigns { path: path.to_path_buf() });
    }
    let mut designs = Designs::default();
    for path in paths {
        let stem = stem(&path, extensions);
        if path.is_dir() || path.file_name().is_none() {
            let name = folder_name(&path);
            designs.add(DesignFiles { name, tables: of_folder(&path, extensions, tables), path });
        } else if tables.len() < 2 {
            designs.add(DesignFiles { name: stem, path, tables: BTreeMap::new() });
        } else {
            let table = tables.iter().filter_map(|table| Some((stem.strip_suffix(&format!(".{table}"))?, table)));
            let Some((name, table)) = table.max_by_key(|(_, table)| table.len()) else {
                // The design fails alone when it is read.
                designs.add(DesignFiles { name: stem, path, tables: BTreeMap::new() });
                continue;
            };
            match designs.by_name.get(name).map(|&place| &mut designs.all[place]).filter(|design| !design.path.is_dir())
            {
                Some(design) => {
                    if let Some(other) = design.tables.insert(table.clone(), path.clone()) {
                        designs.fault.get_or_insert(same_name(name, &other, &path));
                    }
                }
                None => {
                    let tables = BTreeMap::from([(table.clone(), path.clone())]);
                    designs.add(DesignFiles { name: name.to_owned(), path, tables });
                }
            }
        }
    }
    Ok(Listed { designs: designs.all, fault: designs.fault })
}

/// The name of a design that is a folder. A path such as `..`, which ends with no name, is the name
/// itself, as far as a file's name can hold it.
fn folder_name(path: &Path) -> String {
    match path.file_name() {
        Some(name) => name.to_string_lossy().into_owned(),
        None => path.to_string_lossy().replace(['/', '\\'], "_"),
    }
}

/// Designs in their order, each with a name of its own.
#[derive(Default)]
struct Designs {
    all: Vec<DesignFiles>,
    /// Place in `all` of each name.
    by_name: HashMap<String, usize>,
    /// The first two with one name.
    fault: Option<SessionError>,
}

impl Designs {
    fn add(&mut self, design: DesignFiles) {
        match self.by_name.get(&design.name) {
            Some(&place) => {
                let other = &self.all[place].path;
                self.fault.get_or_insert_with(|| same_name(&design.name, other, &design.path));
            }
            None => {
                self.by_name.insert(design.name.clone(), self.all.len());
                self.all.push(design);
            }
        }
    }
}

fn same_name(name: &str, one: &Path, other: &Path) -> SessionError {
    SessionError::SameName { name: name.to_owned(), one: one.to_path_buf(), other: other.to_path_buf() }
}

fn entries(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut paths: Vec<_> = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    paths.sort();
    Ok(paths)
}

/// The files of a folder that have the name of a table, by table. Empty if the path is no folder or
/// a hidden one.
fn of_folder(folder: &Path, extensions: &[&str], tables: &[String]) -> BTreeMap<String, PathBuf> {
    let hidden = folder.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    if hidden || !folder.is_dir() {
        return BTreeMap::new();
    }
    let paths = entries(folder).unwrap_or_default().into_iter().filter(|path| is_design(path, extensions));
    let named = paths.filter_map(|path| {
        let stem = stem(&path, extensions);
        tables.contains(&stem).then_some((stem, path))
    });
    named.collect()
}

/// The name of a path without the extension of a design's file, or of another file.
fn stem(path: &Path, extensions: &[&str]) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    match extension_at(&name, extensions) {
        Some(at) => name[..at].to_owned(),
        None => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
    }
}

/// Where the longest of some extensions begins at the end of a name, with its point. An extension
/// may have two parts, such as `stl.gz`.
fn extension_at(name: &str, extensions: &[&str]) -> Option<usize> {
    let mut points = name.match_indices('.').map(|(at, _)| at).filter(|&at| at > 0);
    points.find(|at| extensions.iter().any(|other| name[at + 1..].eq_ignore_ascii_case(other)))
}

/// Whether the name of a path is that of a design's file. Whether the path is a file shows when the
/// design is read: a pipe or a folder is a design that fails.
fn is_design(path: &Path, extensions: &[&str]) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    // The faulty tets of a result.
    let hidden = name.starts_with('.') || name.ends_with(".inverted.vtu");
    !hidden && extension_at(&name, extensions).is_some()
}
