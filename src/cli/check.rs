//! `idmesh check` does every check of a run that needs no motion, and writes nothing.

use std::path::PathBuf;

use super::console::Console;
use super::estimate::SET_UP;
use super::failure::Failure;
use super::load;
use crate::backend::{self, Selection};
use crate::case::LoadedCase;
use crate::report::{self, aligned};
use crate::session::{Outputs, Session};

/// Arguments of `idmesh check`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The case file (TOML).
    case: PathBuf,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    console.check_stdout()?;
    console.estimate(SET_UP);
    let case = load(&arguments.case, console)?;
    let outputs = Outputs::of(&case.case, None);
    outputs.check(&case)?;
    console.losses(outputs.losses(&case)?);
    for warning in case.warnings() {
        console.warn(warning);
    }
    // The set-up is the same on every backend.
    let backend = backend::select(Selection::Cpu)?;
    Session::new(&case, backend, console.progress())?.check(&case.design)?;
    console.data(&text(&case, &outputs))?;
    console.note("no fault was found; what only the motion can show, such as inverted cells, `idmesh run` tells");
    Ok(())
}

/// What a run would take and write: the families with their roles, the wings with their profiles,
/// and the files.
fn text(case: &LoadedCase, outputs: &Outputs) -> String {
    let mesh = report::Mesh::of(case.file.cells());
    let mut families = vec![["family", "role", "vertices", "faces"].map(str::to_owned).to_vec()];
    for (name, role) in case.file.mesh.families.iter().zip(case.roles()) {
        let size = mesh.families.get(name).copied().unwrap_or_default();
        let faces = size.triangles + size.quadrilaterals;
        families.push(vec![name.clone(), role.name().to_owned(), size.vertices.to_string(), faces.to_string()]);
    }
    let mut text = aligned(&families);
    let old: Vec<_> = case.old_profiles().collect();
    if !old.is_empty() {
        let mut wings = vec![["wing", "new profiles", "old profiles"].map(str::to_owned).to_vec()];
        for (name, profiles) in old {
            let from = match case.case.profiles.get(name).is_some_and(|source| source.old.is_some()) {
                true => "",
                false => ", cut from the mesh",
            };
            let new = case.design.profiles.get(name).map_or(0, Vec::len);
            wings.push(vec![name.to_owned(), new.to_string(), format!("{}{from}", profiles.len())]);
        }
        text.push('\n');
        text += &aligned(&wings);
    }
    text.push('\n');
    let reads = case.inputs.iter().map(|path| format!("reads   {}\n", path.display()));
    let writes = outputs.paths().map(|path| format!("writes  {}\n", path.display()));
    text.extend(reads.chain(writes));
    text
}
