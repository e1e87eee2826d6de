//! The faces and cells where zones of one mesh meet.

use std::collections::{HashMap, HashSet};

use super::elements::Reader;
use super::tree::Node;
use crate::formats::error::ReadError;

/// The faces and cells of the zones read so far all of whose vertices belong to several zones.
pub(super) struct Interfaces<'a> {
    /// Whether a vertex belongs to several zones `[n_vertices]`.
    is_shared: &'a [bool],
    /// Number of zones that have a face without a condition, by its vertices in ascending order.
    faces: HashMap<Vec<u32>, usize>,
    /// Cells by their vertices in ascending order, and the zone.
    cells: HashMap<Vec<u32>, String>,
}

impl<'a> Interfaces<'a> {
    pub fn new(is_shared: &'a [bool]) -> Self {
        Self { is_shared, faces: HashMap::new(), cells: HashMap::new() }
    }

    fn key(&self, vertices: &[u32]) -> Option<Vec<u32>> {
        vertices.iter().all(|&vertex| self.is_shared[vertex as usize]).then(|| sorted(vertices))
    }

    /// Adds the zone that was read last.
    ///
    /// # Errors
    /// [`ReadError::Malformed`]: it has a cell of another zone
    pub fn add(&mut self, zone: &Node, reader: &Reader) -> Result<(), ReadError> {
        for cell in reader.cells() {
            let Some(key) = self.key(cell) else { continue };
            match self.cells.get(&key).filter(|other| *other != zone.path()) {
                Some(other) => {
                    let found = format!("one that {other} has too; leave one of them in the file");
                    return Err(zone.malformed("cells of its own", found));
                }
                None => drop(self.cells.insert(key, zone.path().to_owned())),
            }
        }
        let mut of_zone = HashSet::new();
        for (face, tag) in faces(reader, reader.n_before) {
            if reader.of_sections.last().is_some_and(|of_sections| of_sections.contains(&(tag as usize))) {
                of_zone.extend(self.key(face));
            }
        }
        for face in of_zone {
            *self.faces.entry(face).or_default() += 1;
        }
        Ok(())
    }

    /// Removes the faces without a condition that two zones have: they are inside the mesh. Says
    /// how many there were.
    pub fn remove(self, reader: &mut Reader) -> Option<String> {
        let is_between = |face: &[u32], tag: i32| {
            reader.of_sections.iter().any(|of_sections| of_sections.contains(&(tag as usize)))
                && self.key(face).is_some_and(|key| self.faces.get(&key).is_some_and(|&count| count > 1))
        };
        let stays: Vec<bool> = faces(reader, [0; 2]).map(|(face, tag)| !is_between(face, tag)).collect();
        let count = stays.iter().filter(|stays| !**stays).count();
        let builder = &mut reader.mesh_builder;
        let (of_triangles, of_quadrilaterals) = stays.split_at(builder.triangles.len());
        keep(&mut builder.triangles, of_triangles);
        keep(&mut builder.triangle_tags, of_triangles);
        keep(&mut builder.others.quadrilaterals, of_quadrilaterals);
        keep(&mut builder.quadrilateral_tags, of_quadrilaterals);
        (count > 0).then(|| format!("{count} faces without a boundary condition lie between zones and are passed over"))
    }
}

fn sorted(vertices: &[u32]) -> Vec<u32> {
    let mut vertices = vertices.to_vec();
    vertices.sort_unstable();
    vertices
}

/// Triangles and quadrilaterals with their tags, from these indices on.
fn faces<'a>(reader: &'a Reader, [triangles, quadrilaterals]: [usize; 2]) -> impl Iterator<Item = (&'a [u32], i32)> {
    let builder = &reader.mesh_builder;
    let of_triangles = builder.triangles.iter().map(|face| &face[..]).zip(builder.triangle_tags.iter().copied());
    let others = builder.others.quadrilaterals.iter().map(|face| &face[..]);
    let of_others = others.zip(builder.quadrilateral_tags.iter().copied());
    of_triangles.skip(triangles).chain(of_others.skip(quadrilaterals))
}

fn keep<T>(all: &mut Vec<T>, stays: &[bool]) {
    let mut stays = stays.iter();
    all.retain(|_| stays.next().is_some_and(|stays| *stays));
}
