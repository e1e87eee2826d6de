//! `idmesh completions` prints a script by which a shell completes subcommands, options and files.

use clap_complete::Shell;

use super::console::Console;
use super::failure::Failure;

/// Arguments of `idmesh completions`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
In the shell that runs:
  source <(idmesh completions bash)
In later ones, as a file where the shell looks for it:
  bash  ~/.local/share/bash-completion/completions/idmesh
  zsh   a file _idmesh in a folder of $fpath
  fish  ~/.config/fish/completions/idmesh.fish")]
pub(super) struct Arguments {
    /// The shell.
    shell: Shell,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let mut command = super::command_line();
    let name = command.get_name().to_owned();
    // The generator panics if its output cannot be written, so it writes to memory.
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, name, &mut script);
    console.data(&String::from_utf8_lossy(&script))
}
