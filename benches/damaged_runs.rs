//! Runs the command on damaged files, on and on: every run ends with a documented exit code and
//! leaves no files but its results.
//!
//! `cargo bench --bench damaged_runs -- [RUNS] [SEED]`: 3000 runs from the seed 1.

#[allow(dead_code, reason = "the rest is for the tests of the command")]
#[path = "../tests/cli/fixture.rs"]
mod fixture;
#[path = "../tests/common/schema.rs"]
mod schema;
#[allow(dead_code, reason = "the rest is for the tests of the command")]
#[path = "../tests/cli/wing_box.rs"]
mod wing_box;

#[path = "../tests/cli/damaged_runs.rs"]
mod damaged_runs;

mod common;

use std::collections::BTreeMap;
use std::process::ExitCode;
use std::time::Instant;

use common::Failure;
use damaged_runs::{Random, inputs, run_damaged};

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let numbers = common::numbers(&[3000, 1])?;
    let (runs, seed) = (numbers[0], numbers.get(1).copied().unwrap_or(1));
    let inputs = inputs();
    let mut random = Random(seed as u64);
    let mut codes: BTreeMap<i32, usize> = BTreeMap::new();
    let mut n_wrong = 0;
    let start = Instant::now();
    for round in 0..runs {
        match run_damaged(&inputs, round, &mut random) {
            Ok(code) => *codes.entry(code).or_default() += 1,
            Err(wrong) => {
                n_wrong += 1;
                println!("run {round}: {wrong}");
            }
        }
    }
    println!(
        "{runs} runs on damaged files in {:.1} s: exit codes {codes:?}, {n_wrong} wrong",
        start.elapsed().as_secs_f64()
    );
    if n_wrong == 0 { Ok(()) } else { Err(format!("{n_wrong} runs were wrong").into()) }
}
