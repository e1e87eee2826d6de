//! Colours for the vertices: two vertices of one colour share no tet, so they can move at the same time.

use crate::mesh::csr::Csr;

/// The colour of a vertex that has none.
pub const NONE: u32 = u32::MAX;

/// Gives each vertex that may move the lowest colour free around it, in the order of their numbers `[n_vertices]`; the
/// others get [`NONE`].
///
/// - `vertex_tets` `[n_vertices]` rows, each entry `tet * 4 + local vertex`
/// - `moves` `[n_vertices]`: whether a vertex needs a colour
pub fn colour(tets: &[[u32; 4]], vertex_tets: &Csr, moves: &[bool]) -> Vec<u32> {
    let mut colours = vec![NONE; moves.len()];
    // For each colour the last vertex that saw it taken.
    let mut taken: Vec<usize> = Vec::new();
    for vertex in (0..moves.len()).filter(|&vertex| moves[vertex]) {
        for &entry in vertex_tets.row(vertex) {
            for &other in &tets[entry as usize / 4] {
                if let Some(seen) = taken.get_mut(colours[other as usize] as usize) {
                    *seen = vertex;
                }
            }
        }
        let free = taken.iter().position(|&seen| seen != vertex).unwrap_or(taken.len());
        if free == taken.len() {
            taken.push(usize::MAX);
        }
        colours[vertex] = free as u32;
    }
    colours
}
