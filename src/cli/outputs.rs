//! The files a command writes: checked before anything is computed, written whole or not at all.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::JsonTarget;
use super::console::Console;
use super::failure::Failure;
use crate::formats::{self, FORMATS, write_atomically};

/// A folder for outputs that is there when it is needed, and gone again if nothing was written into
/// it.
#[derive(Debug, Default)]
pub(super) struct Folder {
    /// The folders that were made, outermost first.
    made: Vec<PathBuf>,
}

impl Folder {
    /// Makes the folder and those around it, where they are missing.
    ///
    /// # Errors
    /// One of them cannot be made, or is a file.
    pub(super) fn make(path: &Path) -> Result<Self, Failure> {
        let missing: Vec<_> =
            path.ancestors().take_while(|path| !path.as_os_str().is_empty() && !path.exists()).collect();
        let mut folder = Self::default();
        for ancestor in missing.into_iter().rev() {
            fs::create_dir(ancestor).map_err(|error| cannot_write(path, &error))?;
            folder.made.push(ancestor.to_path_buf());
        }
        if !path.is_dir() {
            return Err(cannot_write(path, &io::ErrorKind::NotADirectory.into()));
        }
        Ok(folder)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // A folder that holds something cannot be removed this way, and that is the point.
        for path in self.made.iter().rev() {
            let _ = fs::remove_dir(path);
        }
    }
}

fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    Failure::bad_input(format!("cannot write {}: {error}", path.display()))
}

/// Checks that a file can be written, by making and removing a temporary one beside it.
///
/// # Errors
/// The path is a folder, or its folder is missing or takes no files.
pub(super) fn check_writable(path: &Path) -> Result<(), Failure> {
    formats::check_writable(path).map_err(|error| cannot_write(path, &error))
}

/// Refuses outputs that would overwrite an input or each other.
///
/// # Errors
/// The first such output.
pub(super) fn check_distinct(inputs: &[PathBuf], outputs: &[&Path]) -> Result<(), Failure> {
    let same = |a: &Path, b: &Path| {
        // A mesh may be a folder, and the other path a file in it.
        let within = |a: &Path, b: &Path| a.is_dir() && b.starts_with(a);
        let real = (fs::canonicalize(a), fs::canonicalize(b));
        a == b || matches!(real, (Ok(a), Ok(b)) if (a == b && a.is_file()) || within(&a, &b) || within(&b, &a))
    };
    for (index, output) in outputs.iter().enumerate() {
        if let Some(input) = inputs.iter().find(|input| same(input, output)) {
            return Err(Failure::bad_input(format!(
                "the output {} would overwrite the input {}, expected another name",
                output.display(),
                input.display()
            )));
        }
        if outputs[..index].iter().any(|other| same(other, output)) {
            return Err(Failure::bad_input(format!("{} is the name of two outputs", output.display())));
        }
    }
    Ok(())
}

/// Checks that JSON can be written where the user wants it.
///
/// # Errors
/// The file cannot be written.
pub(super) fn check_json(target: Option<&JsonTarget>) -> Result<(), Failure> {
    match target {
        Some(JsonTarget::File(path)) => check_writable(path),
        _ => Ok(()),
    }
}

/// Writes a value as JSON to a file or standard output.
///
/// # Errors
/// It cannot be written.
pub(super) fn write_json(target: &JsonTarget, value: &impl Serialize, console: &Console) -> Result<(), Failure> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|error| Failure::bad_input(format!("cannot write the report: {error}")))?;
    text.push('\n');
    match target {
        JsonTarget::StandardOutput => console.data(&text),
        JsonTarget::File(path) => write_text(path, &text),
    }
}

/// Writes a text file.
///
/// # Errors
/// It cannot be written.
pub(super) fn write_text(path: &Path, text: &str) -> Result<(), Failure> {
    write_atomically(path, |out| out.write_all(text.as_bytes())).map_err(|error| cannot_write(path, &error))
}

/// `moved.msh.gz` becomes `moved.invalid.msh.gz`.
pub(super) fn invalid_name(path: &Path) -> PathBuf {
    let (stem, extension) = split_name(path);
    path.with_file_name(format!("{stem}.invalid{extension}"))
}

/// `moved.msh.gz` becomes `moved.inverted.vtu`.
pub(super) fn inverted_name(path: &Path) -> PathBuf {
    path.with_file_name(format!("{}.inverted.vtu", split_name(path).0))
}

/// `moved.msh.gz` becomes `DESIGN.msh.gz`.
///
/// # Errors
/// There is no extension, by which the file would keep its format.
pub(super) fn named_after(path: &Path, design: &str) -> Result<PathBuf, Failure> {
    let extension = split_name(path).1;
    if extension.is_empty() || extension.eq_ignore_ascii_case(".gz") {
        let message = format!("the output {} has no extension to put after a design's name", path.display());
        return Err(
            Failure::bad_input(message).with_hint("`batch` writes single files, such as moved.msh or moved.vtu")
        );
    }
    Ok(path.with_file_name(format!("{design}{extension}")))
}

/// A file's name before its extension, and the extension: `.msh.gz`, `.vtu` or nothing.
fn split_name(path: &Path) -> (String, String) {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let (stem, gz) = match name.len().checked_sub(3).and_then(|at| name.split_at_checked(at)) {
        Some((stem, gz)) if gz.eq_ignore_ascii_case(".gz") => (stem, gz),
        _ => (&*name, ""),
    };
    // Extensions of formats may have two parts: `.b8.ugrid`.
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

    #[test]
    fn an_unused_folder_goes_away() {
        let here = tempfile::tempdir().unwrap();
        let (outer, inner) = (here.path().join("a"), here.path().join("a/b"));
        drop(Folder::make(&inner).unwrap());
        assert!(!outer.exists());
        let folder = Folder::make(&inner).unwrap();
        fs::write(inner.join("result"), "").unwrap();
        drop(folder);
        assert!(inner.join("result").exists());
    }
}
