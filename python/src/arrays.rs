//! Arrays in and out.
//!
//! numpy makes an array of whatever comes in: 64-bit floats, one row after another, aligned. An
//! array in another order would otherwise be read as it lies in memory.

use idmesh::DVec3;
use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::errors::input;

/// The rows of an array (n, 3), or of a flat one with three numbers a row.
///
/// - `what`: names the array in messages
/// - `n_rows`: the number of rows that is wanted, if it is known
///
/// # Errors
/// `InputError`: no array of real numbers, or one of another shape.
pub fn vectors(array: &Bound<'_, PyAny>, what: &str, n_rows: Option<usize>) -> PyResult<Vec<DVec3>> {
    let py = array.py();
    let numpy = py.import("numpy")?;
    let wanted = match n_rows {
        Some(n) => format!("({n}, 3) or ({},)", 3 * n),
        None => "(n, 3) or (3 n,)".to_owned(),
    };
    let no_array = |error: PyErr| input(py, &format!("{what} is no array of shape {wanted}: {}", error.value(py)));
    // A mask would be lost without a word.
    let is_masked =
        |array: &Bound<'_, PyAny>| numpy.getattr("ma")?.call_method1("is_masked", (array,))?.extract::<bool>();
    let mut masked = is_masked(array)?;
    if array.is_instance_of::<PyList>() || array.is_instance_of::<PyTuple>() {
        for row in array.try_iter()? {
            masked |= is_masked(&row?)?;
        }
    }
    if masked {
        return Err(input(py, &format!("{what} has masked entries, expected a number for each")));
    }
    let found = numpy.call_method1("asarray", (array,)).map_err(no_array)?;
    let kind: String = found.getattr("dtype")?.getattr("kind")?.extract()?;
    if !["f", "i", "u"].contains(&kind.as_str()) {
        let dtype = found.getattr("dtype")?;
        return Err(input(py, &format!("{what} holds values of type {dtype}, expected real numbers")));
    }
    let options = PyDict::new(py);
    options.set_item("dtype", "f8")?;
    options.set_item("requirements", ["C", "A"])?;
    let found = numpy.call_method("require", (found,), Some(&options)).map_err(no_array)?;
    let found = found.cast_into::<PyArrayDyn<f64>>()?;
    let shape = found.shape();
    let has_rows = match *shape {
        [n, 3] => n_rows.is_none_or(|rows| rows == n),
        [n] => n % 3 == 0 && n_rows.is_none_or(|rows| 3 * rows == n),
        _ => false,
    };
    if !has_rows {
        let lengths: Vec<String> = shape.iter().map(usize::to_string).collect();
        let comma = if shape.len() == 1 { "," } else { "" };
        return Err(input(py, &format!("{what} has the shape ({}{comma}), expected {wanted}", lengths.join(", "))));
    }
    let borrowed = found.try_readonly().map_err(|error| input(py, &format!("{what}: {error}")))?;
    let numbers = borrowed.as_slice()?;
    Ok(bytemuck::cast_slice::<f64, DVec3>(numbers).to_vec())
}

/// An array (n, 3) of vectors. The array takes the memory of the list.
pub fn rows(py: Python<'_>, vectors: Vec<DVec3>) -> Bound<'_, PyArray2<f64>> {
    let n = vectors.len();
    let numbers: Vec<f64> = bytemuck::allocation::cast_vec(vectors);
    numbers.into_pyarray(py).reshape([n, 3]).expect("a vector has three numbers")
}

/// An array (n, N) of indices. The array takes the memory of the list.
pub fn indices<const N: usize>(py: Python<'_>, cells: Vec<[u32; N]>) -> PyResult<Bound<'_, PyArray2<u32>>>
where
    [u32; N]: bytemuck::Pod,
{
    let n = cells.len();
    let numbers: Vec<u32> = bytemuck::allocation::cast_vec(cells);
    numbers.into_pyarray(py).reshape([n, N])
}

/// The vectors of an array that [`rows`] made.
pub fn vectors_of(numbers: &[f64]) -> Vec<DVec3> {
    bytemuck::cast_slice::<f64, DVec3>(numbers).to_vec()
}

/// As [`rows`], for an array into which nobody can write.
pub fn read_only_rows(py: Python<'_>, vectors: Vec<DVec3>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let n = vectors.len();
    // The array below is a view of this one, which must not be written into either.
    read_only_flat(py, bytemuck::allocation::cast_vec::<DVec3, f64>(vectors))?.reshape([n, 3])
}

/// A flat array that takes the memory of the list, which nobody can write into.
pub fn read_only_flat<T: Element>(py: Python<'_>, numbers: Vec<T>) -> PyResult<Bound<'_, PyArray1<T>>> {
    let array = numbers.into_pyarray(py);
    let options = PyDict::new(py);
    options.set_item("write", false)?;
    array.call_method("setflags", (), Some(&options))?;
    Ok(array)
}
