//! `idmesh cut` cuts the old profiles from the mesh's surface.

use std::path::PathBuf;

use super::console::Console;
use super::failure::Failure;
use super::warn_of_file;
use crate::formats::{self, write_atomically};
use crate::mesh::{check_size, triangles_of_families};
use crate::profile::{Plane, csv, cut, stations};
use crate::session::{check_distinct, check_writable};
use crate::text::nearest::did_you_mean;

/// Arguments of `idmesh cut`.
#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("where").required(true).args(["planes", "at"]))]
pub(super) struct Arguments {
    /// The mesh file.
    mesh: PathBuf,
    /// The family to cut, or several that are one wing: wing_upper,wing_lower.
    #[arg(long, value_name = "NAME", value_delimiter = ',', required = true)]
    family: Vec<String>,
    /// Cut at this many planes, evenly along the span from the first full section to the last.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    planes: Option<u16>,
    /// Cut at these planes, such as y=1.0,y=2.4.
    #[arg(long, value_name = "PLANES", value_delimiter = ',', value_parser = plane)]
    at: Vec<Plane>,
    /// Write the profiles to this file; `-` is standard output.
    #[arg(long, value_name = "FILE.csv")]
    out: PathBuf,
}

fn plane(text: &str) -> Result<Plane, String> {
    stations::parse(text).map_err(|error| error.to_string())
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let to_stdout = arguments.out.as_os_str() == "-";
    if to_stdout {
        console.check_stdout()?;
    } else {
        check_writable(&arguments.out)?;
        check_distinct(std::slice::from_ref(&arguments.mesh), &[&arguments.out])?;
    }
    console.step(&format!("reading {}", arguments.mesh.display()));
    let file = formats::read_mixed(&arguments.mesh)?;
    warn_of_file(&arguments.mesh, &file, console);
    let (mesh, others) = (&file.mesh, &file.others);
    let faces = mesh.triangles.iter().flatten().chain(others.quadrilaterals.iter().flatten());
    let corners = faces.map(|&vertex| mesh.vertices[vertex as usize]);
    check_size(corners).map_err(|error| Failure::bad_input(error.to_string()).in_file(&arguments.mesh))?;
    let families = arguments.family.iter().map(|name| {
        mesh.family(name).ok_or_else(|| {
            let advice = did_you_mean(name, &mesh.families).unwrap_or_default();
            Failure::bad_input(format!(
                "{}: no family `{name}`, the mesh has `{}`{advice}",
                arguments.mesh.display(),
                mesh.families.join("`, `")
            ))
        })
    });
    let families = families.collect::<Result<Vec<_>, _>>()?;
    console.step("cutting");
    let triangles = triangles_of_families(file.cells(), &families);
    let planes = match arguments.planes {
        Some(count) => stations::evenly(&mesh.vertices, &triangles, count.into()),
        None => Ok(arguments.at.clone()),
    };
    let profiles = planes
        .and_then(|planes| {
            let numbered: Vec<_> = (0..).zip(planes).collect();
            cut::cut_at_planes(&mesh.vertices, &triangles, &numbered)
        })
        .map_err(|error| Failure::bad_input(error.to_string()).in_file(&arguments.mesh))?;
    let points: usize = profiles.iter().map(|profile| profile.points.len()).sum();
    let told = format!("{} profiles, {points} points, to", profiles.len());
    if to_stdout {
        let mut text = Vec::new();
        csv::write(&profiles, &mut text).map_err(|error| Failure::bad_input(error.to_string()))?;
        console.data(&String::from_utf8_lossy(&text))?;
        console.note(format_args!("wrote {told} standard output"));
        return Ok(());
    }
    write_atomically(&arguments.out, |out| csv::write(&profiles, out).map_err(std::io::Error::other))
        .map_err(|error| Failure::bad_input(format!("cannot write {}: {error}", arguments.out.display())))?;
    console.note(format_args!("wrote {told} {}", arguments.out.display()));
    Ok(())
}
