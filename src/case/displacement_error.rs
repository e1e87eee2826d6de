//! Errors of tables of prescribed displacements.

use std::path::PathBuf;

use glam::DVec3;
use thiserror::Error;

use crate::text::figures::place;
use crate::text::shown;

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
    /// No vertex of the family is where a row says.
    #[error(
        "{}:{line}: no vertex of the family at {}, the nearest is {distance:e} away, expected one within \
         {tolerance:e}",
        path.display(), place(*position)
    )]
    NoVertex {
        /// The file.
        path: PathBuf,
        /// The row's line, from 1.
        line: usize,
        /// The row's position.
        position: DVec3,
        /// Distance of the nearest vertex. Infinite if the family has no vertex.
        distance: f64,
        /// The largest distance at which a row belongs to a vertex.
        tolerance: f64,
    },
    /// A row of a table of new positions is for no vertex of the family.
    #[error(
        "{}:{line}: vertex {vertex} is none of the family, expected the vertices of the family, numbered as in the mesh from 0 \
         to {}", path.display(), n_vertices.saturating_sub(1)
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
    },
    /// Two rows are for one vertex.
    #[error(
        "{}:{line}: a second row for the vertex at {}, the first is on line {first_line}, expected one",
        path.display(), place(*position)
    )]
    Doubled {
        /// The file.
        path: PathBuf,
        /// The second row's line, from 1.
        line: usize,
        /// The first row's line.
        first_line: usize,
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
    /// Two files move a vertex that both families have to different places.
    #[error(
        "{}:{line} and {}:{other_line}: the vertex at {} belongs to the families of both files, and its \
         displacements differ by {difference:.3e}, expected the same in both",
        path.display(), other_path.display(), place(*position)
    )]
    Disagree {
        /// The first file.
        path: PathBuf,
        /// The vertex's row in it, from 1.
        line: usize,
        /// The second file.
        other_path: PathBuf,
        /// The vertex's row in it, from 1.
        other_line: usize,
        /// The vertex's position.
        position: DVec3,
        /// Distance between the two places.
        difference: f64,
    },
}
