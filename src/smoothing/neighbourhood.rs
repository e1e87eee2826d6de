//! The vertices to be moved and the tets around them, with numbers of their own, as a device
//! receives them.

use std::ops::Range;

use glam::DVec3;

use super::colouring::{NONE, colour};
use crate::mesh::csr::Csr;

/// Vertices to be moved, and the tets around them. Its size does not depend on the size of the
/// mesh.
pub(super) struct Neighbourhood {
    /// Indices of the vertices in the mesh: first the vertices to be moved, colour by colour.
    pub(super) vertices: Vec<u32>,
    /// Range of each colour in `vertices`.
    pub(super) colours: Vec<Range<u32>>,
    /// Indices of the tets in the mesh.
    pub(super) tets: Vec<u32>,
    /// Vertices of each tet, as indices into `vertices`.
    pub(super) corners: Vec<[u32; 4]>,
    /// Tets around each vertex to be moved, each entry is `index in tets * 4 + local vertex`.
    pub(super) vertex_tets: Csr,
}

/// The tets of a mesh, the tets around each vertex, and scratch space for a neighbourhood.
pub(super) struct Topology {
    pub(super) tets: Vec<[u32; 4]>,
    /// Tets around each vertex, each entry is `tet * 4 + local vertex`.
    pub(super) vertex_tets: Csr,
    /// Indices of vertices and tets in the neighbourhood under construction, otherwise [`NONE`].
    place_of_vertex: Vec<u32>,
    place_of_tet: Vec<u32>,
}

impl Topology {
    pub(super) fn new(tets: &[[u32; 4]], n_vertices: usize) -> Self {
        let corners = tets.iter().enumerate().flat_map(|(tet, corners)| {
            corners.iter().enumerate().map(move |(local, &vertex)| (vertex, (4 * tet + local) as u32))
        });
        Self {
            vertex_tets: Csr::from_pairs(n_vertices, corners),
            place_of_vertex: vec![NONE; n_vertices],
            place_of_tet: vec![NONE; tets.len()],
            tets: tets.to_vec(),
        }
    }

    /// The neighbourhood of some vertices, given in ascending order.
    pub(super) fn around(&mut self, moving: &[u32]) -> Neighbourhood {
        let Self { tets: all_tets, vertex_tets: rows, place_of_vertex, place_of_tet } = self;
        let colour_of = colour(all_tets, rows, moving, place_of_vertex);
        let n_colours = colour_of.iter().map(|&colour| colour as usize + 1).max().unwrap_or(0);
        let by_colour = Csr::from_pairs(n_colours, colour_of.iter().copied().zip(moving.iter().copied()));
        let colours = by_colour.row_start.windows(2).map(|ends| ends[0]..ends[1]).collect();
        let mut vertices = by_colour.entries;
        vertices.iter().zip(0..).for_each(|(&vertex, place)| place_of_vertex[vertex as usize] = place);
        let (mut tets, mut corners) = (Vec::new(), Vec::new());
        let mut vertex_tets = Csr { row_start: vec![0], entries: Vec::new() };
        for moving in 0..moving.len() {
            for &entry in rows.row(vertices[moving] as usize) {
                let tet = entry / 4;
                if place_of_tet[tet as usize] == NONE {
                    place_of_tet[tet as usize] = tets.len() as u32;
                    tets.push(tet);
                    corners.push(all_tets[tet as usize].map(|vertex| {
                        if place_of_vertex[vertex as usize] == NONE {
                            place_of_vertex[vertex as usize] = vertices.len() as u32;
                            vertices.push(vertex);
                        }
                        place_of_vertex[vertex as usize]
                    }));
                }
                vertex_tets.entries.push(place_of_tet[tet as usize] * 4 + entry % 4);
            }
            vertex_tets.row_start.push(vertex_tets.entries.len() as u32);
        }
        vertices.iter().for_each(|&vertex| place_of_vertex[vertex as usize] = NONE);
        tets.iter().for_each(|&tet| place_of_tet[tet as usize] = NONE);
        Neighbourhood { vertices, colours, tets, corners, vertex_tets }
    }
}

impl Neighbourhood {
    /// Number of vertices to be moved.
    pub(super) fn n_moving(&self) -> usize {
        self.vertex_tets.n_rows()
    }

    /// The positions of the neighbourhood's vertices, from the positions of all vertices
    /// `[n_vertices]`.
    pub(super) fn positions(&self, at: &[DVec3]) -> Vec<DVec3> {
        self.vertices.iter().map(|&vertex| at[vertex as usize]).collect()
    }
}
