//! Reads a whole input file: never a pipe or a device by way of a link, and never more than the
//! memory holds.
//!
//! To open a pipe waits for a writer, and a device such as `/dev/zero` has no end. A folder from
//! somebody else may hold a link to either. A user may name an open file of the process:
//! `/dev/stdin`, or what a shell makes of `<(...)`. Such a file is read to its end, if the memory
//! holds it.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Component, Path};

use crate::memory::check_memory;

/// Least number of bytes for which the memory is checked.
const PART: u64 = 1 << 20;

/// Reads a regular file. A link to one is one.
///
/// # Errors
/// The file is a pipe, a device or a folder, cannot be read, or is larger than the memory.
pub(crate) fn read_file(path: &Path) -> io::Result<Vec<u8>> {
    let (file, length) = open_file(path)?;
    read_to_end(file, length)
}

/// Opens a regular file. Returns its length too.
///
/// # Errors
/// The file is a pipe, a device or a folder, or cannot be opened.
pub(crate) fn open_file(path: &Path) -> io::Result<(File, u64)> {
    check_kind(&fs::metadata(path)?)?;
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    // Another process may have replaced the file meanwhile.
    check_kind(&metadata)?;
    Ok((file, metadata.len()))
}

/// Reads a file that the user names: a regular file, or an open file of the process.
///
/// # Errors
/// As for [`read_file`].
pub(crate) fn read_named(path: &Path) -> io::Result<Vec<u8>> {
    if is_open_file(path) { read_to_end(File::open(path)?, 0) } else { read_file(path) }
}

/// Reads a file that the user names, in pieces of whole lines. A piece is not kept, so a long file
/// takes little memory, as far as its lines are short.
///
/// # Errors
/// As for [`read_file`], and what `take` returns.
pub(crate) fn read_lines<E>(
    path: &Path,
    of_io: impl Fn(io::Error) -> E,
    mut take: impl FnMut(&[u8]) -> Result<(), E>,
) -> Result<(), E> {
    let file = if is_open_file(path) { File::open(path) } else { open_file(path).map(|(file, _)| file) };
    let mut file = file.map_err(&of_io)?;
    let mut bytes = Vec::new();
    loop {
        let kept = bytes.len();
        if kept as u64 > PART {
            check_memory(kept as u64 + PART).map_err(|error| of_io(io::Error::other(error)))?;
        }
        let n_read = file.by_ref().take(PART).read_to_end(&mut bytes).map_err(&of_io)?;
        if n_read == 0 {
            return if bytes.is_empty() { Ok(()) } else { take(&bytes) };
        }
        if let Some(last) = bytes[kept..].iter().rposition(|&byte| byte == b'\n') {
            let rest = kept + last + 1;
            take(&bytes[..rest])?;
            bytes.drain(..rest);
        }
    }
}

fn check_kind(metadata: &fs::Metadata) -> io::Result<()> {
    match () {
        () if metadata.is_file() => Ok(()),
        () if metadata.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        () => Err(io::Error::other("a pipe or a device, expected a file")),
    }
}

/// Whether a path is the name that the system gives to an open file of this process. A link to such
/// a name is not.
fn is_open_file(path: &Path) -> bool {
    let names: Vec<_> = path.components().filter(|name| *name != Component::RootDir).collect();
    let names: Option<Vec<&str>> = names.iter().map(|name| name.as_os_str().to_str()).collect();
    let is_number = |name: &str| !name.is_empty() && name.bytes().all(|digit| digit.is_ascii_digit());
    path.is_absolute()
        && match names.as_deref() {
            Some(["dev", "stdin"]) => true,
            Some(["dev", "fd", number] | ["proc", "self", "fd", number]) => is_number(number),
            _ => false,
        }
}

/// - `expected`: number of bytes, as far as it is known
fn read_to_end(mut file: File, expected: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // One byte more shows that there are no more.
    let mut part = if expected > 0 { expected.saturating_add(1) } else { PART };
    loop {
        // Small files are not worth the question.
        if part > PART || !bytes.is_empty() {
            check_memory(part).map_err(io::Error::other)?;
        }
        bytes.try_reserve_exact(part as usize)?;
        let n_read = file.by_ref().take(part).read_to_end(&mut bytes)? as u64;
        if n_read < part {
            bytes.shrink_to_fit();
            return Ok(bytes);
        }
        part = PART.max(bytes.len() as u64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn pipes_and_devices_are_no_files() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("file"), "some text").unwrap();
        std::os::unix::fs::symlink("file", at("link")).unwrap();
        std::os::unix::fs::symlink("/dev/zero", at("zero")).unwrap();
        std::os::unix::fs::symlink("/dev/stdin", at("stdin")).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
        for read in [read_file, read_named] {
            assert_eq!(read(&at("file")).unwrap(), b"some text");
            assert_eq!(read(&at("link")).unwrap(), b"some text");
            for name in ["zero", "pipe"] {
                assert!(read(&at(name)).unwrap_err().to_string().contains("a pipe or a device"), "{name}");
            }
            assert_eq!(read(folder.path()).unwrap_err().kind(), io::ErrorKind::IsADirectory);
            assert_eq!(read(&at("gone")).unwrap_err().kind(), io::ErrorKind::NotFound);
        }
    }

    #[test]
    fn only_the_system_s_own_names_are_open_files() {
        for path in ["/dev/stdin", "/dev/fd/63", "/proc/self/fd/0"] {
            assert!(is_open_file(Path::new(path)), "{path}");
        }
        for path in ["dev/stdin", "/dev/zero", "/dev/fd", "/dev/fd/x", "/dev/fd/0/a", "/proc/1/fd/0", "/a/dev/stdin"] {
            assert!(!is_open_file(Path::new(path)), "{path}");
        }
    }

    /// Lines of many lengths, also of more than a part: the pieces end with a line, and are the
    /// file.
    #[test]
    fn pieces_are_whole_lines() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        for last in ["", "\n"] {
            let lines = (0..3000).map(|at| "x".repeat(at)).chain(["y".repeat(3 * PART as usize), "z".to_owned()]);
            let text = lines.collect::<Vec<_>>().join("\n") + last;
            fs::write(&path, &text).unwrap();
            let (mut pieces, mut n_pieces) = (Vec::new(), 0);
            let take = |piece: &[u8]| {
                assert!(pieces.is_empty() || pieces.ends_with(b"\n"));
                pieces.extend_from_slice(piece);
                n_pieces += 1;
                Ok::<_, io::Error>(())
            };
            read_lines(&path, |error| error, take).unwrap();
            assert!(pieces == text.as_bytes() && n_pieces > 4, "{n_pieces}");
        }
    }

    /// Longer than a part, and longer than the system says.
    #[test]
    fn a_file_is_read_to_its_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let bytes: Vec<u8> = (0..5 * PART + 7).map(|at| (at % 251) as u8).collect();
        fs::write(&path, &bytes).unwrap();
        assert!(read_file(&path).unwrap() == bytes);
        assert!(read_to_end(File::open(&path).unwrap(), 0).unwrap() == bytes);
    }
}
