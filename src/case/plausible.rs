//! Whether the displacements of a family can be meant: tables in another unit, and tables of new
//! positions in the place of displacements.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;

use super::displacement_error::DisplacementError;

/// Largest factor between the sizes of a family before and after. Designs change sizes by less, and
/// units of length differ by more.
pub(super) const SIZE: f64 = 2.5;

/// Least strain of a family by the reading that was taken, if another reading is to be considered.
const STRAINED: f64 = 0.25;
/// The other reading is the better one if its strain is less than this share.
const BETTER: f64 = 0.5;
/// Largest logarithm of a ratio of lengths that counts. An edge may shrink to a point.
const MOST: f64 = 3.0;

/// The displaced vertices of a family, in the mesh's unit.
pub(super) struct Displaced<'a> {
    /// The name of the family.
    pub name: &'a str,
    /// Its vertices `[n]`, each once.
    pub vertices: &'a [u32],
    /// Their original positions `[n]`.
    pub original: &'a [DVec3],
    /// Their displacements `[n]`.
    pub displacement: &'a [DVec3],
    /// Its triangles, between vertices of the mesh.
    pub triangles: &'a [[u32; 3]],
}

impl Displaced<'_> {
    /// The edges of the triangles, as indices of the family's vertices.
    fn edges(&self) -> Vec<[usize; 2]> {
        let place: HashMap<u32, usize> = self.vertices.iter().copied().zip(0..).collect();
        let corners = self.triangles.iter().filter_map(|corners| {
            let [a, b, c] = corners.map(|corner| place.get(&corner).copied());
            Some([a?, b?, c?])
        });
        corners.flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]).collect()
    }

    /// Checks that the family keeps about its size.
    ///
    /// - `path`: the file, for errors
    ///
    /// # Errors
    /// [`DisplacementError::Size`]
    pub fn check_size(&self, path: &Path) -> Result<(), DisplacementError> {
        let edges = self.edges();
        let around = |at: &dyn Fn(usize) -> DVec3| -> f64 { edges.iter().map(|&[a, b]| at(a).distance(at(b))).sum() };
        let before = around(&|i| self.original[i]);
        let times = around(&|i| self.original[i] + self.displacement[i]) / before;
        if !times.is_finite() || (SIZE.recip()..=SIZE).contains(&times) {
            return Ok(());
        }
        Err(DisplacementError::Size { path: path.to_path_buf(), family: self.name.to_owned(), times })
    }

    /// Checks that three columns without names are what they were taken for: displacements, or new
    /// positions. Edges tell: a motion keeps their lengths about, and the other reading does not.
    ///
    /// - `path`: the file, for errors
    /// - `as_positions`: whether the columns were taken for new positions
    ///
    /// # Errors
    /// [`DisplacementError::TwoReadings`]
    pub fn check_reading(&self, path: &Path, as_positions: bool) -> Result<(), DisplacementError> {
        let edges = self.edges();
        let strain = |at: &dyn Fn(usize) -> DVec3| {
            let of_edge = |&[a, b]: &[usize; 2]| {
                let ratio = at(a).distance(at(b)) / self.original[a].distance(self.original[b]);
                // The ratio of an edge without length is no number.
                if ratio.is_nan() { 0.0 } else { ratio.ln().clamp(-MOST, MOST).powi(2) }
            };
            (edges.iter().map(of_edge).sum::<f64>() / edges.len().max(1) as f64).sqrt()
        };
        let moved = |i: usize| self.original[i] + self.displacement[i];
        let taken = strain(&moved);
        let other = match as_positions {
            true => strain(&|i| self.original[i] + moved(i)),
            false => strain(&|i| self.displacement[i]),
        };
        if taken > STRAINED && other < BETTER * taken {
            let path = path.to_path_buf();
            let [taken, other] = [taken, other].map(|strain| strain.exp_m1());
            return Err(DisplacementError::TwoReadings { path, as_positions, taken, other });
        }
        Ok(())
    }
}
