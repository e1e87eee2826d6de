//! `idmesh refine` cuts every cell of a mesh into eight, a pyramid into ten.

use std::path::PathBuf;

use super::console::Console;
use super::failure::Failure;
use super::tell_of_file;
use crate::formats::{self, Fields, MeshFile};
use crate::memory::check_memory;
use crate::mesh::{self, CellKind};
use crate::session::check_distinct;

/// Arguments of `idmesh refine`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The mesh file.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The file to write; its extension selects the format.
    #[arg(value_name = "OUT")]
    output: PathBuf,
}

/// Bytes for each tet of the fine mesh, with the tet's share of vertices, of the coarse mesh's
/// topology, and of the memory for writing. Measured were 40 to 55 with 7.4 million tets, depending
/// on the format.
const BYTES: u64 = 60;

/// Bytes for each other cell of the fine mesh: its vertices, its share of edges and faces while
/// they are found, and of the coarse mesh's topology. Counted from the sizes of these arrays.
const BYTES_OF_OTHERS: u64 = 250;

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let Arguments { input, output } = arguments;
    check_distinct(std::slice::from_ref(input), &[output])?;
    console.step(&format!("reading {}", input.display()));
    let coarse = formats::read_mixed(input)?;
    tell_of_file(input, &coarse, console);
    console.step("refining");
    check_memory(BYTES * 8 * coarse.mesh.tets.len() as u64 + BYTES_OF_OTHERS * 8 * coarse.others.n_cells() as u64)
        .map_err(|error| Failure::bad_input(format!("{}: {error}", input.display())))?;
    let fine = mesh::refine_hybrid(coarse.cells());
    let (mesh, others) = fine.map_err(|error| Failure::bad_input(format!("{}: {error}", input.display())))?;
    drop(coarse);
    let fine = MeshFile::from_cells(mesh, others);
    fine.check_output(output)?;
    for loss in fine.losses(output)? {
        console.warn(format_args!("{}: {loss}", output.display()));
    }
    console.step("writing");
    fine.write(output, &fine.mesh.vertices, &Fields::default())?;
    let cells = fine.cells();
    let counts = CellKind::ALL.map(|kind| (cells.count(kind), kind.plural()));
    let counts = counts.iter().filter(|(count, _)| *count > 0).map(|(count, name)| format!("{count} {name}"));
    console.note(format_args!("wrote {}: {}", output.display(), counts.collect::<Vec<_>>().join(", ")));
    Ok(())
}
