//! Files beside a mesh that are links out of the mesh's folder.
//!
//! A folder from somebody else may hold such a link to any file that its reader may read. So an
//! error does not quote the file that a link leads to. The mesh file itself is named by the user
//! and is quoted, wherever it lies.

use std::path::Path;

use super::error::{Location, ReadError};

/// Whether a file is a link to a file outside its folder.
pub(super) fn is_linked(path: &Path) -> bool {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    match (path.canonicalize(), folder.canonicalize()) {
        (Ok(file), Ok(folder)) => !file.starts_with(folder),
        // The file cannot be read either.
        _ => false,
    }
}

/// The error of a file beside the mesh. If the file is linked, the error gives only the place.
pub(super) fn unquoted(error: ReadError) -> ReadError {
    let place = match &error {
        ReadError::Malformed { place, .. }
        | ReadError::Truncated { place, .. }
        | ReadError::AbsurdCount { place, .. }
        | ReadError::NotFinite { place, .. }
        | ReadError::DuplicateVertex { place, .. }
        | ReadError::UnknownVertex { place, .. } => place.clone(),
        ReadError::Unsupported { path, .. } => Location::File(path.clone()),
        _ => return error,
    };
    if is_linked(place.path()) { ReadError::Linked { place } } else { error }
}
