//! Temporary files, which become results when they are complete.
//!
//! The name of a temporary file holds the host and the process that make the file, and the process
//! holds a lock on the file. A file that a killed process left behind is thereby known, and the
//! next run removes the file.

use std::ffi::OsString;
use std::fs::{self, DirEntry, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::process;
use std::sync::LazyLock;
use std::thread;
use std::time::Duration;

use tempfile::{Builder, NamedTempFile};

use super::sums::sha256_of_text;

/// Temporary files begin with this.
const PREFIX: &str = ".idmesh-";

/// A file whose process cannot be looked up is left behind if no process holds a lock on the file
/// and the file is at least this old. A process takes its lock just after it has made its file.
const ABANDONED: Duration = Duration::from_secs(60);

/// The name of this computer, as far as a file's name can hold it.
static HOST: LazyLock<String> = LazyLock::new(|| {
    let name = fs::read_to_string("/proc/sys/kernel/hostname").or_else(|_| std::env::var("HOSTNAME"));
    let name = name.unwrap_or_default();
    let fits = |letter: char| if letter.is_ascii_alphanumeric() || letter == '.' { letter } else { '_' };
    name.trim().chars().map(fits).take(64).collect()
});

/// The name of this computer, as far as a file's name can hold it. Empty if the system gives none.
pub(crate) fn host() -> &'static str {
    &HOST
}

/// Makes a temporary file in a folder. Dropping it removes the file.
///
/// # Errors
/// The file cannot be made. The error does not hold the temporary name, which would confuse a user.
pub(crate) fn temporary(folder: &Path) -> io::Result<NamedTempFile> {
    with_suffix(folder, "")
}

fn with_suffix(folder: &Path, suffix: &str) -> io::Result<NamedTempFile> {
    let prefix = format!("{PREFIX}{}-{}-", *HOST, process::id());
    let mut builder = Builder::new();
    builder.prefix(&prefix).suffix(suffix);
    // Temporary files are private by default (0600). This file becomes a result that others may
    // read. The umask still applies.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder).map_err(without_path)?;
    // A file system without locks leaves the process's number as the only sign of life.
    let _ = file.as_file().lock();
    Ok(file)
}

/// The error of the system in an error that ends with the path of the temporary file. The error
/// gives it as text alone.
fn without_path(error: io::Error) -> io::Error {
    match error.to_string().split_once(" at path ") {
        Some((why, _)) => io::Error::new(error.kind(), why),
        None => error,
    }
}

/// Most bytes of a file's name that the name of its sign holds. A longer name leaves no room.
const MOST_OF_NAME: usize = 128;

/// How often a process looks whether others that want a file for themselves have given way, and the
/// pause between.
const LOOKS: usize = 100;
const PAUSE: Duration = Duration::from_millis(10);

/// The sign of a process that it writes into a file again and again. Dropping it removes the sign.
#[derive(Debug)]
pub(crate) struct Claim {
    sign: NamedTempFile,
    folder: PathBuf,
    /// The signs of one file end alike.
    suffix: String,
}

impl Claim {
    /// Puts the sign beside a file.
    ///
    /// # Errors
    /// The folder of the file takes no files.
    pub(crate) fn new(path: &Path) -> io::Result<Self> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.len() > MOST_OF_NAME {
            name = sha256_of_text(&name);
        }
        let suffix = format!("-writes-{name}");
        Ok(Self { sign: with_suffix(folder, &suffix)?, folder: folder.to_path_buf(), suffix })
    }

    /// [`Claim::new`] for a process that wants the file for itself; `None` if another process
    /// writes into it. Of several that begin at once one gets the file: the others see its sign,
    /// and the one whose sign has the least name waits until they have given way.
    ///
    /// # Errors
    /// The folder of the file takes no files.
    pub(crate) fn alone(path: &Path) -> io::Result<Option<Self>> {
        let claim = Self::new(path)?;
        for _ in 0..LOOKS {
            match claim.others().min() {
                None => return Ok(Some(claim)),
                Some(other) if Some(&*other) < claim.sign.path().file_name() => return Ok(None),
                Some(_) => thread::sleep(PAUSE),
            }
        }
        Ok(None)
    }

    /// Whether another process writes into the file now.
    pub(crate) fn is_shared(&self) -> bool {
        self.others().next().is_some()
    }

    /// The names of the signs of others.
    fn others(&self) -> impl Iterator<Item = OsString> {
        let is_other = |other: &DirEntry| {
            let name = other.file_name();
            Some(&*name) != self.sign.path().file_name()
                && name.to_str().is_some_and(|name| name.ends_with(&self.suffix))
                && !is_abandoned(other)
        };
        temporary_files(&self.folder).filter(is_other).map(|other| other.file_name())
    }
}

/// Removes the temporary files of a folder whose processes have ended. A file that cannot be
/// removed stays.
pub(super) fn remove_abandoned(folder: &Path) {
    for entry in temporary_files(folder).filter(is_abandoned) {
        let _ = fs::remove_file(entry.path());
    }
}

fn temporary_files(folder: &Path) -> impl Iterator<Item = DirEntry> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter(|entry| {
        entry.file_name().to_string_lossy().starts_with(PREFIX) && entry.file_type().is_ok_and(|kind| kind.is_file())
    })
}

/// Whether a temporary file has no process any more.
fn is_abandoned(file: &DirEntry) -> bool {
    let path = &file.path();
    let name = file.file_name();
    // `.idmesh-HOST-PROCESS-LETTERS`
    let owner: Vec<&str> = name.to_str().unwrap_or_default().splitn(4, '-').collect();
    let has_ended = matches!(owner[..], [_, host, process, _] if has_ended(host, process));
    let age = || fs::metadata(path)?.modified()?.elapsed().map_err(io::Error::other);
    if !has_ended && !age().is_ok_and(|age| age >= ABANDONED) {
        return false;
    }
    match OpenOptions::new().read(true).write(true).open(path).as_ref().map(File::try_lock) {
        Ok(Ok(())) => true,
        Ok(Err(TryLockError::WouldBlock)) => false,
        // Without locks, and without the right to open the file, the number of the process decides.
        Ok(Err(TryLockError::Error(_))) | Err(_) => has_ended,
    }
}

/// Whether a process is one of this computer that does not run. Processes of other computers, and
/// of systems without `/proc`, are not known to have ended.
fn has_ended(host: &str, process: &str) -> bool {
    let of_here = host == *HOST && process.parse::<u32>().is_ok() && Path::new("/proc/self").exists();
    of_here && !Path::new("/proc").join(process).exists()
}

#[cfg(test)]
mod tests {
    use std::process::Command;
    use std::time::SystemTime;

    use super::*;

    /// A message has the system's words, and not the name of a temporary file.
    #[cfg(target_os = "linux")]
    #[test]
    fn errors_have_the_words_of_the_system() {
        let folder = tempfile::tempdir().unwrap();
        let error = with_suffix(&folder.path().join("gone"), "").unwrap_err();
        let told = (error.to_string(), error.kind());
        assert_eq!(told, ("No such file or directory (os error 2)".to_owned(), io::ErrorKind::NotFound));
    }

    /// The number of a process that has ended.
    fn ended() -> u32 {
        let mut child = Command::new("true").spawn().unwrap();
        child.wait().unwrap();
        child.id()
    }

    /// Files of killed processes go; files of running processes, of other computers and of others'
    /// making stay. Fails if ABANDONED is a day or nothing.
    #[test]
    #[cfg(target_os = "linux")]
    fn files_of_ended_processes_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let held = temporary(folder.path()).unwrap();
        let make = |name: &str, age: u64| {
            let file = File::create(folder.path().join(name)).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(age)).unwrap();
        };
        held.as_file().set_modified(SystemTime::now() - Duration::from_secs(7200)).unwrap();
        let (ended, own) = (ended(), process::id());
        make(&format!(".idmesh-{}-{ended}-abcdef", *HOST), 0);
        make(&format!(".idmesh-{}-{own}-young", *HOST), 0);
        make(&format!(".idmesh-elsewhere-{ended}-young"), 2);
        make(&format!(".idmesh-elsewhere-{ended}-old"), 3600);
        make(&format!(".idmesh-{}-{ended}-abcdef-writes-my-reports.jsonl", *HOST), 0);
        make(".idmesh-old", 3600);
        make(".idmesh-young", 0);
        make("result.msh", 3600);
        // A name as another program may choose it.
        fs::create_dir(folder.path().join(".idmesh-folder")).unwrap();
        remove_abandoned(folder.path());
        let entries = fs::read_dir(folder.path()).unwrap();
        let mut left: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        left.sort();
        let held = held.path().file_name().unwrap().to_str().unwrap().to_owned();
        let mut expected = [
            format!(".idmesh-{}-{own}-young", *HOST),
            format!(".idmesh-elsewhere-{ended}-young"),
            ".idmesh-folder".to_owned(),
            ".idmesh-young".to_owned(),
            held,
            "result.msh".to_owned(),
        ];
        expected.sort();
        assert_eq!(left, expected);
    }

    /// Two processes that write into one file know of each other, and of no other file's.
    #[test]
    fn writers_of_one_file_know_of_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let claim = |name: &str| Claim::new(&folder.path().join(name)).unwrap();
        let first = claim("a-b.jsonl");
        assert!(!first.is_shared() && !claim("c.jsonl").is_shared());
        let second = claim("a-b.jsonl");
        assert!(first.is_shared() && second.is_shared());
        drop(first);
        assert!(!second.is_shared());
        // The longest name that a file may have.
        assert!(!claim(&"n".repeat(255)).is_shared());
    }

    /// Of many that want a file for themselves at once one gets it. Fails if all see each other and
    /// give way, and if one looks before its own sign is there.
    #[test]
    fn one_of_many_gets_a_file_for_itself() {
        let folder = tempfile::tempdir().unwrap();
        for round in 0..4 {
            let path = folder.path().join(format!("{round}.jsonl"));
            let together = std::sync::Barrier::new(6);
            let got: Vec<Claim> = thread::scope(|scope| {
                let work = || {
                    together.wait();
                    Claim::alone(&path).unwrap()
                };
                let threads: Vec<_> = (0..6).map(|_| scope.spawn(work)).collect();
                threads.into_iter().filter_map(|thread| thread.join().unwrap()).collect()
            });
            assert_eq!(got.len(), 1, "round {round}");
            let late = Claim::alone(&path).unwrap();
            assert!(late.is_none() && !got[0].is_shared());
        }
    }
}
