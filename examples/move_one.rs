//! Moves the mesh of a case to the design of the case, and writes the moved mesh to the outputs of
//! the case.
//!
//! `cargo run --release --example move_one -- CASE.toml`

use std::error::Error;

use idmesh::{backend, case::Case};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "examples/wing-body/case.toml".to_owned());
    run(&path)
}

/// Moves the mesh of a case file and writes the outputs.
///
/// # Errors
/// The case cannot be loaded, the backend failed, an output cannot be written, or the result may
/// not be used.
pub fn run(path: &str) -> Result<(), Box<dyn Error>> {
    let case = Case::load(path)?;
    let mut mover = case.mover(backend::select(backend::Selection::Auto)?)?;
    let outcome = mover.update(&case.design)?;
    // A mesh that is not valid gets another name: `NAME.invalid.EXT`.
    for file in case.write(&outcome)? {
        println!("wrote {}", file.display());
    }
    outcome.check()?;
    Ok(())
}
