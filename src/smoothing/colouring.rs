//! Colours for vertices: two vertices of one colour share no tet, so they can move at the same time.

use crate::mesh::csr::Csr;

/// The colour of a vertex that has none.
pub const NONE: u32 = u32::MAX;

/// Gives each of these vertices the lowest colour free around it, one after another `[n_moving]`.
///
/// - `vertex_tets` `[n_vertices]` rows, each entry `tet * 4 + local vertex`
/// - `moving`: the vertices, each once
/// - `scratch` `[n_vertices]`: [`NONE`] everywhere, and so it is again in the end
pub fn colour(tets: &[[u32; 4]], vertex_tets: &Csr, moving: &[u32], scratch: &mut [u32]) -> Vec<u32> {
    // For each colour the last vertex that saw it taken.
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
