//! Errors of tables of prescribed displacements.

use std::fmt;
use std::path::PathBuf;

use glam::DVec3;
use thiserror::Error;

use crate::formats::ReadError;
use crate::text::figures::place;
use crate::text::shown;

/// Where a row stands in its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowPlace {
    /// The line of a table, from 1.
    Line(usize),
    /// The point of a surface, from 0.
    Point(usize),
}

impl RowPlace {
    /// The place in words, such as `on line 3`.
    fn words(self) -> String {
        match self {
            Self::Line(line) => format!("on line {line}"),
            Self::Point(point) => format!("point {point}"),
        }
    }
}

/// The place as it follows the path: `d.csv:3`, `d.vtp: point 3`.
impl fmt::Display for RowPlace {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, ":{line}"),
            Self::Point(point) => write!(f, ": point {point}"),
        }
    }
}

/// What all rows of a table have in common that do not fit their family.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Misfit {
    /// With all coordinates times this factor every row fits.
    Unit(f64),
    /// Every row is nearest to a vertex of its own, at most this far away, but too far.
    Rounded(f64),
}

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Unit(factor) => {
                write!(
                    f,
                    "; with all coordinates times {factor} every row fits: is the file in another unit than the mesh?"
                )
            }
            Self::Rounded(distance) => write!(
                f,
                "; every row is within {distance:.1e} of a vertex of its own: are the positions rounded? Give more digits, or in a \
                 table a column `index` with the vertices' numbers, and their new positions"
            ),
        }
    }
}

/// An error of prescribed displacements. Lengths are in the mesh's unit.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DisplacementError {
    /// The file cannot be read.
    #[error("{}: cannot read the displacements: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// A line is not six finite numbers.
    #[error("{}:{line}: {what}, expected six numbers x,y,z,dx,dy,dz", path.display(), what = shown(what))]
    BadLine {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The fault of the line.
        what: String,
    },
    /// The file holds no row.
    #[error("{}: no displacements, expected rows x,y,z,dx,dy,dz", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file of a displaced surface is broken.
    #[error(transparent)]
    Surface(#[from] ReadError),
    /// The points of a displaced surface are not the vertices of the family.
    #[error("{}: {what}", path.display(), what = shown(what))]
    BadSurface {
        /// The file.
        path: PathBuf,
        /// What does not fit, and a remedy.
        what: String,
    },
    /// A displaced surface has two readings.
    #[error(
        "{}: the surface fits the family in two ways: {one}, or {other}; say which with the original positions, \
         in an array `original` of three components at the points", path.display(), one = shown(one), other = shown(other)
    )]
    Ambiguous {
        /// The file.
        path: PathBuf,
        /// The first reading.
        one: String,
        /// The second reading.
        other: String,
    },
    /// No vertex of the family is where a row says.
    #[error(
        "{}{row}: no vertex of the family at {}, the nearest is {distance:e} away, expected one within \
         {tolerance:e}{}",
        path.display(), place(*position), misfit.map(|misfit| misfit.to_string()).unwrap_or_default()
    )]
    NoVertex {
        /// The file.
        path: PathBuf,
        /// The row.
        row: RowPlace,
        /// The row's position.
        position: DVec3,
        /// Distance of the nearest vertex. Infinite if the family has no vertex.
        distance: f64,
        /// The largest distance at which a row belongs to a vertex.
        tolerance: f64,
        /// What all rows have in common that do not fit.
        misfit: Option<Misfit>,
    },
    /// A row of a table of new positions is for no vertex of the family.
    #[error(
        "{}:{line}: vertex {vertex} is none of the family, expected the vertices of the family, numbered as in the mesh from 0 \
         to {}{}",
        path.display(),
        n_vertices.saturating_sub(1),
        if *from_one { "; every number less one is a vertex of the family: does the file number them from 1?" } else { "" }
    )]
    NotOfFamily {
        /// The file.
        path: PathBuf,
        /// The row's line, from 1.
        line: usize,
        /// The vertex, from 0.
        vertex: u32,
        /// Number of vertices of the mesh.
        n_vertices: usize,
        /// Whether every row would fit with its number less one.
        from_one: bool,
    },
    /// No vertex moves by a table of new positions, in which other columns may be displacements.
    #[error(
        "{}: no vertex moves: x, y and z beside an index are new positions, and here they are the old ones, but the columns \
         {} may be displacements or new positions; call displacements dx,dy,dz (Displacement:0, disp_x and delta_x are \
         understood too) or the new positions x,y,z, or leave these columns out",
        path.display(), shown(names)
    )]
    Unread {
        /// The file.
        path: PathBuf,
        /// The names of the columns.
        names: String,
    },
    /// Two rows are for one vertex.
    #[error(
        "{}{row}: a second row for the vertex at {}, the first is {}, expected one",
        path.display(), place(*position), first.words()
    )]
    Doubled {
        /// The file.
        path: PathBuf,
        /// The second row.
        row: RowPlace,
        /// The first row.
        first: RowPlace,
        /// The second row's position.
        position: DVec3,
    },
    /// Vertices of the family have no row.
    #[error(
        "{}: {missing} of the family's {total} vertices have no row, the first is vertex {vertex} at {}",
        path.display(), place(*position)
    )]
    Missing {
        /// The file.
        path: PathBuf,
        /// Number of vertices without a row.
        missing: usize,
        /// Number of the family's vertices.
        total: usize,
        /// The first vertex without a row, counted from 0.
        vertex: u32,
        /// Original position of this vertex.
        position: DVec3,
    },
    /// The displaced family is much larger or smaller than the family.
    #[error(
        "{}: the displaced family `{family}` is {times:.3e} times as large as before, expected 0.4 to 2.5 times: displacements \
         in another unit of length, or new positions in place of displacements?", path.display()
    )]
    Size {
        /// The file.
        path: PathBuf,
        /// The family.
        family: String,
        /// Its size after over its size before: the lengths of all edges.
        times: f64,
    },
    /// Columns without names are rather new positions than displacements, or the other way round.
    #[error("{}: {}", path.display(), readings(*as_positions, [*taken, *other]))]
    TwoReadings {
        /// The file.
        path: PathBuf,
        /// Whether the columns would be taken for new positions.
        as_positions: bool,
        /// Mean share by which lengths on the surface change then.
        taken: f64,
        /// The same for the other reading.
        other: f64,
    },
    /// Two files move a vertex that both families have to different places.
    #[error(
        "{}{row} and {}{other_row}: the vertex at {} belongs to the families of both files, and its \
         displacements differ by {difference:.3e}, expected the same in both",
        path.display(), other_path.display(), place(*position)
    )]
    Disagree {
        /// The first file.
        path: PathBuf,
        /// The vertex's row in it.
        row: RowPlace,
        /// The second file.
        other_path: PathBuf,
        /// The vertex's row in it.
        other_row: RowPlace,
        /// The vertex's position.
        position: DVec3,
        /// Distance between the two places.
        difference: f64,
    },
}

/// The two readings of columns without names, in words.
fn readings(as_positions: bool, [taken, other]: [f64; 2]) -> String {
    let [taken, other] = [taken, other].map(|share| format!("{:.0} %", 100.0 * share));
    match as_positions {
        false => format!(
            "the last three columns have no names; as displacements they change lengths on the surface by {taken} in the mean, as \
             new positions by {other}: a header x,y,z,dx,dy,dz says that they are displacements, and new positions stand \
             in rows index,x,y,z"
        ),
        true => format!(
            "the last three columns have no names; as new positions they change lengths on the surface by {taken} in the mean, as \
             displacements by {other}: a header index,x,y,z says that they are new positions, and displacements stand in \
             rows x,y,z,dx,dy,dz"
        ),
    }
}
