//! Whether a wing given its own airfoil stays, and one given another airfoil becomes that.
//!
//! `cargo bench --bench airfoils -- [POINTS A CHORD]`: half wings with the airfoil NACA 0012, chord
//! 1, from a symmetry plane to a wall at 2, with blunt and sharp trailing edge; 25, 33, 50 and 100
//! points a chord if not said. Two new profiles are points of an airfoil in closed form: the wing's
//! own, and NACA 2412. Old ones are left out, so they are cut from the mesh as `idmesh run` does.
//! Every wing vertex is compared with the airfoil in closed form.

mod airfoil;
#[path = "../common/mod.rs"]
mod common;
mod grid;

use std::{collections::BTreeMap, process::ExitCode, sync::Arc};

use airfoil::{Airfoil, Curve};
use common::{Failure, numbers, print_machine, print_table, row};
use glam::{DVec2, DVec3};
use idmesh::{
    backend::{self, Backend, Selection},
    families::Role,
    mesh::TetMesh,
    mover::{Design, Mover, Outcome},
    profile::{Plane, Profile, cut},
};
use rayon::prelude::*;

/// Where the two profiles stand along the span. The wing reaches no farther beyond them than half
/// the way between them.
const PLANES: [[f64; 2]; 5] = [[0.5, 1.5], [0.45, 1.6], [0.41, 1.57], [0.37, 1.48], [0.2, 1.9]];
/// Thickness of a blunt trailing edge.
const BASE: f64 = 0.02;
/// Steps of a new profile on each side.
const STEPS: usize = 100;
/// Largest distance of a vertex from the new airfoil, in chords: a fifth of what facets of 25
/// points a chord miss it by.
const ALLOWED: f64 = 3e-3;

/// The runs with one mesh.
#[derive(Default)]
struct Runs {
    runs: usize,
    valid: usize,
    /// Largest distance of a vertex from the airfoil, of the runs with the wing's own one and with
    /// the other.
    off: [f64; 2],
    /// Largest displacement of a vertex in the runs with the wing's own airfoil.
    moved: f64,
    /// Worst beta over the original's, the lowest of the runs.
    beta: f64,
    /// What went wrong, and where.
    faults: Vec<String>,
}

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let sizes = numbers(&[25, 33, 50, 100])?;
    let backend: Arc<dyn Backend> = Arc::from(backend::select(Selection::Cpu)?);
    print_machine(&[backend.info()]);
    let mut rows = vec![row(&[
        "points a chord",
        "edge",
        "tets",
        "runs",
        "valid",
        "own: moved %",
        "own: off %",
        "2412: off %",
        "sag %",
        "worst beta / original",
    ])];
    let mut faults = Vec::new();
    for &per_chord in &sizes {
        for (edge, base) in [("blunt", BASE), ("sharp", 0.0)] {
            let mesh = grid::mesh(Airfoil::naca_0012(base), per_chord)?;
            let sag = sag(&mesh, &Curve::new(Airfoil::naca_0012(base)));
            let runs = runs(&mesh, base, &backend);
            let percent = |share: f64| format!("{:.4}", 100.0 * share);
            rows.push(vec![
                per_chord.to_string(),
                edge.to_owned(),
                mesh.tets.len().to_string(),
                runs.runs.to_string(),
                runs.valid.to_string(),
                percent(runs.moved),
                percent(runs.off[0]),
                percent(runs.off[1]),
                percent(sag),
                format!("{:.3}", runs.beta),
            ]);
            faults.extend(runs.faults.into_iter().map(|fault| format!("{per_chord} points a chord, {edge}, {fault}")));
        }
    }
    print_table(&rows);
    if faults.is_empty() {
        return Ok(());
    }
    faults.iter().for_each(|fault| println!("{fault}"));
    Err(format!("{} of the runs above are invalid or off", faults.len()).into())
}

/// All runs with one mesh.
fn runs(mesh: &TetMesh, base: f64, backend: &Arc<dyn Backend>) -> Runs {
    let mut runs = Runs { beta: f64::INFINITY, ..Runs::default() };
    let airfoils = [("own", Airfoil::naca_0012(base)), ("2412", Airfoil::naca_2412(base))];
    for planes in PLANES {
        let at = |name: &str| format!("planes at {} and {}, {name}", planes[0], planes[1]);
        runs.runs += airfoils.len();
        // The two airfoils' planes are the same, and so are the old profiles.
        let mut mover = match mover(mesh, planes, backend) {
            Ok(mover) => mover,
            Err(failure) => {
                runs.faults.extend(airfoils.map(|(name, _)| format!("{}: {failure}", at(name))));
                continue;
            }
        };
        for (which, (name, airfoil)) in airfoils.into_iter().enumerate() {
            let new = profiles(airfoil, planes);
            let design = Design { profiles: BTreeMap::from([("wing".to_owned(), new)]), ..Design::default() };
            let outcome = match mover.update(&design) {
                Ok(outcome) => outcome,
                Err(error) => {
                    runs.faults.push(format!("{}: {error}", at(name)));
                    continue;
                }
            };
            let (off, vertex) = farthest(mesh, &outcome, &Curve::new(airfoil));
            runs.off[which] = runs.off[which].max(off);
            let lowest = |betas: &[f64]| betas.iter().copied().fold(f64::INFINITY, f64::min);
            runs.beta = runs.beta.min(lowest(&outcome.beta) / lowest(&outcome.original_beta));
            if which == 0 {
                let moved = wing(mesh)
                    .into_iter()
                    .map(|vertex| outcome.even_if_invalid().displacement()[vertex as usize].length());
                runs.moved = runs.moved.max(moved.fold(0.0, f64::max));
            }
            let valid = outcome.converged && outcome.is_valid();
            runs.valid += usize::from(valid);
            if !valid {
                runs.faults.push(format!("{}: {}", at(name), why(&outcome)));
            }
            if off > ALLOWED || off.is_nan() {
                let from = mesh.vertices[vertex as usize];
                runs.faults.push(format!("{}: the vertex at {from:.4} ends {:.3} % off", at(name), 100.0 * off));
            }
        }
    }
    runs
}

fn mover(mesh: &TetMesh, planes: [f64; 2], backend: &Arc<dyn Backend>) -> Result<Mover, Failure> {
    let triangles = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|&(_, &family)| family == grid::WING);
    let triangles: Vec<[u32; 3]> = triangles.map(|(&triangle, _)| triangle).collect();
    let at = |y: f64| Plane { point: DVec3::Y * y, normal: DVec3::Y };
    let old = cut::cut_at_planes(&mesh.vertices, &triangles, &[(1, at(planes[0])), (2, at(planes[1]))])?;
    let role = |family: &String| match family.as_str() {
        "wing" => Role::Wing,
        "trailing_edge" => Role::TrailingEdge,
        "farfield" => Role::Fixed,
        _ => Role::PLANE,
    };
    let mut builder = Mover::builder(mesh.clone()).old_profiles("wing", old);
    for family in &mesh.families {
        builder = builder.role(family, role(family));
    }
    Ok(builder.build(backend.clone())?)
}

/// An airfoil at two places of the span, numbered from 1; closed if it is sharp.
fn profiles(airfoil: Airfoil, planes: [f64; 2]) -> Vec<Profile> {
    let mut points = airfoil.points(STEPS);
    if airfoil.base == 0.0 {
        let last = points.len() - 1;
        points[last] = points[0];
    }
    let at = |y: f64| points.iter().map(|point| DVec3::new(point.x, y, point.y)).collect();
    (1..).zip(planes).map(|(number, y)| Profile { number, points: at(y) }).collect()
}

/// The wing's vertices, ascending.
fn wing(mesh: &TetMesh) -> Vec<u32> {
    let of_wing = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|&(_, &family)| family == grid::WING);
    let mut vertices: Vec<u32> = of_wing.flat_map(|(&triangle, _)| triangle).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// The wing's vertex that is farthest from an airfoil after a run.
fn farthest(mesh: &TetMesh, outcome: &Outcome, curve: &Curve) -> (f64, u32) {
    let off = |vertex: u32| (curve.distance(section(outcome.even_if_invalid().vertices()[vertex as usize])), vertex);
    wing(mesh).into_par_iter().map(off).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NAN, 0))
}

/// Largest distance of an edge's middle from the airfoil that its ends stand on.
fn sag(mesh: &TetMesh, curve: &Curve) -> f64 {
    let of_wing = mesh.triangles.par_iter().zip(&mesh.triangle_family).filter(|&(_, &family)| family == grid::WING);
    let edges = of_wing.flat_map_iter(|(&[a, b, c], _)| [[a, b], [b, c], [c, a]]);
    let middles = edges.map(|edge| edge.map(|end| mesh.vertices[end as usize]).iter().sum::<DVec3>() / 2.0);
    middles.map(|middle| curve.distance(section(middle))).reduce(|| 0.0, f64::max)
}

/// The place of a point in its section.
fn section(point: DVec3) -> DVec2 {
    DVec2::new(point.x, point.z)
}

/// What makes an outcome invalid.
fn why(outcome: &Outcome) -> String {
    let mut faults = Vec::new();
    if !outcome.converged {
        faults.push(format!("not converged: {:?}", outcome.unconverged));
    }
    if outcome.inverted > 0 {
        faults.push(format!("{} inverted tets", outcome.inverted));
    }
    if !outcome.self_intersecting.is_empty() {
        faults.push(format!("{} triangles self-intersecting", outcome.self_intersecting.len()));
    }
    for missed in outcome.missed.values() {
        let at = outcome.even_if_invalid().vertices()[missed.vertex];
        faults.push(format!(
            "the vertex at {at:.4} misses profile {} by {:.3} %",
            missed.profile,
            100.0 * missed.share
        ));
    }
    for (family, deviation) in outcome.off_surface.iter().chain(&outcome.parted) {
        faults.push(format!("{family} is off its surface or parted by {:e}", deviation.distance));
    }
    let held = outcome.held_back.iter().filter(|held| held.beyond.is_some());
    faults.extend(held.map(|held| format!("{held:?}")));
    faults.join(", ")
}
