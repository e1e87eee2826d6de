//! Profiles as JSON: `[{"profile": 0, "points": [[x, y, z], ...]}, ...]`.

use std::path::Path;

use serde::Deserialize;

use super::fail;
use crate::profile::{Profile, ProfileError};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonSection {
    profile: i64,
    points: Vec<[f64; 3]>,
}

/// Reads the profiles of a file.
///
/// # Errors
/// [`ProfileError::Line`]
pub(super) fn parse(path: &Path, text: &str) -> Result<Vec<Profile>, ProfileError> {
    let sections: Vec<JsonSection> = serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|error| {
        let expected = "[{\"profile\": 0, \"points\": [[x, y, z], ...]}, ...]";
        fail(path, error.line().saturating_sub(1), error.to_string(), expected)
    })?;
    let profile = |section: JsonSection| Profile {
        number: section.profile,
        points: section.points.into_iter().map(Into::into).collect(),
    };
    Ok(sections.into_iter().map(profile).collect())
}
