//! `idmesh report` joins files of reports.

use std::path::{Path, PathBuf};

use super::console::Console;
use super::failure::Failure;
use super::json::check_json;
use super::{JsonTarget, json_target};
use crate::session::{JoinedLine, check_distinct, join, write_text};

/// Arguments of `idmesh report`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Files of `idmesh batch --json`, with the report of a design in each line.
    #[arg(required = true, value_name = "REPORTS")]
    reports: Vec<PathBuf>,
    /// Join the files into one, with each design once; `-` is standard output.
    #[arg(long, value_name = "FILE", required = true, value_parser = json_target)]
    join: JsonTarget,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    if let JsonTarget::File(path) = &arguments.join {
        check_distinct(&arguments.reports, &[path])?;
    }
    check_json(Some(&arguments.join), console)?;
    let joined = join(&arguments.reports)?;
    for path in &joined.torn {
        console.warn(format_args!(
            "{}: the last line was torn when a process was stopped, and is left out",
            path.display()
        ));
    }
    for conflict in &joined.conflicts {
        let (stays, goes) = (&conflict.stays, &conflict.goes);
        console.warn(format_args!(
            "{}: {} and {} have different {}; the line of {} stays",
            stays.design,
            Place(stays),
            Place(goes),
            conflict.what,
            Place(stays)
        ));
    }
    if let [first, others @ ..] = joined.cases.as_slice() {
        for other in others {
            console.warn(format_args!(
                "{} and {} are of different cases, meshes or inputs",
                Place(first),
                Place(other)
            ));
        }
    }
    let text: String = joined.lines.iter().map(|line| line.text.clone() + "\n").collect();
    match &arguments.join {
        JsonTarget::StandardOutput => console.json(&text)?,
        JsonTarget::File(path) => write_text(path, &text)?,
    }
    let failed = joined.lines.iter().filter(|line| line.exit != 0).count();
    console.note(format_args!("{} designs, {failed} of them failed", joined.lines.len()));
    Ok(())
}

/// A line, as people look for it.
struct Place<'l>(&'l JoinedLine);

impl std::fmt::Display for Place<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        let JoinedLine { path, number, .. } = self.0;
        write!(formatter, "{}:{number}", Path::display(path))
    }
}
