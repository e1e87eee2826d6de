//! The boundary of a zone without faces.
//!
//! Conditions on vertices need no sections of faces. They hold faces all the same: those sides of
//! the zone's cells that are on its boundary.

use std::collections::HashMap;

use super::elements::Reader;
use crate::formats::error::ReadError;
use crate::formats::mesh_builder::CellKind;
use crate::mesh::corners::{Face, faces_of};

/// The section of these faces.
const SECTION: &str = "boundary";

impl Reader<'_> {
    /// Whether the zone has faces.
    pub fn has_faces(&self) -> bool {
        self.faces.iter().any(|faces| !faces.is_empty())
    }

    /// Adds the sides of the zone's cells that no other cell of the zone has, as faces of a section
    /// of their own.
    ///
    /// # Errors
    /// [`ReadError`]
    pub fn add_boundary(&mut self) -> Result<(), ReadError> {
        let mut is_once: HashMap<[u32; 4], bool> = HashMap::new();
        for side in self.cells().flat_map(faces_of) {
            is_once.entry(side.key()).and_modify(|is_once| *is_once = false).or_insert(true);
        }
        let sides: Vec<Face> = self.cells().flat_map(faces_of).filter(|side| is_once[&side.key()]).collect();
        let after = self.ranges.last().map_or(1, |range| range.end() + 1);
        for (number, side) in (after..).zip(&sides) {
            let (place, shape) = match side.vertices().len() {
                3 => (0, CellKind::Triangle),
                _ => (1, CellKind::Quadrilateral),
            };
            self.faces[place].push((number, self.sections.len()));
            let mut vertices = side.vertices().iter().copied();
            self.mesh_builder.push(shape, 0, || Ok::<_, ReadError>(vertices.next().unwrap_or_default()))?;
        }
        self.sections.push(SECTION.to_owned());
        Ok(())
    }
}
