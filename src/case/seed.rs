//! Seeds: the derivative of a number by the vertices of a moved mesh, read from a file.
//!
//! | file | columns or arrays |
//! |---|---|
//! | table | a header, the vertex from 0, and the derivative as `jx`, `jy`, `jz` |
//! | SU2's adjoint solution in ASCII | the same, as `PointID`, `Sensitivity_x`, `Sensitivity_y`, `Sensitivity_z` |
//! | VTU or VTP | an array of three components named `seed` or `sensitivity` at the points, which are the vertices in order |
//!
//! A table may have other columns. Rows stand in any order, and the derivative by a vertex without
//! a row is zero. Where a file has positions, they must be those of the moved mesh: a solution on
//! the mesh of another design has another derivative.

use std::path::{Path, PathBuf};

use glam::DVec3;
use thiserror::Error;

use crate::formats::{PointField, ReadError, Surface, is_surface, read_named, read_surface};
use crate::text::figures::place;
use crate::text::header::{self, Header, POSITION, Vector};
use crate::text::{Mark, comma_advice, decode, fields, parse_number, rows, shorten, shown};

/// The columns of a derivative.
const SEED: Vector = Vector {
    components: &[["jx", "jy", "jz"], ["dj dx", "dj dy", "dj dz"], ["djdx", "djdy", "djdz"]],
    names: &["sensitivity", "seed", "gradient"],
};

/// Names of the column with the vertex, in lower case, without `_`, `-` and blanks.
const VERTEX: &[&str] = &["vertex", "pointid", "index", "node", "globalindex", "vertexid", "vertexindex", "nodeindex"];

/// The first bytes of a solution that SU2 wrote in binary.
const SU2_BINARY: [u8; 4] = 535_532_u32.to_le_bytes();

/// Vertices written as doubles are below this number: from there on doubles leave integers out.
const MOST: f64 = 9e15;

/// Rounding of a position in a table, as a share of its largest coordinate: six digits.
const ROUNDED: f64 = 1e-5;
/// The same as a share of the mesh's size, for coordinates near zero.
const OF_SIZE: f64 = 1e-9;

/// An error of a seed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SeedError {
    /// The file cannot be read.
    #[error("{}: cannot read the seed: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// The file is no seed.
    #[error("{}{}: {what}", path.display(), line.map_or(String::new(), |line| format!(":{line}")), what = shown(what))]
    Bad {
        /// The file.
        path: PathBuf,
        /// The line, from 1, if one line is wrong.
        line: Option<usize>,
        /// The fault, and what was expected.
        what: String,
    },
    /// A VTU or VTP file is broken.
    #[error(transparent)]
    Points(#[from] ReadError),
    /// The positions in the file are not those of the moved mesh.
    #[error(
        "{}: vertex {vertex} is at {} in the seed and at {} in the moved mesh; {}", path.display(), place(*given),
        place(*moved), if *is_original {
            "the seed's positions are those of the undeformed mesh, expected the derivative on the moved one"
        } else {
            "was the seed computed for another design or another mesh?"
        }
    )]
    Elsewhere {
        /// The file.
        path: PathBuf,
        /// The vertex that is farthest off, from 0.
        vertex: usize,
        /// Its position in the file.
        given: DVec3,
        /// Its position in the moved mesh.
        moved: DVec3,
        /// Whether all positions in the file are those of the undeformed mesh.
        is_original: bool,
    },
}

/// The derivative of a number by the vertices of a moved mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Seed {
    path: PathBuf,
    /// The derivative by each vertex `[n_vertices]`, in the order of the mesh.
    pub by_vertices: Vec<DVec3>,
    /// The vertices that have a position in the file, with it.
    positions: Vec<(u32, DVec3)>,
    /// Rounding of the positions, as a share of their largest coordinate.
    rounding: f64,
}

impl Seed {
    /// Reads a seed.
    ///
    /// - `n_vertices`: of the mesh
    ///
    /// # Errors
    /// The file cannot be read, is no seed, or names vertices that the mesh does not have.
    pub fn read(path: &Path, n_vertices: usize) -> Result<Self, SeedError> {
        if is_surface(path) {
            return Self::of_points(&read_surface(path)?, path, n_vertices);
        }
        let bytes = read_named(path).map_err(|source| SeedError::Unreadable { path: path.to_path_buf(), source })?;
        if bytes.starts_with(&SU2_BINARY) {
            let what = "a solution of SU2 in binary, expected one in ASCII: OUTPUT_FILES= RESTART_ASCII".to_owned();
            return Err(SeedError::Bad { path: path.to_path_buf(), line: None, what });
        }
        Self::parse(&decode(&bytes), path, n_vertices)
    }

    /// Reads a table.
    ///
    /// # Errors
    /// [`SeedError::Bad`]
    fn parse(text: &str, path: &Path, n_vertices: usize) -> Result<Self, SeedError> {
        let mut seed = Self {
            path: path.to_path_buf(),
            by_vertices: vec![DVec3::ZERO; n_vertices],
            positions: Vec::new(),
            rounding: ROUNDED,
        };
        let bad = |line: Option<usize>, what: String| SeedError::Bad { path: path.to_path_buf(), line, what };
        let mut columns: Option<Columns> = None;
        // The line of each vertex, from 1; 0 for none.
        let mut line_of = vec![0; n_vertices];
        for row in rows(text, Mark::Hash) {
            let line = row.line + 1;
            // SU2 writes lines such as `AOA= 2` after the rows.
            if row.text.is_empty() || (columns.is_some() && row.text.contains('=')) {
                continue;
            }
            let fields = fields(row.text);
            let Some(columns) = &columns else {
                columns = Some(Columns::of(&fields).map_err(|what| bad(Some(line), what))?);
                continue;
            };
            let (vertex, derivative, position) = columns.row(&fields).map_err(|what| bad(Some(line), what))?;
            let Some(first) = line_of.get_mut(vertex) else {
                let what = format!("vertex {vertex}, but the mesh has {n_vertices}, counted from 0");
                return Err(bad(Some(line), what));
            };
            if *first > 0 {
                return Err(bad(Some(line), format!("a second row of vertex {vertex}, the first is on line {first}")));
            }
            *first = line;
            seed.by_vertices[vertex] = derivative;
            seed.positions.extend(position.map(|position| (vertex as u32, position)));
        }
        match columns {
            None => Err(bad(None, "an empty file, expected a header vertex,jx,jy,jz and rows".to_owned())),
            Some(_) if line_of.iter().all(|&line| line == 0) => {
                Err(bad(None, "no rows after the header, expected vertex,jx,jy,jz".to_owned()))
            }
            Some(_) => Ok(seed),
        }
    }

    /// Takes the array of a grid whose points are the vertices.
    ///
    /// # Errors
    /// [`SeedError::Bad`]: another number of points, or no array or several that may be the seed
    fn of_points(points: &Surface, path: &Path, n_vertices: usize) -> Result<Self, SeedError> {
        let bad = |what: String| SeedError::Bad { path: path.to_path_buf(), line: None, what };
        if points.points.len() != n_vertices {
            let found = points.points.len();
            return Err(bad(format!("{found} points, expected the {n_vertices} vertices of the moved mesh")));
        }
        let name_of = |field: &PointField| field.name.to_lowercase().replace(['_', '-'], " ");
        let is_seed = |field: &PointField| SEED.names.contains(&name_of(field).as_str());
        let vectors: Vec<&PointField> = points.fields.iter().filter(|field| field.n_components == 3).collect();
        let field = match vectors.iter().filter(|field| is_seed(field)).collect::<Vec<_>>()[..] {
            [field] => *field,
            // Another vector is no seed: a solution has velocities, and a moved mesh displacements.
            ref found => {
                let names: Vec<_> = vectors.iter().map(|field| format!("`{}`", field.name)).collect();
                let there = if names.is_empty() { "none".to_owned() } else { shorten(&names.join(", ")) };
                return Err(bad(format!(
                    "{} arrays of three components at the points are named `seed` or `sensitivity`, expected one; there is {there}",
                    found.len()
                )));
            }
        };
        let by_vertices: Vec<DVec3> =
            field.values.as_chunks::<3>().0.iter().map(|&value| DVec3::from_array(value)).collect();
        if let Some(point) = by_vertices.iter().position(|value| !value.is_finite()) {
            return Err(bad(format!("`{}` is not finite at point {point}", field.name)));
        }
        let positions = (0..).zip(points.points.iter().copied()).collect();
        let rounding = if points.is_single { 4.0 * f64::from(f32::EPSILON) } else { ROUNDED };
        Ok(Self { path: path.to_path_buf(), by_vertices, positions, rounding })
    }

    /// Checks that the positions in the file are those of the moved mesh.
    ///
    /// - `original`, `moved` `[n_vertices]`: in the mesh's unit
    ///
    /// # Errors
    /// [`SeedError::Elsewhere`]
    pub fn check_positions(&self, original: &[DVec3], moved: &[DVec3]) -> Result<(), SeedError> {
        let size = moved.iter().map(|at| at.distance(moved[0])).fold(0.0, f64::max);
        let off = |vertex: u32, at: DVec3, positions: &[DVec3]| {
            let expected = positions[vertex as usize];
            let allowed = self.rounding * expected.abs().max_element() + OF_SIZE * size;
            at.distance(expected) / allowed
        };
        let worst = self.positions.iter().max_by(|a, b| off(a.0, a.1, moved).total_cmp(&off(b.0, b.1, moved)));
        match worst {
            Some(&(vertex, given)) if off(vertex, given, moved) > 1.0 => Err(SeedError::Elsewhere {
                path: self.path.clone(),
                vertex: vertex as usize,
                given,
                moved: moved[vertex as usize],
                is_original: self.positions.iter().all(|&(vertex, at)| off(vertex, at, original) <= 1.0),
            }),
            _ => Ok(()),
        }
    }
}

/// The columns of a table.
struct Columns {
    n: usize,
    vertex: usize,
    derivative: [usize; 3],
    position: Option<[usize; 3]>,
}

impl Columns {
    /// Finds the columns in a header. The error is its fault in words.
    fn of(fields: &[&str]) -> Result<Self, String> {
        let expected = "expected a header with the columns vertex, jx, jy and jz";
        if !header::is_header(fields) {
            return Err(format!("numbers without a header, {expected}"));
        }
        let header = Header::of(fields);
        let plain = |name: &str| name.to_lowercase().replace(['_', '-', ' '], "");
        let mut vertices = (0..header.names.len()).filter(|&column| VERTEX.contains(&&*plain(header.names[column])));
        let Some(vertex) = vertices.next() else {
            return Err(format!("no column of vertices among '{}', {expected}", shorten(&header.names.join(", "))));
        };
        if let Some(other) = vertices.next() {
            let [one, other] = [vertex, other].map(|column| header.names[column]);
            return Err(format!("the columns '{one}' and '{other}' both are vertices"));
        }
        let derivative = SEED.columns(&header)?;
        let position = if POSITION.is_in(&header) { Some(POSITION.columns(&header)?) } else { None };
        Ok(Self { n: header.names.len(), vertex, derivative, position })
    }

    /// Reads a row: the vertex, the derivative and the position. The error is its fault in words.
    fn row(&self, fields: &[&str]) -> Result<(usize, DVec3, Option<DVec3>), String> {
        if fields.len() != self.n {
            return Err(format!("{} columns under a header of {}", fields.len(), self.n));
        }
        let number = |column: usize| match parse_number(fields[column]) {
            Some(value) if value.is_finite() => Ok(value),
            _ => {
                let field = fields[column];
                Err(format!("\"{}\" is not a finite number{}", shorten(field), comma_advice(field)))
            }
        };
        let vector = |[x, y, z]: [usize; 3]| Ok::<_, String>(DVec3::new(number(x)?, number(y)?, number(z)?));
        let field = fields[self.vertex];
        // Programs that keep a table in one array of doubles write 12.0 or 1.2e1.
        let whole = |value: f64| (value.fract() == 0.0 && (0.0..MOST).contains(&value)).then_some(value as usize);
        let vertex = field.parse().ok().or_else(|| parse_number(field).and_then(whole));
        let vertex = vertex.ok_or_else(|| format!("\"{}\" is no vertex, counted from 0", shorten(field)))?;
        Ok((vertex, vector(self.derivative)?, self.position.map(vector).transpose()?))
    }
}
