//! What `idmesh run` says and shows of a moved mesh that is not valid.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::failure::{Exit, Failure};
use super::job::Job;
use super::outputs;
use crate::formats::{Cells, Fields, write_vtu};
use crate::geometry::triangle_normal;
use crate::mesh::TetMesh;
use crate::mover::{Beyond, MISSED, Mover, Outcome};
use crate::projection::crossing::crosses;
use crate::quality::faults::{self, Cluster};
use crate::report::StageName;

/// Writes the inverted tets and those around them beside an output, as `NAME.inverted.vtu`; its
/// `beta` tells them apart. Without inverted tets it is those at the surface triangles where the
/// surface passes through itself.
///
/// # Errors
/// The file cannot be written.
pub(super) fn write_inverted(output: &Path, mover: &Mover, outcome: &Outcome) -> Result<PathBuf, Failure> {
    let path = outputs::inverted_name(output);
    let all = &mover.mesh().tets;
    let triangles = &mover.mesh().triangles;
    let shown = if outcome.inverted > 0 {
        faults::around(all, outcome.vertices.len(), &faults::inverted(&outcome.beta))
    } else {
        let mut at_pierced: Vec<u32> =
            outcome.self_intersecting.iter().flat_map(|&triangle| triangles[triangle as usize]).collect();
        at_pierced.sort_unstable();
        let touches = |tet: &[u32; 4]| tet.iter().any(|vertex| at_pierced.binary_search(vertex).is_ok());
        (0..all.len() as u32).filter(|&tet| touches(&all[tet as usize])).collect()
    };
    // Only the vertices of these tets, numbered anew.
    let mut used: Vec<u32> = shown.iter().flat_map(|&tet| all[tet as usize]).collect();
    used.sort_unstable();
    used.dedup();
    let number = |vertex: u32| used.partition_point(|&other| other < vertex) as u32;
    let tets: Vec<[u32; 4]> = shown.iter().map(|&tet| all[tet as usize].map(number)).collect();
    let pick = |of: &[DVec3]| used.iter().map(|&vertex| of[vertex as usize]).collect::<Vec<_>>();
    let beta: Vec<f64> = shown.iter().map(|&tet| outcome.beta[tet as usize]).collect();
    let fields = Fields { displacement: Some(&pick(&outcome.displacement)), beta: Some(&beta) };
    let cells = Cells { tets: &tets, triangles: &[], triangle_family: &[], families: &[] };
    write_vtu(&path, &pick(&outcome.vertices), &cells, &fields)?;
    Ok(path)
}

/// The failure that inverted tets are: how many, since which stage, where the worst is, in which
/// files to look, what to try.
pub(super) fn failure(mover: &Mover, job: &Job, outcome: &Outcome, written: &[PathBuf]) -> Failure {
    let mesh = mover.mesh();
    let clusters = faults::clusters(&outcome.vertices, &mesh.tets, &outcome.beta);
    let family = |cluster: &Cluster| {
        let triangle = faults::nearest_triangle(&outcome.vertices, &mesh.tets, &mesh.triangles, cluster)?;
        Some(mesh.families[mesh.triangle_family[triangle as usize].index()].as_str())
    };
    let mut faults = Vec::new();
    if outcome.inverted > 0 {
        faults.push(format!("{} of {} tets are inverted", outcome.inverted, outcome.beta.len()));
    }
    if let Some(&first) = outcome.self_intersecting.first() {
        let mut counts: BTreeMap<String, usize> = BTreeMap::new();
        for &triangle in &outcome.self_intersecting {
            *counts.entry(mesh.families[mesh.triangle_family[triangle as usize].index()].clone()).or_default() += 1;
        }
        faults.push(format!(
            "the moved surface passes through itself ({}), first {}",
            folds(&counts),
            passage(mesh, &outcome.vertices, first)
        ));
    }
    if !outcome.off_surface.is_empty() {
        let off_surface: Vec<_> =
            outcome.off_surface.iter().map(|(name, by)| format!("{name} by {}", short(*by))).collect();
        faults.push(format!("vertices left the surface they slide on ({})", off_surface.join(", ")));
    }
    if !outcome.parted.is_empty() {
        let parted: Vec<_> = outcome.parted.iter().map(|(name, by)| format!("{name} by {}", short(*by))).collect();
        faults.push(format!("partners in periodic planes are no longer apart by the same way ({})", parted.join(", ")));
    }
    for held in &outcome.held_back {
        let Some(Beyond { distance, edge, at }) = held.beyond else { continue };
        let [x, y, z] = at.to_array().map(short);
        faults.push(format!(
            "`{}` holds vertices of `{}` back by more than their shortest edge, at ({x}, {y}, {z}) by {} where that is {}",
            held.by,
            held.family,
            short(distance),
            short(edge)
        ));
    }
    for (wing, missed) in &outcome.missed {
        let [x, y, z] = outcome.vertices[missed.vertex].to_array().map(short);
        faults.push(format!(
            "the wing of `{wing}` misses its new profile {} by {:.2} % of the chord at ({x}, {y}, {z}), allowed is {} %",
            missed.profile,
            100.0 * missed.share,
            100.0 * MISSED
        ));
    }
    let mut message = faults.join(", and ");
    if let Some(worst) = clusters.first() {
        let near = family(worst).map(|family| format!(" near `{family}`")).unwrap_or_default();
        let [x, y, z] = worst.at.to_array().map(short);
        message += &format!("; {}, the worst tet at ({x}, {y}, {z}){near}", places(clusters.len()));
    }
    if outcome.inverted > 0 {
        message += &format!("; inverted by stage: {}", stages(outcome));
    }
    if let Some((stage, count)) = outcome.folds.first() {
        message += &format!("; triangles folded first by stage {stage}: {count}");
    }
    if outcome.path.reached > 0.0 && outcome.path.reached < 1.0 {
        message += &format!("; valid meshes lead up to {:.0} % of the motion", 100.0 * outcome.path.reached);
    }
    if !written.is_empty() {
        let names: Vec<_> = written.iter().map(|path| path.display().to_string()).collect();
        message += &format!("; the mesh is in {}", names.join(", "));
    }
    Failure::new(Exit::Inverted, message).with_hint(hint(job, outcome))
}

/// Where a surface passes through itself: at a triangle and the first one that crosses it, and how
/// these stood before.
fn passage(mesh: &TetMesh, moved: &[DVec3], first: u32) -> String {
    let of =
        |vertices: &[DVec3], triangle: u32| mesh.triangles[triangle as usize].map(|vertex| vertices[vertex as usize]);
    let middle = |[a, b, c]: [DVec3; 3]| (a + b + c) / 3.0;
    let place = |triangle: u32| {
        let [x, y, z] = middle(of(moved, triangle)).to_array().map(short);
        let family = &mesh.families[mesh.triangle_family[triangle as usize].index()];
        format!("`{family}` at ({x}, {y}, {z})")
    };
    let crossing = |other: &u32| crosses(moved, mesh.triangles[first as usize], mesh.triangles[*other as usize]);
    let Some(other) = (0..mesh.triangles.len() as u32).find(crossing) else { return place(first) };
    let [one, two] = [first, other].map(|triangle| of(&mesh.vertices, triangle));
    // Triangles of one edge look nearly the same or nearly opposite ways: the surface is thin
    // there.
    let angle = triangle_normal(one).angle_between(triangle_normal(two)).to_degrees();
    format!(
        "{} with {}, which were {} apart before, their planes at {:.0} degrees",
        place(first),
        place(other),
        short(middle(one).distance(middle(two))),
        angle.min(180.0 - angle)
    )
}

fn places(n: usize) -> String {
    if n == 1 { "in one place".to_owned() } else { format!("in {n} places") }
}

/// `deformed 20, corrected 24, final 3`: the inverted tets at each stage after the first.
fn stages(outcome: &Outcome) -> String {
    let name = |name| match name {
        StageName::Original => "original",
        StageName::Deformed => "deformed",
        StageName::Corrected => "corrected",
        StageName::Final => "final",
    };
    let moved = outcome.stages.iter().filter(|stage| stage.name != StageName::Original);
    moved.map(|stage| format!("{} {}", name(stage.name), stage.inverted)).collect::<Vec<_>>().join(", ")
}

fn hint(job: &Job, outcome: &Outcome) -> String {
    if outcome.held_back.iter().any(|held| held.beyond.is_some()) {
        return "give what holds them a role that lets them move, such as carenage or plane, or profiles that leave them \
                where they are"
            .to_owned();
    }
    if !outcome.self_intersecting.is_empty() {
        let suspect = match &outcome.nearest_to_refusal {
            Some((wing, closeness)) => format!("; of the profiles of `{wing}` {closeness}"),
            None => String::new(),
        };
        return format!(
            "no volume fits a surface that passes through itself: correct its profiles or displacements first{suspect}"
        );
    }
    if !outcome.parted.is_empty() {
        return "partners that a design prescribes must move alike: correct their displacements first".to_owned();
    }
    if !outcome.folded.is_empty() {
        return format!(
            "the moved surface itself is folded ({}), and no volume fits it: correct its profiles or displacements first",
            folds(&outcome.folded)
        );
    }
    if outcome.inverted == 0 && !outcome.missed.is_empty() {
        return "a family that holds the wing back, or a change too uneven along the span for these profiles: give more of \
                them there"
            .to_owned();
    }
    if !outcome.converged {
        return "the relaxation did not converge either: raise max_sweeps or tolerance in [solver] first".to_owned();
    }
    if job.settings.quality.is_none() {
        return "target = \"original\" in [quality] repairs tets; a smaller change of the surface keeps more of them valid"
            .to_owned();
    }
    "a smaller change of the surface, or the same in another place, keeps more tets valid".to_owned()
}

/// The warning about surface triangles that turned over, if there are any.
pub(super) fn fold_warning(folded: &BTreeMap<String, usize>) -> Option<String> {
    (!folded.is_empty()).then(|| format!("surface triangles turned over against those around them: {}", folds(folded)))
}

/// `wing 3, wingtip 1`.
fn folds(folded: &BTreeMap<String, usize>) -> String {
    folded.iter().map(|(family, count)| format!("{family} {count}")).collect::<Vec<_>>().join(", ")
}

/// A coordinate with six significant digits, without trailing zeros.
fn short(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folds_are_told_by_family() {
        assert_eq!(fold_warning(&BTreeMap::new()), None);
        let folded = BTreeMap::from([("wing".to_owned(), 3), ("tip".to_owned(), 1)]);
        assert!(fold_warning(&folded).unwrap().ends_with(": tip 1, wing 3"));
    }

    #[test]
    fn coordinates_are_short() {
        assert_eq!(short(1.0 / 3.0).to_string(), "0.333333");
        assert_eq!(short(1.5).to_string(), "1.5");
    }
}
