//! `idmesh man` writes manual pages, from the texts of `--help`.

use std::path::PathBuf;

use clap::Command;
use clap_mangen::Man;

use super::console::Console;
use super::failure::Failure;
use crate::session::{Folder, check_writable, write_text};

/// Arguments of `idmesh man`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
To install them for one user: idmesh man --out ~/.local/share/man/man1")]
pub(super) struct Arguments {
    /// Write the page of idmesh and one of each subcommand into this folder, made if missing.
    /// Without it the page of idmesh goes to standard output.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let mut command = super::command_line().disable_help_subcommand(true);
    command.build();
    let Some(out) = &arguments.out else {
        return console.data(&page(&command)?.1);
    };
    let _folder = Folder::make(out)?;
    let commands = std::iter::once(&command).chain(command.get_subcommands());
    let pages = commands.map(page).collect::<Result<Vec<_>, _>>()?;
    for (name, _) in &pages {
        check_writable(&out.join(name))?;
    }
    for (name, text) in &pages {
        write_text(&out.join(name), text)?;
    }
    console.note(format_args!("wrote {} manual pages into {}", pages.len(), out.display()));
    Ok(())
}

/// Name and text of a command's page.
fn page(command: &Command) -> Result<(String, String), Failure> {
    let man = Man::new(command.clone()).source(concat!("idmesh ", env!("CARGO_PKG_VERSION"))).manual("idmesh manual");
    let mut text = Vec::new();
    man.render(&mut text).map_err(|error| Failure::bad_input(format!("cannot write a manual page: {error}")))?;
    // The generator gives the text after the options the heading EXTRA. Manuals use NOTES.
    let text = String::from_utf8_lossy(&text).replace("\n.SH EXTRA\n", "\n.SH NOTES\n");
    Ok((man.get_filename(), text))
}
