//! `idmesh cut` cuts the old profiles from the mesh's surface, and prints where they stand in the
//! terms in which a case places an airfoil.

use std::path::PathBuf;

use glam::DVec3;
use serde::Serialize;

use super::console::Console;
use super::failure::Failure;
use super::json::{check_json, write_json};
use super::{JsonTarget, json_target, warn_of_file};
use crate::formats::{self, write_atomically};
use crate::mesh::{check_size, faces_of_families};
use crate::profile::cut::{self, Gap, Junctions};
use crate::profile::{Plane, Pose, Profile, align, csv, stations};
use crate::report::aligned;
use crate::session::{check_distinct, check_writable};
use crate::text::figures::Shortest;
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
    /// Write the place and the size of each section as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE", value_parser = json_target)]
    json: Option<JsonTarget>,
}

/// The sections of a wing. The keys of a section are those of a placement in a case, and more.
#[derive(Debug, Serialize)]
struct Sections {
    idmesh: String,
    file: String,
    families: Vec<String>,
    sections: Vec<Section>,
}

/// Where a section stands. Lengths are in the mesh's unit, `thickness` and `trailing_edge` in
/// chords.
#[derive(Debug, Default, Serialize)]
struct Section {
    number: i64,
    /// The axis across the section's plane. `None` for an oblique plane.
    plane: Option<&'static str>,
    /// Place of the plane along this axis.
    at: Option<f64>,
    position: Option<[f64; 3]>,
    chord: Option<f64>,
    twist: Option<f64>,
    thickness: Option<f64>,
    trailing_edge: Option<f64>,
    /// Gaps at parts on the wing, where the section is a guess.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    bridged: Vec<BridgedGap>,
    /// Why nothing was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    not_measured: Option<String>,
}

/// A gap of a section. `length` is in the mesh's unit, `share` in lengths of the section.
#[derive(Debug, Serialize)]
struct BridgedGap {
    family: String,
    length: f64,
    share: f64,
}

impl Section {
    /// - `towards`: from the leading edge to the trailing edge; `None` if the shape tells
    fn new(profile: &Profile, plane: &Plane, gaps: &[Gap], towards: Option<DVec3>) -> Self {
        let axes = [("x", plane.normal.x, plane.point.x), ("y", plane.normal.y, plane.point.y)];
        let axes = axes.into_iter().chain([("z", plane.normal.z, plane.point.z)]);
        let axis = axes.into_iter().find(|(_, across, _)| across.abs() == 1.0).map(|(name, _, at)| (name, at));
        let (name, at) = axis.unzip();
        let gaps =
            gaps.iter().map(|gap| BridgedGap { family: gap.family.clone(), length: gap.length, share: gap.share });
        let section = Self { number: profile.number, plane: name, at, bridged: gaps.collect(), ..Self::default() };
        match Pose::towards(profile, plane, towards) {
            Err(error) => Self { not_measured: Some(error.to_string()), ..section },
            Ok(pose) => Self {
                position: Some(pose.leading_edge.to_array()),
                chord: Some(pose.chord),
                twist: pose.twist.map(|(_, twist)| twist),
                thickness: Some(pose.thickness),
                trailing_edge: Some(pose.trailing_edge),
                ..section
            },
        }
    }

    /// Whether an airfoil that is placed here has its upper side below.
    fn is_turned(&self) -> bool {
        self.twist.is_some_and(|twist| twist.abs() > 90.0)
    }
}

/// The sections as text.
fn table(sections: &[Section]) -> String {
    let header = ["section", "plane", "position x", "y", "z", "chord", "twist", "thickness", "trailing edge"];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    // A placement with so many digits is right to 1e-8 of the mesh's size.
    let short = |x: f64| Shortest(format!("{x:.8e}").parse().unwrap_or(x)).to_string();
    for section in sections {
        let length = |x: Option<f64>| x.map_or("-".to_owned(), short);
        let decimals = |x: Option<f64>, n: usize| x.map_or("-".to_owned(), |x| format!("{x:.n$}"));
        let plane = section.plane.zip(section.at).map(|(name, at)| format!("{name}={}", short(at)));
        let mut row = vec![section.number.to_string(), plane.unwrap_or_else(|| "oblique".to_owned())];
        row.extend((0..3).map(|axis| length(section.position.map(|position| position[axis]))));
        row.extend([length(section.chord), decimals(section.twist, 4)]);
        row.extend([decimals(section.thickness, 4), decimals(section.trailing_edge, 5)]);
        rows.push(row);
    }
    aligned(&rows)
}

/// Least cosine of the angle between a plane's normal and the span: 60 degrees.
const ACROSS: f64 = 0.5;

/// The name of the axis along a direction.
fn axis(direction: DVec3) -> &'static str {
    ["x", "y", "z"][direction.abs().max_position()]
}

fn plane(text: &str) -> Result<Plane, String> {
    stations::parse(text).map_err(|error| error.to_string())
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    let to_stdout = arguments.out.as_os_str() == "-";
    check_json(arguments.json.as_ref(), console)?;
    let mut written = Vec::new();
    if to_stdout {
        if arguments.json == Some(JsonTarget::StandardOutput) {
            return Err(Failure::bad_input("--out - and --json - would both be standard output"));
        }
        console.check_stdout()?;
    } else {
        check_writable(&arguments.out)?;
        written.push(arguments.out.as_path());
    }
    if let Some(JsonTarget::File(path)) = &arguments.json {
        written.push(path);
    }
    check_distinct(std::slice::from_ref(&arguments.mesh), &written)?;
    console.step(&format!("reading {}", arguments.mesh.display()));
    let file = formats::read_mixed(&arguments.mesh)?;
    warn_of_file(&arguments.mesh, &file, console);
    let (mesh, others) = (&file.mesh, &file.others);
    let corners = mesh.triangles.iter().flatten().chain(others.quadrilaterals.iter().flatten());
    let corners = corners.map(|&vertex| mesh.vertices[vertex as usize]);
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
    let faces = faces_of_families(file.cells(), &families);
    let planes = match arguments.planes {
        Some(count) => stations::evenly(&mesh.vertices, &faces, count.into()),
        None => Ok(arguments.at.clone()),
    };
    let span = stations::span_axis(&mesh.vertices, &faces).ok();
    let is_along = |plane: &&Plane| span.is_some_and(|span| plane.normal.dot(span).abs() < ACROSS);
    for plane in arguments.at.iter().filter(is_along) {
        let [across, along] = [plane.normal, span.unwrap_or_default()].map(axis);
        console.warn(format_args!(
            "{}: a plane {across} = const runs along the span, which is along {along}: what it cuts is no profile of a wing",
            arguments.mesh.display()
        ));
    }
    let (cut, planes) = planes
        .and_then(|planes| {
            let numbered: Vec<_> = (0..).zip(planes).collect();
            // The mesh has no roles, so sections are bridged through every other family.
            let junctions = Junctions::of_mesh(file.cells(), &families, |_| true);
            Ok((cut::cut_at_planes_through_parts(&mesh.vertices, &faces, &numbered, &junctions)?, numbered))
        })
        .map_err(|error| Failure::bad_input(error.to_string()).in_file(&arguments.mesh))?;
    let (mut profiles, gaps): (Vec<Profile>, Vec<Vec<Gap>>) = cut.into_iter().unzip();
    for (profile, gap) in
        profiles.iter().zip(&gaps).flat_map(|(profile, gaps)| gaps.iter().map(move |gap| (profile, gap)))
    {
        console.warn(format_args!(
            "section {} passes through {gap}: its points there are a guess; if the family belongs to the wing, name it in --family \
             too",
            profile.number
        ));
    }
    let only: Vec<Plane> = planes.iter().map(|(_, plane)| *plane).collect();
    let agreed = align(&mut profiles, &only);
    let points: usize = profiles.iter().map(|profile| profile.points.len()).sum();
    if to_stdout {
        let mut text = Vec::new();
        csv::write(&profiles, &mut text).map_err(|error| Failure::bad_input(error.to_string()))?;
        console.data(&String::from_utf8_lossy(&text))?;
    }
    let placed = profiles.iter().zip(&only).zip(gaps.iter().zip(&agreed.towards));
    let sections = placed.map(|((profile, plane), (gaps, towards))| Section::new(profile, plane, gaps, *towards));
    let sections = Sections {
        idmesh: env!("CARGO_PKG_VERSION").to_owned(),
        file: arguments.mesh.display().to_string(),
        families: arguments.family.clone(),
        sections: sections.collect(),
    };
    if agreed.in_doubt {
        console.warn(format_args!(
            "{}: the shape of the sections does not tell the leading from the trailing edge; the leading edge is taken at the \
             smaller x",
            arguments.mesh.display()
        ));
    }
    for section in &sections.sections {
        if let Some(error) = &section.not_measured {
            console.warn(format_args!("section {} was cut, but cannot be measured: {error}", section.number));
        }
        if section.is_turned() {
            console.warn(format_args!(
                "section {} has its leading edge downstream along x: an airfoil placed with this twist has its upper side below",
                section.number
            ));
        }
    }
    // Standard output first: where it is full, no file is written.
    if !to_stdout && arguments.json != Some(JsonTarget::StandardOutput) {
        console.data(&table(&sections.sections))?;
    }
    if let Some(target) = &arguments.json {
        write_json(target, &sections, console)?;
    }
    if !to_stdout {
        write_atomically(&arguments.out, |out| csv::write(&profiles, out).map_err(std::io::Error::other))
            .map_err(|error| Failure::bad_input(format!("cannot write {}: {error}", arguments.out.display())))?;
    }
    let to = if to_stdout { "standard output".to_owned() } else { arguments.out.display().to_string() };
    console.note(format_args!("wrote {} profiles, {points} points, to {to}", profiles.len()));
    Ok(())
}
