//! What a mesh costs by its size, and sweeps as a share of copying.

use std::{sync::Arc, time::Instant};

use idmesh::{
    backend::{Backend, CpuBackend, gpu::Bounds},
    memory::check_memory,
    mesh::{self, OtherCells},
};

use crate::{
    Budget,
    common::{
        Failure,
        cost::{COLUMNS, Cost},
    },
    gpu,
    parity::wing,
    print_cells, print_header,
};

/// Bytes of the process for each tet of a mesh that is refined, set up and moved.
const BYTES: u64 = 700;

/// Above so many tets sweeps are not measured by themselves: their network is made on one thread.
const SWEEPS: usize = 20_000_000;

/// Refining a mesh makes eight tets of one. Set-up grows a little faster.
const GROWTH: f64 = 9.0;

/// Prints the costs of the pitching wing, refined until it is larger than asked for.
///
/// # Errors
/// A mesh does not come out well, or a backend failed at a mesh that fits it.
pub fn run(budget: &Budget) -> Result<(), Failure> {
    let backends: [Arc<dyn Backend>; 2] = [Arc::new(gpu(Bounds::default())?), Arc::new(CpuBackend::default())];
    print_header(&COLUMNS);
    let (_, mut mesh) = wing(0)?;
    // Seconds of each backend at the last size, and of refining.
    let (mut last, mut refining) = ([0.0; 2], 0.0);
    let mut left_out = Vec::new();
    loop {
        let n_tets = mesh.tets.len();
        for (backend, last) in backends.iter().zip(&mut last) {
            let kind = backend.info().kind;
            if *last == f64::INFINITY {
                continue;
            }
            if let Some(why) = budget.refuses(GROWTH * *last) {
                left_out.push(format!("{n_tets} tets on {kind}: not run, {why}"));
                *last = f64::INFINITY;
                continue;
            }
            let start = Instant::now();
            match Cost::of(&mesh, &OtherCells::none(), backend, n_tets <= SWEEPS) {
                Ok(cost) => print_cells(&cost.cells()),
                Err(error) => {
                    left_out.push(format!("{n_tets} tets on {kind}: {error}"));
                    *last = f64::INFINITY;
                    continue;
                }
            }
            *last = start.elapsed().as_secs_f64();
        }
        let next = 8 * n_tets;
        let why = if 1e-6 * next as f64 > budget.millions {
            Some("larger than asked for".to_owned())
        } else if let Err(error) = check_memory(BYTES * next as u64) {
            Some(error.to_string())
        } else if last.iter().all(|seconds| seconds.is_infinite()) {
            Some("the smaller mesh was not run either".to_owned())
        } else {
            budget.refuses(GROWTH * refining)
        };
        if let Some(why) = why {
            left_out.push(format!("{next} tets: not run, {why}"));
            break;
        }
        let start = Instant::now();
        mesh = mesh::refine(&mesh)?;
        refining = start.elapsed().as_secs_f64();
    }
    println!();
    left_out.iter().for_each(|what| println!("- {what}"));
    println!(
        "\nThe model has five passes over the finest level a cycle, each moving every array once as fast as copying does. \
         Coarser levels and all else are not in it. `update` is what one design costs, `host` its part without waiting."
    );
    Ok(())
}
