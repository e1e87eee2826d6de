//! [`WorstCell`]: where the quality of a moved mesh is lowest.

use std::borrow::Cow;

use glam::DVec3;
use serde::Serialize;

use crate::mesh::{HybridMesh, measures_of_cell, middle_of_cell};
use crate::mover::Outcome;

/// Most cells of the list in a report.
pub const LISTED: usize = 20;

/// One of the cells with the lowest quality.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstCell {
    /// The kind of the cell; see [`crate::mesh::CellKind::name`].
    pub kind: &'static str,
    /// The number of the cell among the cells of its kind, in the order of the file, from 0.
    pub index: usize,
    /// The mean of the cell's moved vertices, in the mesh's unit.
    pub at: [f64; 3],
    /// A family that the cell touches, or the nearest one.
    pub family: Option<String>,
    /// Whether a vertex of the cell belongs to the family.
    pub touches: bool,
    /// `"beta"` in a mesh of tets, `"scaled-jacobian"` in a mesh with other cells.
    pub measure: &'static str,
    /// The measure in the moved mesh.
    pub value: f64,
    /// The measure in the original mesh.
    pub original: f64,
}

/// The numbers of the cells with the lowest quality, in the order of [`HybridMesh`], the lowest
/// first. A value that is not a number is the lowest.
///
/// - `values` `[n_cells]`: the measure of each cell
/// - `count`: the number of cells that are wanted
pub(super) fn lowest(values: &[f64], count: usize) -> Vec<usize> {
    let key = |&cell: &usize| {
        let value = values[cell];
        if value.is_nan() { f64::NEG_INFINITY } else { value }
    };
    let order = |a: &usize, b: &usize| key(a).total_cmp(&key(b)).then(a.cmp(b));
    let mut cells: Vec<usize> = (0..values.len()).collect();
    if cells.len() > count {
        cells.select_nth_unstable_by(count, order);
        cells.truncate(count);
    }
    cells.sort_unstable_by(order);
    cells
}

/// The measure of each cell of the moved mesh `[n_cells]`, by which cells are ranked: beta in a
/// mesh of tets, the scaled Jacobian of the worst corner in a mesh with other cells.
pub(super) fn ranking(outcome: &Outcome) -> Cow<'_, [f64]> {
    match &outcome.cell_measures {
        None => Cow::Borrowed(&outcome.beta),
        Some(measures) => measures.iter().map(|cell| cell.jacobian).collect(),
    }
}

impl WorstCell {
    /// The worst cells of a moved mesh, the worst first.
    pub fn list(outcome: &Outcome) -> Vec<Self> {
        let mesh = HybridMesh { mesh: outcome.mesh(), others: outcome.other_cells() };
        let values = ranking(outcome);
        let moved = outcome.even_if_invalid().vertices();
        let of_tets = outcome.cell_measures.is_none();
        let cells = lowest(&values, LISTED);
        let families = Families::near(mesh, moved, &cells);
        let one = |(cell, (family, touches)): (usize, (Option<u32>, bool))| {
            let name = mesh.name(cell);
            Self {
                kind: name.kind.name(),
                index: name.index,
                at: middle_of_cell(mesh.cell(name), moved).to_array(),
                family: family.map(|family| mesh.mesh.families[family as usize].clone()),
                touches,
                measure: if of_tets { "beta" } else { "scaled-jacobian" },
                value: values[cell],
                original: match of_tets {
                    true => outcome.original_beta[cell],
                    false => measures_of_cell(mesh, cell, &mesh.mesh.vertices, None).jacobian,
                },
            }
        };
        cells.into_iter().zip(families).map(one).collect()
    }
}

/// The family at each of some cells.
struct Families;

impl Families {
    /// For each cell the family that it touches, or the nearest one, and whether it touches it.
    fn near(mesh: HybridMesh, moved: &[DVec3], cells: &[usize]) -> Vec<(Option<u32>, bool)> {
        let vertices = |cell: usize| mesh.cell(mesh.name(cell));
        let mut is_of_cell = vec![false; moved.len()];
        cells.iter().flat_map(|&cell| vertices(cell)).for_each(|&vertex| is_of_cell[vertex as usize] = true);
        let middles: Vec<DVec3> = cells.iter().map(|&cell| middle_of_cell(vertices(cell), moved)).collect();
        let mut nearest = vec![(f64::INFINITY, None); cells.len()];
        let mut touching: Vec<(u32, u32)> = Vec::new();
        for face in 0..mesh.n_faces() as u32 {
            let Some(family) = mesh.family_of(face).map(|family| u32::from(family.0)) else { continue };
            for &vertex in mesh.face_vertices(face) {
                if is_of_cell[vertex as usize] {
                    touching.push((vertex, family));
                }
                let at = moved[vertex as usize];
                for (nearest, middle) in nearest.iter_mut().zip(&middles) {
                    let distance = middle.distance_squared(at);
                    if distance < nearest.0 {
                        *nearest = (distance, Some(family));
                    }
                }
            }
        }
        touching.sort_unstable();
        touching.dedup();
        let family_at = |&vertex: &u32| {
            let at = touching.partition_point(|other| other.0 < vertex);
            touching.get(at).filter(|other| other.0 == vertex).map(|other| other.1)
        };
        let of_cell =
            |(&cell, (_, nearest)): (&usize, (f64, Option<u32>))| match vertices(cell).iter().find_map(family_at) {
                Some(family) => (Some(family), true),
                None => (nearest, false),
            };
        cells.iter().zip(nearest).map(of_cell).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails if a value that is not a number passes for a good one, or if equal values come in any
    /// order.
    #[test]
    fn the_lowest_come_first() {
        assert_eq!(lowest(&[0.3, 0.1, f64::NAN, -0.2, 0.1], 4), [2, 3, 1, 4]);
        assert_eq!(lowest(&[0.3], 4), [0]);
        assert_eq!(lowest(&[], 4), [0; 0]);
    }
}
