//! [`Surface`]: a surface mesh, triangles without cells.

use std::collections::BTreeMap;

use glam::DVec3;

use super::mesh_builder::MeshBuilder;

/// Triangles, and values at their points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Coordinates `[n_points]`, in the unit of the file.
    pub points: Vec<DVec3>,
    /// Points of the triangles, each below `n_points`.
    pub triangles: Vec<[u32; 3]>,
    /// Values at the points.
    pub fields: Vec<PointField>,
    /// Whether the file holds coordinates in single precision.
    pub is_single: bool,
    /// Cells and faces that are no triangles, with their numbers.
    pub(super) others: BTreeMap<&'static str, usize>,
}

/// A field of numbers or vectors.
#[derive(Clone, Debug, PartialEq)]
pub struct PointField {
    /// Name in the file.
    pub name: String,
    /// Numbers at each point: 1 or 3.
    pub n_components: usize,
    /// Values `[n_points n_components]`, which may be not finite.
    pub values: Vec<f64>,
}

impl Surface {
    /// Cells and faces that are no triangles, in words: `3 tets`. Empty if there are none.
    pub fn others(&self) -> String {
        let words = self.others.iter().map(|(name, count)| format!("{count} {name}"));
        words.collect::<Vec<_>>().join(", ")
    }

    /// Counts cells and faces that are no triangles.
    pub(super) fn count(&mut self, name: &'static str, count: usize) {
        if count > 0 {
            *self.others.entry(name).or_default() += count;
        }
    }

    /// Takes the triangles of a file, and counts its other cells and faces. Points and lines do not
    /// count.
    pub(super) fn take(&mut self, mesh_builder: MeshBuilder) {
        self.count("tets", mesh_builder.tets.len());
        for (name, count) in mesh_builder.others.counts() {
            self.count(name, count);
        }
        for (name, count) in mesh_builder.refused() {
            self.count(name, count);
        }
        self.triangles = mesh_builder.triangles;
    }
}
