//! What the figures were measured on and with.

use std::{
    fs,
    process::Command,
    time::{SystemTime, UNIX_EPOCH},
};

use idmesh::backend::{self, AdapterSummary};

use crate::{common, print_cells, print_header};

/// Prints the machine, the adapters, the date and the commit.
pub fn print() {
    println!("# idmesh {} on a GPU\n", env!("CARGO_PKG_VERSION"));
    print_header(&["", ""]);
    let field = |name: &str, value: String| print_cells(&[name.to_owned(), value]);
    field("date", date(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs() / 86_400)));
    field("commit", commit());
    let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let of = |text: &str, name: &str| {
        let line = text.lines().find(|line| line.starts_with(name)).unwrap_or_default();
        line.split_once(':').map_or_else(String::new, |(_, value)| value.trim().to_owned())
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    field("processor", format!("{}, {threads} threads", of(&read("/proc/cpuinfo"), "model name")));
    let kilobytes: f64 = of(&read("/proc/meminfo"), "MemTotal").trim_end_matches(" kB").parse().unwrap_or(f64::NAN);
    field("memory", format!("{:.0} GB", kilobytes * 1.024e-6));
    let system = [std::env::consts::OS, std::env::consts::ARCH, read("/proc/sys/kernel/osrelease").trim()].join(" ");
    field("system", system);
    let profile = if cfg!(debug_assertions) { "debug: these times mean nothing" } else { "release" };
    field("build", profile.to_owned());
    for (at, AdapterSummary { name, kind, driver, api, max_array_bytes, arithmetic, auto }) in
        backend::adapters().into_iter().enumerate()
    {
        let which = if at == 0 { "adapter, measured" } else { "adapter, not measured" };
        let auto = if auto { ", taken by `auto`" } else { "" };
        let arrays = max_array_bytes >> 20;
        let arithmetic = arithmetic.name();
        field(which, format!("{name}: {kind}, {api}, {driver}, arrays up to {arrays} MiB, {arithmetic}{auto}"));
    }
    if backend::adapters().iter().all(|adapter| adapter.kind == "software") {
        println!("\nNo hardware GPU: these times say nothing about hardware.");
    }
}

/// The commit: from a file beside the program, else from git.
fn commit() -> String {
    let root = common::root();
    let carried = fs::read_to_string(root.join("commit")).ok().map(|text| text.trim().to_owned());
    let of_git = || {
        let output = Command::new("git").args(["rev-parse", "--short", "HEAD"]).current_dir(&root).output().ok()?;
        Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
    };
    carried.or_else(of_git).filter(|text| !text.is_empty()).unwrap_or_else(|| "unknown".to_owned())
}

/// A day of the Gregorian calendar.
///
/// - `days`: since 1970-01-01
fn date(days: u64) -> String {
    // Years begin in March, so that the leap day is the last of its year. An era has 400 years.
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let (month, year) = if month < 10 { (month + 3, year) } else { (month - 9, year + 1) };
    format!("{:04}-{month:02}-{day:02}", year + 400 * era)
}
