//! `idmesh gradient` turns the derivative of a number by the vertices of the moved mesh, such as a
//! flow solver's adjoint gives it, into the derivative by the design: by the points of the new
//! profiles, and by the displacements of prescribed families.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::console::Console;
use super::failure::Failure;
use super::{BackendChoice, choose_backend, load};
use crate::case::{LoadedCase, Seed};
use crate::formats::read_file;
use crate::mover::{Derivative, Gradient, Mover};
use crate::report::aligned;
use crate::session::{Session, SessionError, check_distinct, check_writable, remove_file, write_text};
use crate::text::figures::Shortest;

/// Arguments of `idmesh gradient`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
SEED is a table with the columns vertex (from 0), jx, jy and jz; SU2's adjoint
solution in ASCII, with PointID and Sensitivity_x, _y and _z; or a VTU file with
an array `seed` of three components at the points. A vertex without a row counts
as zero. Where SEED has positions, they must be those of the moved mesh.

FILE.csv has the columns profile,x,y,z,gx,gy,gz with the points of the new
profiles as they came in, or x,y,z,gx,gy,gz with the vertices of the prescribed
family at their original positions. Where the case has several tables of
profiles or prescribed families, a first column `table` has their names.")]
pub(super) struct Arguments {
    /// The case file (TOML).
    case: PathBuf,
    /// The derivative of the number by the vertices of the moved mesh.
    #[arg(long, value_name = "SEED")]
    seed: PathBuf,
    /// Write the derivative by the design to this file; `-` is standard output.
    #[arg(long, value_name = "FILE.csv")]
    out: PathBuf,
    /// Hold what steps and local optimisation add constant, where they moved the mesh.
    #[arg(long)]
    frozen: bool,
    /// Where to compute.
    #[arg(long, value_enum, default_value = "auto")]
    backend: BackendChoice,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let to_stdout = arguments.out.as_os_str() == "-";
    console.check_stdout()?;
    let mut inputs = vec![arguments.case.clone(), arguments.seed.clone()];
    if !to_stdout {
        check_distinct(&inputs, &[&arguments.out])?;
        // From here on no earlier gradient may be taken for that of this command. The user may have
        // named another file by mistake.
        if is_gradient(&arguments.out) {
            remove_file(&arguments.out)?;
        }
        check_writable(&arguments.out)?;
    }
    let case = load(&arguments.case, console)?;
    if !to_stdout {
        inputs.extend(case.inputs.iter().cloned());
        check_distinct(&inputs, &[&arguments.out])?;
    }
    console.step(&format!("reading {}", arguments.seed.display()));
    let seed = Seed::read(&arguments.seed, case.file.mesh.vertices.len()).map_err(SessionError::from)?;
    if seed.by_vertices.iter().all(|&by| by == DVec3::ZERO) {
        console.warn(format_args!("{}: all derivatives are zero, and so is the gradient", arguments.seed.display()));
    }
    let backend = choose_backend(arguments.backend, console)?;
    let mut session = Session::new(&case, backend, console.progress())?;
    let (outcome, _) = session.update(&case.design)?;
    outcome.check()?;
    let mover = session.mover();
    let moved = outcome.even_if_invalid().vertices();
    seed.check_positions(&mover.mesh().vertices, moved).map_err(SessionError::from)?;
    console.step("gradient");
    let derivative = if arguments.frozen { Derivative::Frozen } else { Derivative::Exact };
    let gradient = mover.reverse(&outcome, &seed.by_vertices, derivative).map_err(SessionError::from)?;
    let parts = parts(&case, mover, &gradient);
    if to_stdout {
        return console.data(&csv(&parts));
    }
    write_text(&arguments.out, &csv(&parts))?;
    console.data(&table(&parts))?;
    console.note(format_args!("wrote {}", arguments.out.display()));
    Ok(())
}

/// Whether a file is an earlier gradient.
fn is_gradient(path: &Path) -> bool {
    read_file(path)
        .is_ok_and(|bytes| bytes.split(|&byte| byte == b'\n').next().is_some_and(|line| line.ends_with(HEADER)))
}

/// The end of the header of every gradient.
const HEADER: &[u8] = b"x,y,z,gx,gy,gz";

/// A name as a cell of comma-separated values.
fn cell(name: &str) -> String {
    match name.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_owned(),
    }
}

/// The gradient by one profile or one prescribed family.
struct Part<'a> {
    /// The table of the case.
    table: &'a str,
    /// The number of the profile; `None` for a prescribed family.
    profile: Option<i64>,
    /// In the mesh's unit.
    positions: Vec<DVec3>,
    gradient: &'a [DVec3],
}

/// The parts of a gradient: the profiles in the order of the design, then the prescribed families.
fn parts<'a>(case: &'a LoadedCase, mover: &Mover, gradient: &'a Gradient) -> Vec<Part<'a>> {
    let mut parts = Vec::new();
    for (wing, of_profiles) in &gradient.profiles {
        let asked = case.design.profiles.get(wing).map_or(&[][..], Vec::as_slice);
        for (profile, gradient) in asked.iter().zip(of_profiles) {
            let (profile, positions) = (Some(profile.number), profile.points.clone());
            parts.push(Part { table: wing, profile, positions, gradient });
        }
    }
    for (family, gradient) in &gradient.prescribed {
        let vertices = mover.family_vertices(family).unwrap_or_default();
        let positions = vertices.iter().map(|&vertex| case.file.mesh.vertices[vertex as usize]).collect();
        parts.push(Part { table: family, profile: None, positions, gradient });
    }
    parts
}

/// The gradient as a table of comma-separated values.
fn csv(parts: &[Part]) -> String {
    let several = parts.windows(2).any(|pair| pair[0].table != pair[1].table);
    let has_profiles = parts.iter().any(|part| part.profile.is_some());
    let mut text = String::new();
    let mut header = vec!["x", "y", "z", "gx", "gy", "gz"];
    if has_profiles {
        header.insert(0, "profile");
    }
    if several {
        header.insert(0, "table");
    }
    text += &header.join(",");
    text.push('\n');
    for part in parts {
        let mut first = String::new();
        if several {
            first += &format!("{},", cell(part.table));
        }
        if has_profiles {
            first += &part.profile.map_or(String::new(), |number| number.to_string());
            first.push(',');
        }
        for (position, by) in part.positions.iter().zip(part.gradient) {
            let [x, y, z, gx, gy, gz] = [position.x, position.y, position.z, by.x, by.y, by.z].map(Shortest);
            // Writing to memory cannot fail.
            let _ = writeln!(text, "{first}{x},{y},{z},{gx},{gy},{gz}");
        }
    }
    text
}

/// How large the gradient by each part is.
fn table(parts: &[Part]) -> String {
    let mut rows = vec![["table", "profile", "points", "norm", "largest"].map(str::to_owned).to_vec()];
    for part in parts {
        let norm = part.gradient.iter().map(|by| by.length_squared()).sum::<f64>().sqrt();
        let largest = part.gradient.iter().map(|by| by.length()).fold(0.0, f64::max);
        let profile = part.profile.map_or("-".to_owned(), |number| number.to_string());
        rows.push(vec![
            part.table.to_owned(),
            profile,
            part.gradient.len().to_string(),
            format!("{norm:.6e}"),
            format!("{largest:.6e}"),
        ]);
    }
    aligned(&rows)
}
