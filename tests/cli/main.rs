//! The command line: what works, what bad input is told, which exit code it gets, and that it
//! leaves no file behind.

mod at_once;
mod batch;
mod book;
mod browser;
mod check;
#[cfg(target_os = "linux")]
mod claims;
mod commands;
mod damage;
mod damaged_runs;
mod demo;
mod earlier;
mod fixture;
mod formats;
mod gpu;
mod gradient;
mod help;
mod init;
#[cfg(unix)]
mod inputs;
#[cfg(unix)]
mod jobs;
mod join;
mod left_handed;
mod limits;
#[cfg(target_os = "linux")]
mod memory;
mod odd;
#[cfg(unix)]
mod openfoam;
mod page;
mod profile_matches;
mod refine;
mod refusals;
mod results;
mod resume;
#[path = "../common/schema.rs"]
mod schema;
mod schemas;
#[cfg(unix)]
mod scripts;
mod shape;
mod shares;
mod shown;
mod surface_files;
mod through_parts;
mod together;
mod units;
mod wing_box;
