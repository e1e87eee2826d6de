//! The reasons why keys of a report are `null`.

use serde_json::Value;

use super::RunReport;
use crate::mover::FaultKind;

impl RunReport {
    /// Fills [`RunReport::reasons`] for every key that is `null`.
    pub fn with_reasons(mut self) -> Self {
        self.reasons.clear();
        let mut nulls = Vec::new();
        if let Ok(value) = serde_json::to_value(&self) {
            find_nulls(&value, String::new(), &mut nulls);
        }
        for pointer in nulls {
            let reason = self.reason(&pointer);
            self.reasons.insert(pointer, reason);
        }
        self
    }

    fn reason(&self, pointer: &str) -> String {
        let has_moved = self.stages.is_some();
        let last = pointer.rsplit('/').next().unwrap_or_default();
        let reason = match pointer {
            "/design" => "the design of the case itself",
            "/error" => "the result is good",
            "/error/hint" => "nothing is known to help",
            "/error/count" => "nothing was counted",
            "/checksums" => "no checksums were asked for",
            "/cells" | "/cells_original" if has_moved => "all cells are tets; `stages` has their quality",
            _ if self.mesh.tets == 0 && last.starts_with("beta_") => "no cell is a tet",
            "/solver_quality" if has_moved => "nothing asked for it",
            _ if pointer.starts_with("/solver_quality/")
                && last.starts_with("non_orthogonality")
                && !self.is_lost() =>
            {
                "no face lies between two cells"
            }
            "/device_work" if has_moved => "the CPU computed",
            "/smoothing" if has_moved => "it is off, or no tet needed it",
            "/checks/max_distance_off_surface" => "no family is a carenage or a plane",
            "/checks/max_distance_to_new_profiles" | "/checks/max_miss_of_vertices" => {
                return self.not_measured().unwrap_or("no wing has profiles").to_owned();
            }
            _ if pointer.starts_with("/profiles/") && last != "not_measured" => {
                return self.not_measured().unwrap_or("not a finite number").to_owned();
            }
            _ if last == "place" => "the fault has no place",
            _ if last == "family" => "no family is near",
            _ if pointer.starts_with("/checksums/") => "the file is missing, or cannot be read twice",
            _ if !has_moved && pointer.matches('/').count() == 1 => "there is no result",
            _ => "not a finite number",
        };
        reason.to_owned()
    }

    /// Whether vertices have no finite position.
    fn is_lost(&self) -> bool {
        self.error.as_ref().is_some_and(|error| error.kind == FaultKind::NotFinite.name())
    }

    /// The reason why a deviation from profiles could not be measured.
    fn not_measured(&self) -> Option<&str> {
        self.profiles.as_ref()?.values().find_map(|profiles| profiles.not_measured.as_deref())
    }
}

/// The JSON Pointers (RFC 6901) of all `null` in a value.
fn find_nulls(value: &Value, pointer: String, nulls: &mut Vec<String>) {
    match value {
        Value::Null => nulls.push(pointer),
        Value::Object(map) => {
            for (key, value) in map {
                let key = key.replace('~', "~0").replace('/', "~1");
                find_nulls(value, format!("{pointer}/{key}"), nulls);
            }
        }
        Value::Array(values) => {
            for (index, value) in values.iter().enumerate() {
                find_nulls(value, format!("{pointer}/{index}"), nulls);
            }
        }
        _ => {}
    }
}
