//! Displaced surfaces: surface meshes whose points are the displaced vertices of a family.
//!
//! | arrays at the points | a point belongs to the vertex |
//! |---|---|
//! | `original` | at its original position |
//! | `displacement` | where the point is, or where it was before its displacement |
//! | none | that has the same place in the order of the points or of the triangles; not for families with quadrilaterals |
//!
//! An order counts only if it takes the family's triangles to the surface's triangles. A regular
//! surface has several such orders, as half a turn of a grid is one; the way with the least motion
//! must then be the one in order. What is left open is an error: a wrong choice would move every
//! vertex to the place of another one.

use std::collections::HashSet;
use std::path::Path;

use glam::DVec3;

pub(super) use super::by_triangles::Family;
use super::by_triangles::by_triangles;
use super::displacement::{DisplacementError, DisplacementRow, DisplacementTable, RowPlace, match_rows};
use super::rounding::{at_rest, by_digits};
use crate::formats::Surface;
use crate::mesh::TetMesh;
use crate::text::header::{DISPLACEMENT, Header, ORIGINAL, Vector};
use crate::text::shorten;

/// Rounding of single precision, as a share of the largest coordinate, and the largest tolerance
/// that follows from it, over the tolerance.
const SINGLE: f64 = 4.0 * f32::EPSILON as f64;
const MOST_SINGLE: f64 = 250.0;

/// The displacement of each vertex of a family `[n family.vertices]`, in the mesh's unit.
///
/// - `path`: the surface's file, for errors
///
/// # Errors
/// The points are not the family's vertices, or are so in several ways.
pub(super) fn match_points(
    surface: &Surface,
    path: &Path,
    mesh: &TetMesh,
    family: &Family,
) -> Result<Vec<DisplacementRow>, DisplacementError> {
    let bad = |what: String| DisplacementError::BadSurface { path: path.to_path_buf(), what };
    let columns = Columns::of(surface);
    let original = columns.vectors(&ORIGINAL, surface).map_err(bad)?;
    let displacement = columns.vectors(&DISPLACEMENT, surface).map_err(bad)?;
    let largest = largest(surface);
    let tolerance = match surface.is_single {
        true => (SINGLE * largest).min(MOST_SINGLE * family.tolerance).max(family.tolerance),
        false => family.tolerance,
    };
    let by_position = |original: &[DVec3], displacement: Option<&[DVec3]>| {
        let rows = rows(surface, original, displacement);
        let path = path.to_path_buf();
        let table = DisplacementTable { path, rows, new_positions: Vec::new(), is_named: true, unread: None };
        match_rows(&table, &mesh.vertices, family.vertices, tolerance)
    };
    let moved = |row: DisplacementRow, vertex: u32| {
        let RowPlace::Point(point) = row.place else { return row };
        let displacement = displacement_to(surface.points[point], mesh.vertices[vertex as usize], surface.is_single);
        DisplacementRow { displacement, ..row }
    };
    let rows: Vec<DisplacementRow> = match (original, displacement) {
        (Some(original), None) => {
            let rows = by_position(&original, None)?;
            rows.into_iter().zip(family.vertices).map(|(row, &vertex)| moved(row, vertex)).collect()
        }
        (Some(original), Some(displacement)) => {
            let apart = |of: &dyn Fn(usize) -> DVec3| {
                (0..surface.points.len()).find(|&point| surface.points[point].distance(of(point)) > tolerance)
            };
            let off = apart(&|point| original[point] + displacement[point]);
            if let (Some(point), Some(_)) = (off, apart(&|point| original[point])) {
                let what = "the point is neither at its original position nor displaced by its displacement from there";
                return Err(bad(format!("point {point}: {what}")));
            }
            by_position(&original, Some(&displacement))?
        }
        (None, Some(displacement)) => {
            let before: Vec<DVec3> = surface.points.iter().zip(&displacement).map(|(at, by)| at - by).collect();
            let at_once = by_position(&surface.points, Some(&displacement));
            match (at_once, by_position(&before, Some(&displacement))) {
                (Ok(one), Ok(other)) => {
                    let place = |row: &DisplacementRow| row.place;
                    if !one.iter().map(place).eq(other.iter().map(place)) {
                        return Err(DisplacementError::Ambiguous {
                            path: path.to_path_buf(),
                            one: "its points are the vertices, and the array `displacement` moves them".into(),
                            other: "its points are moved already by the array `displacement`".into(),
                        });
                    }
                    one
                }
                (Ok(rows), Err(_)) | (Err(_), Ok(rows)) => rows,
                (Err(error), Err(_)) => return Err(error),
            }
        }
        // A surface may divide a quadrilateral along its other diagonal.
        (None, None) if family.has_quadrilaterals => {
            let what = "the family has quadrilaterals, expected an array of the points' original positions or displacements, \
                        as VTP and VTU files have them";
            return Err(bad(what.to_owned()));
        }
        (None, None) => {
            let points = by_triangles(surface, path, mesh, family)?;
            let row = |(point, &vertex): (usize, &u32)| {
                let position = mesh.vertices[vertex as usize];
                let row = DisplacementRow { place: RowPlace::Point(point), position, displacement: DVec3::ZERO };
                moved(row, vertex)
            };
            points.into_iter().zip(family.vertices).map(row).collect()
        }
    };
    // A displacement under an unknown name leaves the points where they are.
    let limit = at_rest(tolerance, rounding(surface));
    if rows.iter().all(|row| row.displacement.length() <= limit)
        && let Some(array) = columns.unknown_vector(surface)
    {
        return Err(bad(format!(
            "the points do not move, but {array} at the points may be a displacement; call it `displacement` (three arrays \
             `dx`, `dy`, `dz`), or leave it out"
        )));
    }
    Ok(rows)
}

/// The largest coordinate of a surface.
fn largest(surface: &Surface) -> f64 {
    surface.points.iter().map(|point| point.abs().max_element()).fold(0.0, f64::max)
}

/// The greatest rounding of the points of a surface, in its unit: that of single precision, or of
/// the digits in which all coordinates are written, if these are fewer than a double has.
pub(super) fn rounding(surface: &Surface) -> f64 {
    let single = SINGLE * largest(surface);
    if surface.is_single {
        return single;
    }
    single.min(by_digits(surface.points.iter().copied()))
}

/// The displacement from a vertex to its point. A coordinate that differs by no more than the
/// rounding of single precision does not move.
fn displacement_to(point: DVec3, vertex: DVec3, is_single: bool) -> DVec3 {
    let is_equal = |axis: usize| is_single && point[axis] as f32 == vertex[axis] as f32;
    DVec3::from_array([0, 1, 2].map(|axis| if is_equal(axis) { 0.0 } else { point[axis] - vertex[axis] }))
}

/// A row for each point. Of points that are equal in all, such as those of cells with points of
/// their own, only the first has a row.
fn rows(surface: &Surface, original: &[DVec3], displacement: Option<&[DVec3]>) -> Vec<DisplacementRow> {
    let mut seen = HashSet::new();
    let bits = |at: DVec3| at.to_array().map(|value| (value + 0.0).to_bits());
    let mut rows = Vec::with_capacity(original.len());
    for (point, &position) in original.iter().enumerate() {
        let displacement = displacement.map_or(DVec3::ZERO, |displacement| displacement[point]);
        if seen.insert([bits(surface.points[point]), bits(position), bits(displacement)]) {
            rows.push(DisplacementRow { place: RowPlace::Point(point), position, displacement });
        }
    }
    rows
}

/// The components of the fields of a surface as the columns of a table.
struct Columns {
    names: Vec<String>,
    /// Field and component of each column.
    of: Vec<(usize, usize)>,
}

impl Columns {
    fn of(surface: &Surface) -> Self {
        let mut columns = Self { names: Vec::new(), of: Vec::new() };
        for (index, field) in surface.fields.iter().enumerate() {
            for component in 0..field.n_components {
                let name = &field.name;
                columns.names.push(if field.n_components == 1 { name.clone() } else { format!("{name}:{component}") });
                columns.of.push((index, component));
            }
        }
        columns
    }

    /// The vectors at the points `[n_points]`, if there is a field of them. The error is the fault,
    /// in words.
    fn vectors(&self, vector: &Vector, surface: &Surface) -> Result<Option<Vec<DVec3>>, String> {
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        let header = Header::of(&names);
        if !vector.is_in(&header) {
            return Ok(None);
        }
        let columns = vector.columns(&header).map_err(|what| format!("arrays at the points: {what}"))?;
        header.check_units(&columns).map_err(|what| format!("arrays at the points: {what}"))?;
        let value = |point: usize, column: usize| {
            let (field, component) = self.of[column];
            let field = &surface.fields[field];
            field.values[point * field.n_components + component]
        };
        let all = (0..surface.points.len()).map(|point| {
            let vector = DVec3::from_array(columns.map(|column| value(point, column)));
            let name = || shorten(header.names[columns[0]]);
            if vector.is_finite() {
                Ok(vector)
            } else {
                Err(format!("point {point}: the array `{}` is not finite", name()))
            }
        });
        all.collect::<Result<_, _>>().map(Some)
    }

    /// A field of vectors in words, or three fields of their components. They are not all zero,
    /// their names are not known, and they may be lengths.
    fn unknown_vector(&self, surface: &Surface) -> Option<String> {
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        let field = |column: usize| &surface.fields[self.of[column].0];
        let is_other = |column: usize| {
            let (_, component) = self.of[column];
            let mut values = field(column).values.iter().skip(component).step_by(field(column).n_components);
            values.any(|&value| value != 0.0)
        };
        let mut vectors = Header::of(&names).unknown_vectors().into_iter();
        let columns = vectors.find(|columns| columns.iter().any(|&column| is_other(column)))?;
        let names = columns.map(|column| format!("`{}`", shorten(&field(column).name)));
        Some(if names[0] == names[1] {
            format!("the array {}", names[0])
        } else {
            format!("the arrays {}", names.join(", "))
        })
    }
}
