//! Physical groups: their names, and the families given by 2-D groups.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};

use crate::formats::error::ReadError;
use crate::formats::scanner::{Scanner, shown};

/// Dimension of surfaces.
const SURFACE: i32 = 2;

/// The surfaces of a file and their physical groups.
#[derive(Default)]
pub(super) struct Groups {
    /// Tags of the named 2-D groups, in the order of `$PhysicalNames`.
    named: Vec<u32>,
    names: HashMap<u32, String>,
    /// The names without a dimension in the file, by their tags.
    without_dimension: HashMap<u32, String>,
    /// Version 4.1: physical tags of each surface entity. With a negative tag the group sees the
    /// surface reversed.
    surfaces: HashMap<i32, Vec<i32>>,
    /// Version 4.1: surface entities between two partitions of a volume, which bound nothing.
    interfaces: HashSet<i32>,
}

impl Groups {
    /// Reads `$PhysicalNames`, which is text in binary files too: a count, then a line
    /// `dimension tag "name"` per group. In files of version 2.0 the dimension is missing. Then the
    /// name belongs to the 2-D group with this tag, if faces are in one.
    ///
    /// - `may_lack_dimension`: whether the file has version 2
    pub fn read_names(&mut self, scanner: &mut Scanner, may_lack_dimension: bool) -> Result<(), ReadError> {
        let int = |scanner: &mut Scanner, what: &str| {
            let token = scanner.token();
            let number = std::str::from_utf8(token).ok().and_then(|token| token.parse::<i32>().ok());
            number.ok_or_else(|| match token {
                b"" => scanner.truncated(what),
                _ => scanner.malformed(what, shown(token)),
            })
        };
        for _ in 0..int(scanner, "the number of physical names")? {
            let mut dimension = SURFACE;
            let mut group = int(scanner, "the dimension of a physical group")?;
            let has_dimension = !may_lack_dimension || scanner.peek_byte() != Some(b'"');
            if has_dimension {
                dimension = group;
                group = int(scanner, "the tag of a physical group")?;
            }
            let group = group.unsigned_abs();
            let name = scanner.line();
            let name = name.strip_prefix(b"\"").and_then(|name| name.strip_suffix(b"\"")).unwrap_or(name);
            if dimension != SURFACE || name.is_empty() {
                continue;
            }
            let name = String::from_utf8_lossy(name).into_owned();
            if !has_dimension {
                // One of two names may be the name of a volume or a curve.
                if let Some(first) = self.without_dimension.insert(group, name.clone()).filter(|first| *first != name) {
                    let expected = format!("one name for the physical group {group}, or the dimension before each tag");
                    let found = format!("'{name}', and '{first}' before");
                    return Err(scanner.malformed(expected, found));
                }
            }
            if let Entry::Vacant(entry) = self.names.entry(group) {
                entry.insert(name);
                self.named.push(group);
            }
        }
        Ok(())
    }

    /// Adds the physical tags of a surface entity.
    pub fn add_surface(&mut self, surface: i32, tags: Vec<i32>) {
        self.surfaces.entry(surface).or_default().extend(tags);
    }

    /// Marks a surface entity as lying between partitions.
    pub fn add_interface(&mut self, surface: i32) {
        self.interfaces.insert(surface);
    }

    pub fn is_interface(&self, surface: i32) -> bool {
        self.interfaces.contains(&surface)
    }

    /// The name of a 2-D group in messages.
    ///
    /// - `group`: absolute value of the group's tag
    pub fn name(&self, group: u32) -> String {
        self.given_name(group).unwrap_or_else(|| format!("surface {group}"))
    }

    /// The name of a 2-D group in the file, if it has one.
    ///
    /// - `group`: absolute value of the group's tag
    pub fn given_name(&self, group: u32) -> Option<String> {
        self.names.get(&group).cloned()
    }

    /// The 2-D group of a surface entity in a 4.1 file, and whether the group sees the surface
    /// reversed.
    ///
    /// # Errors
    /// The surface is in two groups.
    pub fn of_surface(&self, surface: i32) -> Result<Option<(u32, bool)>, (u32, u32)> {
        let Some(&[first, ref others @ ..]) = self.surfaces.get(&surface).map(Vec::as_slice) else {
            return Ok(None);
        };
        match others.iter().find(|other| other.unsigned_abs() != first.unsigned_abs()) {
            Some(other) => Err((first.unsigned_abs(), other.unsigned_abs())),
            None => Ok((first != 0).then_some((first.unsigned_abs(), first < 0))),
        }
    }

    /// The groups in `used`, in the order of the families: named groups in the order of the file,
    /// then unnamed ones by first use.
    pub fn in_order(&self, used: &[u32]) -> Vec<u32> {
        let is_used: HashSet<u32> = used.iter().copied().collect();
        let named = self.named.iter().filter(|group| is_used.contains(group));
        named.chain(used.iter().filter(|group| !self.names.contains_key(group))).copied().collect()
    }
}
