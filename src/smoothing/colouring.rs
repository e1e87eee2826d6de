//! Colours of vertices. Two vertices of one colour share no tet, so they can move at the same time.

use crate::mesh::csr::Csr;

/// Stands for no colour.
pub const NONE: u32 = u32::MAX;

/// Gives each vertex in `moving` the lowest colour free around it, one vertex after another
/// `[n_moving]`.
///
/// - `tets` `[n_tets]`
/// - `vertex_tets` `[n_vertices]` rows, each entry is `tet * 4 + local vertex`
/// - `moving`: the vertices, each once
/// - `scratch` `[n_vertices]`: [`NONE`] everywhere, on entry and on exit
pub fn colour(tets: &[[u32; 4]], vertex_tets: &Csr, moving: &[u32], scratch: &mut [u32]) -> Vec<u32> {
    // For each colour the last vertex that found it taken.
    let mut taken: Vec<u32> = Vec::new();
    for &vertex in moving {
        for &entry in vertex_tets.row(vertex as usize) {
            for &other in &tets[entry as usize / 4] {
                if let Some(seen) = taken.get_mut(scratch[other as usize] as usize) {
                    *seen = vertex;
                }
            }
        }
        let free = taken.iter().position(|&seen| seen != vertex).unwrap_or(taken.len());
        if free == taken.len() {
            taken.push(NONE);
        }
        scratch[vertex as usize] = free as u32;
    }
    moving.iter().map(|&vertex| std::mem::replace(&mut scratch[vertex as usize], NONE)).collect()
}
