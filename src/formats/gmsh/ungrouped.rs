//! Faces without a physical group: an error on the boundary, and left out elsewhere.
//!
//! With "Save all elements" Gmsh also saves surfaces inside the volume, for example surfaces that
//! only control the size of the cells, and surfaces that bound no volume.

use std::collections::HashMap;
use std::path::Path;

use crate::formats::error::ReadError;
use crate::formats::mesh_builder::MeshBuilder;
use crate::mesh::cell_faces;

/// The vertices of a face, ascending. For a triangle the last entry is a number that no vertex has.
type Key = [u32; 4];

fn key(corners: impl IntoIterator<Item = u32>) -> Key {
    let mut key = [u32::MAX; 4];
    key.iter_mut().zip(corners).for_each(|(place, corner)| *place = corner);
    key.sort_unstable();
    key
}

/// The faces of a file without a group.
#[derive(Default)]
pub(super) struct Ungrouped {
    /// Each face with its surface, if the file gives one.
    faces: Vec<(Key, Option<i32>)>,
}

impl Ungrouped {
    /// Adds a face by its vertices.
    pub fn add(&mut self, face: &[u32], surface: Option<i32>) {
        self.faces.push((key(face.iter().copied()), surface));
    }

    /// Checks that no face without a group has a cell on one side only. Returns the faces that are
    /// left out, in words.
    ///
    /// - `n_faces`: number of faces in the file, including faces in groups
    /// - `at`: the place of a vertex, in words
    ///
    /// # Errors
    /// [`ReadError::WithoutFamily`]
    pub fn check(
        &self,
        path: &Path,
        mesh_builder: &MeshBuilder,
        n_faces: usize,
        at: impl Fn(u32) -> String,
    ) -> Result<Option<String>, ReadError> {
        if self.faces.is_empty() {
            return Ok(None);
        }
        let mut n_cells: HashMap<Key, u32> = self.faces.iter().map(|&(face, _)| (face, 0)).collect();
        let mut count = |cell: &[u32]| {
            for face in cell_faces(cell.len()) {
                if let Some(cells) = n_cells.get_mut(&key(face.iter().map(|&corner| cell[corner]))) {
                    *cells += 1;
                }
            }
        };
        mesh_builder.tets.iter().for_each(|cell| count(cell));
        mesh_builder.others.pyramids.iter().for_each(|cell| count(cell));
        mesh_builder.others.prisms.iter().for_each(|cell| count(cell));
        mesh_builder.others.hexahedra.iter().for_each(|cell| count(cell));
        // A face that also occurs in a group has a family.
        let grouped = mesh_builder.triangles.iter().map(|face| key(*face));
        for face in grouped.chain(mesh_builder.others.quadrilaterals.iter().map(|face| key(*face))) {
            if let Some(cells) = n_cells.get_mut(&face) {
                *cells = 0;
            }
        }
        let mut outer = self.faces.iter().filter(|(face, _)| n_cells[face] == 1);
        let Some(&(face, surface)) = outer.next() else {
            return Ok(Some(format!("{} faces without a group, which are not on the boundary", self.faces.len())));
        };
        let detail = match surface {
            Some(surface) => format!("the first on surface {surface}"),
            None => format!("the first at {}", at(face[0])),
        };
        Err(ReadError::WithoutFamily { path: path.into(), count: 1 + outer.count(), n_triangles: n_faces, detail })
    }
}
