//! Compares the families of a case with the families of a mesh.
//!
//! The name of a table may be a pattern. A family belongs to the table with its own name, or else
//! to the only pattern that fits.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::PathBuf;

use super::names::Names;
use super::{Case, CaseError, FamilySettings, Position, ProfileSource};
use crate::families::Role;
use crate::text::nearest::{first_of, nearest, quoted};

/// The message for profiles of a family that is no wing.
pub(super) fn no_wing(family: &str, role: &Role) -> String {
    format!(
        "profiles are given for family `{family}`, whose role is \"{}\", expected a family whose role is \"wing\"",
        role.name()
    )
}

/// The message for a wing without profiles.
pub(super) fn no_profiles(family: &str) -> String {
    format!(
        "family `{family}` is a wing, but there is no table [profiles.{family}], expected one with its new profiles, or one of \
         several families that names it: families = [\"{family}\", ...]"
    )
}

impl Case {
    /// The case for a mesh with these families. In this case no name is a pattern: every family of
    /// the mesh has its settings, and every wing lists its families.
    ///
    /// Tables of profiles with the same files become one wing.
    ///
    /// # Errors
    /// - [`CaseError::Families`]: a family of the mesh has no table, or a table has no family; the
    ///   message lists them all, with similar names
    /// - [`CaseError::Invalid`]: two patterns fit one family, or a wing has no profiles or two
    ///   tables of profiles
    pub fn for_families(&self, mesh_families: &[String]) -> Result<Self, CaseError> {
        self.for_families_beside(mesh_families, &[])
    }

    /// [`Case::for_families`] for a mesh with families inside the volume, which need no table.
    ///
    /// - `inside`: these families
    ///
    /// # Errors
    /// As [`Case::for_families`].
    pub(super) fn for_families_beside(&self, mesh_families: &[String], inside: &[&String]) -> Result<Self, CaseError> {
        let families = self.named_families(mesh_families, inside)?;
        let profiles = self.named_profiles(&families)?;
        Ok(Self { families, profiles, ..self.clone() })
    }

    fn invalid(&self, position: Position, message: String) -> CaseError {
        CaseError::Invalid { path: self.path.clone(), position, message }
    }

    /// Whether each family of the mesh has a table with its own name, not a pattern.
    pub(super) fn names_all(&self, mesh_families: &[String]) -> bool {
        mesh_families.iter().all(|family| self.families.contains_key(family))
    }

    fn named_families(
        &self,
        mesh_families: &[String],
        inside: &[&String],
    ) -> Result<BTreeMap<String, FamilySettings>, CaseError> {
        let mut families = BTreeMap::new();
        let names = Names::new(mesh_families.iter().map(String::as_str));
        let mut without_family = Vec::new();
        let inside_names: HashSet<&String> = inside.iter().copied().collect();
        for (name, settings) in &self.families {
            let fitting = names.fitting(name).map_err(|error| self.invalid(settings.position, error.to_string()))?;
            if fitting.is_empty() {
                without_family.push(name);
            }
            for family in fitting.into_iter().map(|index| &mesh_families[index]) {
                // A pattern is not meant for a family inside the volume.
                if family != name && (self.families.contains_key(family) || inside_names.contains(family)) {
                    continue;
                }
                if let Some((other, _)) = families.insert(family.clone(), (name, settings)) {
                    let message = format!(
                        "family `{family}` fits [family.\"{name}\"] and [family.\"{other}\"], expected one table"
                    );
                    return Err(self.invalid(settings.position, message));
                }
            }
        }
        let mut families: BTreeMap<_, _> =
            families.into_iter().map(|(family, (_, settings))| (family, settings.clone())).collect();
        for &family in inside {
            let position = Position { line: 1, column: 1 };
            let settings = FamilySettings { role: Role::Interior, displacement: None, position };
            families.entry(family.clone()).or_insert(settings);
        }
        self.check_families(mesh_families, &families, &without_family)?;
        Ok(families)
    }

    fn named_profiles(
        &self,
        families: &BTreeMap<String, FamilySettings>,
    ) -> Result<BTreeMap<String, ProfileSource>, CaseError> {
        let mut tables: Vec<(&String, &ProfileSource)> = self.profiles.iter().collect();
        tables.sort_by_key(|(_, source)| (source.position.line, source.position.column));
        let mut wings: Vec<(String, ProfileSource)> = Vec::new();
        let mut owner: BTreeMap<String, &String> = BTreeMap::new();
        let in_order: Vec<(&String, &FamilySettings)> = families.iter().collect();
        let names = Names::new(families.keys().map(String::as_str));
        // Indices in `wings` of the wings with the same new files.
        let mut with_files: HashMap<&[PathBuf], Vec<usize>> = HashMap::new();
        for (table, source) in tables {
            let mut members = Vec::new();
            for entry in &source.families {
                let fitting = names.fitting(entry);
                let fitting = fitting.map_err(|error| self.invalid(source.position, error.to_string()))?;
                let fitting: Vec<_> = fitting.into_iter().map(|index| in_order[index]).collect();
                // Of the families that fit a pattern, the wings belong to the table.
                let wings = fitting.iter().filter(|(_, settings)| settings.role == Role::Wing);
                let found: Vec<&String> = wings.map(|(family, _)| *family).collect();
                match (fitting.first(), found.is_empty()) {
                    (None, _) => {
                        let message = format!("[profiles.{table}]: no family of the mesh is or fits `{entry}`");
                        return Err(self.invalid(source.position, message));
                    }
                    (Some((family, settings)), true) => {
                        return Err(self.invalid(source.position, no_wing(family, &settings.role)));
                    }
                    _ => members.extend(found.into_iter().cloned()),
                }
            }
            members.sort();
            members.dedup();
            for member in &members {
                if let Some(other) = owner.insert(member.clone(), table) {
                    let message =
                        format!("family `{member}` is in [profiles.{other}] and in [profiles.{table}], expected one");
                    return Err(self.invalid(source.position, message));
                }
            }
            let same = |&&index: &&usize| {
                let other = &wings[index].1;
                other.old == source.old
                    && other.placements == source.placements
                    && other.mirror == source.mirror
                    && other.matched == source.matched
            };
            let candidates = with_files.entry(&source.new).or_default();
            match candidates.iter().find(same).copied() {
                Some(index) => wings[index].1.families.extend(members),
                None => {
                    candidates.push(wings.len());
                    wings.push((table.clone(), ProfileSource { families: members, ..source.clone() }));
                }
            }
        }
        // The report has wings and families by name.
        for (name, wing) in &wings {
            if let Some(other) = owner.get(name).filter(|_| !wing.families.contains(name)) {
                let message = format!(
                    "[profiles.{name}] has the name of a family that is in [profiles.{other}], expected another name"
                );
                return Err(self.invalid(wing.position, message));
            }
        }
        let mut without =
            families.iter().filter(|(name, settings)| settings.role == Role::Wing && !owner.contains_key(*name));
        if let Some((name, settings)) = without.next() {
            return Err(self.invalid(settings.position, no_profiles(name)));
        }
        Ok(wings.into_iter().collect())
    }

    fn check_families(
        &self,
        mesh_families: &[String],
        families: &BTreeMap<String, FamilySettings>,
        without_family: &[&String],
    ) -> Result<(), CaseError> {
        let tables: Vec<&String> = self.families.keys().collect();
        let without_table: Vec<&String> = mesh_families.iter().filter(|name| !families.contains_key(*name)).collect();
        if without_table.is_empty() && without_family.is_empty() {
            return Ok(());
        }
        let mut parts = Vec::new();
        if !without_table.is_empty() {
            parts.push(format!("no [family] table for {}", quoted(&without_table)));
        }
        if !without_family.is_empty() {
            let names = without_family.iter().map(|name| {
                let line = self.families[*name].position.line;
                match nearest(name, &without_table) {
                    Some(likely) => format!("`{name}` (line {line}; did you mean `{likely}`?)"),
                    None => format!("`{name}` (line {line})"),
                }
            });
            let names = first_of(without_family.len(), names);
            parts.push(format!("no family in the mesh for the table of {names}"));
        }
        let list = |names: &[&String]| if names.is_empty() { "none".to_owned() } else { quoted(names) };
        parts.push(format!("the mesh has {}", list(&mesh_families.iter().collect::<Vec<_>>())));
        parts.push(format!("the case has {}", list(&tables)));
        Err(CaseError::Families { path: self.path.clone(), message: parts.join("; ") })
    }
}
