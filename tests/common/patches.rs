//! A whole mesh as one patch for a smoother on a device, numbered without the crate's own way to do
//! it.

use std::ops::Range;

use glam::DVec3;
use idmesh::backend::{Ball, SmoothingPatch};
use idmesh::constraint::Constraint;
use idmesh::mesh::csr::Csr;
use idmesh::smoothing::{NONE, colour};

/// Tets around each vertex `[n_vertices]` rows, each entry `tet * 4 + local vertex`.
pub fn vertex_tets(tets: &[[u32; 4]], n_vertices: usize) -> Csr {
    let corner = |slot: usize| (tets[slot / 4][slot % 4], slot as u32);
    Csr::from_pairs(n_vertices, (0..4 * tets.len()).map(corner))
}

/// A mesh with its moving vertices first, colour by colour.
pub struct Whole {
    /// The vertices' numbers in the mesh.
    pub vertices: Vec<u32>,
    pub tets: Vec<[u32; 4]>,
    vertex_tets: Csr,
    colours: Vec<Range<u32>>,
    /// How far each moving vertex may go; anywhere at first.
    pub reach: Vec<Option<Ball>>,
}

impl Whole {
    pub fn new(tets: &[[u32; 4]], n_vertices: usize, moving: &[u32]) -> Self {
        let colours = colour(tets, &vertex_tets(tets, n_vertices), moving, &mut vec![NONE; n_vertices]);
        let mut by_colour: Vec<(u32, u32)> = colours.iter().copied().zip(moving.iter().copied()).collect();
        by_colour.sort_unstable();
        let mut vertices: Vec<u32> = by_colour.iter().map(|&(_, vertex)| vertex).collect();
        vertices.extend((0..n_vertices as u32).filter(|vertex| !moving.contains(vertex)));
        let place = |vertex: u32| vertices.iter().position(|&found| found == vertex).unwrap() as u32;
        let tets: Vec<[u32; 4]> = tets.iter().map(|tet| tet.map(place)).collect();
        let mut rows = vertex_tets(&tets, n_vertices);
        rows.row_start.truncate(moving.len() + 1);
        rows.entries.truncate(rows.row_start[moving.len()] as usize);
        let of_colour = |colour: u32| {
            let end = |colour: u32| by_colour.partition_point(|&(found, _)| found < colour) as u32;
            end(colour)..end(colour + 1)
        };
        let n_colours = colours.iter().max().map_or(0, |colour| colour + 1);
        let colours = (0..n_colours).map(of_colour).collect();
        Self { vertices, tets, vertex_tets: rows, colours, reach: vec![None; moving.len()] }
    }

    /// Something of each of the mesh's vertices, in the patch's order.
    pub fn ordered<R: Copy>(&self, of_vertices: &[R]) -> Vec<R> {
        self.vertices.iter().map(|&vertex| of_vertices[vertex as usize]).collect()
    }

    /// The patch.
    ///
    /// - `positions` `[n_vertices]`, `constraint` `[n_vertices]`: in its order
    pub fn patch<'a>(&'a self, positions: &'a [DVec3], constraint: &'a [Constraint]) -> SmoothingPatch<'a> {
        SmoothingPatch {
            positions,
            tets: &self.tets,
            vertex_tets: &self.vertex_tets,
            constraint: &constraint[..self.reach.len()],
            reach: &self.reach,
            colours: &self.colours,
        }
    }
}
