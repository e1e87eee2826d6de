//! `idmesh demo` moves a small mesh that is in the program, and says what to look at and to change.

use std::path::PathBuf;

use super::console::Console;
use super::failure::Failure;
use super::{BackendChoice, run};
use crate::session::{check_demo_is_free, propose_demo};
use crate::text::{shell_word, shown};

/// Arguments of `idmesh demo`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The folder for the mesh, the case and the results, made if missing.
    #[arg(default_value = "idmesh-demo")]
    folder: PathBuf,
    /// Where to compute.
    #[arg(long, value_enum, default_value = "auto")]
    backend: BackendChoice,
    /// Replace files that are there.
    #[arg(long)]
    force: bool,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let folder = &arguments.folder;
    console.check_stdout()?;
    check_demo_is_free(folder, arguments.force)?;
    console.step("making the case");
    let proposal = propose_demo(folder, arguments.force, console.progress())?;
    let about = "The wing of a small half aircraft becomes thicker and bends up, and its mesh follows.\n\n";
    proposal.write(|| console.data(about))?;
    run::run(&run::Arguments::of_case(&proposal.case, arguments.backend), console)?;
    let case = shell_word(proposal.case.display());
    let [page, section] = ["report.html", "new/wing-4.csv"].map(|name| shown(folder.join(name).display()).to_string());
    console.data(&format!(
        "\nnext:\n  open {page} in a browser\n  change {section}, the section at the tip, and run the case again:\n  \
         idmesh run {case}\n  make a case of a mesh of your own:\n  idmesh init MESH\n"
    ))
}
