//! The file with the faulty tets of a moved mesh that is not valid.

use std::path::Path;

use glam::DVec3;

use super::SessionError;
use super::files::cannot_write;
use super::names::inverted_name;
use crate::formats::{Cells, Fields, FileSet, vtu_bytes};
use crate::mover::Outcome;
use crate::quality::faults;

/// Adds the faulty tets to a set of files as `NAME.inverted.vtu`, in the folder of an output.
///
/// The file holds the inverted tets, the tets around them, and each tet's `beta`, which is not
/// positive in inverted tets. Without inverted tets the file holds the tets at self-intersecting
/// surface triangles.
///
/// # Errors
/// The file cannot be written.
pub(super) fn add_inverted(files: &mut FileSet, output: &Path, outcome: &Outcome) -> Result<(), SessionError> {
    let path = inverted_name(output);
    let moved = outcome.even_if_invalid();
    let all = &outcome.mesh().tets;
    let triangles = &outcome.mesh().triangles;
    let shown = if outcome.inverted > 0 {
        faults::around(all, moved.vertices().len(), &faults::inverted(&outcome.beta))
    } else {
        let mut corners: Vec<u32> =
            outcome.self_intersecting.iter().flat_map(|&triangle| triangles[triangle as usize]).collect();
        corners.sort_unstable();
        let touches = |tet: &[u32; 4]| tet.iter().any(|vertex| corners.binary_search(vertex).is_ok());
        (0..all.len() as u32).filter(|&tet| touches(&all[tet as usize])).collect()
    };
    // The file holds only the vertices of these tets, with new numbers.
    let mut used: Vec<u32> = shown.iter().flat_map(|&tet| all[tet as usize]).collect();
    used.sort_unstable();
    used.dedup();
    let number = |vertex: u32| used.partition_point(|&other| other < vertex) as u32;
    let tets: Vec<[u32; 4]> = shown.iter().map(|&tet| all[tet as usize].map(number)).collect();
    let pick = |of: &[DVec3]| used.iter().map(|&vertex| of[vertex as usize]).collect::<Vec<_>>();
    let beta: Vec<f64> = shown.iter().map(|&tet| outcome.beta[tet as usize]).collect();
    let fields = Fields { displacement: Some(&pick(moved.displacement())), beta: Some(&beta) };
    let cells = Cells { tets: &tets, triangles: &[], triangle_family: &[], families: &[] };
    let bytes = vtu_bytes(&pick(moved.vertices()), &cells, &fields)?;
    files.add(&path, move |out| out.write_all(&bytes)).map_err(|error| cannot_write(&path, error))
}
