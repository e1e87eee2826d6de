//! Damages golden files of all mesh formats, cases, profiles and displacements at random, on and
//! on: no reader may panic, hang or write back other bytes.
//!
//! `cargo bench --bench damage -- [ROUNDS] [SEED]`: a million rounds from the seed 1. What a reader
//! did not survive lies in `target/damage`.

#[path = "../tests/formats/damage.rs"]
mod damage;

#[path = "../tests/formats/damage_inputs.rs"]
mod damage_inputs;

mod common;

use std::panic::catch_unwind;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use common::{Failure, on_core};
use damage::{Random, damage as damaged, seeds, survives};

/// A reader that takes longer on its core for a file of 45 kB hangs, or might as well, s.
const PATIENCE: f64 = 1.0;

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let numbers = common::numbers(&[1_000_000, 1])?;
    let (rounds, seed) = (numbers[0], numbers.get(1).copied().unwrap_or(1));
    let meshes = seeds().into_iter().map(|seed| (seed, survives as fn(&str, &[u8]) -> bool));
    let inputs = damage_inputs::seeds().into_iter().map(|seed| (seed, damage_inputs::survives as _));
    let seeds: Vec<_> = meshes.chain(inputs).collect();
    let mut random = Random(seed as u64);
    let (mut n_read, mut n_failed) = (0, 0);
    let start = Instant::now();
    for round in 0..rounds {
        let (seed, survives) = &seeds[round % seeds.len()];
        let bytes = damaged(&seed.bytes, &mut random);
        let begin = (Instant::now(), on_core());
        let outcome = catch_unwind(|| survives(&seed.name, &bytes));
        // Other work on the machine makes no reader slow.
        let taken = on_core().zip(begin.1).map(|(end, begin)| end - begin);
        if outcome.is_err() || taken.unwrap_or_else(|| begin.0.elapsed().as_secs_f64()) > PATIENCE {
            n_failed += 1;
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/damage");
            std::fs::create_dir_all(&folder)?;
            let path = folder.join(format!("{round}.{}", seed.name.replace('/', ".")));
            std::fs::write(&path, &bytes)?;
            println!("not survived: {}", path.display());
        }
        n_read += usize::from(outcome.unwrap_or(false));
    }
    println!(
        "{rounds} damaged files from {} golden ones in {:.1} s: {n_read} were read, {n_failed} not survived",
        seeds.len(),
        start.elapsed().as_secs_f64()
    );
    if n_failed == 0 { Ok(()) } else { Err(format!("{n_failed} files were not survived").into()) }
}
