//! `idmesh schema` prints a JSON Schema, by which editors and programs check cases and reports.

use clap::ValueEnum;

use super::console::Console;
use super::failure::Failure;
use crate::{case, report};

/// Arguments of `idmesh schema`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
An editor with a language server for TOML, such as Taplo or Even Better TOML,
checks a case whose first line names the schema:
  idmesh schema case > case.schema.json
  #:schema ./case.schema.json")]
pub(super) struct Arguments {
    /// The schema to print.
    #[arg(value_enum)]
    of: Of,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Of {
    /// Of a case file, TOML.
    Case,
    /// Of a run report, JSON.
    Report,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    console.json(match arguments.of {
        Of::Case => case::SCHEMA,
        Of::Report => report::SCHEMA,
    })
}
