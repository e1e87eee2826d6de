//! The place that a path names: two spellings of one place give the same path. Whether an open file
//! still has its name.

use std::fs::{self, File};
use std::path::{Component, Path, PathBuf};

/// The most links that a path is followed through.
const LINKS: usize = 40;

/// The absolute path without links, `.` and `..`. The file, and folders on the way to it, may be
/// missing. A link to a missing file is followed too.
pub(crate) fn real_path(path: &Path) -> PathBuf {
    let mut place = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    for _ in 0..LINKS {
        place = resolved(&place);
        match fs::read_link(&place) {
            Ok(link) => place = place.parent().unwrap_or(Path::new("/")).join(link),
            Err(_) => break,
        }
    }
    place
}

fn resolved(path: &Path) -> PathBuf {
    let mut place = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir => drop(place.pop()),
            Component::CurDir => {}
            component => {
                place.push(component);
                if let Ok(real) = fs::canonicalize(&place) {
                    place = real;
                }
            }
        }
    }
    place
}

/// The folder of files in memory, where jobs of a cluster keep their meshes.
const FILES_IN_MEMORY: &str = "/dev/shm";

/// Whether a path is a pipe or a device, or names an open file of the process, such as
/// `/dev/stdout`. Such a file cannot be replaced, and may not be read twice.
pub(crate) fn is_special(path: &Path) -> bool {
    let mut place = path.to_path_buf();
    for _ in 0..LINKS {
        let is_device = place.starts_with("/dev") && !place.starts_with(FILES_IN_MEMORY);
        if is_device || place.starts_with("/proc") {
            return true;
        }
        match fs::read_link(&place) {
            Ok(link) => place = place.parent().unwrap_or(Path::new("")).join(link),
            Err(_) => break,
        }
    }
    fs::metadata(path).is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir())
}

/// What tells a file from others.
#[cfg(unix)]
fn identity(metadata: &fs::Metadata) -> (u64, u64) {
    use std::os::unix::fs::MetadataExt;
    (metadata.dev(), metadata.ino())
}

/// An open file cannot be replaced on other systems.
#[cfg(not(unix))]
fn identity(_: &fs::Metadata) -> (u64, u64) {
    (0, 0)
}

/// Whether two open files are one.
pub(crate) fn is_same(one: &File, other: &File) -> bool {
    let identity = |file: &File| file.metadata().ok().map(|metadata| identity(&metadata));
    identity(one).is_some() && identity(one) == identity(other)
}

/// Whether an open file still has this name.
pub(crate) fn is_at(file: &File, path: &Path) -> bool {
    let (Ok(open), Ok(named)) = (file.metadata(), fs::metadata(path)) else { return false };
    identity(&open) == identity(&named)
}

#[cfg(test)]
mod tests {
    #[cfg(unix)]
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    #[cfg(unix)]
    fn spellings_of_one_place_are_one_path() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("a")).unwrap();
        symlink("a", at("link")).unwrap();
        symlink("a/new", at("dangling")).unwrap();
        let expected = fs::canonicalize(at("a")).unwrap().join("new");
        for name in ["a/new", "a/./new", "link/new", "link/../a/new", "missing/../a/new", "dangling"] {
            assert_eq!(real_path(&at(name)), expected, "{name}");
        }
        assert_ne!(real_path(&at("a/other")), expected);
    }

    #[test]
    #[cfg(unix)]
    fn files_of_the_process_are_special() {
        let folder = tempfile::tempdir().unwrap();
        symlink("/dev/stdout", folder.path().join("out")).unwrap();
        fs::write(folder.path().join("file"), "").unwrap();
        for path in ["/dev/stdout", "/dev/fd/3", "/proc/self/fd/1", "/dev/null"] {
            assert!(is_special(Path::new(path)), "{path}");
        }
        assert!(is_special(&folder.path().join("out")) && !is_special(&folder.path().join("file")));
        assert!(!is_special(&folder.path().join("missing")));
        // Files in memory are files, but a link among them may lead to a device.
        let in_memory = Path::new(FILES_IN_MEMORY);
        assert!(!is_special(&in_memory.join("idmesh-no-such-folder/moved.msh")));
        if let Ok(folder) = tempfile::tempdir_in(in_memory) {
            symlink("/dev/stdout", folder.path().join("out")).unwrap();
            fs::write(folder.path().join("file"), "").unwrap();
            assert!(is_special(&folder.path().join("out")) && !is_special(&folder.path().join("file")));
        }
    }
}
