//! [`SurfaceBetas`]: the quality of a mesh whose surfaces alone have moved.
//!
//! Only tets with a vertex on a surface change then: one in seven of 800 000 tets around a wing.

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    families::{Families, PlacedBy},
    geometry::corners,
    mesh::TetMesh,
    quality::{self, Partial, Statistics},
};

/// Made once per mesh of tets.
pub(super) struct SurfaceBetas {
    /// The statistics of the blocks of the undeformed mesh's betas.
    partials: Vec<Partial>,
    /// The tets with a vertex on a surface, ascending.
    tets: Vec<u32>,
}

impl SurfaceBetas {
    /// - `betas` `[n_tets]`: of the undeformed mesh
    pub(super) fn new(mesh: &TetMesh, families: &Families, betas: &[f64]) -> Self {
        let on_surface = |tet: &[u32; 4]| tet.iter().any(|&vertex| is_on_surface(families, vertex));
        let tets = (0..mesh.tets.len() as u32).filter(|&tet| on_surface(&mesh.tets[tet as usize])).collect();
        Self { partials: Partial::of_blocks(betas), tets }
    }

    /// The statistics of the undeformed mesh.
    pub(super) fn undeformed(&self, betas: &[f64]) -> Statistics {
        Statistics::of_changed(betas, &self.partials, &[])
    }

    /// The statistics with the vertices at `here` `[n_vertices]`.
    ///
    /// - `betas` `[n_tets]`: of the undeformed mesh
    pub(super) fn at(&self, mesh: &TetMesh, families: &Families, betas: &[f64], here: &[DVec3]) -> Statistics {
        let moved = |vertex: u32| mesh.vertices[vertex as usize] != here[vertex as usize];
        // Nobody but a test moves vertices inside before the volume's stage.
        if (0..here.len() as u32).any(|vertex| !is_on_surface(families, vertex) && moved(vertex)) {
            return Statistics::new(&quality::betas_after(betas.to_vec(), &mesh.vertices, here, &mesh.tets));
        }
        let changed = |&tet: &u32| {
            let of_tet = mesh.tets[tet as usize];
            of_tet.iter().any(|&vertex| moved(vertex)).then(|| (tet, quality::beta(corners(here, of_tet))))
        };
        let changed: Vec<(u32, f64)> = self.tets.par_iter().filter_map(changed).collect();
        Statistics::of_changed(betas, &self.partials, &changed)
    }
}

fn is_on_surface(families: &Families, vertex: u32) -> bool {
    families.placed_by[vertex as usize] != PlacedBy::Volume
}
