//! Keywords whose values are names.

use idmesh::backend::Selection;
use idmesh::mover::{Method, QualityTarget, SPRINGS, Springs};
use pyo3::prelude::*;

use crate::errors::input;

/// The value with this name.
fn named<T: Copy>(py: Python<'_>, keyword: &str, name: &str, values: &[(&str, T)]) -> PyResult<T> {
    let found = values.iter().find(|(known, _)| *known == name);
    found.map(|&(_, value)| value).ok_or_else(|| {
        let known: Vec<String> = values.iter().map(|(known, _)| format!("\"{known}\"")).collect();
        input(py, &format!("`{keyword}` is \"{name}\", expected one of {}", known.join(", ")))
    })
}

/// Where to compute.
pub fn backend(py: Python<'_>, name: &str) -> PyResult<Selection> {
    named(py, "backend", name, &[("auto", Selection::Auto), ("cpu", Selection::Cpu), ("gpu", Selection::Gpu)])
}

/// The target of local optimisation.
pub fn quality(py: Python<'_>, name: &str) -> PyResult<Option<QualityTarget>> {
    let values =
        [("original", Some(QualityTarget::Original)), ("improve", Some(QualityTarget::Improve)), ("off", None)];
    named(py, "quality", name, &values)
}

/// The method of the relaxations.
pub fn method(py: Python<'_>, name: &str) -> PyResult<Method> {
    let values = [
        ("auto", Method::Auto),
        ("multigrid", Method::Multigrid),
        ("chebyshev", Method::Chebyshev),
        ("jacobi", Method::Jacobi),
    ];
    named(py, "method", name, &values)
}

/// The volume's springs.
pub fn springs(py: Python<'_>, name: &str) -> PyResult<&'static Springs> {
    let values: Vec<_> = SPRINGS.iter().map(|springs| (springs.name, springs)).collect();
    named(py, "springs", name, &values)
}

/// A number of sweeps or steps.
pub fn count(py: Python<'_>, keyword: &str, number: i64) -> PyResult<usize> {
    let count = usize::try_from(number).ok().filter(|&count| count > 0);
    count.ok_or_else(|| input(py, &format!("`{keyword}` is {number}, expected a whole number from 1 on")))
}
