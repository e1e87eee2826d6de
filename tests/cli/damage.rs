//! A few of the damaged runs of `benches/damaged_runs.rs`.

use crate::damaged_runs::{Random, inputs, run_damaged};

const RUNS: usize = 42;

#[test]
fn damaged_files_end_a_run_as_documented() {
    let inputs = inputs();
    let mut random = Random(0x6a09_e667_f3bc_c909);
    let codes: Vec<i32> = (0..RUNS)
        .map(|round| run_damaged(&inputs, round, &mut random).unwrap_or_else(|wrong| panic!("{wrong}")))
        .collect();
    assert!(codes.contains(&0) && codes.contains(&3), "the damage is not worth testing: {codes:?}");
}
