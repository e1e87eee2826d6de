//! Runs a mover on a thread of its own. One channel carries designs to the thread, and another
//! carries worst betas back.
//!
//! `cargo run --release --example own_thread -- CASE.toml`

use std::{error::Error, sync::mpsc, thread};

use idmesh::{backend, case::Case, mover::Design};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "examples/wing-body/case.toml".to_owned());
    println!("worst beta {}", run(&path)?);
    Ok(())
}

/// Returns the worst beta of the case's design. The beta of a tet is its volume over the cube of
/// its longest edge.
///
/// # Errors
/// The case cannot be loaded, the backend failed, or the result is not valid.
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
