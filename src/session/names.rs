//! Names of outputs, made from the output's name in the case.

use std::path::{Path, PathBuf};

use super::SessionError;
use crate::formats::FORMATS;

/// `moved.msh.gz` becomes `moved.invalid.msh.gz`.
pub fn invalid_name(path: &Path) -> PathBuf {
    let (stem, extension) = split_name(path);
    path.with_file_name(format!("{stem}.invalid{extension}"))
}

/// `moved.msh.gz` becomes `moved.inverted.vtu`.
pub fn inverted_name(path: &Path) -> PathBuf {
    path.with_file_name(format!("{}.inverted.vtu", split_name(path).0))
}

/// `moved.invalid.b8.ugrid.gz` becomes `moved.invalid.mapbc`.
pub(super) fn mapbc_beside(path: &Path) -> PathBuf {
    path.with_file_name(format!("{}.mapbc", split_name(path).0))
}

/// `moved.msh.gz` becomes `DESIGN.msh.gz`.
///
/// # Errors
/// [`SessionError::NoExtension`]: the name has no extension, which gives the file's format.
pub fn named_after(path: &Path, design: &str) -> Result<PathBuf, SessionError> {
    let extension = split_name(path).1;
    if extension.is_empty() || extension.eq_ignore_ascii_case(".gz") {
        return Err(SessionError::NoExtension { path: path.to_path_buf() });
    }
    Ok(path.with_file_name(format!("{design}{extension}")))
}

/// A file's name without its extension, and the extension with its dot, such as `.msh.gz`. The
/// extension may be empty.
fn split_name(path: &Path) -> (String, String) {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let (stem, gz) = match name.len().checked_sub(3).and_then(|at| name.split_at_checked(at)) {
        Some((stem, gz)) if gz.eq_ignore_ascii_case(".gz") => (stem, gz),
        _ => (&*name, ""),
    };
    // The extension of a format may have two parts, such as `.b8.ugrid`.
    let known = FORMATS.iter().filter(|format| !format.is_folder()).flat_map(|format| format.extensions);
    let at = known.filter_map(|extension| {
        let at = stem.len().checked_sub(extension.len() + 1)?;
        let (_, end) = stem.split_at_checked(at)?;
        end.strip_prefix('.').is_some_and(|end| end.eq_ignore_ascii_case(extension)).then_some(at)
    });
    match at.min().or_else(|| stem.rfind('.')) {
        Some(at) => (stem[..at].to_owned(), format!("{}{gz}", &stem[at..])),
        None => (stem.to_owned(), gz.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_names_keep_their_extensions() {
        let name = |path: &str| invalid_name(Path::new(path));
        assert_eq!(name("a/moved.msh"), Path::new("a/moved.invalid.msh"));
        assert_eq!(name("moved.v2.msh.gz"), Path::new("moved.v2.invalid.msh.gz"));
        assert_eq!(name("moved"), Path::new("moved.invalid"));
        assert_eq!(name("gz"), Path::new("gz.invalid"));
        assert_eq!(name("moved.b8.ugrid"), Path::new("moved.invalid.b8.ugrid"));
        assert_eq!(named_after(Path::new("a/moved.lb8.ugrid.gz"), "d.1").unwrap(), Path::new("a/d.1.lb8.ugrid.gz"));
        assert!(
            named_after(Path::new("a/polyMesh"), "d").is_err() && named_after(Path::new("points.gz"), "d").is_err()
        );
        assert_eq!(inverted_name(Path::new("a/moved.v2.msh.gz")), Path::new("a/moved.v2.inverted.vtu"));
    }
}
