//! Memory, asked for before it is taken: a large mesh is refused with two numbers instead of a process that the system ends.

use std::fs;

use thiserror::Error;

/// Less memory is available than is needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "this takes about {:.2} GB of memory, but {:.2} GB are available",
    1e-9 * *needed as f64, 1e-9 * *available as f64
)]
pub struct MemoryError {
    /// Bytes to be taken.
    pub needed: u64,
    /// Bytes to be had.
    pub available: u64,
}

/// Makes sure that so many bytes can be had, as far as the system tells.
///
/// # Errors
/// They cannot.
pub fn check_memory(needed: u64) -> Result<(), MemoryError> {
    enough(needed, available_memory())
}

fn enough(needed: u64, available: Option<u64>) -> Result<(), MemoryError> {
    match available {
        Some(available) if available < needed => Err(MemoryError { needed, available }),
        _ => Ok(()),
    }
}

/// Bytes the process may still take: what the system has left, within the process's own limit (`ulimit -v`). `None` where the
/// system does not tell; Linux does.
fn available_memory() -> Option<u64> {
    let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let of_system = kilobytes(&read("/proc/meminfo"), "MemAvailable:");
    let taken = kilobytes(&read("/proc/self/status"), "VmSize:");
    let of_process = limit(&read("/proc/self/limits")).zip(taken).map(|(limit, taken)| limit.saturating_sub(taken));
    of_system.into_iter().chain(of_process).min()
}

/// The bytes in a line `name 1234 kB`.
fn kilobytes(text: &str, name: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// The bytes of the limit on a process's addresses that holds; none if it has none.
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

    #[test]
    fn a_refusal_has_both_numbers() {
        assert_eq!(enough(5, Some(5)), Ok(()));
        assert_eq!(enough(5, None), Ok(()));
        let refused = enough(12_340_000_000, Some(7_900_000_000)).unwrap_err();
        assert_eq!(refused.to_string(), "this takes about 12.34 GB of memory, but 7.90 GB are available");
        assert!(check_memory(u64::MAX).is_err() || !cfg!(target_os = "linux"));
    }
}
