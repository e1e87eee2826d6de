//! Checks the available memory before a large allocation.
//!
//! A mesh that needs more memory gets an error with both numbers. Without the check the system
//! would end the process.
//!
//! The user may set a limit for the process ([`set_most`]). The limit also says how far a packed
//! file may unpack ([`most_unpacked`]).

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::{fs, path::Path};

use thiserror::Error;

/// Less memory is available than needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "this takes about {:.3} GB of memory, but {:.3} GB are available",
    1e-9 * *needed as f64, 1e-9 * *available as f64
)]
pub struct MemoryError {
    /// Bytes needed.
    pub needed: u64,
    /// Bytes available.
    pub available: u64,
}

/// The user's limit in bytes. 0 stands for no limit.
static MOST: AtomicU64 = AtomicU64::new(0);

/// Largest size of an unpacked file: this multiple of its packed size, and so many bytes more. Text
/// meshes shrink to a tenth, and hardly any mesh to a fortieth. Files that are made to fill the
/// memory shrink to a thousandth.
const UNPACKED: u64 = 64;
const UNPACKED_BESIDE: u64 = 16 << 20;

/// Sets the most memory that the process may take, in bytes. [`check_memory`] then refuses what
/// needs more, and a packed file may unpack to as much.
pub fn set_most(bytes: u64) {
    MOST.store(bytes.max(1), Relaxed);
}

/// The most bytes to which a packed file may unpack: a multiple of its size, or the limit of
/// [`set_most`] if this is more.
///
/// - `packed`: bytes of the packed file
pub fn most_unpacked(packed: u64) -> u64 {
    packed.saturating_mul(UNPACKED).saturating_add(UNPACKED_BESIDE).max(MOST.load(Relaxed))
}

/// Checks that this number of bytes is available. If the system does not give the available memory,
/// the check passes.
///
/// # Errors
/// [`MemoryError`]: fewer bytes are available.
pub fn check_memory(needed: u64) -> Result<(), MemoryError> {
    enough(needed, available_memory())
}

fn enough(needed: u64, available: Option<u64>) -> Result<(), MemoryError> {
    match available {
        Some(available) if available < needed => Err(MemoryError { needed, available }),
        _ => Ok(()),
    }
}

/// Bytes that the process may still use: the smallest of the system's available memory, the rest of
/// the process's own limit (`ulimit -v`), the rest of the user's limit ([`set_most`]), and the rest
/// of the limits of its control groups. Linux gives these numbers. `None` if the system gives none
/// of them, and the user no limit.
fn available_memory() -> Option<u64> {
    let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let of_system = kilobytes(&read("/proc/meminfo"), "MemAvailable:");
    let status = read("/proc/self/status");
    let taken = kilobytes(&status, "VmSize:");
    let of_process = limit(&read("/proc/self/limits")).zip(taken).map(|(limit, taken)| limit.saturating_sub(taken));
    let of_user = Some(MOST.load(Relaxed)).filter(|&most| most > 0);
    let of_user = of_user.map(|most| most.saturating_sub(kilobytes(&status, "VmRSS:").unwrap_or(0)));
    let of_groups = left_in_groups(&read("/proc/self/cgroup"), Path::new("/sys/fs/cgroup"));
    [of_system, of_process, of_user, of_groups].into_iter().flatten().min()
}

/// Whether the system limits the addresses of the process (`ulimit -v`). Linux tells. `false` where
/// the system does not tell.
pub fn has_limit_of_addresses() -> bool {
    limit(&fs::read_to_string("/proc/self/limits").unwrap_or_default()).is_some()
}

/// The files in which a version of control groups gives a group's limit and use.
struct GroupFiles {
    /// The folder of the groups.
    folder: &'static str,
    limit: &'static str,
    taken: &'static str,
    /// Beginning of the line in `memory.stat` with the bytes that the system frees on demand, such
    /// as copies of files.
    given_back: &'static str,
}

const VERSION_1: GroupFiles = GroupFiles {
    folder: "memory",
    limit: "memory.limit_in_bytes",
    taken: "memory.usage_in_bytes",
    given_back: "total_inactive_file ",
};

const VERSION_2: GroupFiles =
    GroupFiles { folder: "", limit: "memory.max", taken: "memory.current", given_back: "inactive_file " };

/// Bytes left in the control group with the fewest left, among the groups of a process and their
/// parents. Jobs of a cluster and containers have such limits. `None` if no group has a limit.
///
/// - `membership`: contents of `/proc/self/cgroup`
/// - `root`: the folder with all groups
fn left_in_groups(membership: &str, root: &Path) -> Option<u64> {
    let of_group = |line: &str| {
        let (controllers, path) = line.split_once(':')?.1.split_once(':')?;
        let files = match controllers {
            "" => &VERSION_2,
            _ if controllers.split(',').any(|controller| controller == "memory") => &VERSION_1,
            _ => return None,
        };
        let folder = root.join(files.folder);
        // In a container the path may be valid only outside the container. Then only the folder of
        // all groups exists.
        Path::new(path.trim_start_matches('/')).ancestors().filter_map(|group| left(&folder.join(group), files)).min()
    };
    membership.lines().filter_map(of_group).min()
}

/// Bytes left in one group. `None` if the group has no limit.
fn left(group: &Path, files: &GroupFiles) -> Option<u64> {
    let number = |name: &str| fs::read_to_string(group.join(name)).ok()?.trim().parse::<u64>().ok();
    let (limit, taken) = (number(files.limit)?, number(files.taken)?);
    let statistics = fs::read_to_string(group.join("memory.stat")).unwrap_or_default();
    let given_back =
        statistics.lines().find_map(|line| line.strip_prefix(files.given_back)?.trim().parse::<u64>().ok());
    Some(limit.saturating_sub(taken.saturating_sub(given_back.unwrap_or(0))))
}

/// The bytes in a line `name 1234 kB`.
fn kilobytes(text: &str, name: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// Bytes of the process's limit on its address space. `None` if there is no limit.
fn limit(limits: &str) -> Option<u64> {
    let rest = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    rest.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_linux_says_is_understood() {
        let meminfo = "MemTotal:       24684084 kB\nMemFree:        17057476 kB\nMemAvailable:   23499800 kB\n";
        assert_eq!(kilobytes(meminfo, "MemAvailable:"), Some(23_499_800 * 1024));
        assert_eq!(kilobytes("MemTotal: 5 kB\n", "MemAvailable:"), None);
        let limits = |soft: &str| {
            format!(
                "Limit                     Soft Limit  Hard Limit  Units\nMax address space         {soft}  9999  bytes\n"
            )
        };
        assert_eq!(limit(&limits("4096000")), Some(4_096_000));
        assert_eq!(limit(&limits("unlimited")), None);
        assert!(!cfg!(target_os = "linux") || available_memory().is_some_and(|bytes| bytes > 1 << 20));
    }

    /// Files as in the kernel's documentation of control groups, both versions.
    #[test]
    fn the_tightest_control_group_counts() {
        let root = tempfile::tempdir().unwrap();
        let write = |group: &str, files: &[(&str, &str)]| {
            fs::create_dir_all(root.path().join(group)).unwrap();
            for (name, text) in files {
                fs::write(root.path().join(group).join(name), text).unwrap();
            }
        };
        let left = |membership: &str| left_in_groups(membership, root.path());
        assert_eq!(left("0::/job\n"), None);
        write("job", &[("memory.max", "max\n"), ("memory.current", "3000\n")]);
        assert_eq!(left("0::/job\n"), None);
        write("job/step", &[("memory.max", "9000\n"), ("memory.current", "3000\n")]);
        assert_eq!(left("0::/job/step\n"), Some(6000));
        write("job/step", &[("memory.stat", "anon 1000\nfile 2000\ninactive_file 1500\n")]);
        assert_eq!(left("0::/job/step\n"), Some(7500));
        write("job", &[("memory.max", "5000\n")]);
        assert_eq!(left("0::/job/step\n"), Some(2000));

        assert_eq!(left("4:memory:/gone\n"), None);
        write("memory", &[("memory.limit_in_bytes", "8000\n"), ("memory.usage_in_bytes", "7000\n")]);
        write("memory", &[("memory.stat", "inactive_file 1\ntotal_inactive_file 500\n")]);
        assert_eq!(left("5:cpu,cpuacct:/\n4:memory:/gone\n0::/\n"), Some(1500));
    }

    #[test]
    fn a_refusal_has_both_numbers() {
        assert_eq!(enough(5, Some(5)), Ok(()));
        assert_eq!(enough(5, None), Ok(()));
        let refused = enough(12_340_000_000, Some(7_900_000_000)).unwrap_err();
        assert_eq!(refused.to_string(), "this takes about 12.340 GB of memory, but 7.900 GB are available");
        assert!(check_memory(u64::MAX).is_err() || !cfg!(target_os = "linux"));
    }
}
