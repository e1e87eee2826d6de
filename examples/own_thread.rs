//! A mover on a thread of its own: designs go in by a channel, worst betas come out by another.
//!
//! `cargo run --release --example own_thread -- CASE.toml`

use std::{error::Error, sync::mpsc, thread};

use idmesh::{backend, case::Case, mover::Design};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "examples/wing-body/case.toml".to_owned());
    println!("worst beta {}", run(&path)?);
    Ok(())
}

/// The worst beta of the case's design, in the volume of a tet over the cube of its longest edge.
pub fn run(path: &str) -> Result<f64, Box<dyn Error>> {
    let case = Case::load(path)?;
    let mut mover = case.mover(backend::select(backend::Selection::Cpu)?)?;
    mover.on_progress(|stage| eprintln!("{stage}"));
    let (designs, todo) = mpsc::channel::<Design>();
    let (done, results) = mpsc::channel();
    let worker = thread::spawn(move || {
        for design in todo {
            let result = mover
                .update(&design)
                .map(|outcome| outcome.check().map(|()| outcome.beta.iter().copied().fold(f64::INFINITY, f64::min)));
            if done.send(result).is_err() {
                return;
            }
        }
    });
    designs.send(case.design.clone())?;
    drop(designs);
    let worst = results.recv()???;
    worker.join().map_err(|_| "the mover's thread panicked")?;
    Ok(worst)
}
