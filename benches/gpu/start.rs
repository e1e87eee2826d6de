//! The tests of the kernels at the start of the adapter.

use idmesh::backend::{Backend, gpu::Bounds};

use crate::{Budget, common::Failure, gpu, print_cells, print_header};

/// Opens the adapter, and prints what its tests found.
///
/// # Errors
/// There is no adapter, or a kernel with f64 does not pass.
pub fn run(_: &Budget) -> Result<(), Failure> {
    let gpu = gpu(Bounds::default())?;
    let tests = gpu.start_tests();
    if tests.is_empty() {
        println!("The adapter has no f64, so no kernel is tested. Cycles correct in f32.");
        return Ok(());
    }
    print_header(&["kernel", "numbers", "of other bits than the CPU's", "largest difference", "passes"]);
    for test in tests {
        print_cells(&[
            test.kernel.to_owned(),
            test.numbers.to_string(),
            test.differing.to_string(),
            format!("{:.1e}", test.largest),
            if test.passes { "yes" } else { "no" }.to_owned(),
        ]);
    }
    println!("\nCycles correct in {}.", gpu.info().arithmetic.name());
    if tests.iter().all(|test| test.passes) { Ok(()) } else { Err("a kernel is not as precise as f64".into()) }
}
