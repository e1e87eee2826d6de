//! `idmesh report` joins files of reports, and makes a page of them.

use std::path::{Path, PathBuf};

use clap::ArgGroup;

use super::console::Console;
use super::failure::Failure;
use super::json::check_json;
use super::{JsonTarget, json_target, page_target};
use crate::report::batch_html;
use crate::session::{JoinedLine, check_distinct, check_writable, join, write_lines, write_text};

/// Arguments of `idmesh report`.
#[derive(Debug, clap::Args)]
#[command(group(ArgGroup::new("target").args(["join", "output"]).required(true).multiple(true)))]
pub(super) struct Arguments {
    /// Files of `idmesh batch --json`, with the report of a design in each line.
    #[arg(required = true, value_name = "REPORTS")]
    reports: Vec<PathBuf>,
    /// Join the files into one, with each design once; `-` is standard output.
    #[arg(long, value_name = "FILE", value_parser = json_target)]
    join: Option<JsonTarget>,
    /// Make a page for browsers of the designs.
    #[arg(short, long, value_name = "FILE.html", value_parser = page_target)]
    output: Option<PathBuf>,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let file = match &arguments.join {
        Some(JsonTarget::File(path)) => Some(path.as_path()),
        _ => None,
    };
    check_distinct(&arguments.reports, &file.into_iter().chain(arguments.output.as_deref()).collect::<Vec<_>>())?;
    check_json(arguments.join.as_ref(), console)?;
    arguments.output.as_deref().map_or(Ok(()), check_writable)?;
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
    if joined.lines.is_empty() {
        console.warn("there is no report of a design");
    }
    match &arguments.join {
        Some(JsonTarget::StandardOutput) => {
            joined.lines.iter().try_for_each(|line| console.json(&format!("{}\n", line.text)))?;
        }
        Some(JsonTarget::File(path)) => write_lines(path, joined.lines.iter().map(|line| line.text.as_str()))?,
        None => {}
    }
    if let Some(path) = &arguments.output {
        // The lines were read as JSON before.
        let reports = joined.lines.iter().filter_map(|line| serde_json::from_str(&line.text).ok());
        write_text(path, &batch_html(reports))?;
        console.note(format_args!("wrote {}", path.display()));
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
