//! The size from which on a network is relaxed faster on the GPU than on the CPU.

use std::time::Instant;

use glam::DVec3;
use idmesh::{
    backend::{Backend, CpuBackend, gpu::Bounds},
    constraint::Constraint,
    relaxation::{Method, Network, Relaxer, Stopping},
};

use crate::{
    Budget,
    common::{Failure, brick, median, network::Edges},
    gpu, print_cells, print_header,
};

/// Sides of the bricks.
const SIDES: [usize; 12] = [8, 11, 14, 18, 22, 26, 32, 40, 48, 56, 64, 80];

/// Relaxations a figure is the median of, after a first one that is not counted.
const REPEATS: usize = 7;

/// Prints seconds of relaxations of twisted bricks by cycles.
///
/// # Errors
/// A backend failed, or a relaxation did not converge.
pub fn run(budget: &Budget) -> Result<(), Failure> {
    let cpu = CpuBackend::default();
    let gpu = gpu(Bounds { least_vertices: Some(0), ..Bounds::default() })?;
    print_header(&["brick", "tets", "moving vertices", "CPU ms", "GPU ms", "cycles"]);
    let mut faster_from = None;
    let mut last = 0.0;
    for n in SIDES {
        if 6e-6 * (n * n * n) as f64 > budget.millions {
            println!("\nbricks from {n} on: not run, larger than asked for");
            break;
        }
        if let Some(why) = budget.refuses(3.0 * last) {
            println!("\nbricks from {n} on: not run, {why}");
            break;
        }
        let begin = Instant::now();
        let (points, tets, on_boundary) = brick(n);
        let twist = |at: &DVec3| DVec3::Z.cross(*at - DVec3::splat(0.5 * n as f64)) * (at.z / n as f64);
        let start = points.iter().zip(&on_boundary).map(|(at, &held)| if held { twist(at) } else { DVec3::ZERO });
        let start: Vec<DVec3> = start.collect();
        let constraint = on_boundary.iter().map(|&held| if held { Constraint::Held } else { Constraint::Free });
        let network = Edges::new(&points, &tets).network(&cpu, constraint.collect())?;
        let (of_cpu, cycles) = relaxed(&cpu, &network, &start)?;
        let (of_gpu, _) = relaxed(&gpu, &network, &start)?;
        let n_moving = on_boundary.iter().filter(|&&held| !held).count();
        faster_from = if of_gpu < of_cpu { faster_from.or(Some(n_moving)) } else { None };
        print_cells(&[
            n.to_string(),
            tets.len().to_string(),
            n_moving.to_string(),
            format!("{:.2}", 1e3 * of_cpu),
            format!("{:.2}", 1e3 * of_gpu),
            cycles.to_string(),
        ]);
        last = begin.elapsed().as_secs_f64();
    }
    match faster_from {
        Some(n) => {
            println!("\nThe GPU is faster from {n} moving vertices on; `IDMESH_GPU_VERTICES` is 10000 if not set.")
        }
        None => println!("\nThe GPU is not faster at the largest of these sizes."),
    }
    Ok(())
}

/// Median seconds of a relaxation, and its cycles.
fn relaxed(backend: &dyn Backend, network: &Network, start: &[DVec3]) -> Result<(f64, usize), Failure> {
    let mut relaxer = Relaxer::new(network.clone(), backend, Method::Multigrid)?;
    let (mut times, mut cycles) = (Vec::new(), 0);
    for _ in 0..=REPEATS {
        let mut displacement = start.to_vec();
        let begin = Instant::now();
        let end = relaxer.relax(&mut displacement, None, &Stopping::default())?;
        times.push(begin.elapsed().as_secs_f64());
        if !end.converged {
            return Err("a relaxation did not converge".into());
        }
        cycles = end.sweeps;
    }
    Ok((median(times.split_off(1)), cycles))
}
