//! Files that several processes try to make at once.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

use crate::formats::temporary_file;

/// Makes a file, unless there is one, and returns it open; `None` if there is one. Of several
/// processes that make the same file at once exactly one gets it. The file has its contents from
/// the start.
///
/// # Errors
/// The folder takes no files.
pub(super) fn make(path: &Path, contents: &[u8]) -> io::Result<Option<File>> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = temporary_file(folder)?;
    // The error of the temporary file itself would name it.
    file.as_file_mut().write_all(contents)?;
    match file.persist_noclobber(path) {
        Ok(file) => Ok(Some(file)),
        Err(error) if error.error.kind() == io::ErrorKind::AlreadyExists => Ok(None),
        // The file system can give a file a second name only by way of replacing another.
        Err(_) => make_in_place(path, contents),
    }
}

/// [`make`] for file systems without links. The file is empty for a moment, and stays so where the
/// process ends in this moment.
fn make_in_place(path: &Path, contents: &[u8]) -> io::Result<Option<File>> {
    let mut file = match OpenOptions::new().write(true).create_new(true).open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => return Ok(None),
        Err(error) => return Err(error),
    };
    match file.write_all(contents) {
        Ok(()) => Ok(Some(file)),
        Err(error) => {
            let _ = std::fs::remove_file(path);
            Err(error)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;

    use super::*;

    /// Of many that make one file at once exactly one gets it, and its contents are in the file.
    fn one_gets_it(make: impl Fn(&Path, &[u8]) -> io::Result<Option<File>> + Sync) {
        let folder = tempfile::tempdir().unwrap();
        for round in 0..100 {
            let path = folder.path().join(round.to_string());
            let together = Barrier::new(8);
            let got: Vec<u8> = std::thread::scope(|scope| {
                let threads: Vec<_> = (0..8_u8)
                    .map(|number| {
                        let (path, together, make) = (&path, &together, &make);
                        scope.spawn(move || {
                            together.wait();
                            make(path, &[number]).unwrap().map(|_| number)
                        })
                    })
                    .collect();
                threads.into_iter().filter_map(|thread| thread.join().unwrap()).collect()
            });
            assert_eq!(std::fs::read(&path).unwrap(), got, "round {round}");
            assert_eq!(got.len(), 1);
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 100, "temporary files are left");
    }

    #[test]
    fn one_of_many_gets_a_file() {
        one_gets_it(make);
    }

    #[test]
    fn one_of_many_gets_a_file_without_links() {
        one_gets_it(make_in_place);
    }

    #[test]
    fn a_folder_that_takes_no_files_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        assert!(make(&folder.path().join("gone/a"), b"").is_err());
    }
}
