//! The Python package's extension module.
//!
//! Python sees classes with arrays; everything else is the library's. A mesh is read by
//! `Case::load` or by its path alone, and moved by a [`idmesh::mover::Mover`], as the command line
//! does.
//!
//! | file | holds |
//! |---|---|
//! | `arrays` | arrays in and out |
//! | `errors` | the exceptions, one for each exit code |
//! | `work` | work without the interpreter's lock, and what must not happen in a forked process |
//! | `options`, `roles` | keywords and roles of families |
//! | `mesh`, `mover`, `result` | the classes |

mod arrays;
mod errors;
mod matching;
mod mesh;
mod mover;
mod options;
mod result;
mod roles;
mod work;

use std::path::PathBuf;

use idmesh::session::SessionError;
use idmesh::{backend, case};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::rows;
use crate::errors::{input, of_session};
use crate::work::detached;

/// Reads profiles from a file.
///
/// CSV, Tecplot, or slices of a surface. The points of each profile are an array (k, 3) in the
/// mesh's unit, by the profile's number.
///
/// Raises InputError if the file cannot be read or its profiles are wrong.
#[pyfunction]
fn read_profiles(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let profiles = detached(py, || case::read_profiles(path).map_err(SessionError::from))?;
    let profiles = profiles.map_err(|error| of_session(py, error))?;
    let found = PyDict::new(py);
    for profile in profiles {
        found.set_item(profile.number, rows(py, profile.points))?;
    }
    Ok(found)
}

/// The names of the GPUs that idmesh could use.
#[pyfunction]
fn adapters(py: Python<'_>) -> PyResult<Vec<String>> {
    Ok(detached(py, backend::adapters)?.into_iter().map(|adapter| adapter.name).collect())
}

/// For each point (n, 3) the index of the vertex (m, 3) within `tolerance`, -1 if there is none.
///
/// Of several vertices within the tolerance it is the nearest.
#[pyfunction]
fn match_points<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    vertices: &Bound<'py, PyAny>,
    tolerance: f64,
) -> PyResult<Bound<'py, numpy::PyArray1<i64>>> {
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(input(py, &format!("`tolerance` is {tolerance}, expected a length above 0")));
    }
    let points = arrays::vectors(points, "`points`", None)?;
    let vertices = arrays::vectors(vertices, "`vertices`", None)?;
    let found = detached(py, || matching::nearest(&points, &vertices, tolerance))?;
    Ok(numpy::IntoPyArray::into_pyarray(found, py))
}

/// The compiled part of idmesh. Import `idmesh` instead.
#[pymodule]
fn _idmesh(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<mesh::Mesh>()?;
    module.add_class::<mover::Mover>()?;
    module.add_class::<result::MoveResult>()?;
    module.add_function(wrap_pyfunction!(read_profiles, module)?)?;
    module.add_function(wrap_pyfunction!(adapters, module)?)?;
    module.add_function(wrap_pyfunction!(match_points, module)?)
}
