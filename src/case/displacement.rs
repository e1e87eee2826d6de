//! Reads tables of prescribed displacements, with rows `x,y,z,dx,dy,dz` for the vertices of one
//! family, or with rows of an index and a new position.
//!
//! Rows are matched to vertices by original position, so rows may stand in any order. Every vertex
//! of the family must have one row, and every row must have a vertex. A vertex without a row is an
//! error and does not stay where it is in silence.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::DVec3;

pub use super::displacement_error::{DisplacementError, Misfit, RowPlace};
use super::new_positions::{self, NewPosition};
use super::rounding::{NEAREST, at_rest, by_digits};
use crate::formats::read_named;
use crate::mover::prescribed::differ;
use crate::text::header::{self, Header};
use crate::text::{Mark, Row, comma_advice, decode, fields, parse_number, rows, shorten};

/// The extensions of files of displacements: tables, and displaced surfaces, which may be gzipped.
pub const EXTENSIONS: &[&str] =
    &["csv", "dat", "txt", "tsv", "vtp", "vtu", "stl", "msh", "vtp.gz", "vtu.gz", "stl.gz", "msh.gz"];

/// The rows of one file.
#[derive(Clone, Debug, PartialEq)]
pub struct DisplacementTable {
    /// Path of the file.
    pub path: PathBuf,
    /// The rows in the order of the file.
    pub rows: Vec<DisplacementRow>,
    /// The rows of a table of new positions, which has no other rows.
    pub new_positions: Vec<NewPosition>,
    /// Whether a header names the columns.
    pub is_named: bool,
    /// The names of columns beside new positions that were not read and may be displacements.
    pub unread: Option<String>,
}

/// One row: the original position and the displacement of a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplacementRow {
    /// Place in the file.
    pub place: RowPlace,
    /// Original position, in the mesh's unit.
    pub position: DVec3,
    /// Displacement, in the mesh's unit.
    pub displacement: DVec3,
}

/// Reads a displacement file; see [`parse`].
///
/// # Errors
/// - [`DisplacementError::Unreadable`]: the file cannot be read
/// - others as [`parse`]
pub fn read(path: &Path) -> Result<DisplacementTable, DisplacementError> {
    let bytes =
        read_named(path).map_err(|source| DisplacementError::Unreadable { path: path.to_path_buf(), source })?;
    parse(&decode(&bytes), path)
}

/// Reads the text of a displacement file.
///
/// - `path`: the file's path, for errors
///
/// Commas, semicolons or white space separate the six numbers of a row. A header before the rows
/// may name the columns, in any order and among other columns. ParaView's names (`Points:0`,
/// `Displacement:0`) are understood too. A comment begins with `#`, `!` or `%`. A comment before
/// the first row may hold the header.
///
/// Rows of four numbers without a header are the index of a vertex, from 0, and its new position,
/// as in SU2's `surface_positions.dat`. A header may name these columns instead, in any order and
/// among other columns.
///
/// # Errors
/// - [`DisplacementError::Empty`]: the text has no row
/// - [`DisplacementError::BadLine`]: a header lacks columns, or a line is not six finite numbers
pub fn parse(text: &str, path: &Path) -> Result<DisplacementTable, DisplacementError> {
    let (mut table, mut new_positions) = (Vec::new(), Vec::new());
    let mut columns: Option<Columns> = None;
    let mut of_positions: Option<new_positions::Columns> = None;
    let (mut is_empty, mut is_named, mut unread) = (true, false, None);
    for Row { line, text: row, comment } in rows(text, Mark::Any) {
        let line = line + 1;
        let bad = |what: String| DisplacementError::BadLine { path: path.to_path_buf(), line, what };
        if row.is_empty() {
            let names = fields(comment);
            if is_empty && let Ok(of_comment) = Columns::of(&names) {
                (columns, of_positions) = (Some(of_comment), None);
            } else if is_empty && let Some(Ok(of_comment)) = new_positions::Columns::of(&names) {
                (columns, of_positions) = (None, Some(of_comment));
            }
            continue;
        }
        let fields = fields(row);
        let is_header = is_empty && header::is_header(&fields);
        of_positions = of_positions.filter(|of_comment| !is_empty || of_comment.of_comment_fit(&fields));
        let has_no_header = is_empty && columns.is_none() && of_positions.is_none() && !is_header;
        if is_empty && fields.len() == Columns::DEFAULT.n {
            // Other words in the comment count as columns too. If the comment names the columns in
            // the default order, the row is read as without a header.
            columns = columns.filter(|of_comment| of_comment.n == fields.len() || !of_comment.of.is_sorted());
        }
        if is_empty {
            is_named = is_header || columns.is_some() || of_positions.is_some();
        }
        is_empty = false;
        if is_header {
            of_positions = new_positions::Columns::of(&fields).transpose().map_err(bad)?;
            columns = if of_positions.is_none() { Some(Columns::of(&fields).map_err(bad)?) } else { None };
            continue;
        }
        if has_no_header && new_positions::Columns::fit(&fields) {
            of_positions = Some(new_positions::Columns::DEFAULT);
        }
        if let Some(of_positions) = &of_positions {
            new_positions.push(new_positions::row(line, &fields, of_positions).map_err(bad)?);
            unread = unread.or_else(|| of_positions.unread(&fields));
            continue;
        }
        let Columns { n, of } = columns.as_ref().unwrap_or(&Columns::DEFAULT);
        if fields.len() != *n {
            let noun = if fields.len() == 1 { "column" } else { "columns" };
            let header = if *n != 6 { format!(" under a header of {n}") } else { String::new() };
            return Err(bad(format!("{} {noun}{header}", fields.len())));
        }
        let mut numbers = [0.0f64; 6];
        for (number, &column) in numbers.iter_mut().zip(of) {
            let field = fields[column];
            *number = parse_number(field)
                .ok_or_else(|| bad(format!("\"{}\" is not a number{}", shorten(field), comma_advice(field))))?;
            if !number.is_finite() {
                return Err(bad(format!("\"{field}\" is not finite")));
            }
        }
        let [x, y, z, dx, dy, dz] = numbers;
        let (position, displacement) = (DVec3::new(x, y, z), DVec3::new(dx, dy, dz));
        table.push(DisplacementRow { place: RowPlace::Line(line), position, displacement });
    }
    if table.is_empty() && new_positions.is_empty() {
        return Err(DisplacementError::Empty { path: path.to_path_buf() });
    }
    Ok(DisplacementTable { path: path.to_path_buf(), rows: table, new_positions, is_named, unread })
}

/// The number of columns of a table, and the columns with x, y, z, dx, dy and dz.
struct Columns {
    n: usize,
    of: [usize; 6],
}

impl Columns {
    const DEFAULT: Self = Self { n: 6, of: [0, 1, 2, 3, 4, 5] };

    /// The columns that a header names. The error is the fault of the header.
    fn of(fields: &[&str]) -> Result<Self, String> {
        let header = Header::of(fields);
        let [x, y, z] = header::POSITION.columns(&header)?;
        let [dx, dy, dz] = header::DISPLACEMENT.columns(&header)?;
        let of = [x, y, z, dx, dy, dz];
        header.check_units(&of)?;
        Ok(Self { n: header.names.len(), of })
    }
}

/// The displacement of each vertex of a family `[n family_vertices]`, in the mesh's unit; see
/// [`match_rows`].
///
/// # Errors
/// As [`match_rows`].
pub fn match_displacements(
    table: &DisplacementTable,
    vertices: &[DVec3],
    family_vertices: &[u32],
    tolerance: f64,
) -> Result<Vec<DVec3>, DisplacementError> {
    let rows = match_rows(table, vertices, family_vertices, tolerance)?;
    Ok(rows.into_iter().map(|row| row.displacement).collect())
}

/// The row of each vertex of a family `[n family_vertices]`.
///
/// - `vertices` `[n_vertices]`: original positions of the whole mesh, in the mesh's unit
/// - `family_vertices`: the family's vertices, each once
/// - `tolerance`: largest distance between a row and its vertex, in the mesh's unit, `>= 0`; a row
///   belongs to the nearest vertex
///
/// # Errors
/// - [`DisplacementError::NoVertex`]: a row has no vertex
/// - [`DisplacementError::Doubled`]: a vertex has two rows
/// - [`DisplacementError::Missing`]: a vertex has no row
/// - [`DisplacementError::NotOfFamily`]: a row of new positions is for no vertex of the family
/// - [`DisplacementError::Unread`]: no new position is another one, and other columns may be the
///   displacements
pub fn match_rows(
    table: &DisplacementTable,
    vertices: &[DVec3],
    family_vertices: &[u32],
    tolerance: f64,
) -> Result<Vec<DisplacementRow>, DisplacementError> {
    if !table.new_positions.is_empty() {
        let matched = new_positions::match_indices(&table.path, &table.new_positions, vertices, family_vertices)?;
        let row = |NewPosition { line, vertex, position: new }| {
            let position = vertices[vertex as usize];
            DisplacementRow { place: RowPlace::Line(line), position, displacement: new - position }
        };
        let rows: Vec<_> = matched.into_iter().map(row).collect();
        let rounding = || by_digits(table.new_positions.iter().map(|row| row.position));
        let is_at_rest = |limit: f64| rows.iter().all(|row| row.displacement.length() <= limit);
        return match &table.unread {
            Some(names) if is_at_rest(at_rest(tolerance, rounding())) => {
                Err(DisplacementError::Unread { path: table.path.clone(), names: names.clone() })
            }
            _ => Ok(rows),
        };
    }
    let grid = Grid::new(vertices, family_vertices, tolerance);
    let mut row_of: Vec<Option<usize>> = vec![None; family_vertices.len()];
    for (index, row) in table.rows.iter().enumerate() {
        let Some(local) = grid.nearest(row.position) else {
            let distances = family_vertices.iter().map(|&vertex| vertices[vertex as usize].distance(row.position));
            return Err(DisplacementError::NoVertex {
                path: table.path.clone(),
                row: row.place,
                position: row.position,
                distance: distances.min_by(f64::total_cmp).unwrap_or(f64::INFINITY),
                tolerance,
                misfit: misfit(table, vertices, family_vertices, tolerance),
            });
        };
        if let Some(first) = row_of[local].replace(index) {
            return Err(DisplacementError::Doubled {
                path: table.path.clone(),
                row: row.place,
                first: table.rows[first].place,
                position: row.position,
            });
        }
    }
    if let Some(first) = row_of.iter().position(Option::is_none) {
        let vertex = family_vertices[first];
        return Err(DisplacementError::Missing {
            path: table.path.clone(),
            missing: row_of.iter().filter(|row| row.is_none()).count(),
            total: family_vertices.len(),
            vertex,
            position: vertices[vertex as usize],
        });
    }
    Ok(row_of.into_iter().flatten().map(|row| table.rows[row]).collect())
}

/// Factors by which programs' units of length differ: m, dm, cm, mm, um, inch, foot.
const UNITS: [f64; 14] = [1e3, 1e-3, 1e2, 1e-2, 1e1, 1e-1, 1e6, 1e-6, 0.0254, 25.4, 2.54, 0.3048, 304.8, 12.0];

/// What all rows have in common that do not fit a family, if there is such a thing.
fn misfit(table: &DisplacementTable, vertices: &[DVec3], family_vertices: &[u32], tolerance: f64) -> Option<Misfit> {
    let near = Grid::new(vertices, family_vertices, NEAREST * tolerance);
    // The largest distance of a row, if every row has a vertex of its own.
    let farthest = |factor: f64| {
        let mut taken = vec![false; family_vertices.len()];
        table.rows.iter().try_fold(0.0, |farthest: f64, row| {
            let local = near.nearest(factor * row.position)?;
            let distance = vertices[family_vertices[local] as usize].distance(factor * row.position);
            (!std::mem::replace(&mut taken[local], true)).then_some(farthest.max(distance))
        })
    };
    if let Some(distance) = farthest(1.0) {
        return Some(Misfit::Rounded(distance));
    }
    // So few rows, or some of a family's, may fit by chance.
    if table.rows.len() < 3 || table.rows.len() != family_vertices.len() {
        return None;
    }
    let factors = UNITS.into_iter().chain(UNITS[8..].iter().map(|unit| 1.0 / unit));
    let fits = |factor: &f64| farthest(*factor).is_some();
    factors.into_iter().find(fits).map(Misfit::Unit)
}

/// The vertices of one family with their rows.
#[derive(Clone, Debug)]
pub struct Matched {
    /// The file.
    pub path: PathBuf,
    /// The family's vertices `[n]`.
    pub vertices: Vec<u32>,
    /// Their rows `[n]`.
    pub rows: Vec<DisplacementRow>,
    /// Rounding of the displacements by the digits of the file, in the mesh's unit.
    pub rounding: f64,
}

/// Gives vertices of several families the displacement of the file with the least rounding, where
/// the displacements differ by no more than the rounding of both files. Other differences stay.
pub fn settle_shared(families: &mut [Matched]) {
    let mut best: HashMap<u32, (DVec3, f64)> = HashMap::new();
    for Matched { vertices, rows, rounding, .. } in families.iter() {
        for (&vertex, row) in vertices.iter().zip(rows) {
            let exact = best.entry(vertex).or_insert((row.displacement, *rounding));
            if *rounding < exact.1 {
                *exact = (row.displacement, *rounding);
            }
        }
    }
    for Matched { vertices, rows, rounding, .. } in families.iter_mut() {
        for (&vertex, row) in vertices.iter().zip(rows) {
            let Some(&(displacement, least)) = best.get(&vertex) else { continue };
            if row.displacement.distance(displacement) <= *rounding + least {
                row.displacement = displacement;
            }
        }
    }
}

/// Checks that families with common vertices give these vertices the same displacements.
///
/// - `positions` `[n_vertices]`: original positions of the whole mesh, in the mesh's unit
///
/// # Errors
/// [`DisplacementError::Disagree`]: the first two rows of one vertex that [`differ`].
pub fn check_shared(families: &[Matched], positions: &[DVec3]) -> Result<(), DisplacementError> {
    let mut first_of: HashMap<u32, (&Path, DisplacementRow)> = HashMap::new();
    for Matched { path, vertices, rows, .. } in families {
        for (&vertex, &row) in vertices.iter().zip(rows) {
            let (first_path, first) = *first_of.entry(vertex).or_insert((path, row));
            let position = positions[vertex as usize];
            if differ(first.displacement, row.displacement, position) {
                return Err(DisplacementError::Disagree {
                    path: first_path.to_path_buf(),
                    row: first.place,
                    other_path: path.clone(),
                    other_row: row.place,
                    position,
                    difference: first.displacement.distance(row.displacement),
                });
            }
        }
    }
    Ok(())
}

/// The family's vertices in a grid of cubes. The edge of a cube is at least the tolerance, so a
/// row's vertex is in the row's cube or in a cube beside it.
struct Grid<'a> {
    vertices: &'a [DVec3],
    family_vertices: &'a [u32],
    tolerance: f64,
    cell: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl<'a> Grid<'a> {
    fn new(vertices: &'a [DVec3], family_vertices: &'a [u32], tolerance: f64) -> Self {
        let largest = family_vertices.iter().map(|&vertex| vertices[vertex as usize].abs().max_element());
        let largest = largest.fold(0.0, f64::max);
        // With an edge below 1e-12 of the coordinates the index of a cube would not be exact.
        let cell = tolerance.max(1e-12 * largest).max(f64::MIN_POSITIVE);
        let mut grid = Self { vertices, family_vertices, tolerance, cell, cells: HashMap::new() };
        for (local, &vertex) in family_vertices.iter().enumerate() {
            let key = grid.key(vertices[vertex as usize]);
            grid.cells.entry(key).or_default().push(local as u32);
        }
        grid
    }

    fn key(&self, position: DVec3) -> [i64; 3] {
        position.to_array().map(|coordinate| (coordinate / self.cell).floor() as i64)
    }

    /// Index in `family_vertices` of the nearest vertex within the tolerance; the first of equally
    /// near ones.
    fn nearest(&self, position: DVec3) -> Option<usize> {
        let [x, y, z] = self.key(position);
        let around = |centre: i64| (-1..=1).map(move |step| centre.saturating_add(step));
        around(x)
            .flat_map(|x| around(y).flat_map(move |y| around(z).map(move |z| [x, y, z])))
            .filter_map(|key| self.cells.get(&key))
            .flatten()
            .map(|&local| {
                let vertex = self.family_vertices[local as usize];
                (self.vertices[vertex as usize].distance(position), local as usize)
            })
            .filter(|&(distance, _)| distance <= self.tolerance)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map(|(_, local)| local)
    }
}
