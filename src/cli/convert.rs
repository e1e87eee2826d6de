//! `idmesh convert` writes a mesh in another format.

use std::path::PathBuf;

use super::console::Console;
use super::failure::Failure;
use super::{tell_of_file, warn_of_mesh};
use crate::formats::{self, Fields, SURFACE_EXTENSIONS, SurfaceFile, has_format, is_surface_file};
use crate::session::{check_distinct, check_writable, write_surface};

/// Arguments of `idmesh convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The extension selects the format, also before .gz: .msh (Gmsh), .su2, .vtu, .vtk,
.ugrid, .b8.ugrid, .lb8.ugrid, ... (AFLR3), .mesh, .meshb (Medit); a folder of the
name polyMesh is OpenFOAM's; .cgns is read where idmesh was built with it.
The surfaces alone go into a .vtp, .stl (as text) or .glb (glTF) file.")]
pub(super) struct Arguments {
    /// The mesh file.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The file to write; its extension selects the format.
    #[arg(value_name = "OUT")]
    output: PathBuf,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let Arguments { input, output } = arguments;
    check_distinct(std::slice::from_ref(input), &[output])?;
    if is_surface_file(output) {
        check_writable(output)?;
    }
    console.step(&format!("reading {}", input.display()));
    let file = formats::read_mixed(input)?;
    tell_of_file(input, &file, console);
    warn_of_mesh(input, &file, console);
    if is_surface_file(output) {
        console.step("writing");
        let surface = SurfaceFile { mesh: file.cells(), vertices: &file.mesh.vertices, displacement: None };
        write_surface(output, &surface)?;
        console.note(format_args!("wrote {}, the surfaces alone", output.display()));
        return Ok(());
    }
    file.check_output(output).map_err(|error| {
        let mut failure = Failure::from(error);
        if !has_format(output) {
            failure.hint = Some(format!("a name ending in {SURFACE_EXTENSIONS} takes the surfaces alone"));
        }
        failure
    })?;
    for loss in file.losses(output)? {
        console.warn(format_args!("{}: {loss}", output.display()));
    }
    console.step("writing");
    file.write(output, &file.mesh.vertices, &Fields::default())?;
    console.note(format_args!("wrote {}", output.display()));
    Ok(())
}
