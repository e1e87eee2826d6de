//! The edges of the cells as springs: the graph of the springs, and their stiffness at one shape of
//! the mesh.
//!
//! The stiffness of an edge is a sum over the tets and corner tets at the edge. Corner tets also
//! have edges that join two neighbours of a corner, such as the diagonals of a hexahedron's faces.
//! No spring runs along these.

use std::cell::LazyCell;

use glam::DVec3;
use rayon::prelude::*;

use crate::stage::SetUp;
use crate::{
    backend::{BackendError, EdgeStiffness},
    mesh::{
        CornerCells, TetMesh,
        edges::{TetEdges, VertexGraph},
    },
    springs::{Springs, Stiffness, wall_proximity},
};

/// Edges in a task.
const EDGES: usize = 4096;

/// The graph of a mesh's springs. It is the same for all deformed shapes of the mesh.
pub struct EdgeGraph {
    pub(super) tets: TetEdges,
    pub(super) graph: VertexGraph,
}

impl EdgeGraph {
    /// Collects the edges of the tets and corner tets. Springs run along the edges of cells only.
    ///
    /// - `mesh`, `cells`: of [`CornerCells::new`]
    pub fn new(mesh: &TetMesh, cells: &CornerCells) -> Self {
        let n_vertices = mesh.vertices.len();
        let tets = TetEdges::new(n_vertices, &mesh.tets);
        let graph = if cells.are_tets() {
            VertexGraph::new(n_vertices, &tets.edges)
        } else {
            let is_real = cells.real_edges(&tets);
            VertexGraph::of_some(n_vertices, &tets.edges, |edge| is_real[edge])
        };
        Self { tets, graph }
    }
}

/// The springs along the edges, at one shape of the mesh.
pub(super) struct EdgeSprings {
    /// Length of each edge `[n_edges]`, in the mesh's unit.
    pub(super) length: Vec<f64>,
    /// Stiffness of each edge for displacements `[n_edges]`.
    pub(super) stiffness: Vec<f64>,
    /// Stiffness of each edge for rotations `[n_edges]`; `None` if the springs are not
    /// rotation-aware.
    pub(super) rotation_stiffness: Option<Vec<f64>>,
}

impl EdgeSprings {
    /// Evaluates the springs at the vertices of `set_up`'s mesh.
    ///
    /// # Errors
    /// The backend failed, or the mesh does not fit the device.
    pub(super) fn new(set_up: &SetUp, tets: &TetEdges, springs: &Springs) -> Result<Self, BackendError> {
        let SetUp { mesh, surface, families, backend, .. } = *set_up;
        let TetEdges { edges, edge_tets, tet_edges } = tets;
        let edge_vector: Vec<DVec3> =
            edges.iter().map(|[a, b]| mesh.vertices[*b as usize] - mesh.vertices[*a as usize]).collect();
        let near = LazyCell::new(|| {
            let walls: Vec<[u32; 3]> = families.moved().flat_map(|family| surface.corners_of(family)).collect();
            wall_proximity(&mesh.vertices, edges, &walls)
        });
        let length: Vec<f64> = edge_vector.iter().map(|vector| vector.length()).collect();
        // One sum over the tets serves both stiffnesses.
        let sum = match springs.are_torsional() {
            true => backend.edge_stiffness(&EdgeStiffness { edge_vector: &edge_vector, edge_tets, tet_edges })?,
            false => vec![0.0; edges.len()],
        };
        let stiffness = |of: Stiffness| -> Vec<f64> {
            let mut stiffness: Vec<f64> =
                length.iter().zip(&sum).map(|(&length, &sum)| of.on_wall(length, sum)).collect();
            if of.wall != 0.0 {
                stiffness
                    .par_iter_mut()
                    .zip(&**near)
                    .with_min_len(EDGES)
                    .for_each(|(stiffness, near)| *stiffness *= near.powf(of.wall));
            }
            stiffness
        };
        let rotation_stiffness = springs.rotation.map(stiffness);
        Ok(Self { stiffness: stiffness(springs.stiffness), rotation_stiffness, length })
    }
}
