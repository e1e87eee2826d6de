//! Do the case and the mesh speak of the same families?

use super::nearest::nearest;
use super::{Case, CaseError};

impl Case {
    /// Checks that every family of the mesh has a table and every table a family.
    ///
    /// # Errors
    /// [`CaseError::Families`], naming all that lack their other half and, where two names are alike, the likely one.
    pub fn check_families(&self, mesh_families: &[String]) -> Result<(), CaseError> {
        let tables: Vec<&String> = self.families.keys().collect();
        let without_table: Vec<&String> = mesh_families.iter().filter(|name| !tables.contains(name)).collect();
        let without_family: Vec<&String> =
            tables.iter().copied().filter(|name| !mesh_families.contains(name)).collect();
        if without_table.is_empty() && without_family.is_empty() {
            return Ok(());
        }
        let mut parts = Vec::new();
        if !without_table.is_empty() {
            let names: Vec<_> = without_table.iter().map(|name| format!("`{name}`")).collect();
            parts.push(format!("no [family] table for {}", names.join(", ")));
        }
        if !without_family.is_empty() {
            let names: Vec<_> = without_family
                .iter()
                .map(|name| {
                    let line = self.families[*name].position.line;
                    match nearest(name, &without_table) {
                        Some(likely) => format!("`{name}` (line {line}; did you mean `{likely}`?)"),
                        None => format!("`{name}` (line {line})"),
                    }
                })
                .collect();
            parts.push(format!("no family in the mesh for the table of {}", names.join(", ")));
        }
        let list = |names: &[&String]| match names {
            [] => "none".to_owned(),
            names => names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "),
        };
        parts.push(format!("the mesh has {}", list(&mesh_families.iter().collect::<Vec<_>>())));
        parts.push(format!("the case has {}", list(&tables)));
        Err(CaseError::Families { path: self.path.clone(), message: parts.join("; ") })
    }
}
