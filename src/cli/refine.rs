//! `idmesh refine` splits every tet of a mesh into eight.

use std::path::PathBuf;

use super::console::Console;
use super::failure::Failure;
use super::note_reading;
use crate::formats::{self, Fields, MeshFile};
use crate::memory::check_memory;
use crate::mesh;
use crate::session::check_distinct;

/// Arguments of `idmesh refine`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The mesh file; tets and triangles only.
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

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let Arguments { input, output } = arguments;
    check_distinct(std::slice::from_ref(input), &[output])?;
    console.step(&format!("reading {}", input.display()));
    let coarse = formats::read(input)?;
    note_reading(input, &coarse, console);
    let coarse = coarse.mesh;
    console.step("refining");
    check_memory(BYTES * 8 * coarse.tets.len() as u64)
        .map_err(|error| Failure::bad_input(format!("{}: {error}", input.display())))?;
    let fine = mesh::refine(&coarse).map_err(|error| Failure::bad_input(format!("{}: {error}", input.display())))?;
    let fine = MeshFile::from_mesh(fine);
    fine.check_output(output)?;
    for loss in fine.losses(output)? {
        console.warn(format_args!("{}: {loss}", output.display()));
    }
    console.step("writing");
    fine.write(output, &fine.mesh.vertices, &Fields::default())?;
    console.note(format_args!("wrote {}: {} tets", output.display(), fine.mesh.tets.len()));
    Ok(())
}
