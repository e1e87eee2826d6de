//! Moves the mesh of a case to one design after another, as an optimiser does. The mover is set up
//! once.
//!
//! `cargo run --release --example design_loop -- CASE.toml`

use std::error::Error;

use idmesh::{backend, case::Case, mover::Design};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "examples/wing-body/case.toml".to_owned());
    for (bend, lift) in run(&path)? {
        println!("bent up by {bend} a profile: the mesh moves up by at most {lift:.4}");
    }
    Ok(())
}

/// Bends the wings up more and more. Returns pairs of the bend and the mesh's largest upward
/// displacement, both in the mesh's unit.
///
/// # Errors
/// The case cannot be loaded, the backend failed, or a result is not valid.
pub fn run(path: &str) -> Result<Vec<(f64, f64)>, Box<dyn Error>> {
    let case = Case::load(path)?;
    let mut mover = case.mover(backend::select(backend::Selection::Cpu)?)?;
    let mut lifts = Vec::new();
    for bend in [0.01, 0.02, 0.04] {
        let mut design = Design::default();
        for (wing, old) in case.old_profiles() {
            let mut new = old.to_vec();
            for (index, profile) in new.iter_mut().enumerate() {
                profile.points.iter_mut().for_each(|point| point.z += bend * index as f64);
            }
            design = design.with_profiles(wing, new);
        }
        let outcome = mover.update(&design)?;
        let moved = outcome.valid()?;
        lifts.push((bend, moved.displacement().iter().map(|by| by.z).fold(0.0, f64::max)));
    }
    Ok(lifts)
}
