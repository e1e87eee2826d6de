//! Random damage to the files beside the mesh: the case, profiles of every format, prescribed
//! displacements as tables and surfaces, a batch's list.
//!
//! Each reader gives an error that names a line of the file, or something finite.

use std::fmt::Display;
use std::fs;
use std::path::Path;

use glam::DVec3;
use idmesh::case::{Case, CaseError, design_list, displacement};
use idmesh::formats;
use idmesh::profile::files::{Placement, Source, SpanAxis, parse};
use idmesh::profile::{ProfileError, csv};

use super::damage::Seed;

/// A case with every key that there is.
const CASE: &str = r#"mesh = "wing-body.msh.gz"

[profiles.wing]
new = ["new.csv", "tip.dat"]
old = "old.csv"

[profiles.wing.placement."tip.dat"]
chord = 0.8
position = [1.8, 3.5, 0.25]
twist = -1.0
plane = "y"

[family.wing]
role = "wing"

[family."trailing edge"]
role = "trailing-edge"

[family.wingtip]
role = "wingtip"
coefficient = 0.5
start = "affine"

[family.flap]
role = "prescribed"
displacement = "flap.csv"

[family]
far.role = "fixed"
root = { role = "plane" }

[volume]
springs = "rotation-aware-wall"
max_steps = 64

[quality]
target = "improve"

[solver]
method = "auto"
tolerance = 1e-4
max_sweeps = 200000

[output]
mesh = ["moved.msh.gz", "moved.vtu"]
histogram = "beta.svg"
"#;

const DISPLACEMENTS: &str = "x,y,z,dx,dy,dz\n0,0,0,0.1,0,-1e-3\n1, 0, 0, 0.1, 0, 0\n0,1,0,0,0,0\n\n0,0,1,0.2,0,0\n";
const DESIGNS: &str = "# the first ones\ndesigns/a.csv\n\n  b.csv  # again\n/elsewhere/c.csv\n";
const PLACES: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];

const PROFILES: [(&str, &str); 8] = [
    ("section.csv", "profile,x,y,z\n0,1,2,0\n0,0.5,2,0.1\n0,0,2,0\n0,1,2,0\n\n 7.0, 1, 3, 0\n7,0,3,0.1\n7,0,3,0\n"),
    ("selig.dat", "DIAMOND airfoil 2012\n 1.0 0.0\n 0.5 0.1\n 0.0 0.0\n\n 0.5 -0.1\n 1.0 0.0\n"),
    ("lednicer.txt", "DIAMOND\n  3.  3.\n\n0 0\n0.5 0.1\n1 0\n\n0 0\n0.5 -0.1\n1 0\n"),
    ("sides.dat", "# by a tool\nDIAMOND\n0.D0 0 0\n0.5 1.0D-01 0 ! thick\n1 0 0\n\n0 0 0\n0.5 -0.1 0\n1 0 0\n"),
    (
        "paraview.csv",
        "# 12 %\n\"Cp, mean\",\"Points:2\",\"Points:0\",\"Points:1\",\"profile\"\n9,0,1,2,0\n,0.1,0.5,2,0\n9,0,0,2,0 # nose\n",
    ),
    (
        "zones.tec",
        "TITLE = \"slices\"\nVARIABLES = \"X\", \"Y\" \"Z\"\nZONE T=\"a\", I=3, F=POINT\n1 2 0\n0 2 0\n1 2 0.1\n\
         ZONE I=3 DATAPACKING=BLOCK\n1 0 1\n2 2 2\n0 0 0.1\n",
    ),
    (
        "segments.plt",
        "VARIABLES = \"x\" \"y\" \"z\"\nZONE Nodes=4, Elements=4, ZONETYPE=FELineSeg\nDATAPACKING=POINT\n\
         1 2 0\n0 2 0\n0.5 2 0.1\n0.5 2 -0.1\n2 4\n3 1\n4 1\n3 2\n",
    ),
    (
        "section.json",
        r#"[{"profile": 0, "points": [[1, 0, 0], [0, 0, 0.1], [0, 0, 0], [1, 0, 0]]}, {"profile": -3, "points": [[1, 2, 0]]}]"#,
    ),
];

/// Displaced surfaces of every format.
const SURFACES: [&str; 7] = [
    "surfaces/vtk.ascii.vtp",
    "surfaces/vtk.raw.zlib.vtp",
    "surfaces/pyvista.original.vtu",
    "surfaces/meshio.ascii.stl",
    "surfaces/vtk.binary.stl",
    "surfaces/gmsh.v41.ascii.msh",
    "surfaces/gmsh.v22.binary.msh",
];

/// A case, a file of displacements, a list of designs, profiles and surfaces of every format.
pub fn seeds() -> Vec<Seed> {
    let mut seeds = vec![("case.toml", CASE), ("flap.csv", DISPLACEMENTS), ("designs.txt", DESIGNS)];
    seeds.extend(PROFILES);
    let mut seeds: Vec<Seed> =
        seeds.into_iter().map(|(name, text)| Seed { name: name.into(), bytes: text.into() }).collect();
    let sections = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/sections");
    for name in ["diamonds.vtp", "diamonds.vtk"] {
        seeds.push(Seed { name: name.into(), bytes: fs::read(sections.join(name)).unwrap() });
    }
    let surfaces = sections.with_file_name("surfaces");
    for name in SURFACES {
        let bytes = fs::read(surfaces.join(name.strip_prefix("surfaces/").unwrap())).unwrap();
        seeds.push(Seed { name: name.into(), bytes });
    }
    seeds
}

/// Reads damaged bytes. Returns whether they could be read.
pub fn survives(name: &str, bytes: &[u8]) -> bool {
    match name {
        "case.toml" => case(&String::from_utf8_lossy(bytes)),
        "flap.csv" => displacements(&String::from_utf8_lossy(bytes)),
        "designs.txt" => designs(&String::from_utf8_lossy(bytes)),
        _ if name.starts_with("surfaces/") => surface(name, bytes),
        _ => profiles(name, bytes),
    }
}

fn case(text: &str) -> bool {
    match Case::parse(text, Path::new("case.toml")) {
        Ok(case) => {
            let placements = case.profiles.values().flat_map(|source| source.placements.values());
            assert!(
                placements.into_iter().flatten().all(|place| place.position.is_finite() && place.chord.is_finite())
            );
            assert!(case.settings.stopping.tolerance > 0.0 && !case.output.mesh.is_empty());
            true
        }
        Err(CaseError::Invalid { position, message, .. }) => {
            is_in(text.as_bytes(), position.line, &message);
            false
        }
        Err(error) => panic!("{error}"),
    }
}

fn designs(text: &str) -> bool {
    let list = design_list::parse(text, Path::new("folder/designs.txt"));
    assert!(list.len() <= text.lines().count());
    for path in &list {
        let named = path.strip_prefix("folder").unwrap_or(path).to_str().unwrap();
        // A dot alone is the folder itself.
        assert!(!named.contains(['#', '\n']) && text.contains(named), "{named:?}");
    }
    !list.is_empty()
}

fn displacements(text: &str) -> bool {
    let path = Path::new("flap.csv");
    let Ok(table) = displacement::parse(text, path).inspect_err(|error| {
        if let displacement::DisplacementError::BadLine { line, .. } = error {
            is_in(text.as_bytes(), *line, error);
        }
    }) else {
        return false;
    };
    assert!(table.rows.iter().all(|row| row.position.is_finite() && row.displacement.is_finite()));
    // Whether or not the rows fit the family.
    drop(displacement::match_displacements(&table, &PLACES, &[0, 1, 2, 3], 1e-3));
    true
}

fn surface(name: &str, bytes: &[u8]) -> bool {
    let Ok(surface) = formats::surface_of(Path::new(name), bytes) else { return false };
    let n_points = surface.points.len();
    assert!(surface.points.iter().all(|point| point.is_finite()), "{name}");
    assert!(surface.triangles.iter().flatten().all(|&point| (point as usize) < n_points), "{name}");
    assert!(surface.fields.iter().all(|field| field.values.len() == n_points * field.n_components), "{name}");
    true
}

fn profiles(name: &str, bytes: &[u8]) -> bool {
    let placement = Placement { chord: 2.0, twist: 3.0, position: DVec3::new(5.0, 6.0, 7.0), span: SpanAxis::Y };
    let placement = matches!(name, "selig.dat" | "lednicer.txt" | "sides.dat").then_some(placement);
    match parse(&[Source { path: Path::new(name), bytes, placements: placement.as_slice() }]) {
        Ok(profiles) => {
            assert!(profiles.iter().flat_map(|profile| &profile.points).all(|point| point.is_finite()), "{name}");
            // What was read is written so that it comes back.
            let mut text = Vec::new();
            csv::write(&profiles, &mut text).unwrap();
            let text = String::from_utf8(text).unwrap();
            if profiles.iter().all(|profile| !profile.points.is_empty()) {
                assert_eq!(csv::parse(&[(Path::new("copy.csv"), &text)]).unwrap(), profiles, "{name}");
            }
            true
        }
        Err(error) => {
            if let ProfileError::Line { line, .. } = error {
                is_in(bytes, line, &error);
            }
            false
        }
    }
}

/// An error leads to a line of the file, or to its end.
fn is_in(bytes: &[u8], line: usize, error: &dyn Display) {
    let n_lines = 1 + bytes.iter().filter(|&&byte| byte == b'\n').count();
    assert!((1..=n_lines + 1).contains(&line), "line {line} of {n_lines}: {error}");
}
