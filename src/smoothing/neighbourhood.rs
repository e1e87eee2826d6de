//! The tets around vertices that are to be moved, numbered by themselves: what a device is given.

use std::ops::Range;

use glam::DVec3;

use super::colouring::{NONE, colour};
use crate::mesh::csr::Csr;

/// Vertices that are to be moved with the tets around them. Costs what these cost, however large the mesh is.
pub(super) struct Neighbourhood {
    /// The vertices' numbers in the mesh, those to be moved first, colour by colour.
    pub(super) vertices: Vec<u32>,
    /// Where each colour stands in `vertices`.
    pub(super) colours: Vec<Range<u32>>,
    /// The tets' numbers in the mesh.
    pub(super) tets: Vec<u32>,
    /// Where the vertices of each tet stand in `vertices`.
    pub(super) corners: Vec<[u32; 4]>,
    /// Tets around each vertex to be moved, each entry `place in tets * 4 + local vertex`.
    pub(super) vertex_tets: Csr,
}

/// A mesh's tets around its vertices, and room to number some of them.
pub(super) struct Topology {
    pub(super) tets: Vec<[u32; 4]>,
    /// Tets around each vertex, each entry `tet * 4 + local vertex`.
    pub(super) vertex_tets: Csr,
    /// Places of vertices and of tets in the last neighbourhood; [`NONE`] between two.
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

    /// The neighbourhood of some vertices, ascending.
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

    /// Of all vertices' positions those of these.
    pub(super) fn positions(&self, at: &[DVec3]) -> Vec<DVec3> {
        self.vertices.iter().map(|&vertex| at[vertex as usize]).collect()
    }
}
