//! No file makes a reader panic, hang or take the machine's memory: damaged copies of every golden
//! file, and of the files beside a mesh. What was read, moved and written is the same mesh again.
//!
//! The bounded run of every day; `cargo bench --bench damage -- 1000000` runs on.

use std::process::Command;

#[path = "formats/damage.rs"]
mod damage;

#[path = "formats/damage_inputs.rs"]
mod damage_inputs;

use damage::{Random, damage as damaged, seeds, survives};

const ROUNDS: usize = 40_000;

/// Rounds for the case, profiles and displacements.
const INPUT_ROUNDS: usize = 100_000;

/// Greatest size that the process has had, in bytes of addresses, where the system tells.
fn most_memory() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmPeak:"))?;
    Some(line.split_whitespace().next()?.parse::<usize>().ok()? * 1024)
}

/// Runs a test of this file again, alone in a process in which all threads take memory from one
/// place. Otherwise glibc sets 64 MiB of addresses aside whenever a thread first asks for memory,
/// and the test would count them as a reader's.
fn alone_in_a_process(test: &str) {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", test, "--nocapture"])
        .env("MALLOC_ARENA_MAX", "1")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("1 passed"), "{text}");
}

#[test]
fn damaged_files_of_every_format_are_survived() {
    if most_memory().is_some() && std::env::var_os("MALLOC_ARENA_MAX").is_none() {
        return alone_in_a_process("damaged_files_of_every_format_are_survived");
    }
    let seeds = seeds();
    assert!(seeds.len() > 45, "{} golden files", seeds.len());
    // Once unharmed, so that what the process needs anyway is there.
    assert!(seeds.iter().all(|seed| survives(&seed.name, &seed.bytes)));
    let before = most_memory();
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut n_read = 0;
    for round in 0..ROUNDS {
        let seed = &seeds[round % seeds.len()];
        let bytes = damaged(&seed.bytes, &mut random);
        n_read += usize::from(survives(&seed.name, &bytes));
    }
    // The files are smaller than 45 kB.
    if let (Some(before), Some(after)) = (before, most_memory()) {
        assert!(after - before < 64 << 20, "{} bytes more", after - before);
    }
    assert!((ROUNDS / 50..ROUNDS - ROUNDS / 20).contains(&n_read), "{n_read} of {ROUNDS} damaged files were read");
}

#[test]
fn damaged_cases_profiles_and_displacements_are_survived() {
    let seeds = damage_inputs::seeds();
    for seed in &seeds {
        assert!(damage_inputs::survives(&seed.name, &seed.bytes), "{}", seed.name);
    }
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    let mut n_read = 0;
    for round in 0..INPUT_ROUNDS {
        let seed = &seeds[round % seeds.len()];
        n_read += usize::from(damage_inputs::survives(&seed.name, &damaged(&seed.bytes, &mut random)));
    }
    let some = INPUT_ROUNDS / 50..INPUT_ROUNDS - INPUT_ROUNDS / 20;
    assert!(some.contains(&n_read), "{n_read} of {INPUT_ROUNDS} damaged files were read");
}
